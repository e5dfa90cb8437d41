# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole or not at all, together where they belong together, and never through a link."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import socket
import tempfile
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from . import signals

try:
    import fcntl
except ImportError:  # on Windows nothing tells a dead process' folder from a living one's: none is swept
    fcntl = None

LONGEST = 240  # bytes of a name without its suffix; file systems take 255
LOCK = "lock"  # in a folder of parts, held by its process
PART = re.compile(r"\..*\.\w{8}\.part(\.gone)?", re.DOTALL)
TURNING = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}  # what changes the way in which text runs


def check_name(name: str) -> None:
    """Raise ValueError, one sentence, for a text that cannot name a file in a folder."""
    if name in ("", ".", "..") or any(map(_is_odd, name)):
        raise ValueError(f"{name!r} cannot name a file; use letters, digits, dots and dashes.")
    if len(os.fsencode(name)) > LONGEST:
        raise ValueError(f"a name of {len(name)} letters is too long for a file; use at most {LONGEST}.")


def _is_odd(letter):
    separates = letter in (os.sep, os.altsep)
    return (
        separates
        or unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp")
        or unicodedata.bidirectional(letter) in TURNING
    )


def writable_folder(folder: str | os.PathLike[str]) -> Path:
    """Make `folder` (a path) if it is missing and return it as a Path; OSError, one sentence, if it cannot be written.

    What processes that were killed have left half written in it goes.
    """
    if not str(folder):  # which Path takes for the working directory
        raise OSError("the name of the folder to write into is empty; name a folder, or . for this one.")
    try:
        os.fsencode(folder).decode()
    except UnicodeError:  # which neither Blender nor OpenImageIO takes
        raise OSError(f"cannot write into {str(folder)!a}: its name is not Unicode; name another folder.") from None
    try:
        folder = Path(folder).expanduser()
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except RuntimeError:
        raise OSError(f"cannot write into {folder}: there is no such home; name another folder.") from None
    except OSError as error:
        raise _cannot_write(folder, error) from None
    sweep(folder)
    return folder


@contextlib.contextmanager
def files_to(
    folder: str | os.PathLike[str], name: str, suffixes: Iterable[str] = ()
) -> Iterator[tuple[Path, Callable[..., list[Path]]]]:
    """Files that appear in `folder` whole or not at all.

    suffixes: those of the files that will be, as far as they are known: whether they can be is seen before the work
    Yields a folder (Path) to write parts into, which goes at the end, and finish(*files): gives the name NAME.suffix in
    `folder` to each of those files, all of them or none, and returns their paths; finish(*files, own=True) lets them
    have their own names there.
    Raises ValueError as check_name(), and OSError, one sentence, where they cannot be written.
    """
    check_name(name)
    folder = writable_folder(folder)
    check_targets([folder / f"{name}{suffix}" for suffix in suffixes])

    def finish(*files, own=False):
        return _rename(files, [folder / (file.name if own else f"{name}{file.suffix}") for file in files], part)

    # within: at the end there is room again
    with _said(folder), _part_of(folder, name) as part, _said(folder):
        yield part, finish


def whole(file: str | os.PathLike[str], write: Callable[[Path], object]) -> Path:
    """Call write(part) with the path of a temporary file, then give it the name `file`; returns the Path.

    A killed run leaves no half file under the name. Raises OSError, one sentence, where the file cannot be written.
    """
    file = Path(file)
    with contextlib.suppress(RuntimeError):  # there is no such home, as will be said
        file = file.expanduser()
    with files_to(file.parent, file.stem, [file.suffix]) as (part, finish):
        written = part / f"written{file.suffix}"
        write(written)
        return finish(written)[0]


@contextlib.contextmanager
def temporary() -> Iterator[Path]:
    """A folder for what is needed for a moment; OSError, one sentence, where the computer has no room for it."""
    with _said(None):
        place = Path(tempfile.gettempdir())
        sweep(place)
        with _part_of(place, "nimray") as folder, _said(None):
            yield folder


def is_full(folder: str | Path | None) -> bool:
    """Whether there is no room for a file in a folder."""
    try:
        return folder is not None and shutil.disk_usage(folder).free < 1 << 16
    except OSError:  # there is no such folder
        return False


@contextlib.contextmanager
def _said(folder):
    """Say in a sentence why nothing could be written into `folder`, None for the system's own for temporary files."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        # of a full disk neither Blender nor OpenImageIO says so; without a number it is a sentence of ours
        if getattr(error, "errno", None) is None and not is_full(folder or tempfile.tempdir):
            raise
        raise _cannot_write(folder, error) from None


def _cannot_write(folder, error):
    place = folder or tempfile.tempdir  # None before there is one
    reason = os.strerror(errno.ENOSPC) if is_full(place) else getattr(error, "strerror", None) or error
    if folder:
        return OSError(f"cannot write into {folder}: {reason}; name another folder.")
    return OSError(
        f"cannot write temporary files{f' in {place}' if place else ''}: {reason}; make room, or set TMPDIR."
    )


# ------------------------------------------------------------------------------------------------ names


def check_targets(targets: Iterable[Path]) -> None:
    """Raise OSError, one sentence, where one of these, which files will have, is a folder."""
    for target in targets:
        if os.path.isdir(target) and not os.path.islink(target):
            other = f"name a file in it, such as {target / 'picture'}{target.suffix}"
            raise OSError(f"{target} is a folder; {other}, or move it away.")


def _rename(files, targets, part):
    """Give the files the names `targets`, or, where one cannot have it, none of them; what was there is kept in `part`."""
    check_targets(targets)
    for file in files:
        _to_disk(file)
    done = []
    with signals.atomic():
        try:
            for number, (file, target) in enumerate(zip(files, targets, strict=True)):
                former = part / f"former.{number}"
                if number < len(files) - 1:  # after the last nothing can fail
                    _keep(target, former)
                os.replace(file, target)
                done.append((former, target))
        except BaseException:
            for former, target in done:
                if os.path.lexists(former):
                    os.replace(former, target)
                else:
                    target.unlink()
            raise
    for folder in {target.parent for target in targets}:
        with contextlib.suppress(OSError):  # Windows opens no folder
            _to_disk(folder, os.O_RDONLY)
    return targets


def _keep(target, former):
    if not os.path.lexists(target):
        return
    try:
        os.link(target, former, follow_symlinks=False)
    except (OSError, NotImplementedError):  # a file system without links
        shutil.copy2(target, former, follow_symlinks=False)


def _to_disk(path, how=os.O_RDWR):
    """See that what was written has arrived: a disk that is full, or a server, may say so only now."""
    handle = os.open(path, how | getattr(os, "O_BINARY", 0))
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):  # a file system that has no such thing
            raise
    finally:
        os.close(handle)


# ------------------------------------------------------------------------------------------------ parts


@contextlib.contextmanager
def _part_of(folder, name):
    """A new folder in `folder` for what is half written, whose lock tells that this process lives."""
    # beside the result, so that the last step is a rename; its own name is longer
    short = os.fsencode(name)[:100].decode(errors="ignore")
    with contextlib.ExitStack() as stack:
        with signals.atomic():
            held = False
            while not held:  # another process may sweep it before there is a lock
                part = Path(tempfile.mkdtemp(prefix=f".{short}.", suffix=".part", dir=folder))
                taken = stack.enter_context(contextlib.ExitStack())
                taken.enter_context(signals.cleaned_up(lambda part=part: signals.remove(part)))
                held = _is_locked(part, taken)
        with signals.interruptible():
            yield part


def _is_locked(part, stack):
    """Whether a folder of parts is locked from now on, as long as this process and the ExitStack `stack` last."""
    if not fcntl:
        return True
    try:
        lock = os.open(part / LOCK, os.O_RDWR | os.O_CREAT | os.O_EXCL)
        stack.callback(os.close, lock)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a file system without locks, where nobody sweeps
            pass
        os.write(lock, _host())
        return os.stat(part / LOCK).st_ino == os.fstat(lock).st_ino
    except FileNotFoundError:
        return False


def sweep(folder: Path) -> None:
    """Take away what processes of this computer that are dead have left half written in `folder`."""
    with contextlib.suppress(OSError):
        for part in folder.iterdir():
            if PART.fullmatch(part.name) and part.is_dir() and not part.is_symlink():
                with contextlib.suppress(OSError):
                    _sweep(part)


def _sweep(part):
    if not fcntl:
        return None
    with contextlib.suppress(OSError):  # killed before there was a lock
        return part.rmdir()
    try:
        lock = os.open(part / LOCK, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    except FileNotFoundError:
        if part.name.endswith(".gone"):  # killed while it was taken away
            signals.remove(part)
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # of another computer's process the lock may tell nothing here
        if os.read(lock, 1000) in (b"", _host()):
            signals.remove(part)
    finally:
        os.close(lock)


def _host():
    return socket.gethostname().encode(errors="replace")

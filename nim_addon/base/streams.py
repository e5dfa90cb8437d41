# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard streams: closed, full, or read by nobody, they never break what the command does; and kept quiet."""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import select
import sys
import tempfile
from collections.abc import Callable, Iterator


class _Stream(io.FileIO):
    """A stream that takes all that is written to it; what it could not pass on is told once, by close()."""

    failure: OSError | None = None  # the last OSError of any of them

    def write(self, data):
        try:
            while (written := super().write(data)) is None:  # it is full, and another made it one that does not wait
                select.select((), (self,), ())
            return written
        except BrokenPipeError:  # nobody listens any more, which is no failure: the files are still wanted
            return len(data)
        except OSError as error:
            _Stream.failure = error
            return len(data)


def prepare() -> None:
    """Make the three standard streams of this process fit to be used, whatever it was started with."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # closed: the next file to be opened would be in its place
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    if sys.stdin is None:
        sys.stdin = io.TextIOWrapper(io.FileIO(0, closefd=False))
    if os.name == "nt":  # where a console is no file
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        return
    for number, name in ((1, "stdout"), (2, "stderr")):
        former = getattr(sys, name)
        setattr(sys, name, opened(number, former.encoding if former else "utf-8"))


def opened(number: int, encoding: str = "utf-8") -> io.TextIOWrapper:
    """A text stream that writes to an open file descriptor, and closes it with itself if it is no standard one.

    It raises neither OSError nor UnicodeError: what its encoding lacks is written like \\xe9.
    """
    raw = _Stream(number, "w", closefd=number > 2)
    eager = raw.isatty() or number == 2
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding=encoding, errors="backslashreplace", line_buffering=eager)


def close() -> str | None:
    """Pass on what is still to be said; returns a sentence where some of it was lost, else None."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.flush()
    failure = _Stream.failure
    return failure and f"not all that there was to say could be written: {os.strerror(failure.errno or 0)}."


@contextlib.contextmanager
def quiet(descriptor: int = 1) -> Iterator[Callable[[], str]]:
    """Keep what a library prints on standard output (1) or error (2) away from ours; yields a function to read it."""
    _write_out()
    # in memory, where that can be: the folder for temporary files may be full
    memory = hasattr(os, "memfd_create")
    with os.fdopen(os.memfd_create("log"), "w+b") if memory else tempfile.TemporaryFile() as log:
        kept = os.dup(descriptor)
        os.dup2(log.fileno(), descriptor)
        try:
            yield lambda: (_write_out(), log.seek(0), log.read().decode(errors="replace"))[2]
        finally:
            _write_out()
            os.dup2(kept, descriptor)
            os.close(kept)


def _write_out():
    """Write what streams hold back, Python's and C's: Blender says what it does by both."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.flush()
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Files appear whole or not at all: on a full disk, over folders and links, beside other processes, after a kill."""

import contextlib
import errno
import multiprocessing
import os
import shutil
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from nim_addon.base import files

ROOT = Path(__file__).resolve().parents[2]


def hold(folder, name, words, **more):
    """A process that has begun files NAME in `folder`: it says so, then goes on with the lines `words` of Python."""
    code = f"""
import os, signal, sys
from nim_addon.base import files
with files.files_to({str(folder)!r}, {name!r}) as (part, finish):
    (part / "half.txt").write_text("half")
    print("begun", flush=True)
    {words}
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipe = subprocess.PIPE
    run = subprocess.Popen([sys.executable, "-c", code], env=environment, stdin=pipe, stdout=pipe, text=True, **more)
    assert run.stdout.readline() == "begun\n"
    return run


def names(folder):
    return sorted(file.name for file in folder.iterdir())


@pytest.mark.parametrize(
    "name", ("", ".", "..", "a/b", "../a", "/a", "a\nb", "a\x1b[31m", "a\x7f", "a\x00", "a\u202eb", "a\udcff")
)
def test_what_cannot_name_a_file_is_refused(name, tmp_path, one_sentence):
    with pytest.raises(ValueError) as raised, files.files_to(tmp_path / "new", name):
        pytest.fail("it was begun")
    one_sentence(raised.value, "cannot name a file", "use letters")
    with pytest.raises(ValueError) as raised:
        files.check_name("x" * 250)
    one_sentence(raised.value, "250 letters", "at most 240")
    assert not names(tmp_path)


def test_a_folder_whose_name_is_no_text_is_refused(tmp_path, one_sentence):
    with pytest.raises(OSError) as raised:
        files.writable_folder(os.path.join(tmp_path, "a\udcff"))
    one_sentence(raised.value, "udcff", "not Unicode", "name another folder").encode()
    assert not names(tmp_path)


@pytest.mark.parametrize("name", ("a", "a.b", " ", "日本 é \U0001f600", "x" * 240, "%d#", "$HOME"))
def test_any_other_name_is_taken(name, tmp_path):
    with files.files_to(tmp_path / "new" / "er", name) as (part, finish):
        (part / "x.txt").write_text("1")
        (part / "y.svg").write_text("2")
        made = finish(part / "x.txt", part / "y.svg")
    assert [file.read_text() for file in made] == ["1", "2"]
    assert names(tmp_path / "new" / "er") == sorted([f"{name}.txt", f"{name}.svg"])


def test_all_files_get_their_names_or_none(tmp_path, one_sentence, monkeypatch):
    (tmp_path / "a.exr").write_text("old")
    (tmp_path / "a.png").mkdir()
    for suffixes in ((), (".exr", ".png")):
        with pytest.raises(OSError) as raised, files.files_to(tmp_path, "a", suffixes) as (part, finish):
            assert not suffixes, "seen before the work"
            for suffix in (".exr", ".png", ".blend"):
                (part / f"x{suffix}").write_text("new")
            finish(*(part / f"x{suffix}" for suffix in (".exr", ".png", ".blend")))
        one_sentence(raised.value, "a.png is a folder", "move it away")
        assert names(tmp_path) == ["a.exr", "a.png"] and (tmp_path / "a.exr").read_text() == "old"

    (tmp_path / "a.png").rmdir()
    replace = os.replace

    def fail(source, target):
        if str(target).endswith(".blend"):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        replace(source, target)

    for link in (os.link, None):  # a file system without links
        with monkeypatch.context() as change:
            change.setattr(os, "replace", fail)
            if link is None:
                change.setattr(os, "link", lambda *_, **__: (_ for _ in ()).throw(OSError(errno.EPERM, "no links")))
            with pytest.raises(OSError) as raised, files.files_to(tmp_path, "a") as (part, finish):
                for suffix in (".exr", ".png", ".blend"):
                    (part / f"x{suffix}").write_text("new")
                finish(*(part / f"x{suffix}" for suffix in (".exr", ".png", ".blend")))
        one_sentence(raised.value, "cannot write into", os.strerror(errno.EIO), "name another folder")
        assert names(tmp_path) == ["a.exr"] and (tmp_path / "a.exr").read_text() == "old"


def test_nothing_is_written_through_a_link(tmp_path):
    stranger = tmp_path / "stranger"
    stranger.write_text("theirs")
    folder = tmp_path / "out"
    folder.mkdir()
    for name in ("a.txt", ".a.txt.part", ".a.part", "a.txt.part"):
        (folder / name).symlink_to(stranger)
    files.whole(folder / "a.txt", lambda part: part.write_text("ours"))
    assert stranger.read_text() == "theirs"
    assert (folder / "a.txt").read_text() == "ours" and not (folder / "a.txt").is_symlink()


def test_a_new_file_has_the_rights_that_any_has(tmp_path):
    former = os.umask(0o027)
    try:
        files.whole(tmp_path / "a.txt", lambda part: part.write_text("ours"))
    finally:
        os.umask(former)
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o640


def test_what_the_disk_did_not_take_is_known_before_the_names_change(tmp_path, monkeypatch, one_sentence):
    (tmp_path / "a.txt").write_text("old")

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError) as raised:
        files.whole(tmp_path / "a.txt", lambda part: part.write_text("new"))
    one_sentence(raised.value, f"cannot write into {tmp_path}", os.strerror(errno.ENOSPC))
    assert names(tmp_path) == ["a.txt"] and (tmp_path / "a.txt").read_text() == "old"


@pytest.mark.parametrize("error", (RuntimeError("Blender says little."), OSError("cut off."), OSError(errno.EIO, "no")))
def test_a_disk_that_is_full_is_known_before_what_filled_it_goes(error, tmp_path, monkeypatch, one_sentence):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=0 if list(tmp_path.iterdir()) else 1 << 30))
    with pytest.raises(OSError) as raised, files.files_to(tmp_path, "a"):
        raise error
    one_sentence(raised.value, f"cannot write into {tmp_path}: {os.strerror(errno.ENOSPC)}")
    monkeypatch.setattr(files.tempfile, "tempdir", str(tmp_path))
    with pytest.raises(OSError) as raised, files.temporary():
        raise error
    one_sentence(raised.value, f"temporary files in {tmp_path}: {os.strerror(errno.ENOSPC)}", "TMPDIR")


def test_a_killed_process_is_swept_and_a_living_one_is_not(tmp_path):
    dead, living = (hold(tmp_path, name, "sys.stdin.read(); finish(part / 'half.txt')") for name in ("dead", "living"))
    (tmp_path / ".mine.12345678.part").mkdir()  # a stranger's, by its name
    (tmp_path / ".mine.12345678.part" / "notes").write_text("kept")
    (tmp_path / ".film.part").write_text("kept")
    dead.kill()
    dead.communicate()
    assert len(names(tmp_path)) == 4
    files.whole(tmp_path / "other.txt", lambda part: part.write_text("ours"))
    assert [name.split(".")[1] for name in names(tmp_path)] == ["film", "living", "mine", "txt"]
    living.communicate()
    assert living.returncode == 0
    assert names(tmp_path) == [".film.part", ".mine.12345678.part", "living.txt", "other.txt"]


@pytest.mark.parametrize("state", ("empty", "locked", "gone", "halfway gone"))
def test_what_was_killed_at_any_moment_is_swept(state, tmp_path):
    part = tmp_path / (".a.0123abcd.part" + (".gone" if "gone" in state else ""))
    part.mkdir()
    if state != "empty":
        (part / "half.exr").write_text("half")
    if state in ("locked", "gone"):
        (part / files.LOCK).write_text("")
    files.writable_folder(tmp_path)
    assert not names(tmp_path)


def test_a_lock_that_is_no_file_is_not_waited_for(tmp_path):
    """The folder for temporary files is everybody's."""
    part = tmp_path / ".a.0123abcd.part"
    part.mkdir()
    os.mkfifo(part / files.LOCK)
    files.writable_folder(tmp_path)
    assert names(part) == [files.LOCK]


def test_another_computers_parts_are_left_alone(tmp_path):
    part = tmp_path / ".a.0123abcd.part"
    part.mkdir()
    (part / files.LOCK).write_text("elsewhere")
    files.writable_folder(tmp_path)
    assert names(part) == [files.LOCK]


def _write_many(folder, text):
    for _ in range(60):
        files.whole(Path(folder, "state.photons"), lambda part: part.write_text(text * 5000))


def test_processes_that_write_one_name_never_mix_it(tmp_path):
    context = multiprocessing.get_context("spawn")
    several = [context.Process(target=_write_many, args=(str(tmp_path), text)) for text in "abc"]
    for process in several:
        process.start()
    seen = set()
    while any(process.is_alive() for process in several):
        with contextlib.suppress(FileNotFoundError):
            text = (tmp_path / "state.photons").read_text()
            seen.add((len(text), *set(text)))
    for process in several:
        process.join()
    assert all(process.exitcode == 0 for process in several)
    assert seen <= {(5000, "a"), (5000, "b"), (5000, "c")} and names(tmp_path) == ["state.photons"]


@pytest.mark.parametrize("how", ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"))
def test_a_signal_leaves_nothing(how, tmp_path):
    run = hold(tmp_path, "a", "import time; time.sleep(20)")
    number = getattr(signal, how)
    run.send_signal(number)
    run.communicate(timeout=10)
    assert run.returncode == 128 + number and not names(tmp_path)


def test_the_end_waits_for_a_step(tmp_path):
    """Blender makes a folder anew that was taken away while it wrote a picture."""
    words = """from nim_addon.base import signals; import time
    with signals.atomic():
        os.kill(os.getpid(), signal.SIGTERM)
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            part.mkdir(exist_ok=True)
    time.sleep(5)"""
    run = hold(tmp_path, "a", words)
    run.communicate(timeout=10)
    assert run.returncode == 128 + signal.SIGTERM and not names(tmp_path)


def test_a_terminal_that_closes_is_ignored_where_nohup_asks_for_it(tmp_path):
    ignore = {"preexec_fn": lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)}
    run = hold(tmp_path, "a", "sys.stdin.read(); finish(part / 'half.txt')", **ignore)
    run.send_signal(signal.SIGHUP)
    run.communicate()
    assert run.returncode == 0 and names(tmp_path) == ["a.txt"]


def test_where_there_is_no_room_for_temporary_files_a_sentence_says_so(tmp_path, monkeypatch, one_sentence):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(files.tempfile, "tempdir", str(tmp_path))
    for error, free in (
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), 1 << 30),
        (RuntimeError("the compiler refused."), 0),
    ):
        monkeypatch.setattr(shutil, "disk_usage", lambda _, free=free: usage._replace(free=free))
        with pytest.raises(OSError) as raised, files.temporary() as folder:
            (folder / "x").write_text("half")
            raise error
        one_sentence(raised.value, f"temporary files in {tmp_path}: No space left on device", "TMPDIR")
        assert not names(tmp_path)
    with pytest.raises(RuntimeError, match="refused"), files.temporary():
        monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1 << 30))
        raise RuntimeError("the compiler refused.")
    monkeypatch.setattr(files.tempfile, "tempdir", str(tmp_path / "none"))
    with pytest.raises(OSError) as raised, files.temporary():
        pytest.fail("there is no such folder")
    one_sentence(raised.value, "temporary files", "TMPDIR")

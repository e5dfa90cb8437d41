# SPDX-License-Identifier: GPL-3.0-or-later
"""The command where its streams are closed, full, read by nobody, or know few letters: as a shell makes them."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RENDER = "render sphere --size 32x24 --samples 1 --out o"
# what is asked for, and the exit code that tells how that went, whoever listens
COMMANDS = {
    "fresnel --inside nim --step 1": 0,
    "render --help": 0,
    "scenes": 0,
    f"{RENDER} --progress": 0,
    "rays sphere --out o/x.svg": 0,
    "info /etc/passwd": 2,
    "render nope": 2,
}

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a shell's own")


def needs_drawing(command):
    if command.startswith("rays"):
        pytest.importorskip("matplotlib")


def shell(line, where, **environment):
    """Run a line of bash in which NIMRAY is the command."""
    line = line.replace("NIMRAY", f"{shlex.quote(sys.executable)} -m nim_addon")
    return subprocess.run(
        ["bash", "-c", line],
        cwd=where,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        timeout=120,
    )


@pytest.mark.parametrize(
    "ends", ("| head -c 1; exit ${PIPESTATUS[0]}", "| true; exit ${PIPESTATUS[0]}", ">&- 2>&- <&-")
)
@pytest.mark.parametrize("command", COMMANDS)
def test_that_nobody_listens_changes_nothing(command, ends, tmp_path):
    needs_drawing(command)
    done = shell(f"NIMRAY {command} {ends}", tmp_path)
    assert done.returncode == COMMANDS[command]
    assert done.stderr.count(b"\n") == (COMMANDS[command] == 2 and "2>&-" not in ends)
    assert not list(tmp_path.rglob(".*")), "a half file"
    if "o" in command.split():
        assert {file.name for file in (tmp_path / "o").iterdir()} == {"sphere.exr", "sphere.png"}


@pytest.mark.parametrize("command", ("fresnel --inside nim", f"{RENDER} --progress", "render --help"))
def test_that_what_it_says_is_lost_is_said(command, tmp_path):
    done = shell(f"NIMRAY {command} >/dev/full", tmp_path)
    said = b"nimray: not all that there was to say could be written: No space left on device.\n"
    assert (done.returncode, done.stderr) == (1, said)


def test_what_blender_says_is_not_among_what_is_asked_for(tmp_path):
    """It says by Python's stream that a file is saved, which a pipe gets only at the end."""
    assert shell(f"NIMRAY {RENDER} --blend", tmp_path).stdout.decode().split() == ["o/sphere.exr", "o/sphere.png"]


def test_a_closed_stream_is_no_file_that_is_written(tmp_path):
    """What is opened first has the closed one's number, and what the library says on it would be in that file."""
    assert shell(f"NIMRAY {RENDER} >&- 2>&- <&-", tmp_path).returncode == 0
    head = {file.suffix: file.read_bytes()[:4] for file in (tmp_path / "o").iterdir()}
    assert head == {".exr": b"\x76\x2f\x31\x01", ".png": b"\x89PNG"}


@pytest.mark.parametrize(
    ("encoding", "letters"),
    (("ascii", b"o/\\xe9 \\u65e5.svg"), ("latin1", b"o/\xe9 \\u65e5.svg"), ("utf-8", "o/é 日.svg".encode())),
)
def test_letters_that_a_terminal_lacks_are_escaped(encoding, letters, tmp_path):
    needs_drawing("rays")
    done = shell("NIMRAY rays sphere --out 'o/é 日.svg'", tmp_path, PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr, done.stdout.strip()) == (0, b"", letters)
    refused = shell("NIMRAY render сфера", tmp_path, PYTHONIOENCODING=encoding)
    assert refused.returncode == 2 and refused.stderr.count(b"\n") == 1


def test_a_folder_with_other_letters_than_the_systems_own(tmp_path):
    done = shell(f"NIMRAY {RENDER}/é", tmp_path, LC_ALL="C", PYTHONCOERCECLOCALE="0", PYTHONUTF8="0")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout == b"o/\\udcc3\\udca9/sphere.exr\no/\\udcc3\\udca9/sphere.png\n"
    assert {file.name for file in (tmp_path / "o" / "é").iterdir()} == {"sphere.exr", "sphere.png"}


def test_a_stream_that_does_not_wait_gets_all_that_is_said(tmp_path):
    """As another program on the same terminal may have made it."""
    (tmp_path / "slow.py").write_text("import sys, time; time.sleep(3); sys.stdout.write(sys.stdin.read())")
    (tmp_path / "small.py").write_text(
        "import fcntl, os, sys; fcntl.fcntl(1, fcntl.F_SETFL, os.O_NONBLOCK); fcntl.fcntl(1, fcntl.F_SETPIPE_SZ, 4096)\n"
        "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
    )
    python = shlex.quote(sys.executable)
    line = f"{python} small.py -m nim_addon fresnel --inside nim --step 1 --json | {python} slow.py"
    done = shell(f"{line}; exit ${{PIPESTATUS[0]}}", tmp_path)
    assert (done.returncode, done.stderr) == (0, b"")
    assert len(json.loads(done.stdout)["rows"]) == 91


def test_a_window_system_that_matplotlib_lacks_is_not_asked_for(tmp_path):
    needs_drawing("rays")
    done = shell("NIMRAY rays sphere --out a.svg", tmp_path, MPLBACKEND="nonsense")
    assert (done.returncode, done.stdout, done.stderr) == (0, b"a.svg\n", b"")

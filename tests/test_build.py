# SPDX-License-Identifier: GPL-3.0-or-later
"""build.py: every command of nimray is one of its own, what it starts ends with it, what it makes environments of."""

import importlib.util
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nim_addon import command

ROOT = Path(__file__).parents[1]

spec = importlib.util.spec_from_file_location("build", ROOT / "build.py")
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)


def test_build_runs_every_command_of_nimray():
    assert set(build.NIMRAY) == set(command.parser().commands)


# build.py without the making of an environment
BUILD = """
import importlib.util, pathlib, sys
spec = importlib.util.spec_from_file_location("build", {file!r})
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)
build.environment = lambda *_: pathlib.Path(sys.executable)
sys.exit(build.main(sys.argv[1:]))
"""
# a command that takes its time to clear away
SLOW = """
import pathlib, signal, sys, time
home = pathlib.Path(__file__).parent
def clear(number, _):
    time.sleep(1)
    (home / "cleared").touch()
    sys.exit(128 + number)
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, clear)
(home / "begun").touch()
time.sleep(20)
"""


@pytest.mark.parametrize(
    ("name", "module", "how"),
    (("render", "numpy", signal.SIGINT), ("render", "numpy", signal.SIGTERM), ("test", "pytest", signal.SIGINT)),
)
def test_ctrl_c_or_a_kill_of_build_lets_the_command_clear_away(name, module, how, tmp_path):
    (tmp_path / f"{module}.py").write_text(SLOW)
    run = subprocess.Popen(
        [sys.executable, "-c", BUILD.format(file=str(ROOT / "build.py")), name],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        start_new_session=True,
    )
    deadline = time.monotonic() + 20
    while not (tmp_path / "begun").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    # Ctrl-C reaches all of them, a kill only the one
    (os.killpg if how == signal.SIGINT else os.kill)(run.pid, how)
    assert run.wait(20) == 128 + how
    assert (tmp_path / "cleared").exists()


def test_build_of_a_scene_that_does_not_exist_is_a_usage_error():
    done = subprocess.run(
        [sys.executable, "-c", BUILD.format(file=str(ROOT / "build.py")), "blends", "spere"],
        env=os.environ.copy(),  # without what Blender itself has set, of which 5.2 would have its child speak
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and done.stdout == ""
    assert re.fullmatch(r"make.py: there is no scene 'spere'; did you mean sphere\? The .*\.\n", done.stderr)


@pytest.mark.parametrize("words", (["bake"], ["--blender", "2.8", "test"], ["--blender"]))
def test_build_refuses_what_it_does_not_know(words, capsys):
    assert build.main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1


# ---------------------------------------------------------------------------------------------------- the environment


@pytest.fixture
def pips(monkeypatch):
    """What pip would have been asked for by build.environment_in(), a list of words for each call."""
    asked = []

    def run(words, **_):
        if "venv" in words:
            python = Path(words[-1], "Scripts/python.exe" if sys.platform == "win32" else "bin/python")
            python.parent.mkdir(parents=True)
            python.touch()
        else:
            asked.append(words)
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(build.subprocess, "run", run)
    return asked


def test_a_locked_environment_has_what_the_lock_says(pips, tmp_path):
    lock = tmp_path / "lock.txt"
    lock.write_text("numpy==2.0.0 --hash=sha256:0\n")

    def times_asked(wanted=("numpy",), locked=None):
        build.environment_in(tmp_path / "env", list(wanted), lambda: sys.executable, "", locked)
        return len(pips)

    assert times_asked() == 1 and pips[-1][-1] == "numpy"
    assert times_asked() == 1
    assert times_asked(locked=lock) == 2 and pips[-1][-1] == str(lock) and "--require-hashes" in pips[-1]
    # who asks for no lock takes it as it is
    assert times_asked() == times_asked(locked=lock) == 2
    lock.write_text("numpy==2.0.1 --hash=sha256:1\n")
    assert times_asked() == 2
    assert times_asked(locked=lock) == 3
    assert times_asked(["numpy", "scipy"]) == 4


@pytest.mark.parametrize("blender", ("4.2", "4.5", "5.0", "5.2"))
def test_the_locks_name_all_that_is_wanted_by_version_and_hash(blender):
    lines = build.locked_packages(blender).read_text().splitlines()[1:]
    pinned = {}
    for line in lines:
        name, version = re.fullmatch(r"(\S+)==(\S+) --hash=sha256:[0-9a-f]{64}", line).groups()
        pinned[re.sub("[-_.]+", "-", name).lower()] = version
    for need in build.packages(blender):
        assert re.sub("[-_.]+", "-", re.match(r"[\w.-]+", need)[0]).lower() in pinned, need
    assert pinned["bpy"].startswith(blender + ".")

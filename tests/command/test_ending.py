# SPDX-License-Identifier: GPL-3.0-or-later
"""How the command ends before its time: at once, with one line, and with nothing left behind."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from nim_addon.base import signals
from nim_addon.command import blender

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("how", (signal.SIGINT, signal.SIGTERM))
def test_ctrl_c_or_a_kill_stops_at_once_and_leaves_nothing(how, tmp_path):
    run = subprocess.Popen(
        [sys.executable, "-m", "nim_addon", "render", "sphere", "--samples", "100000", "--out", str(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob(".sphere.*.part")) and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(1.5)
    run.send_signal(how)
    out, err = run.communicate(timeout=20)
    assert run.returncode == 128 + how
    assert out == ""
    assert err == "nimray: stopped.\n"
    assert not list(tmp_path.iterdir())


def standing_in(folder, module, how):
    """Make a module that, as it is imported, sends a signal to its own process and holds on to any exception."""
    (folder / f"{module}.py").write_text(f"""
import os, time
try:
    os.kill(os.getpid(), {how:d})
    time.sleep(20)
except BaseException:
    pass
""")


@pytest.mark.parametrize("how", (signal.SIGINT, signal.SIGTERM))
@pytest.mark.parametrize("module", ("numpy", "bpy"))
def test_ctrl_c_or_a_kill_stops_what_still_loads(nimray, module, how, tmp_path):
    """Their imports swallow exceptions: the render went on to its end."""
    standing_in(tmp_path, module, how)
    done = nimray("render", "sphere", where=tmp_path, instead=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (128 + how, "", "nimray: stopped.\n")


@pytest.mark.parametrize("how", (signal.SIGINT, signal.SIGTERM))
@pytest.mark.parametrize(
    ("command", "where"), (("figures 5.8 --out new", "new/5.8"), ("rays sphere --out new/a.svg", "new"))
)
def test_ctrl_c_or_a_kill_leaves_nothing_of_a_drawing(nimray, command, where, how, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    (tmp_path / "sitecustomize.py").write_text(f"""
import os, signal, sys, time
class Late:
    # the last thing that a drawing is written with
    def find_spec(self, name, path, target=None):
        if name == "matplotlib.backends.backend_svg":
            os.kill(os.getpid(), {how:d})
            time.sleep(20)
sys.meta_path.insert(0, Late())
""")
    done = nimray(*command.split(), where=work, instead=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (128 + how, "", "nimray: stopped.\n")
    assert not list((work / where).rglob("*"))


@pytest.mark.parametrize(
    ("command", "module", "how"),
    (
        ("scenes", None, 0),
        ("scenes", "nim_addon.scenes", signal.SIGHUP),
        ("scenes", "nim_addon.scenes", signal.SIGKILL),
        ("verify", "nim_addon.cycles.verify", signal.SIGINT),
    ),
)
def test_nothing_stays_in_the_temporary_folder(nimray, command, module, how, tmp_path):
    """Blender makes a folder there, which it takes away only where it ends by itself."""
    (tmp_path / "tmp").mkdir()
    if module:
        (tmp_path / "sitecustomize.py").write_text(f"""
import os, sys, time
class Late:
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), {how:d})
            time.sleep(20)
sys.meta_path.insert(0, Late())
""")
    done = nimray(command, where=tmp_path, instead=tmp_path, temporary=tmp_path / "tmp")
    if how == signal.SIGKILL:  # the next run takes it away
        assert list((tmp_path / "tmp").iterdir())
        done, how = nimray(command, temporary=tmp_path / "tmp"), 0
    assert done.returncode == (128 + how if how else 0)
    assert not list((tmp_path / "tmp").iterdir())


def test_a_second_import_of_blender_makes_no_folder(empty_file, monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with signals.interruptible():
        assert signals.watched()
        blender.load()
        assert not list(tmp_path.iterdir())


def test_ctrl_c_while_python_learns_of_signals_stops_too(nimray, tmp_path):
    (tmp_path / "sitecustomize.py").write_text("""
import os, sys
class Early:
    def find_spec(self, name, path, target=None):
        if name == "enum":  # of the module signal
            os.kill(os.getpid(), 2)
sys.meta_path.insert(0, Early())
""")
    done = nimray("scenes", where=tmp_path, instead=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "nimray: stopped.\n")


def test_a_signal_after_the_work_is_done_is_none(nimray, tmp_path):
    """What Python takes down at its end runs without handlers: Ctrl-C then ended `rays` with -2."""
    (tmp_path / "sitecustomize.py").write_text("""
import os, signal, sys
class Last:
    def __del__(self, kill=os.kill, pid=os.getpid(), number=signal.SIGINT):
        kill(pid, number)
sys.last = Last()
""")
    done = nimray("rays", "slab", "--out", tmp_path / "slab.svg", where=tmp_path, instead=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")

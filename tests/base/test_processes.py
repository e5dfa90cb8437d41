# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender: it runs a module of the package, and outlives neither this process nor patience."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from nim_addon.base import processes

ROOT = Path(__file__).parents[2]
# starts a render of hours, and is killed as soon as that has said that it renders
KILLED = """
import os, signal, subprocess, sys
from nim_addon.base.processes import second_blender
words = ["render", "sphere", "--samples", "100000", "--size", "64x48", "--progress", "--out", sys.argv[1]]
child = second_blender("__main__", words, binary="", stdout=subprocess.PIPE)
print(child.stdout.readline(), end="", flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_it_runs_a_module_with_words():
    words = ["fresnel", "--inside", "water", "--step", "90", "--csv"]
    process = processes.second_blender("__main__", words, binary="", stdout=subprocess.PIPE)
    said = process.stdout.read()
    assert (process.wait(60), said.split("\n")[0]) == (0, "theta_i,theta_t,R_s,R_p,R,T")


def test_it_ends_with_the_process_that_started_it(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-c", KILLED, str(tmp_path)]
    done = subprocess.run(words, env=environment, stdout=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == -signal.SIGKILL
    assert done.stdout.startswith('{"done": 0')
    deadline = time.monotonic() + 20
    while list(tmp_path.iterdir()) and time.monotonic() < deadline:  # what is half written goes at the end
        time.sleep(0.1)
    assert not list(tmp_path.iterdir())


def test_what_does_not_end_by_itself_is_killed():
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], stdin=subprocess.PIPE)
    processes.end(process, 0.1)
    assert process.returncode == -signal.SIGKILL

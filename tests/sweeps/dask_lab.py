# SPDX-License-Identifier: GPL-3.0-or-later
"""Schedulers and workers of Dask as processes, and what is known of processes by /proc."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = {"PYTHONPATH": str(ROOT)}
ENVIRONMENT = {**os.environ, **PACKAGE}
SCHEDULER = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
WORKER = ("--host", "127.0.0.1", "--no-dashboard")


def standing(*words, before=(), protocol="tcp", how="-m"):
    """A process of Dask, and the address that it says it listens on; `before`: words that start it."""
    process = subprocess.Popen(
        [*before, sys.executable, how, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, **PACKAGE},
    )
    for line in process.stderr:
        if f"{protocol}://" in line:
            return process, f"{protocol}://" + line.rpartition(f"{protocol}://")[2].strip()
    raise AssertionError("it ended")


def end(*processes):
    """Let processes end as by Ctrl-C."""
    for process in processes:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()


def pids_of(pid):
    """The processes that a process has started, and those that these have, by /proc."""
    found = []
    with contextlib.suppress(OSError):  # it, or one of its threads, has ended meanwhile
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                found += [int(child), *pids_of(child)]
    return list(dict.fromkeys(found))


def runs(pid, words):
    """Whether words are in the command line of a process."""
    try:
        return words in Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return False


@contextlib.contextmanager
def within(seconds):
    """Within, what waits longer fails, rather than for ever."""

    def late(*_):
        raise AssertionError(f"it waits for more than {seconds} s")

    former = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)


def wait(condition, seconds):
    """Until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)

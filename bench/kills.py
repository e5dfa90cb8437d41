# SPDX-License-Identifier: GPL-3.0-or-later
"""`kill -9` of anything in a sweep at random moments: the command, its Blenders, a worker of Dask, its scheduler.

What is done must be whole and stay as it is, nothing may run on without the command, and the same command must end the sweep.
Words: how many kills (50), and what random numbers begin with (1). Linux only.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import random
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import OpenImageIO
import psutil

from nim_addon.base import signals
from nim_addon.sweeps import plan, results
from tests.sweeps.dask_lab import SCHEDULER, WORKER, standing

TASKS = "n=-1.1:-2:-0.1"  # ten
SWEEP = ["sweep", "sphere", "--vary", TASKS, "--size", "160x120", "--samples", "16", "--backend", "nodes", "--progress"]
ENGINES = {
    "local": [],
    "local, two workers": ["--workers", "2"],
    "dask": ["--on", "dask", "--workers", "2"],
    "dask=tcp": ["--on", "dask={}"],
}
ONE_AFTER_ANOTHER = 3  # kills of one sweep, before it is let end
LATE = 20  # seconds in which what lost its command must have ended


class Standing:
    """A scheduler of Dask and a worker, as processes; started anew where one was killed."""

    def __init__(self):
        self.processes, self.address = [], ""

    def stand(self):
        """Its address."""
        if not self.processes or any(process.poll() is not None for process in self.processes):
            self.end()
            scheduler, self.address = standing(*SCHEDULER)
            self.processes = [scheduler, self._worker()]
        return self.address

    def mend(self):
        """Start another worker, if the one was killed: a sweep waits for it."""
        if self.processes and self.processes[0].poll() is None and self.processes[1].poll() is not None:
            self.processes[1] = self._worker()

    def _worker(self):
        return standing("distributed.cli.dask_worker", self.address, "--nthreads", "1", *WORKER)[0]

    def end(self):
        """With all that they have started."""
        for process in self.processes:
            for one in _with_all_below(process.pid):
                _kill(one)
            process.wait()
        self.processes = []


def _with_all_below(pid):
    try:
        process = psutil.Process(pid)
        return [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def _kill(process):
    with contextlib.suppress(psutil.NoSuchProcess):
        process.send_signal(signal.SIGKILL)


def _victim(chance, command, others):
    """The command, once in three times, else one of what it or a scheduler has started."""
    others = [one for one in others if one.pid != command.pid and _ours(one)]
    return chance.choice(others) if others and chance.random() < 2 / 3 else psutil.Process(command.pid)


def _ours(process):
    """Whether it is one that a sweep needs: Python that has begun to run something, no helper of multiprocessing."""
    try:
        words = " ".join(process.cmdline())
    except psutil.Error:
        return False
    return "nim_addon" in words or "dask" in words or "spawn_main" in words


def start(folder, engine):
    """The command, which is to carry out the sweep in a folder."""
    words = [sys.executable, "-m", "nim_addon", *SWEEP, *engine, "--out", str(folder)]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def done(folder):
    """{its file: (its hash, when it was written)} of all that is done, and a list of what is done but not whole."""
    found, broken = {}, []
    listed = folder / "plan.jsonl"
    tasks = plan.read(listed) if listed.exists() else []
    for task in tasks:
        if results.made(folder, task):
            for file in (image := results.image_of(folder, task)), image.with_suffix(".png"):
                found[file] = hashlib.sha256(file.read_bytes()).hexdigest(), file.stat().st_mtime_ns
                read = OpenImageIO.ImageBuf(str(file))
                if not read.read(force=True) or read.has_error:
                    broken.append(file)
    return found, broken


def main(count: int = 50, seed: int = 1) -> int:
    """Kill, look, go on; prints each kill, and at the end what was wrong; 0 where nothing was."""
    chance, faults, killed, cluster = random.Random(seed), [], 0, Standing()
    try:
        with tempfile.TemporaryDirectory() as work:
            for number in itertools.count():
                if killed >= count:
                    break
                name = list(ENGINES)[number % len(ENGINES)]
                folder, kept = Path(work) / str(number), {}
                for _ in range(ONE_AFTER_ANOTHER):
                    found = _one(chance, name, folder, kept, cluster)
                    killed += found is not None
                    faults += found or []
                process = start(folder, _words(name, cluster))
                said = process.communicate(timeout=600)[1]
                if process.returncode:
                    faults.append(f"{name}: the same command ended with {process.returncode}: {said[-300:]}")
                faults += _changed(name, folder, kept)
                if len(kept) != 20:
                    faults.append(f"{name}: {len(kept)} files of 20")
                faults += [f"{name}: {file.name} is left" for file in folder.rglob(".*.part*")]
    finally:
        cluster.end()
    print(*faults, f"{killed} kills, {len(faults)} faults", sep="\n", flush=True)
    return bool(faults)


def _words(name, cluster):
    return [word.format(cluster.stand()) if "{}" in word else word for word in ENGINES[name]]


def _one(chance, name, folder, kept, cluster):
    """Start it, kill something of it, and wait until it has ended; what was wrong, None where it had ended before."""
    process = start(folder, _words(name, cluster))
    try:
        process.communicate(timeout=chance.uniform(0.3, 8))
        return None
    except subprocess.TimeoutExpired:
        pass
    client = _with_all_below(process.pid)
    beside = [one for each in cluster.processes for one in _with_all_below(each.pid)] if name == "dask=tcp" else []
    victim = _victim(chance, process, client + beside)
    what = "command" if victim.pid == process.pid else " ".join(victim.cmdline()[1:4])[-60:]
    _kill(victim)
    (process if victim.pid == process.pid else victim).wait(LATE)
    if name == "dask=tcp":
        cluster.mend()
    faults = _changed(name, folder, kept)
    said = process.communicate(timeout=600)[1]
    faults += _changed(name, folder, kept)
    print(f"{name}: killed {what}; {len(kept) // 2} pictures of 10, exit code {process.returncode}", flush=True)
    if "Traceback" in said:
        faults.append(f"{name}: a traceback after {what}: {said[-1500:]}")
    _, alive = psutil.wait_procs([one for one in client if one.pid != process.pid], LATE)
    return faults + [f"{name}: {one.pid} runs on after {what}" for one in alive]


def _changed(name, folder, kept):
    """What is not as it was as it was done; kept: by file what that was, to which what is new is added."""
    found, broken = done(folder)
    faults = [f"{name}: {file} was made twice, or is gone" for file, was in kept.items() if found.get(file) != was]
    kept.update(found)
    return faults + [f"{name}: {file} is not whole" for file in broken]


if __name__ == "__main__":
    signals.leave(main(*map(int, sys.argv[1:])))  # Blender as a module may hang as it exits

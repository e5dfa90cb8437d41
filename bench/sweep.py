# SPDX-License-Identifier: GPL-3.0-or-later
"""Many small renders: a bare loop in one process, `nimray sweep` here, and by Dask; what a task costs beside its render.

Times are of the clock, since several processes wait for each other; what is compared alternates. With `scale`, a simulation
of many workers by the times that were measured: where the scheduler is too slow, and how many tasks a job should have.
"""

from __future__ import annotations

import functools
import heapq
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import bpy

from nim_addon.base import signals
from nim_addon.renders.request import Request
from nim_addon.sweeps import cluster, local, run, state
from nim_addon.sweeps.plan import Task

COUNT, ROUNDS = 24, 3
SMALL = {"size": (128, 96), "samples": 32, "caustics": "path", "backend": "osl"}
TINY = {"size": (8, 6), "samples": 1, "caustics": "path", "backend": "nodes"}


def tasks(options, count=COUNT):
    """Spheres of so many indices."""
    return [Task(Request.of("sphere", {"n": f"{-1.1 - 0.05 * k:.3f}"}, **options)) for k in range(count)]


def by(engine, made):
    """Seconds that an engine takes for tasks, and until the first has ended."""
    merging = functools.partial(local.carry_out, binary=bpy.app.binary_path)
    with tempfile.TemporaryDirectory() as name, state.alone(name) as folder:
        (folder / "plan.jsonl").touch()  # which workers look for
        started, first = time.monotonic(), []
        problems = run.carry_out(
            made, folder, engine, state.State(folder, 0), merging, lambda *_: first.append(time.monotonic() - started)
        )
        assert not problems, problems
        return time.monotonic() - started, first[0]


LOOP = """
import sys, time
import bpy
from nim_addon.sweeps.plan import Task
from bench_sweep import tasks, SMALL, TINY
made = tasks({options})
for task in made:
    task.request.render(sys.argv[1], task.key)
"""


def bare_loop(options):
    """Seconds of the same renders in one process that does nothing else, its start counted in."""
    code = LOOP.format(options=options).replace(
        "from bench_sweep", f"sys.path.insert(0, {str(Path(__file__).parent)!r})\nfrom sweep"
    )
    with tempfile.TemporaryDirectory() as name:
        started = time.monotonic()
        subprocess.run(
            [sys.executable, "-c", code, name], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        return time.monotonic() - started


def simulated(count, workers, seconds, each, chunk, cost):
    """Part of the workers' time that is rendering: a scheduler hands out chunks one after the other, `cost` s for each."""
    free = [0.0] * min(workers, -(-count // chunk))
    clock = 0.0
    for first in range(0, count, chunk):
        ready = heapq.heappop(free)
        clock = max(clock, ready) + cost  # the scheduler is busy meanwhile
        heapq.heappush(free, clock + min(chunk, count - first) * (seconds + each))
    return count * seconds / workers / max(free)


def scale():
    """Print where a scheduler of the measured cost saturates."""
    print(
        "100,000 tasks on 1,000 workers; 0.8 ms of the scheduler and 20 ms of a worker for each job: part that is rendering"
    )
    print(f"{'s each':>8}" + "".join(f"{chunk:>8}" for chunk in (1, 2, 5, 10, 25, 50, 100)) + "   tasks a job")
    for seconds in (0.2, 0.6, 1.2, 5.0, 30.0):
        parts = (simulated(100_000, 1000, seconds, 0.02, chunk, 0.0008) for chunk in (1, 2, 5, 10, 25, 50, 100))
        print(f"{seconds:>8g}" + "".join(f"{part:>8.0%}" for part in parts))


def main():
    """Print the ratios."""
    if "scale" in sys.argv:
        return scale()
    here = functools.partial(local.carry_out, binary=bpy.app.binary_path)
    two = functools.partial(here, workers=2)
    dask = cluster.engine("dask", workers=2)
    loops, ours, twos, dasks, firsts = [], [], [], [], []
    for _ in range(ROUNDS):
        loops.append(bare_loop("SMALL"))
        took, first = by(here, tasks(SMALL))
        ours.append(took)
        firsts.append(first)
        twos.append(by(two, tasks(SMALL))[0])
        dasks.append(by(dask, tasks(SMALL))[0])
    pairs = [mine / loop for mine, loop in zip(ours, loops, strict=True)]
    beside = [without / with_ for without, with_ in zip(twos, dasks, strict=True)]
    tiny = [by(here, tasks(TINY))[0] for _ in range(ROUNDS)]
    loop = [bare_loop("TINY") for _ in range(ROUNDS)]
    each = (min(tiny) - min(loop)) / COUNT
    print(
        f"{COUNT} spheres of {SMALL['size'][0]} x {SMALL['size'][1]} pixels, {SMALL['samples']} samples, median of {ROUNDS} pairs"
    )
    print(f"{'sweep here / bare loop, its start counted in both':<58}{statistics.median(pairs):>8.2f}  at most 1.05")
    print(f"{'two workers here / two workers of Dask':<58}{statistics.median(beside):>8.2f}  at least 0.95")
    print(f"{'a task beside its render, ms':<58}{1000 * each:>8.0f}  at most 50")
    print(f"{'start to first result, s':<58}{min(firsts):>8.1f}  at most 4")
    return None


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    signals.leave(0)  # Blender as a module may hang as it exits

# SPDX-License-Identifier: GPL-3.0-or-later
"""Many small renders: a bare loop in one process, `nimray sweep` here, and by Dask; what a task costs beside its render.

Times are of the clock, since several processes wait for each other; what is compared alternates. With `scale`, a simulation
of many workers by the times that were measured: where the scheduler is too slow, and how many tasks a job should have.
"""

from __future__ import annotations

import heapq
import statistics
import subprocess
import sys
import tempfile
import time

COUNT, ROUNDS = 24, 3
VALUES = "n=-1.1:-2.25:-0.05"  # so many
SMALL = {"size": (128, 96), "samples": 32, "caustics": "path", "backend": "osl"}
TINY = {"size": (8, 6), "samples": 1, "caustics": "path", "backend": "nodes"}


def by(options, *words):
    """Seconds that `nimray sweep` takes with these words, a process, and until its first result."""
    width, height = options["size"]
    sweep = ["sweep", "sphere", "--vary", VALUES, "--size", f"{width}x{height}", "--samples", str(options["samples"])]
    more = ["--caustics", "path", "--backend", options["backend"], "--progress", *words]
    with tempfile.TemporaryDirectory() as folder:
        started = time.monotonic()
        run = [sys.executable, "-m", "nim_addon", *sweep, *more, "--out", folder]
        process = subprocess.Popen(run, stdout=subprocess.PIPE, text=True)
        first = next(time.monotonic() - started for line in process.stdout if line.startswith('{"key"'))
        process.stdout.read()
        assert process.wait() == 0
        return time.monotonic() - started, first


LOOP = """
import sys
from nim_addon.base import signals
from nim_addon.renders.request import Request
for k in range({count}):
    made = Request.of("sphere", {{"n": str(round(-1.1 - 0.05 * k, 3))}}, **{options})
    made.render(sys.argv[1], str(k))
signals.leave(0)  # Blender as a module may hang as it exits
"""


def bare_loop(options):
    """Seconds of the same renders in one process that does nothing else, its start counted in."""
    with tempfile.TemporaryDirectory() as name:
        code, started = LOOP.format(count=COUNT, options=options), time.monotonic()
        subprocess.run([sys.executable, "-c", code, name], check=True, stdout=subprocess.DEVNULL)
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
    loops, ours, twos, dasks, firsts = [], [], [], [], []
    for _ in range(ROUNDS):
        loops.append(bare_loop(SMALL))
        took, first = by(SMALL)
        ours.append(took)
        firsts.append(first)
        twos.append(by(SMALL, "--workers", "2")[0])
        dasks.append(by(SMALL, "--on", "dask", "--workers", "2")[0])
    pairs = [mine / loop for mine, loop in zip(ours, loops, strict=True)]
    beside = [without / with_ for without, with_ in zip(twos, dasks, strict=True)]
    tiny = [by(TINY)[0] for _ in range(ROUNDS)]
    loop = [bare_loop(TINY) for _ in range(ROUNDS)]
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

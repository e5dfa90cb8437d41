# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command says: how far it is, to a person at a terminal or as JSON lines, what it wrote, and what went wrong."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ..base.streams import opened
from ..base.text import counted, duration, printable, said_by

USAGE, FAILURE = 2, 1  # exit codes: what was asked for makes no sense, or could not be done
LONGEST_SAID = 600  # letters of a sentence

# What a render reports to: called with (samples done, samples in all, seconds left or None).
Progress = Callable[[int, int, float | None], None]
# What the tracing of photons reports to: called with (passes done, passes in all).
Tracing = Callable[[int, int], None]


class Failure(Exception):
    """What was asked for could not be done: exit code 1."""


def sentence(error: Exception) -> str:
    """The text of an error, also of one that the system or Blender raised: without numbers and brackets."""
    if isinstance(error, OSError) and error.errno:
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror}."
    return said_by(error).removeprefix("Error: ")


def complain(error: object, code: int) -> int:
    """Say on standard error what is wrong; returns the exit code."""
    said = printable(error)
    if len(said) > LONGEST_SAID:  # of a word of thousands of letters, its ends will do
        said = f"{said[: LONGEST_SAID // 2]} ... {said[-LONGEST_SAID // 4 :]}"
    note(said)
    return code


def note(text: str) -> None:
    """Say something on standard error, beside what was asked for."""
    print(f"nimray: {printable(text)}", file=sys.stderr)


def at_terminal(arguments: argparse.Namespace) -> bool:
    """Whether a person sees at a terminal how far it is, who asked neither for --quiet nor for --json."""
    return sys.stderr.isatty() and not (arguments.quiet or arguments.json)


class Output:
    """What a render of one or more images tells: nothing, files and a line for a person, or JSON (--progress)."""

    def __init__(self, images: int, *, quiet: bool = False, progress: bool = False) -> None:
        """Of so many images, with --quiet or --progress."""
        self.images, self.quiet, self.progress = images, quiet, progress
        self.shown = sys.stderr.isatty() and not (quiet or progress)
        self.files: list[str] = []
        self.frame: int | None = None  # the number of the image that is being made, in a sequence
        self.started = time.monotonic()

    def __enter__(self) -> Output:
        # a copy: while Blender renders, standard output is kept clear of what it says
        self.stream = opened(os.dup(1)) if self.progress else None
        return self

    def __exit__(self, *_) -> None:
        if self.stream:
            self.stream.close()

    @contextlib.contextmanager
    def showing(self, name: str, samples: int) -> Iterator[Progress | None]:
        """While one image renders: yields what render() calls as its progress, or None."""
        if self.progress:
            yield self._reporter(samples)
        elif self.shown:
            order = f" ({len(self.files) // 2 + 1} of {self.images})" if self.images > 1 else ""
            with Bar(name + order) as bar:
                yield bar
        else:
            yield None

    @contextlib.contextmanager
    def tracing(self, samples: int, photons: int) -> Iterator[Tracing | None]:
        """While the photons of one image of so many samples are traced: yields what bake() calls as its progress, or None."""
        if self.progress:
            done, total = len(self.files) // 2 * samples, self.images * samples

            def report(passes: int, of: int) -> None:
                traced = photons * passes // of
                self._print({"done": done, "total": total, "left": None, "photons": traced, **self._which()})

            yield report
        elif self.shown:
            million, started = photons / 1e6, time.monotonic()
            with Bar("photons", "million") as bar:

                def show(passes: int, of: int) -> None:
                    left = (time.monotonic() - started) / passes * (of - passes) if passes else None
                    bar(round(million * passes / of), max(round(million), 1), left)

                yield show
        else:
            yield None

    def _which(self) -> dict:
        return {"frame": self.frame, "frames": self.images} if self.frame is not None else {}

    def _reporter(self, samples: int) -> Progress:
        finished, started = len(self.files) // 2, time.monotonic()
        which = self._which()

        def report(done: int, _: int, left: float | None) -> None:
            if left is not None:  # the images to come take as long as this one
                left += (time.monotonic() - started + left) * (self.images - finished - 1)
            self._print({"done": finished * samples + done, "total": self.images * samples, "left": left, **which})

        report(0, samples, None)
        return report

    def written(self, files: Iterable[Path]) -> None:
        """These files are there."""
        files = list(files)
        self.files += map(str, files)
        if not (self.quiet or self.progress):
            for file in files:
                print(file, flush=True)

    def end(self, files: Iterable[Path], size: Iterable[int], samples: int) -> None:
        """These files are the last, of renders of that size (width and height, pixels) and so many samples."""
        self.written(files)
        if self.progress:
            self._print({"files": self.files})
        elif not self.quiet and sys.stdout.isatty():
            width, height = size
            seconds = time.monotonic() - self.started
            print(f"{width} x {height}, {counted(samples, 'sample')}, {seconds:.1f} s")

    def _print(self, message: dict) -> None:
        print(json.dumps(message), file=self.stream, flush=True)


class Bar:
    """A line on the terminal that tells how far a render is; between Cycles' reports, rare ones, it goes by the clock."""

    WIDTH = 28

    def __init__(self, name: str, unit: str = "samples") -> None:
        """Of something with a name, which is counted in units; it is drawn within a `with` block."""
        self.name, self.unit = name, unit
        self.report: tuple[int, int, float | None, float] | None = None
        self.over = threading.Event()
        self.ticker = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> Bar:
        self.ticker.start()
        return self

    def __exit__(self, *_) -> None:
        self.over.set()
        self.ticker.join()
        print("\r" + " " * (len(self.name) + self.WIDTH + 46) + "\r", end="", file=sys.stderr, flush=True)

    def __call__(self, done: int, total: int, left: float | None) -> None:
        """So many of all are done, and it takes `left` seconds more, if that is known."""
        self.report = done, total, left, time.monotonic()

    def _tick(self) -> None:
        while not self.over.wait(0.25):
            if self.report:
                done, total, left, when = self.report
                if left:
                    passed = min((time.monotonic() - when) / left, 1.0)
                    done, left = done + int((total - done) * passed), left * (1 - passed)
                self._draw(done, total, left)

    def _draw(self, done: int, total: int, left: float | None) -> None:
        full = self.WIDTH * done // total
        bar = "#" * full + "." * (self.WIDTH - full)
        wait = "" if left is None else f", {duration(left)} left"
        line = f"{self.name} [{bar}] {done}/{total} {self.unit}{wait}"
        print(f"\r{line:<{len(self.name) + self.WIDTH + 46}}", end="", file=sys.stderr, flush=True)

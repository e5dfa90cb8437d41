# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a render is, told to a person at a terminal, or to a program."""

import contextlib
import json
import os
import sys
import threading
import time

from .streams import opened


class Output:
    """What a render of one or more images tells: nothing, files and a line for a person, or JSON (--progress)."""

    def __init__(self, arguments, images):
        self.quiet, self.progress, self.images = arguments.quiet, arguments.progress, images
        self.files = []
        self.frame = None  # the number of the image that is being made, in a sequence
        self.started = time.monotonic()

    def __enter__(self):
        # a copy: while Blender renders, standard output is kept clear of what it says
        self.stream = opened(os.dup(1)) if self.progress else None
        return self

    def __exit__(self, *_):
        if self.stream:
            self.stream.close()

    @contextlib.contextmanager
    def showing(self, name, samples):
        """While one image renders: yields what render() calls as its progress, or None."""
        if self.progress:
            yield self._reporter(samples)
        elif self.quiet or not sys.stderr.isatty():
            yield None
        else:
            order = f" ({len(self.files) // 2 + 1} of {self.images})" if self.images > 1 else ""
            bar = Bar(name + order)
            try:
                yield bar
            finally:
                bar.end()

    @contextlib.contextmanager
    def tracing(self, made):
        """While the photons of one image are traced: yields what bake() calls as its progress, or None."""
        if self.progress:
            which = {"frame": self.frame, "frames": self.images} if self.frame else {}
            done, total = len(self.files) // 2 * made["samples"], self.images * made["samples"]

            def report(passes, of):
                photons = made["photons"] * passes // of
                self._print({"done": done, "total": total, "left": None, "photons": photons, **which})

            yield report
        elif self.quiet or not sys.stderr.isatty():
            yield None
        else:
            bar, million, started = Bar("photons", "million"), made["photons"] / 1e6, time.monotonic()

            def show(passes, of):
                left = (time.monotonic() - started) / passes * (of - passes) if passes else None
                bar(round(million * passes / of), max(round(million), 1), left)

            try:
                yield show
            finally:
                bar.end()

    def _reporter(self, samples):
        finished, started = len(self.files) // 2, time.monotonic()
        which = {"frame": self.frame, "frames": self.images} if self.frame else {}

        def report(done, _, left):
            if left is not None:  # the images to come take as long as this one
                left += (time.monotonic() - started + left) * (self.images - finished - 1)
            self._print({"done": finished * samples + done, "total": self.images * samples, "left": left, **which})

        report(0, samples, None)
        return report

    def written(self, files):
        """These files are there."""
        self.files += map(str, files)
        if not (self.quiet or self.progress):
            for file in files:
                print(file, flush=True)

    def end(self, files, made):
        """These files are the last, of renders with that record."""
        self.written(files)
        if self.progress:
            self._print({"files": self.files})
        elif not self.quiet and sys.stdout.isatty():
            width, height = made["size"]
            seconds = time.monotonic() - self.started
            print(f"{width} x {height}, {made['samples']} samples, {seconds:.1f} s")

    def _print(self, message):
        print(json.dumps(message), file=self.stream, flush=True)


class Bar:
    """A line on the terminal that tells how far a render is; between Cycles' reports, rare ones, it goes by the clock."""

    WIDTH = 28

    def __init__(self, name, unit="samples"):
        self.name, self.unit = name, unit
        self.report = None
        self.over = threading.Event()
        self.ticker = threading.Thread(target=self._tick, daemon=True)
        self.ticker.start()

    def __call__(self, done, total, left):
        self.report = done, total, left, time.monotonic()

    def _tick(self):
        while not self.over.wait(0.25):
            if self.report:
                done, total, left, when = self.report
                if left:
                    passed = min((time.monotonic() - when) / left, 1.0)
                    done, left = done + int((total - done) * passed), left * (1 - passed)
                self._draw(done, total, left)

    def _draw(self, done, total, left):
        full = self.WIDTH * done // total
        bar = "#" * full + "." * (self.WIDTH - full)
        wait = "" if left is None else f", {duration(left)} left"
        line = f"{self.name} [{bar}] {done}/{total} {self.unit}{wait}"
        print(f"\r{line:<{len(self.name) + self.WIDTH + 46}}", end="", file=sys.stderr, flush=True)

    def end(self):
        """Clear the line."""
        self.over.set()
        self.ticker.join()
        print("\r" + " " * (len(self.name) + self.WIDTH + 46) + "\r", end="", file=sys.stderr, flush=True)


def duration(seconds):
    """Seconds as a person reads them: 1:30, or 3 h 44 min."""
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes}:{seconds:02}"

# SPDX-License-Identifier: GPL-3.0-or-later
"""What the comparisons with other renderers share: a renderer that answers in a process of its own, and what its renders were."""

import json
import subprocess
import tempfile

import numpy as np


class Missing(Exception):
    """A peer is not installed; one sentence says how to get it."""


class Peer:
    """A renderer in a process of its own, which keeps what it has compiled.

    name:    for people
    command: words; the program says "ready", and answers each line "WORD WORD SEED" by a line of JSON: the .npy `file` of
             the picture, and the seconds of its rendering, `clock` and `processors`
    Raises Missing where it does not start.
    """

    def __init__(self, name, command):
        self.name, self.log = name, tempfile.TemporaryFile("w+")  # noqa: SIM115 it lives as long as the process
        try:
            self.process = subprocess.Popen(
                list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True
            )
        except OSError as error:
            raise Missing(f"{name} is left out: {command[0]} does not run ({error.strerror}).") from None
        if self._answer() != "ready":
            raise Missing(f"{name} is left out: it did not start ({self._said()}).")

    def _answer(self):
        return self.process.stdout.readline().strip()

    def _said(self):
        self.log.seek(0)
        lines = self.log.read().strip().splitlines() or ["it gave no reason"]
        return next((line for line in lines if "ERROR" in line), lines[-1])

    def __call__(self, *words):
        """Pixels, seconds on the clock and on the processors; Missing where the process ends instead."""
        try:
            self.process.stdin.write(" ".join(map(str, words)) + "\n")
            self.process.stdin.flush()
            answer = json.loads(self._answer())
        except (OSError, ValueError):
            raise Missing(f"{self.name} is left out: it ended while it rendered ({self._said()}).") from None
        return np.load(answer["file"]), answer["clock"], answer["processors"]

    def close(self):
        """End the process."""
        self.process.stdin.close()
        self.process.wait()


class Record:
    """What the renders of one program were: times and pictures."""

    def __init__(self):
        self.clock, self.processors, self.pictures = [], [], []

    def add(self, pixels, clock, processors):
        """One render."""
        self.pictures.append(pixels.astype(np.float32))
        self.clock.append(clock)
        self.processors.append(processors)

    @property
    def error(self):
        """Mean squared error of one picture: the variance over the seeds."""
        return float(np.mean(np.var(self.pictures, axis=0, ddof=1, dtype=float)))

    def error_of(self, picture):
        """Mean squared error of another program's picture, of which these are unbiased estimates."""
        off = np.subtract(picture, self.pictures, dtype=float)
        count = len(off)
        return float(np.mean(off.sum(0) ** 2 - (off**2).sum(0)) / (count * (count - 1)))

    def error_to(self, truths):
        """Mean squared error to a truth, of which there are two pictures: what noise they have by themselves cancels."""
        first, second = truths
        return float(np.mean([np.mean((picture - first) * (picture - second)) for picture in self.pictures]))

# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender that renders tasks for this process, as sweeps.child does it, and takes its turn to be started anew."""

from __future__ import annotations

import contextlib
import json
import subprocess
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from ..base import processes

RENDERS = 200  # after which a child is replaced, as what it holds may grow
PATIENCE = 1.5  # seconds that it may take to end by itself

Report = Callable[[int, int], object]  # called with samples done and samples in all


class Outcome(NamedTuple):
    """How an order went: its task's key, the seconds that it took, and a sentence where it could not be done.

    again: whether it may be done another time
    """

    key: str
    seconds: float
    problem: str | None = None
    again: bool = True


class Child:
    """A second Blender, started at need, that carries out one order at a time.

    binary:  of Blender; empty where Blender is a module of this Python
    """

    def __init__(self, binary: str) -> None:
        self._binary = binary
        self._process: subprocess.Popen[str] | None = None
        self._rendered, self._stopped = 0, False
        self._lock = threading.Lock()

    def start(self) -> None:
        """Start it, where it does not run; OSError where it cannot be started."""
        with self._lock:
            if self._process is None and not self._stopped:
                self._process = processes.second_blender("sweeps.child", binary=self._binary, stdout=subprocess.PIPE)
                self._rendered = 0

    def carry_out(self, order: Mapping, report: Report | None = None) -> Outcome:
        """Carry out an order of sweeps.child; one that ends without a word is started anew for the next."""
        key = order["task"]["key"]
        if self._rendered >= RENDERS:
            self.end()
        self.start()
        process, said = self._process, []
        if process is None:
            return Outcome(key, 0.0, "stopped.")
        assert process.stdin and process.stdout
        with contextlib.suppress(OSError):  # it has ended, as will be seen
            process.stdin.write(json.dumps(order) + "\n")
            process.stdin.flush()
        for line in process.stdout:
            answer = _answer(line)
            if answer is None:
                said = [*said[-2:], line.strip()]
            elif "seconds" in answer:
                self._rendered += 1
                return Outcome(key, answer["seconds"], answer["problem"], answer["again"])
            elif "done" in answer and report:
                report(answer["done"], answer["total"])
        self.end()
        code = process.returncode
        return Outcome(
            key, 0.0, f"the Blender that rendered it ended (exit code {code}): {' '.join(said) or 'no word'}."
        )

    def end(self, *, for_good: bool = False) -> None:
        """End it, and wait until it has; `for_good`: it is not started again."""
        with self._lock:
            self._stopped |= for_good
            process, self._process = self._process, None
        if process:
            processes.end(process, PATIENCE)

    @property
    def pid(self) -> int | None:
        """The id of its process, where it runs."""
        process = self._process
        return process.pid if process else None


def end_all(children: Iterable[Child]) -> None:
    """End them for good, side by side."""
    enders = [threading.Thread(target=child.end, kwargs={"for_good": True}) for child in children]
    for ender in enders:
        ender.start()
    for ender in enders:
        ender.join()


def _answer(line):
    """What a line of its output says, where it is one of sweeps.child."""
    with contextlib.suppress(ValueError):
        answer = json.loads(line) if line.startswith("{") else None
        if isinstance(answer, dict) and ("key" in answer or "ready" in answer):
            return answer
    return None

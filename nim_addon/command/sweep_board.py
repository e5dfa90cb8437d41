# SPDX-License-Identifier: GPL-3.0-or-later
"""What `nimray sweep` says while it runs: the whole and each worker on a terminal, or JSON lines for programs."""

from __future__ import annotations

import json
import os
import shutil
import sys
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.streams import opened
from ..base.text import duration, printable
from .report import Bar, note

if TYPE_CHECKING:
    from ..sweeps.children import Outcome
    from ..sweeps.orders import Order
    from ..sweeps.state import State

EVERY = 0.25  # seconds between two looks
MOST_LINES = 12  # of workers


class Board:
    """What is said of a State, within `with`."""

    def __init__(self, state: State, *, quiet: bool = False, progress: bool = False) -> None:
        self.state, self.quiet, self.progress = state, quiet, progress
        self.shown = sys.stderr.isatty() and not (quiet or progress)
        self._drawn, self._told = 0, False
        self._over = threading.Event()
        self._ticker = threading.Thread(target=self._tick, daemon=True)
        if not quiet:
            state.tell = self._warn

    def __enter__(self) -> Board:
        # a copy: while Blender works, standard output is kept clear of what it says
        self._stream = opened(os.dup(1)) if self.progress else None
        if self.shown or self.progress:
            self._ticker.start()
        return self

    def __exit__(self, *_) -> None:
        self._stop()
        if self._stream:
            self._stream.close()

    def _stop(self):
        self._over.set()
        if self._ticker.is_alive():
            self._ticker.join()
        self._clear()

    def ended(self, order: Order, outcome: Outcome) -> None:
        """An order has ended."""
        if self.progress:
            self._print({"key": outcome.key, "task": order.task.title, "seconds": round(outcome.seconds, 3)})
        if self.state.estimate and not self._told:
            self._told = True
            self._tell(self.state.estimate)

    def _tell(self, estimate):
        if self.progress:
            self._print({"estimate": {**estimate._asdict(), "seconds": round(estimate.seconds, 1)}})
        elif not self.quiet:
            self._clear()
            workers = f"{estimate.workers} worker{'s' * (estimate.workers > 1)}"
            others = f"the other {estimate.tasks} take" if estimate.tasks > 1 else "the last one takes"
            note(f"{others} about {duration(estimate.seconds)} on {workers}.")

    def _warn(self, sentence):
        self._clear()
        note(sentence)

    def end(self, files: Iterable[Path]) -> None:
        """These files are there."""
        self._stop()
        if self.progress:
            self._print(self.state.record())
            self._print({"files": [os.fspath(file) for file in files]})
        elif not self.quiet:
            for file in files:
                print(file, flush=True)

    def _tick(self):
        wait = 1.0 if self.progress else EVERY
        while not self._over.wait(wait):
            if self.progress:
                self._print(self.state.record())
            else:
                self._draw(self.state.record())

    def _print(self, message):
        print(json.dumps(message), file=self._stream, flush=True)

    # -------------------------------------------------------------------------------------------- on a terminal

    def _draw(self, said):
        ended, total = said["done"] + said["failed"], max(said["total"], 1)
        full = Bar.WIDTH * ended // total
        left = "" if said["left"] is None else f", {duration(said['left'])} left"
        failed = f", {said['failed']} failed" if said["failed"] else ""
        lines = [f"[{'#' * full}{'.' * (Bar.WIDTH - full)}] {ended}/{said['total']}{left}{failed}"]
        for name, work in list(said["workers"].items())[:MOST_LINES]:
            part = f" {work['done']}/{work['total']} samples" if work["total"] else ""
            lines.append(f"  {name}: {printable(work['task'])}{part}")
        width = shutil.get_terminal_size().columns - 1
        self._clear()
        print("\n".join(line[:width] for line in lines), end="", file=sys.stderr, flush=True)
        self._drawn = len(lines)

    def _clear(self):
        """Take away the lines that were drawn last."""
        if self._drawn:
            print("\r\x1b[2K" + "\x1b[1A\x1b[2K" * (self._drawn - 1), end="", file=sys.stderr, flush=True)
            self._drawn = 0

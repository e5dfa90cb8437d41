# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a sweep is, kept in its folder for other shells to see; and that one process at a time carries it out."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..base import records
from ..base.files import whole, writable_folder

if TYPE_CHECKING:
    from .children import Outcome
    from .orders import Order  # which needs Blender, as who asks how far a sweep is does not
    from .sample import Estimate, Sample

try:
    import fcntl
except ImportError:  # on Windows nothing tells a dead process' lock from a living one's
    fcntl = None

FILE, LOCK = "state.json", ".lock"
EVERY = 1.0  # seconds between two looks at the file
TRUST = 3  # orders that have ended for which an estimate counts


class State:
    """What becomes of the orders of a sweep, as a Watch is told; written to its folder about once a second where `kept`.

    sample:   the tasks by which its time is told; estimate: what they tell, once they have ended
    """

    def __init__(self, folder: Path, total: int, *, kept: bool = True) -> None:
        self.folder, self.total, self.kept = folder, total, kept
        self.done, self.failed = 0, 0
        self.sample: Sample | None = None
        self.estimate: Estimate | None = None
        self._since = time.monotonic(), 0  # that time is counted, and how many orders had ended then
        self.tell: Callable[[str], object] | None = None  # whom a sentence is told that a person should read at once
        self._workers: dict[str, dict] = {}
        self._written, self._lock = 0.0, threading.Lock()

    def began(self, worker: str, order: Order) -> None:
        """A worker has begun an order."""
        with self._lock:
            self._workers[worker] = {"task": order.task.title, "done": 0, "total": 0}
        self.write()

    def goes_on(self, worker: str, order: Order, done: int, total: int) -> None:
        """So many samples of an order, of so many, are done."""
        with self._lock:
            self._workers[worker] = {"task": order.task.title, "done": done, "total": total}
        self.write()

    def ended(self, order: Order, outcome: Outcome) -> None:
        """An order has ended."""
        failed = outcome.problem is not None
        with self._lock:
            self.done, self.failed = self.done + (not failed), self.failed + failed
            workers = max(1, len(self._workers))
        if self.sample and not self.estimate:
            self.sample.ended(order.task, None if failed else outcome.seconds)
            self.estimate = said = self.sample.estimate(workers)
            if said:  # from here on the sample, which may have been slow, counts as the estimate has it
                pace = said.seconds / said.tasks
                self._since = time.monotonic() - TRUST * pace, self.done + self.failed - TRUST
        self.write()

    def waits(self, why: str) -> None:
        """Nobody is there who could carry out orders."""
        if self.tell:
            self.tell(why)

    def left(self) -> float | None:
        """Seconds that it takes still, by what it took so far; None before the first has ended."""
        since, before = self._since
        ended = self.done + self.failed
        return (time.monotonic() - since) / (ended - before) * (self.total - ended) if ended else None

    def record(self) -> dict:
        """All that as JSON-ready values."""
        with self._lock:
            workers = {name: dict(said) for name, said in self._workers.items()}
        left = self.left()
        return {
            "total": self.total,
            "done": self.done,
            "failed": self.failed,
            "left": None if left is None else round(left, 1),
            "workers": workers,
        }

    def write(self, *, at_last: bool = False) -> None:
        """Write it to the folder, unless that was just done."""
        now = time.monotonic()
        with self._lock:
            if not self.kept or (now - self._written < EVERY and not at_last):
                return
            self._written = now
        text = json.dumps({**self.record(), "pid": os.getpid(), "host": socket.gethostname()})
        with contextlib.suppress(OSError):  # of a disk that is full whoever renders says so
            whole(self.folder / FILE, lambda part: part.write_text(text, encoding="utf-8"))


def read(folder: str | Path) -> dict | None:
    """What the process that carries out a sweep, or did so last, has written; None where there is nothing."""
    with contextlib.suppress(OSError, ValueError):
        return records.parse((Path(folder).expanduser() / FILE).read_text(encoding="utf-8"))
    return None


@contextlib.contextmanager
def alone(folder: str | Path) -> Iterator[Path]:
    """Within, no other process of this machine carries out the sweep of a folder, which is made where it is missing.

    Raises OSError, one sentence, where the folder cannot be written, RuntimeError where another process is at work.
    """
    folder = writable_folder(folder)
    if fcntl is None:
        yield folder
        return
    with open(folder / LOCK, "w") as lock:
        if not _take(lock):
            raise RuntimeError(
                f"another process carries out the sweep in {folder}; wait for it, or stop it with Ctrl-C."
            )
        yield folder


def is_at_work(folder: str | Path) -> bool:
    """Whether a process of this machine carries out the sweep of a folder."""
    with contextlib.suppress(OSError):
        if fcntl:
            with open(Path(folder).expanduser() / LOCK, "r+") as lock:
                return not _take(lock)
    return False


def _take(lock):
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        pass
    return True

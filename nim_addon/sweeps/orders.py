# SPDX-License-Identifier: GPL-3.0-or-later
"""What whoever carries a sweep out is given, and whom they tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from .children import Outcome
from .plan import Task


class Order(NamedTuple):
    """A task to be rendered; or, with the parts of its picture, (first, count) and file of each, to be put together."""

    task: Task
    parts: tuple[tuple[tuple[int, int], str], ...] = ()

    def record(self, folder: str | Path, *, threads: int = 0, mixed: bool = False) -> dict:
        """The order as sweeps.child takes it, in JSON-ready values.

        folder: of the sweep; threads: that Cycles renders with, 0 for all; mixed: whether its Blender may be another one
        """
        order = {"task": self.task.record(), "folder": str(Path(folder).expanduser().resolve())}
        parts = {"parts": [[list(part), file] for part, file in self.parts]} if self.parts else {}
        return {**order, "threads": threads, "mixed": mixed, **parts}


class Watch(Protocol):
    """Who is told, in threads of whoever carries out, what becomes of the orders."""

    def began(self, worker: str, order: Order) -> None:
        """A worker has begun an order."""

    def goes_on(self, worker: str, order: Order, done: int, total: int) -> None:
        """So many samples of an order, of so many, are done."""

    def waits(self, why: str) -> None:
        """Nobody is there who could carry out orders; why, and what to do, is a sentence."""


# Who carries orders out that lie in a sweep's folder: each is yielded, in any order, with how it went at last.
Engine = Callable[[Sequence[Order], Path, Watch], Iterator[tuple[Order, Outcome]]]

# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep on this machine: one Blender with all processors, or some of them side by side, each with its share."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

from .children import Child, Outcome, end_all
from .orders import Order, Watch

TRIES = 3  # of an order, before it is left


def carry_out(
    orders: Sequence[Order],
    folder: str | Path,
    watch: Watch,
    *,
    binary: str,
    workers: int = 1,
    mixed: bool = False,
    first: Child | None = None,
) -> Iterator[tuple[Order, Outcome]]:
    """Carry out orders, which end in any order; one that fails is tried anew, and what is yielded is how it went at last.

    binary:  as children.Child has it
    workers: how many Blenders render side by side
    mixed:   whether this Blender may be another than the plan is for
    first:   one of them, that was started before
    Where the iterator is closed, all of them end.
    """
    waiting: queue.SimpleQueue[tuple[Order, int] | None] = queue.SimpleQueue()
    over: queue.SimpleQueue[tuple[Order, Outcome] | BaseException] = queue.SimpleQueue()
    workers = max(1, min(workers, len(orders)))
    threads = 0 if workers == 1 else max(1, (os.cpu_count() or 1) // workers)
    for order in orders:
        waiting.put((order, 1))
    children = [first or Child(binary), *(Child(binary) for _ in range(workers - 1))]

    def work(name: str, child: Child) -> None:
        try:
            child.start()
            while given := waiting.get():
                order, tries = given
                watch.began(name, order)
                record = order.record(folder, threads=threads, mixed=mixed)
                outcome = child.carry_out(record, lambda *samples, order=order: watch.goes_on(name, order, *samples))
                if outcome.problem and outcome.again and tries < TRIES:
                    waiting.put((order, tries + 1))
                else:
                    over.put((order, outcome))
        except BaseException as error:
            over.put(error)

    for number, child in enumerate(children, 1):
        threading.Thread(target=work, args=(f"worker {number}", child), daemon=True).start()
    try:
        for _ in orders:
            ended = over.get()
            if isinstance(ended, BaseException):
                raise ended
            yield ended
    finally:
        for _ in children:
            waiting.put(None)
        end_all(children)

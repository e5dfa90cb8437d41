# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs in a worker of Dask: a Blender beside it renders, so that no crash takes the worker down; text in, text out.

It needs neither Blender nor the rest of the sweep in its own process.
"""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from . import PLAN
from .children import Child, Outcome, end_all

TOPIC = "nimray"  # of the events that tell how far a worker is
EVERY, LOOK = 1.0, 0.1  # seconds between two of them, and between two looks whether the task is still wanted
GONE = ("cancelled", "resumed", "released", "forgotten")  # states of a task that nobody wants any more
LEAVING = ("closing", "closed")  # states of a worker whose task is another's by now

_own = (
    threading.local()
)  # its child: of each thread, as a process may have several workers, and a worker several threads
_lent: list[Child] = []


@contextlib.contextmanager
def lent(children: Sequence[Child]) -> Iterator[None]:
    """Within, workers of this process render with these Blenders, one each; at the end all of them end."""
    _lent[:] = children
    try:
        yield
    finally:
        _lent.clear()
        end_all(children)


def _child():
    if not hasattr(_own, "child"):
        _own.child = _lent.pop() if _lent else Child("")
    return _own.child


def carry_out(text: str) -> str:
    """Carry out an order of sweeps.child, as JSON; returns as JSON how it went, and with which worker.

    It ends where the task is cancelled.
    """
    from distributed import get_worker  # pyright: ignore[reportMissingImports]

    order = json.loads(text)
    worker = get_worker()
    key = order["task"]["key"]
    if not (Path(order["folder"]) / PLAN).is_file():
        problem = f"the worker {worker.name} does not see {order['folder']}; name a folder with --out that all machines share."
        outcome = Outcome(key, 0.0, problem)
        return json.dumps({**outcome._asdict(), "worker": worker.address})
    child = _child()
    task, over, said = worker.get_current_task(), threading.Event(), 0.0

    def report(done: int, total: int) -> None:
        nonlocal said
        if done == 0 or time.monotonic() - said > EVERY:
            said = time.monotonic()
            name = str(worker.name).partition("://")[2] or str(worker.name)
            worker.log_event(TOPIC, {"name": name, "key": key, "done": done, "total": total})

    def look() -> None:
        while not over.wait(LOOK):
            state = worker.state.tasks.get(task)
            if state is None or state.state in GONE or worker.status.name in LEAVING:
                child.end()
                return

    looker = threading.Thread(target=look, daemon=True)
    looker.start()
    try:
        with contextlib.suppress(Exception):  # of what is only told
            report(0, 0)
        outcome = child.carry_out(order, report)
    finally:
        over.set()
        looker.join()
    return json.dumps({**outcome._asdict(), "worker": worker.address})

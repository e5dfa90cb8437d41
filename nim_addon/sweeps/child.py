# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender that renders one task after the other, as it is told on its standard input; run as a module of its own.

It is given a line of JSON for each: an order, {"task": a task's record, "folder": where to, "threads": how many}; with
"parts" beside them the parts of the task's picture are put together. It says with lines of JSON how far it is, and at the
end of each order how that went.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import IO

from ..base import records, signals, streams
from ..base.files import writable_folder
from ..base.text import said_by


def serve(orders: IO[str], answers: IO[str]) -> None:
    """Carry out the orders that come in, a line each, until there are no more."""

    def say(message: dict) -> None:
        print(json.dumps(message), file=answers, flush=True)

    with signals.importing_blender():
        import bpy
    say({"ready": os.getpid(), "blender": bpy.app.version_string})
    for line in orders:
        order = records.parse(line)
        key, started = order["task"]["key"], time.monotonic()
        try:
            carry_out(order, lambda done, total, key=key: say({"key": key, "done": done, "total": total}))
            problem, again = None, False
        except ValueError as error:  # which another time is the same
            problem, again = said_by(error), False
        except (OSError, RuntimeError) as error:
            problem, again = _sentence(error), True
        except MemoryError:
            problem, again = "there is not enough memory for this; ask for less, such as a smaller --size.", True
        say({"key": key, "seconds": time.monotonic() - started, "problem": problem, "again": again})


def _sentence(error):
    return f"{error.filename}: {error.strerror}." if isinstance(error, OSError) and error.errno else said_by(error)


def carry_out(order: Mapping, progress: Callable[[int, int], object]) -> None:
    """Carry out one order, whose images and how they were made then lie in its folder; raises as Session.render() does."""
    import bpy

    from ..renders.parts import Part, merge, render_part
    from ..renders.session import Session
    from . import results
    from .plan import Task

    started = time.monotonic()
    task = Task.of(order["task"])
    planned, version = order["task"]["request"]["blender"], bpy.app.version_string
    if planned != version and not order.get("mixed"):
        raise ValueError(
            f"the plan is for Blender {planned}, and {socket.gethostname()} has {version}; render all with one version, or "
            "allow others with --mixed."
        )
    folder = writable_folder(results.folder_of(order["folder"], task))

    def report(done: int, total: int, _left: float | None) -> None:
        progress(done, total)

    def showing(_name: str, _samples: int) -> nullcontext:
        return nullcontext(report)

    with Session(task.request, threads=order.get("threads", 0)) as session:
        if "parts" in order:
            parts = {Part(*part): Path(file) for part, file in order["parts"]}
            merge(session, parts, folder, task.image)
        elif task.part:
            file = folder / f"{task.key}.exr"
            render_part(session, Part(*task.part), file, folder / f".{task.key}.photons", report)
        else:
            session.render(folder, task.image, keep=False, showing=showing)
        backend = session.request.backend
    made = results.Made(round(time.monotonic() - started, 4), socket.gethostname(), version, backend)
    results.finish(order["folder"], task, made)
    for _, file in order.get("parts", ()):  # which are in the picture now
        for done in (Path(file).with_suffix(".json"), Path(file)):
            done.unlink(missing_ok=True)


if __name__ == "__main__":
    streams.prepare()
    signals.watch()
    # Blender's own chatter goes elsewhere
    answers = streams.opened(os.dup(1))
    os.dup2(2, 1)
    try:
        serve(sys.stdin, answers)
    except KeyboardInterrupt:
        signals.leave(130)
    signals.leave(0)

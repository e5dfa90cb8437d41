# SPDX-License-Identifier: GPL-3.0-or-later
"""The act: the tasks of a plan that are not done are carried out, and parts become pictures."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from ..base.options import BACKEND_NAMES
from . import film as films
from . import page, results, sheet, table
from .children import Outcome
from .orders import Engine, Order
from .plan import Task, pictures
from .sample import Sample
from .state import State

PATIENCE = 60  # seconds until what another machine has written must be seen here

Ended = Callable[[Order, Outcome], object]


class Problem(NamedTuple):
    """A task that could not be done, and why."""

    task: Task
    problem: str


def carry_out(
    tasks: Sequence[Task], folder: Path, engine: Engine, state: State, merging: Engine, ended: Ended | None = None
) -> list[Problem]:
    """Carry out the tasks of a plan that are not done in its folder, and make pictures of their parts.

    engine:  by which they are; merging: by which parts become pictures, on this machine
    ended:   called with each order that has ended, and how it went
    Returns those that could not be done.
    """
    problems = render(tasks, folder, engine, state, ended)
    merges = _merges(tasks, folder)
    problems += _carry_out(merges, folder, merging, state, ended)
    state.write(at_last=True)
    return problems


def render(
    tasks: Sequence[Task], folder: Path, engine: Engine, state: State, ended: Ended | None = None
) -> list[Problem]:
    """The first half of carry_out(): parts stay parts."""
    state.sample = Sample(results.to_do(folder, tasks))
    return _carry_out([Order(task) for task in state.sample.tasks], folder, engine, state, ended)


def _carry_out(orders, folder, engine, state, ended):
    state.total += len(orders)
    problems, done = [], []
    for order, outcome in engine(orders, folder, state) if orders else ():
        state.ended(order, outcome)
        if outcome.problem:
            problems.append(Problem(order.task, outcome.problem))
        else:
            done.append(order.task)
        if ended:
            ended(order, outcome)
    unseen = f"it was rendered, but is not in {folder} here; name a folder with --out that all machines share."
    return problems + [Problem(task, unseen) for task in _unseen(folder, done)]


def _unseen(folder, tasks):
    """Those of tasks that were carried out that are not there, once a folder of the network has had time to show them."""
    until = time.monotonic() + PATIENCE
    while (missing := results.to_do(folder, tasks)) and time.monotonic() < until:
        time.sleep(1)
    return missing


def collect(
    tasks: Sequence[Task], folder: Path, measured: Sequence[str], *, film: str | None = None, fps: float = 24
) -> tuple[list[Path], list[str]]:
    """Write what the pictures of a plan show together: table, contact sheet, page and film.

    measured: names of quantities; film: the name of its file in the folder, None for none
    Returns the files, and the versions of Blender with their backends that the pictures are of.
    """
    shown = pictures(tasks)
    lines = table.rows(folder, shown, measured)
    files = table.write(folder, lines)
    if lines:
        keys = list(dict.fromkeys(key for task in shown for key in task.values))
        files.append(sheet.write(folder, shown))
        files.append(page.write(folder, _title(shown), lines, keys, measured))
        if film:
            frames = [(folder / line["file"]).with_suffix(".png") for line in lines]
            files.append(films.write(folder / Path(film).name, frames, fps))
    versions = {f"Blender {line['blender']} ({BACKEND_NAMES.get(line['backend'], line['backend'])})" for line in lines}
    return files, sorted(versions)


def _title(shown):
    request = shown[0].request
    varied = ", ".join(dict.fromkeys(key for task in shown for key in task.values))
    return f"{request.scene or request.name}{f' by {varied}' if varied else ''}"


def _merges(tasks, folder):
    """The orders that make pictures of parts, of those all of whose parts are there."""
    parted: dict[str, list[Task]] = {}
    for task in tasks:
        if task.part:
            parted.setdefault(task.image, []).append(task)
    orders = []
    for parts in parted.values():
        picture = Task(parts[0].request, parts[0].values)
        if results.made(folder, picture) is None and all(results.made(folder, part) for part in parts):
            files = results.folder_of(folder, picture)
            known = tuple((part.part, str(files / f"{part.key}.exr")) for part in parts if part.part)
            orders.append(Order(picture, known))
    return orders

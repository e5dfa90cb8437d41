# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a sweep takes, told by a few of its tasks that are rendered before all others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .plan import Task  # which needs Blender, as who asks how far a sweep is does not

# Simpson's rule: the mean of what costs more, or less, along the plan, and a Blender's start, in the first, counts little
WEIGHTS = (1, 4, 1)


class Estimate(NamedTuple):
    """Seconds of the clock that so many tasks, all that are left, take on so many workers."""

    seconds: float
    tasks: int
    workers: int


class Sample:
    """The first, the middle and the last of the pictures among some tasks, and of the probes; its `tasks` begin with them."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        kinds = [[task for task in tasks if task.probe is probe] for probe in (False, True)]
        chosen = {
            kind[place].key: weight
            for kind in kinds
            if kind
            for place, weight in zip((0, len(kind) // 2, len(kind) - 1), WEIGHTS, strict=True)
        }
        self.tasks = sorted(tasks, key=lambda task: task.key not in chosen)
        self._rest = Counter(task.probe for task in self.tasks[len(chosen) :])
        self._awaited = chosen
        self._taken: dict[bool, list[tuple[int, float]]] = {False: [], True: []}

    def ended(self, task: Task, seconds: float | None) -> None:
        """A task has ended that took so long; None where it could not be rendered."""
        weight = self._awaited.pop(task.key, 0)
        if not weight:
            self._rest[task.probe] -= 1
        elif seconds is not None:
            self._taken[task.probe].append((weight, seconds))

    def estimate(self, workers: int) -> Estimate | None:
        """That of the others; None while it is not rendered, where none of it could be, and where nothing is left."""
        rest = +self._rest
        if self._awaited or not rest or not all(self._taken[probe] for probe in rest):
            return None
        seconds = sum(count * _mean(self._taken[probe]) for probe, count in rest.items())
        return Estimate(seconds / workers, rest.total(), workers)


def _mean(taken):
    return sum(weight * seconds for weight, seconds in taken) / sum(weight for weight, _ in taken)

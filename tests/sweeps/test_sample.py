# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a sweep takes, by the first, the middle and the last of its tasks."""

import dataclasses

import pytest

from nim_addon.sweeps import state
from nim_addon.sweeps.children import Outcome
from nim_addon.sweeps.orders import Order
from nim_addon.sweeps.sample import Estimate, Sample


def told(sample, seconds, workers=1):
    """What it tells after its first tasks have ended that took so long."""
    for task, taken in zip(sample.tasks, seconds, strict=False):
        assert sample.estimate(workers) is None
        sample.ended(task, taken)
    return sample.estimate(workers)


def test_the_first_the_middle_and_the_last_come_first(spheres):
    tasks = spheres(-2, -1.9, -1.8, -1.7, -1.6)
    assert Sample(tasks).tasks == [tasks[place] for place in (0, 2, 4, 1, 3)]
    for few in ([], tasks[:1], tasks[:2], tasks[:3]):
        sample = Sample(few)
        assert sample.tasks == few and told(sample, [1] * 3) is None  # nothing is left


def test_what_is_dear_at_the_end_is_in_the_estimate(spheres):
    tasks = spheres(-2, -1.9, -1.8, -1.7, -1.6, -1.5, -1.4)
    assert told(Sample(tasks), [10, 1, 2]) == Estimate(4 * (10 + 4 + 2) / 6, 4, 1)
    assert told(Sample(tasks), [2, 1, 100], 2) == Estimate(4 * (2 + 4 + 100) / 6 / 2, 4, 2)
    assert told(Sample(tasks), [None, 1, 6]) == Estimate(4 * (4 + 6) / 5, 4, 1)  # of those that could be rendered
    assert told(Sample(tasks), [None, None, None]) is None
    sample = Sample(tasks)
    sample.ended(sample.tasks[3], 7)  # by another worker, meanwhile
    assert told(sample, [6, 6, 6]) == Estimate(18, 3, 1)


def test_probes_are_told_apart(spheres):
    tasks = spheres(-2, -1.9, -1.8, -1.7, -1.6)
    probes = [dataclasses.replace(task, probe=True) for task in spheres(-2, -1.9, -1.8, -1.7, samples=1)]
    sample = Sample([*tasks, *probes])
    assert sample.tasks[:6] == [*(tasks[place] for place in (0, 2, 4)), *(probes[place] for place in (0, 2, 3))]
    assert told(sample, [60, 60, 60, 6, 6, 6]) == Estimate(2 * 60 + 6, 3, 1)


def test_the_time_that_is_left_begins_with_the_estimate(spheres, tmp_path):
    at = state.State(tmp_path, 7, kept=False)
    at.sample = Sample(spheres(-2, -1.9, -1.8, -1.7, -1.6, -1.5, -1.4))
    orders = [Order(task) for task in at.sample.tasks]
    assert at.left() is None
    for worker, order in zip("aba", orders, strict=False):
        at.began(worker, order)
        at.ended(order, Outcome(order.task.key, 600.0))
    assert at.estimate == Estimate(1200.0, 4, 2) and at.left() == pytest.approx(1200, abs=5)
    at.ended(orders[3], Outcome(orders[3].task.key, 0.1))
    assert at.left() == pytest.approx(3 * 300 * 3 / 4, abs=5)  # quicker than it was told

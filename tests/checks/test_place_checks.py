# SPDX-License-Identifier: GPL-3.0-or-later
"""Interfaces in the same place as something else, coarse, or far away."""

import pytest

from nim_addon import checks
from tests.checks.pieces import CUP, GLASS, NIM, WATER, add, ball, box, codes, found, sheet, turned


def test_a_copy_in_the_same_place(scene):
    obj = add("Ball", NIM, ball(1))
    copy = add("Copy", None, mesh=obj.data)
    (problem,) = found(scene)
    assert problem.code == "touching" and "are in the same place" in problem.sentence and problem.remedy is None
    copy.location.z = 2.5
    assert codes(scene) == []


def test_a_box_that_rests_on_the_floor_exactly(scene):
    obj = add("Box", NIM, box(2, (0, 0, 1)))
    add("Floor", None, sheet(5))
    (problem,) = found(scene)
    assert problem.code == "touching" and "Box and Floor have faces in the same place" in problem.sentence
    checks.mend(scene)
    assert codes(scene) == [] and 0 < obj.location.z < 1e-3 and tuple(obj.location)[:2] == (0, 0)
    obj.location.z = 0
    obj.lock_location[2] = True
    assert [problem.remedy for problem in found(scene)] == [None]


@pytest.mark.parametrize("segments, coarse", [(16, True), (24, True), (32, False), (64, False)])
def test_coarse_smooth_surfaces(scene, segments, coarse):
    obj = add("Ball", NIM, ball(1, segments=segments))
    assert codes(scene) == []
    obj.data.shade_smooth()
    assert codes(scene) == ["coarse"] * coarse
    if coarse:
        obj.modifiers.new("Finer", "SUBSURF").render_levels = 2
        assert codes(scene) == []


@pytest.mark.parametrize("distance, far", [(1e3, False), (1e4, True)])
def test_far_from_the_origin(scene, distance, far):
    add("Ball", NIM, ball(1)).location.y = distance
    assert codes(scene) == ["far"] * far


def test_a_liquid_that_fills_its_cup_exactly_touches_it(scene):
    turned("Cup", GLASS, CUP)
    turned("Water", WATER, [(0, 0.1), (0.9, 0.1), (0.9, 1.5), (0, 1.5)])
    (problem,) = found(scene)
    assert problem.code == "touching" and problem.remedy is None, "no step would part all of the wall"

# SPDX-License-Identifier: GPL-3.0-or-later
"""An interface absorbs on straight ways to its own faces: what else stands in the medium is said, and a volume mends it."""

import bpy
import pytest

from nim_addon import checks
from nim_addon.cycles.material import interface_material, interface_nodes
from nim_addon.physics import Medium
from tests.checks.pieces import AIR, add, ball, box, codes, found, sheet

RED = Medium(1.5 + 1e-7j)  # loses nine tenths of the light within a metre


def matt(name="Straw"):
    return add(name, bpy.data.materials.new("Matt"), ball(0.2))


def test_what_absorbs_and_is_solid_is_right(scene):
    add("Ball", RED, ball(1))
    add("Beside", bpy.data.materials.new("Matt"), ball(0.2, (3, 0, 0)))
    assert codes(scene) == []


@pytest.mark.parametrize("medium", [RED, Medium.parse("n-bk7")], ids=["constant", "dispersive"])
def test_what_stands_in_it_is_said_and_a_volume_mends_it(scene, one_sentence, medium):
    body = add("Ball", medium, ball(1))
    matt()
    problem = next(problem for problem in found(scene) if problem.code == "absorbs")
    one_sentence(problem.sentence, "Ball", "Straw", "volume")
    checks.mend(scene, "absorbs")
    assert "absorbs" not in codes(scene)
    material = body.data.materials[0]
    (link,) = material.node_tree.get_output_node("CYCLES").inputs["Volume"].links
    assert link.from_node.inputs["Density"].default_value == pytest.approx(medium.absorption(), rel=1e-5)
    assert not interface_nodes(material)[0].inputs["Absorption Inside"].is_linked


def test_a_lamp_in_it_is_said(scene):
    add("Ball", RED, ball(1))
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    problem = next(problem for problem in found(scene) if problem.code == "absorbs")
    assert "Lamp stands in what absorbs" in problem.sentence
    lamp.location.x = 3
    assert "absorbs" not in codes(scene)


def test_another_interface_in_it_absorbs_on_its_side(scene):
    add("Ball", RED, ball(1))
    add("Bubble", (AIR, RED), ball(0.3))
    assert codes(scene) == []


def test_a_sheet_that_absorbs_is_said(scene, one_sentence):
    add("Sheet", RED, sheet(1))
    problem = next(problem for problem in found(scene) if problem.code == "absorbs")
    one_sentence(problem.sentence, "Sheet", "closed body")
    assert problem.remedy is None


def test_an_outside_that_absorbs_in_the_open_is_said(scene):
    add("Ball", (AIR, RED), ball(1))
    problem = next(problem for problem in found(scene) if problem.code == "absorbs")
    assert "no faces close it in" in problem.sentence and problem.remedy is None


def test_what_is_too_faint_to_see_or_absorbed_by_a_volume_already_is_not_said(scene):
    add("Ball", Medium(1.5 + 1e-12j), ball(1))
    add("Other", interface_material("Volume", RED, backend="nodes", volume=True), box(1, (4, 0, 0)))
    matt()
    add("In the other", bpy.data.materials.new("Matt"), ball(0.2, (4, 0, 0)))
    assert codes(scene) == []

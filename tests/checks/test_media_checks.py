# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that do not fit where two interfaces meet are said, and mended where it is known which is wrong."""

import bpy
import pytest

from nim_addon import checks
from nim_addon.cycles.material import interface_material, interface_nodes, interface_of
from nim_addon.physics import Medium
from nim_addon.scenes import SCENES
from tests.checks.pieces import AIR, CUP, GLASS, NIM, WATER, add, ball, box, codes, found, turned


def test_a_bubble_whose_outside_was_forgotten(scene):
    add("Ball", NIM, ball(1))
    bubble = add("Bubble", (AIR, AIR), ball(0.3, (0.4, 0, 0)))
    (problem,) = found(scene)
    assert problem.sentence == "Bubble lies in NIM -1.5 (Ball), but its outside is n = 1."
    checks.mend(scene)
    assert (
        codes(scene) == []
        and interface_nodes(bubble.data.materials[0])[0].inputs["Index Outside"].default_value == -1.5
    )


LOSSY, METAL, GLASSES = Medium(-1.5 + 1e-7j), Medium.of(-2.25), [Medium.parse(name) for name in ("n-bk7", "n-sf11")]


@pytest.mark.parametrize(
    "medium, outside, words",
    [
        (LOSSY, NIM, "NIM -1.5+1e-07j (Ball), but its outside is NIM -1.5."),
        (LOSSY, Medium(-1.5 + 2e-7j), "its outside is NIM -1.5+2e-07j."),
        (METAL, AIR, "n = 0+1.5j (Ball), but its outside is n = 1."),
        (NIM, METAL, "NIM -1.5 (Ball), but its outside is n = 0+1.5j."),
        (Medium.of(-1.7, -0.7 + 0.3j), NIM, ", mu = -0.7+0.3j (Ball)"),
        (GLASSES[0], GLASSES[1], "n-bk7 (Ball), but its outside is n-sf11."),
        (GLASSES[0], Medium(GLASSES[0].n), "n-bk7 (Ball)"),
        (NIM, GLASSES[0], "NIM -1.5 (Ball), but its outside is n-bk7."),
    ],
    ids=str,
)
def test_media_with_loss_and_dispersion_that_do_not_fit(scene, medium, outside, words):
    add("Ball", medium, ball(1))
    bubble = add("Bubble", (AIR, outside), ball(0.3, (0.4, 0, 0)))
    problem = next(problem for problem in found(scene) if problem.code == "outside")
    assert words in problem.sentence
    checks.mend(scene, "outside")
    assert "outside" not in codes(scene)
    read = interface_of(interface_nodes(bubble.data.materials[0])[0]).outside
    assert read.index == pytest.approx(medium.index, rel=1e-6) and read.dispersion == medium.dispersion


def test_media_with_loss_and_dispersion_that_fit(scene):
    for place, medium in enumerate((LOSSY, METAL, *GLASSES)):
        add(f"Ball {place}", medium, ball(1, (3 * place, 0, 0)))
        add(f"Bubble {place}", (AIR, medium), ball(0.3, (3 * place, 0, 0)))
    assert "outside" not in codes(scene)


def test_a_material_that_is_right_elsewhere_is_copied(scene):
    add("Ball", NIM, ball(1))
    glass = interface_material("Glass", GLASS, backend="nodes")
    inner, free = add("Inner", glass, ball(0.3)), add("Free", glass, ball(0.3, (3, 0, 0)))
    (problem,) = found(scene)
    assert problem.objects == ("Inner",)
    checks.mend(scene)
    assert codes(scene) == []
    assert free.material_slots[0].material == glass != inner.material_slots[0].material
    assert interface_nodes(glass)[0].inputs["Index Outside"].default_value == 1


def test_many_bubbles_are_one_problem(scene):
    add("Ball", NIM, ball(1))
    air = interface_material("Air", AIR, backend="nodes")
    for place in (-0.6, 0, 0.6):
        add(f"Bubble {place}", air, ball(0.2, (place, 0, 0)))
    (problem,) = found(scene)
    assert "and 2 more lie in NIM -1.5" in problem.sentence
    checks.mend(scene)
    assert codes(scene) == []


def test_what_a_node_decides_is_not_judged(scene):
    add("Ball", NIM, ball(1))
    tree = add("Bubble", (AIR, AIR), ball(0.3)).data.materials[0].node_tree
    fresnel = tree.nodes.new("ShaderNodeLayerWeight")
    node = next(node for node in tree.nodes if node.type == "GROUP")
    tree.links.new(fresnel.outputs[0], node.inputs["Index Outside"])
    assert codes(scene) == []


def test_bodies_that_overlap(scene):
    add("A", NIM, box(2))
    add("B", NIM, box(2, (1, 0.2, 0.3)))
    (problem,) = found(scene)
    assert "overlap" in problem.sentence and problem.remedy is None


def test_of_two_that_face_each_other_none_is_known_to_be_wrong(scene):
    add("A", NIM, ball(1))
    add("B", (NIM, WATER), ball(1, (3, 0, 0)))
    (problem,) = found(scene)
    assert "face each other" in problem.sentence and problem.remedy is None
    for place in (3, 6):
        add(f"C{place}", NIM, ball(1, (0, place, 0)))
    (problem,) = found(scene)
    assert problem.objects == ("B",) and problem.remedy
    checks.mend(scene)
    assert codes(scene) == []


@pytest.mark.parametrize(
    "material, side, medium, wrong",
    [
        ("Liquid to air", "Inside", Medium(-2.2), "Glass to liquid lies in NIM -2.2 (Liquid to air)"),
        ("Glass to liquid", "Outside", WATER, "Glass to liquid lies in NIM -1.33 (Liquid to air)"),
        ("Glass to air", "Inside", Medium(1.6), "Glass to liquid and Glass to air have their inside in common"),
    ],
    ids=lambda value: str(value),
)
def test_media_of_the_glass_scene_fit(empty_file, material, side, medium, wrong):
    scene = SCENES["glass"].build(SCENES["glass"].parameters(), "nodes")
    node = interface_nodes(bpy.data.materials[material])[0]
    node.inputs[f"Index {side}"].default_value = medium.n
    node.inputs[f"Permeability {side}"].default_value = medium.mu
    (problem,) = checks.problems(scene)
    assert problem.sentence.startswith(wrong) and problem.remedy
    checks.mend(scene)
    assert checks.problems(scene) == []


def test_a_nim_in_the_water_of_a_glass(empty_file):
    scene_type = SCENES["glass"]
    scene = scene_type.build(scene_type.parameters(liquid=WATER), "nodes")
    obj = add("Ball", NIM, ball(0.01, (0, 0, 0.05)))
    bpy.context.scene.collection.objects.unlink(obj)
    scene.collection.objects.link(obj)
    (problem,) = checks.problems(scene)
    assert problem.sentence == "Ball lies in n = 1.33 (Glass), but its outside is n = 1."
    checks.mend(scene)
    assert checks.problems(scene) == []


@pytest.mark.parametrize("reach", [0.9, 0.95])
def test_a_cup_that_is_wet_in_part_is_not_given_one_outside(scene, reach):
    """A liquid's surface in a cup of one material: the wall below it borders on the liquid, the rest on air."""
    turned("Cup", GLASS, CUP)
    turned("Water", WATER, [(reach, 1.5), (0, 1.5)])
    (problem,) = found(scene)
    assert "Cup lies partly in n = 1.33 (Water)" in problem.sentence and problem.remedy is None


LIQUIDS = [
    ([(0, 0), (1, 0), (1, 2), (0.9, 2), (0.9, 1.5)], GLASS, AIR),
    ([(0.9, 1.5), (0.9, 0.1), (0, 0.1)], GLASS, NIM),
    ([(0.9, 1.5), (0, 1.5)], NIM, AIR),
]


def test_a_liquid_of_three_objects_whose_rims_meet(scene):
    """The glass to the air, the glass to the liquid and the liquid to the air: open, but closed by each other."""
    for number, (profile, *media) in enumerate(LIQUIDS):
        turned(f"Part {number}", tuple(media), profile)
    bubble = add("Bubble", (AIR, NIM), ball(0.2, (0.2, 0.1, 0.7)))
    assert found(scene) == []
    interface_nodes(bubble.data.materials[0])[0].inputs["Index Outside"].default_value = 1.0
    (problem,) = found(scene)
    assert problem.objects == ("Bubble",) and problem.remedy
    checks.mend(scene)
    assert codes(scene) == []
    bpy.data.objects["Part 2"].location.x = 0.2
    assert "open" in codes(scene)


def test_a_liquid_that_stands_off_the_wall_is_right(scene):
    turned("Cup", GLASS, CUP)
    turned("Water", WATER, [(0, 0.11), (0.89, 0.11), (0.89, 1.5), (0, 1.5)])
    assert found(scene) == []


def test_a_bubble_in_a_collection_instance(scene):
    held = bpy.data.collections.new("Held")
    for obj in (add("Ball", NIM, ball(1)), add("Bubble", (AIR, AIR), ball(0.3))):
        scene.collection.objects.unlink(obj)
        held.objects.link(obj)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", held
    instance.location, instance.scale = (5, 0, 0), (-2, 2, 2)
    scene.collection.objects.link(instance)
    (problem,) = found(scene)
    assert problem.sentence == "Bubble lies in NIM -1.5 (Ball), but its outside is n = 1."
    checks.mend(scene)
    assert codes(scene) == []

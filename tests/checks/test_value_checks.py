# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of an interface that nothing has, in its sockets, in what feeds them, and on the way of an animation."""

import math

import bpy
import pytest

from nim_addon import checks
from tests.checks import rig
from tests.checks.rig import codes, dark_tint, nim, own_group


@pytest.fixture
def scene(scene):
    rig.build(scene)
    return scene


def test_a_tint_is_brought_into_range(scene):
    dark_tint(scene)
    checks.mend(scene)
    assert tuple(nim().node_tree.nodes["NIM Interface"].inputs["Tint"].default_value) == (0, 1, 1, 1)


@pytest.mark.parametrize("name", ["Index Inside", "Permeability Inside", "Index Outside", "Permeability Outside"])
@pytest.mark.parametrize("value, word", [(0.0, "refracts nothing"), (math.nan, "range"), (1e7, "range"), (-1e-9, "0")])
@pytest.mark.parametrize("fed", [False, True], ids=["in the socket", "by a Value node"])
def test_a_number_that_nothing_has(scene, one_sentence, name, value, word, fed):
    put(name, value, fed)
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "NIM", name, word)
    assert problem.code == "number" and problem.remedy is None and problem.materials == ("NIM",)


@pytest.mark.parametrize("fed", [False, True], ids=["in the socket", "by a Value node"])
@pytest.mark.parametrize(
    "name, value, word, mended",
    [
        ("Extinction Inside", -0.25, "-0.25, but it lies between 0 and 1e+06", 0.0),
        ("Extinction Outside", math.nan, "nan", 0.0),
        ("Permeability Loss Inside", 1e9, "1e+09", 1e6),
        ("Permeability Loss Outside", -1.0, "-1", 0.0),
        ("Absorption Inside", -3.0, "-3, but it lies between 0 and 1e+12", 0.0),
        ("Absorption Outside", math.inf, "e+38", 1e12),
        ("Roughness", 1.5, "1.5, but it lies between 0 and 1", 1.0),
    ],
)
def test_a_loss_that_nothing_has_is_brought_into_range(scene, one_sentence, name, value, word, mended, fed):
    socket = put(name, value, fed)
    problem = next(problem for problem in checks.problems(scene) if problem.code == "range")
    one_sentence(problem.sentence, "NIM", name, word)
    checks.mend(scene, "range")
    assert socket.default_value == pytest.approx(mended) and "range" not in codes(scene)


@pytest.mark.parametrize("quantity, loss", [("Index", "Extinction"), ("Permeability", "Permeability Loss")])
def test_a_real_part_may_be_0_where_there_is_an_imaginary_one(scene, quantity, loss):
    put(f"{quantity} Inside", 0.0)
    assert codes(scene) == ["number"]
    put(f"{loss} Inside", 1.5)
    assert "number" not in codes(scene)
    put(f"{loss} Inside", 0.0)
    put(f"{loss} Outside", 1.5)  # that of the other side is another matter
    assert "number" in codes(scene)


def test_a_loss_that_is_wrong_on_the_way(scene, one_sentence):
    socket = put("Absorption Inside", 1.0)
    for frame, value in ((1, 1.0), (11, -1.0)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    scene.frame_set(1)
    problem = next(problem for problem in checks.problems(scene) if problem.code == "range")
    one_sentence(problem.sentence, "on frame", "Absorption Inside")
    assert problem.remedy is None


def test_a_number_that_a_driver_or_ones_own_group_gives(scene):
    own_group(scene)
    group = bpy.data.node_groups["Mine"]
    group.interface.new_socket("n", in_out="INPUT", socket_type="NodeSocketFloat")
    node = next(node for node in group.nodes if node.type == "GROUP")
    group.links.new(group.nodes.new("NodeGroupInput").outputs["n"], node.inputs["Index Inside"])
    outer = bpy.data.materials["Grouped"].node_tree.nodes["Group"].inputs["n"]
    outer.default_value = -1.5
    assert codes(scene) == []
    outer.driver_add("default_value").driver.expression = "0.0"
    bpy.context.view_layer.update()
    assert codes(scene) == ["number"]


def test_a_tint_that_a_value_gives_and_an_index_that_a_colour_gives(scene):
    value, colour = (nim().node_tree.nodes.new(f"ShaderNode{name}") for name in ("Value", "RGB"))
    sockets = nim().node_tree.nodes["NIM Interface"].inputs
    nim().node_tree.links.new(value.outputs[0], sockets["Tint"])
    nim().node_tree.links.new(colour.outputs[0], sockets["Index Inside"])
    value.outputs[0].default_value, colour.outputs[0].default_value = 2.0, (0.0, 1.0, 1.0, 1.0)
    assert codes(scene) == ["tint"]
    checks.mend(scene)
    assert codes(scene) == [] and value.outputs[0].default_value == 1.0


def put(name, value, fed=False):
    tree = nim().node_tree
    socket = tree.nodes["NIM Interface"].inputs[name]
    if fed:
        node = tree.nodes.new("ShaderNodeValue")
        tree.links.new(node.outputs[0], socket)
        socket = node.outputs[0]
    socket.default_value = value
    return socket


@pytest.mark.parametrize("fed", [False, True], ids=["in the socket", "by a Value node"])
@pytest.mark.parametrize("strip", [False, True], ids=["action", "strip"])
@pytest.mark.parametrize(
    "keys, words",
    [
        ({1: -1.5, 20: 0.0, 40: -2.0}, ("is 0 on frame 20",)),
        ({1: -1.5, 20: 1e9, 40: -1.5}, ("out of range",)),
        ({1: -1.5, 40: 1.5}, ("passes through 0 before frame 21",)),
    ],
)
def test_a_number_that_is_wrong_on_the_way(scene, one_sentence, fed, strip, keys, words):
    socket = put("Index Inside", -1.5, fed)
    for frame, value in keys.items():
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    scene.frame_set(1)
    if strip:
        animation = nim().node_tree.animation_data
        action, slot = animation.action, getattr(animation, "action_slot", None)
        played = animation.nla_tracks.new().strips.new("Strip", 1, action)
        if slot:
            played.action_slot = slot
        animation.action = None
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "NIM", "Index Inside", *words)


def test_the_frame_that_is_named_is_the_scenes_where_a_strip_moves_and_stretches_the_animation(scene, one_sentence):
    socket = put("Index Inside", -1.5)
    for frame, value in ((1, -1.5), (6, 0.0), (11, -1.5)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    animation = nim().node_tree.animation_data
    action, slot = animation.action, getattr(animation, "action_slot", None)
    played = animation.nla_tracks.new().strips.new("Strip", 100, action)
    if slot:
        played.action_slot = slot
    animation.action, played.scale = None, 2
    scene.frame_set(110)
    assert socket.default_value == 0
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "NIM", "Index Inside", "is 0 on frame 110")


def test_an_animation_that_is_right(scene):
    socket = put("Index Inside", -1.5)
    for frame, value in ((1, -1.5), (40, -0.5)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    assert codes(scene) == []


def test_a_tint_that_is_wrong_on_the_way(scene, one_sentence):
    socket = nim().node_tree.nodes["NIM Interface"].inputs["Tint"]
    for frame, value in ((1, 1.0), (11, 2.0)):
        socket.default_value = (1.0, value, 1.0, 1.0)
        socket.keyframe_insert("default_value", frame=frame)
    scene.frame_set(1)
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "frame 2", "1.0")
    assert problem.code == "tint" and problem.remedy is None


def test_bumps_of_a_wide_filter_are_said_and_narrowed(scene):
    tree = nim().node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], bump.inputs["Height"])
    if "Filter Width" in bump.inputs:
        assert not checks.problems(scene)  # linked to nothing
        bump.inputs["Filter Width"].default_value = 1.0
    interface = next(node for node in tree.nodes if node.type == "GROUP")
    tree.links.new(bump.outputs["Normal"], interface.inputs["Normal"])
    (problem,) = checks.problems(scene)
    assert problem.code == "bump_filter"
    if "Filter Width" in bump.inputs:
        assert checks.mend(scene) and not checks.problems(scene)
        assert bump.inputs["Filter Width"].default_value == pytest.approx(0.1)
    else:
        assert problem.remedy is None and "4.5" in problem.sentence

# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics with materials wherever a person puts them: in slots of objects and meshes, in groups, from geometry nodes."""

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Medium
from nim_addon.scenes import shapes
from tests.caustics.rig import bake, dark_scene, mesh_object, painted, sheet

GLASS = Medium(1.5)


@pytest.fixture
def scene(empty_file):
    """2 m of glass at z = 1 over a wide grey floor at z = 0 under a sun, and an eye between that sees 4 m of the floor."""
    scene = dark_scene("SUN", 1.0, height=5, eye=0.5, width=4.0)
    scene.objects["Lamp"].data.angle = 0.0
    scene.cycles.max_bounces = 0
    mesh_object("Surface", sheet(1), interface_material("Glass", GLASS, backend="nodes"), (0, 0, 1))
    mesh_object("Floor", sheet(6), painted("Paint"))
    return scene


def through():
    """Power that passes a surface of glass of 4 square metres, as Cycles counts light within a medium."""
    return 3 * 4 * (1 - 0.04) / 1.5**2


# ------------------------------------------------------------------------------------------------ where they sit


def test_a_surface_with_its_material_on_the_object(scene):
    surface = scene.objects["Surface"]
    glass = surface.material_slots[0].material
    surface.material_slots[0].material = None
    surface.material_slots[0].link, surface.material_slots[0].material = "OBJECT", glass
    assert bake(scene)["Floor"] == pytest.approx(through(), rel=0.01)


def test_a_floor_with_its_material_on_the_object_keeps_its_colour(scene, render):
    floor = scene.objects["Floor"]
    floor.material_slots[0].link, floor.material_slots[0].material = "OBJECT", painted("Green", (0.1, 0.6, 0.2))
    bake(scene)
    middle = render(scene)[12:20, 12:20].mean((0, 1))
    assert middle == pytest.approx(np.array((0.1, 0.6, 0.2)) * through() / 12 / np.pi, rel=0.03)


def test_a_nim_on_an_object_beside_another_stands_where_it_stood(scene):
    """It took light as a white surface, and a grey copy stood in its place."""
    power = bake(scene)["Floor"]
    nim = interface_material("NIM", Medium(-1.5), backend="nodes")
    mesh_object("Other", shapes.rectangle((-1, -1), (1, 1)), nim, (3, 0, 1), "OBJECT")
    assert bake(scene) == {"Floor": pytest.approx(2 * power, rel=0.02)}
    assert [one.name for one in caustics.baked(scene).objects if one.type == "MESH"] == ["NIM Caustics Floor"]


def wearing(thing, material):
    """Let geometry nodes give an object its material."""
    tree = bpy.data.node_groups.new("Wear", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    enter, wear, leave = map(tree.nodes.new, ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput"))
    wear.inputs["Material"].default_value = material
    tree.links.new(enter.outputs[0], wear.inputs["Geometry"])
    tree.links.new(wear.outputs[0], leave.inputs[0])
    thing.modifiers.new("Wear", "NODES").node_group = tree


@pytest.mark.parametrize("way", ["geometry nodes", "view layer", "instance"])
def test_a_material_that_comes_from_elsewhere(way, scene, render):
    surface, floor = scene.objects["Surface"], scene.objects["Floor"]
    glass = surface.material_slots[0].material
    if way == "geometry nodes":
        surface.data.materials.clear()
        wearing(surface, glass)
        floor.data.materials.clear()
        wearing(floor, painted("Green", (0.1, 0.6, 0.2)))
    elif way == "view layer":  # a floor of glass takes no light
        scene.view_layers[0].material_override = glass
        with pytest.raises(ValueError, match="no diffuse surface"):
            bake(scene)
        return
    else:
        held = bpy.data.collections.new("Held")
        scene.collection.objects.unlink(surface)
        held.objects.link(surface)
        empty = bpy.data.objects.new("Empty", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", held
        scene.collection.objects.link(empty)
        surface.material_slots[0].link, surface.material_slots[0].material = "OBJECT", glass
        surface.data.materials[0] = None
    assert bake(scene)["Floor"] == pytest.approx(through(), rel=0.01)
    if way == "geometry nodes":
        middle = render(scene)[12:20, 12:20].mean((0, 1))
        assert middle == pytest.approx(np.array((0.1, 0.6, 0.2)) * through() / 12 / np.pi, rel=0.03)


# ------------------------------------------------------------------------------------------------ what shines


def half(nodes):
    """Grey paint, half of it black, its colour from a texture."""
    color = nodes.add("ShaderNodeRGB")
    color.outputs[0].default_value = (0.1, 0.6, 0.2, 1.0)
    paint = nodes.add("ShaderNodeBsdfDiffuse", inputs={"Color": color.outputs[0]})
    black = nodes.add("ShaderNodeBsdfDiffuse", inputs={"Color": (0, 0, 0)})
    return nodes.add("ShaderNodeMixShader", inputs={0: 0.5, 1: paint.outputs[0], 2: black.outputs[0]})


@pytest.mark.parametrize("where", ["material", "group"])
def test_a_mixture_shines_with_what_each_part_of_it_sends_back(where, scene, render):
    material = bpy.data.materials.new("Mixed")
    nodes = Nodes(empty_tree(material))
    if where == "group":
        group = bpy.data.node_groups.new("Mine", "ShaderNodeTree")
        group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        inner = Nodes(group)
        inner.add("NodeGroupOutput", inputs={0: half(inner).outputs[0]})
        nodes.end(nodes.add("ShaderNodeGroup", node_tree=group))
    else:
        nodes.end(half(nodes))
    scene.objects["Floor"].material_slots[0].material = material
    groups = set(bpy.data.node_groups)
    bake(scene)
    middle = render(scene)[12:20, 12:20].mean((0, 1))
    assert middle == pytest.approx(np.array((0.1, 0.6, 0.2)) / 2 * through() / 12 / np.pi, rel=0.03)
    caustics.clear(scene)
    assert set(bpy.data.node_groups) == groups

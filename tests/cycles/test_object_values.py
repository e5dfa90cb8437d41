# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material reads of its object reaches the copies by which caustics are traced, and in which they shine."""

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics.lights import Sun
from nim_addon.caustics.photons import Tracer
from nim_addon.cycles.material import asked_interfaces, interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Interface, Medium
from tests.caustics.rig import landed_of, over_floor, sheet

SUN = Sun((0.5, 0, -1), (1.0, 1.0, 1.0), 0.0)
N = 1.7


@pytest.fixture
def scene(empty_file):
    """A sheet at z = 0, whose index inside is to come from elsewhere, over a floor at z = -1."""
    return over_floor(interface_material("Sheet", Medium(N), backend="nodes"), sheet(1), name="Sheet", size=32).scene


def fed(thing, build):
    """Feed the index inside of an object's material with the output of build(nodes)."""
    material = thing.material_slots[0].material
    node = asked_interfaces(material)[0].node
    nodes = Nodes(material.node_tree)
    nodes.feed(node.inputs["Index Inside"], build(nodes))


def landed(scene, passes=2):
    return landed_of(scene, SUN, 160**2, passes)[1].place


def index_of(scene):
    """The index that the photons met, by Snell's law; the middle of what landed."""
    places = landed(scene)[:, 0]
    x = (places.min() + places.max()) / 2
    return np.sin(np.arctan(0.5)) / np.sin(np.arctan(x))


def attribute(kind, name, scale=1.0):
    def build(nodes):
        node = nodes.add("ShaderNodeAttribute", attribute_type=kind, attribute_name=name)
        return nodes.math("MULTIPLY", node.outputs["Fac"], scale)

    return build


@pytest.mark.parametrize("where", ["object", "data", "path", "instancer", "scene", "view layer"])
def test_an_attribute_reaches_the_photons(where, scene):
    surface = scene.objects["Sheet"]
    owner = {"data": surface.data, "scene": scene, "view layer": scene.view_layers[0]}.get(where, surface)
    if where == "path":
        surface.empty_display_size = N
        fed(surface, attribute("OBJECT", "empty_display_size"))
    else:
        owner["n"] = N
        kind = {"scene": "VIEW_LAYER", "view layer": "VIEW_LAYER", "instancer": "INSTANCER"}.get(where, "OBJECT")
        fed(surface, attribute(kind, "n"))
    assert index_of(scene) == pytest.approx(N, rel=0.01)


@pytest.mark.parametrize("output", ["Color", "Object Index", "Location"])
def test_object_info_reaches_the_photons(output, scene):
    surface = scene.objects["Sheet"]
    surface.color, surface.pass_index, surface.location = (0.25, 0, 0, 1), 17, (0, 0, 0)
    surface.parent = bpy.data.objects.new("Sheared", None)
    scene.collection.objects.link(surface.parent)
    scale = {"Color": N / 0.25, "Object Index": 0.1, "Location": 1.0}[output]
    if output == "Location":
        # a sheared object, whose copy stands elsewhere
        surface.parent.scale, surface.parent.location, surface.rotation_euler.z = (1.5, 1, 1), (N, 0, 0), 0.4

    def build(nodes):
        source = nodes.add("ShaderNodeObjectInfo").outputs[output]
        if output != "Object Index":
            source = nodes.add("ShaderNodeSeparateXYZ", inputs={0: source}).outputs[0]
        return nodes.math("MULTIPLY", source, scale)

    fed(surface, build)
    shift = N if output == "Location" else 0.0
    places = landed(scene)[:, 0]
    x = (places.min() + places.max()) / 2 - shift
    assert np.sin(np.arctan(0.5)) / np.sin(np.arctan(x)) == pytest.approx(N, rel=0.02)


def look(scene, render):
    """Mean of a picture of a surface that shines as bright as its random number, straight from above."""
    scene.camera.location, scene.camera.rotation_euler = (0, 0, 5), (0, 0, 0)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.cycles.samples = 1
    return render(scene).mean()


def test_the_random_number_is_that_of_the_object(scene, render):
    """Of what bends photons, and of the copy that takes the place of a floor."""
    surface = scene.objects["Sheet"]
    nodes = Nodes(empty_tree(bpy.data.materials.new("Random")))
    random = nodes.add("ShaderNodeObjectInfo").outputs["Random"]
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": (1, 1, 1), "Strength": random}))
    kept = surface.material_slots[0].material
    surface.material_slots[0].material = bpy.data.materials["Random"]
    stage_camera(scene)
    number = look(scene, render)
    surface.material_slots[0].material = kept

    def build(nodes):
        random = nodes.add("ShaderNodeObjectInfo").outputs["Random"]
        return nodes.math("ADD", 1.0, random)

    fed(surface, build)
    assert 0.01 < number < 1
    assert index_of(scene) == pytest.approx(1 + number, rel=0.01)
    # the floor shines by its number, and diffusely too
    floor = scene.objects["Floor"]
    tree = floor.material_slots[0].material.node_tree
    nodes = Nodes(tree)
    shown = tree.get_output_node("CYCLES").inputs["Surface"]
    random = nodes.add("ShaderNodeObjectInfo").outputs["Random"]
    glow = nodes.add("ShaderNodeEmission", inputs={"Color": (1, 1, 1), "Strength": random})
    both = nodes.add("ShaderNodeAddShader", inputs={0: shown.links[0].from_socket, 1: glow.outputs[0]})
    nodes.feed(shown, both.outputs[0])
    surface.visible_camera = False
    before = look(scene, render)
    caustics.bake(scene, [SUN], texels=64, photons=1 << 12)
    for thing in caustics.baked(scene).objects:
        thing.hide_render = thing.type == "LIGHT"
    baked = look(scene, render)
    passed = (1 - float(Interface(Medium(1 + number)).fresnel(np.cos(np.arctan(0.5))).R)) / (1 + number) ** 2
    assert baked - before == pytest.approx(passed * 0.5 / np.pi, rel=0.1)


def stage_camera(scene):
    scene.camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("Dark")
    empty_tree(scene.world)


def test_instances_made_by_geometry_nodes_are_traced_but_not_by_their_attributes(scene, one_sentence):
    """Cubes that belong to no object, as geometry nodes make them."""
    tree = bpy.data.node_groups.new("Cubes", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    surface = scene.objects["Sheet"]
    material = surface.material_slots[0].material
    kinds = "NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeMeshGrid", "GeometryNodeSetMaterial"
    enter, points, grid, wear, leave = map(tree.nodes.new, (*kinds, "NodeGroupOutput"))
    for name in ("Size X", "Size Y"):
        grid.inputs[name].default_value = 2.0
    wear.inputs["Material"].default_value = material
    tree.links.new(enter.outputs[0], points.inputs["Points"])
    tree.links.new(grid.outputs[0], wear.inputs["Geometry"])
    tree.links.new(wear.outputs[0], points.inputs["Instance"])
    tree.links.new(points.outputs[0], leave.inputs[0])
    point = bpy.data.meshes.new("Point")
    point.from_pydata([(0, 0, 0)], [], [])
    makes = bpy.data.objects.new("Makes", point)
    scene.collection.objects.link(makes)
    makes.modifiers.new("Cubes", "NODES").node_group = tree
    bpy.data.objects.remove(surface)
    assert index_of(scene) == pytest.approx(N, rel=0.01)
    node = asked_interfaces(material)[0].node
    nodes = Nodes(material.node_tree)
    nodes.feed(node.inputs["Index Inside"], attribute("INSTANCER", "n")(nodes))
    with pytest.raises(ValueError) as error, Tracer(scene):
        pass
    one_sentence(error.value, "Makes", "instance")

# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics in scenes as people make them: what they leave in materials, collections and transforms."""

import bpy
import mathutils
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.cycles import meshes
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.visibility import CAUSTICS_HIDDEN
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces
from tests.caustics.rig import bake, material_of, mesh_object


def corners(obj):
    return meshes.vertices(obj.data, obj.matrix_world)


# ------------------------------------------------------------------------------------------------ materials


@pytest.mark.parametrize("lost", ["links", "output"])
def test_a_material_that_shows_nothing_takes_no_light_and_the_last_bake_stays(lost, build, one_sentence):
    scene = build()
    bake(scene)
    tree = scene.objects["Floor"].data.materials[0].node_tree
    if lost == "links":
        tree.links.clear()
    else:
        tree.nodes.remove(tree.get_output_node("CYCLES"))
    with pytest.raises(ValueError) as error:
        bake(scene)
    one_sentence(error.value, "diffuse")
    assert caustics.baked(scene) and scene.objects["Floor"].hide_render
    mesh_object("Lower", shapes.rectangle((-4, -4), (4, 4), -1.0), material_of("ShaderNodeBsdfPrincipled", "Lower"))
    scene.objects["Floor"].hide_render = True
    del scene.objects["Floor"][CAUSTICS_HIDDEN]
    assert set(bake(scene)) == {"Lower"}


def test_nodes_that_are_linked_to_nothing_do_not_count(build):
    scene = build()
    material = scene.objects["Ball"].data.materials[0]
    wanted = bake(scene)["Floor"]
    material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    assert not caustics.out_of_date(scene)
    assert bake(scene)["Floor"] == wanted
    material.node_tree.nodes["NIM Interface"].inputs["Index Inside"].default_value = -1.5
    assert caustics.out_of_date(scene)
    nodes = Nodes(empty_tree(material))
    nodes.add("ShaderNodeBsdfPrincipled")
    nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs={"Roughness": 0.0, "IOR": 1.5}))
    assert bake(scene)["Floor"] == pytest.approx(wanted, rel=0.02)
    # nor does an interface in a floor's material that its output does not ask
    paint = scene.objects["Floor"].data.materials[0].node_tree
    paint.nodes.new("ShaderNodeGroup").node_tree = (
        interface_material("Other", Medium(-1.5)).node_tree.nodes["NIM Interface"].node_tree
    )
    assert bake(scene)["Floor"] == pytest.approx(wanted, rel=0.02)


def test_a_material_with_its_nodes_off_shines_too(build, render):
    if bpy.app.version >= (5, 0):
        pytest.skip("nodes cannot be switched off here")
    scene = build()
    paint = scene.objects["Floor"].data.materials[0]
    paint.diffuse_color = (0.8, 0.8, 0.8, 1.0)
    paint.use_nodes = False
    for lamp in (obj for obj in scene.objects if obj.type == "LIGHT"):
        lamp.data.energy = 3.0
    bake(scene)
    for lamp in (obj for obj in scene.objects if obj.type == "LIGHT"):
        lamp.hide_render = True
    assert render(scene).max() > 0.1


# ------------------------------------------------------------------------------------------------ shapes and places


def test_a_surface_of_curves_is_one_surface(build):
    scene = build()
    ball = scene.objects["Ball"]
    glass = ball.data.materials[0]
    bpy.data.objects.remove(ball)
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0, 0, 2))
    curved = bpy.context.object
    curved.data.materials.append(glass)
    power = bake(scene)["Floor"]
    mesh = bpy.data.meshes.new_from_object(curved.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    assert not caustics.out_of_date(scene)
    curved.data.splines[0].points[0].co.x += 0.1
    assert caustics.out_of_date(scene)
    bpy.data.objects.remove(curved)
    ball = bpy.data.objects.new("Ball", mesh)
    ball.location = (0, 0, 2)
    scene.collection.objects.link(ball)
    assert power > 1 and power == pytest.approx(bake(scene)["Floor"], rel=0.02)


@pytest.mark.parametrize("name", ["Floor", "Ball"])
def test_sheared_objects_keep_their_shape(name, build):
    scene = build()
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.scale = (3, 1, 1)
    obj = scene.objects[name]
    obj.parent, obj.rotation_euler = parent, (0, 0, 0.7)
    scene.view_layers[0].update()
    before, power = corners(obj), bake(scene)
    copy = next(obj for obj in caustics.baked(scene).objects if obj.type == "MESH")
    scene.view_layers[0].update()
    np.testing.assert_allclose(corners(copy), before if name == "Floor" else corners(scene.objects["Floor"]), atol=1e-5)
    # the same, its transform applied
    caustics.clear(scene)
    obj.data.transform(obj.matrix_world)
    obj.parent, obj.matrix_world = None, mathutils.Matrix.Identity(4)
    assert power["Floor"] == pytest.approx(bake(scene)["Floor"], rel=0.02)


def test_a_mirrored_ball_is_not_inside_out(build):
    scene = build("POINT")
    power = bake(scene)["Floor"]
    scene.objects["Ball"].scale = (-1, 1, 1)
    assert bake(scene)["Floor"] == pytest.approx(power, rel=0.02)


def test_a_floor_without_height_has_an_area(build):
    scene = build()
    power = bake(scene)["Floor"]
    scene.objects["Floor"].scale = (1, 1, 0)
    assert bake(scene)["Floor"] == pytest.approx(power, rel=0.02)


# ------------------------------------------------------------------------------------------------ what a render shows


def moved(obj, name):
    """Put an object into a new collection of the scene; returns the collection and its layer."""
    collection = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    return collection, bpy.context.view_layer.layer_collection.children[name]


@pytest.mark.parametrize("way", ["excluded", "not rendered"])
def test_a_lamp_that_no_render_shows_is_not_traced(way, build):
    scene = build()
    power = bake(scene)["Floor"]
    data = bpy.data.lights.new("Second", "SUN")
    data.energy = 50
    second = bpy.data.objects.new("Second", data)
    scene.collection.objects.link(second)
    collection, layer = moved(second, "Off")
    if way == "excluded":
        layer.exclude = True
    else:
        collection.hide_render = True
    assert bake(scene)["Floor"] == pytest.approx(power, rel=0.02)
    assert not any("Second" in obj.name for obj in caustics.baked(scene).objects)


@pytest.mark.parametrize("way", ["eye", "collection in viewports", "collection's eye", "collection in renders"])
def test_what_throws_a_shadow_is_what_a_render_shows(way, build):
    scene = build()
    power = bake(scene)["Floor"]
    roof = mesh_object("Roof", shapes.rectangle((-2, -2), (2, 2), 4.0), surfaces.plain("Roof", (0.5, 0.5, 0.5)))
    if way == "eye":
        roof.hide_set(True)
    else:
        collection, layer = moved(roof, "Off")
        owner, name = {
            "collection in viewports": (collection, "hide_viewport"),
            "collection's eye": (layer, "hide_viewport"),
            "collection in renders": (collection, "hide_render"),
        }[way]
        setattr(owner, name, True)
    if way == "collection in renders":
        assert bake(scene)["Floor"] == pytest.approx(power, rel=0.02)
    else:
        with pytest.raises(ValueError, match="no light lands"):
            bake(scene)
        assert roof.hide_get() if way == "eye" else getattr(owner, name)


def test_what_is_instanced_from_a_floor_stays_in_the_picture(build, render):
    scene = build()
    mesh_object("Lower", shapes.rectangle((-9, -9), (9, 9), -1.0), material_of("ShaderNodeBsdfPrincipled", "Lower"))
    floor = scene.objects["Floor"]
    red = surfaces.shining("Red", lambda nodes: (1, 0, 0), 50.0)
    stone = mesh_object("Stone", shapes.box((-0.4, -0.4, 0), (0.4, 0.4, 0.1)), red)
    stone.parent, floor.instance_type = floor, "VERTS"
    scene.cycles.samples = 64
    before = render(scene)[..., 0]  # the stones light the floor's corners
    power = bake(scene)
    assert set(power) == {"Lower"} and not floor.hide_render
    after = render(scene)[..., 0]
    assert before[:4, :4].mean() > 2 * before[8, 8]
    assert after[:4, :4].mean() == pytest.approx(before[:4, :4].mean(), rel=0.2)


def test_what_another_scene_shows_too_is_not_hidden(build, one_sentence):
    scene = build()
    bpy.data.scenes.new("Other").collection.objects.link(scene.objects["Floor"])
    with pytest.raises(ValueError) as error:
        bake(scene)
    one_sentence(error.value, "another scene")
    assert not scene.objects["Floor"].hide_render


@pytest.mark.parametrize("way", ["keyframes", "strip", "driver"])
def test_what_keyframes_show_again_is_not_hidden(way, build, one_sentence):
    scene = build()
    floor = scene.objects["Floor"]
    if way == "driver":
        floor.driver_add("hide_render").driver.expression = "0"
    else:
        floor.keyframe_insert("hide_render", frame=1)
    if way == "strip":
        animation = floor.animation_data
        strip = animation.nla_tracks.new().strips.new("Strip", 1, animation.action)
        if hasattr(strip, "action_slot"):
            strip.action_slot = animation.action_slot
        animation.action = None
    with pytest.raises(ValueError) as error:
        bake(scene)
    one_sentence(error.value, "keyframes")
    assert not floor.hide_render


def test_the_copy_is_seen_as_the_surface_is(build, render):
    scene = build()
    floor = scene.objects["Floor"]
    floor.visible_camera = floor.visible_shadow = False
    floor.color, floor.pass_index, floor["mine"] = (1, 0, 0, 1), 7, 0.5
    scene.objects["Ball"].visible_camera = False
    bake(scene)
    copy = next(obj for obj in caustics.baked(scene).objects if obj.type == "MESH")
    assert not copy.visible_camera and not copy.visible_shadow
    assert tuple(copy.color) == (1, 0, 0, 1) and copy.pass_index == 7 and copy["mine"] == 0.5
    assert render(scene).max() == 0

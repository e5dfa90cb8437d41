# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics in scenes as people make them: what they leave in materials, collections and transforms, and what they change."""

import math

import bpy
import mathutils
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics import placing
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.visibility import CAUSTICS_HIDDEN
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, sphere, surfaces

ENERGY = {"SUN": 3.0, "POINT": 500.0}


def mesh_object(name, shape, material, scene=None, location=(0, 0, 0)):
    data = bpy.data.meshes.new(name)
    vertices, faces = shape[:2]
    data.from_pydata(vertices, [], faces)
    data.materials.append(material)
    thing = bpy.data.objects.new(name, data)
    thing.location = location
    (scene or bpy.context.scene).collection.objects.link(thing)
    return thing


@pytest.fixture
def build(empty_file):
    """build(lamp) -> a scene: a ball of glass at z = 2 over a floor of 8 m at z = 0, a lamp at z = 6, an eye above."""

    def made(lamp="SUN"):
        scene = bpy.context.scene
        scene.render.engine, scene.cycles.samples = "CYCLES", 4
        scene.render.resolution_x = scene.render.resolution_y = 32
        empty_tree(bpy.data.worlds.new("Dark"))
        scene.world = bpy.data.worlds["Dark"]
        glass = interface_material("Glass", Medium(1.5), backend="nodes")
        bpy.ops.mesh.primitive_ico_sphere_add(radius=1, location=(0, 0, 2), subdivisions=3)
        ball = bpy.context.object
        ball.name = "Ball"
        ball.data.materials.append(glass)
        ball.data.shade_smooth()
        mesh_object("Floor", shapes.rectangle((-4, -4), (4, 4)), principled("Paint"))
        data = bpy.data.lights.new("Lamp", lamp)
        data.energy = ENERGY[lamp]
        thing = bpy.data.objects.new("Lamp", data)
        thing.location = (0, 0, 6)
        scene.collection.objects.link(thing)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 8.0, (0, 0, 9)
        scene.collection.objects.link(camera)
        scene.camera = camera
        return scene

    return made


def principled(name):
    material = bpy.data.materials.new(name)
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfPrincipled"))
    return material


def bake(scene, **options):
    return caustics.bake(scene, **{"photons": 1 << 16, "texels": 128} | options)


def corners(thing):
    return np.array([thing.matrix_world @ vertex.co for vertex in thing.data.vertices])


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
    mesh_object("Lower", shapes.rectangle((-4, -4), (4, 4), -1.0), principled("Lower"), scene)
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
    for lamp in (thing for thing in scene.objects if thing.type == "LIGHT"):
        lamp.data.energy = 3.0
    bake(scene)
    for lamp in (thing for thing in scene.objects if thing.type == "LIGHT"):
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
    thing = scene.objects[name]
    thing.parent, thing.rotation_euler = parent, (0, 0, 0.7)
    scene.view_layers[0].update()
    before, power = corners(thing), bake(scene)
    copy = next(one for one in caustics.baked(scene).objects if one.type == "MESH")
    scene.view_layers[0].update()
    np.testing.assert_allclose(corners(copy), before if name == "Floor" else corners(scene.objects["Floor"]), atol=1e-5)
    # the same, its transform applied
    caustics.clear(scene)
    thing.data.transform(thing.matrix_world)
    thing.parent, thing.matrix_world = None, mathutils.Matrix.Identity(4)
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


def moved(thing, name):
    """Put an object into a new collection of the scene; returns the collection and its layer."""
    collection = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(thing)
    collection.objects.link(thing)
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
    assert not any("Second" in thing.name for thing in caustics.baked(scene).objects)


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
    mesh_object("Lower", shapes.rectangle((-9, -9), (9, 9), -1.0), principled("Lower"))
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
    copy = next(one for one in caustics.baked(scene).objects if one.type == "MESH")
    assert not copy.visible_camera and not copy.visible_shadow
    assert tuple(copy.color) == (1, 0, 0, 1) and copy.pass_index == 7 and copy["mine"] == 0.5
    assert render(scene).max() == 0


# ------------------------------------------------------------------------------------------------ what is kept


def test_what_a_person_put_into_the_collection_stays_in_the_scene(build):
    scene = build()
    bake(scene)
    mine, box = bpy.data.objects.new("Mine", None), bpy.data.collections.new("Box")
    caustics.baked(scene).objects.link(mine)
    caustics.baked(scene).children.link(box)
    bake(scene)
    caustics.clear(scene)
    assert "Mine" in scene.collection.objects and "Box" in scene.collection.children


@pytest.mark.parametrize("change", ["emptied", "another"])
def test_a_sky_changed_after_the_bake_can_be_cleared(change, empty_file):
    scene = sphere.build(sphere.SphereParameters(n=1.5, sun_angle=0.5), "nodes")
    sky = scene.world
    method = sky.cycles.sampling_method
    bake(scene)
    if change == "emptied":
        sky.node_tree.nodes.clear()
    else:
        scene.world = bpy.data.worlds.new("Mine")
    caustics.clear(scene)
    assert not caustics.left(scene) and not scene.objects["Ground"].hide_render
    assert sky.cycles.sampling_method == method
    if change == "another":
        assert sky.node_tree.nodes["NIM Sun hidden"].outputs[0].default_value == 0


def test_what_was_hidden_comes_back_though_its_copy_was_deleted(build):
    scene = build()
    bake(scene)
    collection = caustics.baked(scene)
    bpy.data.batch_remove([*collection.objects, collection])
    assert scene.objects["Floor"].hide_render and caustics.left(scene)
    caustics.clear(scene)
    assert not scene.objects["Floor"].hide_render and not caustics.left(scene)
    assert scene.objects["Lamp"].data.cycles.use_multiple_importance_sampling


def test_namesakes_from_a_library_are_told_apart(build, tmp_path):
    scene = build()
    wanted = bake(scene)["Floor"]
    caustics.clear(scene)
    scene.objects["Floor"].location.x, scene.objects["Ball"].location.x = 40, 40
    index = scene.objects["Ball"].data.materials[0].node_tree.nodes["NIM Interface"].inputs["Index Inside"]
    index.default_value = -1.5
    bpy.data.libraries.write(str(tmp_path / "far.blend"), {scene.objects["Floor"], scene.objects["Ball"]})
    index.default_value = 1.5
    own = {name: scene.objects[name] for name in ("Floor", "Ball")}
    for thing in own.values():
        thing.location.x = 0
        scene.collection.objects.unlink(thing)
    with bpy.data.libraries.load(str(tmp_path / "far.blend"), link=True) as (_, to):
        to.objects = ["Floor", "Ball"]
    for thing in (*to.objects, *own.values()):
        scene.collection.objects.link(thing)
    assert bake(scene)["Floor"] == pytest.approx(wanted, rel=0.05)
    assert own["Floor"].hide_render and not to.objects[0].hide_render


@pytest.mark.parametrize("name", ["Floor", "Lamp"])
def test_overrides_of_a_library_stay_as_they_are(name, build, tmp_path, one_sentence):
    scene = build()
    held = bpy.data.collections.new("Held")
    held.objects.link(scene.objects[name])
    bpy.data.libraries.write(str(tmp_path / "held.blend"), {held})
    bpy.data.objects.remove(scene.objects[name])
    with bpy.data.libraries.load(str(tmp_path / "held.blend"), link=True) as (_, to):
        to.objects = [name]
    thing = to.objects[0].override_create()
    scene.collection.objects.link(thing)
    thing.data.override_create(remap_local_usages=True)
    # a mark on them is not saved, and nothing would find them again
    with pytest.raises(ValueError) as error:
        bake(scene)
    one_sentence(error.value, "overrid")
    assert not caustics.left(scene) and not thing.hide_render


def test_caustics_may_lie_in_another_collection(build):
    scene = build()
    bake(scene)
    box = bpy.data.collections.new("Box")
    scene.collection.children.link(box)
    box.children.link(caustics.baked(scene))
    scene.collection.children.unlink(caustics.baked(scene))
    assert caustics.baked(scene) and not caustics.out_of_date(scene)
    mine = bpy.data.objects.new("Mine", None)
    caustics.baked(scene).objects.link(mine)
    scene.objects["Ball"].location.x = 1
    assert caustics.out_of_date(scene)
    caustics.clear(scene)
    assert not caustics.left(scene) and "NIM Caustics" not in bpy.data.collections
    assert box in set(scene.collection.children) and "Mine" in scene.objects


def test_a_copy_that_was_taken_for_its_surface_makes_caustics_out_of_date(build, tmp_path):
    scene = build()
    scene.objects["Floor"].rotation_euler = (0.1, 0.2, 0.3)
    bake(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    scene = bpy.context.scene
    copy = next(one for one in caustics.baked(scene).objects if one.type == "MESH")
    copy.name, copy.hide_viewport = "Mine", True
    assert not caustics.out_of_date(scene)
    copy.location.x += 1
    assert caustics.out_of_date(scene)
    copy.location.x -= 1
    assert not caustics.out_of_date(scene)
    bpy.data.objects.remove(copy)
    assert caustics.out_of_date(scene)
    bake(scene)
    assert not caustics.out_of_date(scene)


def test_how_things_are_shown_does_not_make_caustics_out_of_date(build):
    scene = build()
    modifier = scene.objects["Ball"].modifiers.new("Decimate", "DECIMATE")
    modifier.decimate_type, modifier.delimit = "DISSOLVE", {"NORMAL", "MATERIAL", "SEAM", "SHARP"}
    marks = {caustics.digest(scene)}
    modifier.show_expanded = not modifier.show_expanded
    modifier.show_viewport = not modifier.show_viewport
    marks.add(caustics.digest(scene))
    assert len(marks) == 1
    modifier.angle_limit = math.radians(30)
    assert caustics.digest(scene) not in marks


def test_a_state_that_is_none_and_a_folder_that_is_not_there(build, tmp_path, one_sentence):
    scene = build()
    np.save(tmp_path / "state.npy", np.zeros(3))
    with caustics.Bake(scene, texels=64, photons=1 << 12) as one:
        assert not one.load(tmp_path / "state.npy")
    with pytest.raises(OSError) as error:
        bake(scene, file=tmp_path / "nowhere" / "state")
    one_sentence(error.value, "nowhere")


def test_a_bake_that_fails_at_its_end_leaves_the_scene_as_it_was(build, monkeypatch):
    scene = build()

    def full(*_):
        raise MemoryError("no room for another lamp")

    monkeypatch.setattr(placing, "split", full)
    with pytest.raises(MemoryError):
        bake(scene)
    assert not caustics.baked(scene) and not any(thing.hide_render for thing in scene.objects)
    assert not [thing.name for thing in scene.objects if "NIM" in thing.name]

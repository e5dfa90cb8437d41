# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons of every kind of lamp are the lamp's own light: where, and how much, against Cycles' own picture of it."""

import math

import bpy
import mathutils
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics import lights
from nim_addon.caustics.photons import Tracer
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage
from tests.caustics.rig import floor_eye, over_floor, sheet

SIZE, BLOCKS = 32, 8
LAMPS = {
    "sun": ("SUN", {"energy": 3.0, "angle": math.radians(20)}),
    # a sphere; with Soft Falloff it is a disk that faces each place, which no light can be: (radius / distance)^2 darker
    "point": ("POINT", {"energy": 100.0, "shadow_soft_size": 0.4, "use_soft_falloff": False}),
    "spot": (
        "SPOT",
        {
            "energy": 200.0,
            "shadow_soft_size": 0.3,
            "spot_size": math.radians(80),
            "spot_blend": 1.0,
            "use_soft_falloff": False,
        },
    ),
    "area": ("AREA", {"energy": 60.0, "shape": "RECTANGLE", "size": 1.5, "size_y": 0.5}),
    "disk": ("AREA", {"energy": 60.0, "shape": "DISK", "size": 1.2}),
}


def stage_of(kind, medium):
    """A wide grey floor at z = -1 under 3 m x 3 m of a medium at z = 0 (or None), a slanting lamp, and an eye between."""
    material = interface_material("Surface", medium, backend="nodes") if medium else None
    stage = over_floor(material, sheet(1.5), albedo=(0.6, 0.5, 0.4), size=SIZE)
    floor_eye(stage, 4.0)
    name, values = LAMPS[kind]
    data = bpy.data.lights.new("Lamp", name)
    data.color = (1.0, 0.8, 0.5)
    for key, value in values.items():
        setattr(data, key, value)
    lamp = stage.object("Lamp", data, (0.7, -0.5, 1.6))
    lamp.rotation_euler = mathutils.Vector((-0.35, 0.2, -1.0)).to_track_quat("-Z", "Y").to_euler()
    return stage.scene


def blocks(picture):
    step = SIZE // BLOCKS
    return picture.reshape(BLOCKS, step, BLOCKS, step, 3).mean((1, 3))


def baked(scene, render, seed):
    caustics.bake(scene, texels=256, photons=1 << 19, seed=seed)
    scene.cycles.seed = seed
    return blocks(render(scene))


@pytest.mark.parametrize("kind", LAMPS)
def test_through_a_surface_that_changes_nothing_the_light_is_the_lamps(kind, empty_file, render):
    scene = stage_of(kind, None)
    scene.cycles.samples = 512
    straight = blocks(render(scene))
    scene = stage_of(kind, Medium(1.0))
    scene.cycles.samples = 128
    one, other = (baked(scene, render, seed) for seed in (0, 100))
    noise = np.sqrt(np.mean((one - other) ** 2) / 4)  # of the mean of both
    off = (one + other) / 2 - straight
    assert noise < 0.01 * straight.max()
    assert np.sqrt(np.mean(off**2)) < 1.5 * noise
    assert (one + other).mean((0, 1)) / 2 == pytest.approx(straight.mean((0, 1)), rel=0.003)


def assert_same_mean(scene, render):
    """What is found by chance and what is baked, in every block and on the whole, in each colour."""
    scene.cycles.max_bounces = 1024
    scene.cycles.samples = 4096
    picture = render(scene)
    scene.cycles.samples = 256
    one, other = (baked(scene, render, seed) for seed in (0, 100))
    off = (one + other) / 2 - blocks(picture)
    for color in range(3):
        # of the path tracer, from neighbouring pixels, and of the bakes
        noise = np.sqrt(np.mean(np.diff(picture[..., color], axis=0) ** 2) / 2 * (BLOCKS / SIZE) ** 2)
        noise = math.hypot(noise, np.sqrt(np.mean((one - other)[..., color] ** 2) / 4))
        assert noise < 0.1 * picture[..., color].mean()
        assert np.sqrt(np.mean(off[..., color] ** 2)) < 1.5 * noise
        assert abs(off[..., color].mean()) < 3 * noise / BLOCKS


@pytest.mark.parametrize("kind", ["sun", "point", "area"])
def test_baked_and_path_traced_light_have_the_same_mean(kind, empty_file, render):
    """A wide lamp, which a path tracer can find by chance through the NIM."""
    assert_same_mean(stage_of(kind, Medium(-1.5, -3.0)), render)


def test_through_several_tinted_media(empty_file, render):
    """Air, then water, then a NIM on the floor: each crossing counts by its own indices, and colours the light."""
    scene = stage_of("sun", Medium(1.33))
    below = interface_material("Below", Medium(-1.6), Medium(1.33), backend="nodes", tint=(0.9, 0.5, 0.3))
    data = bpy.data.meshes.new("Below")
    data.from_pydata([(x, y, -0.4) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))], [], [(0, 1, 2, 3)])
    data.materials.append(below)
    scene.collection.objects.link(bpy.data.objects.new("Below", data))
    surface = scene.objects["Surface"]
    surface.scale = (4 / 3, 4 / 3, 1)
    assert_same_mean(scene, render)


def blenders(kind, color=(1.0, 0.9, 0.7)):
    """A material of one of Blender's own sharp closures, of index 1.5."""
    material = bpy.data.materials.new(kind)
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add(f"ShaderNodeBsdf{kind}", inputs={"Color": color, "Roughness": 0.0, "IOR": 1.5}))
    return material


@pytest.mark.parametrize("below", [None, Medium(-1.33)], ids=["alone", "over a NIM"])
@pytest.mark.parametrize("kind", ["Glass", "Refraction"])
def test_through_blenders_own_glass(kind, below, empty_file, render):
    """Its crossings count as those of our interface do, whatever else stands in the scene."""
    scene = stage_of("sun", Medium(1.5))
    surface = scene.objects["Surface"]
    surface.data.materials[0] = blenders(kind)
    surface.scale = (4 / 3, 4 / 3, 1)
    if below:
        # a slab of a NIM within the glass
        data = bpy.data.meshes.new("Slab")
        vertices, faces = shapes.box((-2, -2, -0.6), (2, 2, -0.4))
        data.from_pydata(vertices, [], faces)
        data.materials.append(interface_material("Slab", below, Medium(1.5), backend="nodes"))
        scene.collection.objects.link(bpy.data.objects.new("Slab", data))
    assert_same_mean(scene, render)


def test_by_way_of_a_coloured_mirror(empty_file, render):
    scene = stage_of("disk", None)
    mirror = bpy.data.materials.new("Mirror")
    nodes = Nodes(empty_tree(mirror))
    nodes.end(nodes.add("ShaderNodeBsdfAnisotropic", inputs={"Color": (0.9, 0.6, 0.3), "Roughness": 0.0}))
    data = bpy.data.meshes.new("Mirror")
    data.from_pydata([(-1.2, y, z) for y, z in ((-1, -0.9), (1, -0.9), (1, 1), (-1, 1))], [], [(0, 1, 2, 3)])
    data.materials.append(mirror)
    scene.collection.objects.link(bpy.data.objects.new("Mirror", data))
    assert_same_mean(scene, render)


def test_it_does_not_matter_which_way_a_floor_faces(empty_file, render):
    pictures = []
    for flipped in (False, True):
        scene = stage_of("point", Medium(-1.33))
        if flipped:
            scene.objects["Floor"].data.flip_normals()
        scene.cycles.samples = 128
        pictures.append(baked(scene, render, 0))
    scene.camera.location.z, scene.camera.rotation_euler.x = -1.5, math.pi  # from below there is nothing to be seen
    assert pictures[0].max() > 0.05
    assert np.abs(pictures[1] - pictures[0]).max() < 0.02 * pictures[0].max()
    assert render(scene).max() == 0


def test_the_gaussian_sun_and_the_disk_have_the_same_light(empty_file):
    target = lights.Target(np.array([[-1.0, -1, 0], [1, 1, 0]]), np.array([[-1.0, -1, -1], [1, 1, 0]]))
    for gaussian in (False, True):
        sun = lights.Sun((0.3, 0.2, -1.0), (2.0, 2.0, 2.0), 0.02, gaussian)
        for shot in sun.shots(target, 1000, 3, np.random.default_rng(0)):
            assert shot.power[0] * np.prod(shot.size) == pytest.approx(
                2.0 * shot.width**2 * min(shot.size) / max(shot.size)
            )


def test_a_lamp_keeps_its_watts(empty_file):
    """All around a point lamp, and before a lamp of an area, the power that leaves is what the lamp says."""
    around = lights.Target(np.random.default_rng(1).normal(size=(500, 3)) * 9, np.zeros((1, 3)))
    random = np.random.default_rng(0)
    (shot,) = lights.Lamp((0, 0, 0), (1.0, 1.0, 1.0)).shots(around, 10000, 1, random)
    assert shot.power.sum((0, 1)) == pytest.approx(4 * math.pi)
    area = lights.Area(tuple(map(tuple, np.eye(4))), (2.0, 3.0), False, (1.0, 1.0, 1.0))
    (shot,) = area.shots(around, 40000, 1, random)
    assert shot.power.sum((0, 1)) == pytest.approx(math.pi, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda lamp: setattr(lamp, "spread", 1.0), "Spread"),
        (lambda lamp: setattr(lamp, "size", 0.0), "size"),
    ],
)
def test_what_is_not_traced_is_refused(change, word, empty_file, one_sentence):
    scene = stage_of("area", Medium(-1.5))
    change(scene.objects["Lamp"].data)
    with pytest.raises(ValueError) as error:
        caustics.Bake(scene)
    one_sentence(error.value, word)


@pytest.mark.parametrize("kind", ["point", "area"])
def test_a_lamp_within_a_medium_is_refused(kind, empty_file, one_sentence):
    scene = stage_of(kind, Medium(-1.5))
    scene.objects["Lamp"].location.z = -0.5
    with pytest.raises(ValueError) as error, caustics.Bake(scene):
        pass
    one_sentence(error.value, "Lamp", "medium")


def test_a_scene_without_a_lamp_is_refused(empty_file, one_sentence):
    scene = stage_of("point", Medium(-1.5))
    scene.objects["Lamp"].hide_render = True
    with pytest.raises(ValueError) as error:
        caustics.Bake(scene)
    one_sentence(error.value, "light", "lamp")


def test_a_lamp_with_an_emission_node_is_traced_and_seen_with_its_colour(empty_file):
    scene = stage_of("point", Medium(-1.5))
    lamp = scene.objects["Lamp"]
    plain = np.array(lights.light_of(lamp).intensity)
    nodes = Nodes(empty_tree(lamp.data))
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": (0.5, 0.25, 0.125), "Strength": 2.0}), "Light")
    assert lights.light_of(lamp).intensity == pytest.approx(plain * (1.0, 0.5, 0.25))
    caustics.bake(scene, texels=64, photons=1 << 12)
    seen = next(one for one in scene.objects if one.type == "LIGHT" and one.get(caustics.CAUSTICS_MARK))
    glow = next(node for node in seen.data.node_tree.nodes if node.type == "EMISSION")
    assert tuple(glow.inputs["Color"].default_value)[:3] == pytest.approx((1.0, 0.5, 0.25))


# ------------------------------------------------------------------------------------------------ light counted twice


def shadowed(scene):
    scene.objects["Lamp"].data.use_shadow = False


def linked_shadows(scene):
    scene.objects["Lamp"].light_linking.blocker_collection = bpy.data.collections.new("Blockers")


def shadow_caustics(scene):
    scene.objects["Lamp"].data.cycles.is_caustics_light = True


def not_glossy(scene):
    scene.objects["Lamp"].visible_glossy = False


def not_shadowing(scene):
    scene.objects["Surface"].visible_shadow = False


def foggy(scene):
    nodes = Nodes(scene.world.node_tree)
    fog = nodes.add("ShaderNodeVolumeScatter")
    nodes.add("ShaderNodeOutputWorld", inputs={"Volume": fog.outputs[0]})


def smoky(scene):
    scene.collection.objects.link(bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke")))


@pytest.mark.parametrize(
    "change, words",
    [
        (shadowed, ("Lamp", "Shadow", "twice")),
        (linked_shadows, ("Lamp", "Shadow Linking", "twice")),
        (shadow_caustics, ("Lamp", "Shadow Caustics")),
        (not_glossy, ("Lamp", "glossy")),
        (not_shadowing, ("Surface", "Shadow", "twice")),
        (foggy, ("world", "Dark")),
        (smoky, ("Smoke", "volume")),
    ],
    ids=lambda one: getattr(one, "__name__", ""),
)
def test_light_that_a_bake_would_count_twice_or_not_at_all_is_refused(change, words, empty_file, one_sentence):
    scene = stage_of("point", Medium(-1.5))
    change(scene)
    with pytest.raises(ValueError) as error, caustics.Bake(scene):
        pass
    one_sentence(error.value, *words)
    assert not caustics.baked(scene)


@pytest.mark.parametrize("option", ["photons", "texels", "most"])
@pytest.mark.parametrize("value", [0, -5])
def test_numbers_that_trace_nothing_are_refused(option, value, empty_file, one_sentence):
    with pytest.raises(ValueError) as error:
        caustics.Bake(stage_of("point", Medium(-1.5)), **{option: value})
    one_sentence(error.value, option, str(value), "1 or more")


# ------------------------------------------------------------------------------------------------ light linking


def link(lamp, thing, state):
    linked = bpy.data.collections.new("Receivers")
    linked.objects.link(thing)
    linked.collection_objects[0].light_linking.link_state = state
    lamp.light_linking.receiver_collection = linked
    return linked


@pytest.mark.parametrize("state", ["INCLUDE", "EXCLUDE"])
def test_a_floor_that_a_lamp_does_not_light_gets_none_of_its_photons(state, empty_file, render):
    """Two halves of a floor, of which one is left out; what is baked is lit as what it stands for."""
    scene = stage_of("point", Medium(1.5))
    floor = scene.objects["Floor"]
    floor.scale.x = 0.5
    floor.location.x = 4.5
    other = floor.copy()
    other.name, other.location.x = "Other", -4.5
    scene.collection.objects.link(other)
    both = caustics.bake(scene, texels=64, photons=1 << 14)
    caustics.clear(scene)
    lamp = scene.objects["Lamp"]
    linked = link(lamp, floor if state == "INCLUDE" else other, state)
    if state == "INCLUDE":
        linked.objects.link(scene.objects["Surface"])
    assert caustics.bake(scene, texels=64, photons=1 << 14) == {"Floor": pytest.approx(both["Floor"], rel=0.02)}
    assert both["Other"] > 0.1 * both["Floor"]
    picture = render(scene)[..., 0]
    assert picture[:, : SIZE // 2 - 1].max() == 0 and picture[:, SIZE // 2 + 1 :].mean() > 0.01
    # lit straight, where no surface is above
    scene.camera.location = (3, 0, 0.5)
    scene.objects["Surface"].visible_camera = False
    assert render(scene)[:, -4:].mean() > 0.01
    caustics.clear(scene)
    assert len(linked.objects) == (2 if state == "INCLUDE" else 1)


def test_an_interface_that_a_lamp_does_not_light_is_refused(empty_file, one_sentence):
    scene = stage_of("point", Medium(1.5))
    link(scene.objects["Lamp"], scene.objects["Surface"], "EXCLUDE")
    with pytest.raises(ValueError) as error, caustics.Bake(scene):
        pass
    one_sentence(error.value, "Lamp", "Surface", "Light Linking")


# ------------------------------------------------------------------------------------------------ where lamps stand


def test_a_lamp_in_an_instance_of_a_collection_is_traced(empty_file):
    scene = stage_of("point", Medium(1.5))
    lamp = scene.objects["Lamp"]
    power = caustics.bake(scene, texels=64, photons=1 << 14)["Floor"]
    caustics.clear(scene)
    held = bpy.data.collections.new("Held")
    lamp.users_collection[0].objects.unlink(lamp)
    held.objects.link(lamp)
    lamp.location.z -= 1.0
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", held, (0, 0, 1)
    scene.collection.objects.link(empty)
    assert lights.lamps_of(scene) == [lamp]
    assert caustics.bake(scene, texels=64, photons=1 << 14) == {"Floor": pytest.approx(power, rel=0.02)}
    (seen,) = [one for one in caustics.baked(scene).objects if one.type == "LIGHT"]
    scene.view_layers[0].update()
    assert tuple(seen.matrix_world.translation) == pytest.approx((0.7, -0.5, 1.6))
    assert not lamp.data.cycles.use_multiple_importance_sampling
    assert not caustics.out_of_date(scene)
    empty.location.x += 0.1
    assert caustics.out_of_date(scene)
    caustics.clear(scene)
    assert lamp.data.cycles.use_multiple_importance_sampling
    empty.hide_render = True
    assert lights.lamps_of(scene) == []
    with pytest.raises(ValueError, match="no light"):
        caustics.Bake(scene)


def test_a_portal_is_no_lamp(empty_file):
    scene = stage_of("area", Medium(1.5))
    scene.objects["Lamp"].data.cycles.is_portal = True
    with pytest.raises(ValueError, match="no light"):
        caustics.Bake(scene)


def landed_of(size, height):
    """Power that lands on a floor a `size` below a square that changes nothing, two sizes wide, of a lamp at a height."""
    stage = Stage("scale", (SIZE, SIZE), "nodes")
    grey = surfaces.plain("Floor", (0.6, 0.5, 0.4))
    stage.mesh("Floor", *shapes.rectangle((-9 * size, -9 * size), (9 * size, 9 * size), -size), grey)
    material = interface_material("Surface", Medium(1.0), backend="nodes")
    stage.mesh("Surface", *shapes.rectangle((-size, -size), (size, size)), material)
    with Tracer(stage.scene) as tracer:
        lamp = lights.Lamp((0.0, 0.0, height), (1.0, 1.0, 1.0))
        return sum(one.power.sum() for one in tracer.trace(lamp, 256**2, 2)) / 2 / 3


def test_a_scene_as_large_as_a_city_is_traced(empty_file):
    solid = 4 * math.asin(1 / (1 + 1.5**2))  # of a square two wide, from 1.5 above
    assert landed_of(1e5, 1.5e5) == pytest.approx(solid, rel=0.01)


def test_a_lamp_a_hair_above_a_surface_is_traced(empty_file):
    solid = 4 * math.asin(81 / (81 + 1.0009**2))
    assert landed_of(1.0, 0.9e-3) == pytest.approx(solid, rel=0.01)

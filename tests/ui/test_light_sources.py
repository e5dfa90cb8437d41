# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light paths start: each source, arrangement and aim, and that they meet interfaces from outside."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles.casting import Meshes
from nim_addon.cycles.visibility import PATHS_MARK, as_rendered, shown
from nim_addon.physics import MEDIA
from nim_addon.physics.rays import Kind
from nim_addon.scenes import shapes, surfaces
from nim_addon.ui.add_interface import SHAPES
from tests.ui.drawn_paths import add, add_interface, direction, drawn


@pytest.fixture
def scene(addon):
    """The default file without its cube, with rays from the 3D cursor."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.context.scene.nim_rays.source = "CURSOR"
    return bpy.context.scene


CURSORS = ((0, 0, 0), (0, 0, 1.001), (7, -5, -3))


def met_from_outside(scene, least):
    """The rays of the default source, after a check that so many meet an interface, of a medium in air, from air."""
    bpy.context.view_layer.update()
    with as_rendered(scene) as depsgraph:
        objects = (seen for seen in shown(scene, depsgraph) if not seen.original.get(PATHS_MARK))
        surfaces = Meshes(objects, depsgraph)
        ends, _ = drawn(Kind.INCIDENT, scene)
        along = direction(ends)
        ahead, behind = surfaces.hit(ends[:, 0], along), surfaces.hit(ends[:, 0], -along)
        met = ahead.which >= 0
        assert met.mean() >= least, met
        assert all(surfaces.interfaces[which].outside == MEDIA["air"] for which in ahead.which[met])
        assert (np.sum(along * ahead.normal, axis=1)[met] < 0).all()  # comes from outside
        assert (np.sum(-along * behind.normal, axis=1) <= 0).all()  # nothing closed is around the start
        assert (ends[:, 0] < surfaces.low).any(axis=1).all() or (ends[:, 0] > surfaces.high).any(axis=1).all()
        landed = surfaces.hit(ends[:, 1] + surfaces.gap * 10 * along, along)
        assert np.isfinite(landed.distance[met]).mean() > 0.5  # and it goes on to another surface
    return ends


def test_arrangements(scene, press):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    scene.cursor.location = (-5, 0, 0)
    press("nim.light_paths", rays=5, arrangement="BEAM")
    ends, _ = drawn(Kind.INCIDENT)
    np.testing.assert_allclose(ends[:, 0], [(-5, 0, z) for z in np.linspace(-0.8, 0.8, 5)], atol=1e-6)
    press("nim.light_paths", rays=5, arrangement="BEAM", roll=math.radians(90), fit=False, width=1.0)
    np.testing.assert_allclose(np.abs(drawn(Kind.INCIDENT)[0][:, 0, 1]), (0.5, 0.25, 0, 0.25, 0.5), atol=1e-6)
    press("nim.light_paths", rays=5, arrangement="FAN", angle=math.radians(20), roll=0)
    along = direction(drawn(Kind.INCIDENT)[0])
    np.testing.assert_allclose(np.degrees(np.arctan2(along[:, 2], along[:, 0])), (-10, -5, 0, 5, 10), atol=1e-4)
    press("nim.light_paths", rays=100, arrangement="CONE", angle=math.radians(20))
    ends, _ = drawn(Kind.INCIDENT)
    assert (ends[:, 0] == (-5, 0, 0)).all()
    off = np.degrees(np.arccos(direction(ends) @ (1, 0, 0)))
    assert off.max() < 10 and abs(np.median(off) - 10 / math.sqrt(2)) < 0.2
    np.testing.assert_allclose(direction(ends).mean(axis=0)[1:], 0, atol=0.002)


@pytest.mark.parametrize("name", ["sphere", "glass", "sea", "pool"])
def test_build_then_draw_is_a_beam_from_outside_wherever_the_cursor_stands(addon, press, name):
    bpy.context.scene.nim_scenes.scene = name
    press("nim.build_scene")
    scene = bpy.context.scene
    assert scene.name == f"NIM {name}"
    first = None
    for cursor in CURSORS:
        scene.cursor.location = cursor
        press("nim.light_paths")
        ends = met_from_outside(scene, 0.8)
        first = ends if first is None else first
        np.testing.assert_array_equal(ends, first)
        assert len(drawn(Kind.TRANSMITTED, scene)[0]) >= 17
    # its plane is seen by the camera, if that does not look along the beam from below
    along, spread = direction(ends)[0], ends[-1, 0] - ends[0, 0]
    across = np.cross(along, spread / np.linalg.norm(spread))
    if name != "sea":
        assert abs(across @ np.array(scene.camera.matrix_world)[:3, 2]) > 0.5
    if name in ("sea", "pool"):
        assert -0.9 < along[2] < -0.5  # at a slant from above


def test_of_an_added_sphere_too(scene, press):
    scene.nim_rays.source = "SIDE"
    for cursor in CURSORS:
        scene.cursor.location = cursor
        press("nim.add_object")
        added = bpy.context.object
        press("nim.light_paths")
        ends = met_from_outside(scene, 1.0)
        np.testing.assert_allclose(ends[10, 1], np.array(cursor) - (1, 0, 0), atol=1e-3)
        bpy.data.objects.remove(added)


def test_of_the_converted_cube_too(addon, press):
    press("nim.convert")
    press("nim.light_paths", rays=3)
    ends, _ = drawn(Kind.INCIDENT)
    # at 30 degrees to the middle of a face, a quarter as wide as the cube
    along, wide = (math.sqrt(0.75), 0, -0.5), 0.25 / math.sqrt(0.75)
    np.testing.assert_allclose(direction(ends), np.tile(along, (3, 1)), atol=1e-5)
    np.testing.assert_allclose(ends[:, 1], [(-1, 0, -wide), (-1, 0, 0), (-1, 0, wide)], atol=1e-5)


@pytest.mark.parametrize("shape", [*SHAPES, "Suzanne"])
@pytest.mark.parametrize("sees", [True, False], ids=["camera", "no camera"])
def test_the_first_beam_is_seen_to_bend_backwards(scene, press, shape, sees):
    scene.nim_rays.source = "SIDE"
    scene.camera = scene.camera if sees else None
    if shape == "Suzanne":
        press("mesh.primitive_monkey_add")
        press("nim.convert")
    else:
        press("nim.add_object", shape=shape)
    press("nim.light_paths", bounces=1)
    along = direction(drawn(Kind.INCIDENT)[0])
    bent = direction(drawn(Kind.TRANSMITTED)[0])
    assert len(bent) == len(along) == 21
    # the normal lies in the plane of both, and along n_i d_i - n_t d_t
    normal = direction(np.stack([np.zeros_like(along), along + 1.5 * bent], axis=1))
    theta_i = np.degrees(np.arccos(np.abs(np.sum(normal * along, axis=1))))
    assert np.mean((theta_i > 10) & (theta_i < 75)) >= 0.9
    aside, goes_on = (one - np.sum(one * normal, axis=1)[:, None] * normal for one in (along, bent))
    assert (np.sum(aside * goes_on, axis=1) < 0).all()


def test_a_bubble_is_met_from_outside_the_block_it_is_in(scene, press):
    add_interface(-1.5, shapes.box((-5, -5, -5), (5, 5, 5)))
    bubble = add_interface(1.1, shapes.cube_sphere(8), smooth=True)
    bpy.context.view_layer.objects.active = bubble
    press("nim.light_paths", source="SIDE")
    assert (drawn(Kind.INCIDENT)[0][:, 0, 0] < -5).all()


def test_spheres_far_apart_leave_no_beam_between_them(scene, press):
    for x, y in ((-20, 3), (20, -9), (-2, 15)):
        ball = add_interface(-1.5, shapes.cube_sphere(8), smooth=True)
        ball.location = x, y, 0
    bpy.context.view_layer.objects.active = None
    press("nim.light_paths", source="SIDE")
    met_from_outside(scene, 0.9)


def test_what_stands_in_the_way_is_gone_around(scene, press):
    add_interface(-1.5, shapes.cube_sphere(8), smooth=True)
    wall = add("Wall", *shapes.box((-1.4, -3, -3), (-1.2, 3, 3)), surfaces.plain("Wall", (0.5, 0.5, 0.5)))
    press("nim.light_paths", source="SIDE")
    met_from_outside(scene, 1.0)
    wall.hide_render = True
    press("nim.light_paths", source="SIDE")
    assert (drawn(Kind.INCIDENT)[0][:, 0, 0] < -1.4).all()


def test_an_interface_within_the_default_cube_is_said_to_be_behind_it(addon, press, capfd):
    press("nim.add_object")
    press("nim.light_paths")
    assert "Warning: All rays end at an opaque object before they meet one that bends light" in capfd.readouterr().out


@pytest.mark.parametrize("turn", [(0, 0, 0), (90, 0, 0), (0, 90, 0)])
def test_a_sheet_is_met_at_a_slant(scene, press, turn):
    sheet = add_interface(-1.5, shapes.rectangle((-5, -5), (5, 5)))
    sheet.rotation_euler = np.radians(turn)
    press("nim.light_paths", source="SIDE")
    ends, _ = drawn(Kind.INCIDENT)
    normal = np.array(sheet.matrix_world)[:3, 2]
    np.testing.assert_allclose(direction(ends) @ normal, -math.sqrt(0.5), atol=1e-6)
    np.testing.assert_allclose(ends[:, 1] @ normal, 0, atol=1e-5)


SLANTED = [(aim, (math.sqrt(0.75), 0, -0.5)) for aim in ("TARGET", "FORWARD")]


@pytest.mark.parametrize("aim, along", [*SLANTED, ("DIRECTION", (0, 0.6, -0.8))])
def test_from_the_side_takes_a_direction_of_ones_own(scene, press, aim, along):
    add_interface(-1.5, shapes.cube_sphere(8), smooth=True)
    press("nim.light_paths", source="SIDE", aim=aim, direction=(0, 3, -4), rays=3)
    ends, _ = drawn(Kind.INCIDENT)
    np.testing.assert_allclose(direction(ends), np.tile(along, (3, 1)), atol=1e-6)
    assert (np.linalg.norm(ends[:, 1], axis=1) < 1.001).all()


def test_numbers_of_sources_stay_as_files_hold_them(addon):
    items = bpy.context.scene.nim_rays.bl_rna.properties["source"].enum_items
    assert {item.identifier: item.value for item in items} == {
        "CURSOR": 0,
        "CAMERA": 1,
        "LAMP": 2,
        "SIDE": 3,
        "HANDLE": 4,
    }


def test_lamps_of_every_type(scene, press):
    target = add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    bpy.data.objects.remove(bpy.data.objects["Light"])
    for kind, x in (("POINT", -5), ("SPOT", 5), ("AREA", 9)):
        lamp = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
        lamp.location = x, 0, 0
        scene.collection.objects.link(lamp)
        lamp.select_set(True)
    press("nim.light_paths", source="LAMP", rays=3, arrangement="FAN", angle=0.1)
    ends, _ = drawn(Kind.INCIDENT)
    assert sorted(ends[:, 0, 0]) == [-5, -5, -5, 5, 5, 5, 9, 9, 9]
    np.testing.assert_allclose(np.abs(ends[:, 1, 0]), 1, atol=1e-5)
    for object_ in scene.objects:
        object_.select_set(False)
    with pytest.raises(RuntimeError, match="select a lamp"):
        press("nim.light_paths", source="LAMP")
    # a sun is nowhere: its beam is parallel to it and centred on the active object, else on the cursor
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler = (0, math.radians(30), 0)
    sun.location = (77, 7, 7)
    scene.collection.objects.link(sun)
    sun.select_set(True)
    target.location = (3, 0, 0)
    bpy.context.view_layer.objects.active = target
    press("nim.light_paths_clear")
    shines = np.array((-math.sin(math.radians(30)), 0, -math.cos(math.radians(30))))
    for aim, middle in (("TARGET", (3, 0, 0)), ("FORWARD", (3.2, 0, 0.3))):
        scene.cursor.location = (3.2, 0, 0.3)
        press("nim.light_paths", source="LAMP", rays=3, aim=aim, arrangement="FAN")
        ends, _ = drawn(Kind.INCIDENT)
        np.testing.assert_allclose(direction(ends), np.tile(shines, (3, 1)), atol=1e-6)
        np.testing.assert_allclose(np.cross(middle - ends[1, 0], shines), 0, atol=1e-5)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Live light paths: what would be drawn, without a window to draw into."""

import math
import subprocess
import sys
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from nim_addon.cycles.graded import graded_ball_material
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.slabs import slab_material
from nim_addon.physics import Medium, colour
from nim_addon.physics.balls import POINTS
from nim_addon.physics.graded import Profile
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.rays import Kind
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import shapes
from nim_addon.ui import light_live, live_lines, live_look
from tests.ui.conftest import Layout
from tests.ui.drawn_paths import add, add_interface, drawn


@pytest.fixture
def scene(addon):
    """The default file without its cube, with 9 rays from the 3D cursor, and live paths as if they were on."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.context.scene.nim_rays.source, bpy.context.scene.nim_rays.rays = "CURSOR", 9
    live_look.on = True
    for name, handler in light_live.HANDLERS_WHILE_ON:
        getattr(bpy.app.handlers, name).append(handler)
    yield bpy.context.scene
    light_live.stop()


def look():
    bpy.context.view_layer.update()
    return live_look.Look(bpy.context.scene)


def trees():
    """The tree of each mesh that is kept, by how many faces it has."""
    return {mesh.faces: mesh.tree for _, kept in live_look.known_meshes.values() for mesh in kept.meshes.values()}


def a_ball(n=-1.5):
    return add_interface(n, shapes.cube_sphere(16), smooth=True)


# ---------------------------------------------------------------- of a scene


def test_live_paths_are_those_that_curves_draw(scene, press):
    scene.cursor.location = (-3, 0.2, 0)
    a_ball()
    made = look()
    assert made.sentence is None and len(made.lines.ends) > 9
    press("nim.light_paths")
    for kind in Kind:
        paths = made.traced[0].paths
        chosen = paths.kind == kind
        ends = np.stack([paths.start, paths.end], 1)[chosen]
        np.testing.assert_allclose(ends, drawn(kind)[0], atol=1e-5)
    # what was drawn does not stop the rays
    assert len(look().lines.ends) == len(made.lines.ends)


def test_live_paths_change_nothing_of_the_scene(scene):
    a_ball()
    before = live_look.marks(scene)
    look()
    assert live_look.marks(scene) == before


def test_where_a_medium_disperses_wavelengths_part_in_their_colours(scene):
    scene.cursor.location = (-3, 0, 0)
    prism = [(-1, -1, -0.8), (1, -1, -0.8), (0, -1, 0.9), (-1, 1, -0.8), (1, 1, -0.8), (0, 1, 0.9)]
    faces = [(0, 1, 2), (5, 4, 3), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]
    add("Prism", prism, faces, interface_material("SF11", Medium.parse("n-sf11"), backend="nodes"))
    scene.nim_rays.rays, scene.nim_rays.aim, scene.nim_rays.direction = 1, "DIRECTION", (1, 0, 0.2)
    made = look()
    (one,) = made.traced
    assert one.wavelengths_nm == live_lines.WAVELENGTHS_NM and len(one.paths.lost) == len(one.wavelengths_nm)
    first = one.paths.direction[(one.paths.kind == Kind.TRANSMITTED) & (one.paths.depth == 1)]
    assert len(first) == len(one.wavelengths_nm)
    assert (np.diff(first, axis=0)[:, 2] != 0).all() and len(np.unique(np.sign(np.diff(first, axis=0)[:, 2]))) == 1
    split = one.paths.depth[made.lines.source[:, 1]] > 0
    nm = np.array(one.wavelengths_nm)[one.paths.ray[made.lines.source[split, 1]]]
    np.testing.assert_allclose(made.lines.colors[split, 0, :3], colour.of_wavelength(nm), atol=1e-6)
    # what all of them share is one white line
    assert (~split).sum() == 1
    np.testing.assert_allclose(made.lines.colors[~split][0, 0, :3], live_lines.WHITE, atol=1e-6)
    scene.nim_rays.rays = 3
    (three,) = look().traced
    entered = (three.paths.kind == Kind.TRANSMITTED) & (three.paths.depth == 1)
    wanted = [Medium.parse("n-sf11").at(nm).n for nm in three.wavelengths_nm]
    np.testing.assert_allclose(three.paths.n[entered], np.array(wanted)[three.number[entered]], rtol=1e-6)
    assert entered.sum() > len(wanted)
    for segment, nm in enumerate(one.wavelengths_nm):
        read = live_lines.reading(one, segment)
        assert read.n_t == pytest.approx(Medium.parse("n-sf11").at(nm).n, rel=1e-6) and read.wavelength_nm == nm
    scene.nim_rays.color = "PART"
    assert [one.wavelengths_nm for one in look().traced] == [()]


def test_the_panel_says_what_the_colours_say(scene):
    def said(color):
        scene.nim_rays.color = color
        live_look.LOOKS.renew(scene.session_uid)
        return live_look.legend(scene)

    def panel():
        layout = Layout()
        context = SimpleNamespace(scene=scene, region=None)
        bpy.types.NIM_PT_light_paths.draw(SimpleNamespace(layout=layout), context)
        return layout.text

    ball = a_ball()
    bpy.context.view_layer.update()
    assert said("PART") == said("WAVELENGTH") == "Yellow in, orange on, blue reflected", "nothing disperses"
    assert said("WAVELENGTH") and "Yellow in" in panel() and "Nothing disperses, so by part" in panel()
    assert said("PART") and "Nothing disperses" not in panel()
    assert said("ENERGY").startswith("White")
    ball.data.materials[0] = interface_material("SF11", Medium.parse("n-sf11"), backend="nodes")
    bpy.context.view_layer.update()
    assert said("WAVELENGTH") == "The colors are those of the light" and "Nothing disperses" not in panel()
    light_live.stop()
    assert said("ENERGY").startswith("Yellow"), "of curves"


@pytest.mark.parametrize(
    "material",
    [
        lambda: lenslet_material("Window", LensletWindow(-1.5), backend="nodes"),
        lambda: slab_material("Slab", UniaxialSlab(2.0, -3.0, 0.25), backend="nodes"),
    ],
    ids=["window", "slab"],
)
def test_windows_and_slabs_take_live_rays_on(scene, material):
    add("Pane", *shapes.rectangle((-2, -2), (2, 2)), material())
    scene.cursor.location = (0, 0, 2)
    scene.nim_rays.aim, scene.nim_rays.direction = "DIRECTION", (0.2, 0, -1)
    made = look()
    paths = made.traced[0].paths
    assert made.sentence is None and (paths.end[paths.depth > 0, 2] < -0.1).any()


def test_in_a_graded_ball_live_rays_are_curved(scene):
    add(
        "Lens", *shapes.cube_sphere(16), graded_ball_material("Lens", Profile("luneburg"), backend="nodes"), smooth=True
    )
    scene.cursor.location = (-3, 0, 0)
    scene.nim_rays.aim, scene.nim_rays.direction = "DIRECTION", (1, 0, 0)
    made = look()
    within = np.linalg.norm(made.lines.ends.mean(axis=1), axis=1) < 0.99
    assert within.sum() > 8 * POINTS
    # of a ray that meets the lens off its axis the pieces within turn little by little
    paths = made.traced[0].paths
    pieces = paths.direction[(paths.ray == 1) & (paths.depth == 1)][: POINTS - 1]
    turns = np.degrees(np.arccos(np.clip(np.sum(pieces[1:] * pieces[:-1], axis=1), -1, 1)))
    assert 5 < turns.sum() < 90 and turns.max() < 3


def test_what_leads_nowhere_is_a_sentence(scene):
    assert "no visible mesh" in look().sentence and not len(look().lines.ends)
    add_interface(-1.5, shapes.rectangle((-1, -1), (1, 1)))
    scene.nim_rays.source = "HANDLE"
    assert "no handle" in look().sentence
    scene.nim_rays.source, scene.cursor.location = "CURSOR", (0, 0, 2)
    scene.nim_rays.aim, scene.nim_rays.direction = "DIRECTION", (1, 0, 0)
    made = look()
    assert "No ray met" in made.sentence and len(made.lines.ends) == 9


def test_a_mesh_that_is_too_large_is_left_out_and_named(scene, monkeypatch):
    a_ball()
    monkeypatch.setattr(live_look, "LARGEST", 1000)
    assert "NIM have too many faces" in look().sentence
    scene.cursor.location = (0, 0, 3)
    add_interface(1.5, shapes.rectangle((-1, -1), (1, 1), 2.0))
    made = look()
    assert "pass through NIM" in made.sentence
    assert made.traced[0].paths.which.max() == 0


def test_a_mesh_with_a_vertex_that_is_nowhere_is_named(scene):
    ball = a_ball()
    ball.data.vertices[0].co.x = np.nan
    ball.data.update()
    scene.cursor.location = (0, 0, 3)
    assert "pass through NIM, with vertices whose coordinates are no finite numbers" in look().sentence
    add_interface(1.5, shapes.rectangle((-1, -1), (1, 1), 2.0))
    assert "pass through NIM, with vertices" in look().sentence


# ---------------------------------------------------------------- following


def test_a_moved_object_is_followed_and_its_tree_kept(scene):
    ball = a_ball()
    scene.cursor.location = (-3, 0, 0)
    scene.nim_rays.aim = "DIRECTION"
    before, tree = look(), trees()
    ball.location.x = 0.25
    after = look()
    moved = after.traced[0].paths.end[4] - before.traced[0].paths.end[4]
    np.testing.assert_allclose(moved, (0.25, 0, 0), atol=1e-6)
    assert trees() == tree


def test_a_changed_mesh_is_read_anew(scene):
    ball = a_ball()
    scene.cursor.location = (-3, 0, 0)
    scene.nim_rays.aim = "DIRECTION"
    before, tree = look(), trees()
    ball.data.transform(Matrix.Scale(0.5, 4))
    ball.data.update()
    after = look()
    moved = after.traced[0].paths.end[4] - before.traced[0].paths.end[4]
    np.testing.assert_allclose(moved, (0.5, 0, 0), atol=1e-6)
    assert trees() != tree and len(trees()) == 1


def test_a_modifier_and_its_numbers_are_followed(scene):
    wall = add_interface(-1.5, shapes.rectangle((-1, -1), (1, 1)))
    scene.cursor.location = (0, 0, 2)
    scene.nim_rays.rays, scene.nim_rays.aim, scene.nim_rays.least = 1, "FORWARD", 0.5
    assert len(look().traced[0].paths.ray) == 2
    array = wall.modifiers.new("Array", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = 3, False, True
    array.constant_offset_displace = (0, 0, -1)
    assert len(look().traced[0].paths.ray) == 4
    array.count = 2
    assert len(look().traced[0].paths.ray) == 3
    # what has moved and been rebuilt in between, too
    array.constant_offset_displace = (0, 0, -1.5)
    np.testing.assert_allclose(look().traced[0].paths.end[1], (0, 0, -1.5), atol=1e-6)


def test_frames_are_followed_and_what_deforms_with_them(scene):
    ball = a_ball()
    scene.cursor.location = (-3, 0, 0)
    scene.nim_rays.aim = "DIRECTION"
    cast = ball.modifiers.new("Cast", "CAST")
    cast.factor, cast.use_radius_as_size, cast.radius, cast.size = 1.0, False, 0.0, 1.0
    for frame, size in ((1, 1.0), (11, 0.5)):
        cast.size = size
        cast.keyframe_insert("size", frame=frame)
    for frame, x in ((1, -1.0), (11, -0.5), (1, -1.0)):
        scene.frame_set(frame)
        np.testing.assert_allclose(live_look.Look(scene).traced[0].paths.end[4], (x, 0, 0), atol=1e-2)


def test_edited_vertices_are_followed_in_edit_mode(scene):
    ball = a_ball()
    scene.cursor.location = (-3, 0, 0)
    scene.nim_rays.aim = "DIRECTION"
    bpy.context.view_layer.objects.active = ball
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        np.testing.assert_allclose(look().traced[0].paths.end[4], (-1, 0, 0), atol=1e-2)
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.resize(value=(0.5, 0.5, 0.5))
        np.testing.assert_allclose(look().traced[0].paths.end[4], (-0.5, 0, 0), atol=1e-2)
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_allclose(look().traced[0].paths.end[4], (-0.5, 0, 0), atol=1e-2)


def test_a_deleted_object_leaves_nothing(scene):
    ball = a_ball()
    assert len(look().lines.ends) and trees()
    bpy.data.objects.remove(ball)
    assert not len(look().lines.ends) and not trees()


def test_a_number_of_the_node_or_a_setting_makes_the_last_look_old(scene):
    ball = a_ball()
    bpy.context.view_layer.update()
    uid = scene.session_uid
    live_look.LOOKS.renew(uid)
    assert live_look.LOOKS.is_fresh(scene)
    next(node for node in ball.active_material.node_tree.nodes if node.type == "GROUP").inputs[
        "Index Inside"
    ].default_value = -2
    bpy.context.view_layer.update()
    assert live_look.known(scene).traced[0].interfaces[0].inside.n == -2
    count = len(live_look.known(scene).lines.ends)
    scene.nim_rays.rays = 5
    assert len(live_look.known(scene).lines.ends) < count


def test_a_view_that_is_drawn_takes_the_look_itself_and_is_not_drawn_again(scene, monkeypatch):
    ball = a_ball()
    scene.cursor.location, scene.nim_rays.aim = (-3, 0, 0), "DIRECTION"
    bpy.context.view_layer.update()
    asked = []
    monkeypatch.setattr(live_look, "redraw", lambda *but: asked.append(but))
    first = live_look.known(scene)
    assert live_look.known(scene) is first, "nothing has changed"
    asked.clear()
    ball.location.x = 0.25
    bpy.context.view_layer.update()
    asked.clear()
    moved = live_look.known(scene)
    np.testing.assert_allclose(moved.traced[0].paths.end[4], first.traced[0].paths.end[4] + (0.25, 0, 0), atol=1e-6)
    assert not asked and live_look.LOOKS.is_fresh(scene)
    # panels, which say something else now
    scene.nim_rays.direction = (-1, 0, 0)
    assert "No ray met" in live_look.known(scene).sentence and asked == [(bpy.context.region,)]


def test_while_changes_follow_each_other_there_are_fewer_rays_and_it_says_so(scene, monkeypatch):
    a_ball()
    bpy.context.view_layer.update()
    scene.nim_rays.rays, uid = 40, scene.session_uid
    live_look.LOOKS.forget()
    live_look.LOOKS.renew(uid)
    assert live_look.LOOKS.last(scene).coarse is None and live_look.sentence(scene) is None
    asked = []
    monkeypatch.setattr(live_look.deferred, "do", lambda *given, after=0.0: asked.append((given, after)))
    last = live_look.LOOKS.last(scene)
    last.seconds, last.at = live_look.BUDGET / 20, last.at + 1000
    live_look.LOOKS.renew(uid)
    made = live_look.LOOKS.last(scene)
    assert made.coarse == 20 and len(made.traced[0].paths.lost) == 20
    assert "20 of 40" in live_look.sentence(scene)
    (renew, *given), after = asked[-1]
    assert after == live_look.STILL
    renew(*given)
    assert live_look.LOOKS.last(scene).coarse is None and len(live_look.LOOKS.last(scene).traced[0].paths.lost) == 40


def test_scenes_are_known_apart(scene):
    a_ball()
    other = bpy.data.scenes.new("Other")
    assert len(look().lines.ends)
    assert "no visible mesh" in live_look.Look(other).sentence
    assert len(live_look.known_meshes) == 2


# ---------------------------------------------------------------- the handle


def test_rays_start_from_the_handle_along_its_arrow(scene, press):
    a_ball()
    scene.nim_rays.source = "SIDE"
    side = look()
    press("nim.light_handle")
    handle = scene.nim_rays.handle
    assert scene.nim_rays.source == "HANDLE" and bpy.context.view_layer.objects.active == handle
    # where they started, and along the same way
    np.testing.assert_allclose(look().lines.ends, side.lines.ends, atol=1e-4)
    handle.matrix_world = Matrix.Translation((0, 0, 4)) @ Euler((math.pi, 0, 0)).to_matrix().to_4x4()
    starts = look().traced[0].paths
    first = starts.depth == 0
    np.testing.assert_allclose(starts.direction[first], np.tile((0, 0, -1), (9, 1)), atol=1e-6)
    np.testing.assert_allclose(starts.start[first].mean(axis=0), (0, 0, 4), atol=1e-6)
    # side by side along its X axis, as wide as the beam from the side was
    np.testing.assert_allclose(np.ptp(starts.start[first], axis=0), (0.5, 0, 0), atol=1e-4)
    handle.scale = (5, 5, 5)
    np.testing.assert_allclose(look().traced[0].paths.start, starts.start, atol=1e-4)
    scene.nim_rays.arrangement = "FAN"
    fan = look().traced[0].paths
    np.testing.assert_allclose(fan.direction[0] @ fan.direction[8], math.cos(scene.nim_rays.angle), atol=1e-6)
    scene.nim_rays.arrangement = "BEAM"
    # curves start there as well
    press("nim.light_paths")
    np.testing.assert_allclose(drawn(Kind.INCIDENT)[0][:, 0], starts.start[first], atol=1e-4)


def test_a_handle_that_is_deleted_is_added_anew(scene, press):
    a_ball()
    press("nim.light_handle")
    press("nim.light_handle")
    handle = scene.nim_rays.handle
    assert [obj for obj in scene.objects if obj.type == "EMPTY"] == [handle]
    scene.collection.objects.unlink(handle)  # as Delete does it, while the scene still points to it
    assert "no handle" in look().sentence
    press("nim.light_handle")
    assert scene.nim_rays.handle != handle and look().sentence is None


def test_a_file_keeps_the_handle(scene, press, tmp_path):
    a_ball()
    press("nim.light_handle")
    scene.nim_rays.handle.location = (-4, 1, 0)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "rays.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "rays.blend"))
    np.testing.assert_allclose(look().traced[0].paths.start[0, :2], (-4, 1), atol=1e-6)


def test_without_any_interface_a_handle_is_put_at_the_cursor(scene, press):
    scene.cursor.location = (1, 2, 3)
    press("nim.light_handle")
    np.testing.assert_allclose(scene.nim_rays.handle.matrix_world.translation, (1, 2, 3))


# ---------------------------------------------------------------- off


def test_off_leaves_nothing_registered(scene):
    a_ball()
    look()
    ours = {handler for _, handler in light_live.HANDLERS_WHILE_ON}

    def registered():
        return [
            one for name in dir(bpy.app.handlers) for one in as_list(getattr(bpy.app.handlers, name)) if one in ours
        ]

    def as_list(handlers):
        return handlers if isinstance(handlers, list) else []

    assert len(registered()) == len(light_live.HANDLERS_WHILE_ON)
    light_live.stop()
    assert not registered() and not live_look.known_meshes and not light_live.is_on()
    # what was asked for before
    live_look.LOOKS.renew(scene.session_uid)
    assert live_look.LOOKS.last(scene) is None


def test_another_file_ends_it(scene):
    a_ball()
    look()
    bpy.ops.wm.read_homefile()
    assert not light_live.is_on() and not live_look.known_meshes


def test_without_a_window_it_cannot_be_switched_on_and_says_why(addon, press):
    with pytest.raises(RuntimeError, match="need a Blender with a window"):
        press("nim.light_paths_live")
    assert not light_live.is_on()


def test_nothing_of_the_gpu_is_imported_without_a_window():
    code = "import sys, bpy, nim_addon; nim_addon.register(); print(any('live_views' in name for name in sys.modules))"
    code += "; sys.stdout.flush(); import os; os._exit(0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split()[-1] == "False", done.stderr

# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of a graded ball: rays leave it where numpy carries them to, in both backends, wherever it stands."""

import bmesh
import bpy
import mathutils
import numpy as np
import pytest

from nim_addon import checks
from nim_addon.cycles import closures, versions
from nim_addon.cycles.closures import GRADED_BALL
from nim_addon.cycles.closures.closure import VERSION_MARK
from nim_addon.cycles.graded import (
    backend_of,
    graded_ball_material,
    is_profile_node,
    profile_node,
    profile_nodes,
    profile_of,
    set_profile,
    switch,
)
from nim_addon.cycles.material import asked_closures, switch_backend
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.visibility import asked, is_interface
from nim_addon.physics import graded
from nim_addon.physics.graded import DEVICES, Profile
from nim_addon.scenes import surfaces
from nim_addon.scenes.stage import Stage

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])

BIAS = 16.0  # added to places, so that what glows with them is positive
PLAIN = mathutils.Matrix()
MOVED = (
    mathutils.Matrix.Translation((1.3, -2.1, 0.7))
    @ mathutils.Euler((0.3, 1.1, -0.4)).to_matrix().to_4x4()
    @ mathutils.Matrix.Scale(1.7, 4)
)
SINES = (0.02, 0.35, 0.7, 0.94)
WAYS = np.array([(0.3, -0.8, 0.5), (-0.6, 0.1, 0.7), (0.2, 0.9, -0.3), (-0.5, -0.5, -0.7)])


class Range:
    """A ball in the middle of a box whose walls glow with the place of each of their points."""

    def __init__(self, backend, matrix=PLAIN, segments=32):
        self.stage = stage = Stage("range", (2, 2), backend)
        stage.scene.cycles.samples = 4
        self.centre, self.radius = np.array(matrix.translation), matrix.to_scale()[0]
        self.ball = stage.object("Ball", round_mesh(segments))
        self.ball.matrix_world = matrix
        box = bpy.data.meshes.new("Box")
        shape = bmesh.new()
        bmesh.ops.create_cube(shape, size=12 * self.radius)
        shape.to_mesh(box)
        shape.free()
        box.materials.append(glowing())
        stage.object("Box", box, matrix.translation)
        data = bpy.data.cameras.new("Camera")
        data.type, data.clip_start = "ORTHO", 1e-3
        data.ortho_scale = 1e-8 * self.radius  # all of it is one ray
        self.camera = stage.scene.camera = stage.object("Camera", data)
        stage.world(surfaces.sky("Black", (0, 0, 0), (0, 0, 0)))

    def off(self, profile, render, sine, way):
        """How far off the line that `graded` carries it to a ray lands, in radii, by the sine of its angle of incidence."""
        d = way / np.linalg.norm(way)
        across = np.cross(d, (0.1, 0.7, 0.4))
        start = self.centre + self.radius * (sine * across / np.linalg.norm(across) - 3 * d)
        turn = mathutils.Vector(d).to_track_quat("-Z", "Y").to_matrix().to_4x4()
        self.camera.matrix_world = mathutils.Matrix.Translation(start) @ turn
        frame = np.array(self.camera.matrix_world)  # of single precision
        landed = render(self.stage.scene).reshape(-1, 3).mean(axis=0) - BIAS
        carried = graded.carry(profile, (frame[:3, 3] - self.centre) / self.radius, -frame[:3, 2])
        away = (landed - self.centre) / self.radius - carried.points
        along = away @ carried.directions
        assert along > 0
        return np.linalg.norm(away - along * carried.directions)


def round_mesh(segments):
    mesh = bpy.data.meshes.new("Ball")
    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=1.0)
    shape.to_mesh(mesh)
    shape.free()
    return mesh


def glowing():
    material = bpy.data.materials.new("Place")
    nodes = Nodes(empty_tree(material))
    place = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": nodes.vector("ADD", place, (BIAS,) * 3)}))
    return material


def wear(ball, material):
    ball.data.materials.clear()
    ball.data.materials.append(material)


@both_backends
@pytest.mark.parametrize("matrix", [PLAIN, MOVED], ids=["plain", "moved"])
def test_rays_leave_every_device_where_they_should(backend, matrix, empty_file, render):
    there = Range(backend, matrix)
    for device in DEVICES:
        profile = Profile(device)
        wear(there.ball, graded_ball_material(device, profile, backend=backend))
        off = [there.off(profile, render, sine, way) for sine, way in zip(SINES, WAYS, strict=True)]
        # where the sweep is no multiple of pi the plane of incidence, and so its rounding, counts near the axis
        assert max(off[device == "turn" :]) < 5e-5 and off[0] < 5e-4, (device, off)


@both_backends
def test_the_sphere_is_ideal_whatever_its_facets_and_its_radius(backend, empty_file, render):
    there = Range(backend, segments=10)
    profile = Profile("luneburg")
    wear(there.ball, graded_ball_material("Ball", profile, backend=backend, radius=2.0))
    there.ball.data.transform(mathutils.Matrix.Scale(2, 4))
    there.ball.matrix_world = mathutils.Matrix.Scale(0.5, 4)
    assert there.off(profile, render, 0.3, WAYS[1]) < 5e-5


@both_backends
def test_an_index_that_a_person_gives(backend, empty_file, render):
    there = Range(backend)
    for profile in (
        Profile(lambda r: 2 / (1 + r**2)),
        Profile(((0.0, 1.5), (0.5, 1.3), (1.0, 1.0))),
        Profile("eaton", cap=3.0),
    ):
        wear(there.ball, graded_ball_material("Ball", profile, backend=backend))
        assert there.off(profile, render, 0.8, WAYS[2]) < 5e-5


def white(stage):
    stage.camera((0, -4, 0), (0, 0, 0), 40)
    stage.world(surfaces.sky("White", (1, 1, 1), (1, 1, 1)))
    stage.scene.cycles.samples = 4


@both_backends
def test_no_light_is_lost(backend, empty_file, render):
    stage = Stage("furnace", (48, 48), backend)
    ball = stage.object("Ball", round_mesh(32))
    white(stage)
    for profile in (Profile("luneburg"), Profile("magnifier", core=0.5), Profile("invisible")):
        wear(ball, graded_ball_material("Ball", profile, backend=backend))
        picture = render(stage.scene)
        assert picture.min() == pytest.approx(1, abs=1e-6) and picture.max() == pytest.approx(1, abs=1e-6)
    # a black core of the magnifier is seen as large as the ball
    wear(ball, graded_ball_material("Ball", Profile("magnifier", core=0.5, surface="black"), backend=backend))
    picture = render(stage.scene)
    assert picture[24, 24].max() == 0 and picture[0, 0].min() == 1
    # and is not met from within
    stage.scene.camera.location = (0, 0, 0)
    assert render(stage.scene).min() == 1


@both_backends
def test_it_is_read_again_from_a_file(backend, empty_file, tmp_path):
    profiles = (Profile("turn", angle=1.0), Profile(((0.0, 2.0), (1.0, 1.0)), cap=1.5), Profile("cloak", hollow=0.5))
    for index, profile in enumerate(profiles):
        graded_ball_material(f"Ball {index}", profile, backend=backend, radius=0.5).use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "balls.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "balls.blend"))
    for index, profile in enumerate(profiles):
        (node,) = profile_nodes(bpy.data.materials[f"Ball {index}"])
        assert profile_of(node) == profile and node.inputs["Radius"].default_value == 0.5
        (texture,) = (inner for inner in node.node_tree.nodes if inner.type == "TEX_IMAGE")
        pixels = np.array(texture.image.pixels).reshape(-1, 4)
        np.testing.assert_array_equal(pixels[:, :3], graded.table(profile, len(pixels)))


def test_each_function_has_a_table_of_its_own_and_a_linked_group_is_not_ours(empty_file, tmp_path):
    tables = []
    for device in ("luneburg", "fisheye"):
        index = Profile(device).index
        (node,) = profile_nodes(graded_ball_material("Ball", Profile(lambda r, index=index: index(r)), backend="nodes"))
        tables.append(next(inner.image for inner in node.node_tree.nodes if inner.type == "TEX_IMAGE"))
    assert tables[0] != tables[1] and not np.array_equal(tables[0].pixels, tables[1].pixels)
    (node,) = profile_nodes(graded_ball_material("Eaton", Profile("eaton"), backend="nodes"))
    bpy.data.libraries.write(str(tmp_path / "balls.blend"), {bpy.data.materials["Eaton"]})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "balls.blend"), link=True) as (_, wanted):
        wanted.materials = ["Eaton"]
    (node,) = profile_nodes(graded_ball_material("Own", Profile("eaton"), backend="nodes"))
    assert node.node_tree.library is None


def test_materials_of_one_profile_share_a_node_and_each_backend_its_table(empty_file):
    one, other = (graded_ball_material("Ball", Profile("luneburg"), backend="osl") for _ in range(2))
    (node,), (second,) = profile_nodes(one), profile_nodes(other)
    assert node.node_tree == second.node_tree and len(bpy.data.images) == 1
    assert switch_backend(one, "nodes") == 1
    assert backend_of(node.node_tree) == "nodes" and backend_of(second.node_tree) == "osl"
    assert profile_of(node) == Profile("luneburg") and len(bpy.data.images) == 1 and node.outputs[0].is_linked
    switch(one, "osl")
    assert node.node_tree == second.node_tree
    node.inputs["Radius"].default_value = 0.25
    set_profile(node, Profile("eaton"))
    assert profile_of(node) == Profile("eaton") and profile_of(second) == Profile("luneburg")
    assert node.inputs["Radius"].default_value == 0.25 and node.outputs[0].is_linked
    set_profile(node, Profile(lambda r: np.sqrt(2 - r * r)))
    assert profile_of(node) is None and is_profile_node(node)
    assert {image.name for image in bpy.data.images} == {"Sweep of luneburg", "Sweep of function"}


@both_backends
def test_whoever_follows_the_nodes_meets_one_closure(backend, empty_file):
    material = graded_ball_material("Ball", Profile("luneburg"), backend=backend)
    (found,) = asked_closures(material)
    assert closures.closure_of_node(found.node) is GRADED_BALL and found.path == tuple(profile_nodes(material))
    assert {node.type for node, _ in asked(material)} >= {"TEX_IMAGE"} and not is_interface(found.node)
    group = found.node.node_tree
    group[VERSION_MARK] = 0
    group.nodes.clear()
    assert versions.update().updated == [GRADED_BALL.group_name(backend)] and GRADED_BALL.is_present(group)


def test_a_blender_without_osl_takes_the_nodes(empty_file):
    stage = Stage("graded", (8, 8), "osl")
    material = graded_ball_material("Ball", Profile("luneburg"), backend="osl")
    wear(stage.object("Ball", round_mesh(8)), material)
    assert checks.backends([material]) == {"osl": ("Ball",)} and checks.problems(stage.scene) == []
    checks.MENDS["osl_missing"](stage.scene, checks.Problem("osl_missing", (), {}, None, materials=("Ball",)))
    assert checks.backends([material]) == {"nodes": ("Ball",)}
    assert profile_of(profile_nodes(material)[0]) == Profile("luneburg")


def test_bad_input_is_refused_and_nothing_is_made(empty_file, one_sentence):
    before = len(bpy.data.materials), len(bpy.data.node_groups)
    with pytest.raises(TypeError) as error:
        graded_ball_material("Ball", "luneburg")
    one_sentence(error.value, "luneburg", "Profile")
    for radius in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(ValueError) as error:
            graded_ball_material("Ball", Profile("luneburg"), radius=radius)
        one_sentence(error.value, "radius", "above 0")
    with pytest.raises(ValueError) as error:
        graded_ball_material("Ball", Profile("magnifier", surface="textured"))
    one_sentence(error.value, "graded_core_material")
    with pytest.raises(ValueError):
        profile_node(empty_tree(bpy.data.materials.new("Other")), Profile("eaton"), backend="metal")
    assert (len(bpy.data.materials), len(bpy.data.node_groups)) == (before[0] + 1, before[1])

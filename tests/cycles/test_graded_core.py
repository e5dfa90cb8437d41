# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of a graded shell around a core: what is seen of the core is where numpy puts it, and no light is lost."""

import bmesh
import bpy
import mathutils
import numpy as np
import pytest

from nim_addon.cycles.casting import Meshes
from nim_addon.cycles.closures import GRADED_CORE, closure_of_node
from nim_addon.cycles.graded import graded_ball_material, graded_core_material, profile_nodes, profile_of
from nim_addon.cycles.material import asked_closures, switch_backend
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.visibility import as_rendered, shown
from nim_addon.physics import graded
from nim_addon.physics.balls import Shell
from nim_addon.physics.graded import Profile
from nim_addon.physics.rays import Fate, trace
from nim_addon.scenes import surfaces
from nim_addon.scenes.stage import Stage

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])

BIAS = 8.0  # added to places, so that what glows with them is positive
SHELLS = (
    Profile("magnifier", core=0.8, surface="textured"),
    Profile("magnifier", core=0.25, surface="textured"),
    Profile("luneburg", core=0.5, surface="textured"),
)
PLACE = (
    mathutils.Matrix.Translation((0.4, -1.2, 0.7))
    @ mathutils.Euler((0.3, 1.1, -0.4)).to_matrix().to_4x4()
    @ mathutils.Matrix.Scale(1.7, 4)
)
CENTRE, RADIUS = np.array(PLACE.translation), 1.7


def ball(stage, name, radius, material, segments=96):
    mesh = bpy.data.meshes.new(name)
    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=radius)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(material)
    thing = stage.object(name, mesh)
    thing.matrix_world = PLACE
    return thing


def core_material(type_, **inputs):
    material = bpy.data.materials.new("Core")
    nodes = Nodes(empty_tree(material))
    if type_ == "ShaderNodeEmission":  # it glows with the place of each of its points
        place = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
        inputs["Color"] = nodes.vector("ADD", place, (BIAS,) * 3)
    nodes.end(nodes.add(type_, inputs=inputs))
    return material


def stage_of(profile, backend, core, size=2):
    stage = Stage("core", (size, size), backend)
    ball(stage, "Shell", 1.0, graded_core_material("Shell", profile, backend=backend), 48)
    ball(stage, "Core", profile.core, core)
    stage.scene.cycles.samples = 4
    return stage


def ray(stage, sine, before=3.0):
    """Look along one ray, by its distance from the centre, from so far before it; returns its direction and that from there."""
    d = np.array((0.3, -0.8, 0.5)) / np.linalg.norm((0.3, -0.8, 0.5))
    f = np.cross(d, (0.1, 0.7, 0.4))
    f /= np.linalg.norm(f)
    data = bpy.data.cameras.new("Camera")
    data.type, data.clip_start, data.ortho_scale = "ORTHO", 1e-3, 1e-8
    camera = stage.scene.camera = stage.object("Camera", data)
    turn = mathutils.Vector(d).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.matrix_world = mathutils.Matrix.Translation(CENTRE + RADIUS * (sine * f - before * d)) @ turn
    return d, f


@both_backends
def test_a_white_globe_in_a_white_world_is_not_seen(backend, empty_file, render):
    for profile in SHELLS:
        stage = stage_of(profile, backend, core_material("ShaderNodeBsdfDiffuse", Color=(1.0, 1.0, 1.0)), 24)
        stage.camera(CENTRE + np.array([0, -8, 0]), CENTRE, 30)
        stage.world(surfaces.sky("White", (1, 1, 1), (1, 1, 1)))
        stage.scene.cycles.min_light_bounces = stage.scene.cycles.min_transparent_bounces = 1024
        picture = render(stage.scene)
        assert picture.mean() == pytest.approx(1, abs=1e-4) and picture.max() == pytest.approx(1, abs=1e-5), profile


@both_backends
def test_rays_land_on_the_core_where_they_should(backend, empty_file, render):
    for profile in SHELLS:
        stage = stage_of(profile, backend, core_material("ShaderNodeEmission"))
        ball(stage, "Wall", 4.0, core_material("ShaderNodeEmission"))
        for sine in (0.1, 0.4, 0.9):
            d, f = ray(stage, sine)
            landing = graded.landing(profile, sine)
            place = (render(stage.scene).reshape(-1, 3).mean(axis=0) - BIAS - CENTRE) / RADIUS
            if not landing.reached:  # it passes beside the core
                carried = graded.carry(profile, sine * f - 3 * d, d)
                assert np.linalg.norm(np.cross(place - carried.points, carried.directions)) < 1e-4
                continue
            c = np.sqrt(1 - sine**2)
            e1, e2 = sine * f - c * d, c * f + sine * d
            expected = np.cos(landing.angle) * e1 + np.sin(landing.angle) * e2
            # the core's facets lie within it by up to 1e-3
            assert np.linalg.norm(np.cross(place / np.linalg.norm(place), expected)) < 1e-3, (profile, sine)


@both_backends
def test_light_that_glides_away_from_the_core_falls_back(backend, empty_file, render):
    profile, sine = Profile("magnifier", core=0.5, surface="textured"), 0.7
    stage = stage_of(profile, backend, core_material("ShaderNodeEmission"))
    # straight from the core, where its angle to the radius has this sine
    d, f = ray(stage, 0.5 * sine, before=-0.5 * np.sqrt(1 - sine**2) - 1e-3)
    place = (render(stage.scene).reshape(-1, 3).mean(axis=0) - BIAS - CENTRE) / RADIUS
    angle = 2 * np.arccos(sine)
    out = sine * f + np.sqrt(1 - sine**2) * d
    expected = np.cos(angle) * out + np.sin(angle) * (sine * d - np.sqrt(1 - sine**2) * f)
    assert np.linalg.norm(place) == pytest.approx(0.5, abs=1e-3)
    # it comes in again at 46 degrees, where facets that lie 1e-3 within the core are met 1e-3 further on
    assert np.linalg.norm(np.cross(place / np.linalg.norm(place), expected)) < 1.5e-3


@both_backends
def test_a_mirror_in_a_shell_is_a_ball_with_a_mirror_in_it(backend, empty_file, render):
    profile = SHELLS[0]
    mirror = core_material("ShaderNodeBsdfAnisotropic", Color=(1.0, 1.0, 1.0), Roughness=0.0)
    stage = stage_of(profile, backend, mirror)
    bpy.data.objects["Core"].data.shade_smooth()
    ball(stage, "Wall", 5.0, core_material("ShaderNodeEmission"))
    for sine in (0.2, 0.7):
        d, f = ray(stage, sine)
        landed = render(stage.scene).reshape(-1, 3).mean(axis=0) - BIAS
        carried = graded.carry(Profile("magnifier", core=0.8), sine * f - 3 * d, d)
        away = (landed - CENTRE) / RADIUS - carried.points
        along = away @ carried.directions
        assert along > 0
        # a mirror of facets, 1e-3 off, seen five radii away
        assert np.linalg.norm(away - along * carried.directions) < 1e-2


def test_it_is_read_again_switched_and_cast(empty_file):
    stage = stage_of(SHELLS[1], "osl", core_material("ShaderNodeBsdfDiffuse"))
    material = bpy.data.objects["Shell"].data.materials[0]
    (node,) = profile_nodes(material)
    assert profile_of(node) == SHELLS[1] and node.label == "NIM Graded Core"
    (found,) = asked_closures(material)
    assert closure_of_node(found.node) is GRADED_CORE
    assert switch_backend(material, "nodes") == 1 and profile_of(node) == SHELLS[1]
    assert len(bpy.data.images) == 1 and tuple(bpy.data.images[0].size) == (1024, 2)
    with as_rendered(stage.scene) as depsgraph:
        surfaces_ = Meshes(shown(stage.scene, depsgraph), depsgraph)
        (shell,) = surfaces_.interfaces
        assert isinstance(shell, Shell)
        d = np.array((0.0, 0.6, -0.8))
        f = np.cross(d, (1.0, 0.0, 0.0))
        paths = trace(surfaces_, CENTRE + RADIUS * (0.5 * f - 3 * d), d, gap=surfaces_.gap)
    assert paths.fate[-1] == Fate.LANDED
    landing = graded.landing(SHELLS[1], 0.5)
    c = np.sqrt(0.75)
    e1, e2 = 0.5 * f - c * d, c * f + 0.5 * d
    expected = np.cos(landing.angle) * e1 + np.sin(landing.angle) * e2
    place = paths.end[-1] - CENTRE
    np.testing.assert_allclose(place / np.linalg.norm(place), expected, atol=1e-3)


def test_bad_input_is_refused(empty_file, one_sentence):
    for make, profile, word in (
        (graded_core_material, Profile("magnifier"), "surface='textured'"),
        (graded_core_material, Profile("luneburg", surface="textured"), "core"),
        (graded_ball_material, SHELLS[0], "graded_core_material"),
        (graded_core_material, Profile("cloak", core=0.7, hollow=0.5, surface="textured"), "cloak"),
    ):
        with pytest.raises(ValueError) as error:
            make("Ball", profile)
        one_sentence(error.value, word)
    assert not bpy.data.materials and not bpy.data.node_groups and not bpy.data.images

# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded balls that a render cannot show right, and the buttons that mend it; what is right has no problem."""

import bpy
import mathutils
import numpy as np
import pytest

from nim_addon import checks
from nim_addon.checks import ball_checks
from nim_addon.checks.sight import look
from nim_addon.cycles.graded import graded_ball_material, graded_core_material
from nim_addon.cycles.visibility import as_rendered
from nim_addon.figures import probes
from nim_addon.physics import Medium
from nim_addon.physics.graded import Profile
from tests.checks.pieces import WATER, add, ball, box, codes, found


def lens(name="Lens", profile=None):
    return add(name, graded_ball_material(name, profile or Profile("luneburg"), backend="nodes"), ball(1))


def plain(name, *pieces):
    return add(name, bpy.data.materials.new(name), *pieces)


def test_a_ball_alone_is_right(scene):
    obj = lens()
    obj.scale, obj.location, obj.rotation_euler = (2, 2, 2), (1, 2, 3), (0.3, 0.2, 0.1)
    assert codes(scene) == []
    scene.cycles.transparent_max_bounces = 4
    assert codes(scene) == ["transparent_bounces"]
    scene.cycles.transparent_max_bounces = 64
    obj.data.materials[0] = graded_ball_material("Large", Profile("luneburg"), backend="nodes", radius=1.5)
    assert codes(scene) == []  # it is not in itself


def test_a_ball_that_is_scaled_unevenly_is_mended_to_its_radius(scene):
    obj = lens()
    obj.scale = (1.5, 1, 1)
    (problem,) = found(scene)
    assert problem.code == "uneven_ball" and "Lens is not scaled evenly" in problem.sentence and problem.remedy
    checks.mend(scene)
    assert codes(scene) == [] and tuple(obj.scale) == (1.5, 1.5, 1.5)
    obj.scale = (-1.5, 1, 1)
    checks.mend(scene)
    assert tuple(obj.scale) == (1.5, 1.5, 1.5)
    parent = plain("Parent", box(0.1, (9, 9, 9)))
    parent.scale, obj.parent = (1, 2, 1), parent
    assert [(problem.code, problem.remedy) for problem in found(scene)] == [("uneven_ball", None)]


def noted(scene):
    with as_rendered(scene) as depsgraph:
        return [note.sentence for note in ball_checks.notes(look(scene, depsgraph, None))]


def test_what_another_object_makes_uneven_has_no_button(scene):
    obj = lens()
    parent = plain("Parent", box(0.1, (9, 9, 9)))
    obj.parent = parent
    # as long along each of its axes, but slanted
    obj.matrix_parent_inverse = mathutils.Matrix(((1, 0.6, 0, 0), (0, 0.8, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))
    assert [(problem.code, problem.remedy) for problem in found(scene)] == [("uneven_ball", None)]
    obj.parent = None
    obj.matrix_parent_inverse.identity()
    assert codes(scene) == []
    like = obj.constraints.new("COPY_SCALE")
    like.target, parent.scale = parent, (1, 2, 1)
    assert [(problem.code, problem.remedy) for problem in found(scene)] == [("uneven_ball", None)]


@pytest.mark.parametrize("distance, inside", [(0.9, True), (1.1, False)])
def test_a_camera_within(scene, distance, inside):
    lens().location = (0, 1, 0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, camera.location = camera, (0, 1 + distance, 0)
    assert codes(scene) == ["camera_in_ball"] * inside


def test_what_is_within_is_named_but_for_what_a_cloak_hides(scene):
    obj, other = lens(), plain("Box", box(0.4, (0.2, 0, 0)))
    (problem,) = found(scene)
    assert problem.code == "in_ball" and "Box is in Lens" in problem.sentence
    other.location.z = 2
    assert codes(scene) == []
    other.location.z = 0
    assert noted(scene) == []
    obj.data.materials[0] = graded_ball_material("Cloak", Profile("cloak", hollow=0.6), backend="nodes")
    assert codes(scene) == [] and noted(scene) == ["Box is in the hollow of Lens, and is not seen: that is the cloak."]
    other.location.x = 0.4
    assert codes(scene) == ["in_ball"] and noted(scene) == []
    # one mesh in two places: what is seen of neither is named once
    again = bpy.data.objects.new("Empty", None)
    again.instance_type, again.instance_collection = "COLLECTION", bpy.data.collections.new("Boxes")
    scene.collection.objects.link(again)
    again.instance_collection.objects.link(other)
    again.location.x = -0.4
    assert [problem.values["other"] for problem in found(scene)] == ["Box"]


def test_the_core_of_a_shell_is_seen(scene):
    profile = Profile("magnifier", core=0.5, surface="textured")
    add("Shell", graded_core_material("Shell", profile, backend="nodes"), ball(1))
    core = plain("Core", ball(0.5))
    assert codes(scene) == []
    core.scale = (1.5, 1.5, 1.5)
    assert codes(scene) == ["in_ball"]


def test_a_ball_in_water_is_not_matched_at_its_rim(scene):
    lens()
    water = add("Water", WATER, box(4))
    (problem,) = found(scene)
    assert problem.code == "rim_unmatched" and "Lens is in Water, of n = 1.33" in problem.sentence
    for apart in ((5, 0, 0), (0, 0, 5), (0, 0, -5)):
        water.location = apart
        assert codes(scene) == []


@pytest.mark.parametrize("medium, matched", [((2, 2), False), ((1, 2), False), ((1, 1), True)])
def test_a_rim_is_matched_by_index_and_impedance(medium, matched, scene):
    lens()
    add("Box", Medium(*medium), box(4))
    assert codes(scene) == [] if matched else "rim_unmatched" in codes(scene)


def test_a_lamp_without_size(scene):
    lens()
    light = bpy.data.lights.new("Lamp", "POINT")
    light.shadow_soft_size = 0
    lamp = bpy.data.objects.new("Lamp", light)
    scene.collection.objects.link(lamp)
    lamp.location.z = 5
    assert codes(scene) == ["light_at_ball"]
    checks.mend(scene)
    assert codes(scene) == [] and light.shadow_soft_size > 0
    light.type = "AREA"
    portal = lamp.data
    portal.size, portal.cycles.is_portal = 0, False
    assert codes(scene) == ["light_at_ball"]
    portal.cycles.is_portal = True  # which shines with nothing of its own
    assert codes(scene) == []
    portal.type, portal.cycles.is_portal = "POINT", False
    lamp.data.shadow_soft_size = 0
    add("Water", WATER, box(1, (9, 0, 0)))
    assert codes(scene) == ["zero_light"]  # and once


def test_a_scaled_ball_shows_beside_its_sphere_what_is_behind(scene, render):
    """What the check of the scale warns of: half of a stretched object is no ball."""
    obj = lens(profile=Profile("eaton"))
    obj.scale = (0.5, 1, 1)
    probes.sky(scene, lambda nodes, direction: direction)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.0, (0, 0, 5)
    scene.camera, scene.cycles.samples = camera, 4
    scene.render.resolution_x = scene.render.resolution_y = 32
    back = render(scene)[..., 2] > 0.5  # Eaton's ball looks up
    assert back.any() and np.mean(back) == pytest.approx(np.pi / 16, abs=0.03)

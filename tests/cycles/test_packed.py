# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that are packed into the file: Cycles renders each with its own pixels, whatever was rendered and removed before."""

import math

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics.lights import Sun
from nim_addon.cycles import settings
from nim_addon.cycles.graded import profile_nodes, set_profile
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.packed import packed_image
from nim_addon.physics import Medium
from nim_addon.physics.graded import Profile
from nim_addon.scenes import ball
from nim_addon.scenes.ball import BallParameters
from tests.caustics.rig import floor_eye, over_floor, sheet


def test_an_image_has_the_pixels_that_it_was_made_of(empty_file):
    pixels = np.random.default_rng(1).random((3, 5, 3)).astype(np.float32)
    for number in range(3):  # the second and the third find the places of those before
        image = packed_image("Numbers", pixels + number)
        assert image.name == "Numbers" and image.packed_file and tuple(image.size) == (5, 3)
        image.buffers_free()  # now as they are in the file
        found = np.array(image.pixels).reshape(3, 5, 4)
        np.testing.assert_array_equal(found[..., :3], pixels + np.float32(number))
        assert np.all(found[..., 3] == 1)
        bpy.data.images.remove(image)
    assert not bpy.data.images


def test_a_new_image_is_never_seen_as_one_that_was_removed(empty_file, render):
    scene = bpy.context.scene
    settings.lossless(scene, "nodes")
    scene.cycles.samples, scene.render.resolution_x, scene.render.resolution_y = 1, 8, 8
    scene.render.use_persistent_data = True
    mesh = bpy.data.meshes.new("Screen")
    mesh.from_pydata([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)], [], [(0, 1, 2, 3)])
    scene.collection.objects.link(bpy.data.objects.new("Screen", mesh))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    for number in range(8):
        material = bpy.data.materials.new("Shining")
        nodes = Nodes(empty_tree(material))
        image = packed_image("Numbers", np.full((1, 64, 3), number + 1.0))
        color = nodes.add("ShaderNodeTexImage", image=image).outputs[0]
        nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": color}))
        mesh.materials.clear()
        mesh.materials.append(material)
        assert render(scene) == pytest.approx(number + 1)
        bpy.data.batch_remove([material, image])


def addresses(*names):
    """Where the images stand whose names begin so: Cycles knows them by that."""
    return {image.as_pointer() for image in bpy.data.images if image.name.startswith(names)}


def test_no_table_stands_where_another_stood(empty_file):
    former = set()
    for number in range(30):
        core = 0.3 + number / 100
        if number % 5 == 0:
            scene = ball.build(BallParameters(device="magnifier", core=core), "nodes")
            (node,) = profile_nodes(scene.objects["Ball"].active_material)
        else:
            set_profile(node, Profile("magnifier", core))
        (here,) = addresses("Sweep")
        assert here not in former
        former.add(here)


def test_no_caustics_stand_where_others_stood(empty_file):
    scene = floor_eye(
        over_floor(interface_material("Surface", Medium(-1.33), backend="nodes"), sheet(0.5), size=16), 2.0
    )
    sun, former = Sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), math.radians(0.53)), set()
    for _ in range(8):
        caustics.bake(scene, [sun], texels=64, photons=1 << 10)
        (here,) = addresses(caustics.COLLECTION)
        assert here not in former
        former.add(here)

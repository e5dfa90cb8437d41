# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked caustics: the surface shines with what landed on it, where it landed, and is itself again when they are cleared."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles import caustics
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.lights import Sun
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage

THETA = math.radians(30)
SUN = Sun((math.sin(THETA), 0.0, -math.cos(THETA)), (2.0, 3.0, 4.0), math.radians(0.53))
ALBEDO = (0.5, 0.3, 0.1)


@pytest.fixture
def scene(empty_file):
    """A square metre of NIM at z = 0 over a wide floor at z = -1 in the dark, and an eye between them that sees 2 m of it."""
    stage = Stage("surface", (128, 128), "nodes")
    stage.mesh("Floor", *shapes.rectangle((-9, -9), (9, 9), -1.0), surfaces.plain("Floor", ALBEDO))
    material = interface_material("Surface", Medium(-1.33), backend="nodes")
    stage.mesh("Surface", *shapes.rectangle((-0.5, -0.5), (0.5, 0.5)), material)
    camera = stage.camera((0, 0, -0.5), (0, 0, -1), 40)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    dark = bpy.data.worlds.new("Dark")
    surfaces.Nodes(dark)
    stage.world(dark)
    stage.scene.cycles.samples = 4
    stage.scene.cycles.max_bounces = 0  # what the floor shines with is seen, not what that lights in turn
    return stage.scene


def test_the_floor_shines_with_what_the_surface_lets_through(scene, render):
    power = caustics.bake(scene, [SUN], texels=256, photons=1 << 18)
    for lamp in (thing for thing in scene.objects if thing.type == "LIGHT"):
        lamp.hide_render = True
    picture = render(scene)
    cosine = math.cos(THETA)
    # Cycles sees the same radiance on both sides of an interface, where really it grows by n^2
    through = cosine * (1 - float(Interface(Medium(-1.33)).fresnel(cosine).R)) / 1.33**2
    assert set(power) == {"Floor"}
    assert power["Floor"] == pytest.approx(through * sum(SUN.irradiance), rel=0.02)
    expected = through * np.array(SUN.irradiance) * ALBEDO / math.pi
    across = 64 * (1 + math.tan(float(Interface(Medium(-1.33)).theta_t(THETA))))  # column of the square's middle
    # well within the square, and well outside it
    assert picture[48:80, round(across) - 16 : round(across) + 16].mean((0, 1)) == pytest.approx(expected, rel=0.01)
    assert np.all(picture[:, round(across) + 38 :] == 0) and np.all(picture[:24] == 0)
    # all of the light, with its soft edge
    assert picture.sum((0, 1)) * (2 / 128) ** 2 == pytest.approx(expected, rel=0.02)
    # an edge as sharp as the photons are dense: from a tenth to nine tenths within three pixels
    profile = picture[48:80, :, 0].mean(0) / expected[0]
    assert np.count_nonzero((profile > 0.1) & (profile < 0.9)) <= 2 * 3


@pytest.mark.parametrize("n", [-1.33, 1.33])
def test_baked_and_path_traced_light_have_the_same_mean(n, scene, render):
    """A soft sun of 10 degrees, which a path tracer can find by chance: nothing is counted twice, nothing is lost."""
    node = scene.objects["Surface"].material_slots[0].material.node_tree.nodes["NIM Interface"]
    node.inputs["Index Inside"].default_value, node.inputs["Permeability Inside"].default_value = n, math.copysign(1, n)
    scene.cycles.max_bounces = 1024
    sun = SUN._replace(angle=math.radians(10), gaussian=True)
    angle, step = np.linspace(0, np.pi / 2, 20001, retstep=True)
    unit = np.pi * np.sum(np.exp(-np.square(angle / (sun.angle / 2))) * np.sin(2 * angle)) * step
    glow = tuple(-np.array(sun.direction)), tuple(np.array(sun.irradiance) / unit), 5.0
    dark, scene.world = scene.world, surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=glow)
    scene.world.cycles.sampling_method = "NONE"  # by chance, through the interface and past it alike
    small = 32
    scene.render.resolution_x = scene.render.resolution_y = small
    scene.cycles.samples = 4096
    traced = render(scene)[..., 1]
    scene.world = dark
    caustics.bake(scene, [sun], texels=256, photons=48 << 16)
    scene.cycles.samples = 64
    baked = render(scene)[..., 1]
    blocks = [picture.reshape(4, 8, 4, 8).swapaxes(1, 2).reshape(16, 64) for picture in (traced, baked)]
    # the noise of the path tracer, from pixels of nearly the same light
    noise = np.sqrt(np.mean(np.diff(traced, axis=0) ** 2) / 2 / 64)
    off = blocks[0].mean(axis=1) - blocks[1].mean(axis=1)
    assert traced.mean() > 0.2 and np.ptp(blocks[0].mean(axis=1)) > 0.1
    assert noise < 0.02 * traced.mean()
    assert np.sqrt(np.mean(off**2)) < 1.5 * noise
    assert abs(off.mean()) < 3 * noise / 4


def test_clearing_gives_the_scene_back(scene):
    names = {
        kind: sorted(one.name for one in getattr(bpy.data, kind))
        for kind in ("objects", "meshes", "materials", "lights")
    }
    caustics.bake(scene, [SUN], texels=64, photons=1 << 13)
    assert scene.objects["Floor"].hide_render
    caustics.bake(scene, [SUN], texels=64, photons=1 << 13)  # again, in place of the former
    assert len([thing for thing in scene.objects if thing.get(caustics.OWNER)]) == 2  # the floor's copy and the lamp
    caustics.clear(scene)
    assert not scene.objects["Floor"].hide_render
    assert not [image for image in bpy.data.images if image.name.startswith(caustics.COLLECTION)]
    assert {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in names} == names


def test_a_bake_lives_in_the_file(scene, render, tmp_path):
    caustics.bake(scene, [SUN], texels=128, photons=1 << 15)
    before = render(scene)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    after = render(bpy.data.scenes["NIM surface"])
    assert before.max() > 0.1
    assert np.abs(after - before).max() < 1e-5

# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests for all wavelengths, or for one: asked for, recorded, rendered, and as a stack of one render each shows them."""

import dataclasses

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.cycles import spectral_images, wavelength
from nim_addon.physics import colour
from nim_addon.renders import changes
from nim_addon.renders.request import Request
from nim_addon.renders.stack import Stack
from nim_addon.scenes.stage import Pose

SKY = (0.2, 0.5, 0.9)


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]


def test_spectral_is_a_setting_of_every_scene(one_sentence):
    for settings in (["n=1.5", "spectral=yes"], {"n": 1.5, "spectral": True}):
        asked = Request.of("sphere", settings, samples=128)
        assert asked.spectral and asked.record()["spectral"] is True and asked.name == "sphere_n-1.5_spectral-yes"
    assert Request.of("sphere", ["spectral=no"]) == Request.of("sphere")
    assert "spectral" not in Request.of("sphere").record()
    with pytest.raises(ValueError) as caught:
        Request.of("sphere", ["spectral=some"])
    one_sentence(caught.value, "spectral = 'some' is neither on nor off")


def test_how_many_passes_are_decided_and_recorded(empty_file):
    asked = Request.of("sphere", ["spectral=yes"], size=(800, 600), samples=128, caustics="path")
    assert asked.spectral_passes is None and asked.decided().spectral_passes == 8
    assert dataclasses.replace(asked, size=(24, 16)).decided().spectral_passes == 1
    assert dataclasses.replace(asked, spectral_passes=2).decided().record()["spectral_passes"] == 2


def lit(scene):
    """A sky of one colour, and nothing but the ball."""
    for obj in [obj for obj in scene.objects if obj.type == "MESH" and obj.name != "Sphere"]:
        scene.collection.children[0].objects.unlink(obj)
    scene.world = bpy.data.worlds.new("Lit")
    if scene.world.node_tree is None:  # from 5.0 on there is one
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*SKY, 1)


def test_a_sky_keeps_its_colour_whatever_way_it_is_rendered(tmp_path, empty_file):
    """In all wavelengths at once, by its preview in a stack, and for who reads the stack's spectrum."""
    usual = Request.of(
        "sphere", ["n=nim-normal"], size=(6, 4), samples=256, caustics="path", change=changes.register(lit)
    )
    # within the ball alone: at its edge chance says which wavelengths meet it
    usual = dataclasses.replace(usual, pose=Pose((0, -7, 1), (0, 0, 1), 8))
    for passes in (1, 8):
        made = dataclasses.replace(usual, spectral=True, spectral_passes=passes).render(tmp_path, f"passes{passes}")
        np.testing.assert_allclose(pixels(made.exr).mean(axis=(0, 1)), SKY, rtol=3e-3)
    few = dataclasses.replace(usual, samples=2)
    found = spectral_images.read(Stack(few, tuple(np.arange(380, 731, 10.0))).render(tmp_path, "s").exr)
    np.testing.assert_allclose(found.rgb, np.broadcast_to(SKY, (4, 6, 3)), rtol=2e-4)
    fine = np.arange(380, 731.0)
    spectrum = np.array([np.interp(fine, found.wavelengths_nm, line) for line in found.radiance.reshape(-1, 36)])
    seen = colour.xyz_to_srgb(spectrum @ colour.colour_matching(fine))
    np.testing.assert_allclose(seen, np.broadcast_to(SKY, seen.shape), atol=0.01)


def test_media_at_the_wavelength_that_they_are_at_anyway_are_the_same(tmp_path, empty_file):
    usual = Request.of("sphere", ["n=n-bk7"], size=(24, 16), samples=4, backend="nodes", caustics="path")
    asked = {"plain": usual, "green": dataclasses.replace(usual, wavelength=550.0)}
    asked |= {"violet": dataclasses.replace(usual, wavelength=400.0)}
    made = {name: one.render(tmp_path, name) for name, one in asked.items()}
    plain, green, violet = (pixels(one.exr) for one in made.values())
    assert np.median(np.abs(green - plain)) < 1e-6 < np.abs(violet - plain).mean()
    assert made["green"].record["wavelength"] == 550.0 and wavelength.neutral() == 550.0


def test_a_spectral_render_is_repeated_of_its_record(tmp_path, empty_file):
    asked = Request.of("sphere", ["spectral=yes"], size=(8, 6), samples=4, backend="nodes", caustics="path")
    made = asked.render(tmp_path, "one")
    request, record = Request.again(made.png)
    assert request == dataclasses.replace(asked, spectral_passes=1) and record == made.record
    assert record["spectral"] is True and request.render(tmp_path, "one").was_there

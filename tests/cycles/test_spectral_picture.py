# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral pictures: strata are the samples of one render, colours outside of sRGB are kept, cleaned and displayed."""

import sys

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.cycles import render as cycles_render
from nim_addon.cycles import spectral, spectral_picture, wavelength
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.spectral_picture import part_of, usual_strata
from nim_addon.physics import colour
from nim_addon.scenes.stage import Stage


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3].astype(float)


@pytest.fixture
def stage(empty_file):
    """A white square that glows, seen from above, 16 x 16 pixels, spectral."""
    stage = Stage("picture", (16, 16), "nodes")
    material = bpy.data.materials.new("Light")
    nodes = Nodes(empty_tree(material))
    emission = nodes.add("ShaderNodeEmission")
    nodes.add("ShaderNodeOutputMaterial", inputs={"Surface": emission.outputs[0]})
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    stage.mesh("Square", corners, [(0, 1, 2, 3)], material)
    stage.camera((0, 0, 4), (0, 0, 0), 20)
    stage.scene.cycles.samples = 64
    spectral.set_up(stage.scene, "nodes")
    wavelength.set_clear_paths(white=False)  # what is seen directly has its weight, too
    return stage


def test_how_many_strata_suit_a_picture():
    many = 800 * 600
    assert [usual_strata(samples, many) for samples in (1, 2, 4, 16, 64, 100, 128, 256, 1024)] == [
        1, 1, 2, 4, 8, 4, 8, 16, 16,
    ]  # fmt: skip
    assert usual_strata(256, 32 * 24) == 1  # where Cycles would start more than it renders
    assert usual_strata(99, many) == 1


def test_strata_are_ranges_of_the_samples_of_one_render(empty_file):
    """Without wavelengths their mean is the picture of one render, to rounding."""
    stage = Stage("plain", (12, 8), "nodes")
    world = bpy.data.worlds.new("World")
    if world.node_tree is None:  # from 5.0 on there is one
        world.use_nodes = True
    nodes = Nodes(world.node_tree)
    place = nodes.add("ShaderNodeNewGeometry")
    nodes.feed(world.node_tree.nodes["Background"].inputs["Color"], place.outputs["Incoming"])
    stage.world(world)
    stage.camera((0, 0, 0), (1, 1, 1), 120)
    scene = stage.scene
    scene.cycles.samples = 32
    if not hasattr(scene.cycles, "use_sample_subset"):  # before 4.5 one sequence alone goes on at an offset
        scene.cycles.sampling_pattern = "TABULATED_SOBOL"
    once = cycles_render.layers_of(scene)["Combined"]
    merged = spectral_picture.picture_of(scene, 8)
    np.testing.assert_allclose(merged, once, atol=2e-6)
    assert not getattr(scene.cycles, "use_sample_subset", False) and scene.cycles.samples == 32


def test_strata_share_the_spectrum_out(stage):
    """A render of each stratum has its part of the weights alone, their mean is white, and after them all is drawn again."""
    whole = spectral_picture.picture_of(stage.scene, 8)
    np.testing.assert_allclose(whole.mean(axis=(0, 1)), 1, atol=3e-3)
    spectral.set_stratum(0, 8)
    violet = cycles_render.layers_of(stage.scene)["Combined"].mean(axis=(0, 1))
    spectral.set_stratum(7, 8)
    red = cycles_render.layers_of(stage.scene)["Combined"].mean(axis=(0, 1))
    assert violet[2] > 1 > violet[0] and red[0] > 1 > red[2]
    spectral_picture.picture_of(stage.scene, 2)
    for tree in wavelength.groups():
        assert tree.nodes[wavelength.START].outputs[0].default_value == 0
        assert tree.nodes[wavelength.WIDTH].outputs[0].default_value == 1


def test_colours_outside_of_srgb_are_kept_in_the_exr_and_desaturated_in_the_png(stage, tmp_path):
    stage.scene.view_settings.view_transform = "Standard"

    def one_stratum(scene, linear, shown, progress):
        spectral.set_stratum(5, 16)
        spectral_picture.drawing(1)(scene, linear, shown, progress)

    exr, png = cycles_render.render(stage.scene, tmp_path, "a", drawing=one_stratum)
    linear, shown = pixels(exr).mean(axis=(0, 1)), pixels(png).mean(axis=(0, 1))
    assert linear.min() < -0.2
    expected = colour.encoded(colour.into_gamut(linear))
    np.testing.assert_allclose(shown, expected, atol=0.02)
    assert np.abs(colour.encoded(linear) - expected).max() > 0.05  # what clipping shows is another colour


def test_the_denoiser_leaves_colours_outside_of_srgb(stage, capfd):
    layers = {
        "Combined": np.broadcast_to((-0.3, 0.9, 0.2), (16, 16, 3)).copy(),
        "Denoising Albedo": np.ones((16, 16, 3)),
        "Denoising Normal": np.broadcast_to((0.0, 0.0, 1.0), (16, 16, 3)).copy(),
        "Denoising Depth": np.ones((16, 16, 1)),
    }
    clean = spectral_picture.denoised(layers)
    np.testing.assert_allclose(clean.mean(axis=(0, 1)), (-0.3, 0.9, 0.2), atol=0.03)
    sys.stdout.flush()
    assert not capfd.readouterr().out  # which would stand among what programs read


def test_a_denoised_picture_has_less_noise_and_the_same_mean(stage, tmp_path):
    stage.scene.cycles.samples = 4  # of which the weights alone are noise
    noisy, _ = cycles_render.render(stage.scene, tmp_path, "noisy", drawing=spectral_picture.drawing(1))
    stage.scene.cycles.use_denoising = True
    clean, _ = cycles_render.render(stage.scene, tmp_path, "clean", drawing=spectral_picture.drawing(1))
    assert pixels(clean).std(axis=(0, 1)).max() < 0.5 * pixels(noisy).std(axis=(0, 1)).max()
    np.testing.assert_allclose(pixels(clean).mean(axis=(0, 1)), pixels(noisy).mean(axis=(0, 1)), atol=0.03)
    assert stage.scene.cycles.use_denoising and not stage.scene.view_layers[0].cycles.denoising_store_passes


def test_parts_report_as_one():
    told = []
    report = part_of(lambda *words: told.append(words), 1, 4)
    report(0, 8, None)
    report(4, 8, 10.0)
    report(8, 8, 0.0)
    part_of(lambda *words: told.append(words), 3, 4)(8, 8, 0.0)
    assert told == [(8, 32, None), (12, 32, 50.0), (16, 32, None), (32, 32, 0.0)]
    assert part_of(None, 0, 2) is None

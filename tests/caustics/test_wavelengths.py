# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons of a spectral scene: each is bent by its own wavelength, counted by it, and adds its colour."""

import itertools

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics.density import ENOUGH, spread
from nim_addon.caustics.lights import Sun, light_of
from nim_addon.cycles import spectral
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Interface, Medium
from tests.caustics.rig import dark_world, landed_of, over_floor, sheet

BACKENDS = pytest.mark.parametrize("backend", ["osl", "nodes"])
HALF = 0.005  # of the sheet, a metre above the floor
SUN = Sun((np.sqrt(0.5), 0.0, -np.sqrt(0.5)), (1.0, 1.0, 1.0), 0.0)


@BACKENDS
@pytest.mark.parametrize("name", ["nim-mirror", "n=cauchy(1.4 0.02)"])
def test_each_photon_lands_where_its_own_wavelength_takes_it(empty_file, backend, name):
    medium = Medium.parse(name)
    stage = over_floor(interface_material("Surface", medium, backend=backend), sheet(HALF), backend=backend)
    spectral.set_up(stage.scene, backend)
    names, landed = landed_of(stage.scene, SUN, 1 << 13, 2)
    assert len(names) > 5000 and set(names) == {"Floor"}
    assert landed.nm.min() < 400 and landed.nm.max() > 710
    n = medium.spectrum(landed.nm)[0].real
    sine = np.sqrt(0.5) / n
    off = landed.place[:, 0] - sine / np.sqrt(1 - sine**2)
    # from where on the sheet it came, at the most; single precision, and drift in the backend of nodes
    assert np.abs(off).max() < HALF + 2e-4
    # and that is even over the wavelengths: a wavelength that is not the photon's own would be off by its dispersion
    ends = np.quantile(landed.nm, [0, 0.2, 0.8, 1])
    for low, high in itertools.pairwise(ends):
        here = off[(landed.nm >= low) & (landed.nm <= high)]
        assert abs(here.mean()) < 4 * HALF / np.sqrt(3 * len(here)) + 1e-4
    np.testing.assert_allclose(landed.share, 1 / n**2, rtol=1e-5)
    # all light together is white, and what is not reflected of it (R is the same to 1e-3 over these wavelengths)
    T = 1 - Interface(medium.at(550)).fresnel(np.radians(45)).R
    total = landed.power.sum(axis=0) / 2 / (2 * HALF) ** 2 / np.sqrt(0.5)
    noise = landed.power.std(axis=0) * np.sqrt(len(landed.nm)) / 2 / (2 * HALF) ** 2 / np.sqrt(0.5)
    assert (np.abs(total - T) < 4 * noise + 0.01).all(), (total, T, noise)


@BACKENDS
def test_without_a_spectral_scene_all_have_the_neutral_wavelength(empty_file, backend):
    medium = Medium.parse("nim-mirror")
    stage = over_floor(interface_material("Surface", medium, backend=backend), sheet(HALF))
    _, landed = landed_of(stage.scene, SUN, 1 << 10, 1)
    sine = np.sqrt(0.5) / -1.33
    assert np.abs(landed.place[:, 0] - sine / np.sqrt(1 - sine**2)).max() < HALF + 1e-5
    assert (landed.nm == 550).all() and np.ptp(landed.power) == 0


def test_caustics_of_a_spectral_scene_keep_their_colours(empty_file):
    stage = over_floor(interface_material("Surface", Medium.parse("nim-mirror"), backend="nodes"), sheet(HALF))
    scene = stage.scene
    lamp = stage.object("Sun", bpy.data.lights.new("Sun", "SUN"))
    lamp.data.energy, lamp.data.angle = 3, 0
    lamp.rotation_euler.y = -np.pi / 4
    scene.world = dark_world()
    bpy.context.view_layer.update()
    scene.view_layers[0].update()
    before = light_of(lamp)
    spectral.set_up(scene, "nodes")
    assert light_of(lamp) == before  # the weights are not its own light
    caustics.bake(scene, photons=1 << 15, texels=128)
    image = next(image for image in bpy.data.images if "Floor" in image.name)
    pixels = np.array(image.pixels[:]).reshape(*reversed(image.size), 4)[..., :3]
    red, green, blue = (np.average(np.indices(pixels.shape[:2])[1], weights=pixels[..., c]) for c in range(3))
    # towards -x is farther: blue bends most in nim-mirror, so it lands nearer
    assert red < green < blue and pixels.min() < 0
    assert spectral.set_up(scene, "nodes").materials == 1  # the copy of the floor, which shines
    assert not caustics.out_of_date(scene)
    caustics.clear(scene)
    spectral.undo(scene)
    assert light_of(lamp) == before and not any("NIM" in image.name for image in bpy.data.images)


def test_colours_below_0_are_spread_as_others_are():
    rng = np.random.default_rng(3)
    flux = rng.normal(0, 1, (32, 32, 3))
    counts, area = np.full((32, 32), ENOUGH), np.ones((32, 32))
    np.testing.assert_allclose(spread(flux, counts, area).sum(axis=(0, 1)), flux.sum(axis=(0, 1)), atol=1e-9)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons through windows of lenslets and uniaxial slabs: where they land, and how much light they are."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.caustics.lights import Sun
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.slabs import slab_material
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import shapes, surfaces
from tests.caustics.rig import landed_of, over_floor

HALF, SIDE = 1.0, 64
SLANT = (0.3, 0.1, -1.0)
SPREAD = 1 / math.sqrt(1.1)  # of light on the ground that comes so


def landed(material, shape, direction=SLANT, passes=4):
    """Place (N, 2) and power (N, 3), as Cycles counts it, of what landed on a floor 1 m below, in the light of a sun of 1."""
    direction = np.array(direction) / np.linalg.norm(direction)
    scene = over_floor(material, shape).scene
    _, landed = landed_of(scene, Sun(tuple(direction), (1.0, 1.0, 1.0), 0.0), SIDE**2, passes)
    return landed.place, landed.power * landed.share[:, None] / passes


def window(law, backend="nodes", tint=(1, 1, 1)):
    material = lenslet_material("Window", law, backend=backend)
    material.node_tree.nodes["NIM Lenslet Window"].inputs["Tint"].default_value = (*tint, 1)
    return material


def within(place, middle):
    return np.abs(place - middle).max(axis=1) < HALF + 1e-3


def stretched(law, direction):
    """cos d omega behind a window over that in front of it, by a small cone of rays."""
    d = np.array(direction) / np.linalg.norm(direction)
    axes = np.linalg.svd(d[None])[2][1:]
    cone = law.bend(np.stack([d, *(d + 1e-6 * axes)]), (0, 0, 1), (1, 0, 0))
    solid = np.linalg.norm(np.cross(cone[1] - cone[0], cone[2] - cone[0])) / 1e-12
    return abs(cone[0, 2] / d[2]) * solid


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_light_lands_behind_a_window_as_much_as_is_seen_from_there(backend, empty_file):
    for law in (LensletWindow(-1.0), LensletWindow((2.0, -0.5)), LensletWindow(2.0, (0.2, 0.0))):
        before = set(bpy.data.node_groups)
        place, power = landed(window(law, backend), shapes.rectangle((-HALF, -HALF), (HALF, HALF)))
        slopes = (np.array(SLANT[:2]) - law.offset) / law.eta
        through = within(place, slopes)
        assert power[through, 0].sum() == pytest.approx(4 * SPREAD * stretched(law, SLANT), rel=2e-2)
        np.testing.assert_allclose(place[through].mean(axis=0), slopes, atol=0.03)
        new = {group.name for group in set(bpy.data.node_groups) - before}
        assert not any("photons" in name for name in new)


def test_lenslets_of_a_width_and_a_tint_take_their_share(empty_file):
    law = LensletWindow(-1.0, aperture=1.2)
    place, power = landed(window(law, tint=(1, 0.5, 0.25)), shapes.rectangle((-HALF, -HALF), (HALF, HALF)))
    share = float(law.transmittance(SLANT, (0, 0, 1), (1, 0, 0)))
    assert 0.1 < share < 0.9
    found = power[within(place, -np.array(SLANT[:2]))].sum(axis=0)
    np.testing.assert_allclose(found, 4 * SPREAD * share * np.array((1, 0.5, 0.25)), rtol=2e-2)


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_a_hyperbolic_slab_casts_two_patches_of_light(backend, empty_file):
    slab = UniaxialSlab(2.0, -3.0, 2.0)
    upper, face = shapes.rectangle((-8, -8), (8, 8), 2.0)
    lower, _ = shapes.rectangle((-8, -8), (8, 8))
    plate = shapes.joined((upper, face), (lower, [face[0][::-1]]))[:2]
    scene = over_floor(slab_material("Slab", slab, backend=backend), plate)
    scene.mesh("Hole", *shapes.frame((0.4, 0.4), (12, 12), 2.001), surfaces.shining("Black", lambda nodes: (0, 0, 0)))
    theta = math.pi / 4
    sun = Sun((math.sin(theta), 0, -math.cos(theta)), (1.0, 1.0, 1.0), 0.0)
    _, landed = landed_of(scene.scene, sun, 16 * SIDE**2, 4)
    place, power = landed.place[:, 0], landed.power[:, 0] / 4
    T, slopes = slab.transmittances(theta), slab.slopes(theta)
    found = []
    for share, slope in ((T.p, slopes.p), (T.s, slopes.s)):
        patch = np.abs(place - slab.thickness * slope - 1) < 0.42
        assert power[patch].sum() == pytest.approx(0.64 * math.cos(theta) * share / 2, rel=4e-2)
        found.append(patch)
    assert np.logical_xor(*found).all(), "each photon lies in one of the two"

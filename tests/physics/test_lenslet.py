# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of lenslets: against rays through two thin lenses, every ray run backwards, and the sharp images that they make."""

import itertools
import math

import numpy as np
import pytest

from nim_addon.physics.lenslet import LensletWindow, Pane
from nim_addon.physics.rays import Fate, Plane, Shapes, trace

ETAS = (-1.0, -1.2, 0.8, -0.5, 2.0, (-0.7, 1.6))
OFFSETS = ((0.0, 0.0), (0.3, -0.2))
NORMAL, U = np.array([0.2, -0.9, 0.4]), np.array([1.0, 0.1, 0.3])


def directions(count=400, seed=3):
    return np.random.default_rng(seed).normal(size=(count, 3))


def through_two_lenses(eta, offset, aperture, slope, places, from_behind):
    """Slopes after two thin lenses in one section, f1 = 1, and whether the second is met within the aperture.

    places: where the rays meet the first lens, from its own middle
    """
    lenses = [(0.0, 1.0), (offset, -eta)]  # middle and focal length, in front and behind
    (first, f), (second, g) = lenses[::-1] if from_behind else lenses
    x = first + places
    slope = slope - (x - first) / f
    x = x + (1 - eta) * slope  # the way between them, which is negative as a virtual one for eta > 1
    return slope - (x - second) / g, np.abs(x - second) <= aperture / 2


@pytest.mark.parametrize(("eta", "offset"), list(itertools.product(ETAS, OFFSETS)))
def test_every_ray_runs_back(eta, offset):
    window = LensletWindow(eta, offset)
    d = directions()
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    there = window.bend(d, NORMAL, U)
    np.testing.assert_allclose(window.bend(-there, NORMAL, U), -d, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(there, axis=-1), 1, rtol=0, atol=1e-14)
    assert np.all((there @ NORMAL) * (d @ NORMAL) > 0), "none is reflected"


@pytest.mark.parametrize(("eta", "offset"), list(itertools.product(ETAS[:5], (0.0, 0.3, -0.2))))
def test_slopes_and_shares_are_those_of_two_lenses(eta, offset):
    aperture = 0.8
    window = LensletWindow(eta, (offset, 0.0), aperture)
    across = ((np.arange(100_000) + 0.5) / 100_000 - 0.5) * aperture
    for slope, behind in itertools.product((-1.5, -0.4, 0.0, 0.2, 0.9), (False, True)):
        d = (slope, 0.0, 1.0 if behind else -1.0)
        after, passes = through_two_lenses(eta, offset, aperture, slope, across, behind)
        bent = window.bend(d, (0, 0, 1), (1, 0, 0))
        np.testing.assert_allclose(after, bent[0] / abs(bent[2]), rtol=0, atol=1e-12)  # whatever place of the lens
        straight = through_two_lenses(eta, 0.0, aperture, 0.0, across, behind)[1].mean()
        assert window.transmittance(d, (0, 0, 1), (1, 0, 0)) == pytest.approx(passes.mean() * straight, abs=1e-4)


def test_the_shares_of_straight_light():
    for eta, share in ((-1.0, 1.0), (-2.0, 0.25), (0.5, 1.0), (-0.5, 1.0)):
        window = LensletWindow(eta, aperture=0.1)
        assert window.transmittance((0, 0, -1), (0, 0, 1), (1, 0, 0)) == pytest.approx(share, abs=1e-15)
    assert LensletWindow(-1.0, aperture=0.1).transmittance((0.1, 0, -1), (0, 0, 1), (1, 0, 0)) == 0
    assert LensletWindow(-1.0).transmittance((9, 0, -1), (0, 0, 1), (1, 0, 0)) == 1, "ideal lenslets lose nothing"


@pytest.mark.parametrize("eta", ETAS[:5])
def test_points_have_sharp_images(eta):
    window, depth = LensletWindow(eta), 1.5
    slopes = np.array([(x, y) for x in (-2.0, -0.3, 0.7) for y in (-1.0, 0.1, 3.0)])
    # light from a point behind, through the places where it meets the window
    light = window.bend(np.column_stack([slopes, np.ones(len(slopes))]), (0, 0, 1), (1, 0, 0))
    back = window.image_depth(depth)
    np.testing.assert_allclose(slopes * depth, light[:, :2] / light[:, 2:] * back, rtol=0, atol=1e-12)


def test_the_apparent_sizes_of_the_scene():
    found = [LensletWindow(eta).apparent_size(5.0, 1.5) for eta in (-1.0, -1.2, 0.8)]
    np.testing.assert_allclose(found, [13 / 7, 26 / 15, 52 / 55], rtol=1e-15)
    assert LensletWindow(-1.0).image_depth(1.0) == -1, "in front of the window: depth is turned over"


@pytest.mark.parametrize("wrong", [{"eta": 0}, {"eta": (1, 0)}, {"eta": math.nan}, {"aperture": 0}, {"aperture": -1}])
def test_wrong_numbers_are_refused_in_one_sentence(wrong, one_sentence):
    with pytest.raises(ValueError) as error:
        LensletWindow(**wrong)
    assert next(iter(wrong)) in one_sentence(str(error.value))


def test_rays_within_the_window_go_nowhere():
    assert np.isnan(LensletWindow(2.0).bend((1, 0, 0), (0, 0, 1), (1, 0, 0))).all()


def test_rays_are_traced_through_a_window():
    window = LensletWindow((-1.0, 2.0), (0.1, 0.0), 5.0)
    pane = Plane((0, 0, 0), (0, 0, 1), Pane(window, np.eye(3)[:2]))
    floor = Plane((0, 0, -2), (0, 0, 1))
    paths = trace(Shapes(pane, floor), [(0, 0, 1), (0, 0, 1)], [(0.2, 0.4, -1), (0, 0, -1)])
    landed = paths.fate == Fate.LANDED
    np.testing.assert_allclose(paths.end[landed], [(0, 0.8, -2), (0.2, 0, -2)], atol=1e-12)
    share = window.transmittance([(0.2, 0.4, -1), (0, 0, -1)], (0, 0, 1), (1, 0, 0))
    np.testing.assert_allclose(paths.arriving[landed], share, atol=1e-15)
    np.testing.assert_allclose(paths.lost, 1 - share, atol=1e-15)
    # a face that looks along x, in which u is y
    side = Shapes(
        Plane((0, 0, 0), (1, 0, 0), Pane(LensletWindow((2.0, -1.0)), np.eye(3)[:2])), Plane((-1, 0, 0), (1, 0, 0))
    )
    (end,) = (paths := trace(side, (1, 0, 0), (-1, 0.5, 0.25))).end[paths.fate == Fate.LANDED]
    np.testing.assert_allclose(end, (-1, 0.75, 0), atol=1e-12)


def test_only_windows_of_eta_1_and_minus_1_keep_solid_angles():
    assert LensletWindow(-1.0).keeps_solid_angle and LensletWindow((1.0, -1.0)).keeps_solid_angle
    assert not LensletWindow(-1.2).keeps_solid_angle and not LensletWindow(-1.0, (0.1, 0.0)).keeps_solid_angle

# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat lenses and the caustic of a half space: against closed forms of their own, and against rays that are traced."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nim_addon.physics import Interface, Medium, flat_lens, half_space
from nim_addon.physics.rays import Convex, Kind, Plane, Shapes, trace

THETA = np.radians(np.linspace(-85, 85, 341))


def traced(shape, theta, start, at):
    """x, at z = -at, of the last ways of rays that start at z = start, down through a shape; NaN where they turn back."""
    directions = np.stack([np.sin(theta), 0 * theta, -np.cos(theta)], axis=-1)
    paths = trace(Shapes(shape), (0, 0, start), directions, branches=False, least=0, gap=1e-14)
    x = np.full(len(theta), np.nan)
    last = ~np.isin(np.arange(len(paths.ray)), paths.parent) & (paths.kind != Kind.REFLECTED)
    way = paths.direction[last]
    x[paths.ray[last]] = paths.start[last][:, 0] + (-at - paths.start[last][:, 2]) / way[:, 2] * way[:, 0]
    return x


def plate(n, thickness):
    return Convex(((0, 0, 0), (0, 0, -thickness)), ((0, 0, 1), (0, 0, -1)), Interface(Medium(n, n)))


@pytest.mark.parametrize("n", (-1.0, -1.05, -0.95, -1.5, 1.33))
def test_rays_land_where_traced_rays_do(n):
    theta = THETA[np.abs(np.sin(THETA)) < 0.999 * abs(n)]
    through = traced(plate(n, 0.7), theta, 0.3, 1.1)
    np.testing.assert_allclose(flat_lens.landing(n, theta, 0.7, 0.3, 0.4), through, rtol=0, atol=1e-11)
    below = traced(Plane((0, 0, 0), (0, 0, 1), Interface(Medium(n, n))), theta, 0.3, 1.1)
    np.testing.assert_allclose(half_space.landing(n, theta, 0.3, 1.1), below, rtol=0, atol=1e-11)


@given(st.floats(0.01, 2), st.floats(0.01, 0.99))
def test_minus_one_images_all_rays_into_one_point(thickness, part):
    distance = part * thickness
    behind = flat_lens.image(-1, thickness, distance)
    assert behind == pytest.approx(thickness - distance)
    np.testing.assert_allclose(flat_lens.landing(-1, THETA, thickness, distance, behind), 0, atol=1e-12)
    assert flat_lens.nearer(-1, thickness) == 2 * thickness


@pytest.mark.parametrize("n", (-1.05, -0.95, -1.5, -1))
def test_the_spread_beside_minus_one(n):
    """Against rays of a pinhole, even in its picture."""
    radius = np.sqrt(np.random.default_rng(1).random(400_000)) * math.tan(math.radians(60))
    theta = np.arctan(radius)
    sine = np.sin(theta)
    x = np.tan(theta) - sine / np.sqrt(n * n - sine**2)
    widest = math.radians(60)
    assert flat_lens.spread(n, 1.0, widest, 0.8) == pytest.approx(np.quantile(np.abs(x), 0.8), rel=0.01, abs=1e-12)
    assert flat_lens.spread(n, 0.3, widest) == pytest.approx(0.3 * flat_lens.spread(n, 1.0, widest), abs=1e-12)


def test_a_thing_appears_nearer_by_what_paraxial_rays_say():
    small = 1e-4
    for n in (-1, -1.05, -2, 1.33):
        apparent = flat_lens.landing(n, small, 0.7, 0.3, 5.0) / math.tan(small)
        assert apparent == pytest.approx(0.3 + 0.7 + 5.0 - flat_lens.nearer(n, 0.7), abs=1e-6)


@pytest.mark.parametrize(
    "m, z, x",
    [(1.5, 2.0, 0.13042), (1.5, 3.0, 0.60401), (2.0, 3.5, 0.35112), (0.8, 0.5, 0.18602), (0.8, 0.7, 0.03314)],
)
def test_the_caustic_is_where_landings_turn(m, z, x):
    theta = np.linspace(0, min(math.pi / 2, math.asin(min(1, m))) - 1e-3, 200_001)[1:]
    # near the axis rays land on the other side of it, and turn where the caustic is
    landed = half_space.landing(-m, theta, 1.0, z) * (1 if m < 1 else -1)
    turning = landed.max()
    assert half_space.caustic_at(-m, z) == pytest.approx(turning, abs=1e-8) == pytest.approx(x, abs=2e-5)


@pytest.mark.parametrize("n", (-1.5, -0.8, 1.33))
def test_caustics_are_where_neighbouring_rays_meet(n):
    theta = np.radians(np.linspace(-50, 50, 101))
    step = 1e-5
    x, z = half_space.caustic(n, theta, 2.0)
    ahead, back = (half_space.landing(n, theta + turn, 2.0, z) for turn in (step, -step))
    np.testing.assert_allclose(ahead, back, atol=1e-8)
    np.testing.assert_allclose(half_space.landing(n, theta, 2.0, z), x, atol=1e-12)
    x, behind = flat_lens.caustic(n, theta, 0.7, 0.3)
    ahead, back = (flat_lens.landing(n, theta + turn, 0.7, 0.3, behind) for turn in (step, -step))
    np.testing.assert_allclose(ahead, back, atol=1e-8)
    if n < 0:
        sine = np.sin(theta)
        closed = 0.7 * sine**3 * (1 - n * n) / (n * n - sine**2) ** 1.5
        np.testing.assert_allclose(x, closed, atol=1e-12)


def test_the_caustic_begins_in_a_cusp_at_the_height_times_the_index():
    for n in (-1.5, -0.8):
        x, z = half_space.caustic(n, 1e-6, 0.4)
        assert (x, z) == pytest.approx((0, 0.4 * abs(n)), abs=1e-12)
        assert half_space.caustic_at(n, float(z), 0.4) == pytest.approx(0, abs=1e-12)
        x, behind = flat_lens.caustic(n, 1e-6, 0.7, 0.3)
        assert (x, behind) == pytest.approx((0, flat_lens.image(n, 0.7, 0.3)), abs=1e-12)
    assert half_space.caustic(-1.0, 0.7) == pytest.approx((0, 1))
    assert math.isnan(half_space.caustic_at(-1.5, 1.4)) and math.isnan(half_space.caustic_at(-0.8, 0.9))
    assert np.isnan(half_space.caustic(-0.8, math.radians(60))).all(), "totally reflected"

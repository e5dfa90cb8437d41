# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through media that absorb and disperse: Beer and Lambert on the way, Fresnel of complex media at the faces."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nim_addon.physics import Interface, Medium
from nim_addon.physics.rays import Fate, Kind, Plane, Shapes, Sphere, trace
from nim_addon.physics.reference_image import picture

UP, DOWN = (0, 0, 1), (0, 0, -1)
LENGTH = 0.05  # metres within which light falls to 1/e


def slab(medium, thickness, *more):
    """A slab that fills -thickness < z < 0."""
    interface = Interface(medium)
    return Shapes(Plane((0, 0, 0), UP, interface), Plane((0, 0, -thickness), DOWN, interface), *more)


@pytest.mark.parametrize("n", [1.33, -1.33, -1.0])
def test_a_slab_lets_through_what_the_series_of_its_reflections_does(n):
    medium, thickness = Medium.parse(f"n={n},length={LENGTH}"), 0.03
    paths = trace(slab(medium, thickness), (0, 0, 1), DOWN, bounces=60, least=0)
    # the k of such a length is 1e-6, so that R is that of the real index to 1e-12
    R, once = ((n - math.copysign(1, n)) / (n + math.copysign(1, n))) ** 2, math.exp(-thickness / LENGTH)
    gone = paths.fate == Fate.ESCAPED
    down = gone & (paths.direction[:, 2] < 0)
    series = 1 - (R * once) ** 2
    assert paths.arriving[down].sum() == pytest.approx((1 - R) ** 2 * once / series, abs=1e-9)
    assert paths.arriving[gone & ~down].sum() == pytest.approx(R + (1 - R) ** 2 * once**2 * R / series, abs=1e-9)


@pytest.mark.parametrize("n", [1.5, -1.5])
def test_along_a_slant_the_way_is_longer(n):
    medium, theta = Medium.parse(f"n={n},length={LENGTH}"), math.radians(60)
    paths = trace(slab(medium, 0.1), (0, 0, 1), (math.sin(theta), 0, -math.cos(theta)), least=0, branches=False)
    within = np.flatnonzero(paths.depth == 1)
    way = 0.1 / math.sqrt(1 - (math.sin(theta) / n) ** 2)
    assert paths.arriving[within] / paths.energy[within] == pytest.approx(math.exp(-way / LENGTH), rel=1e-7)
    assert paths.energy[paths.depth == 2] <= paths.arriving[within]
    np.testing.assert_array_equal(paths.arriving[paths.depth != 1], paths.energy[paths.depth != 1])


def test_what_is_absorbed_goes_by_the_wavelength():
    # by the table's k at each, and by Snell's law of the n there
    medium = Medium.parse("n=table(400 1.6 700 1.5),k=table(400 2e-6 700 1e-6)")
    floor = Plane((0, 0, -0.1), UP)
    theta = math.radians(40)
    for wavelength, n, k in ((400, 1.6, 2e-6), (700, 1.5, 1e-6), (550, 1.55, 1.5e-6)):
        paths = trace(
            Shapes(Plane((0, 0, 0), UP, Interface(medium)), floor),
            *((-math.sin(theta), 0, math.cos(theta)), (math.sin(theta), 0, -math.cos(theta))),
            branches=False,
            wavelength_nm=wavelength,
        )
        (last,) = np.flatnonzero(paths.fate == Fate.LANDED)
        inner = math.asin(math.sin(theta) / n)
        assert paths.end[last, 0] == pytest.approx(0.1 * math.tan(inner), abs=1e-8) and paths.n[last] == n
        way = 0.1 / math.cos(inner)
        assert paths.arriving[last] / paths.energy[last] == pytest.approx(
            math.exp(-4 * math.pi * k * way / (wavelength * 1e-9)), rel=1e-6
        )
    with pytest.raises(ValueError, match="does not cover 300 nm"):
        trace(Shapes(floor, Plane((0, 0, 0), UP, Interface(medium))), (0, 0, 1), DOWN, wavelength_nm=300)


def test_a_source_within_is_weakened_before_its_first_surface():
    medium = Medium.parse(f"n=-1.33,length={LENGTH}")
    paths = trace(slab(medium, 1.0), (0, 0, -0.02), UP, branches=False)
    assert paths.energy[0] == 1 and paths.arriving[0] == pytest.approx(math.exp(-0.02 / LENGTH))
    assert paths.energy[1] == pytest.approx(paths.arriving[0] * Interface(Medium(-1.33)).fresnel(1.0).T, rel=1e-9)


@pytest.mark.parametrize("name", ["silver", "n=-1.33,k=0.01"])
def test_rays_end_at_a_mirror_for_all_that_one_can_see(name):
    mirror = Interface(Medium.parse(name))
    for branches in (True, False):
        paths = trace(
            Shapes(Sphere((0, 0, 0), 1, mirror)), [(0, 0.1, 5), (0, 0.9, 5)], DOWN, branches=branches, least=0
        )
        assert set(paths.kind) == {Kind.INCIDENT, Kind.REFLECTED} and len(paths.ray) == 4
        R = mirror.fresnel(np.sqrt(1 - np.square([0.1, 0.9]))).R
        np.testing.assert_allclose(paths.arriving[2:], R, atol=1e-7)
        np.testing.assert_allclose(paths.lost, 1 - R, atol=1e-7)
        np.testing.assert_array_equal(paths.absorbed, 0)


@settings(max_examples=50)
@given(
    st.sampled_from([1.33, 2.4, -1.0, -1.5]),
    st.floats(0.01, 10),
    st.floats(-0.999, 0.999),
    st.integers(0, 10),
    st.sampled_from([0, 1e-3, 0.1]),
    st.booleans(),
)
def test_nothing_is_gained_and_all_is_accounted_for(n, length, height, bounces, least, branches):
    surfaces = Shapes(Sphere((0, 0, 0), 1, Interface(Medium.parse(f"n={n},length={length}"))))
    paths = trace(surfaces, (height, 0.01, 5), DOWN, bounces=bounces, least=least, branches=branches)
    ends = paths.fate != Fate.SPLIT
    np.testing.assert_allclose(paths.arriving[ends].sum() + paths.lost + paths.absorbed, 1, atol=1e-12)
    assert (paths.arriving <= paths.energy).all() and paths.energy.min() >= least


def test_a_picture_sees_what_arrives():
    medium = Medium.parse(f"n=1.33,length={LENGTH}")
    white = lambda end, direction, lands: np.ones((len(end), 1))  # noqa: E731
    floor = Plane((0, 0, -0.05), UP)
    surface = Plane((0, 0, 0), UP, Interface(medium))
    T = 1 - (0.33 / 2.33) ** 2
    seen = picture(Shapes(surface, floor), white, (0, 0, 1), np.array([DOWN], float))
    assert seen[0, 0] == pytest.approx(T * math.exp(-1) + 1 - T, abs=1e-9)
    # without a floor its light would come from infinitely far away
    assert picture(Shapes(surface), white, (0, 0, 1), np.array([DOWN], float))[0, 0] == pytest.approx(1 - T, abs=1e-9)

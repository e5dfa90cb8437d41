# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of live light paths, and what is read at one: numbers, and nothing of Blender."""

import math

import numpy as np
import pytest

from nim_addon.physics import Interface, Medium
from nim_addon.physics.rays import Kind, Plane, Shapes, Sphere, trace
from nim_addon.ui import live_lines
from nim_addon.ui.light_curves import COLORS
from nim_addon.ui.live_lines import Traced


@pytest.fixture
def plane():
    """A ray of 45 degrees from above onto a NIM."""
    surfaces = Shapes(Plane((0, 0, 0), (0, 0, 1), Interface(Medium(-1.5))))
    return Traced(trace(surfaces, (-1, 0, 1), (1, 0, -1), bounces=1, reach=2), surfaces.interfaces)


def test_lines_are_the_paths_in_the_colours_of_their_parts_and_thinner_with_less_energy(plane):
    paths, R = plane.paths, float(Interface(Medium(-1.5)).fresnel(math.sqrt(0.5)).R)
    made = live_lines.lines([plane], "PART")
    # the weakest first
    assert made.source.tolist() == [[0, 1], [0, 0], [0, 2]] or made.source.tolist() == [[0, 1], [0, 2], [0, 0]]
    np.testing.assert_allclose(made.ends, np.stack([paths.start, paths.end], 1)[made.source[:, 1]], atol=1e-6)
    kinds = paths.kind[made.source[:, 1]]
    np.testing.assert_allclose(made.colors[..., :3], np.repeat([[COLORS[kind]] for kind in kinds], 2, 1), atol=1e-6)
    weakest = kinds.tolist().index(Kind.REFLECTED)
    assert made.colors[weakest, 0, 3] == pytest.approx(R**0.25) and made.widths.max() == live_lines.WIDEST
    assert made.widths[weakest] == max(1, round(live_lines.WIDEST * R**0.25)) < live_lines.WIDEST


def test_by_energy_a_ray_is_white_and_its_weak_branches_are_not(plane):
    made = live_lines.lines([plane], "ENERGY")
    by_kind = dict(zip(plane.paths.kind[made.source[:, 1]], made.colors[:, 0, :3], strict=True))
    np.testing.assert_allclose(by_kind[Kind.INCIDENT], live_lines.RAMP[-1], atol=1e-6)
    reds, blues = ({kind: color[channel] for kind, color in by_kind.items()} for channel in (0, 2))
    assert reds[Kind.INCIDENT] >= reds[Kind.TRANSMITTED] and blues[Kind.INCIDENT] > blues[Kind.TRANSMITTED]
    assert not np.allclose(by_kind[Kind.REFLECTED], by_kind[Kind.TRANSMITTED], atol=0.1)


def test_in_what_absorbs_a_line_fades():
    surfaces = Shapes(Sphere((0, 0, 0), 1, Interface(Medium.parse("n=-1.5,length=2"))))
    paths = trace(surfaces, (0, 0.3, 5), (0, 0, -1), bounces=2)
    made = live_lines.lines([Traced(paths, surfaces.interfaces)], "PART")
    wanted = np.stack([paths.energy, paths.arriving], -1)[made.source[:, 1]] ** 0.25
    np.testing.assert_allclose(made.colors[..., 3], np.maximum(wanted, live_lines.FAINTEST), rtol=1e-6)
    assert (made.colors[:, 1, 3] < 0.9 * made.colors[:, 0, 3]).any()


def test_each_line_is_drawn_as_a_quad_of_its_width_and_colours(plane):
    made = live_lines.lines([plane], "PART")
    content, triangles = live_lines.quads(made)
    assert all(values.dtype == np.float32 and len(values) == 4 * len(made.ends) for values in content.values())
    assert triangles.dtype == np.int32 and triangles.shape == (2 * len(made.ends), 3)
    ends = np.stack([content["first"], content["second"]], 1)
    at_end, width = content["place"].T
    for line, corners in enumerate(triangles.reshape(-1, 6)):
        assert (ends[corners] == made.ends[line]).all()
        assert (content["color"][corners] == made.colors[line, at_end[corners].astype(int)]).all()
        # two triangles on either side of the diagonal between what is left at one end and right at the other
        assert sorted(zip(at_end[np.unique(corners)], width[np.unique(corners)], strict=True)) == [
            (end, side * made.widths[line]) for end in (0, 1) for side in (-1, 1)
        ]
        shared = set(corners[:3]) & set(corners[3:])
        assert len(shared) == 2 and len({(at_end[one], width[one] > 0) for one in shared}) == 2
        assert sum(at_end[one] for one in shared) == 1 and sum(width[one] for one in shared) == 0
    assert not len(live_lines.quads(live_lines.lines([], "PART")).triangles)


# ---------------------------------------------------------------- at the mouse

# what looks down from 10 above, 90 degrees wide, into a region of 200 by 200
DOWN = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1.002, 9.82], [0, 0, -1, 10.0]])


def across(*places):
    """Lines along y at those x, as strong as they are many."""
    ends = np.array([[(x, -5.0, 0.0), (x, 5.0, 0.0)] for x in places]).reshape(-1, 2, 3)
    colors, widths = np.ones((len(places), 2, 4)), np.ones(len(places))
    return live_lines.Lines(ends, colors, widths, np.zeros((len(places), 2), int))


def test_the_line_at_the_mouse_is_the_nearest_and_of_those_on_each_other_the_strongest():
    three = across(0.0, 2.0, 2.0)
    assert live_lines.nearest(three, DOWN, (200, 200), (103, 90), 8) == 0
    assert live_lines.nearest(three, DOWN, (200, 200), (117, 120), 8) == 2
    assert live_lines.nearest(three, DOWN, (200, 200), (110, 90), 8) is None
    assert live_lines.nearest(three, DOWN, (200, 200), (100, 190), 8) is None  # beyond its end
    assert live_lines.nearest(across(), DOWN, (200, 200), (100, 100), 8) is None


def test_a_line_from_behind_the_eye_is_met_where_it_is_seen():
    ends = np.array([[(0.0, 0.0, 30.0), (5.0, 0.0, 0.0)], [(0.0, 3.0, 30.0), (0.0, 3.0, 20.0)]])
    lines = live_lines.Lines(ends, np.ones((2, 2, 4)), np.ones(2), np.zeros((2, 2), int))
    assert live_lines.nearest(lines, DOWN, (200, 200), (160, 100), 8) == 0  # towards its end at (150, 100)
    assert live_lines.nearest(lines, DOWN, (200, 200), (40, 100), 8) is None
    assert live_lines.nearest(lines, DOWN, (200, 200), (100, 70), 8) is None  # of the one that is all behind


def test_a_reading_is_what_the_equations_say_of_both_sides(plane):
    read = live_lines.reading(plane, 0)
    assert (read.n, read.n_t, read.energy, read.wavelength_nm) == (1, -1.5, 1, 550)
    assert read.theta_i == pytest.approx(math.radians(45))
    assert read.theta_t == pytest.approx(-math.asin(math.sqrt(0.5) / 1.5))
    R = float(Interface(Medium(-1.5)).fresnel(math.sqrt(0.5)).R)
    assert abs(read.R - R) < 1e-12
    away = live_lines.reading(plane, int(np.flatnonzero(plane.paths.kind == Kind.TRANSMITTED)[0]))
    assert away.n == -1.5 and away.n_t is away.R is None and away.energy == pytest.approx(1 - read.R)


def test_a_reading_from_inside_tells_of_total_reflection():
    surfaces = Shapes(Plane((0, 0, 0), (0, 0, 1), Interface(Medium(1.5))))
    paths = trace(surfaces, (-1, 0, -1), (1, 0, 1), bounces=1)
    read = live_lines.reading(Traced(paths, surfaces.interfaces), 0)
    assert (read.n, read.n_t, read.theta_t, read.R) == (1.5, 1, None, 1)

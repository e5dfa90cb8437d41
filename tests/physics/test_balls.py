# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays by other laws than Snell's: through graded balls against closed forms, and what must hold for any law."""

import numpy as np
import pytest

from nim_addon.physics import Interface, Medium
from nim_addon.physics.balls import Ball, Shell
from nim_addon.physics.graded import Profile
from nim_addon.physics.laws import Branch
from nim_addon.physics.rays import Fate, Kind, Plane, Shapes, Sphere, trace

CENTER, RADIUS, UP = np.array([0.3, -0.2, 1.0]), 1.7, np.array([0, 0, 1])
HEIGHTS = np.array([0.02, 0.3, 0.6, 0.9])


def through(profile, *others):
    """A parallel beam along -z, at HEIGHTS in radii from the axis, through a ball."""
    ball = Sphere(CENTER, RADIUS, Ball(profile, CENTER, RADIUS))
    origins = CENTER + RADIUS * np.stack([HEIGHTS, 0 * HEIGHTS, 3 + 0 * HEIGHTS], axis=-1)
    return trace(Shapes(ball, *others), origins, (0, 0, -1), reach=10.0)


def check_chain(paths):
    """Each segment begins where the one before it ends, later in the list, and no energy is lost on the way."""
    after = paths.parent >= 0
    np.testing.assert_allclose(paths.start[after], paths.end[paths.parent[after]], atol=1e-12)
    assert (paths.parent[after] < np.flatnonzero(after)).all()
    np.testing.assert_array_equal(paths.ray[after], paths.ray[paths.parent[after]])
    np.testing.assert_array_equal(paths.fate[paths.parent[after]], Fate.SPLIT)
    ends = paths.fate != Fate.SPLIT
    arrives = np.bincount(paths.ray[ends], paths.arriving[ends], len(paths.lost))
    np.testing.assert_allclose(arrives + paths.lost + paths.absorbed, 1, atol=1e-12)


def last(paths):
    return np.array([np.flatnonzero((paths.ray == ray) & (paths.fate != Fate.SPLIT))[0] for ray in range(len(HEIGHTS))])


def test_a_luneburg_ball_brings_a_beam_to_its_far_rim():
    paths = through(Profile("luneburg"))
    check_chain(paths)
    ends = last(paths)
    np.testing.assert_allclose(paths.start[ends], np.tile(CENTER - RADIUS * UP, (4, 1)), atol=1e-9)
    # turned by the angle of incidence
    np.testing.assert_allclose(paths.direction[ends, 2], -np.sqrt(1 - HEIGHTS**2), atol=1e-9)
    np.testing.assert_allclose(paths.direction[ends, 0], -HEIGHTS, atol=1e-9)
    # an ellipse around the centre, as which a ray goes in an index sqrt(2 - r^2): half axes 1 +- cos(theta_i), squared
    within = (paths.depth == 1) & (paths.fate == Fate.SPLIT)
    assert set(paths.kind[within]) == {Kind.TRANSMITTED} and set(paths.depth[ends]) == {1}
    places = (paths.end[within] - CENTER) / RADIUS
    assert np.linalg.norm(places, axis=1).max() < 1 + 1e-9
    for ray, height in enumerate(HEIGHTS):
        nearest = np.linalg.norm(places[paths.ray[within] == ray], axis=1).min()
        assert nearest == pytest.approx(np.sqrt(1 - np.sqrt(1 - height**2)), rel=2e-2, abs=2e-2)


def test_an_eaton_ball_sends_a_beam_back():
    paths = through(Profile("eaton"))
    check_chain(paths)
    np.testing.assert_allclose(paths.direction[last(paths)], np.tile((0, 0, 1), (4, 1)), atol=1e-9)
    x = paths.start[last(paths), 0] - CENTER[0]
    np.testing.assert_allclose(x, -RADIUS * HEIGHTS, atol=1e-9)


def test_what_meets_a_black_core_is_lost():
    paths = through(Profile("magnifier", core=0.5, surface="black"))
    check_chain(paths)
    np.testing.assert_array_equal(paths.lost, 1)


def test_the_ball_stands_among_other_surfaces():
    """In glass that surrounds it rays are bent first; a mirror behind an invisible ball sends them back through it."""
    glass = Plane(CENTER + 2 * RADIUS * UP, (0, 0, 1), Interface(Medium(1.5)))
    floor = Plane(CENTER - 2 * RADIUS * UP, (0, 0, 1))
    paths = through(Profile("invisible"), glass, floor)
    check_chain(paths)
    landed = paths.fate == Fate.LANDED
    np.testing.assert_allclose(np.sort(paths.end[landed, 0]), np.sort(CENTER[0] + RADIUS * HEIGHTS), atol=1e-8)
    np.testing.assert_allclose(paths.energy[landed], 0.96, atol=1e-9)
    np.testing.assert_allclose(paths.n[landed], 1.5)


LAWS = [
    Ball(Profile("luneburg"), CENTER, RADIUS),
    Shell(Profile("luneburg", core=0.5, surface="textured"), CENTER, RADIUS),
]


@pytest.mark.parametrize("law", LAWS, ids=["ball", "shell"])
def test_rays_from_within_and_beside_the_sphere_go_straight_on(law):
    wide = Sphere(CENTER, 1.2 * RADIUS, law)
    # what comes from the centre of a shell comes from its core
    within = [[0, 0, 0]] if isinstance(law, Ball) else []
    starts = CENTER + RADIUS * np.array([*within, [1.0005, 0, 3], [1.1, 0, 3]])
    ways = trace(Shapes(wide), starts, (0, 0, -1), reach=9.0)
    check_chain(ways)
    np.testing.assert_allclose(ways.direction, np.tile((0, 0, -1), (len(ways.ray), 1)), atol=1e-12)
    assert not ways.lost.any()


@pytest.mark.parametrize("law", LAWS, ids=["ball", "shell"])
def test_a_path_begins_on_the_facet_that_the_ray_meets(law):
    facet = CENTER + RADIUS * np.array([[0.3, 0, 0.94]])  # within the sphere
    through, _ = law.branches(facet, np.array([[0.0, 0, -1]]), np.array([[0.0, 0, 1]]))
    np.testing.assert_array_equal(through.way[:, 0], facet)
    np.testing.assert_allclose(through.way[:, -1], through.start, atol=1e-9)


@pytest.mark.parametrize(
    "profile", [Profile("magnifier", core=0.6, surface="textured"), Profile("luneburg", core=0.5, surface="textured")]
)
def test_a_mirror_within_a_shell_is_the_ball_with_a_mirror_in_it(profile):
    """A ray that comes to the core, is mirrored by it and leaves, by two tables, goes as one that is carried by one sweep."""
    core = Sphere(CENTER, profile.core * RADIUS, Mirror())
    shell = Sphere(CENTER, RADIUS, Shell(profile, CENTER, RADIUS))
    origins = CENTER + RADIUS * np.stack([HEIGHTS, 0 * HEIGHTS, 3 + 0 * HEIGHTS], axis=-1)
    paths = trace(Shapes(shell, core), origins, (0, 0, -1), reach=5.0)
    check_chain(paths)
    out = last(paths)
    whole = through(Profile(profile.n, core=profile.core))
    np.testing.assert_allclose(paths.start[out], whole.start[last(whole)], atol=1e-6)
    np.testing.assert_allclose(paths.direction[out], whole.direction[last(whole)], atol=1e-6)


def test_light_that_glides_away_from_a_core_of_high_index_falls_back():
    profile = Profile("magnifier", core=0.5, surface="textured")
    shell = Shapes(
        Sphere(CENTER, RADIUS, Shell(profile, CENTER, RADIUS)), Sphere(CENTER, 0.5 * RADIUS * (1 - 1e-6), None)
    )
    start = CENTER + 0.5 * RADIUS * UP
    for sine, fate in ((0.45, Fate.ESCAPED), (0.55, Fate.LANDED)):
        paths = trace(shell, start, (sine, 0, np.sqrt(1 - sine**2)))
        check_chain(paths)
        assert paths.fate[-1] == fate
        # n = -1 / r^2 is that of a ball of n = 1 turned inside out: straight lines in 1 / r
        place = ((paths.start if fate == Fate.ESCAPED else paths.end)[-1] - CENTER) / RADIUS
        if fate == Fate.ESCAPED:
            p = sine / 0.5
            turned = np.arcsin(p) - np.arcsin(sine)
            np.testing.assert_allclose(place, (np.sin(turned), 0, np.cos(turned)), atol=1e-6)
            np.testing.assert_allclose(paths.direction[-1] @ place, np.sqrt(1 - p**2), atol=1e-6)
            assert np.cross(place, paths.direction[-1])[1] < 0, "on the other side than in a medium of n > 0"
        else:
            turned = np.pi - 2 * np.arcsin(sine)
            np.testing.assert_allclose(place, np.multiply(0.5, (np.sin(turned), 0, np.cos(turned))), atol=1e-5)


class Mirror:
    def branches(self, points, directions, normals):
        mirrored = directions - 2 * np.sum(directions * normals, axis=1, keepdims=True) * normals
        return [Branch(np.ones(len(points)), points, mirrored, reflected=True)]


class Halves:
    """Half of the light goes on a step aside, a quarter back, and a quarter is absorbed."""

    def branches(self, points, directions, normals):
        share, aside = np.full(len(points), 0.5), points + np.array([1, 0, 0])
        way = np.stack([points, aside], axis=1)
        mirrored = directions - 2 * np.sum(directions * normals, axis=1, keepdims=True) * normals
        return [Branch(share, aside, directions, way), Branch(share / 2, points, mirrored, reflected=True)]


def test_a_law_may_split_rays_and_absorb_some():
    law = Halves()
    two = Shapes(Plane((0, 0, 0), (0, 0, 1), law), Plane((0, 0, -1), (0, 0, 1), law))
    paths = trace(two, [(0, 0, 1), (5, 0, 1)], (0, 0, -1), bounces=2, least=0.1)
    check_chain(paths)
    np.testing.assert_allclose(paths.lost, 0.25 + 0.5 * 0.25)
    down = (paths.fate == Fate.ESCAPED) & (paths.direction[:, 2] < 0)
    np.testing.assert_allclose(paths.start[down], [(2, 0, -1), (7, 0, -1)])
    np.testing.assert_allclose(paths.energy[down], 0.25)
    assert set(paths.kind[paths.depth == 1]) == {Kind.REFLECTED, Kind.TRANSMITTED}
    only = trace(two, (0, 0, 1), (0, 0, -1), branches=False, bounces=2)
    assert (only.kind != Kind.REFLECTED).all() and only.lost[0] == pytest.approx(0.75)
    # what has too little energy has no way either
    assert len(trace(two, (0, 0, 1), (0, 0, -1), least=0.6).ray) == 1

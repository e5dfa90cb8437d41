# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through shapes: against closed forms of lenses, balls and slabs, and against what must hold for any of them."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from nim_addon.physics import Interface, Medium
from nim_addon.physics.interface import unit
from nim_addon.physics.rays import Convex, Cylinder, Fate, Kind, Plane, Shapes, Sphere, trace

UP = (0, 0, 1)
# trace() starts this far off a surface by default, and nothing else is rounded as much
GAP = 1e-9

indices = st.sampled_from([1.33, 1.5, 2.418, -1.0, -1.33, -1.5, -2.418, -0.7, 0.7])


def ball(n, mu=None, radius=1.0):
    return Shapes(Sphere((0, 0, 0), radius, Interface(Medium(n, mu))))


def slab(n, thickness=1.0, floor=None):
    """A slab that fills -thickness < z < 0, and an opaque floor at z = floor."""
    interface = Interface(Medium(n))
    shapes = [Plane((0, 0, 0), UP, interface), Plane((0, 0, -thickness), (0, 0, -1), interface)]
    return Shapes(*shapes, *([] if floor is None else [Plane((0, 0, floor), UP)]))


def straight_on(surfaces, origins, directions, **options):
    """The last segments of rays that take the transmitted branch alone, in the order of the rays."""
    paths = trace(surfaces, origins, directions, branches=False, **options)
    last = np.flatnonzero(paths.fate != Fate.SPLIT)
    assert len(last) == len(np.unique(paths.ray)), "more than one way"
    return paths, last[np.argsort(paths.ray[last])]


def energy_of_ends(paths):
    """Per ray, the energy that arrived somewhere, and what was not followed."""
    ends = paths.fate != Fate.SPLIT
    return np.bincount(paths.ray[ends], paths.energy[ends], len(paths.lost)) + paths.lost


@pytest.mark.parametrize("n", [1.33, 1.5, -1.0, -1.33, -1.5, -4.1])
def test_landing_under_a_plane_is_snells(n):
    theta = np.radians([0, 10, 45, 80, 89])
    down = np.stack([np.sin(theta), 0 * theta, -np.cos(theta)], -1)
    water = Shapes(Plane((0, 0, 0), UP, Interface(Medium(n))), Plane((0, 0, -1), UP))
    paths, last = straight_on(water, -down, down)
    x = np.tan(np.arcsin(np.sin(theta) / n))  # the sign of n decides the side
    np.testing.assert_allclose(paths.end[last], np.stack([x, 0 * x, 0 * x - 1], -1), atol=100 * GAP)
    assert set(paths.fate[last]) == {Fate.LANDED} and set(paths.kind[last]) == {Kind.TRANSMITTED}
    assert set(paths.n[last]) == {n}
    np.testing.assert_allclose(paths.energy[last], Interface(Medium(n)).fresnel(np.cos(theta)).T, atol=1e-14)


@pytest.mark.parametrize("n", [1.5, 1.33, 2.418, -1.0, -1.33, -1.5])
def test_paraxial_focus_of_a_ball(n):
    # from its centre n r / (2 (n - 1)); aberration goes with the square of the height
    radius, height = 2.0, 1e-3
    paths, last = straight_on(ball(n, radius=radius), (height, 0, 5), (0, 0, -1))
    start, direction = paths.start[last[0]], paths.direction[last[0]]
    focus = start[2] - start[0] / direction[0] * direction[2]
    assert -focus == pytest.approx(n * radius / (2 * (n - 1)), rel=20 * height**2)


@given(indices, st.floats(0.01, 0.99), st.integers(0, 3))
def test_deviation_by_a_ball_after_internal_reflections(n, height, reflections):
    # Descartes: 2 (i - t) + k (pi - 2 t), t negative in a NIM
    interface = Interface(Medium(n))
    i = math.asin(height)
    t = float(interface.theta_t(i))
    assume(abs(t) < math.radians(87))  # nearer the critical angle the gap, too, is bent a lot; NaN is beyond it
    paths = trace(ball(n), (height, 0, 5), (0, 0, -1), bounces=6, least=0, gap=1e-12)
    out = np.flatnonzero((paths.fate == Fate.ESCAPED) & (paths.depth == reflections + 2))
    R = float(interface.fresnel(math.cos(i)).R)
    if R == 0 and reflections:
        assert not len(out)
        return
    (out,) = out
    turned = 2 * (i - t) + reflections * (math.pi - 2 * t)
    np.testing.assert_allclose(
        paths.direction[out], (-math.sin(turned), 0, -math.cos(turned)), atol=1e-6, err_msg=f"{n} {height}"
    )
    assert paths.energy[out] == pytest.approx((1 - R) ** 2 * R**reflections, rel=1e-6, abs=1e-9)


def test_perfect_lens_images_a_point_inside_and_behind():
    # Veselago 1968, Pendry 2000: d in front, d inside, L - d behind, and nothing is reflected
    d, thickness = 0.4, 1.0
    aside = np.random.default_rng(3).uniform(-1, 1, (50, 2))
    paths = trace(slab(-1, thickness), (0, 0, d), np.column_stack([aside, np.full(50, -1)]), reach=9)
    assert len(paths.ray) == 150 and set(paths.kind) == {Kind.INCIDENT, Kind.TRANSMITTED}
    for depth, image in ((1, -d), (2, -thickness - (thickness - d))):
        way = paths.start[paths.depth == depth], paths.direction[paths.depth == depth]
        steps = (image - way[0][:, 2]) / way[1][:, 2]
        np.testing.assert_allclose(way[0] + steps[:, None] * way[1], np.tile((0, 0, image), (50, 1)), atol=50 * GAP)


def test_slab_adds_up_its_reflections():
    # at normal incidence, T + T R^2 + ... = (1 - R) / (1 + R)
    paths = trace(slab(-1.5, floor=-3), (0, 0, 1), (0, 0, -1), bounces=40, least=0)
    R = 0.04
    assert paths.energy[paths.fate == Fate.LANDED].sum() == pytest.approx((1 - R) / (1 + R), abs=1e-14)
    assert paths.energy[paths.fate == Fate.ESCAPED].sum() == pytest.approx(2 * R / (1 + R), abs=1e-14)


@pytest.mark.parametrize("n", [1.5, -1.5])
def test_total_reflection_is_one_branch(n):
    critical = math.asin(1 / 1.5)
    for theta, branches in ((critical - 1e-6, 2), (critical + 1e-6, 1)):
        paths = trace(slab(n, 9), (0, 0, -1), (math.sin(theta), 0, math.cos(theta)), bounces=1, least=0)
        assert len(paths.ray) == 1 + branches
    assert paths.energy[1] == 1 and paths.kind[1] == Kind.REFLECTED and paths.n[1] == n
    np.testing.assert_allclose(paths.direction[1], (math.sin(theta), 0, -math.cos(theta)), atol=1e-8)
    followed = trace(slab(n, 9), (0, 0, -1), (math.sin(theta), 0, math.cos(theta)), bounces=1, branches=False)
    np.testing.assert_array_equal(followed.end, paths.end)


@settings(max_examples=50)
@given(
    indices,
    st.floats(0.1, 30),
    st.floats(-0.999, 0.999),
    st.integers(0, 10),
    st.sampled_from([0, 1e-3, 0.1]),
    st.booleans(),
)
def test_energy_is_conserved(n, mu, height, bounces, least, branches):
    surfaces = ball(n, math.copysign(mu, n))
    paths = trace(surfaces, (height, 0.01, 5), (0, 0, -1), bounces=bounces, least=least, branches=branches)
    np.testing.assert_allclose(energy_of_ends(paths), 1, atol=1e-12)
    assert paths.energy.min() >= least and paths.depth.max() <= bounces
    if least == 0 and branches:
        np.testing.assert_array_equal(paths.lost, 0)


def test_segments_hang_together():
    random = np.random.default_rng(5)
    glass = Interface(Medium(-1.5))
    surfaces = Shapes(Sphere((0, 0, 1.2), 1, glass), Plane((0, 0, 0), UP), Cylinder((3, 0, 0), (3, 0, 2), 1, glass))
    origins = random.uniform(-4, 4, (200, 3)) * (1, 1, 0) + (0, 0, 5)
    paths = trace(surfaces, origins, random.uniform(-1, 1, (200, 3)) - (0, 0, 1.5))
    np.testing.assert_allclose(energy_of_ends(paths), 1, atol=1e-12)
    assert {Fate.SPLIT, Fate.LANDED, Fate.ESCAPED} <= set(paths.fate)
    child = np.flatnonzero(paths.parent >= 0)
    parent = paths.parent[child]
    assert (parent < child).all() and (paths.fate[parent] == Fate.SPLIT).all()
    np.testing.assert_array_equal(paths.start[child], paths.end[parent])
    np.testing.assert_array_equal(paths.ray[child], paths.ray[parent])
    np.testing.assert_array_equal(paths.depth[child], paths.depth[parent] + 1)
    same = paths.kind[child] == Kind.REFLECTED
    np.testing.assert_array_equal((paths.n[child] == paths.n[parent]), same)
    assert (np.bincount(parent, paths.energy[child], len(paths.ray)) <= paths.energy + 1e-15).all()
    roots = np.flatnonzero(paths.parent < 0)
    np.testing.assert_array_equal(paths.ray[roots], np.arange(200))
    np.testing.assert_array_equal(paths.start[roots], origins)
    # no segment ends where it begins: none hits the surface it leaves
    assert np.linalg.norm(paths.end - paths.start, axis=1).min() > 1e-6


@given(indices, st.floats(-0.95, 0.95), st.floats(-0.2, 0.2))
def test_the_way_back_is_the_way_there(n, x, y):
    surfaces = ball(n)
    there, last = straight_on(surfaces, (x, y, 3), (0.05, 0.02, -1), reach=2, gap=1e-12)
    assume(there.depth[last[0]] == 2)  # it passes through the ball, and nowhere nearly along its surface
    cosines = np.abs(np.sum(there.direction * np.roll(there.end, 1, axis=0), axis=1))[1:]
    cosines = np.append(cosines, np.abs(np.sum(there.direction * there.end, axis=1))[:2])
    assume(cosines.min() > 0.05)
    back, end = straight_on(surfaces, there.end[last], there.start[last] - there.end[last], reach=2, gap=1e-12)
    np.testing.assert_allclose(back.end[:2], there.start[:0:-1], atol=1e-8)
    np.testing.assert_allclose(back.direction[end], -there.direction[:1], atol=1e-8)


def test_cylinder_is_a_ball_across_its_axis_and_a_slab_along_it():
    wall = Shapes(Cylinder((0, -1, 0), (0, 1, 0), 1, Interface(Medium(-1.5))))
    x = np.linspace(-0.9, 0.9, 7)
    origins = np.stack([x, 0 * x, 0 * x + 5], -1)
    across = trace(wall, origins, (0, 0, -1))
    expected = trace(ball(-1.5), origins, (0, 0, -1))
    np.testing.assert_allclose(across.end, expected.end, atol=100 * GAP)
    np.testing.assert_allclose(across.energy, expected.energy, atol=1e-7)
    tilted = trace(wall, origins, (0, 0.2, -5))
    along = tilted.direction[:, 1]
    np.testing.assert_allclose(along[tilted.n == -1.5] / along[0], 1 / -1.5, rtol=1e-7)
    np.testing.assert_allclose(along[tilted.n == 1], along[0], rtol=1e-7)
    for height, meets in ((-1.01, False), (-0.99, True), (0.99, True), (1.01, False)):
        paths = trace(wall, np.add(origins, (0, height, 0)), (0, 0, -1))
        assert (len(paths.ray) > 7) == meets and (set(paths.fate) == {Fate.ESCAPED}) == (not meets)


@pytest.mark.parametrize(
    ("unit", "moved"),
    [
        (Sphere((0, 0, 0), 1, Interface(Medium(-1.5))), Sphere((3, -2, 7), 0.4, Interface(Medium(-1.5)))),
        (
            Cylinder((0, -1, 0), (0, 1, 0), 1, Interface(Medium(-1.5))),
            Cylinder((3, -2.4, 7), (3, -1.6, 7), 0.4, Interface(Medium(-1.5))),
        ),
    ],
    ids=["sphere", "cylinder"],
)
def test_a_shape_elsewhere_and_of_another_size_is_the_same_picture(unit, moved):
    place, scale = np.array([3, -2, 7]), 0.4
    x = np.linspace(-0.9, 0.9, 7)
    origins = np.stack([x, 0.3 * x, 0 * x + 5], -1)
    wanted = trace(Shapes(unit), origins, (0.1, 0.05, -1))
    found = trace(Shapes(moved), place + scale * origins, (0.1, 0.05, -1), reach=scale)
    np.testing.assert_allclose(found.end, place + scale * wanted.end, atol=100 * GAP)
    np.testing.assert_allclose(found.energy, wanted.energy, atol=1e-7)


def test_grazing_rays_are_safe():
    for height in (1 - 1e-15, 1 - 1e-9, 1.0, 1 + 1e-9):
        paths = trace(ball(-1.5), (height, 0, 5), (0, 0, -1))
        np.testing.assert_allclose(energy_of_ends(paths), 1, atol=1e-12)
        assert np.isfinite(paths.end).all() and len(paths.ray) < 20
    along = trace(slab(-1.5), (0, 0, 0), (1, 0, 0), reach=3)
    np.testing.assert_array_equal(along.end, [(3, 0, 0)])


def test_what_escapes_has_the_given_length():
    paths = trace(ball(1.5), [(0, 0, 5), (2, 0, 5)], (0, 0, -2), reach=4)
    away = paths.fate == Fate.ESCAPED
    np.testing.assert_allclose(np.linalg.norm(paths.end - paths.start, axis=1)[away], 4)
    np.testing.assert_array_equal(paths.end[1], (2, 0, 1))
    assert paths.lost[1] == 0


def test_what_cannot_be_is_refused(one_sentence):
    down = (0, 0, 5), (0, 0, -1)
    for wrong in ({"bounces": -1}, {"least": 1}, {"least": math.nan}, {"reach": 0}, {"gap": -1}):
        with pytest.raises(ValueError) as caught:
            trace(ball(-1.5), *down, **wrong)
        one_sentence(caught.value, *wrong)
    with pytest.raises(ValueError) as caught:
        trace(slab(-30), *down, bounces=60, least=0, most=50)
    one_sentence(caught.value, "50 segments", "fewer")
    with pytest.raises(ValueError) as caught:
        trace(ball(-1.5), down[0], (0, 0, 0))
    one_sentence(caught.value, "direction", "zero")


CUBE = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]


def cube(interface=None):
    """A cube of edge 2 about the origin."""
    return Convex(tuple(CUBE), tuple(CUBE), interface)


def test_a_convex_solid_is_met_on_its_nearest_face():
    o = np.array([(-3, 0.2, 0.3), (0, 0, 0), (-3, 1.5, 0), (-3, 0, 0), (0.5, 0, 3), (1, 5, 0)], float)
    d = np.array([(1, 0, 0), (0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, -1), (0, -1, 0)], float)
    distance, normal = cube().meet(o, d)
    np.testing.assert_allclose(distance, [2, 1, np.inf, np.inf, 2, 4])
    np.testing.assert_allclose(normal[[0, 1, 4, 5]], [(-1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0)])


@pytest.mark.parametrize("n", [1.5, -1.5])
def test_a_convex_slab_is_a_slab_of_planes(n):
    theta = np.radians([0, 20, -50, 80])
    d = np.stack([np.sin(theta), 0 * theta, -np.cos(theta)], -1)
    faces = ((0, 0, 0), (0, 0, -1)), (UP, (0, 0, -1))
    ours = trace(Shapes(Convex(*faces, Interface(Medium(n)))), -d, d, bounces=4)
    planes = trace(slab(n), -d, d, bounces=4)
    np.testing.assert_allclose(ours.end, planes.end, atol=1e-12)
    np.testing.assert_allclose(ours.energy, planes.energy, atol=1e-14)


def test_rays_of_many_wavelengths_go_as_those_of_one_at_a_time():
    medium, wavelengths = Medium.parse("n-sf11"), (440.0, 650.0, 540.0)
    wedge = Plane((0, 0, 0), (0, 0, 1), Interface(medium)), Plane((0, 0, -1), (0.3, 0, -1), Interface(medium))
    starts, towards = np.array([(0.0, 0, 1), (0.1, 0, 1)]), np.array([(0.3, 0, -1), (0.5, 0.1, -1)])
    options = {"bounces": 3, "reach": 2.0}
    each = np.repeat(wavelengths, 2)
    together = trace(Shapes(*wedge), np.tile(starts, (3, 1)), np.tile(towards, (3, 1)), wavelength_nm=each, **options)
    assert len(together.lost) == 6
    for number, nm in enumerate(wavelengths):
        alone = trace(Shapes(*wedge), starts, towards, wavelength_nm=nm, **options)
        for ray in range(2):
            chosen, same = together.ray == 2 * number + ray, alone.ray == ray
            assert chosen.sum() == same.sum() > 3
            # in whichever order branches were followed
            sort, order = (
                np.lexsort(np.round(one.end[rows].T, 9)) for one, rows in ((together, chosen), (alone, same))
            )
            for name in ("start", "end", "energy", "n", "kind", "depth", "fate"):
                np.testing.assert_allclose(
                    getattr(together, name)[chosen][sort], getattr(alone, name)[same][order], atol=1e-12
                )


@pytest.mark.parametrize("medium", ["n-sf11", "silver", "n=-1.5,mu=-1", "n=1.5,k=0.1"])
def test_every_bend_is_what_the_interface_says_by_itself(medium):
    """Of rays that come from both sides, at several wavelengths, which trace() takes all at once."""
    interface, wavelengths = Interface(Medium.parse(medium)), np.repeat((440.0, 540.0, 650.0), 40)
    rng = np.random.default_rng(5)
    towards = unit(rng.normal(size=(120, 3)))
    starts = np.array((0.0, 0, 0.5)) - 1.5 * towards * (1 + rng.random((120, 1)))
    surfaces = Shapes(Sphere((0, 0, 0), 1, interface))
    paths = trace(surfaces, starts, towards, bounces=4, wavelength_nm=wavelengths, least=0)
    reflected, passed = (
        np.flatnonzero((paths.kind == kind) & (paths.energy > 0)) for kind in (Kind.REFLECTED, Kind.TRANSMITTED)
    )
    assert len(reflected) > 60
    for child in (*reflected, *passed):
        parent = paths.parent[child]
        seen = interface.at(wavelengths[paths.ray[child]])
        d, normal = paths.direction[parent], paths.normal[parent]
        from_inside = d @ normal > 0
        R = float((seen.reversed() if from_inside else seen).fresnel(min(abs(d @ normal), 1.0)).R)
        ahead = seen.refract(d, normal)
        is_mirrored = paths.kind[child] == Kind.REFLECTED
        if not np.isfinite(ahead).all() and not seen.is_complex:
            R = 1.0
        share = R if is_mirrored else 1 - R
        assert paths.energy[child] == pytest.approx(share * paths.arriving[parent], rel=1e-6, abs=1e-12)
        wanted = d - 2 * (d @ normal) * normal if is_mirrored else ahead
        np.testing.assert_allclose(paths.direction[child], wanted, atol=1e-7)
        side = seen.inside if from_inside == is_mirrored else seen.outside
        assert paths.n[child] == pytest.approx(side.n)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded balls: against closed forms, reference sweeps, Hamilton's equations, and themselves run backwards."""

import csv
import gzip
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nim_addon.physics import graded
from nim_addon.physics.graded import DEVICES, Profile

SMOOTH = {
    "luneburg": lambda r: np.sqrt(2 - r * r),
    "fisheye": lambda r: 2 / (1 + r * r),
    "eaton": lambda r: np.sqrt(2 / r - 1),
    "hump": lambda r: 1 + 0.5 * (1 - r * r) ** 2,
    "steep": lambda r: 1 + 20 * (1 + np.tanh((0.05 - r) / 0.008)),
}
BALLS = {
    **{device: Profile(device) for device in DEVICES},
    "capped": Profile("invisible", cap=3.0),
    "cored": Profile("eaton", core=0.3),
    "cloaked": Profile("cloak", hollow=0.6, core=0.7),
    "table": Profile(((0.0, 1.5), (0.5, 1.4), (1.0, 1.0))),
    "function": Profile(SMOOTH["hump"]),
}


def rays(count, seed=0):
    """Points before the ball and unit directions, (N, 3) each, of rays that meet it, and their p."""
    random = np.random.default_rng(seed)
    d = random.normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    across = np.cross(d, random.normal(size=(count, 3)))
    p = random.uniform(0.01, 0.99, count)
    return p[:, None] * across / np.linalg.norm(across, axis=1, keepdims=True) - 3 * d, d, p


def hamilton(n, x, d):
    """Where a ray (2,) leaves the ball, and its direction: Runge and Kutta's fourth order of x' = k, k' = grad n^2 / 2."""

    def force(y):
        r = np.hypot(*y)
        h = 1e-4 * r
        return (n(r + h) ** 2 - n(r - h) ** 2) / (4 * h) * y / r

    def rate(state):
        return np.concatenate([state[2:], force(state[:2])])

    state = np.concatenate([x, d])
    while True:
        step = 4e-4 * np.hypot(*state[:2])
        a = rate(state)
        b = rate(state + step / 2 * a)
        c = rate(state + step / 2 * b)
        e = rate(state + step * c)
        ahead = state + step / 6 * (a + 2 * b + 2 * c + e)
        if np.hypot(*ahead[:2]) > 1:
            # k has hardly changed since: straight to the rim
            y, k = state[:2], state[2:]
            b = y @ k / (k @ k)
            t = -b + math.sqrt(b * b + (1 - y @ y) / (k @ k))
            k = k + t * force(y)
            return y + t * state[2:] + t * t / 2 * force(y), k / np.hypot(*k)
        state = ahead


def reference(data):
    with gzip.open(data / "sweeps.csv.gz", "rt", encoding="utf-8") as file:
        return list(csv.DictReader(line.removeprefix("# ") for line in file))


def ball(row):
    numbers = {key: float(row[key]) for key in ("core", "cap", "hollow") if row[key]}
    return Profile(row["device"], **numbers)


def test_sweeps_agree_with_the_reference(data):
    rows = reference(data)
    for row in rows:
        i = math.radians(float(row["incidence_deg"]))
        found = graded.sweep(ball(row), math.sin(i))
        # of the capped ones it is by quadrature, which 1.5e-9 off the closed forms elsewhere is twice in the sum
        allowed = 3e-9 if row["cap"] else max(float(row["error"]), 1e-15)
        assert found == pytest.approx(float(row["sweep"]), abs=allowed, rel=0), row
    assert len(rows) == 240 and {row["device"] for row in rows} == set(DEVICES)


def test_what_is_integrated_is_what_closed_forms_say():
    p = np.sin(np.radians(np.linspace(0.5, 85, 40)))
    for device in ("luneburg", "fisheye", "eaton"):
        np.testing.assert_allclose(
            graded.sweep(Profile(SMOOTH[device]), p), graded.sweep(Profile(device), p), rtol=0, atol=5e-11
        )
    made = Profile(lambda r: -1 / r**2, core=0.5)
    np.testing.assert_allclose(
        graded.sweep(made, p), graded.sweep(Profile("magnifier", core=0.5), p), rtol=0, atol=1e-13
    )


@pytest.mark.parametrize(
    "index",
    [
        lambda r: 1 + 1.5 * (1 - r * r) ** 2 + (1 - r * r) * np.exp(-np.square((r - 0.5) / 0.05)),
        SMOOTH["steep"],
        lambda r: 1 + 20 * (1 + np.tanh((0.05 - r) / 0.0006)),
    ],
)
def test_what_is_steep_is_integrated_as_well_in_one_piece_as_in_many(index):
    p = np.sin(np.radians(np.linspace(0.5, 85, 40)))
    pieces = Profile(index, breaks=(*np.arange(1, 20) / 400, *np.arange(1, 20) / 20))
    np.testing.assert_allclose(graded.sweep(Profile(index), p), graded.sweep(pieces, p), rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("p", [0.2, 0.7])
def test_hamiltons_equations_lead_the_same_way(name, p):
    c = math.sqrt(1 - p * p)
    point, direction = hamilton(SMOOTH[name], np.array([-c, p]), np.array([1.0, 0.0]))
    found = graded.carry(Profile(SMOOTH[name]), (-5, p, 0), (1, 0, 0))
    np.testing.assert_allclose(found.points, (*point, 0), atol=1e-6)
    np.testing.assert_allclose(found.directions, (*direction, 0), atol=1e-6)


@pytest.mark.parametrize("device, cap", [("eaton", 3.0), ("invisible", 3.0), ("luneburg", 1.2)])
def test_the_capped_part_is_a_uniform_ball(device, cap):
    capped = Profile(device, cap=cap)
    (edge,) = capped.edges
    assert capped.index(np.array([edge])) == pytest.approx(cap)
    p = np.array([0.05, 0.3, 0.5]) * cap * edge
    # the chord in the uniform ball, and the shell as one with a core of that radius
    chord = 2 * np.arccos(p / (cap * edge))
    shell = graded.sweep(Profile(device, core=edge), p)
    np.testing.assert_allclose(graded.sweep(capped, p), chord + shell, rtol=0, atol=1e-10)
    outside = np.array([1.01 * cap * edge, 0.99])
    np.testing.assert_allclose(
        graded.sweep(capped, outside), graded.sweep(Profile(device), outside), rtol=0, atol=1e-15
    )
    assert cap * edge == pytest.approx({"eaton": 0.6, "invisible": math.sqrt(0.75)}.get(device, cap * edge))


@pytest.mark.parametrize("name", BALLS)
def test_every_ray_runs_back_as_it_came(name):
    points, directions, p = rays(200)
    out = graded.carry(BALLS[name], points, directions)
    comes = np.isfinite(out.points[:, 0])
    assert comes.all()
    back = graded.carry(BALLS[name], out.points - 2 * -out.directions, -out.directions)
    entry = points + (3 - np.sqrt(1 - p * p))[:, None] * directions
    np.testing.assert_allclose(back.points, entry, rtol=0, atol=1e-12)
    np.testing.assert_allclose(back.directions, -directions, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(out.points, axis=1), 1, atol=1e-12)
    assert (np.sum(out.points * out.directions, axis=1) > 0).all()


def test_rays_that_come_from_far_away_have_unit_directions():
    points, directions, _ = rays(50)
    out = graded.carry(BALLS["luneburg"], points - 1e9 * directions, directions)
    np.testing.assert_allclose(np.linalg.norm(out.directions, axis=1), 1, rtol=0, atol=1e-12)


def test_what_each_device_is_for():
    points, d, p = rays(50)

    def out(device, **numbers):
        return graded.carry(Profile(device, **numbers), points, d)

    c = np.sqrt(1 - p * p)[:, None]
    entry = points + (3 - c) * d
    np.testing.assert_allclose(out("luneburg").points, d, atol=1e-12)  # the focus: the far rim, on the axis
    np.testing.assert_allclose(out("fisheye").points, -entry, atol=1e-12)
    np.testing.assert_allclose(out("eaton").directions, -d, atol=1e-12)
    np.testing.assert_allclose(np.sum(out("turn").directions * d, axis=1), 0, atol=1e-12)
    for device in ("invisible", "cloak"):
        np.testing.assert_allclose(out(device).directions, d, atol=1e-12)
        np.testing.assert_allclose(out(device).points, entry + 2 * c * d, atol=1e-12)
    # a bare mirror of radius 1 / a
    bare = points + (3 - np.sqrt(25 / 16 - p * p))[:, None] * d
    normal = bare * 0.8
    mirrored = d - 2 * np.sum(d * normal, axis=1, keepdims=True) * normal
    np.testing.assert_allclose(out("magnifier", core=0.8).directions, mirrored, atol=1e-12)
    apart = np.cross(out("magnifier", core=0.8).points - bare, mirrored)
    np.testing.assert_allclose(apart, 0, atol=1e-12)


def test_turning_by_any_angle():
    for angle in (0.3, math.pi, 2 * math.pi):
        profile = Profile("turn", angle=angle)
        r = np.linspace(0.01, 1, 50)
        n, t = profile.index(r), profile.rho(r)
        np.testing.assert_allclose(n, (1 / t + np.sqrt(np.maximum(1 / t**2 - 1, 0))) ** (angle / math.pi), rtol=1e-6)
    np.testing.assert_allclose(Profile("turn", angle=math.pi).index(r), Profile("eaton").index(r), rtol=1e-7)
    np.testing.assert_allclose(Profile("turn", angle=2 * math.pi).index(r), Profile("invisible").index(r), rtol=1e-7)


def test_tables_are_the_sweep():
    for profile in (*BALLS.values(), Profile("cloak", hollow=0.6, core=0.7, surface="black")):
        found = graded.table(profile, 65)
        h = np.arange(65) / 64
        theta = graded.sweep(profile, 2 * h / (1 + h * h))
        np.testing.assert_allclose(found[:, :2], np.stack([np.cos(theta), np.sin(theta)], axis=-1), atol=1e-6)
        assert found.dtype == np.float32 and set(found[:, 2]) <= {0.0, 1.0}
    # the share of a cloak's disc that a core too large by 0.1 blackens
    assert h[np.argmax(found[:, 2] > 0)] == pytest.approx(math.tan(math.asin(0.25) / 2), abs=1 / 64)


def test_where_light_lands_on_a_core_and_leaves_it():
    magnifier = Profile("magnifier", core=0.8, surface="textured")
    p = np.linspace(0, 0.99, 20)
    there = graded.landing(magnifier, p)
    assert there.reached.all()
    np.testing.assert_allclose(there.angle, np.arcsin(0.8 * p) - np.arcsin(p), atol=1e-14)
    np.testing.assert_allclose(there.sine, -0.8 * p, atol=1e-14)
    angle, leaves = graded.leaving(magnifier, np.abs(there.sine))
    np.testing.assert_allclose(angle, there.angle, atol=1e-9)
    assert leaves.all() and graded.leaving(magnifier, 0.8)[1], "along the rim, too"
    trapped = np.linspace(0.81, 0.99, 9)  # chords of the sphere of radius 1 / a, outside of the rim
    angle, leaves = graded.leaving(magnifier, trapped)
    np.testing.assert_allclose(angle, -2 * np.arccos(trapped), atol=1e-9)
    assert not leaves.any()
    found = graded.table(magnifier, 33)
    h = np.arange(33) / 32
    sines = 2 * h / (1 + h * h)
    np.testing.assert_allclose(found[:, 1], np.sin(np.arcsin(0.8 * sines) - np.arcsin(sines)), atol=1e-6)
    assert (found[:, 2] == -1).all()
    cored = graded.landing(Profile("eaton", core=0.3, surface="black"), [0.2, 0.7, 0.72])
    assert cored.reached.tolist() == [True, True, False] and np.isnan(cored.angle[2])  # rho = 0.714 at the core


@pytest.mark.parametrize("name", BALLS)
def test_paths_end_where_rays_leave(name):
    for p in (0.0, 0.03, 0.4, 0.95):
        way = graded.trace(BALLS[name], p)
        assert way[0].tolist() == [1, 0] and way[-1, 0] == pytest.approx(1)
        assert math.remainder(way[-1, 1] - graded.sweep(BALLS[name], p), 2 * math.pi) == pytest.approx(0, abs=2e-4)
        point = graded.path(BALLS[name], (p, 0, 4), (0, 0, -2))
        out = graded.carry(BALLS[name], (p, 0, 4), (0, 0, -2))
        np.testing.assert_allclose(point[-1], out.points, atol=2e-4)
        assert np.linalg.norm(out.points) == pytest.approx(1), "on the axis, too"
        np.testing.assert_allclose(point[0], (p, 0, math.sqrt(1 - p * p)), atol=1e-12)
    assert len(graded.path(BALLS[name], (1.1, 0, 4), (0, 0, -2))) == 0


@pytest.mark.parametrize("name", BALLS)
def test_many_paths_at_once_are_those_of_each_ray(name):
    starts = np.array([(p, 0.0, 4.0) for p in (0.0, 0.2, 0.35, 0.8, 0.99)])
    ways = graded.paths(BALLS[name], starts, (0, 0, -2), 129)
    for start, way in zip(starts, ways, strict=True):
        one = graded.path(BALLS[name], start, (0, 0, -2))
        np.testing.assert_allclose(way, graded.evenly(one[None], 129)[0], atol=1e-9)
        np.testing.assert_allclose(way[[0, -1]], one[[0, -1]], atol=1e-12)
    steps = np.linalg.norm(np.diff(ways, axis=1), axis=-1)
    assert (steps.min(axis=1) > 0.8 * steps.max(axis=1)).all()


def test_no_path_cuts_through_what_a_cloak_hides():
    for p in (1e-6, 1e-3, 0.1):
        (way,) = graded.paths(Profile("cloak", hollow=0.6), [(p, 0, 4)], (0, 0, -2), 129)
        assert np.linalg.norm((way[1:] + way[:-1]) / 2, axis=1).min() > 0.599


def test_lines_without_length_stay_where_they_are():
    lines = np.array([[(1.0, 2.0, 3.0)] * 3, [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]])
    dots = graded.evenly(lines, 5)
    np.testing.assert_allclose(dots[0], [(1, 2, 3)] * 5)
    np.testing.assert_allclose(dots[1][:, :2], [(0, 0), (0.5, 0), (1, 0), (1, 0.5), (1, 1)])


def test_the_orbits_that_are_known():
    r, phi = graded.trace(Profile("luneburg"), 0.5).T  # an ellipse about the centre: p^2 / r^2 = 1 - cos(..) cos i
    x, y = r * np.cos(phi), r * np.sin(phi)
    conic = np.linalg.lstsq(np.stack([x * x, x * y, y * y], axis=-1), np.ones_like(x), rcond=None)
    np.testing.assert_allclose(np.stack([x * x, x * y, y * y], axis=-1) @ conic[0], 1, atol=1e-9)
    assert r.min() == pytest.approx(math.sqrt(1 - math.sqrt(0.75)))
    x, y = (lambda way: (way[:, 0] * np.cos(way[:, 1]), way[:, 0] * np.sin(way[:, 1])))(
        graded.trace(Profile("fisheye"), 0.5)
    )
    circle = np.linalg.lstsq(np.stack([x, y, np.ones_like(x)], axis=-1), x * x + y * y, rcond=None)[0]
    np.testing.assert_allclose(np.stack([x, y, np.ones_like(x)], axis=-1) @ circle, x * x + y * y, atol=1e-9)
    r, _ = graded.trace(Profile("cloak", hollow=0.6), 0.25).T
    assert r.min() == pytest.approx(0.7, abs=1e-3) and r.min() >= 0.7 - 1e-12
    ends = graded.trace(Profile("eaton", core=0.3, surface="black"), 0.2)
    assert ends[-1, 0] == pytest.approx(0.3) and len(ends) < len(graded.trace(Profile("eaton", core=0.3), 0.2))


@given(st.floats(1.01, 1.9), st.floats(0.05, 0.95), st.floats(1e-6, 1))
@settings(max_examples=30)
def test_any_profile_turns_by_what_it_sweeps(middle, knee, p):
    profile = Profile(((0, middle), (knee, (1 + middle) / 2), (1, 1)))
    found = graded.carry(profile, (0, p, -3), (0, 0, 1))
    i = math.asin(p)
    turned = graded.sweep(profile, p) - (math.pi - 2 * i)
    np.testing.assert_allclose(found.directions, (0, -math.sin(turned), math.cos(turned)), atol=1e-9)


def test_what_misses_or_ends_within_does_not_come_out():
    black = Profile("cloak", hollow=0.5, core=0.6, surface="black")
    out = graded.carry(black, [[0, 0.1, 5], [0, 0.3, 5], [0, 1.2, 5]], (0, 0, -1))
    assert np.isnan(out.points[:, 0]).tolist() == [True, False, True]
    assert graded.Profile("cloak", hollow=0.5, core=0.4).core is None  # no light gets there


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Profile("eton"), ("eton", "did you mean eaton", "fisheye")),
        (lambda: Profile(lambda r: 1 + 0.1 * r), ("n = 1.1 at the rim", "1 or -1")),
        (lambda: Profile(lambda r: 0 * r), ("n = 0", "nowhere 0")),
        (lambda: Profile(lambda r: np.where(r < 0.5, np.nan, 1)), ("n = nan", "finite")),
        (lambda: Profile(lambda r: 4 * r - 3, core=0.1), ("passes through 0 near r = 0.75", "breaks")),
        (lambda: Profile(lambda r: np.where(r < 0.5, 1.5, 1.0), breaks=(0.5,)), ("jumps from 1.5 to 1", "reflected")),
        (lambda: Profile(lambda r: 1 / r), ("never come out", "core")),
        (lambda: Profile(lambda r: 1.0), ("one number for each",)),
        (lambda: Profile("eaton", core=1.0), ("core = 1", "below 1")),
        (lambda: Profile("eaton", core=0.0), ("core = 0", "above 0")),
        (lambda: Profile("eaton", core=math.nan), ("core = nan",)),
        (lambda: Profile("eaton", core=0.2, surface="shiny"), ("shiny", "mirror")),
        (lambda: Profile("eaton", cap=0.9), ("cap = 0.9", "above 1")),
        (lambda: Profile("cloak", cap=2.0), ("cloak", "no cap")),
        (lambda: Profile("cloak", hollow=1.0), ("hollow = 1",)),
        (lambda: Profile("turn", angle=7.0), ("angle = 7", "2 pi")),
        (lambda: Profile(((0.2, 1.5), (1, 1))), ("gap", "from r = 0.2 to 1", "from 0 to 1")),
        (lambda: Profile(((0, 1.5), (0.9, 1))), ("gap", "to 0.9")),
        (lambda: Profile(((0, 1.5), (0.5, math.nan), (1, 1))), ("gap", "finite")),
        (lambda: Profile(((0, 1.5), (0.7, 1.2), (0.5, 1.3), (1, 1))), ("growing order",)),
        (lambda: Profile(np.array([[0.1, 1.5], [0.9, 1.2]])), ("a gap", "from r = 0.1 to 0.9")),
        (lambda: Profile(3), ("3 is no profile", "a table of pairs")),
        (lambda: Profile((1.5, 1.4, 1.0)), ("is no profile",)),
        (lambda: Profile(((0, 1.5), (1, 1.2))), ("n = 1.2 at the rim",)),
        (lambda: Profile("eaton", breaks=(1.5,)), ("breaks has 1.5",)),
        (lambda: graded.sweep(Profile("eaton"), 1.5), ("sine", "[0, 1]")),
        (lambda: graded.trace(Profile("eaton"), -0.1), ("sine",)),
        (lambda: graded.leaving(Profile("eaton"), 0.5), ("without a core",)),
        (lambda: graded.sweep(Profile(lambda r: 1 + (r < 0.05)), 0.3), ("too steep", "breaks")),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(one_sentence, make, words):
    with pytest.raises(ValueError) as caught:
        make()
    one_sentence(caught.value, *words)


def test_a_jump_of_the_sign_passes():
    nim = Profile(lambda r: np.where(r < 0.5, 1.0, -1.0), breaks=(0.5,))
    p = np.array([0.1, 0.3, 0.49, 0.7])
    inner = np.arccos(np.minimum(p / 0.5, 1))
    np.testing.assert_allclose(graded.sweep(nim, p), 2 * (2 * inner - np.arccos(p)), atol=1e-9)
    pairs = Profile(((0, 1.0), (0.5, 1.0), (0.5, -1.0), (1, -1.0)))
    np.testing.assert_allclose(graded.sweep(pairs, p), graded.sweep(nim, p), atol=1e-9)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through graded balls. All that a ball does to a ray is one function, the sweep: how far round it carries it.

The sweep Theta of a ray with p = sin(i), i its angle of incidence, is the angle from where it enters to where it leaves, in
the sense of its motion: Theta = 2 Int sign(n) p / sqrt(rho^2 - p^2) dr / r from the turning point to the rim (Born and Wolf
3.2.3); of a uniaxial ball with eps_r along the radius, Theta = 2 Int (p / eps_r) / sqrt(1 - p^2 / rho^2) dr / r^2. In a NIM
light runs against its wave vector, hence the sign. The direction is turned by Theta - (pi - 2 i), also by a mirror within.
"""

from __future__ import annotations

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .interface import unit
from .profiles import CORES, DEVICES, Profile

__all__ = [
    "CORES",
    "DEVICES",
    "SIZE",
    "Carried",
    "Landing",
    "Profile",
    "carry",
    "evenly",
    "landing",
    "leaving",
    "path",
    "paths",
    "sweep",
    "table",
    "trace",
]

SIZE = 1024  # of a table; texels
_GRAZING = 1 - 1e-9  # a sine beyond it is taken as this, where the sweep is integrated
_AXIS = 1e-9  # and one below it as this
_NEAR = 1e-4  # to a turning point, in ln r
_NODES, _FEWER = 200, 48  # of a quadrature: of a piece of a profile of few pieces, and of one of many
_EXACT, _FAIR = 2e-12, 1e-6  # radians between two quadratures: both are right, or good enough to be seen
_PANELS, _PANEL_NODES = 24, 8  # of a path, of each piece: points between them, and nodes of each


class Landing(NamedTuple):
    """Where rays meet the core.

    reached: (...) whether they do
    angle:   (...) from where they enter the ball, in the sense of their motion; NaN where they do not
    sine:    (...) of the angle to the radius at which they arrive, signed: p / (n a) where n is the index at the core
    """

    reached: NDArray
    angle: NDArray
    sine: NDArray


class Carried(NamedTuple):
    """Where rays leave a ball, (..., 3) each: points of its surface, and unit vectors; NaN for what does not come out."""

    points: NDArray
    directions: NDArray


def _sines(sines: ArrayLike, most: float = 1.0) -> NDArray:
    sines = np.asarray(sines, float)
    if not ((sines >= 0) & (sines <= most)).all():
        raise ValueError(f"the sine of an angle of incidence must lie in [0, {most:.6g}].")
    return sines


def _turning(profile: Profile, p: NDArray) -> tuple[NDArray, NDArray]:
    """The radii (N,) at which rays of p (N,) turn back, coming from outside, and whether they do before the inner radius."""
    r = profile.radii
    rho = profile.rho(r)
    # the least rho outside of each radius: a ray gets to the first that is below p
    least = np.minimum.accumulate(rho[::-1])[::-1]
    turns = p > least[0]
    place = np.clip(np.searchsorted(least, p) - 1, 0, len(r) - 2)
    return _between(profile, p, r[place], r[place + 1], turns, profile.inner), turns


def _between(profile: Profile, p: NDArray, below: NDArray, above: NDArray, there: NDArray, otherwise: float) -> NDArray:
    """The radii (N,) at which rho is p, from brackets in which it passes it from `below` to `above`."""
    for _ in range(80):
        middle = np.sqrt(below * above)
        under = profile.rho(middle) < p
        below, above = np.where(under, middle, below), np.where(under, above, middle)
    return np.where(there, above, otherwise)


def _pieces(profile: Profile) -> list[tuple[float, float]]:
    """(from, to) in the logarithm of the radius, from within."""
    ends = np.log([profile.inner, *profile.edges, 1.0])
    return list(itertools.pairwise(ends))


def _rate(profile: Profile, p: NDArray, low: NDArray, q: NDArray) -> NDArray:
    """d Theta / d ln r (N, M) at ln r = low + q, of rays of p (N, 1); low (N, 1), q (N, M) of 0 or more."""

    def square(q):
        rho = profile.rho(np.exp(low + q))
        return (rho - p) * (rho + p)

    # next to a turning point the difference is all rounding: there it is q times a parabola through three places
    near = np.minimum(_NEAR, np.max(q, axis=1, keepdims=True) / 20)
    a, b, c = (square(k * near) / (k * near) for k in (1, 2, 3))
    t = q / near
    smooth = q * (a * (t - 2) * (t - 3) / 2 - b * (t - 1) * (t - 3) + c * (t - 1) * (t - 2) / 2)
    turns = np.abs(square(np.zeros_like(low))) < 1e-13 * p * p
    squares = np.where(turns & (t < 3), smooth, square(q))
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = profile.sense(np.exp(low + q)) * p / np.sqrt(squares)
    return np.where(squares > 0, rate, 0.0)


def _integral(profile: Profile, p: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """The angle (N,) by which rays of p (N,) go round between two radii, ln r from low (N,) to high (N,)."""
    return _summed(profile, p, low, high, _panels(profile))


@functools.lru_cache(64)
def _panels(profile: Profile) -> int:
    """Into how many panels each piece of it is cut for its integrals: one, but where its index is steep."""
    p = _followed(profile, np.sin(np.radians(np.linspace(0.2, 85, 200))))
    low, high = np.log(_turning(profile, p)[0]), np.zeros_like(p)
    former = _summed(profile, p, low, high, 1)
    for panels in (2, 4, 8, 16, 32):
        finer = _summed(profile, p, low, high, panels)
        error, former = np.abs(finer - former).max(), finer
        if error < _EXACT:
            return panels // 2
    if error > _FAIR:
        raise ValueError(
            "the index n(r) is too steep somewhere for rays to be followed; name the radii there as breaks."
        )
    return panels


def _summed(profile: Profile, p: NDArray, low: NDArray, high: NDArray, panels: int) -> NDArray:
    pieces = _pieces(profile)
    nodes, weights = _gauss(_NODES if len(pieces) < 8 else _FEWER)
    ends = np.arange(panels)[:, None]
    u, weights = (
        (math.pi / 4 / panels * (2 * ends + nodes + 1)).ravel(),
        np.tile(math.pi / 4 / panels * weights, panels),
    )
    # with x = a + (b - a) sin^2 u the root at a turning point, at either end, is none
    share, weights = np.square(np.sin(u)), weights * np.sin(2 * u)
    total = np.zeros_like(p)
    for first, last in pieces:
        a, b = np.clip(low, first, last), np.clip(high, first, last)
        some = b > a
        if some.any():
            a, width = a[some, None], (b - a)[some, None]
            total[some] += np.sum(_rate(profile, p[some, None], a, width * share) * width * weights, axis=1)
    return total


def _half(profile: Profile, p: NDArray) -> tuple[NDArray, NDArray]:
    """The angle (N,) from the rim to where rays of p (N,) turn back or meet the core, and whether they meet it."""
    q = _followed(profile, p)
    inner, turns = _turning(profile, q)
    reached = ~turns & (profile.core is not None)
    half = _closed(profile, p, inner, reached)
    some = np.isnan(half)
    half[some] = _integral(profile, q[some], np.log(inner[some]), np.zeros(np.count_nonzero(some)))
    return half, reached


def _followed(profile: Profile, p: NDArray) -> NDArray:
    """p (N,) that is near to p (N,) and can be integrated: neither grazing, nor on the axis of a ball without a core."""
    least = max(2 * profile.rho(profile.radii[:1])[0], _AXIS) if profile.core is None else 0.0
    return np.clip(p, least, _GRAZING)


def _closed(profile: Profile, p: NDArray, inner: NDArray, reached: NDArray) -> NDArray:
    """The same where a closed form says it, NaN elsewhere; inner (N,): where the rays turn back, or the core."""
    i = np.arcsin(p)
    core = profile.core or 0.0
    if profile.n == "cloak":  # rays are straight in the radius rho
        at_core = profile.rho(np.array([core]))[0] if core else 1.0
        return np.arccos(p) - np.where(reached, np.arccos(np.minimum(p / at_core, 1)), 0.0)
    if profile.n == "magnifier":
        return np.full_like(p, np.nan) if profile.edges else np.arcsin(core * p) - i
    halves = {
        "luneburg": (math.pi - i) / 2,
        "fisheye": np.full_like(p, math.pi / 2),
        "eaton": math.pi - i,
        "invisible": 1.5 * math.pi - i,
        "turn": (math.pi + profile.angle) / 2 - i,
    }
    if not isinstance(profile.n, str):
        return np.full_like(p, np.nan)
    return np.where(reached | (inner <= max(profile.edges, default=0.0)), np.nan, halves[profile.n])


def _flat(values: NDArray) -> NDArray:
    return np.atleast_1d(values).ravel()


def sweep(profile: Profile, sines: ArrayLike) -> NDArray:
    """The sweep (...), radians, of rays by the sines (...) of their angles of incidence, 0 to 1.

    A ray that meets the core is taken as reflected there, whatever the core is. Exact to rounding where a closed form is
    known, to 1e-10 up to 85 degrees elsewhere. Raises ValueError for other sines, and for an index that is too steep.
    """
    sines = _sines(sines)
    return 2 * _half(profile, _flat(sines))[0].reshape(sines.shape)


def landing(profile: Profile, sines: ArrayLike) -> Landing:
    """Where rays meet the core, by the sines (...) of their angles of incidence on the ball."""
    sines = _sines(sines)
    half, reached = (values.reshape(sines.shape) for values in _half(profile, _flat(sines)))
    index = profile.index(np.array([profile.inner]))[0]
    return Landing(reached, np.where(reached, half, np.nan), np.where(reached, sines / (index * profile.inner), np.nan))


def leaving(profile: Profile, sines: ArrayLike) -> tuple[NDArray, NDArray]:
    """Where rays go that start on the core, by the sines (...), 0 to 1, of their angles to the radius there.

    Returns the angle (...) from there, in the sense of p and so negative in a NIM, to where they leave the ball or fall back
    on the core, and whether they leave (...): at an angle to the radius whose sine is p = sine abs(n) a. Raises ValueError
    for a ball without a core.
    """
    if profile.core is None:
        raise ValueError("a ball without a core has nothing that light starts from; give it a core.")
    sines = _sines(sines)
    r = profile.radii
    rho = profile.rho(r)
    p = _flat(sines) * rho[0]
    least = np.minimum.accumulate(rho)
    leaves = p <= least[-1]
    place = np.clip(np.searchsorted(-least, -p), 1, len(r) - 1)  # the first beyond which rho is below p
    # outwards rho falls: _between() takes its brackets the other way round
    turning = _between(profile, p, r[place], r[place - 1], ~leaves, 1.0)
    angle = _integral(profile, p, np.full_like(p, math.log(profile.core)), np.log(turning))
    return np.where(leaves, angle, 2 * angle).reshape(sines.shape), leaves.reshape(sines.shape)


def table(profile: Profile, size: int = SIZE) -> NDArray:
    """The sweep as a table (size, 3), float32, of cos Theta, sin Theta and weight at h = tan(i / 2) = j / (size - 1).

    The weight is 1 where light goes on, 0 where a black core ends it, and -1 where it lands on a textured core: Theta is
    the angle to there then.
    """
    h = np.arange(size) / (size - 1)
    half, reached = _half(profile, np.minimum(2 * h / (1 + h * h), 1))
    theta = np.where(reached & (profile.surface == "textured"), half, 2 * half)
    weight = np.where(reached, {"mirror": 1, "black": 0, "textured": -1}[profile.surface], 1)
    return np.stack([np.cos(theta), np.sin(theta), weight], axis=-1).astype(np.float32)


class _Plane(NamedTuple):
    """The plane of incidence of rays (..., 3), their p (...): the entry is `out`, and `along` the way they go round it."""

    p: NDArray
    out: NDArray
    along: NDArray


def _plane(points: ArrayLike, directions: ArrayLike) -> _Plane:
    points, d = np.broadcast_arrays(np.asarray(points, float), unit(directions))
    foot = points - np.sum(points * d, axis=-1, keepdims=True) * d
    foot -= np.sum(foot * d, axis=-1, keepdims=True) * d  # once more, for points far away
    p = np.linalg.norm(foot, axis=-1, keepdims=True)
    # on the axis any plane will do
    aside = np.where(np.abs(d[..., :1]) < 0.6, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    aside = unit(aside - np.sum(aside * d, axis=-1, keepdims=True) * d)
    away = np.where(p > 0, foot / np.where(p > 0, p, 1), aside)
    with np.errstate(invalid="ignore"):
        c = np.sqrt((1 - p) * (1 + p))
    return _Plane(p[..., 0], p * away - c * d, p * d + c * away)


def carry(profile: Profile, points: ArrayLike, directions: ArrayLike) -> Carried:
    """Rays carried through the ball of radius 1 in the origin.

    points:     (..., 3), anywhere on the rays, before the ball; directions: (..., 3), of any length but zero
    Returns what leaves it: NaN for rays that miss the ball, and for those that end on a core that is no mirror.
    """
    plane = _plane(points, directions)
    meets = plane.p <= 1
    p = np.where(meets, plane.p, 0.0)
    half, reached = (values.reshape(p.shape) for values in _half(profile, _flat(p)))
    theta = np.where(meets & ~(reached & (profile.surface != "mirror")), 2 * half, np.nan)[..., None]
    out = np.cos(theta) * plane.out + np.sin(theta) * plane.along
    along = np.cos(theta) * plane.along - np.sin(theta) * plane.out
    p = plane.p[..., None]
    with np.errstate(invalid="ignore"):
        return Carried(out, np.sqrt((1 - p) * (1 + p)) * out + p * along)


def trace(profile: Profile, p: float) -> NDArray:
    """The path of one ray within the ball, (N, 2): radius, and angle from where it enters, in the sense of its motion.

    It ends where the ray leaves, or on a core that is no mirror. Raises ValueError for p outside of [0, 1].
    """
    radii, angles = _ways(profile, _flat(_sines(p)))
    way = np.stack([radii[0], angles[0]], axis=-1)
    return way[np.append(True, (way[1:] != way[:-1]).any(axis=1))]


def _ways(profile: Profile, p: NDArray) -> tuple[NDArray, NDArray]:
    """Radii and angles (N, M) of the whole ways of rays of p (N,), as trace() has them; points may be there several times."""
    q = _followed(profile, p)
    inner, turns = _turning(profile, q)
    if profile.is_cloak:
        radii, angles = _through_cloak(profile, q, turns)
    else:
        radii, angles = _inwards(profile, q, np.log(inner))
    ends = ~turns[:, None] & (profile.core is not None and profile.surface != "mirror")
    # the way out is the way in, turned round
    out, onwards = radii[:, -2::-1], 2 * angles[:, -1:] - angles[:, -2::-1]
    return (
        np.concatenate([radii, np.where(ends, radii[:, -1:], out)], axis=1),
        np.concatenate([angles, np.where(ends, angles[:, -1:], onwards)], axis=1),
    )


def _through_cloak(profile: Profile, p: NDArray, turns: NDArray) -> tuple[NDArray, NDArray]:
    """Radii and angles (N, M) of the way in: a straight line in the radius rho."""
    end = np.where(turns, p, profile.rho(np.array([profile.inner]))[0])
    first, last = np.sqrt(1 - p * p), np.sqrt(end * end - p * p)
    # evenly along the line, and evenly in angle, for where it passes near to the centre
    turned = p * np.tan(np.linspace(np.arctan2(first, p), np.arctan2(last, p), 4 * _PANELS))
    along = np.concatenate([np.linspace(last, first, 2 * _PANELS), turned.clip(last, first)])
    along, p = np.sort(along, axis=0)[::-1].T, p[:, None]
    return profile.hollow + (1 - profile.hollow) * np.hypot(p, along), np.arctan2(along[:, :1], p) - np.arctan2(
        along, p
    )


def _inwards(profile: Profile, p: NDArray, low: NDArray) -> tuple[NDArray, NDArray]:
    """Radii and angles (N, M) of the way in, of p (N,), to ln r = low (N,)."""
    nodes, weights = _gauss(_PANEL_NODES)
    step = math.pi / 2 / _PANELS
    u = step * (np.arange(_PANELS)[:, None] + (nodes + 1) / 2)
    radii, angles = [np.ones((len(p), 1))], [np.zeros((len(p), 1))]
    for first, last in reversed(_pieces(profile)):
        begins = np.clip(low, first, last)
        width = (last - begins)[:, None]
        passed = np.zeros((len(p), _PANELS))
        some = begins < last  # of what turns back farther out nothing is left
        if some.any():
            q = width[some, None] * np.square(np.sin(u))
            each, low_ends = (np.repeat(values[some], _PANELS)[:, None] for values in (p, begins))
            rate = _rate(profile, each, low_ends, q.reshape(-1, len(nodes))).reshape(q.shape)
            passed[some] = (rate * width[some, None] * np.sin(2 * u) * weights).sum(axis=-1)[:, ::-1] * step / 2
        radii.append(np.exp(begins[:, None] + width * np.square(np.sin(step * np.arange(_PANELS)[::-1]))))
        angles.append(angles[-1][:, -1:] + np.cumsum(passed, axis=1))
    return np.maximum(np.concatenate(radii, axis=1), np.exp(low)[:, None]), np.concatenate(angles, axis=1)


@functools.cache
def _gauss(count: int) -> tuple[NDArray, NDArray]:
    """So many places in [-1, 1], and their weights: both are shared, and not to be written to."""
    return np.polynomial.legendre.leggauss(count)


def path(profile: Profile, point: ArrayLike, direction: ArrayLike) -> NDArray:
    """The points (N, 3) of one ray's way through the ball of radius 1 in the origin; (0, 3) where it misses the ball.

    point: (3,) anywhere on the ray, before the ball; direction: (3,), of any length but zero
    """
    plane = _plane(point, direction)
    if plane.p > 1:
        return np.zeros((0, 3))
    radii, angles = trace(profile, float(plane.p)).T[..., None]
    return radii * (np.cos(angles) * plane.out + np.sin(angles) * plane.along)


def paths(profile: Profile, points: ArrayLike, directions: ArrayLike, count: int) -> NDArray:
    """The same of N rays that meet the ball: `count` points of each, (N, count, 3), evenly along its way.

    points: (N, 3); directions: (N, 3), of any length but zero
    """
    plane = _plane(points, directions)
    radii, angles = (values[..., None] for values in _ways(profile, plane.p))
    return evenly(radii * (np.cos(angles) * plane.out[:, None] + np.sin(angles) * plane.along[:, None]), count)


def evenly(points: ArrayLike, count: int) -> NDArray:
    """(N, count, 3) points evenly along each of N lines through points (N, M, 3)."""
    points = np.asarray(points, float)
    if not len(points):
        return np.zeros((0, count, 3))
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    along = np.concatenate([np.zeros((len(points), 1)), np.cumsum(lengths, axis=1)], axis=1)
    # one line after the other, each from an even number to the next odd one
    before, total = 2.0 * np.arange(len(points))[:, None], along[:, -1:]
    share = np.where(total > 0, along / np.where(total > 0, total, 1), np.linspace(0, 1, points.shape[1]))
    places = (before + share).ravel()
    wanted = before + np.linspace(0, 1, count)
    return np.stack([np.interp(wanted, places, column) for column in points.reshape(-1, 3).T], axis=-1)

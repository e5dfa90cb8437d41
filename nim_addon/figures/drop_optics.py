# SPDX-License-Identifier: GPL-3.0-or-later
"""What the figures of the drop need of theory: where its light lands on the wall, in closed form. No bpy.

Lengths are in radii of the drop, which is in the origin; light travels along -y, and the wall is the plane y = distance.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..physics import Interface, Medium, deviation
from .sunlight import strata, sun_directions

OUTSIDE = -1  # the "order" of what the drop mirrors before any of it gets in
ORDERS = range(OUTSIDE, 12)  # of what grazes the drop 5e-5 of the light is left after these
STRATA = 64  # of the wavelengths


class Leaving(NamedTuple):
    """Light of one order as it leaves the drop, in the plane of the axis and the ray.

    around: (...) angle at the drop's middle from where the light comes from, to where it leaves, radians
    onward: (...) angle from there to the direction it leaves in
    energy: (...) its share of what arrived
    """

    around: np.ndarray
    onward: np.ndarray
    energy: np.ndarray


def leaving(medium: Medium, b, order: int, absorption: float = 0.0) -> Leaving:
    """How light that arrives b (...) from the axis leaves a drop, of a plain medium, after `order` reflections within.

    absorption: of the drop, in one of its radii
    It enters at the angle i from the axis, goes on by k + 1 chords of 2 cos r, pi - 2 r of the circle each, and is turned by
    D in all; every surface is met at the same angles, so (1 - R)^2 R^k is left of it, but for what is absorbed. OUTSIDE is
    R at the angle 2 i.
    """
    b = np.asarray(b, float)
    i = np.arcsin(b)
    R = Interface(medium).fresnel(np.cos(i)).R
    if order == OUTSIDE:
        return Leaving(i, 2 * i, R)
    r = np.arcsin(b / medium.n)
    left = np.exp(-absorption * 2 * (order + 1) * np.cos(r))
    return Leaving(
        i + (order + 1) * (math.pi - 2 * r),
        math.pi + deviation.drop(medium.n, i, order),
        (1 - R) ** 2 * R**order * left,
    )


def on_the_wall(
    medium: Medium, radius: float, distance: float, sun_angle: float, edges, seed: int, rays: int = 100_000
) -> np.ndarray:
    """Irradiance (N - 1, 3), linear RGB, of rings on the wall, where the sun's is 1 across its rays.

    radius:    of the drop, metres
    edges:     (N,) radii of the rings about the hole
    sun_angle: width of the sun's disk, degrees
    """
    random = np.random.default_rng(seed)
    total = np.zeros((len(edges) - 1, 3))
    for at, weight, count in _colours(medium, random, rays):
        towards = sun_directions(random, np.array([0.0, 1.0, 0.0]), sun_angle, count, disk=True)
        b = np.sqrt(
            (np.arange(count) + random.random(count)) / count
        )  # evenly over the disk that the drop is to the sun
        turn = random.uniform(0, 2 * math.pi, count)
        aside = np.stack([np.cos(turn), np.zeros(count), np.sin(turn)], axis=-1)
        aside -= np.sum(aside * towards, axis=1, keepdims=True) * towards
        aside /= np.linalg.norm(aside, axis=1, keepdims=True)
        for order in ORDERS:
            around, onward, energy = leaving(at.medium, b, order, radius * at.absorption)
            start, ahead = (
                np.cos(angle)[:, None] * towards + np.sin(angle)[:, None] * aside for angle in (around, onward)
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                way = (distance - start[:, 1]) / ahead[:, 1]
                place = np.hypot(*(start + way[:, None] * ahead)[:, ::2].T)
            here = ahead[:, 1] > 0
            landed, _ = np.histogram(place[here], edges, weights=energy[here])
            total += math.pi * landed[:, None] / rays * weight
    return total / (math.pi * np.diff(np.square(edges)))[:, None]


class _At(NamedTuple):
    """A medium at one wavelength, and its absorption there, per metre."""

    medium: Medium
    absorption: float


def _colours(medium: Medium, random: np.random.Generator, rays: int) -> Iterator[tuple[_At, np.ndarray, int]]:
    """What the drop is, the weight (3,) in linear RGB, and the number of rays, of each wavelength of white light."""
    if medium.dispersion is None:
        yield _At(medium, medium.absorption()), np.ones(3), rays
        return
    for nm, weight in strata(random, STRATA):
        yield _At(medium.at(nm), medium.absorption(nm)), weight, rays // STRATA

# SPDX-License-Identifier: GPL-3.0-or-later
"""How far prisms and drops turn light, by their index: for either sign of it. Angles in radians, arrays broadcast.

Outside is air or vacuum, n = 1; n is the real part of the index of refraction, so colours follow from n(lambda).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


def prism(n: ArrayLike, apex: ArrayLike, incidence: ArrayLike) -> NDArray:
    """The angle by which a prism turns a ray in its cross-section, positive towards the base.

    delta = i_1 + i_2 - A, sin r_1 = sin i_1 / n, r_2 = A - r_1, sin i_2 = n sin r_2 (Born and Wolf 4.7.2). n, apex (A),
    incidence (i_1, positive on the base's side of the normal): (...). NaN where the second face reflects all, or none
    of the light gets in.
    """
    n, apex, incidence = (np.asarray(value, float) for value in (n, apex, incidence))
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = apex - np.arcsin(np.sin(incidence) / n)
        return incidence + np.arcsin(n * np.sin(inside)) - apex


def symmetric(n: ArrayLike, apex: ArrayLike) -> NDArray:
    """The angle of incidence of the ray that crosses a prism symmetrically, where its deviation is stationary.

    sin i_1 = n sin(A / 2), so that delta = 2 i_1 - A (Born and Wolf 4.7.2). n, apex (A): (...); NaN where no light passes
    so.
    """
    n, apex = np.asarray(n, float), np.asarray(apex, float)
    with np.errstate(invalid="ignore"):
        return np.arcsin(n * np.sin(apex / 2))


def apex_for(n: float) -> float:
    """The apex, radians, of a prism that shows well how an index disperses: 60 degrees of glass, 20 of what bends more.

    Light crosses it symmetrically: 60 degrees let through what has n < 2 that way, but of 1.9 it leaves at 72 degrees.
    """
    return math.radians(60 if 1 < n < 1.9 else 20)


def incidence_for(n: float, apex: float) -> float:
    """The angle of incidence, radians, that goes with apex_for(): symmetric() of glass, 0 of all else.

    At right angles to the first face all colours of a medium enter it, however it disperses. NaN where none passes so.
    """
    return float(symmetric(n, apex)) if n > 1 else 0.0


def drop(n: ArrayLike, incidence: ArrayLike, order: int = 1) -> NDArray:
    """The angle by which a ball turns a ray after `order` reflections inside it, counted on beyond a full turn.

    D = k pi + 2 i - 2 (k + 1) r, sin r = sin i / n (Descartes 1637). n, incidence (i): (...); NaN where none of the light
    gets in.
    """
    n, incidence = np.asarray(n, float), np.asarray(incidence, float)
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = np.arcsin(np.sin(incidence) / n)
    return order * math.pi + 2 * incidence - 2 * (order + 1) * inside


class Bow(NamedTuple):
    """The rainbow of one order and index: where light arrives on the drop, how far it is turned, and where it is seen.

    incidence: angle of incidence at which the deviation is stationary
    deviation: angle by which it is turned, counted on beyond a full turn
    radius:    angle from the point opposite the sun, 0 to pi, at which it is seen
    """

    incidence: float
    deviation: float
    radius: float


def bow(n: float, order: int = 1) -> Bow | None:
    """The rainbow of a drop of index n, of one order (1, 2, ...); None where there is none.

    cos^2 i = (n^2 - 1) / (k (k + 2)) (Descartes 1637). A drop of negative index has no bow of any order: dD/di =
    2 + 2 (k + 1) cos i / (|n| cos r) is above 0 everywhere.
    """
    if order < 1:
        raise ValueError(f"order = {order} of a rainbow must be 1 or more: how often light is reflected in the drop.")
    cos2 = (n * n - 1) / (order * (order + 2))
    if n <= 1 or cos2 > 1:
        return None
    incidence = math.acos(math.sqrt(cos2))
    deviation = float(drop(n, incidence, order))
    return Bow(incidence, deviation, abs(math.remainder(deviation - math.pi, 2 * math.pi)))


def glory(n: float) -> float | None:
    """The distance from the axis, in radii, of the ring of light that a drop of index n < 0 sends straight back.

    b = |n| / sqrt(1 + n^2), where i + |r| = pi / 2, so that a ray which is refracted twice and never reflected is turned by
    D = 2 i - 2 r = pi. None for n > 0, where only light on the axis comes straight back.
    """
    return abs(n) / math.hypot(1, n) if n < 0 else None

# SPDX-License-Identifier: GPL-3.0-or-later
"""The flat lens of Veselago and Pendry: a plate of negative index, by rays. At n = -1 all rays of a point meet again.

Outside is air or vacuum, n = 1; angles in radians from the normal, arrays broadcast. A point stands at some `distance` before a
plate of some `thickness`; x grows to the side that its ray leaves to, and `behind` from the plate's other face on. Of waves
that rays know nothing of, such as those by which Pendry's lens (2000) would be sharper than half a wavelength, there is nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .half_space import slope


def landing(n: ArrayLike, theta: ArrayLike, thickness: ArrayLike, distance: ArrayLike, behind: ArrayLike) -> NDArray:
    """How far from the axis a ray is at some distance behind: x = (s + a) tan(theta) + d tan(theta_t).

    n, theta, thickness (d), distance (s), behind (a): (...). NaN in total reflection. With s + a = d and n = -1 it is 0
    whatever theta (Veselago 1968).
    """
    return (np.asarray(distance) + np.asarray(behind)) * np.tan(theta) + np.asarray(thickness) * slope(n, theta)


def image(n: ArrayLike, thickness: ArrayLike, distance: ArrayLike) -> NDArray:
    """Where rays near the axis meet, behind the plate; negative where they only seem to come from before its other face.

    -d / n - s, of landing() by small angles; at n = -1 that is where all of them do. n, thickness, distance: (...).
    """
    return -np.asarray(thickness) / np.asarray(n, float) - np.asarray(distance)


def nearer(n: ArrayLike, thickness: ArrayLike) -> NDArray:
    """How much nearer than it is a thing appears through the plate, near the axis: d (1 - 1 / n), 2 d at n = -1."""
    return np.asarray(thickness) * (1 - 1 / np.asarray(n, float))


def caustic(n: ArrayLike, theta: ArrayLike, thickness: ArrayLike, distance: ArrayLike) -> tuple[NDArray, NDArray]:
    """Where the ray touches the caustic behind the plate: x and a, each (...).

    s + a = -d cos^3(theta) / (n cos^3(theta_t)), x = (s + a) tan(theta) + d tan(theta_t): where neighbouring rays of landing()
    meet, dx / dtheta = 0. Its cusp is image(); a < 0 is where light only seems to come from. NaN in total reflection.
    """
    tangent = slope(n, theta)
    meets = -np.asarray(thickness) / np.asarray(n, float) * (np.cos(theta) * np.hypot(1, tangent)) ** 3
    behind = meets - np.asarray(distance)
    return landing(n, theta, thickness, distance, behind), behind


def spread(n: ArrayLike, thickness: ArrayLike, widest: ArrayLike, share: ArrayLike = 0.95) -> NDArray:
    """How far from the axis that share of the rays to `widest` lands, at most, where n = -1 has its image: s + a = d.

    The rays are those of a pinhole camera, even in its picture: the share within an angle goes with tan^2(theta). NaN where
    some of the share is totally reflected. n, thickness, widest, share: (...).
    """
    tangent = np.sqrt(share) * np.tan(widest)
    # |x| = d |tan(theta) - |tan(theta_t)|| grows with theta
    return np.abs(landing(-np.abs(n), np.arctan(tangent), thickness, thickness, 0.0))

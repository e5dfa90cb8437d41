# SPDX-License-Identifier: GPL-3.0-or-later
"""A point source over the plane surface of a medium: where its refracted rays land, and the caustic that they touch.

Outside is air or vacuum, n = 1; angles in radians from the normal, arrays broadcast. x grows to the side that a ray leaves the
source to, z into the medium, from the surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def slope(n: ArrayLike, theta: ArrayLike) -> NDArray:
    """tan(theta_t) of the ray in the medium, negative where n is; NaN in total reflection.

    By Snell's law s / (n cos(theta_t)), with s = sin(theta). n, theta: (...).
    """
    n, s = np.asarray(n, float), np.sin(theta)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(n * n > s * s, np.sign(n) * s / np.sqrt(n * n - s * s), np.nan)


def landing(n: ArrayLike, theta: ArrayLike, height: ArrayLike, depth: ArrayLike) -> NDArray:
    """How far from the axis a ray is at a depth z: x = a tan(theta) + z tan(theta_t).

    n, theta, height (a, of the source), depth (z): (...). NaN in total reflection.
    """
    return np.asarray(height) * np.tan(theta) + np.asarray(depth) * slope(n, theta)


def caustic(n: ArrayLike, theta: ArrayLike, height: ArrayLike = 1.0) -> tuple[NDArray, NDArray]:
    """Where the ray touches the caustic: x and z, each (...).

    z = -a n cos^3(theta_t) / cos^3(theta), x = a tan^3(theta) (1 - n^2) / n^2: where neighbouring rays of landing() meet,
    dx / dtheta = 0 (Shendeleva 2008 for negative n; derived here). For n < 0 light does meet there, from a cusp at depth a |n|
    on; for n > 0, with z < 0, it only seems to come from there; n = -1 makes a point of it. NaN in total reflection.
    """
    n, height = np.asarray(n, float), np.asarray(height, float)
    cosine, tangent = np.cos(theta), slope(n, theta)
    z = -height * n / (cosine * np.hypot(1, tangent)) ** 3
    x = height * np.tan(theta) ** 3 * (1 - n * n) / (n * n)
    return np.where(np.isnan(z), np.nan, x), z


def caustic_at(n: float, depth: float, height: float = 1.0) -> float:
    """How far from the axis the caustic is at a depth, 0 or more, of a NIM; NaN where it does not reach there.

    caustic()'s z(theta) = depth, solved for theta; a |n| is where it begins.
    """
    # z goes straight up or down with c^2 = cos^2(theta): (z / (a m))^(2/3) m^2 = (m^2 - 1 + c^2) / c^2
    m2 = n * n
    ratio = (depth / (height * abs(n))) ** (2 / 3) * m2 - 1
    with np.errstate(invalid="ignore", divide="ignore"):
        tangent2 = np.float64(ratio) / (m2 - 1) - 1  # 1 / c^2 - 1
        return float(height * np.sqrt(tangent2) ** 3 * abs(1 - m2) / m2)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour: what a light of one wavelength adds to a picture, how wavelengths are drawn, and how a wavelength is shown.

The observer is CIE 1931 (2 degrees), white is D65, pictures are linear sRGB (IEC 61966-2-1, primaries of ITU-R BT.709).
Tables stand every 5 nm over VISIBLE_NM, with straight lines between.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.shipped import SPECTRA

# x, y of red, green and blue, and of white
_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
_WHITE = (0.3127, 0.3290)
# How much of the density of drawn wavelengths is everywhere the same, beside what is as |w|: measured to be the best
# of pictures of prisms and balls.
_FLOOR = 0.6
# Over how many times the way of 1/e what is left of white light is taken for that of three channels.
WAYS = 3.0
# A curve of Blender's nodes: it keeps a table of so many numbers evenly over [0, 1], and Cycles reads so many from that.
CURVE_POINTS, TABLE_SIZE = 257, 256
_HELD = np.linspace(0, 1, TABLE_SIZE)


def _to_xyz(x: float, y: float) -> NDArray:
    return np.array([x / y, 1, (1 - x - y) / y])


@functools.cache
def _xyz_to_srgb() -> NDArray:
    """The matrix (3, 3) that takes X, Y, Z to linear red, green and blue, white of D65 to (1, 1, 1)."""
    primaries = np.stack([_to_xyz(*primary) for primary in _PRIMARIES], axis=1)
    to_xyz = primaries * np.linalg.solve(primaries, _to_xyz(*_WHITE))
    return np.linalg.inv(to_xyz)


def xyz_to_srgb(xyz: ArrayLike) -> NDArray:
    """Linear sRGB (..., 3), with negative values outside its gamut, of X, Y, Z (..., 3)."""
    return np.asarray(xyz, float) @ _xyz_to_srgb().T


@functools.cache
def _observer() -> tuple[NDArray, NDArray, NDArray]:
    """Wavelengths (N,), nm, colour-matching functions (N, 3), D65 (N,)."""
    rows = np.loadtxt(SPECTRA / "cie-1931.csv", delimiter=",")
    return rows[:, 0], rows[:, 1:4], rows[:, 4]


def colour_matching(wavelength_nm: ArrayLike) -> NDArray:
    """The CIE 1931 functions x, y, z (..., 3) of the 2-degree observer at wavelengths (...), nm; 0 outside VISIBLE_NM."""
    places, matching, _ = _observer()
    return _interpolated(wavelength_nm, places, matching)


def _interpolated(wavelength_nm: ArrayLike, places: NDArray, table: NDArray) -> NDArray:
    """The columns (..., C) of a table (N, C) at wavelengths (...); 0 outside it."""
    wavelength_nm = np.asarray(wavelength_nm, float)
    return np.stack([np.interp(wavelength_nm, places, column, 0, 0) for column in table.T], axis=-1)


@functools.cache
def weights() -> tuple[NDArray, NDArray]:
    """What a wavelength adds to a picture: wavelengths (N,), nm, and weights (N, 3) of linear sRGB, straight between.

    w = M (x, y, z) D65, of wavelengths that are equally likely over VISIBLE_NM, scaled in each channel so that the mean
    of the straight lines is exactly (1, 1, 1): what has no colour stays as it is. Negative in places.
    """
    places, matching, daylight = _observer()
    raw = xyz_to_srgb(matching * daylight[:, None])
    mean = ((raw[1:] + raw[:-1]) / 2).mean(axis=0)  # of the straight lines, which are all 5 nm long
    return _fixed(places), _fixed(raw / mean)


def _fixed(array: NDArray) -> NDArray:
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class Wavelengths:
    """How a uniform number u in [0, 1] becomes a wavelength, and what light of it adds to a picture, as a renderer has it.

    Curves of Blender's nodes are given by CURVE_POINTS points evenly from 0 to 1, of which Cycles keeps TABLE_SIZE, on
    straight lines between. What is returned is what those straight lines give, whose mean weight is exactly (1, 1, 1).

    points_nm: (CURVE_POINTS,) wavelengths, nanometres, rising
    points:    (CURVE_POINTS, 3) weights of linear sRGB
    """

    points_nm: NDArray
    points: NDArray

    @classmethod
    def uniform(cls) -> Wavelengths:
        """All wavelengths of VISIBLE_NM equally likely."""
        return cls._of(np.ones(len(weights()[0])))

    @classmethod
    def by_importance(cls) -> Wavelengths:
        """Wavelengths as likely as what they add to a picture: density as |w_r| + |w_g| + |w_b| + 0.6."""
        return cls._of(np.abs(weights()[1]).sum(axis=1) + _FLOOR)

    @classmethod
    def _of(cls, density: NDArray) -> Wavelengths:
        """density: (N,) at the wavelengths of weights(), straight between, of any scale."""
        places, table = weights()
        nm = np.linspace(places[0], places[-1], 7001)
        p = np.interp(nm, places, density)
        share = np.concatenate([[0.0], np.cumsum((p[1:] + p[:-1]) / 2)])
        points_nm = np.interp(np.linspace(0, 1, CURVE_POINTS), share / share[-1], nm)
        points = _interpolated(points_nm, places, table) / np.interp(points_nm, places, density)[:, None]
        held = as_held(points)
        mean = ((held[1:] + held[:-1]) / 2).mean(axis=0)
        return cls(_fixed(points_nm), _fixed(points / mean))

    def wavelength(self, u: ArrayLike) -> NDArray:
        """The vacuum wavelengths (...), nanometres, of numbers u (...) in [0, 1]."""
        return np.interp(np.asarray(u, float), _HELD, as_held(self.points_nm))

    def weight(self, u: ArrayLike) -> NDArray:
        """What light of numbers u (...) adds to a picture, (..., 3) of linear sRGB; its mean over u is (1, 1, 1)."""
        return _interpolated(u, _HELD, as_held(self.points))

    def noise(self) -> NDArray:
        """The mean squares (3,) of weight() over u: how much noisier, in variance, each channel is than without colour."""
        table = as_held(self.points)
        a, b = table[:-1], table[1:]
        return ((a * a + a * b + b * b) / 3).mean(axis=0)  # of straight lines


def as_held(points: NDArray) -> NDArray:
    """The rows (TABLE_SIZE, ...) that Cycles keeps of the points (CURVE_POINTS, ...) of a curve of Blender's nodes."""
    given = np.linspace(0, 1, CURVE_POINTS)
    if points.ndim == 1:
        return np.interp(_HELD, given, points)
    return np.stack([np.interp(_HELD, given, column) for column in points.T], axis=-1)


def spans_of(wavelengths_nm: ArrayLike) -> NDArray:
    """How many nanometres (N,) each of N wavelengths, rising, stands for: half of the way to either neighbour.

    At the ends as far out as in; of a single one 1.
    """
    steps = np.diff(np.atleast_1d(np.asarray(wavelengths_nm, float)))
    return (np.append(steps[:1], steps) + np.append(steps, steps[-1:])) / 2 if len(steps) else np.ones(1)


def weights_of(wavelengths_nm: ArrayLike) -> NDArray:
    """Weights (N, 3) of N renders of one wavelength each, (N,), rising, whose mean is the picture: scaled to a mean of (1, 1, 1).

    Each stands for the wavelengths nearer to it than to the others. Raises ValueError where the wavelengths, too few or all
    in one place, leave a channel without a positive mean.
    """
    w = _interpolated(wavelengths_nm, *weights()) * spans_of(wavelengths_nm)[:, None]
    mean = w.mean(axis=0)
    if not (mean > 0).all():
        raise ValueError("these wavelengths make no white together; take more, over 400 to 700 nm.")
    return w / mean


def absorption_of_channels(alpha: ArrayLike) -> NDArray:
    """Coefficients (3,) of red, green and blue whose exponentials are nearest to the light that a medium lets through.

    alpha: (N,) absorption coefficients, per metre, at the wavelengths of weights()
    What is left of white light in a channel is no exponential of the way, and may be above 1, or negative, where its colour
    is outside the gamut. Nearest is by the squares of what differs on ways up to WAYS times that of 1/e.
    """
    alpha = np.asarray(alpha, float)
    if np.ptp(alpha) <= 1e-6 * alpha.max():
        return np.full(3, alpha.mean())
    _, w = weights()
    luminance = _observer()[1][:, 1] * _observer()[2]
    usual = max(luminance @ alpha / luminance.sum(), 1e-3 * alpha.max())
    ways = np.linspace(0, WAYS, 65) / usual
    seen = w * np.exp(-ways[:, None, None] * alpha[:, None])
    left = ((seen[:, 1:] + seen[:, :-1]) / 2).mean(axis=1)
    return np.array([_nearest(ways, column, alpha.max()) for column in left.T])


def _nearest(ways: NDArray, left: NDArray, most: float) -> float:
    """The coefficient in [0, 2 most] whose exponential is nearest to values (K,) on ways (K,)."""
    low, high, steps = 0.0, 2 * most, np.linspace(0, 1, 101)
    for _ in range(4):
        tried = low + steps * (high - low)
        best = np.argmin(np.square(np.exp(-tried[:, None] * ways) - left).sum(axis=1))
        low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    return float(tried[best])


@functools.cache
def _primaries() -> tuple[NDArray, NDArray]:
    """Wavelengths (N,), nm, and the spectra (N, 3) of red, green and blue."""
    rows = np.loadtxt(SPECTRA / "srgb-basis.csv", delimiter=",")
    return rows[:, 0], rows[:, 1:]


def shares_of(wavelength_nm: ArrayLike) -> NDArray:
    """How much red, green and blue (..., 3) make of the light of wavelengths (...), nm, beside white's: they sum to 1.

    A colour r, g, b of linear sRGB is the spectrum r s_r + g s_g + b s_b under daylight, grey the same everywhere (Mallett
    and Yuksel 2019, Spectral Primary Decomposition for Rendering with sRGB Reflectance); 0 outside VISIBLE_NM.
    """
    return _interpolated(wavelength_nm, *_primaries())


def daylight(wavelength_nm: ArrayLike) -> NDArray:
    """White, D65, at wavelengths (...), nm: per nm, and of luminance 1, which is its integral with y; 0 outside VISIBLE_NM."""
    places, matching, power = _observer()
    seen = matching[:, 1] * power
    luminance = np.diff(places) @ (seen[1:] + seen[:-1]) / 2
    return np.interp(np.asarray(wavelength_nm, float), places, power, 0, 0) / luminance


def into_gamut(rgb: ArrayLike) -> NDArray:
    """Linear sRGB (..., 3) without negative values: mixed with grey of the same luminance as far as needed, for display.

    Where luminance itself is not above 0 it is black. Colours that have no negative value stay as they are.
    """
    rgb = np.asarray(rgb, float)
    luminance = np.maximum(rgb @ np.linalg.inv(_xyz_to_srgb())[1], 0)[..., None]
    least = np.minimum(rgb.min(axis=-1, keepdims=True), 0)
    kept = luminance / np.where(luminance > least, luminance - least, 1)  # the share of the colour; 1 where least is 0
    mixed = np.maximum(luminance + kept * (rgb - luminance), 0)
    return np.where(least < 0, np.where(luminance > 0, mixed, 0), rgb)


def of_wavelength(wavelength_nm: ArrayLike) -> NDArray:
    """The linear sRGB (..., 3), in [0, 1], that stands for light of wavelengths (...), nm, in a drawing.

    Of the light's hue, as saturated as the gamut allows, and as bright as the screen can show it; black outside
    VISIBLE_NM.
    """
    rgb = into_gamut(xyz_to_srgb(colour_matching(wavelength_nm)))
    brightest = rgb.max(axis=-1, keepdims=True)
    return rgb / np.where(brightest > 0, brightest, 1)


def encoded(linear: ArrayLike) -> NDArray:
    """The values of sRGB (...), in [0, 1], that files and screens take, of linear ones (...); clipped to [0, 1]."""
    linear = np.clip(np.asarray(linear, float), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced rays as coloured lines over a view, and what is to be read at one of them: numbers only, nothing of Blender."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics import Interface, colour
from ..physics.dispersion import REPRESENTATIVE_NM
from ..physics.laws import Law
from ..physics.rays import Fate, Kind, Paths
from .light_curves import COLORS, THINNING

# Where a medium disperses: nanometres.
WAVELENGTHS_NM = (440.0, 490.0, 540.0, 590.0, 650.0)
WIDEST = 3.0  # of a line with all its energy, pixels
FAINTEST = 0.2  # the least opacity
WHITE = (1.0, 0.95, 0.85)  # of light that is not split into wavelengths yet
# Linear colours from the least energy to all of it, evenly in its logarithm.
RAMP = ((0.1, 0.2, 1.0), (0.6, 0.05, 0.7), (1.0, 0.12, 0.05), (1.0, 0.65, 0.1), (1.0, 1.0, 0.9))
LEAST = 1e-3  # what the ramp begins with
FLAT = 0.05  # of the second extent of rays: what is less across that lies in a plane
STRAIGHT = 1e-3  # of the first: what is less beside it lies in a line


class Traced(NamedTuple):
    """Paths of rays, first of one wavelength, nanometres, then the same rays of the next, through those interfaces or laws.

    wavelengths_nm: empty where they are of any wavelength
    """

    paths: Paths
    interfaces: Sequence[Interface | Law]
    wavelengths_nm: Sequence[float] = ()

    @property
    def number(self) -> NDArray:
        """(S,) which of the wavelengths each segment has."""
        rays = max(1, len(self.paths.lost) // max(1, len(self.wavelengths_nm)))
        return self.paths.ray // rays


class Lines(NamedTuple):
    """S lines over a view.

    ends:   (S, 2, 3) float32
    colors: (S, 2, 4) float32, linear, with opacity
    widths: (S,) float32, pixels
    source: (S, 2) which Traced a line is of, and which of its segments
    """

    ends: NDArray
    colors: NDArray
    widths: NDArray
    source: NDArray


def lines(traced: Sequence[Traced], color: str) -> Lines:
    """The lines of all of them, the weakest first; color: of light_settings.COLORS.

    Light that is split into wavelengths is one white line as it leaves its source.
    """
    columns = [_lines(number, one, color) for number, one in enumerate(traced)]
    if not columns:
        return Lines(np.zeros((0, 2, 3), "f"), np.zeros((0, 2, 4), "f"), np.zeros(0, "f"), np.zeros((0, 2), int))
    ends, colors, widths, source = (np.concatenate(column) for column in zip(*columns, strict=True))
    order = np.argsort(widths, kind="stable")
    return Lines(ends[order].astype("f"), colors[order].astype("f"), widths[order].astype("f"), source[order])


def _lines(number, one, color):
    paths = one.paths
    energy = np.stack([paths.energy, paths.arriving], axis=1)
    strength = energy**THINNING
    if color == "ENERGY":
        rgb = _of_energy(energy)
    elif color == "WAVELENGTH" and len(one.wavelengths_nm):
        rgb = colour.of_wavelength(np.array(one.wavelengths_nm))[one.number]
        rgb = np.repeat(np.where((paths.depth == 0)[:, None], WHITE, rgb)[:, None], 2, axis=1)
    else:
        table = np.array([COLORS[kind] for kind in Kind])
        rgb = np.repeat(table[paths.kind][:, None], 2, axis=1)
    rgba = np.concatenate([rgb, np.maximum(strength, FAINTEST)[..., None]], axis=-1)
    ends = np.stack([paths.start, paths.end], axis=1)
    source = np.stack([np.full(len(energy), number), np.arange(len(energy))], axis=1)
    # what all wavelengths share is one line
    shown = (paths.depth > 0) | (one.number == 0)
    widths = np.maximum(1.0, np.round(WIDEST * strength[:, 0]))
    return ends[shown], rgba[shown], widths[shown], source[shown]


def _of_energy(energy):
    """(..., 3) the colours of energies (...)."""
    place = 1 - np.log(np.clip(energy, LEAST, 1)) / np.log(LEAST)
    steps = np.linspace(0, 1, len(RAMP))
    return np.stack([np.interp(place, steps, channel) for channel in np.transpose(RAMP)], axis=-1)


class Quads(NamedTuple):
    """Lines as what a GPU draws them of, a quad each, all of them at once.

    content:   {attribute of a vertex (4 S,): float32}: the two ends of its line, its colour, linear, with opacity, and `place`:
               at which end it is, 0 or 1, and the line's width, pixels, negative on the other side of the line
    triangles: (2 S, 3) int32 indices of vertices
    """

    content: dict[str, NDArray]
    triangles: NDArray


def quads(drawn: Lines) -> Quads:
    """The quads of lines, in their order."""
    count = len(drawn.ends)
    first, second = (np.repeat(drawn.ends[:, end], 4, axis=0) for end in (0, 1))
    place = np.empty((count, 4, 2), "f")
    place[:, :, 0] = 0, 0, 1, 1
    place[:, :, 1] = drawn.widths[:, None] * np.array((1, -1, 1, -1), "f")
    content = {
        "first": first,
        "second": second,
        "color": np.repeat(drawn.colors, 2, axis=1).reshape(-1, 4),
        "place": place.reshape(-1, 2),
    }
    corners = 4 * np.arange(count, dtype=np.int32)[:, None] + np.array((0, 1, 2, 2, 1, 3), np.int32)
    return Quads(content, corners.reshape(-1, 3))


class Lie(NamedTuple):
    """How rays lie in the scene.

    middle: (3,) of all their ends
    axis:   (3,) along which they are longest
    normal: (3,) of the plane that they are in, None where they are in none, or in one line
    points: (N, 3) their ends
    """

    middle: NDArray
    axis: NDArray
    normal: NDArray | None
    points: NDArray


def lie_of(drawn: Lines) -> Lie | None:
    """How the rays lie that are drawn by those lines; None of none."""
    points = drawn.ends.reshape(-1, 3).astype(float)
    if not len(points):
        return None
    squares, axes = np.linalg.eigh(np.cov(points.T))  # the least first
    third, second, first = np.sqrt(np.maximum(squares, 0))
    normal = axes[:, 0] if second > STRAIGHT * first and third < FLAT * second else None
    return Lie((points.min(axis=0) + points.max(axis=0)) / 2, axes[:, 2], normal, points)


# ---------------------------------------------------------------- at the mouse


def nearest(
    drawn: Lines, matrix: NDArray, size: tuple[float, float], place: tuple[float, float], reach: float
) -> int | None:
    """The line that passes nearest to a place of a region, no more than `reach` away, all in pixels; None if none does.

    matrix: (4, 4) from the world to clip space; size: of the region, width and height
    """
    corners = np.concatenate([drawn.ends, np.ones((len(drawn.ends), 2, 1))], axis=-1) @ np.asarray(matrix, float).T
    depth = corners[..., 3]
    # a line that comes from behind the eye begins just before it
    near = 1e-6 * np.max(np.abs(depth), initial=0.0) + 1e-12
    seen = depth.max(axis=1, initial=-np.inf) > near
    a, b = corners[:, 0], corners[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = ((near - a[:, 3]) / (b[:, 3] - a[:, 3]))[:, None]
    crossing = a + np.where(np.isfinite(share), share, 0) * (b - a)
    a, b = (np.where((end[:, 3] < near)[:, None], crossing, end) for end in (a, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = ((end[:, :2] / end[:, 3:] + 1) / 2 * size for end in (a, b))
    along, to = b - a, place - a
    length = np.sum(along * along, axis=1)
    part = np.clip(np.sum(to * along, axis=1) / np.where(length > 0, length, 1), 0, 1)
    away = np.linalg.norm(to - part[:, None] * along, axis=1)
    away = np.where(seen & np.isfinite(away), away, np.inf)
    # where lines lie on each other the strongest, which is the last of them
    within = np.flatnonzero(away <= np.min(away, initial=np.inf) + 0.5)
    return int(within[-1]) if len(within) and away[within[-1]] <= reach else None


class Reading(NamedTuple):
    """What is to be read at a segment: of what it runs in, and of the surface that it ends at.

    n, energy, wavelength_nm: of the segment; energy as a share of its ray's, at its end
    n_t, theta_i, theta_t, R: of the interface there, radians; None where it ends at none; theta_t is None in total reflection
    """

    n: float
    energy: float
    wavelength_nm: float
    n_t: float | None = None
    theta_i: float | None = None
    theta_t: float | None = None
    R: float | None = None


def reading(one: Traced, segment: int) -> Reading:
    """What is to be read at a segment of what was traced."""
    paths = one.paths
    nm = one.wavelengths_nm[one.number[segment]] if len(one.wavelengths_nm) else REPRESENTATIVE_NM
    plain = Reading(float(paths.n[segment]), float(paths.arriving[segment]), nm)
    which = int(paths.which[segment])
    interface = one.interfaces[which] if which >= 0 and paths.fate[segment] != Fate.LANDED else None
    if not isinstance(interface, Interface):
        return plain
    along = paths.end[segment] - paths.start[segment]
    cosine = float(along @ paths.normal[segment] / np.linalg.norm(along))
    seen = interface.at(nm)
    seen = seen.reversed() if cosine > 0 else seen
    cosine = min(abs(cosine), 1.0)
    theta_i = float(np.arccos(cosine))
    theta_t = float(seen.theta_t(theta_i))
    return plain._replace(
        n=seen.outside.n,
        n_t=seen.inside.n,
        theta_i=theta_i,
        theta_t=None if np.isnan(theta_t) else theta_t,
        R=float(seen.fresnel(cosine).R),
    )

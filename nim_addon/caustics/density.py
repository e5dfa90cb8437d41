# SPDX-License-Identifier: GPL-3.0-or-later
"""Density of photons: from where each landed to power per area, in a texture for each object."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import atlas
from .photons import Landed

# Least share of all landed photons for which a side of a chart gets a part of a texture.
LEAST_SHARE = 1e-4
PADDING = 4  # texels around a window
# Some light is thrown far out. Windows lie within one another, each for this share of the photons at either edge of the next,
# as far as it is so many times smaller.
LEVELS, QUANTILES, SMALLER = 3, (0.05, 0.005, 0.0), 8
FINEST = 0.75  # of a texture, for the finest windows
SMALLEST = 64  # edge of a texture
ROOM = 8  # of the largest texture's size, for all of them together: a thousand tiles lit alike would else take 60 GB
ENOUGH = 32  # photons that make a kernel wide enough
ENOUGH_COLOURED = (
    128  # of those that have wavelengths, whose colours have four times the variance (colour.Wavelengths.noise)
)
RADII = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)  # of kernels, in texels


class Window:
    """The part of a side of a chart where photons land, and where it lies in its texture.

    low:   (2,) corner in metres
    texel: edge of a texel, metres
    cells: (2,) texels across and up
    at:    (2,) texel of the texture where it begins; (0, 0) until it is laid out
    """

    def __init__(self, low: ArrayLike, texel: float, cells: ArrayLike, at: ArrayLike = (0, 0)):
        self.low, self.texel, self.cells, self.at = np.array(low), texel, np.array(cells), np.array(at)

    @classmethod
    def around(cls, low: NDArray, high: NDArray, texel: float) -> Window:
        """The Window for a rectangle from `low` to `high`, (2,) each in metres, with PADDING about it."""
        cells = np.ceil((high - low) / texel).astype(int) + 2 * PADDING
        return cls(low - PADDING * texel, texel, cells)

    def plain(self) -> list:
        """What makes the same Window again, JSON-ready."""
        return [self.low.tolist(), float(self.texel), self.cells.tolist(), self.at.tolist()]


class Texture:
    """A texture of one object.

    windows: {key: Window}; a key is LEVELS times the side (photons.Landed) plus the level, 0 for the finest
    shape:   (height, width) in texels
    first:   number of its first texel among those of all textures
    """

    def __init__(self, windows: dict[int, Window], shape: tuple[int, int], first: int):
        self.windows, self.shape, self.first = windows, shape, first

    @property
    def size(self) -> int:
        """Texels."""
        return self.shape[0] * self.shape[1]


class Density:
    """What landed, in each half of the passes, texel by texel: memory depends on the textures, not on the photons.

    parts, charts: of a photons.Tracer
    textures: of layout()
    color: (3,) of all the light, or None where it has several; then three numbers a texel are kept, not one
    flux:  (2, channels, texels of all textures) power that landed so far in each half, float32; None for none
    count: (2, texels of all textures) photons that did, float32; None for none
    """

    def __init__(
        self,
        parts: Sequence[atlas.Part],
        charts: Sequence[atlas.Chart],
        textures: Mapping[str, Texture],
        color: tuple[float, ...] | None = None,
        flux: NDArray | None = None,
        count: NDArray | None = None,
    ):
        self.parts, self.charts, self.textures, self.color = parts, charts, textures, color
        total = sum(texture.size for texture in self.textures.values())
        self.flux = np.zeros((2, 3 if color is None else 1, total), np.float32) if flux is None else flux
        self.count = np.zeros((2, total), np.float32) if count is None else count
        keys = LEVELS * (2 * len(charts))
        self._low, self._cells, self._at = np.zeros((keys, 2)), np.zeros((keys, 2), int), np.zeros((keys, 2), int)
        self._texel, self._first, self._width = np.ones(keys), np.zeros(keys, int), np.zeros(keys, int)
        for texture in self.textures.values():
            for key, window in texture.windows.items():
                self._low[key], self._cells[key], self._at[key] = window.low, window.cells, window.at
                self._texel[key], self._first[key], self._width[key] = window.texel, texture.first, texture.shape[1]

    def add(self, landed: Landed, half: int) -> None:
        """Count a pass of photons.Landed in one half of the passes, 0 or 1."""
        power = landed.power * landed.share[:, None]
        left = np.arange(len(landed.side))
        for level in range(LEVELS):
            key = LEVELS * landed.side[left] + level
            cell = np.floor((landed.place[left] - self._low[key]) / self._texel[key, None]).astype(int)
            here = np.all((cell >= 0) & (cell < self._cells[key]), axis=1)
            self._count(half, key[here], cell[here], power[left[here]])
            left = left[~here]

    def _count(self, half, key, cell, power):
        column, row = (cell + self._at[key]).T
        index = self._first[key] + row * self._width[key] + column
        np.add.at(self.count[half], index, np.float32(1))
        if self.color is not None:
            strongest = int(np.argmax(self.color))
            power = power[:, strongest : strongest + 1] / self.color[strongest]
        for channel, values in enumerate(power.T):
            np.add.at(self.flux[half, channel], index, values.astype(np.float32))

    def state(self) -> dict:
        """Arrays and texts by name, from which from_state() makes the keywords for the same Density again."""
        plain = {
            name: [texture.shape, texture.first, {key: window.plain() for key, window in texture.windows.items()}]
            for name, texture in self.textures.items()
        }
        return {"flux": self.flux, "count": self.count, "layout": json.dumps([plain, self.color])}

    @staticmethod
    def from_state(state: Mapping) -> dict:
        """Keywords of Density, of what state() gave; raises KeyError or ValueError where it did not."""
        plain, color = json.loads(str(state["layout"]))
        textures = {
            name: Texture({int(key): Window(*values) for key, values in windows.items()}, tuple(shape), first)
            for name, (shape, first, windows) in plain.items()
        }
        return {"textures": textures, "color": color and tuple(color), "flux": state["flux"], "count": state["count"]}

    def power(self, passes: int) -> dict[str, float]:
        """All that landed after so many passes, {name of the object: the sum of its colours, W where lights have watts}."""
        by_color = 1 if self.color is None else sum(self.color)
        return {
            name: float(self.flux[:, :, texture.first : texture.first + texture.size].sum(dtype=float))
            * by_color
            / passes
            for name, texture in self.textures.items()
        }

    def irradiance(self, name: str, passes: int) -> NDArray:
        """(H, W, 3) power per m^2 on an object after `passes`: each photon's power spread over a box about it.

        The box is as wide as it takes to hold ENOUGH photons, so that a sharp line stays sharp and a dim place smooth, and
        bright light does not leak into a dark place beside it (a variable kernel at the sample points: Breiman, Meisel and
        Purcell 1977; the density estimate of a photon map, Jensen 1996, asks at the texels instead, and does leak). The
        photons of one half of the passes choose the width for those of the other: chosen by its own, an estimate is biased.
        What a box holds is shared out over the surface in it: nothing is lost where the surface or its chart ends.
        """
        texture = self.textures[name]
        span = slice(texture.first, texture.first + texture.size)
        answer = np.zeros((*texture.shape, self.flux.shape[1]))
        areas = {}
        for key, window in sorted(texture.windows.items()):
            rows = slice(window.at[1], window.at[1] + window.cells[1])
            columns = slice(window.at[0], window.at[0] + window.cells[0])
            chart = key // LEVELS // 2
            area = atlas.area(self.parts, self.charts[chart], chart, window.low, window.texel, window.cells)
            for finer in range(key - key % LEVELS, key):
                if finer in areas:
                    _cut(area, window, areas[finer], texture.windows[finer])
            areas[key] = area
            for half in (0, 1):
                flux = np.moveaxis(self.flux[half, :, span].reshape(-1, *texture.shape)[:, rows, columns], 0, -1)
                others = self.count[1 - half, span].reshape(texture.shape)[rows, columns]
                answer[rows, columns] += spread(flux.astype(float), others, area)
        return answer / passes * (1.0 if self.color is None else np.asarray(self.color))


def layout(charts: Sequence[atlas.Chart], sample: Landed, texels: float) -> dict[str, Texture]:
    """A Texture for each object, by its name, with windows for the sides of charts where photons landed.

    sample: of a first try
    texels: edge of the largest texture, that of the object where most landed, or less where many are lit alike (ROOM)
    """
    count = np.bincount(sample.side, minlength=1)
    order = np.argsort(sample.side, kind="stable")
    ends = np.cumsum(count)
    shares, boxes = {}, {}
    for side in np.flatnonzero(count > LEAST_SHARE * len(sample.side)):
        chart = charts[side // 2]
        shares[chart.name] = shares.get(chart.name, 0) + count[side]
        spots = sample.place[order[ends[side] - count[side] : ends[side]]]
        boxes.setdefault(chart.name, {})[int(side)] = _nested(spots, chart)
    textures, first = {}, 0
    texels *= min(1.0, float(np.sqrt(ROOM * max(shares.values(), default=1) / max(sum(shares.values()), 1))))
    for name, nests in sorted(boxes.items()):
        # as many texels a photon as where most of them land
        edge = round(texels * np.sqrt(shares[name] / max(shares.values())))
        windows, shape = _packed(nests, edge)
        textures[name] = Texture(windows, shape, first)
        first += textures[name].size
    return textures


def _packed(nests, edge):
    """Windows by their key for the boxes of _nested() by their side, in a texture of that edge or the least; its shape."""
    edge = max(SMALLEST, int(np.ceil(np.sqrt(sum(map(len, nests.values()))) * (2 * PADDING + 4))), edge)
    deepest = max(map(len, nests.values()))
    grown = 1.0
    while True:
        windows = {}
        for level in range(deepest):
            boxes = {side: nest[level] for side, nest in nests.items() if level < len(nest)}
            part = 1.0 if deepest == 1 else FINEST if level == 0 else (1 - FINEST) / (deepest - 1)
            area = sum(float(np.prod(high - low)) for low, high in boxes.values())
            texel = max(np.sqrt(area / part) / edge, 1e-6) * grown
            for side, (low, high) in boxes.items():
                windows[LEVELS * side + level] = Window.around(low, high, texel)
        height = _shelve(windows.values(), edge)
        if height <= edge:
            return windows, (int(height), int(edge))
        grown *= 1.1


def _nested(spots, chart):
    """Corners (low, high) of the windows for photons that landed at `spots` (N, 2), the smallest first."""
    nest = []
    for share in QUANTILES[::-1]:
        low, high = np.quantile(spots, share, axis=0), np.quantile(spots, 1 - share, axis=0)
        margin = 0.05 * (high - low).max() + 1e-4
        low, high = np.maximum(low - margin, chart.low), np.minimum(high + margin, chart.high)
        if not nest or np.prod(high - low) * SMALLER < np.prod(nest[0][1] - nest[0][0]):
            nest.insert(0, (low, high))
    return nest


def _cut(area, window, finer_area, finer):
    """Take from a window's `area` (H, W) what lies in a finer one."""
    low = (finer.low - window.low) / window.texel
    step = finer.texel / window.texel
    column, row = (np.floor(low[axis] + (np.arange(finer.cells[axis]) + 0.5) * step).astype(int) for axis in (0, 1))
    inside = ((row >= 0) & (row < area.shape[0]))[:, None] & ((column >= 0) & (column < area.shape[1]))
    index = (np.clip(row, 0, area.shape[0] - 1)[:, None] * area.shape[1] + np.clip(column, 0, area.shape[1] - 1))[
        inside
    ]
    area -= np.bincount(index, finer_area[inside], area.size).reshape(area.shape)
    np.maximum(area, 0, out=area)


def _shelve(windows, width):
    """Lay windows on shelves, the highest first; returns the height they take, infinite where one is too wide."""
    left = top = shelf = 0
    for window in sorted(windows, key=lambda window: -window.cells[1]):
        if window.cells[0] > width:
            return np.inf
        if left + window.cells[0] > width:
            left, top, shelf = 0, top + shelf, 0
        window.at = np.array([left, top])
        left += window.cells[0]
        shelf = max(shelf, window.cells[1])
    return top + shelf


def spread(flux: NDArray, others: NDArray, area: NDArray) -> NDArray:
    """Power per m^2 (H, W, C): that of each cell shared out over the surface in a box about it (Density.irradiance).

    flux:   (H, W, C) power that landed in each cell
    others: (H, W) photons of the other half of the passes, of which a box must hold ENOUGH
    area:   (H, W) surface in each cell, m^2
    """
    counts, ground = _table(others), _table(area)
    height, width = area.shape
    y, x = np.nonzero((flux != 0).any(axis=2))
    coloured = bool((flux < 0).any())  # no colour of a screen is that of one wavelength
    needed = ENOUGH_COLOURED if coloured else ENOUGH

    def corners(radius: Any, some: Any = slice(None)) -> tuple:
        """Flat places in a table of the corners of the boxes about some of the texels, cut off at the edges."""
        low_y, high_y = np.maximum(y[some] - radius, 0), np.minimum(y[some] + radius + 1, height)
        low_x, high_x = np.maximum(x[some] - radius, 0), np.minimum(x[some] + radius + 1, width)
        low_y, high_y = low_y * (width + 1), high_y * (width + 1)
        return low_y + low_x, high_y + high_x, low_y + high_x, high_y + low_x

    def held(table, places):
        a, b, c, d = (table.ravel()[place] for place in places)
        return a + b - c - d

    reach, surface, left = np.full(len(y), RADII[-1]), np.zeros(len(y)), np.arange(len(y))
    for radius in RADII:
        places = corners(radius, left)
        # a photon on a cell that holds no surface, at its very edge, lands on the nearest
        around = held(ground, places)
        enough = around > 0
        if radius < RADII[-1]:
            enough &= held(counts, places) >= needed
        reach[left[enough]], surface[left[enough]] = radius, around[enough]
        left = left[~enough]
        if not len(left):
            break
    share = np.divide(1.0, surface, out=np.zeros_like(surface), where=surface > 0)
    answer = np.empty_like(flux)
    places = corners(reach)
    for channel in range(flux.shape[2]):
        power = flux[y, x, channel] * share
        # each box is four corners of a table of differences, which is summed up once for all of them
        change = sum(
            sign * np.bincount(place, power, counts.size) for sign, place in zip((1, 1, -1, -1), places, strict=True)
        )
        change = change.reshape(counts.shape)[:-1, :-1]
        answer[..., channel] = change.cumsum(axis=0).cumsum(axis=1)
    return (answer if coloured else np.maximum(answer, 0)) * (area > 0)[..., None]


def _table(values):
    return np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)

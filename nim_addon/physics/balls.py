# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded balls as rays meet them: the law of a surface that is a sphere, whatever facets stand for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import graded
from .graded import Profile
from .laws import Branch

POINTS = 65  # of the way through a ball


@dataclass(frozen=True, eq=False)
class Ball:
    """A graded ball around `center` (3,), of any radius, as laws.Law: rays that come from within pass straight on."""

    profile: Profile
    center: ArrayLike
    radius: float = 1.0

    def branches(self, points: NDArray, directions: NDArray, normals: NDArray) -> Sequence[Branch]:
        """As laws.Law.branches: through the ball, and straight past it; what ends on a core is absorbed."""
        center = np.asarray(self.center, float)
        at = (points - center) / self.radius
        from_inside = np.sum(directions * normals, axis=1) > 0
        carried = graded.carry(self.profile, at, directions)
        # facets may lie beside the sphere
        beside = from_inside | (np.linalg.norm(np.cross(at, directions), axis=1) >= 1)
        comes_out = np.isfinite(carried.points).all(axis=1) & ~beside
        way = np.repeat(points[:, None], POINTS, axis=1)
        for row in np.flatnonzero(comes_out):
            way[row] = center + self.radius * _evenly(graded.path(self.profile, at[row], directions[row]))
        way[:, 0] = points  # of a facet
        start = np.where(comes_out[:, None], center + self.radius * carried.points, points)
        out = np.where(comes_out[:, None], carried.directions, directions)
        return [
            Branch(comes_out * 1.0, start, out, way),
            Branch(beside * 1.0, points, directions),
        ]


def _evenly(points: NDArray) -> NDArray:
    """(POINTS, 3) on the line through points (N, 3), evenly."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    places = np.linspace(0, along[-1], POINTS)
    return np.stack([np.interp(places, along, column) for column in points.T], axis=-1)

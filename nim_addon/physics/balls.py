# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded balls and shells as rays meet them: laws of a surface that is a sphere, whatever facets stand for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import graded
from .graded import Profile
from .laws import Branch

POINTS = 65  # of the way through a ball
_BEFORE = 1e-4  # of the radius
_BESIDE = 1e-3  # of the core's radius: rays from farther off do not come from it


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
        through = graded.paths(self.profile, at[comes_out], directions[comes_out], POINTS)
        way[comes_out] = center + self.radius * through
        way[:, 0] = points  # of a facet
        start = np.where(comes_out[:, None], center + self.radius * carried.points, points)
        out = np.where(comes_out[:, None], carried.directions, directions)
        return [
            Branch(comes_out * 1.0, start, out, way),
            Branch(beside * 1.0, points, directions),
        ]


@dataclass(frozen=True, eq=False)
class Shell:
    """A graded shell around a core that is a surface of its own, as laws.Law: the profile's core is textured.

    Rays from outside are put onto the core where they come to it; those that come from the core leave the shell, or fall back.
    """

    profile: Profile
    center: ArrayLike
    radius: float = 1.0

    def branches(self, points: NDArray, directions: NDArray, normals: NDArray) -> Sequence[Branch]:
        """As laws.Law.branches: to the core, or out of the shell; and straight on of rays that come from elsewhere."""
        core, center = self.profile.core or 0.0, np.asarray(self.center, float)
        index = self.profile.index(np.array([core]))[0]
        at = (points - center) / self.radius
        leaving = np.sum(directions * normals, axis=1, keepdims=True) > 0
        foot = at - np.sum(at * directions, axis=1, keepdims=True) * directions
        away = np.linalg.norm(foot, axis=1, keepdims=True)
        s = away / np.where(leaving, core, 1.0)  # sine of the angle to the radius where it comes from
        straight = s >= np.where(leaving, 1 + _BESIDE, 1.0)
        s = np.minimum(s, 1.0)
        c, side = np.sqrt((1 - s) * (1 + s)), np.where(leaving, -1.0, 1.0)
        f = foot / np.maximum(away, 1e-300)
        out, along = s * f - side * c * directions, side * c * f + s * directions
        angle, lands = self._round(s, leaving, index)
        x, t = np.cos(angle) * out + np.sin(angle) * along, np.cos(angle) * along - np.sin(angle) * out
        across = np.where(lands == leaving, s, np.where(leaving, s * index * core, s / (index * core)))
        radial = np.sqrt(np.maximum((1 - across) * (1 + across), 0))
        direction = np.where(straight, directions, np.where(lands, -radial, radial) * x + across * t)
        # before the core, which is to be met
        place = np.where(lands, core * x - _BEFORE * direction, x)
        start = np.where(straight, points, center + self.radius * place)
        way = np.repeat(points[:, None], POINTS, axis=1)
        rows = np.flatnonzero(~straight & ~leaving)
        way[rows] = center + self.radius * graded.paths(self.profile, at[rows], directions[rows], POINTS)
        rows = np.flatnonzero(~straight & leaving)  # of which no path is known
        corners = np.stack([at[rows], core * out[rows], (start[rows] - center) / self.radius], axis=1)
        way[rows] = center + self.radius * graded.evenly(corners, POINTS)
        way[:, 0], way[:, -1] = points, start
        jumps = ~straight[:, 0] * 1.0
        return [Branch(jumps, start, direction, way), Branch(1 - jumps, points, directions)]

    def _round(self, s: NDArray, leaving: NDArray, index: float) -> tuple[NDArray, NDArray]:
        """By which angles rays go round in the sense of their ways, and whether they come to the core, (N, 1)."""
        landing = graded.landing(self.profile, s)
        onwards, leaves = graded.leaving(self.profile, s)
        inwards = np.where(landing.reached, landing.angle, graded.sweep(self.profile, s))
        return (
            np.where(leaving, np.sign(index) * onwards, inwards),  # in a NIM light goes round against the sense of p
            np.where(leaving, ~leaves, landing.reached),
        )

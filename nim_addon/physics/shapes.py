# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that rays meet: spheres, planes, cylinders, solids of flat faces, and several of them as one.

The `interface` of each says what it does to rays: an Interface, another Law, or None where it stops them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .interface import Interface, unit
from .laws import Law


class Hit(NamedTuple):
    """Where N rays meet a surface first.

    distance: (N,) along the unit direction, inf where there is nothing
    normal:   (N, 3) unit normals into `outside`; the sign of direction . normal tells the side a ray comes from
    which:    (N,) index into the surfaces' `interfaces`, -1 where the surface is opaque
    """

    distance: NDArray
    normal: NDArray
    which: NDArray


def _dot(a: NDArray, b: NDArray) -> NDArray:
    return np.sum(a * b, axis=-1)


def _first(roots: NDArray) -> NDArray:
    """The smallest of the distances (K, N) that lies ahead, inf where none does."""
    with np.errstate(invalid="ignore"):
        return np.min(np.where(roots > 0, roots, np.inf), axis=0)


def _roots(away: NDArray, along: NDArray, radius: float, square: NDArray | float = 1.0) -> NDArray:
    """Distances (2, N), in order, at which away + distance * along, each (N, 3), is of length `radius`; NaN where never.

    square: (N,) of the lengths of `along`
    """
    b = _dot(away, along) / square
    # where it is nearest, by the vector and not by |away|^2 - b^2, which cancels far away
    nearest = away - b[:, None] * along
    half = np.sqrt((np.square(radius) - _dot(nearest, nearest)) / square)
    return np.stack([-b - half, -b + half])


@dataclass(frozen=True)
class Sphere:
    """A sphere whose normals point away from `center`; opaque where `interface` is None."""

    center: ArrayLike
    radius: float
    interface: Interface | Law | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """Distances (N,), inf where there is nothing, and normals (N, 3) of rays from o (N, 3) along unit d (N, 3)."""
        away = o - np.asarray(self.center, float)
        with np.errstate(invalid="ignore"):
            distance = _first(_roots(away, d, self.radius))
        reached = np.where(np.isfinite(distance), distance, 0)[:, None]
        return distance, (away + reached * d) / self.radius


@dataclass(frozen=True)
class Plane:
    """A plane without end through `point`, its normal of any length; opaque where `interface` is None."""

    point: ArrayLike
    normal: ArrayLike
    interface: Interface | Law | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        normal = unit(self.normal)
        along = _dot(d, normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = _first(_dot(np.asarray(self.point, float) - o, normal)[None] / along)
        return distance, np.broadcast_to(normal, o.shape)


@dataclass(frozen=True)
class Cylinder:
    """The wall of a cylinder from `start` to `end`, without its caps; normals point away from the axis."""

    start: ArrayLike
    end: ArrayLike
    radius: float
    interface: Interface | Law | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        start, end = np.asarray(self.start, float), np.asarray(self.end, float)
        axis = unit(end - start)
        # across the axis it is a circle
        away = (o - start) - _dot(o - start, axis)[:, None] * axis
        across = d - _dot(d, axis)[:, None] * axis
        with np.errstate(divide="ignore", invalid="ignore"):
            roots = _roots(away, across, self.radius, _dot(across, across))
            height = _dot(o - start, axis) + roots * _dot(d, axis)
        distance = _first(np.where((height >= 0) & (height <= np.linalg.norm(end - start)), roots, np.inf))
        reached = np.where(np.isfinite(distance), distance, 0)[:, None]
        return distance, (away + reached * across) / self.radius


@dataclass(frozen=True)
class Convex:
    """A solid with flat faces and no hollow, each face by a point on it and its normal, of any length, outwards."""

    points: ArrayLike
    normals: ArrayLike
    interface: Interface | Law | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        normals = unit(self.normals)
        along = d @ normals.T
        gap = np.sum(np.asarray(self.points, float) * normals, axis=1) - o @ normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = gap / along
        # A line is inside the solid from the last of the planes that it enters by (their normals are against it) to the
        # first of those it leaves by; if it leaves before it has entered, it passes by, as it does beside a parallel plane.
        entries = np.where(along < 0, distances, -np.inf)
        exits = np.where(along > 0, distances, np.inf)
        first, last = np.max(entries, axis=1), np.min(exits, axis=1)
        beside = np.any((along == 0) & (gap < 0), axis=1)
        meets = (first < last) & (last > 0) & ~beside
        enters = first > 0
        face = np.where(enters, np.argmax(entries, axis=1), np.argmin(exits, axis=1))
        return np.where(meets, np.where(enters, first, last), np.inf), normals[face]


class Shape(Protocol):
    """One of the Shapes; opaque where `interface` is None."""

    @property
    def interface(self) -> Interface | Law | None: ...

    def meet(self, o: NDArray, d: NDArray, /) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        ...


class Shapes:
    """Several shapes as one: what trace() takes."""

    def __init__(self, *shapes: Shape):
        self.shapes = shapes
        self.interfaces: list[Interface | Law | None] = [shape.interface for shape in shapes]
        self._which = np.array([-1 if shape.interface is None else i for i, shape in enumerate(shapes)])

    def hit(self, origins: NDArray, directions: NDArray) -> Hit:
        """The nearest Hit of rays from origins (N, 3) along unit directions (N, 3)."""
        distances, normals = zip(*(shape.meet(origins, directions) for shape in self.shapes), strict=True)
        nearest = np.argmin(distances, axis=0)
        rows = np.arange(len(origins))
        return Hit(np.stack(distances)[nearest, rows], np.stack(normals)[nearest, rows], self._which[nearest])

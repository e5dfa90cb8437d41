# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays traced through what the diagrams show, in the plane z = 0: x is to the right, y up, lengths are free. No bpy."""

import math
from typing import NamedTuple

import numpy as np

from ..physics import Interface, Medium
from ..physics.rays import Convex, Kind, Paths, Plane, Shapes, Sphere, trace

AIR = Medium(1.0)
DEPTH, FLOOR, STEEPEST = 1.0, 1.4, 75.0  # of the source and of the floor below the surface; degrees of the fan
WIDEST_BEAM = 0.95  # of the sphere's radius: at 1 a ray touches and no more
APEX = math.radians(20)  # of the prism: small enough that indices up to 2.9 let the light out
PRISM = 1.05  # half the height of the prism
PRISM_SLOPE = (math.cos(APEX), math.sin(APEX), 0.0)  # the normal of its second face
SIDE = 2.0  # of the faces of a prism that stands upright on its base
FAINTEST_DRAWN = 0.01  # a branch of less energy than this is not drawn


class Beam(NamedTuple):
    """Parallel rays on a sphere: their heights above its axis, from `low` to `high`, in radii; how many B.1 draws."""

    name: str
    low: float
    high: float
    rays: int


BEAMS = (
    Beam("hemisphere", -WIDEST_BEAM, WIDEST_BEAM, 15),
    Beam("centre", -0.3, 0.3, 7),
    Beam("edge", 0.75, WIDEST_BEAM, 5),
)


def focal_length(n: float) -> float | None:
    """From the centre of a ball of radius 1 to where paraxial light meets behind it, n / (2 (n - 1)); None for n = 1.

    The textbook's ball lens, which a negative n keeps: below 1 the point lies in the ball, and rays only seem to
    come from it.
    """
    return None if n == 1 else n / (2 * (n - 1))


def sphere_paths(medium: Medium, heights, **options) -> Paths:
    """Of rays to the right at `heights` (N,), through a ball of radius 1 about the origin; options: of trace()."""
    surfaces = Shapes(Sphere((0, 0, 0), 1.0, Interface(medium, AIR)))
    heights = np.asarray(heights, float)
    origins = np.stack([np.full_like(heights, -2.0), heights, np.zeros_like(heights)], axis=-1)
    return _traced(surfaces, origins, (1, 0, 0), options)


def pool_paths(medium: Medium, degrees: np.ndarray, **options) -> Paths:
    """Of rays from the point source up to the surface y = 0, `degrees` (N,) from the vertical, to the right."""
    theta = np.radians(degrees)
    surfaces = Shapes(Plane((0, 0, 0), (0, 1, 0), Interface(medium, AIR)), Plane((0, -FLOOR, 0), (0, 1, 0)))
    return _traced(surfaces, (0, -DEPTH, 0), np.stack([np.sin(theta), np.cos(theta), 0 * theta], axis=-1), options)


def slab_paths(medium: Medium, source: tuple, degrees: np.ndarray, **options) -> Paths:
    """Of rays from a source to the slab from x = 0 to 1, at `degrees` (N,) to its normal."""
    theta = np.radians(degrees)
    surfaces = Shapes(Convex(((0, 0, 0), (1, 0, 0)), ((-1, 0, 0), (1, 0, 0)), Interface(medium, AIR)))
    return _traced(surfaces, source, np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=-1), options)


def prism_paths(medium: Medium, heights: np.ndarray, **options) -> Paths:
    """Of rays to the right at `heights` (N,), through a prism whose first face is upright, its foot at y = -PRISM."""
    points = ((0, 0, 0), (0, PRISM, 0), (0, -PRISM, 0))
    surfaces = Shapes(Convex(points, ((-1, 0, 0), PRISM_SLOPE, (0, -1, 0)), Interface(medium, AIR)))
    origins = np.stack([np.full_like(heights, -1.2), heights, 0 * heights], axis=-1)
    return _traced(surfaces, origins, (1, 0, 0), options)


def upright_prism(apex: float) -> np.ndarray:
    """The corners (3, 2) of a prism with its apex above, radians, and the middles of its two faces at y = 0."""
    half = SIDE / 2 * np.array([math.sin(apex / 2), math.cos(apex / 2)])
    return np.array([(0, 1), (2, -1), (-2, -1)]) * half


def upright_prism_paths(medium: Medium, apex: float, incidence: float, heights: np.ndarray, **options) -> Paths:
    """Of rays through an upright_prism(): at `heights` (N,) across them from the one that meets the middle of a face.

    incidence: radians, positive on the base's side of the normal, as deviation.prism() has it
    """
    corners = np.column_stack([upright_prism(apex), np.zeros(3)])
    across, up = math.cos(apex / 2), math.sin(apex / 2)
    normals = ((-across, up, 0), (across, up, 0), (0, -1, 0))
    surfaces = Shapes(Convex((corners[0], corners[0], corners[1]), normals, Interface(medium, AIR)))
    slope = incidence - apex / 2
    ahead, aside = (math.cos(slope), math.sin(slope), 0.0), (-math.sin(slope), math.cos(slope), 0.0)
    middle = (corners[0] + corners[2]) / 2
    return _traced(surfaces, middle - 1.75 * np.array(ahead) + np.outer(heights, aside), ahead, options)


def _traced(surfaces, origins, directions, options):
    return trace(surfaces, origins, directions, **{"reach": 20.0, "least": FAINTEST_DRAWN} | options)


def transmitted_way(paths: Paths, ray: int) -> list[int]:
    """The segments of a ray that never was reflected, from its source on; in total reflection it ends there."""
    way = [int(np.flatnonzero((paths.ray == ray) & (paths.parent < 0))[0])]
    while len(onward := np.flatnonzero((paths.parent == way[-1]) & (paths.kind == Kind.TRANSMITTED))):
        way.append(int(onward[0]))
    return way

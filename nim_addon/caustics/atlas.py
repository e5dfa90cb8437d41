# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts: nearly flat pieces of surfaces, on which places can be counted in metres along two axes of the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import bpy
import mathutils
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cycles import meshes

LINES = 4  # across a cell, on each of which its surface is measured


class Chart(NamedTuple):
    """A nearly flat piece of a surface, seen along one axis of the world.

    name: of its object
    axis: 0 to 5 for +x, -x, +y, -y, +z, -z
    low, high: (2,) its bounds in metres, on the two other axes in their order
    """

    name: str
    axis: int
    low: NDArray
    high: NDArray


class Part(NamedTuple):
    """A mesh that light lands on.

    name:      of its object
    mesh:      as photons meet it
    matrix:    where it stands
    materials: those that the object wears, by the material index of faces, None where there is none
    corners:   (L, 3) place of each corner in the world
    charts:    (L,) number of each corner's chart, -1 where light does not land
    values:    object_values.values_of() it
    """

    name: str
    mesh: bpy.types.Mesh
    matrix: mathutils.Matrix
    materials: list[bpy.types.Material | None]
    corners: NDArray
    charts: NDArray
    values: dict


def charts_of(polygons: Sequence[Sequence[int]], normals: ArrayLike) -> tuple[NDArray, NDArray]:
    """The chart of each face of a mesh: faces that share an edge and look the same way, of six ways.

    polygons: the vertices of each face; normals: (F, 3) of any length
    Returns (F,) numbers of charts from 0, and (charts,) the axis of each (Chart.axis).
    """
    normals = np.asarray(normals)
    strongest = np.abs(normals).argmax(axis=1)
    axis = 2 * strongest + (normals[np.arange(len(normals)), strongest] < 0)
    parent = np.arange(len(polygons))

    def root(face):
        while parent[face] != face:
            parent[face] = parent[parent[face]]
            face = parent[face]
        return face

    edges = {}
    for face, corners in enumerate(polygons):
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            other = edges.setdefault((min(a, b), max(a, b)), face)
            if axis[other] == axis[face]:
                parent[root(face)] = root(other)
    _, first, number = np.unique([root(face) for face in range(len(polygons))], return_index=True, return_inverse=True)
    return number, axis[first]


def area(parts: Sequence[Part], chart: Chart, number: int, low: NDArray, texel: float, cells: NDArray) -> NDArray:
    """Surface (height, width), m^2, of a Chart in each cell of a grid.

    parts: those that may hold it; number: of the chart in them
    low: (2,) corner of the grid; texel: edge of a cell, metres; cells: (width, height)
    """
    answer = np.zeros(tuple(cells)[::-1])
    for part in parts:
        if part.name != chart.name or not (part.charts == number).any():
            continue
        loops = meshes.triangles(part.mesh, "loops")
        corners = part.corners[loops[part.charts[loops[:, 0]] == number]]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        steep = np.linalg.norm(across, axis=1) / np.maximum(np.abs(across[:, chart.axis // 2]), 1e-12)
        flat = (np.delete(corners, chart.axis // 2, axis=2) - low) / texel
        for triangle, slope in zip(flat, steep, strict=True):
            first = np.clip(np.floor(triangle.min(axis=0)).astype(int), 0, cells)
            last = np.clip(np.ceil(triangle.max(axis=0)).astype(int), 0, cells)
            if np.all(last > first):
                cover = _cover(triangle - first, *(last - first))
                answer[first[1] : last[1], first[0] : last[0]] += cover * (slope * texel**2)
    return answer


def _cover(triangle, width, height):
    """Share (height, width) of each unit cell that a triangle (3, 2) covers, exact along lines of constant y."""
    answer = np.empty((height, width))
    edges = np.arange(width + 1)
    for top in range(0, height, 256):
        bottom = min(top + 256, height)
        y = top + (np.arange((bottom - top) * LINES) + 0.5) / LINES
        left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
        for p, q in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            met = (np.minimum(p[1], q[1]) <= y) & (y < np.maximum(p[1], q[1]))
            x = p[0] + (y[met] - p[1]) * (q[0] - p[0]) / (q[1] - p[1])
            left[met], right[met] = np.minimum(left[met], x), np.maximum(right[met], x)
        met = left < right
        run = np.zeros((len(y), width))
        run[met] = np.diff(np.clip(edges, left[met, None], right[met, None]), axis=1)
        answer[top:bottom] = run.reshape(bottom - top, LINES, width).mean(axis=1)
    return answer

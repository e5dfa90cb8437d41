# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts: nearly flat pieces of surfaces, on which places can be counted in metres along two axes of the world."""

from typing import NamedTuple

import bpy
import mathutils
import numpy as np

from ..cycles import meshes

LINES = 4  # across a cell, on each of which its surface is measured


class Chart(NamedTuple):
    """A nearly flat piece of a surface, seen along one axis of the world.

    thing: name of its object; axis: 0 to 5 for +x, -x, +y, -y, +z, -z; low, high: its bounds (2,) in metres, on the two
    other axes in their order
    """

    thing: str
    axis: int
    low: np.ndarray
    high: np.ndarray


class Part(NamedTuple):
    """A mesh that light lands on: its object's name, its matrix and materials, each corner's place in the world (N, 3) and
    chart (N,), -1 where light does not land, and the object_values.values_of() it."""

    name: str
    mesh: bpy.types.Mesh
    matrix: mathutils.Matrix
    materials: list
    corners: np.ndarray
    charts: np.ndarray
    values: dict


def charts_of(vertices, polygons, normals):
    """The chart of each face of a mesh: faces that share an edge and look the same way, of six ways.

    vertices: (V, 3); polygons: sequences of vertex indices; normals: (F, 3)
    Returns (F,) chart numbers from 0, and the axis of each chart.
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


def area(parts, chart, number, low, texel, cells):
    """Surface (height, width), m^2, of a Chart in each cell of a grid of `cells` (width, height) of side `texel`.

    parts: the Parts that may hold it; number: of the chart in them; low: (2,) the grid's corner
    """
    answer = np.zeros(tuple(cells)[::-1])
    for part in parts:
        if part.name != chart.thing or not (part.charts == number).any():
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

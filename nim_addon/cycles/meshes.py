# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh of Blender holds, as arrays."""

from __future__ import annotations

from itertools import pairwise

import bpy
import mathutils
import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

ENDLESS = 1e15  # times the unit: single precision has no areas of what is larger


def read(items: bpy.types.bpy_prop_collection, name: str, width: int = 1, dtype: DTypeLike = np.float32) -> NDArray:
    """The property `name` of all items of a Blender collection: (N, width), or (N,) where the width is 1.

    dtype: of the array; where it is that of the property, Blender copies faster
    """
    values = np.empty((len(items), width) if width > 1 else len(items), dtype)
    items.foreach_get(name, values.ravel())
    return values


def attribute(mesh: bpy.types.Mesh, name: str, field: str, width: int = 1, dtype: DTypeLike = np.float32) -> NDArray:
    """read() of an attribute of a mesh, with no row where the mesh has none of that name.

    The built-in ones, position, .corner_vert and the like, are copied at once here; as properties of vertices and loops
    they are read one by one, which takes 50 to 300 times as long.
    """
    if name not in mesh.attributes:
        return np.empty((0, width) if width > 1 else 0, dtype)
    return read(mesh.attributes[name].data, field, width, dtype)


def vertices(mesh: bpy.types.Mesh, matrix: mathutils.Matrix | ArrayLike | None = None) -> NDArray:
    """(V, 3) places of the vertices: float32 in the mesh's own coordinates, or float64 where a `matrix` (4, 4) puts them."""
    points = _built_in(mesh, "position", "vector", mesh.vertices, "co", 3)
    return points if matrix is None else moved(points, matrix)


def placeless(mesh: bpy.types.Mesh) -> NDArray:
    """(V,) whether a vertex has a coordinate that is no number, or infinite, as more than ENDLESS is to a render."""
    return ~(np.abs(vertices(mesh)) < ENDLESS).all(axis=1)


def moved(points: ArrayLike, matrix: mathutils.Matrix | ArrayLike) -> NDArray:
    """Points (..., 3) where an affine `matrix` (4, 4) puts them."""
    frame = np.array(matrix, float)
    return points @ frame[:3, :3].T + frame[:3, 3]


def corners(mesh: bpy.types.Mesh) -> NDArray:
    """(L,) the vertex of each corner, face by face."""
    return _built_in(mesh, ".corner_vert", "value", mesh.loops, "vertex_index", dtype=np.int32)


def corner_edges(mesh: bpy.types.Mesh) -> NDArray:
    """(L,) the edge from each corner to the next of its face."""
    return _built_in(mesh, ".corner_edge", "value", mesh.loops, "edge_index", dtype=np.int32)


def _built_in(mesh, name, field, items, prop, width=1, dtype=np.float32):
    """A built-in attribute, or the same of `items`: while a mesh is edited, its attributes are not of what is shown."""
    values = attribute(mesh, name, field, width, dtype)
    return values if len(values) == len(items) else read(items, prop, width, dtype)


def starts(mesh: bpy.types.Mesh) -> NDArray:
    """(F + 1,) where the corners of each face begin, and at last how many there are."""
    begins = np.full(len(mesh.polygons) + 1, len(mesh.loops), np.int32)
    mesh.polygons.foreach_get("loop_start", begins[:-1])
    return begins


def slots(mesh: bpy.types.Mesh, count: int) -> NDArray:
    """(F,) the material index of each face, as a render takes those that are beyond the `count` of materials."""
    return np.clip(read(mesh.polygons, "material_index", dtype=np.int32), 0, count - 1)


def triangles(mesh: bpy.types.Mesh, name: str = "vertices") -> NDArray:
    """(T, 3) the vertices, or the corners where `name` is "loops", of the triangles that a mesh is rendered as."""
    mesh.calc_loop_triangles()
    return read(mesh.loop_triangles, name, 3, np.int32)


def faces(corners: NDArray, starts: NDArray) -> list[list[int]]:
    """The vertices of each face, of corners() and starts()."""
    every = corners.tolist()
    return [every[first:last] for first, last in pairwise(starts.tolist())]


def bounds(points: NDArray) -> tuple[NDArray, NDArray]:
    """Lowest and highest coordinates (3,) of points (N, 3); zeros where there is none."""
    return (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.zeros(3))


def box_corners(low: ArrayLike, high: ArrayLike) -> NDArray:
    """(8, 3) the corners of the box between two of them, (3,) each."""
    return np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3)

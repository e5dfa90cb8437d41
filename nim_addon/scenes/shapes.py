# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as arrays, for Stage.mesh: vertices (N, 3) in metres and faces, counter-clockwise seen from outside."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Faces: TypeAlias = Sequence[Sequence[int]]  # the indices of their corners
Shape: TypeAlias = tuple[NDArray, Faces]


def box(low: ArrayLike, high: ArrayLike) -> Shape:
    """Vertices (8, 3) and 6 quads of an axis-aligned box from corner `low` to corner `high`."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    vertices = np.asarray(low, float) + corners * (np.asarray(high, float) - np.asarray(low, float))
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return vertices, faces


def upright(outline: ArrayLike, low: float, high: float) -> Shape:
    """Vertices (2 N, 3) and faces of a straight prism over a polygon (N, 2), counter-clockwise from above, from z to z."""
    outline = np.asarray(outline, float)
    count = len(outline)
    vertices = np.concatenate([np.column_stack([outline, np.full(count, z)]) for z in (low, high)])
    sides = [(i, (i + 1) % count, (i + 1) % count + count, i + count) for i in range(count)]
    return vertices, [tuple(range(count))[::-1], tuple(range(count, 2 * count)), *sides]


def rectangle(low: tuple[float, float], high: tuple[float, float], z: float = 0.0) -> Shape:
    """Vertices (4, 3) and one quad at height z, facing up, between the corners low and high (x, y)."""
    (x0, y0), (x1, y1) = low, high
    return np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], float), [(0, 1, 2, 3)]


def cube_sphere(divisions: int) -> Shape:
    """Vertices and quads of a unit sphere made of a cube, `divisions` quads of equal angle along an edge."""
    angles = np.tan(np.linspace(-np.pi / 4, np.pi / 4, divisions + 1))
    u, v = np.meshgrid(angles, angles, indexing="ij")
    side = np.ones_like(u)
    sides = [(side, u, v), (-side, v, u), (v, side, u), (u, -side, v), (u, v, side), (v, u, -side)]
    points = np.concatenate([np.stack(xyz, -1).reshape(-1, 3) for xyz in sides])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    unique, index = np.unique(points.round(9), axis=0, return_inverse=True)
    index = index.reshape(6, divisions + 1, divisions + 1)
    quads = np.stack([index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]], -1)
    return unique / np.linalg.norm(unique, axis=1, keepdims=True), quads.reshape(-1, 4).tolist()


def revolve(profile: ArrayLike, segments: int) -> tuple[NDArray, Faces, NDArray]:
    """Vertices and faces of a profile turned about the z axis.

    profile: (N, 2) radii and heights; a point of radius 0 becomes a pole, and a last point equal to the first closes
    it. Faces point to the right of the profile's direction of travel in the (radius, height) half plane: a profile that
    climbs an outer wall faces outwards.
    Returns vertices (M, 3), faces, and for each face the index of the profile's segment it came from.
    """
    profile = np.asarray(profile, float)
    turn = 2 * np.pi * np.arange(segments) / segments
    vertices, rings = [], []
    closed = np.array_equal(profile[0], profile[-1])
    for radius, height in profile[:-1] if closed else profile:
        count = segments if radius > 0 else 1
        rings.append(np.arange(segments) % count + len(vertices))
        angle = turn[:count]
        vertices.extend(zip(radius * np.cos(angle), radius * np.sin(angle), np.full(count, height), strict=True))
    if closed:
        rings.append(rings[0])
    faces, origin = [], []
    for i, (low, high) in enumerate(pairwise(rings)):
        for a, b, c, d in zip(low, np.roll(low, -1), np.roll(high, -1), high, strict=True):
            face = list(dict.fromkeys(int(k) for k in (a, b, c, d)))
            if len(face) > 2:
                faces.append(tuple(face))
                origin.append(i)
    return np.array(vertices), faces, np.array(origin)


def tube(start: ArrayLike, end: ArrayLike, radius: float, segments: int = 48, inner: float = 0.0) -> Shape:
    """Vertices and faces of a straight tube between two points; with `inner` > 0 a wall of that inner radius."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    axis = end - start
    length = np.linalg.norm(axis)
    if inner > 0:
        profile = [(inner, 0), (radius, 0), (radius, length), (inner, length), (inner, 0)]
    else:
        profile = [(0, 0), (radius, 0), (radius, length), (0, length)]
    vertices, faces, _ = revolve(profile, segments)
    z = axis / length
    x = np.cross((0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (1.0, 0.0, 0.0), z)
    x /= np.linalg.norm(x)
    return start + vertices @ np.stack([x, np.cross(z, x), z]), faces


def arc(center: tuple[float, float], radius: float, start: float, end: float, steps: int) -> NDArray:
    """Points of a circular arc, (steps + 1, 2), from angle `start` to `end` in degrees about `center`."""
    angle = np.radians(np.linspace(start, end, steps + 1))
    return np.asarray(center, float) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def sweep(points: ArrayLike, radius: ArrayLike, segments: int = 12) -> Shape:
    """Vertices and faces of a bent tube with closed ends along `points` (N, 3); `radius` one value, or (N,)."""
    points = np.asarray(points, float)
    radius = np.broadcast_to(radius, len(points))
    tangents = np.gradient(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.eye(3)[np.argmin(np.abs(tangents[0]))]
    turn = 2 * np.pi * np.arange(segments)[:, None] / segments
    rings = []
    for point, tangent, width in zip(points, tangents, radius, strict=True):
        # carried on from ring to ring, so that the tube does not twist
        side = side - tangent * np.dot(side, tangent)
        side /= np.linalg.norm(side)
        rings.append(point + width * (np.cos(turn) * side + np.sin(turn) * np.cross(tangent, side)))
    index = np.arange(len(points) * segments).reshape(-1, segments)
    ahead = np.roll(index, -1, axis=1)
    quads = np.stack([index[:-1], ahead[:-1], ahead[1:], index[1:]], -1).reshape(-1, 4)
    return np.concatenate(rings), [*quads.tolist(), index[0, ::-1].tolist(), index[-1].tolist()]


def frame(inner: ArrayLike, outer: ArrayLike, z: float = 0.0) -> Shape:
    """Vertices (8, 3) and 4 quads, facing up at height z, between two rectangles about the z axis.

    inner, outer: half sizes (x, y) of the hole and of the whole.
    """
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    flat = np.concatenate([corners * outer, corners * inner])
    vertices = np.column_stack([flat, np.full(8, float(z))])
    return vertices, [(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)]


def grid(low: ArrayLike, high: ArrayLike, step: float) -> Shape:
    """Vertices (N, 3) at z = 0 and quads, facing up, over the rectangle low to high (x, y), at most `step` wide."""
    sides = np.stack([low, high], axis=-1).tolist()
    lines = [np.linspace(a, b, max(1, math.ceil((b - a) / step - 1e-9)) + 1) for a, b in sides]
    x, y = np.meshgrid(*lines, indexing="ij")
    index = np.arange(x.size).reshape(x.shape)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1)
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], -1), quads.reshape(-1, 4).tolist()


def closed_below(vertices: NDArray, faces: Faces, bottom: float) -> Shape:
    """The solid between a sheet that faces up, with one convex rim and no holes, and the height `bottom` below all of it.

    Returns vertices and faces, those of the sheet first.
    """
    edges = {(int(a), int(b)) for face in faces for a, b in zip(face, [*face[1:], face[0]], strict=True)}
    onwards = {a: b for a, b in edges if (b, a) not in edges}
    rim = [next(iter(onwards))]
    while (ahead := onwards[rim[-1]]) != rim[0]:
        rim.append(ahead)
    below = vertices[rim] * (1, 1, 0) + (0, 0, bottom)
    middle = below.mean(axis=0)
    first, last = len(vertices), len(vertices) + len(rim)  # of those at the bottom
    sides, floor = [], []
    for i, (a, b) in enumerate(zip(rim, [*rim[1:], rim[0]], strict=True)):
        low, next_low = first + i, first + (i + 1) % len(rim)
        sides.append((b, a, low, next_low))
        floor.append((next_low, low, last))
    return np.vstack([vertices, below, middle]), [*faces, *sides, *floor]


def joined(*pieces: Shape) -> tuple[NDArray, Faces, NDArray]:
    """Vertices and faces of several (vertices, faces) as one mesh, and for each face the index of its piece."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in pieces])
    faces = [
        [int(k) + int(start) for k in face] for (_, own), start in zip(pieces, starts, strict=False) for face in own
    ]
    origin = np.repeat(np.arange(len(pieces)), [len(own) for _, own in pieces])
    return np.concatenate([vertices for vertices, _ in pieces]), faces, origin

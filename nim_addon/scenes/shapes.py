# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as arrays, for Stage.mesh: vertices (N, 3) in metres and faces, counter-clockwise seen from outside."""

import numpy as np


def box(low, high):
    """Vertices (8, 3) and 6 quads of an axis-aligned box from corner `low` to corner `high`."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    vertices = np.asarray(low, float) + corners * (np.asarray(high, float) - np.asarray(low, float))
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return vertices, faces


def rectangle(low, high, z=0.0):
    """Vertices (4, 3) and one quad at height z, facing up, between the corners low and high (x, y)."""
    (x0, y0), (x1, y1) = low, high
    return np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], float), [(0, 1, 2, 3)]


def cube_sphere(divisions):
    """Vertices and quads of a unit sphere made of a cube, `divisions` quads of equal angle along an edge."""
    angles = np.tan(np.linspace(-np.pi / 4, np.pi / 4, divisions + 1))
    u, v = np.meshgrid(angles, angles, indexing="ij")
    one = np.ones_like(u)
    sides = [(one, u, v), (-one, v, u), (v, one, u), (u, -one, v), (u, v, one), (v, u, -one)]
    points = np.concatenate([np.stack(side, -1).reshape(-1, 3) for side in sides])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    unique, index = np.unique(points.round(9), axis=0, return_inverse=True)
    index = index.reshape(6, divisions + 1, divisions + 1)
    quads = np.stack([index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]], -1)
    return unique / np.linalg.norm(unique, axis=1, keepdims=True), quads.reshape(-1, 4).tolist()


def revolve(profile, segments):
    """Vertices and faces of a profile turned about the z axis.

    profile: (N, 2) radii and heights; a point of radius 0 becomes a pole. Faces point to the right of the profile's
    direction of travel in the (radius, height) half plane: a profile that climbs an outer wall faces outwards.
    Returns vertices (M, 3), faces, and for each face the index of the profile's segment it came from.
    """
    profile = np.asarray(profile, float)
    turn = 2 * np.pi * np.arange(segments) / segments
    vertices, rings = [], []
    for radius, height in profile:
        count = segments if radius > 0 else 1
        rings.append(np.arange(segments) % count + len(vertices))
        angle = turn[:count]
        vertices.extend(zip(radius * np.cos(angle), radius * np.sin(angle), np.full(count, height), strict=True))
    faces, origin = [], []
    for i, (low, high) in enumerate(zip(rings[:-1], rings[1:], strict=True)):
        for a, b, c, d in zip(low, np.roll(low, -1), np.roll(high, -1), high, strict=True):
            face = list(dict.fromkeys(int(k) for k in (a, b, c, d)))
            if len(face) > 2:
                faces.append(tuple(face))
                origin.append(i)
    return np.array(vertices), faces, np.array(origin)


def tube(start, end, radius, segments=48, inner=0.0):
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

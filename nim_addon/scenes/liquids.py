# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquids in a basin: a surface, and below it a body where the liquid absorbs."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles.absorption import absorbs
from ..cycles.material import interface_material
from ..physics import Medium
from . import shapes
from .stage import Stage

OVERLAP = 0.01  # metres that a surface, and a body, reach into the walls, so that no gap shows


def fill(
    stage: Stage, medium: Medium, surface: tuple[NDArray, shapes.Faces, NDArray], waves: bool, floor: float
) -> bpy.types.Object:
    """Fill a basin with a liquid; returns the object.

    surface: vertices (N, 3), quads facing up and unit normals (N, 3) at the vertices; waves: whether these count
    floor:   height of the basin's floor
    Where the liquid absorbs, its surface is the top of a closed body, whose sides and bottom lie OVERLAP beyond the walls
    and the floor, where no light comes.
    """
    vertices, faces, normals = surface
    corners = normals[np.asarray(faces)].reshape(-1, 3) if waves else None
    body = absorbs(medium)
    if body:
        quads = len(faces)
        vertices, faces = shapes.closed_below(vertices, faces, floor - OVERLAP)
        if corners is not None:
            corners = np.vstack([corners, *(_flat(vertices, face) for face in faces[quads:])])
    material = interface_material("Liquid", medium, backend=stage.backend, volume=body)
    return stage.mesh("Liquid", vertices, faces, material, normals=corners)


def _flat(vertices, face):
    """The normal of a face at each of its corners, (K, 3)."""
    a, b, c = vertices[list(face)[:3]]
    normal = np.cross(b - a, c - a)
    return np.tile(normal / np.linalg.norm(normal), (len(face), 1))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays meet the triangles of a mesh that stands in the world (cycles.casting), and the normals there."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import meshes


class Body(NamedTuple):
    """A mesh of cycles.casting where it stands: the world is `matrix` (4, 4) away, and `inverse` leads back.

    which: (slots,) indices of interfaces, -1 where a material is none
    """

    mesh: Any
    matrix: NDArray
    inverse: NDArray
    which: NDArray

    def within(self, origins: NDArray, directions: NDArray) -> tuple[NDArray, NDArray]:
        """Rays, (N, 3) each, in its own coordinates; directions are no unit vectors there."""
        turned = self.inverse[:3, :3].T
        return origins @ turned + self.inverse[:3, 3], directions @ turned

    def smooth(self, triangles: NDArray, shares: NDArray, directions: NDArray) -> NDArray:
        """The normals (K, 3) where rays meet triangles (K,) of a small mesh, by the shares (K, 2) of their later corners."""
        mesh = self.mesh
        # of all, which are fewer than rays
        _, normals, facing = self._placed(*mesh.corners_of(mesh.face_of, np.arange(len(mesh.face_of))))
        facing, weights = facing[triangles], np.column_stack([1 - shares.sum(axis=1), shares])
        return _interpolated(weights, normals[triangles], facing, dot(facing, directions), directions)

    def exactly(self, faces: NDArray, origins: NDArray, directions: NDArray) -> tuple[NDArray, NDArray]:
        """Where rays meet faces (K,) that they are known to meet: distances (K,), normals (K, 3).

        The tree says which face, in single precision; where it is met is worked out again in double.
        """
        of, corners, normals = self.mesh.triangles(faces)
        origin, direction = origins[of], directions[of]
        corners, normals, facing = self._placed(corners, normals)
        a, b, c = np.moveaxis(corners, 1, 0)
        along = dot(facing, direction)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.maximum(np.nan_to_num(dot(a - origin, facing) / along), 0)
            at = origin + distance[:, None] * direction
            # areas of the triangles between the point and two of the corners
            weights = np.stack([dot(np.cross(q - at, r - at), facing) for q, r in ((b, c), (c, a), (a, b))], -1)
            weights = np.nan_to_num(weights / weights.sum(axis=-1, keepdims=True), nan=-np.inf)
        # the triangle of each face that it lies in
        _, first = np.unique(of, return_index=True)
        met = np.lexsort((-weights.min(axis=-1), of))[first]
        return distance[met], _interpolated(weights[met], normals[met], facing[met], along[met], direction[met])

    def _placed(self, corners, normals):
        """Corners and normals (T, 3, 3) of triangles in the world, and the triangles' own normals (T, 3)."""
        corners, normals = meshes.moved(corners, self.matrix), _unit_or_zero(normals @ self.inverse[:3, :3])
        a, b, c = np.moveaxis(corners, 1, 0)
        # a mirrored object has its normals on the same side as before, though its corners run the other way round
        return corners, normals, _unit_or_zero(np.cross(b - a, c - a) * np.sign(np.linalg.det(self.matrix[:3, :3])))


def _interpolated(weights, normals, facing, along, directions):
    """The normals (K, 3) of rays that meet triangles, of their weights (K, 3) and normals (K, 3, 3) of the corners.

    facing, along: the triangles' own normals (K, 3), and the cosines (K,) of the unit directions to them
    """
    normal = _unit_or_zero(np.einsum("nk,nki->ni", np.clip(np.nan_to_num(weights, neginf=0), 0, 1), normals))
    # near the rim of a smooth mesh its normals look away from the ray, or mirror it through the face
    towards = dot(directions, normal)
    mirrored = along - 2 * towards * dot(normal, facing)
    wrong = (towards * along <= 0) | (mirrored * along >= 0)
    return np.where(wrong[:, None], facing, normal)


def dot(a: NDArray, b: NDArray) -> NDArray:
    """(...) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, b)


def _unit_or_zero(vectors):
    return vectors / np.maximum(np.sqrt(dot(vectors, vectors)), 1e-300)[..., None]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that rays meet, cast by Blender's trees."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree
from numpy.typing import ArrayLike, NDArray

from ..physics import Interface
from ..physics.laws import Law
from ..physics.rays import Hit
from . import meshes
from .laws import asked_law, law_of
from .material import asked_interfaces, interface_of, is_rough
from .visibility import Shown

# Rays times meshes whose bounds are compared at once.
AT_ONCE = 1_000_000


def entries(origins: NDArray, directions: NDArray, low: ArrayLike, high: ArrayLike, margin: ArrayLike = 0.0) -> NDArray:
    """(N, B) how far rays run until they enter each of some boxes: 0 where they start within, inf where they miss it.

    origins, directions: (N, 3); low, high: (B, 3) corners; margin: by how much the boxes are enlarged, or (B,) for each
    """
    low, high = np.asarray(low) - np.reshape(margin, (-1, 1)), np.asarray(high) + np.reshape(margin, (-1, 1))
    enter, leave = np.zeros((len(origins), len(low))), np.full((len(origins), len(low)), np.inf)
    # a ray in the plane of a side passes by or meets it: 0 / 0 would be neither
    along = np.where(directions == 0, 1e-300, directions)
    with np.errstate(over="ignore"):
        for axis in range(3):
            first = (low[:, axis] - origins[:, axis, None]) / along[:, axis, None]
            last = (high[:, axis] - origins[:, axis, None]) / along[:, axis, None]
            enter, leave = np.maximum(enter, np.minimum(first, last)), np.minimum(leave, np.maximum(first, last))
    return np.where(enter <= leave, enter, np.inf)


class Faces:
    """Faces in the world as a shape of physics.rays.Shapes, opaque where `interface` is None; in single precision.

    points: (V, 3); faces: the indices of their corners, counter-clockwise as seen from outside
    """

    def __init__(self, points: NDArray, faces: Sequence[Sequence[int]], interface: Interface | Law | None = None):
        self.interface = interface
        self._low, self._high = meshes.bounds(points)
        self._tree = BVHTree.FromPolygons(points.tolist(), faces)

    def meet(self, origins: NDArray, directions: NDArray) -> tuple[NDArray, NDArray]:
        """As physics.rays.Sphere.meet."""
        distance, normals = np.full(len(origins), np.inf), np.zeros(origins.shape)
        near = entries(origins, directions, [self._low], [self._high])[:, 0]
        for i in np.flatnonzero(np.isfinite(near)):  # most rays pass its box by
            _, normal, _, length = self._tree.ray_cast(origins[i].tolist(), directions[i].tolist())
            if normal is not None:
                distance[i], normals[i] = length, normal
        return distance, normals


class _Body(NamedTuple):
    """A mesh where it stands; `which` (slots,) are indices of interfaces, -1 where a material is none."""

    mesh: _Mesh
    matrix: NDArray
    inverse: NDArray
    which: NDArray


class Meshes:
    """The meshes of visibility.shown(), as physics.rays.trace() takes surfaces; valid as long as their depsgraph.

    Faces with an interface node bend rays, those of another law (cycles.laws) take them elsewhere, all others stop them.
    `unknown` names the materials whose media a link decides: what it gives is not known here, so rays stop there as well.
    `rough` names those with a rough surface, where rays go as by a smooth one, in the middle of what is scattered. `bounds`
    maps each object (its original) to the two corners of its interfaces, and is empty where there is none; `low` and `high`
    are those of all, `size` the distance between them. `gap` is more than the rounding of a hit, for trace(): Blender's trees
    find the face, in single precision, and where a ray meets it is worked out again in double.

    A bend uses the interpolated normal, as Cycles does: with the faces' own, a beam through a round but coarse mesh
    comes out as one bundle a face.
    """

    def __init__(self, surfaces: Iterable[Shown], depsgraph: bpy.types.Depsgraph):
        self.interfaces: list[Interface | Law] = []
        self.bounds = {}
        self.unknown, self.rough = set(), set()
        self._bodies, boxes, known_meshes, known_materials = [], [], {}, {}
        far = 0.0
        for surface in surfaces:
            matrix = np.array(surface.matrix.copy(), float)
            if np.linalg.det(matrix[:3, :3]) == 0:
                continue
            key = surface.mesh.as_pointer()
            if key not in known_meshes:
                known_meshes[key] = _Mesh(surface, depsgraph)
            mesh = known_meshes[key]
            if not mesh.faces:
                continue
            for material in surface.materials:
                if material not in known_materials:
                    known_materials[material] = self._which(material)
            which = np.array([self._placed(known_materials[material], matrix) for material in surface.materials])
            own = mesh.points(which >= 0)
            if len(own):
                low, high = meshes.bounds(meshes.moved(own, matrix))
                first, last = self.bounds.get(surface.original, (low, high))
                self.bounds[surface.original] = np.minimum(low, first), np.maximum(high, last)
                # Blender casts in single precision, in the mesh's own space
                far = max(far, np.abs([low, high]).max(), np.abs(matrix[:3, :3]).max() * np.abs(mesh.box).max())
            self._bodies.append(_Body(mesh, matrix, np.linalg.inv(matrix), which))
            boxes.append(meshes.bounds(meshes.moved(meshes.box_corners(*mesh.box), matrix)))
        if self.bounds:
            self.low = np.min([low for low, _ in self.bounds.values()], axis=0)
            self.high = np.max([high for _, high in self.bounds.values()], axis=0)
            self.size = float(np.linalg.norm(self.high - self.low))
        self.gap = 1e-6 * far
        self._boxes = np.array(boxes).reshape(-1, 2, 3)

    def _placed(self, which, matrix):
        """Index of what _which() says of a material, on an object of that matrix; -1 where rays end at it."""
        if isinstance(which, int):
            return which
        material, found = which
        law = law_of(found, matrix)
        if law is None:
            self.unknown.add(material.name)
            return -1
        self.interfaces.append(law)
        return len(self.interfaces) - 1

    def _which(self, material):
        """Index of the material's interface, -1 where rays end at it; or it and its node, where its law has a place."""
        found = asked_interfaces(material)
        if not found:
            lawful = asked_law(material)
            return (material, lawful) if lawful else -1
        interface = interface_of(*found[0])
        if interface is None:
            self.unknown.add(material.name)
            return -1
        if is_rough(*found[0]):
            self.rough.add(material.name)
        if interface not in self.interfaces:
            self.interfaces.append(interface)
        return self.interfaces.index(interface)

    def hit(self, origins: NDArray, directions: NDArray) -> Hit:
        """The nearest physics.rays.Hit of rays from origins (N, 3) along unit directions (N, 3)."""
        count = len(origins)
        distance, normal, which = np.full(count, np.inf), np.zeros((count, 3)), np.full(count, -1)
        step = max(1, AT_ONCE // max(1, len(self._bodies)))
        for start in range(0, count, step):
            rays = slice(start, start + step)
            for ray, at, towards, slot in self._met(origins[rays], directions[rays]):
                if at < distance[start + ray]:
                    distance[start + ray], normal[start + ray], which[start + ray] = at, towards, slot
        return Hit(distance, normal, which)

    def _met(self, origins, directions):
        """Of each ray the hits that may be the nearest: its index, the distance, the normal, the interface."""
        ray, body, entry = self._candidates(origins, directions)
        if not len(ray):
            return
        inverse = np.array([body.inverse for body in self._bodies])[body]
        starts = np.einsum("nij,nj->ni", inverse[:, :3, :3], origins[ray]) + inverse[:, :3, 3]
        ways = np.einsum("nij,nj->ni", inverse[:, :3, :3], directions[ray])
        lengths = np.linalg.norm(ways, axis=1)
        found, nearest = [], np.full(len(origins), np.inf)
        for row, (i, j, near) in enumerate(zip(ray.tolist(), body.tolist(), entry.tolist(), strict=True)):
            # a hit in single precision is good enough to leave out what lies behind it
            if near > nearest[i] * (1 + 1e-5) + self.gap:
                continue
            *_, face, away = self._bodies[j].mesh.tree.ray_cast(starts[row], ways[row])
            if face is not None:
                nearest[i] = min(nearest[i], away / lengths[row])
                found.append((i, j, face))
        for i, j, face in found:
            distance, normal, slot = _exactly(self._bodies[j], face, origins[i], directions[i])
            yield i, distance, normal, self._bodies[j].which[slot]

    def _candidates(self, origins, directions):
        """Rays and the bodies whose bounds they meet, and how far away, each ray's nearest first: three arrays (P,)."""
        entry = entries(origins, directions, self._boxes[:, 0], self._boxes[:, 1], self.gap)
        ray, body = np.nonzero(np.isfinite(entry))
        entry = entry[ray, body]
        order = np.lexsort((entry, ray))
        return ray[order], body[order], entry[order]


class _Mesh:
    """An evaluated mesh, of which only what is asked for is read: a mesh of millions of faces is in memory once."""

    def __init__(self, surface, depsgraph):
        self.data, self._depsgraph = surface.mesh, depsgraph
        self.faces = len(self.data.polygons)
        if not self.faces:
            return
        self.box = np.stack(meshes.bounds(meshes.vertices(self.data))).astype(float)
        self._object = surface.object

    @cached_property
    def tree(self):
        """The tree of its triangles, made when it is first asked for."""
        if self._object.data == self.data:
            return BVHTree.FromObject(self._object, self._depsgraph)
        # a mesh that geometry nodes or curves made has an object only while its instances are gone through
        tree = None
        for instance in self._depsgraph.object_instances:  # to its end: Blender leaks one that is broken off
            if tree is None and instance.object.data == self.data:
                tree = BVHTree.FromObject(instance.object, self._depsgraph)
        return tree

    def points(self, chosen):
        """(N, 3) the vertices, those of all faces whose slot is `chosen` (slots,), bool, among them."""
        if chosen.all() or not chosen.any():
            return meshes.vertices(self.data) if chosen.any() else ()
        own = chosen[meshes.slots(self.data, len(chosen))]
        corners = meshes.corners(self.data)[np.repeat(own, np.diff(meshes.starts(self.data)))]
        return meshes.vertices(self.data)[corners]

    def triangles(self, face):
        """The corners and the normals at them (T, 3, 3) of the triangles of a face."""
        data = self.data
        data.calc_loop_triangles()
        polygon = data.polygons[face]
        # a face of k corners has k - 2 triangles
        first = polygon.loop_start - 2 * face
        chosen = [data.loop_triangles[i] for i in range(first, first + polygon.loop_total - 2)]
        corners = np.array([[data.vertices[i].co for i in triangle.vertices] for triangle in chosen], float)
        if data.normals_domain == "FACE":
            return corners, np.broadcast_to(np.array(data.polygon_normals[face].vector, float), corners.shape)
        if data.normals_domain == "POINT":
            normals = [[data.vertex_normals[i].vector for i in triangle.vertices] for triangle in chosen]
        else:
            normals = [[data.corner_normals[i].vector for i in triangle.loops] for triangle in chosen]
        return corners, np.array(normals, float)


def _exactly(body, face, origin, direction):
    """Where a ray meets a face of a _Body that it is known to meet: the distance, the normal (3,), the slot.

    The tree says which face, in single precision; where it is met is worked out again in double.
    """
    linear = body.matrix[:3, :3]
    corners, normals = body.mesh.triangles(face)
    corners, normals = meshes.moved(corners, body.matrix), _unit_or_zero(normals @ body.inverse[:3, :3])
    a, b, c = np.moveaxis(corners, 1, 0)
    # a mirrored object has its normals on the same side as before, though its corners run the other way round
    facing = _unit_or_zero(np.cross(b - a, c - a) * np.sign(np.linalg.det(linear)))
    along = facing @ direction
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.maximum(np.nan_to_num(_dot(a - origin, facing) / along), 0)
        at = origin + distance[:, None] * direction
        # areas of the triangles between the point and two of the corners
        weights = np.stack([_dot(np.cross(q - at, r - at), facing) for q, r in ((b, c), (c, a), (a, b))], -1)
        weights = np.nan_to_num(weights / weights.sum(axis=-1, keepdims=True), nan=-np.inf)
    met = int(np.argmax(weights.min(axis=-1)))  # the triangle of the face that it lies in
    facing, along = facing[met], along[met]
    normal = _unit_or_zero(np.clip(np.nan_to_num(weights[met], neginf=0), 0, 1) @ normals[met])
    # near the rim of a smooth mesh its normals look away from the ray, or mirror it through the face
    towards = direction @ normal
    mirrored = along - 2 * towards * (normal @ facing)
    if towards * along <= 0 or mirrored * along >= 0:
        normal = facing
    slot = min(body.mesh.data.polygons[face].material_index, len(body.which) - 1)
    return float(distance[met]), normal, slot


def _dot(a, b):
    return np.sum(a * b, axis=-1)


def _unit_or_zero(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)

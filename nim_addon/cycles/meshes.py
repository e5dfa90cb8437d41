# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render shows, for rays to meet: Blender's trees find the triangle, double precision where it is met."""

from collections.abc import Iterable
from typing import NamedTuple

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from ..physics.rays import Hit
from .material import asked_interfaces, interface_of
from .visibility import Shown

# Rays times meshes whose bounds are compared at once.
AT_ONCE = 1_000_000


class _Body(NamedTuple):
    """A mesh where it stands; `which` (slots,) are indices of interfaces, -1 where a material is none."""

    mesh: "_Mesh"
    matrix: np.ndarray
    inverse: np.ndarray
    which: np.ndarray


class Meshes:
    """The meshes of visibility.shown(), as physics.rays.trace() takes surfaces; valid as long as their depsgraph.

    Faces with an interface node bend rays, all others stop them. `unknown` names the materials whose media a link
    decides: what it gives is not known here, so rays stop there as well. `bounds` maps each object (its original) to
    the two corners of its interfaces, and is empty where there is none; `low` and `high` are those of all, `size` the
    distance between them. `gap` is more than the rounding of a hit, for trace().

    A bend uses the interpolated normal, as Cycles does: with the faces' own, a beam through a round but coarse mesh
    comes out as one bundle a face.
    """

    def __init__(self, things: Iterable[Shown], depsgraph: bpy.types.Depsgraph):
        self.interfaces, self.unknown, self.bounds = [], set(), {}
        self._bodies, boxes, meshes, known = [], [], {}, {}
        far = 0.0
        for one in things:
            matrix = np.array(one.matrix.copy(), float)
            if np.linalg.det(matrix[:3, :3]) == 0:
                continue
            key = one.mesh.as_pointer()
            if key not in meshes:
                meshes[key] = _Mesh(one, depsgraph)
            mesh = meshes[key]
            if not mesh.faces:
                continue
            for material in one.materials:
                if material not in known:
                    known[material] = self._which(material)
            which = np.array([known[material] for material in one.materials])
            inside = mesh.points(which >= 0)
            if len(inside):
                bends = inside @ matrix[:3, :3].T + matrix[:3, 3]
                low, high = self.bounds.get(one.original, (np.inf, -np.inf))
                self.bounds[one.original] = np.minimum(low, bends.min(axis=0)), np.maximum(high, bends.max(axis=0))
                # Blender casts in single precision, in the mesh's own space
                far = max(far, np.abs(bends).max(), np.abs(matrix[:3, :3]).max() * np.abs(mesh.box).max())
            self._bodies.append(_Body(mesh, matrix, np.linalg.inv(matrix), which))
            corners = np.array(np.meshgrid(*mesh.box.T)).reshape(3, -1).T @ matrix[:3, :3].T + matrix[:3, 3]
            boxes.append((corners.min(axis=0), corners.max(axis=0)))
        if self.bounds:
            self.low = np.min([low for low, _ in self.bounds.values()], axis=0)
            self.high = np.max([high for _, high in self.bounds.values()], axis=0)
            self.size = float(np.linalg.norm(self.high - self.low))
        self.gap = 1e-6 * far
        self._boxes = np.array(boxes).reshape(-1, 2, 3)

    def _which(self, material):
        """Index of the material's interface, -1 where rays end at it."""
        found = asked_interfaces(material)
        if not found:
            return -1
        interface = interface_of(*found[0])
        if interface is None:
            self.unknown.add(material.name)
            return -1
        if interface not in self.interfaces:
            self.interfaces.append(interface)
        return self.interfaces.index(interface)

    def hit(self, origins: np.ndarray, directions: np.ndarray) -> Hit:
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
        inverse = np.array([one.inverse for one in self._bodies])[body]
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
        along = np.where(directions == 0, 1e-300, directions)[:, None]
        near, far = (
            np.full((len(origins), len(self._boxes)), -np.inf),
            np.full((len(origins), len(self._boxes)), np.inf),
        )
        with np.errstate(over="ignore"):
            for axis in range(3):
                low = (self._boxes[:, 0, axis] - self.gap - origins[:, None, axis]) / along[..., axis]
                high = (self._boxes[:, 1, axis] + self.gap - origins[:, None, axis]) / along[..., axis]
                near, far = np.maximum(near, np.minimum(low, high)), np.minimum(far, np.maximum(low, high))
        ray, body = np.nonzero((near <= far) & (far >= 0))
        entry = np.maximum(near[ray, body], 0)
        order = np.lexsort((entry, ray))
        return ray[order], body[order], entry[order]


class _Mesh:
    """An evaluated mesh, of which only what is asked for is read: a mesh of millions of faces is in memory once."""

    def __init__(self, one, depsgraph):
        self.data, self._depsgraph, self._tree = one.mesh, depsgraph, None
        self.faces = len(self.data.polygons)
        if not self.faces:
            return
        vertices = self._vertices()
        self.box = np.stack([vertices.min(axis=0), vertices.max(axis=0)]).astype(float)
        self._object = one.object

    @property
    def tree(self):
        """The tree of its triangles, made when it is first asked for."""
        if self._tree is None:
            self._tree = self._made()
        return self._tree

    def _made(self):
        if self._object.data == self.data:
            return BVHTree.FromObject(self._object, self._depsgraph)
        # a mesh that geometry nodes or curves made has an object only while its instances are gone through
        made = None
        for instance in self._depsgraph.object_instances:  # to its end: Blender leaks one that is broken off
            if made is None and instance.object.data == self.data:
                made = BVHTree.FromObject(instance.object, self._depsgraph)
        return made

    def _vertices(self):
        return _read(self.data.vertices, "co", 3, np.float32)

    def points(self, chosen):
        """(N, 3) the vertices, those of all faces whose slot is `chosen` (slots,), bool, among them."""
        if chosen.all() or not chosen.any():
            return self._vertices() if chosen.any() else ()
        slot = _read(self.data.polygons, "material_index", 1, np.int32)[:, 0]
        corners = _read(self.data.polygons, "loop_total", 1, np.int32)[:, 0]
        own = np.repeat(chosen[np.minimum(slot, len(chosen) - 1)], corners)
        return self._vertices()[_read(self.data.loops, "vertex_index", 1, np.int32)[own, 0]]

    def triangles(self, face):
        """The corners and the normals at them (T, 3, 3) of the triangles of a face."""
        data = self.data
        data.calc_loop_triangles()
        polygon = data.polygons[face]
        # a face of k corners has k - 2 triangles
        first = polygon.loop_start - 2 * face
        chosen = [data.loop_triangles[i] for i in range(first, first + polygon.loop_total - 2)]
        corners = np.array([[data.vertices[i].co for i in one.vertices] for one in chosen], float)
        if data.normals_domain == "FACE":
            return corners, np.broadcast_to(np.array(data.polygon_normals[face].vector, float), corners.shape)
        if data.normals_domain == "POINT":
            return corners, np.array([[data.vertex_normals[i].vector for i in one.vertices] for one in chosen], float)
        return corners, np.array([[data.corner_normals[i].vector for i in one.loops] for one in chosen], float)


def _exactly(body, face, origin, direction):
    """Where a ray meets a face of a _Body that it is known to meet: the distance, the normal (3,), the slot.

    The tree says which face, in single precision; where it is met is worked out again in double.
    """
    linear = body.matrix[:3, :3]
    corners, normals = body.mesh.triangles(face)
    corners, normals = corners @ linear.T + body.matrix[:3, 3], _unit_or_zero(normals @ body.inverse[:3, :3])
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
    one = int(np.argmax(weights.min(axis=-1)))  # the triangle of the face that it lies in
    facing, along = facing[one], along[one]
    normal = _unit_or_zero(np.clip(np.nan_to_num(weights[one], neginf=0), 0, 1) @ normals[one])
    # near the rim of a smooth mesh its normals look away from the ray, or mirror it through the face
    towards = direction @ normal
    mirrored = along - 2 * towards * (normal @ facing)
    if towards * along <= 0 or mirrored * along >= 0:
        normal = facing
    slot = min(body.mesh.data.polygons[face].material_index, len(body.which) - 1)
    return float(distance[one]), normal, slot


def _read(items, name, width, kind):
    values = np.empty((len(items), width), kind)
    items.foreach_get(name, values.ravel())
    return values


def _dot(a, b):
    return np.sum(a * b, axis=-1)


def _unit_or_zero(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)

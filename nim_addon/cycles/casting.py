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
# Up to so many triangles are compared with all rays at once, in less time than a tree takes for a ray.
FEW = 64
EDGE = 1e-9  # of a triangle's size, so that no ray passes between two


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
    """The meshes of visibility.shown(), as physics.rays.trace() takes surfaces, to be cast at while their depsgraph is valid.

    Faces with an interface node bend rays, those of another law (cycles.laws) take them elsewhere, all others stop them.
    `unknown` names the materials whose media a link decides: what it gives is not known here, so rays stop there as well.
    `rough` names those with a rough surface, where rays go as by a smooth one, in the middle of what is scattered. `bounds`
    maps each object (its original) to the two corners of its interfaces, and is empty where there is none; `low` and `high`
    are those of all, `size` the distance between them. `gap` is more than the rounding of a hit, for trace(): Blender's trees
    find the face, in single precision, and where a ray meets it is worked out again in double. `left_out` names the objects
    whose meshes have more faces than `kept` allows: rays pass through them.

    kept: what of the meshes may be known already, and is to be known the next time

    A bend uses the interpolated normal, as Cycles does: with the faces' own, a beam through a round but coarse mesh
    comes out as one bundle a face.
    """

    def __init__(self, surfaces: Iterable[Shown], depsgraph: bpy.types.Depsgraph, kept: Kept | None = None):
        self.interfaces: list[Interface | Law] = []
        self.bounds = {}
        self.unknown, self.rough, self.left_out = set(), set(), set()
        self._bodies, boxes, known_materials = [], [], {}
        kept = Kept() if kept is None else kept
        far = 0.0
        for surface in surfaces:
            matrix = np.array(surface.matrix.copy(), float)
            if np.linalg.det(matrix[:3, :3]) == 0:
                continue
            mesh = kept.mesh(surface, depsgraph)
            if not mesh.faces:
                continue
            if mesh.faces > kept.largest:
                self.left_out.add(surface.original.name)
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
        kept.leave_unused()

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
            ray, at, towards, slot = self._met(origins[rays], directions[rays])
            # the nearest of each ray, the first found where two are as near
            order = np.lexsort((at, ray))
            _, first = np.unique(ray[order], return_index=True)
            chosen = order[first]
            there = start + ray[chosen]
            distance[there], normal[there], which[there] = at[chosen], towards[chosen], slot[chosen]
        return Hit(distance, normal, which)

    def _met(self, origins, directions):
        """Hits (H,) that may be the nearest of their rays: indices of those, distances, normals (H, 3), interfaces."""
        ray, body, face = self._faces(origins, directions)
        distance, normal, which = np.zeros(len(ray)), np.zeros((len(ray), 3)), np.full(len(ray), -1)
        for j in np.unique(body):
            rows = np.flatnonzero(body == j)
            one = self._bodies[j]
            distance[rows], normal[rows] = _exactly(one, face[rows], origins[ray[rows]], directions[ray[rows]])
            which[rows] = one.which[np.minimum(one.mesh.slots[face[rows]], len(one.which) - 1)]
        return ray, distance, normal, which

    def _faces(self, origins, directions):
        """What _met() looks at: rays, bodies, and faces of theirs that they meet, three arrays (H,) of indices."""
        ray, body, entry = self._candidates(origins, directions)
        if not len(ray):
            return ray, body, ray
        inverse = np.array([body.inverse for body in self._bodies])[body]
        starts = np.einsum("nij,nj->ni", inverse[:, :3, :3], origins[ray]) + inverse[:, :3, 3]
        ways = np.einsum("nij,nj->ni", inverse[:, :3, :3], directions[ray])
        lengths = np.linalg.norm(ways, axis=1)
        face, away = np.full(len(ray), -1), np.full(len(ray), np.inf)
        small = np.array([body.mesh.is_small for body in self._bodies])[body]
        for j in np.unique(body[small]):
            rows = np.flatnonzero(body == j)
            face[rows], away[rows] = self._bodies[j].mesh.meet(starts[rows], ways[rows])
        nearest = np.full(len(origins), np.inf)
        np.minimum.at(nearest, ray, away)
        # a hit in single precision is good enough to leave out what lies behind it
        behind, nearest = 1 + 1e-5, nearest.tolist()
        rows = np.flatnonzero(~small)
        columns = (column[rows].tolist() for column in (ray, body, entry, lengths, starts, ways))
        for row, i, j, near, length, start, way in zip(rows.tolist(), *columns, strict=True):
            if near > nearest[i] * behind + self.gap:
                continue
            *_, index, distance = self._bodies[j].mesh.tree.ray_cast(start, way)
            if index is not None:
                face[row], away[row] = index, distance / length
                nearest[i] = min(nearest[i], distance / length)
        chosen = (face >= 0) & (away <= np.array(nearest)[ray] * behind + self.gap)
        return ray[chosen], body[chosen], face[chosen]

    def _candidates(self, origins, directions):
        """Rays and the bodies whose bounds they meet, and how far away, each ray's nearest first: three arrays (P,)."""
        entry = entries(origins, directions, self._boxes[:, 0], self._boxes[:, 1], self.gap)
        ray, body = np.nonzero(np.isfinite(entry))
        entry = entry[ray, body]
        order = np.lexsort((entry, ray))
        return ray[order], body[order], entry[order]


class Kept:
    """Meshes as they were read for rays, for the next Meshes of the same scene: a tree takes longer than a thousand rays.

    Whoever keeps one tells it by changed() of all that depsgraphs update, and forgets it with the file, or with its state.
    A mesh is known by its address, which another one may have only after such an update.

    largest: meshes of more faces are left out
    trees:   how many were made
    meshes:  that are known, by their addresses
    """

    def __init__(self, largest: float = np.inf):
        self.largest, self.trees = largest, 0
        self.meshes, self._used = {}, set()

    def mesh(self, surface: Shown, depsgraph: bpy.types.Depsgraph) -> _Mesh:
        """The mesh of what is shown, as it was read before if it was."""
        key, data = surface.mesh.as_pointer(), surface.mesh
        known = self.meshes.get(key)
        if known is None or known.counts != _counts(data):
            known = self.meshes[key] = _Mesh(data, self)
        known.stands_in(surface, depsgraph)
        self._used.add(key)
        return known

    def leave_unused(self) -> None:
        """Forget the meshes that have not been asked for since the last time."""
        self.meshes = {key: mesh for key, mesh in self.meshes.items() if key in self._used}
        self._used = set()

    def changed(self, update: bpy.types.DepsgraphUpdate) -> None:
        """Forget what a depsgraph's update says is another shape now."""
        if update.is_updated_geometry:
            uid = update.id.original.session_uid
            self.meshes = {key: mesh for key, mesh in self.meshes.items() if uid not in mesh.owners}


def _counts(data):
    return len(data.vertices), len(data.loops), len(data.polygons)


class _Mesh:
    """An evaluated mesh, of which only what is asked for is read, once; later it is not looked at any more.

    owners: session_uids of the objects and of the mesh in the file that it comes of
    """

    def __init__(self, data, kept):
        self.counts, self.owners, self._kept = _counts(data), set(), kept
        self.faces = len(data.polygons)
        if self.faces:
            self.box = np.stack(meshes.bounds(meshes.vertices(data))).astype(float)

    def stands_in(self, surface, depsgraph):
        """Be read, from now on, from what is shown in a depsgraph."""
        self.data, self._object, self._depsgraph = surface.mesh, surface.object, depsgraph
        owners = (surface.original, surface.original.data, surface.parent)
        self.owners.update(owner.session_uid for owner in owners if owner)

    @cached_property
    def tree(self):
        """The tree of its triangles, made when it is first asked for."""
        self._kept.trees += 1
        if self._object.data == self.data:
            return BVHTree.FromObject(self._object, self._depsgraph)
        # a mesh that geometry nodes or curves made has an object only while its instances are gone through
        tree = None
        for instance in self._depsgraph.object_instances:  # to its end: Blender leaks one that is broken off
            if tree is None and instance.object.data == self.data:
                tree = BVHTree.FromObject(instance.object, self._depsgraph)
        return tree

    @cached_property
    def slots(self):
        """(F,) material index of each face."""
        return meshes.read(self.data.polygons, "material_index", dtype=np.int32)

    @cached_property
    def vertices(self):
        """(V, 3) float32, in its own coordinates."""
        return meshes.vertices(self.data)

    @cached_property
    def starts(self):
        """(F + 1,) where the corners of each face begin."""
        return meshes.starts(self.data)

    @cached_property
    def corners(self):
        """(T, 3) the corners of its triangles: a face of k corners has k - 2 of them, one after the other."""
        return meshes.triangles(self.data, "loops")

    @cached_property
    def corner_vertices(self):
        """(L,) the vertex of each corner."""
        return meshes.corners(self.data)

    @cached_property
    def normals(self):
        """Whether they are of a "FACE", a "POINT" or a "CORNER", and those: (N, 3)."""
        domain = self.data.normals_domain
        vectors = {"FACE": "polygon_normals", "POINT": "vertex_normals", "CORNER": "corner_normals"}[domain]
        return domain, meshes.read(getattr(self.data, vectors), "vector", 3)

    @property
    def is_small(self):
        """Whether meet() is quicker than the tree."""
        return self.counts[1] - 2 * self.faces <= FEW

    @cached_property
    def _planes(self):
        """Of its triangles (T,) their faces, first corners, normals, and what gives the shares of the other corners (T, 3)."""
        a, b, c = np.moveaxis(self.vertices[self.corner_vertices[self.corners]].astype(float), 1, 0)
        b, c = b - a, c - a
        normal = np.cross(b, c)
        with np.errstate(divide="ignore", invalid="ignore"):
            area = _dot(normal, normal)[:, None]
            shares = np.cross(c, normal) / area, np.cross(normal, b) / area
        return np.repeat(np.arange(self.faces), np.diff(self.starts) - 2), a, normal, *shares

    def meet(self, origins, directions):
        """The faces (N,) that rays, in its own coordinates, meet first, -1 for none; and how far away, in `directions`."""
        face, corner, *vectors = self._planes
        above, b, c = (origins @ vector.T - _dot(corner, vector) for vector in vectors)
        along, to_b, to_c = (directions @ vector.T for vector in vectors)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            away = -above / along
            b, c = b + away * to_b, c + away * to_c
            met = (away >= 0) & (b >= -EDGE) & (c >= -EDGE) & (b + c <= 1 + EDGE)
        away = np.where(met, away, np.inf)
        first = np.argmin(away, axis=1)
        away = away[np.arange(len(away)), first]
        return np.where(np.isfinite(away), face[first], -1), away

    def points(self, chosen):
        """(N, 3) the vertices, those of all faces whose slot is `chosen` (slots,), bool, among them."""
        if chosen.all() or not chosen.any():
            return self.vertices if chosen.any() else ()
        own = chosen[np.clip(self.slots, 0, len(chosen) - 1)]
        return self.vertices[self.corner_vertices[np.repeat(own, np.diff(self.starts))]]

    def triangles(self, faces):
        """Of the triangles (T,) of faces (K,): which of those each is of, its corners and the normals at them (T, 3, 3)."""
        begin = self.starts[faces]
        count = self.starts[faces + 1] - begin - 2
        of = np.repeat(np.arange(len(faces)), count)
        before = np.cumsum(count) - count
        corners = self.corners[np.arange(len(of)) + np.repeat(begin - 2 * faces - before, count)]
        vertices = self.corner_vertices[corners]
        domain, normals = self.normals
        chosen = {"FACE": np.broadcast_to(faces[of, None], (len(of), 3)), "POINT": vertices, "CORNER": corners}[domain]
        return of, self.vertices[vertices].astype(float), normals[chosen].astype(float)


def _exactly(body, faces, origins, directions):
    """Where rays meet faces (K,) of a _Body that they are known to meet: distances (K,), normals (K, 3).

    The tree says which face, in single precision; where it is met is worked out again in double.
    """
    linear = body.matrix[:3, :3]
    of, corners, normals = body.mesh.triangles(faces)
    origin, direction = origins[of], directions[of]
    corners, normals = meshes.moved(corners, body.matrix), _unit_or_zero(normals @ body.inverse[:3, :3])
    a, b, c = np.moveaxis(corners, 1, 0)
    # a mirrored object has its normals on the same side as before, though its corners run the other way round
    facing = _unit_or_zero(np.cross(b - a, c - a) * np.sign(np.linalg.det(linear)))
    along = _dot(facing, direction)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.maximum(np.nan_to_num(_dot(a - origin, facing) / along), 0)
        at = origin + distance[:, None] * direction
        # areas of the triangles between the point and two of the corners
        weights = np.stack([_dot(np.cross(q - at, r - at), facing) for q, r in ((b, c), (c, a), (a, b))], -1)
        weights = np.nan_to_num(weights / weights.sum(axis=-1, keepdims=True), nan=-np.inf)
    # the triangle of each face that it lies in
    _, first = np.unique(of, return_index=True)
    met = np.lexsort((-weights.min(axis=-1), of))[first]
    facing, along, direction = facing[met], along[met], direction[met]
    normal = _unit_or_zero(np.einsum("nk,nki->ni", np.clip(np.nan_to_num(weights[met], neginf=0), 0, 1), normals[met]))
    # near the rim of a smooth mesh its normals look away from the ray, or mirror it through the face
    towards = _dot(direction, normal)
    mirrored = along - 2 * towards * _dot(normal, facing)
    wrong = (towards * along <= 0) | (mirrored * along >= 0)
    return distance[met], np.where(wrong[:, None], facing, normal)


def _dot(a, b):
    return np.sum(a * b, axis=-1)


def _unit_or_zero(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that rays meet, cast by Blender's trees."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree
from numpy.typing import ArrayLike, NDArray

from ..physics import Interface
from ..physics.laws import Law
from ..physics.rays import Hit
from . import meshes
from .facets import Body, dot
from .laws import asked_law, law_of
from .material import asked_interfaces, interface_of, is_rough
from .visibility import Shown

# Rays times meshes whose bounds are compared at once.
AT_ONCE = 1_000_000
# Up to so many triangles are compared with all rays at once, in less time than a tree takes for a ray.
FEW = 64
BEHIND = 1 + 1e-5  # times as far as a hit in single precision there may be a nearer one
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


class Meshes:
    """The meshes of visibility.shown(), as physics.rays.trace() takes surfaces, to be cast at while their depsgraph is valid.

    Faces with an interface node bend rays, those of another law (cycles.laws) take them elsewhere, all others stop them.
    `unknown` names the materials whose media a link decides: what it gives is not known here, so rays stop there as well.
    `rough` names those with a rough surface, where rays go as by a smooth one, in the middle of what is scattered. `bounds`
    maps each object (its original) to the two corners of its interfaces, and is empty where there is none; `low` and `high`
    are those of all, `size` the distance between them. `gap` is more than the rounding of a hit, for trace(): Blender's trees
    find the face, in single precision, and where a ray meets it is worked out again in double. `left_out` names the objects
    whose meshes have more faces than `kept` allows, `placeless` those with a vertex whose coordinates are no finite numbers: rays
    pass through them.

    kept: what of the meshes may be known already, and is to be known the next time

    A bend uses the interpolated normal, as Cycles does: with the faces' own, a beam through a round but coarse mesh
    comes out as one bundle a face.
    """

    def __init__(self, surfaces: Iterable[Shown], depsgraph: bpy.types.Depsgraph, kept: Kept | None = None):
        self.interfaces: list[Interface | Law] = []
        self.bounds = {}
        self.unknown, self.rough, self.left_out, self.placeless = set(), set(), set(), set()
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
            if not (np.abs(mesh.box) < meshes.ENDLESS).all():
                self.placeless.add(surface.original.name)
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
            self._bodies.append(Body(mesh, matrix, np.linalg.inv(matrix), which))
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
        ray, body, entry = self._candidates(origins, directions)
        face, away, nearest = np.full(len(ray), -1), np.full(len(ray), np.inf), np.full(len(origins), np.inf)
        rows_of = {j: np.flatnonzero(body == j) for j in np.unique(body).tolist()}
        small = {j: rows for j, rows in rows_of.items() if self._bodies[j].mesh.is_small}
        shares = np.zeros((len(ray), 2))
        for j, rows in small.items():
            starts, ways = self._bodies[j].within(origins[ray[rows]], directions[ray[rows]])
            face[rows], away[rows], shares[rows] = self._bodies[j].mesh.meet(starts, ways)
            nearest[ray[rows]] = np.minimum(nearest[ray[rows]], away[rows])  # each ray meets a body once
        if len(small) < len(rows_of):
            self._cast(origins, directions, (ray, body, entry), face, away, nearest)
        # a hit in single precision is good enough to leave out what lies behind it
        chosen = (face >= 0) & (away <= nearest[ray] * BEHIND + self.gap)
        distance, normal, which = away.copy(), np.zeros((len(ray), 3)), np.full(len(ray), -1)
        for j, rows in rows_of.items():
            rows, one = rows[chosen[rows]], self._bodies[j]
            if not len(rows):
                continue
            faces, towards = face[rows], directions[ray[rows]]
            if j in small:
                normal[rows] = one.smooth(faces, shares[rows], towards)
                faces = one.mesh.face_of[faces]
            else:
                distance[rows], normal[rows] = one.exactly(faces, origins[ray[rows]], towards)
            which[rows] = one.which[np.minimum(one.mesh.slots[faces], len(one.which) - 1)]
        return ray[chosen], distance[chosen], normal[chosen], which[chosen]

    def _cast(self, origins, directions, candidates, face, away, nearest):
        """Note the faces (P,) that candidates meet by their trees, and how far away; `nearest` (N,) is of each ray."""
        large = np.array([not body.mesh.is_small for body in self._bodies])[candidates[1]]
        ray, body, entry = (column[large] for column in candidates)
        inverse = np.array([body.inverse for body in self._bodies])[body]
        starts = np.einsum("nij,nj->ni", inverse[:, :3, :3], origins[ray]) + inverse[:, :3, 3]
        ways = np.einsum("nij,nj->ni", inverse[:, :3, :3], directions[ray])
        columns = ray, body, entry, np.linalg.norm(ways, axis=1), starts, ways
        least = nearest.tolist()
        found = []
        for i, j, near, length, start, way in zip(*(column.tolist() for column in columns), strict=True):
            index = None
            if near <= least[i] * BEHIND + self.gap:
                *_, index, distance = self._bodies[j].mesh.tree.ray_cast(start, way)
            if index is None:
                found.append((-1, np.inf))
                continue
            found.append((index, distance / length))
            least[i] = min(least[i], distance / length)
        nearest[:] = least
        face[large], away[large] = zip(*found, strict=True)

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
    def face_of(self):
        """(T,) the face of each of its triangles."""
        return np.repeat(np.arange(self.faces), np.diff(self.starts) - 2)

    @cached_property
    def _planes(self):
        """Of its triangles (T,) their first corners, normals, and what gives the shares of the other corners (T, 3)."""
        a, b, c = np.moveaxis(self.vertices[self.corner_vertices[self.corners]].astype(float), 1, 0)
        b, c = b - a, c - a
        normal = np.cross(b, c)
        with np.errstate(divide="ignore", invalid="ignore"):
            area = dot(normal, normal)[:, None]
            shares = np.cross(c, normal) / area, np.cross(normal, b) / area
        return a, normal, *shares

    def meet(self, origins, directions):
        """What rays, in its own coordinates, meet first.

        Returns triangles (N,), -1 for none; how far away, in `directions`; and the shares (N, 2) of second and third corners.
        """
        corner, *vectors = self._planes
        above, b, c = (origins @ vector.T - dot(corner, vector) for vector in vectors)
        along, to_b, to_c = (directions @ vector.T for vector in vectors)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            away = -above / along
            b, c = b + away * to_b, c + away * to_c
            met = (away >= 0) & (b >= -EDGE) & (c >= -EDGE) & (b + c <= 1 + EDGE)
        away = np.where(met, away, np.inf)
        first = np.argmin(away, axis=1)
        there = np.arange(len(away)), first
        away = away[there]
        return np.where(np.isfinite(away), first, -1), away, np.stack([b[there], c[there]], axis=-1)

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
        return of, *self.corners_of(faces[of], np.arange(len(of)) + np.repeat(begin - 2 * faces - before, count))

    def corners_of(self, faces, triangles):
        """The corners of triangles (T,) of faces (T,), and the normals at them, (T, 3, 3)."""
        corners = self.corners[triangles]
        vertices = self.corner_vertices[corners]
        domain, normals = self.normals
        chosen = {"FACE": np.broadcast_to(faces[:, None], corners.shape), "POINT": vertices, "CORNER": corners}[domain]
        return self.vertices[vertices].astype(float), normals[chosen].astype(float)

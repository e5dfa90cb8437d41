# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh encloses: its parts, their holes and sides, on vertices welded by distance; numpy, no materials.

Files often give each face vertices of its own (every STL, most glTF): what lies in the same place is one vertex here.
A part is what hangs together by edges of two faces. An edge of three or more, where a liquid meets the wall of its
glass, is a seam between parts and no hole.
"""

from collections import Counter
from functools import cached_property
from itertools import product
from typing import NamedTuple

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from ..cycles import meshes
from ..cycles.meshes import bounds

# Vertices on the rim of a hole are one where they are nearer than this, relative to the size of the mesh.
WELD = 1e-5
# How much of the faces' area looks one way in a sheet: all where it is flat, half in a bowl.
SHEET = 0.75


class Part(NamedTuple):
    """A piece of a mesh that hangs together.

    holes:      edges with but one face
    seams:      edges where it ends but other parts go on
    agreeing:   whether neighbours have the same side outside
    orientable: whether they can have
    volume:     enclosed, in the mesh's own units, negative where the faces point inwards; once neighbours agree
    area, net:  the sum of the faces' areas, and the length of the sum of their area vectors: 0 for what is closed
    faces:      how many
    """

    holes: int
    seams: int
    agreeing: bool
    orientable: bool
    volume: float
    area: float
    net: float
    faces: int

    @property
    def closed(self) -> bool:
        """Whether it has an inside and an outside by itself."""
        return not (self.holes or self.seams) and self.orientable

    @property
    def is_sheet(self) -> bool:
        """Whether its faces look one way, so that it bounds a half-space rather than a body."""
        return self.net > SHEET * self.area


class Rim(NamedTuple):
    """The edges that have but one face: start and end vertex as the face runs, vertices of the mesh, and the face."""

    start: np.ndarray
    end: np.ndarray
    face: np.ndarray


class _Edges(NamedTuple):
    """Corners (N,) where edges begin: the edge, where it starts and ends, the face; and the faces of each edge (E,)."""

    edge: np.ndarray
    faces: np.ndarray
    start: np.ndarray
    end: np.ndarray
    face: np.ndarray
    loop: np.ndarray


class Solid:
    """The parts of a bpy.types.Mesh, in its own coordinates; keeps no Blender data.

    points:    (V, 3) vertices; corners: (L,) their indices by face; begins: (F + 1,) where each face's corners begin
    material:  (F,) material index
    area:      (F, 3) area vector of each face, along its normal
    part:      (F,) index into `parts` of each face
    turned:    (F,) whether a face must be turned for its part to agree
    doubled:   (F,) whether another face before it has the same vertices; backed: and looks the other way
    parts:     tuple of Part
    rim:       Rim
    """

    def __init__(self, mesh: bpy.types.Mesh):
        with np.errstate(all="ignore"):  # of coordinates that are no numbers, or nearly too large
            self._read(mesh)
            self._divide(self._welded(mesh))

    def _read(self, mesh):
        count = len(mesh.polygons)
        self.points = np.nan_to_num(meshes.vertices(mesh), posinf=0, neginf=0)
        self.corners, self.begins = meshes.corners(mesh), meshes.starts(mesh)
        self.material = meshes.read(mesh.polygons, "material_index", dtype=np.int32)
        used = np.zeros(len(self.points), bool)
        used[self.corners] = True
        self.low, self.high = bounds(self.points[used])
        self.size = float(np.linalg.norm(self.high - self.low))
        places = self.points - ((self.low + self.high) / 2).astype(np.float32)
        if len(self.corners) == 3 * count:
            a, b, c = np.moveaxis(places[self.corners.reshape(-1, 3)], 1, 0)
            self.area = np.cross(b - a, c - a).astype(float) / 2
        else:
            a = places[self.corners[self.begins[:-1]]]
            legs = places[self.corners] - a[self._faces()]
            self.area = np.add.reduceat(np.cross(legs, legs[self._ahead()]), self.begins[:-1]).astype(float) / 2
        self._volumes = np.einsum("ij,ij->i", a, self.area) / 3

    def _faces(self):
        """(L,) the face of each corner."""
        return np.repeat(np.arange(self.count, dtype=np.int32), np.diff(self.begins))

    def _ahead(self):
        """(L,) the corner after each, round its face."""
        ahead = np.arange(1, len(self.corners) + 1, dtype=np.int32)
        ahead[self.begins[1:] - 1] = self.begins[:-1]
        return ahead

    @property
    def count(self) -> int:
        """How many faces."""
        return len(self.material)

    def _welded(self, mesh):
        """The _Edges, once each vertex has in self.same the number of the first one in its place."""
        _, first, same = np.unique(_words(self.points), return_index=True, return_inverse=True)
        self.same = first[same.ravel()]
        alone = len(first) == len(self.points)
        edges = self._edges(meshes.corner_edges(mesh) if alone else None)
        lonely = edges.faces[edges.edge] == 1
        if not lonely.any():
            return edges
        # only what is on a rim: elsewhere small things may stay small
        start, end = edges.start[lonely], edges.end[lonely]
        ends = np.unique([start, end])
        # what is nearer than coordinates are exact is in one place: a pole of a NURBS sphere is a ring of such points
        exact = 4 * float(np.spacing(np.abs(self.points[ends]).max()))
        length = np.median(np.linalg.norm(self.points[start] - self.points[end], axis=1))
        reach = min(WELD * self.size, max(length / 4, exact))
        pairs = [np.zeros((0, 2), int)]
        for shift in product((0, 0.5), repeat=3) if reach > 0 else ():
            cells = np.floor((self.points[ends] - self.low) / (2 * reach) + shift).astype(np.int64)
            _, first, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
            pairs.append(np.stack([ends, ends[first[which.ravel()]]], -1))
        a, b = np.concatenate(pairs).T
        if (a == b).all():
            return edges
        self.same = components(len(self.points), a, b)[self.same]
        return self._edges()

    def _edges(self, edge=None):
        """The _Edges between the vertices of self.same; `edge`: (L,) those of the mesh, where nothing is welded."""
        start, faces = self.same[self.corners], self._faces()
        end = start[self._ahead()] if len(start) else start
        self.doubled, self.first = np.zeros(self.count, bool), None
        loops = slice(None)
        if edge is None:
            # a face that welding leaves without area joins its neighbours to each other
            sides = np.bincount(faces[start != end], minlength=self.count)
            loops = np.flatnonzero((start != end) & (sides[faces] > 2))
        found = self._counted(edge, start, end, faces, loops)
        if (found.faces > 2).any():
            # faces of the same vertices, whatever their order
            key = np.add.reduceat(_salt(len(self.points))[start], self.begins[:-1])
            _, first, which = np.unique(key, return_index=True, return_inverse=True)
            self.first = first[which.ravel()]
            self.doubled = self.first != np.arange(self.count)
            if self.doubled.any():
                kept = np.zeros(len(start), bool)
                kept[loops] = True
                found = self._counted(edge, start, end, faces, np.flatnonzero(kept & ~self.doubled[faces]))
        return found

    def _counted(self, edge, start, end, faces, loops):
        start, end = start[loops], end[loops]
        if edge is None:
            key = np.minimum(start, end).astype(np.int64) * len(self.points) + np.maximum(start, end)
            _, edge, count = np.unique(key, return_inverse=True, return_counts=True)
            edge = edge.ravel()
        else:
            edge = edge[loops]
            count = np.bincount(edge) if len(edge) else np.zeros(0, int)
        return _Edges(edge, count, start, end, faces[loops], np.arange(len(faces))[loops])

    def _divide(self, edges):
        two = edges.faces == 2
        first, last = np.zeros(len(two), np.int64), np.zeros(len(two), np.int64)
        order = np.arange(len(edges.edge))
        last[edges.edge] = order  # the last of an edge's loops stays
        first[edges.edge[::-1]] = order[::-1]
        first, last = first[two], last[two]
        f, g = edges.face[first], edges.face[last]
        opposed = edges.start[first] == edges.start[last]
        whole = components(self.count, f, g)
        whole = whole if self.first is None else whole[self.first]
        roots = np.flatnonzero(whole == np.arange(self.count))
        number = np.zeros(self.count, np.int32)
        number[roots] = np.arange(len(roots))
        self.part = number[whole]
        orientable, disagreeing = np.ones(len(roots), bool), np.zeros(len(roots), bool)
        self.turned = np.zeros(self.count, bool)
        size = np.linalg.norm(self.area, axis=1)
        if opposed.any():
            disagreeing[self.part[f[opposed]]] = True
            orientable = self._turn(f, g, opposed, roots, size)
        sign = np.where(self.turned, -1.0, 1.0) * ~self.doubled
        net = [np.bincount(self.part, self.area[:, axis] * sign, len(roots)) for axis in range(3)]
        holes, seams = self._ends_of(edges, len(roots))
        columns = (
            holes,
            seams,
            ~disagreeing,
            orientable,
            np.bincount(self.part, self._volumes * sign, len(roots)),
            np.bincount(self.part, size, len(roots)),
            np.linalg.norm(net, axis=0),
            np.bincount(self.part, minlength=len(roots)),
        )
        self.parts = tuple(Part(*values) for values in zip(*(column.tolist() for column in columns), strict=True))
        lonely = edges.faces[edges.edge] == 1
        ahead = self._ahead() if lonely.any() else edges.loop
        loops = edges.loop[lonely]
        self.rim = Rim(self.corners[loops], self.corners[ahead[loops]], edges.face[lonely])
        backed = np.einsum("ij,ij->i", self.area, self.area[self.first]) < 0 if self.first is not None else False
        self.backed = self.doubled & backed
        del self._volumes, self.first

    def _turn(self, f, g, opposed, roots, size):
        """Find the faces to be turned, in self.turned, the lesser area of each part; whether each part can agree."""
        # each face twice, as it is and turned: those that go together are the components
        count = self.count
        a, b = np.concatenate([f, f + count]), np.concatenate([g + count * opposed, g + count * ~opposed])
        both = components(2 * count, a, b)
        self.turned = (both[:count] != both[roots[self.part]]) & ~self.doubled
        whole = np.bincount(self.part, size * ~self.doubled, len(roots))
        most = np.bincount(self.part, size * self.turned, len(roots)) > whole / 2
        self.turned ^= most[self.part] & ~self.doubled
        return both[roots] != both[roots + count]

    def _ends_of(self, edges, parts):
        """Holes and seams of each part."""
        total = edges.faces[edges.edge]
        holes = np.bincount(self.part[edges.face[total == 1]], minlength=parts)
        many = total > 2
        own = edges.edge[many] * np.int64(max(parts, 1)) + self.part[edges.face[many]]
        own, count = np.unique(own, return_counts=True)
        seams = np.bincount((own % max(parts, 1))[count % 2 == 1], minlength=parts)
        return holes, seams

    @cached_property
    def tree(self) -> BVHTree:
        """The BVHTree of the faces, as polygons of the mesh."""
        return BVHTree.FromPolygons(self.points.tolist(), meshes.faces(self.corners, self.begins))

    def plane(self, part: int) -> tuple[np.ndarray, np.ndarray]:
        """The middle of a part and the mean normal of its faces, (3,) each, the latter not of unit length."""
        chosen = self.part == part
        weight = np.linalg.norm(self.area[chosen], axis=1)
        corners = self.points[self.corners[self.begins[:-1][chosen]]]
        return weight @ corners / max(weight.sum(), 1e-300), self.area[chosen].sum(axis=0) / max(weight.sum(), 1e-300)

    def samples(self, chosen: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places on the faces that `chosen` (F,) marks, spread over their area: points (N, 3), unit normals, faces (N,)."""
        which = np.flatnonzero(chosen & (np.einsum("ij,ij->i", self.area, self.area) > 0))
        if not len(which) or not count:
            return np.zeros((0, 3)), np.zeros((0, 3)), which[:0]
        run = np.cumsum(np.linalg.norm(self.area[which], axis=1))
        # not at halves: the mesh may be as regular as these are
        picks = np.searchsorted(run, run[-1] * (np.arange(count) + 0.382) / count)
        faces = which[np.minimum(picks, len(which) - 1)]
        places = np.array([self.place(face, turn) for turn, face in enumerate(faces.tolist(), start=1)])
        normals = self.area[faces]
        return places, normals / np.linalg.norm(normals, axis=1, keepdims=True), faces

    def place(self, face: int, turn: int = 0) -> np.ndarray:
        """A point (3,) on a face: near its middle, or elsewhere on it for another `turn`."""
        corners = self.points[self.corners[self.begins[face] : self.begins[face + 1]]].astype(float)
        a, b, c = corners[0], corners[1:-1], corners[2:]
        # triangles of a fan, which lie on the face where it is convex; the largest does so mostly
        sides = np.cross(b - a, c - a) @ self.area[face]
        best = int(np.argmax(sides))
        if turn and (sides > 0).all():
            best = min(int(np.searchsorted(np.cumsum(sides), sides.sum() * (turn * 0.569840 % 1))), len(sides) - 1)
        # as evenly spread as may be: the R2 sequence
        u, v = (0.41 + turn * 0.754878) % 1, (0.31 + turn * 0.569840) % 1
        u, v = (1 - u, 1 - v) if u + v > 1 else (u, v)
        u, v = 0.02 + 0.94 * u, 0.02 + 0.94 * v
        return (1 - u - v) * a + u * b[best] + v * c[best]

    def within(self, point: np.ndarray) -> set[int]:
        """The parts that a point (3,) lies within, by the parity of what two of three rays cross."""
        votes = Counter(part for direction in _DIRECTIONS for part in self.odd(point, direction))
        return {part for part, count in votes.items() if count > 1}

    def odd(self, point: np.ndarray, direction: np.ndarray) -> list[int]:
        """The parts that a ray crosses an odd number of times. point: (3,); direction: (3,), unit."""
        crossed = Counter()
        for _ in range(500):
            met, _, face, far = self.tree.ray_cast(point.tolist(), direction.tolist())
            if met is None:
                break
            if not self.doubled[face]:
                crossed[int(self.part[face])] += 1
            point = point + (far + 1e-6 * self.size) * direction
        return [part for part, count in crossed.items() if count % 2]

    def outlines(self) -> list[tuple[list[int], int]] | None:
        """For each hole its vertices, of the mesh, in the order in which a face that fills it runs, and a face at it.

        None where holes meet, so that it cannot be told which is which.
        """
        ahead = {}
        for start, end, face in zip(*(array.tolist() for array in self.rim), strict=True):
            if ahead.setdefault(int(self.same[end]), (end, int(self.same[start]), face))[2] != face:
                return None
        found = []
        while ahead:
            place = begin = next(iter(ahead))
            outline = []
            while place in ahead:
                vertex, place, face = ahead.pop(place)
                outline.append(vertex)
            if place != begin or len(outline) < 3:
                return None
            found.append((outline, face))
        return found


def components(count: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The lowest member, (count,), of the component that each of `count` members is in; a, b: (N,) pairs that are joined."""
    label = np.arange(count)
    while len(a):
        left, right = label[a], label[b]
        apart = left != right
        a, b, left, right = a[apart], b[apart], left[apart], right[apart]
        lower = np.minimum(left, right)
        np.minimum.at(label, np.maximum(left, right), lower)
        while not np.array_equal(label, step := label[label]):
            label = step
    return label


def _words(points):
    """A number for each place: the same for the same place, whichever sign a zero has."""
    bits = (points + np.float32(0)).view(np.uint32).astype(np.uint64)
    factors = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    words = (bits + np.uint64(1)) * factors
    words ^= words >> np.uint64(29)
    return (words * factors[::-1]).sum(axis=1, dtype=np.uint64)


# Of rays, along no symmetry of a mesh.
_DIRECTIONS = np.array([(0.267, 0.534, 0.802), (-0.771, 0.154, 0.617), (0.371, -0.906, -0.204)])
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)


def _salt(count):
    return np.random.default_rng(1).integers(0, 2**63, count, np.uint64)

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
    def closed(self):
        """Whether it has an inside and an outside by itself."""
        return not (self.holes or self.seams) and self.orientable

    @property
    def is_sheet(self):
        """Whether its faces look one way, so that it bounds a half-space rather than a body."""
        return self.net > SHEET * self.area


class Rim(NamedTuple):
    """The edges that have but one face: start and end vertex as the face runs, vertices of the mesh, and the face."""

    start: np.ndarray
    end: np.ndarray
    face: np.ndarray


class Solid:
    """The parts of a bpy.types.Mesh, in its own coordinates; keeps no Blender data.

    points:    (V, 3) vertices; corners: (L,) their indices by face; begins: (F + 1,) where each face's corners begin
    material:  (F,) material index
    area:      (F, 3) area vector of each face, along its normal
    part:      (F,) index into `parts` of each face
    turned:    (F,) whether a face must be turned for its part to agree
    doubled:   (F,) whether another face before it has the same vertices
    parts:     tuple of Part
    rim:       Rim
    """

    def __init__(self, mesh: bpy.types.Mesh):
        self._read(mesh)
        self._weld()
        self._divide()

    def _read(self, mesh):
        count = len(mesh.polygons)
        self.points = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", self.points.ravel())
        self.corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", self.corners)
        self.begins = np.empty(count + 1, np.int32)
        mesh.polygons.foreach_get("loop_start", self.begins[:-1])
        self.begins[-1] = len(self.corners)
        self.material = np.empty(count, np.int32)
        mesh.polygons.foreach_get("material_index", self.material)
        self.faces = np.repeat(np.arange(count), np.diff(self.begins))
        self.ahead = np.arange(1, len(self.corners) + 1)
        self.ahead[self.begins[1:] - 1] = self.begins[:-1]
        self.middle = self.points.mean(axis=0, dtype=float) if len(self.points) else np.zeros(3)
        self.low, self.high = bounds(self.points[self.corners])
        self.size = float(np.linalg.norm(self.high - self.low))
        places = self.points - self.middle.astype(np.float32)
        first = places[self.corners[self.begins[:-1]]]
        legs = (places[self.corners] - first[self.faces]).astype(float)
        fans = np.cross(legs, legs[self.ahead]) / 2
        self.area = np.add.reduceat(fans, self.begins[:-1]) if count else np.zeros((0, 3))
        self.volumes = np.einsum("ij,ij->i", first, self.area) / 3

    @property
    def count(self):
        """How many faces."""
        return len(self.material)

    def _weld(self):
        """Give each vertex the number of the first one in its place, in self.same; find edges."""
        _, first, same = np.unique(_words(self.points), return_index=True, return_inverse=True)
        self.same = first[same.ravel()]
        self._find_edges()
        lonely = self.edge_faces[self.edge] == 1
        if not lonely.any():
            return
        # only what is on a rim: elsewhere small things may stay small
        ends = np.unique([self._starts[lonely], self._ends[lonely]])
        lengths = np.linalg.norm(self.points[self._starts[lonely]] - self.points[self._ends[lonely]], axis=1)
        reach = min(WELD * self.size, np.median(lengths) / 4)
        pairs = [np.zeros((0, 2), int)]
        for shift in product((0, 0.5), repeat=3) if reach > 0 else ():
            cells = np.floor((self.points[ends] - self.low) / (2 * reach) + shift).astype(np.int64)
            _, one, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
            pairs.append(np.stack([ends, ends[one[which.ravel()]]], -1))
        a, b = np.concatenate(pairs).T
        if (a != b).any():
            self.same = components(len(self.points), a, b)[self.same]
            self._find_edges()

    def _find_edges(self):
        start = self.same[self.corners]
        end = start[self.ahead] if len(start) else start
        keys = _salt(len(self.points))[start]
        # faces of the same vertices, whatever their order
        key = np.add.reduceat(keys, self.begins[:-1]) if self.count else keys[:0]
        _, first, which = np.unique(key, return_index=True, return_inverse=True)
        self.doubled = first[which.ravel()] != np.arange(self.count)
        self.first = first[which.ravel()]
        # a face that welding leaves without area joins its neighbours to each other
        sides = np.bincount(self.faces[start != end], minlength=self.count)
        kept = (start != end) & (sides[self.faces] > 2) & ~self.doubled[self.faces]
        self._starts, self._ends, self._of = start[kept], end[kept], self.faces[kept]
        self._loops = np.flatnonzero(kept)
        low, high = np.minimum(self._starts, self._ends), np.maximum(self._starts, self._ends)
        _, edge, faces = np.unique(
            low.astype(np.int64) * len(self.points) + high, return_inverse=True, return_counts=True
        )
        self.edge, self.edge_faces = edge.ravel(), faces

    def _divide(self):
        forward = self._starts < self._ends
        order = np.argsort(self.edge, kind="stable")
        pairs = order[self.edge_faces[self.edge[order]] == 2].reshape(-1, 2)
        f, g = self._of[pairs].T
        opposed = forward[pairs[:, 0]] == forward[pairs[:, 1]]
        count = self.count
        whole = components(count, f, g)
        whole = whole[self.first] if self.doubled.any() else whole
        roots, self.part = np.unique(whole, return_inverse=True)
        self.part = self.part.ravel()
        self.turned, orientable = np.zeros(count, bool), np.ones(len(roots), bool)
        disagreeing = np.zeros(len(roots), bool)
        size = np.linalg.norm(self.area, axis=1)
        area = np.bincount(self.part, size, len(roots))
        if opposed.any():
            disagreeing[self.part[f[opposed]]] = True
            # each face twice, as it is and turned: those that go together are the components
            a, b = np.concatenate([f, f + count]), np.concatenate([g + count * opposed, g + count * ~opposed])
            both = components(2 * count, a, b)
            orientable = both[roots] != both[roots + count]
            self.turned = (both[:count] != both[roots[self.part]]) & ~self.doubled
            most = np.bincount(self.part, size * self.turned, len(roots)) > area / 2
            self.turned ^= most[self.part] & disagreeing[self.part]
        sign = np.where(self.turned, -1.0, 1.0)
        alone = ~self.doubled
        volume = np.bincount(self.part, self.volumes * sign * alone, len(roots))
        net = [np.bincount(self.part, self.area[:, axis] * sign * alone, len(roots)) for axis in range(3)]
        holes, seams = self._ends_of(len(roots))
        faces = np.bincount(self.part, minlength=len(roots))
        self.parts = tuple(
            Part(*map(int, (holes[i], seams[i])), not disagreeing[i], bool(orientable[i]), float(volume[i]), float(area[i]),
                 float(np.linalg.norm([axis[i] for axis in net])), int(faces[i]))
            for i in range(len(roots))
        )  # fmt: skip
        lonely = self.edge_faces[self.edge] == 1
        loops = self._loops[lonely]
        self.rim = Rim(self.corners[loops], self.corners[self.ahead[loops]], self._of[lonely])

    def _ends_of(self, parts):
        """Holes and seams of each part."""
        total = self.edge_faces[self.edge]
        holes = np.bincount(self.part[self._of[total == 1]], minlength=parts)
        many = total > 2
        own, count = np.unique(self.edge[many] * np.int64(parts) + self.part[self._of[many]], return_counts=True)
        seams = np.bincount((own % parts)[count % 2 == 1], minlength=parts) if parts else holes
        return holes, seams

    @cached_property
    def tree(self):
        """The BVHTree of the faces, as polygons of the mesh."""
        faces = np.split(self.corners, self.begins[1:-1]) if self.count else []
        return BVHTree.FromPolygons(self.points.tolist(), [face.tolist() for face in faces])

    @cached_property
    def part_bounds(self):
        """Lowest and highest coordinates of each part, (P, 3) each."""
        low, high = np.full((len(self.parts), 3), np.inf), np.full((len(self.parts), 3), -np.inf)
        part, points = self.part[self.faces], self.points[self.corners]
        np.minimum.at(low, part, points)
        np.maximum.at(high, part, points)
        return low, high

    def samples(self, chosen: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places on the faces that `chosen` (F,) marks, spread over their area: points (N, 3), unit normals, faces (N,)."""
        which = np.flatnonzero(chosen & (np.einsum("ij,ij->i", self.area, self.area) > 0))
        if not len(which):
            return np.zeros((0, 3)), np.zeros((0, 3)), which
        run = np.cumsum(np.linalg.norm(self.area[which], axis=1))
        # not at halves: the mesh may be as regular as these are
        picks = np.searchsorted(run, run[-1] * (np.arange(count) + 0.382) / count)
        faces = which[np.minimum(picks, len(which) - 1)]
        # the first point of a face near its middle, the others anywhere on it
        repeats = np.arange(count) - np.searchsorted(faces, faces)
        places = np.array([self.place(*pair) for pair in zip(faces.tolist(), repeats.tolist(), strict=True)])
        normals = self.area[faces]
        return places, normals / np.linalg.norm(normals, axis=1, keepdims=True), faces

    def place(self, face: int, repeat: int = 0) -> np.ndarray:
        """A point (3,) on a face, another for each `repeat`."""
        corners = self.points[self.corners[self.begins[face] : self.begins[face + 1]]].astype(float)
        a, b, c = corners[0], corners[1:-1], corners[2:]
        # triangles of a fan, which lie on the face where it is convex; the largest does so mostly
        sides = np.cross(b - a, c - a) @ self.area[face]
        if not repeat or (sides <= 0).any():
            best = np.argmax(sides)
        else:
            best = np.searchsorted(np.cumsum(sides), sides.sum() * (repeat * 0.7548777 % 1))
            best = min(best, len(sides) - 1)
        u, v = (0.41, 0.31) if not repeat else ((0.41 + repeat * 0.618034) % 1, (0.31 + repeat * 0.754878) % 1)
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
    """The lowest member, (count,), of the component that each of `count` things is in; a, b: (N,) pairs that are joined."""
    label = np.arange(count)
    while len(a):
        one, other = label[a], label[b]
        apart = one != other
        a, b, one, other = a[apart], b[apart], one[apart], other[apart]
        lower = np.minimum(one, other)
        np.minimum.at(label, np.maximum(one, other), lower)
        while not np.array_equal(label, step := label[label]):
            label = step
    return label


def bounds(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (3,) of points (N, 3); zeros where there is none."""
    return (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.zeros(3))


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

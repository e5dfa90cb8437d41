# SPDX-License-Identifier: GPL-3.0-or-later
"""Which medium lies around each interface, found by casting rays: what they meet first says what they have run through."""

from __future__ import annotations

import math
from collections import Counter
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..cycles import meshes
from ..cycles.casting import entries
from ..cycles.meshes import bounds
from ..cycles.visibility import PATHS_MARK
from ..physics import Medium
from .bodies import FRONT, LARGEST, NEAR, Body, Patch
from .sight import Sight
from .solids import Solid

PATCH_POINTS = 12  # on each patch
STANDING, PANEL_STANDING = 3_000_000, 200_000  # faces of all that may, and while a panel waits
MOST_VERTICES = 1000  # vertices that tell where an instance is
TOUCHED = 24  # points on each patch that may lie on faces of something else
AT_ONCE = 500_000  # rays times bodies
RAYS = 12_000  # in all, about: where there are many patches, fewer leave each
PANEL = 100  # patches of interfaces for which rays are cast while a panel waits
AIMS = 4  # rays from each point that are aimed at other interfaces
RIM_POINTS = 32  # places on the rim of an open part
SLANTS = (0.0, 0.8, 0.8, 0.8, 0.8)  # sines of the angles that rays leave at, evenly round the normal


class Hit(NamedTuple):
    """What a ray meets first: index of the body, face, its side (FRONT, BACK), and how far off."""

    body: int
    face: int
    side: str
    distance: float


class Surroundings:
    """The bodies of a scene, and what rays that leave an interface meet.

    bodies: list of Body, the interfaces among them and what else may stand in a ray's way
    memory: a dict in which what rays met is kept for the next time that the same meshes are in the same places
    blind:  whether there are too many interfaces for now, so that no rays are cast
    """

    blind = False
    eye = None  # (3,) where the camera is
    beyond = ()  # bounds (2, 3) of what is rendered elsewhere

    def __init__(self, bodies: list[Body], memory: dict | None = None):
        self.bodies = [body for body in bodies if body.solid.count and not body.flat]
        memory = {} if memory is None else memory
        key = [(body.solid, body.matrix.tobytes(), len(body.shown.materials), body.open) for body in self.bodies]
        if memory.get("key") != key:
            memory.clear()
            memory["key"] = key
        self._memory = memory
        self.lows = np.array([body.low for body in self.bodies]).reshape(-1, 3)
        self.highs = np.array([body.high for body in self.bodies]).reshape(-1, 3)

    @cached_property
    def patches(self) -> list[Patch]:
        """Those of interfaces."""
        found = []
        for index, body in enumerate(self.bodies):
            if body.media:
                count = len(body.shown.materials)
                for number in np.unique(body.solid.part.astype(np.int64) * count + body.slots()).tolist():
                    part, slot = divmod(number, count)
                    if slot in body.media:
                        found.append(Patch(index, part, slot))
        return found

    def cast(self, origin: NDArray, direction: NDArray) -> Hit | None:
        """The first thing that a ray meets, past what has a volume only. origin, direction: (3,), the latter unit."""
        return self.cast_all(np.array([origin], float), np.array([direction], float))[0]

    def cast_all(self, origins: NDArray, directions: NDArray) -> list[Hit | None]:
        """For each of several rays, (N, 3), the Hit or None."""
        found = []
        slack = 1e-6 * np.linalg.norm(self.highs - self.lows, axis=1)
        step = max(1, AT_ONCE // max(1, len(self.bodies)))
        for start in range(0, len(origins), step):
            rays = slice(start, start + step)
            enters = entries(origins[rays], directions[rays], self.lows, self.highs, slack)
            found += [self._first(*ray) for ray in zip(origins[rays], directions[rays], enters, strict=True)]
        return found

    def _first(self, origin, direction, enters):
        best = None
        which = np.flatnonzero(np.isfinite(enters))
        order = which[np.argsort(enters[which])]
        for index, enter in zip(order.tolist(), enters[order].tolist(), strict=True):
            if best and enter > best.distance:
                break
            met = self.bodies[index].cast(origin, direction)
            if met and (best is None or met[0] < best.distance):
                best = Hit(index, met[1], met[2], met[0])
        return best

    def within(self, point: NDArray) -> set[tuple[int, int]]:
        """The (body, part) of interfaces that a point in the world lies within."""
        around = np.flatnonzero(((self.lows <= point) & (point <= self.highs)).all(axis=1)).tolist()
        return {
            (index, part)
            for index in around
            if self.bodies[index].media and not self.bodies[index].heavy
            for part in self.bodies[index].solid.within(self.bodies[index].local(point))
        }

    def leaving(self, patch: Patch, side: str) -> list[list[Hit | None]]:
        """What rays meet that leave a Patch on that side: for each of some points a list of Hit, None for the far away.

        Hits of the patch itself are left out.
        """
        points = min(PATCH_POINTS, max(3, RAYS // (2 * (len(SLANTS) + AIMS) * len(self.patches))))
        key = (patch, side, points)
        if key not in self._memory:
            starts, normals = self.starts(patch, side, points)
            ways = [
                np.array([*_around(normal), *self._towards(start, normal, patch.body)])
                for start, normal in zip(starts, normals, strict=True)
            ]
            counts = [len(way) for way in ways]
            hits = iter(self.cast_all(np.repeat(starts, counts, axis=0), np.concatenate(ways))) if counts else ()
            found = [[next(hits) for _ in range(count)] for count in counts]
            self._memory[key] = [[hit for hit in hits if hit is None or self.patch_of(hit) != patch] for hits in found]
        return self._memory[key]

    def _towards(self, start, normal, body):
        """Unit directions from a point to the interfaces nearest to it that are in front of it, a few."""
        others = [index for index in self._interfaces if index != body]
        ways = (self.lows[others] + self.highs[others]) / 2 - start
        lengths = np.linalg.norm(ways, axis=1)
        ways, lengths = ways[lengths > 0], lengths[lengths > 0]
        ways = ways[np.argsort(lengths)[:AIMS]] / np.sort(lengths)[:AIMS, None]
        return list(ways[ways @ normal > 0.05])

    @cached_property
    def _interfaces(self):
        return [index for index, body in enumerate(self.bodies) if body.media]

    def holders(self, patch: Patch, side: str) -> set[tuple[int, int]]:
        """The (body, part) of interfaces that all of a Patch, just off it on that side, lies within."""
        key = (patch, side)
        if key not in self._memory:
            starts, _ = self.starts(patch, side, PATCH_POINTS)
            found = None
            for start in starts:
                found = self.within(start) if found is None else found & self.within(start)
                if not found:
                    break
            self._memory[key] = found or set()
        return self._memory[key]

    def touching(self, patch: Patch) -> tuple[Counter[int], dict[int, NDArray], int]:
        """How many of some points of a Patch lie on faces of each other body, by its index; and of how many.

        Between the two: the sum of the unit normals there, (3,), by the same index.
        """
        key = (patch,)
        if key not in self._memory:
            body, found, sums = self.bodies[patch.body], Counter(), {}
            starts, normals = self.starts(patch, FRONT, TOUCHED, 0.0)
            for place, normal in zip(starts, normals, strict=True):
                reach = NEAR * body.size
                near = ((self.lows - reach <= place) & (place <= self.highs + reach)).all(axis=1)
                for other in set(np.flatnonzero(near).tolist()) - {patch.body}:
                    # single precision is less precise on what is large
                    slack = min(4 * reach, 2e-7 * self.bodies[other].size)
                    if self.bodies[other].has(place, normal, reach + slack):
                        found[other] += 1
                        sums[other] = sums.get(other, 0) + normal
            self._memory[key] = found, sums, len(starts)
        return self._memory[key]

    def is_before(self, point: NDArray, patch: Patch) -> bool:
        """Whether a point (3,) in the world is on the outer side of the plane that a part is in or near."""
        body = self.bodies[patch.body]
        middle, normal = body.solid.plane(patch.part)
        return bool((body.local(point) - middle) @ normal > 1e-3 * body.solid.size)

    def is_supported(self, index: int, part: int) -> bool:
        """Whether the rim of an open part lies at, in or behind something else, as a pool's surface ends at its walls.

        Or, of a sheet, beyond everything else, as the sea's does.
        """
        body = self.bodies[index]
        solid = body.solid
        if solid.parts[part].is_sheet and self._spans(index, part):
            return True
        mine = np.flatnonzero(solid.part[solid.rim.face] == part)
        mine = mine[np.unique(np.linspace(0, len(mine) - 1, RIM_POINTS).astype(int))]
        middle = body.world(solid.plane(part)[0]) if solid.parts[part].is_sheet else None
        held = sum(self._is_held(body, index, edge, middle) for edge in mine)
        return held >= 0.9 * len(mine)

    def _spans(self, index, part):
        """Whether the camera and all other bodies are within the outline of a sheet, seen along its normal."""
        body = self.bodies[index]
        if self.eye is None:
            return False
        _, normal = body.solid.plane(part)
        axes = np.linalg.svd(normal[None])[2][1:]  # of unit length, along the sheet
        own = body.solid.points[body.solid.corners[np.repeat(body.solid.part == part, np.diff(body.solid.begins))]]
        others = [other for other in range(len(self.bodies)) if other != index]
        both = np.stack([self.lows[others], self.highs[others]])
        both = np.concatenate([both, np.array(self.beyond).reshape(-1, 2, 3).swapaxes(0, 1)], axis=1)
        corners = [both[list(turn), :, range(3)].T for turn in product((0, 1), repeat=3)]
        inside = np.vstack([*corners, [self.eye]])
        inside = np.array([body.local(point) for point in inside]) @ axes.T
        low, high = bounds(own @ axes.T)
        margin = 0.1 * (high - low)
        return bool(((inside > low + margin) & (inside < high - margin)).all())

    def _is_held(self, body, index, edge, middle):
        solid = body.solid
        ends = body.world(solid.points[[solid.rim.start[edge], solid.rim.end[edge]]].astype(float))
        face = int(solid.rim.face[edge])
        place, length = ends.mean(axis=0), np.linalg.norm(ends[1] - ends[0])
        reach = 1e-3 * body.size
        near = np.flatnonzero(((self.lows - reach <= place) & (place <= self.highs + reach)).all(axis=1))
        for other in near.tolist():
            there = self.bodies[other]
            if there.heavy:
                continue
            local = there.local(place)
            if other == index:
                # edges that a neighbour's vertex divides
                scale = np.abs(np.linalg.det(body.matrix[:3, :3])) ** (1 / 3)
                around = solid.tree.find_nearest_range(local.tolist(), min(reach, length / 10) / scale)
                if any(neighbour != face for _, _, neighbour, _ in around):
                    return True
                continue
            nearest = there.solid.tree.find_nearest(local.tolist())[0]
            if nearest is not None and np.linalg.norm(there.world(np.array(nearest)) - place) <= reach:
                return True
            if there.solid.within(local):
                return True
        inner = body.world(solid.place(face))
        for start, end in [(inner, place)] + ([(place, middle)] if middle is not None else []):
            way = end - start
            far = np.linalg.norm(way)
            if far > 0:
                hit = self.cast(start + 1e-4 * way, way / far)
                if hit and hit.body != index and hit.distance <= far + reach * (end is place):
                    return True
        return False

    def starts(self, patch: Patch, side: str, count: int = PATCH_POINTS, near: float = NEAR) -> tuple[NDArray, NDArray]:
        """Points (N, 3) in the world just off a Patch, and the unit normals (N, 3) on that side."""
        body = self.bodies[patch.body]
        count = 0 if body.heavy or self.blind else count
        chosen = (body.solid.part == patch.part) & (body.slots() == patch.slot)
        places, normals, _ = body.solid.samples(chosen, count)
        normals = normals @ body.inverse[:3, :3]  # as normals go: by the transpose of the inverse
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals if side == FRONT else -normals
        return body.world(places) + near * body.size * normals, normals

    def patch_of(self, hit: Hit) -> Patch:
        """The Patch that was hit."""
        return self.bodies[hit.body].patch(hit.body, hit.face)


def survey(sight: Sight) -> Surroundings:
    """The Surroundings of what a sight.Sight shows; what is over its limit is left out of it."""
    memory = sight.kept.setdefault("surroundings", {})
    wearers = {shown for group in sight.worn.values() for shown in group}
    solids = {}  # by mesh, which many may share

    def bodies_of(group):
        for shown in group:
            key = shown.mesh.as_pointer()
            if key not in solids:
                solids[key] = sight.measured(shown, "solid", Solid)
            if solids[key]:
                yield Body(shown, solids[key])

    bodies = [body for body in bodies_of(shown for shown in sight.shown if shown in wearers) if not body.flat]
    others = [shown for shown in sight.shown if shown not in wearers and not shown.original.get(PATHS_MARK)]
    near, beyond = _standing(others, bodies, sight.limit)
    bodies += bodies_of(near)
    around = Surroundings(bodies, memory)
    if sight.limit is not None and len(around.patches) > PANEL:
        sight.left_out.update(body.name for body in bodies if body.media)
        around = Surroundings(bodies)  # what it does not know is not to be remembered
        around.blind = True
    around.beyond = beyond
    camera = sight.scene.camera
    if camera:
        around.eye = np.array(camera.evaluated_get(sight.depsgraph).matrix_world.translation)
    return around


def _standing(others, interfaces, limit):
    """Of Shown without an interface those that may stand between interfaces, and the bounds (2, 3) of all the rest."""
    if not interfaces:
        return [], []
    low = np.min([body.low for body in interfaces], axis=0)
    high = np.max([body.high for body in interfaces], axis=0)
    margin = 0.01 * np.linalg.norm(high - low)
    near, beyond, left = [], [], STANDING if limit is None else PANEL_STANDING
    for shown in others:
        corners = np.array(shown.object.bound_box)
        if shown.object.data != shown.mesh:  # an instance that geometry nodes made, whose object is another
            corners = meshes.vertices(shown.mesh)[:MOST_VERTICES]
        box = np.array(bounds(meshes.moved(corners, shown.matrix.copy())))
        count = len(shown.mesh.polygons)
        if (box[0] <= high + margin).all() and (box[1] >= low - margin).all() and count <= min(left, limit or LARGEST):
            near.append(shown)
            left -= count
        else:
            beyond.append(box)
    return near, beyond


def same(medium: Medium, other: Medium) -> bool:
    """Whether two media are the same to what sockets hold: the permeability of a real one counts by magnitude."""
    if medium.dispersion != other.dispersion:
        return False
    parts = ((medium.n, other.n), (medium.k, other.k), (medium.mu, other.mu), (medium.mu_imag, other.mu_imag))
    return all(math.isclose(*pair, rel_tol=1e-5, abs_tol=1e-12) for pair in parts)


def _around(normal):
    """Unit directions (N, 3) about a normal."""
    side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    side /= np.linalg.norm(side)
    other = np.cross(normal, side)
    turns = 2.4 * np.arange(len(SLANTS)) + 0.3  # no symmetry of the mesh's
    sines = np.array(SLANTS)[:, None]
    return (
        np.sqrt(1 - sines**2) * normal + sines * (np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * other)
    )  # fmt: skip

# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays can meet in a scene: each mesh that a render shows, with the media that its interfaces name."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles import meshes
from ..cycles.material import asked_interfaces, interface_of
from ..cycles.meshes import bounds
from ..cycles.visibility import Shown, asked, has_nodes
from ..physics import Medium
from .solids import Solid

FRONT, BACK = "outside", "inside"  # the two sides of a face, by the names of the media there
LARGEST = 500_000  # faces of a mesh that may stand in a ray's way
NEAR = 1e-5  # where rays start, off the face, relative to the size of the mesh


class Patch(NamedTuple):
    """The faces of one part of one body that wear the same material: indices of the body and the part, material index."""

    body: int
    part: int
    slot: int


class Body:
    """A visibility.Shown that rays can meet.

    shown, solid: the Shown, and the Solid of its mesh
    media:        {material index: {FRONT: Medium, BACK: Medium}, where they are known, or None} of interfaces
    open:         the material indices that rays pass: of volumes without a surface
    """

    def __init__(self, shown: Shown, solid: Solid):
        self.shown, self.solid = shown, solid
        self.matrix = np.array(shown.matrix.copy(), float)
        self.media, self.open = {}, set()
        for slot, material in enumerate(shown.materials):
            nodes = asked_interfaces(material)
            if nodes:
                between = interface_of(*nodes[0]) if len(nodes) == 1 else None
                self.media[slot] = {FRONT: between.outside, BACK: between.inside} if between else None
            elif has_nodes(material) and not asked(material) and asked(material, "Volume"):
                self.open.add(slot)
        self.low, self.high = bounds(self.world(meshes.box_corners(solid.low, solid.high)))
        self.size = float(np.linalg.norm(self.high - self.low))
        self.heavy = solid.count > LARGEST  # rays pass it
        with np.errstate(all="ignore"):
            volume = abs(np.linalg.det(self.matrix[:3, :3]))
        # or nowhere, or larger than single precision has areas for
        self.flat = not (volume > 1e-30 and np.isfinite(volume) and max(self.size, solid.size) < 1e15)

    @property
    def object(self) -> bpy.types.Object:
        """Of the file: the one that is shown, or of which it is an instance."""
        return self.shown.original

    @property
    def name(self) -> str:
        """Of that object."""
        return self.object.name

    @property
    def worn(self) -> tuple[str, ...]:
        """Names of its interface materials, sorted."""
        return tuple(sorted({self.shown.materials[slot].name for slot in self.media}))

    @cached_property
    def inverse(self) -> NDArray:
        """World to the mesh's own coordinates, (4, 4)."""
        return np.array(self.shown.matrix.inverted_safe(), float)

    def world(self, points: NDArray) -> NDArray:
        """Points (..., 3) of the mesh in the world."""
        return meshes.moved(points, self.matrix)

    def local(self, point: NDArray) -> NDArray:
        """A point (3,) of the world in the mesh's own coordinates."""
        return self.inverse[:3, :3] @ point + self.inverse[:3, 3]

    def has(self, place: NDArray, normal: NDArray, reach: float) -> bool:
        """Whether a face passes, along that normal or against it, a point of the world as near as `reach`."""
        met, _, face, _ = (None,) * 4 if self.heavy else self.solid.tree.find_nearest(self.local(place).tolist())
        if met is None or np.linalg.norm(self.world(np.array(met)) - place) > reach:
            return False
        other = self.solid.area[face] @ self.inverse[:3, :3]
        return bool(abs(other @ normal) > 0.9999 * np.linalg.norm(other))

    def slot(self, face: int) -> int:
        """The material index that counts for a face."""
        return min(max(int(self.solid.material[face]), 0), len(self.shown.materials) - 1)

    def slots(self) -> NDArray:
        """(F,) of them."""
        return np.clip(self.solid.material, 0, len(self.shown.materials) - 1)

    def patch(self, index: int, face: int) -> Patch:
        """The Patch that a face is of; `index`: this body's."""
        return Patch(index, int(self.solid.part[face]), self.slot(face))

    def medium(self, patch: Patch, side: str) -> Medium | None:
        """The Medium on that side of a Patch; None where it is no interface or not known."""
        known = self.media.get(patch.slot)
        return known[side] if known else None

    def cast(self, origin: NDArray, direction: NDArray) -> tuple[float, int, str] | None:
        """(distance, face, side) of the first face that a ray in the world meets, or None; volumes alone it passes.

        origin, direction: (3,), the latter unit
        """
        if self.heavy:
            return None
        place = self.local(origin)
        along = self.inverse[:3, :3] @ direction
        for _ in range(16 if self.open else 1):
            met, _, face, _ = self.solid.tree.ray_cast(place.tolist(), along.tolist())
            if met is None:
                return None
            if self.slot(face) not in self.open:
                side = FRONT if along @ self.solid.area[face] < 0 else BACK
                return float((self.world(np.array(met)) - origin) @ direction), face, side
            place = np.array(met) + NEAR * self.solid.size * along / np.linalg.norm(along)
        return None

# SPDX-License-Identifier: GPL-3.0-or-later
"""What bent light can land on: what scatters it, and in whose place a copy that shines can stand."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles import meshes
from ..cycles.animation import curves_of
from ..cycles.visibility import PATHS_MARK, Shown, as_rendered, shown
from .bending import bends, lands


def met(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> Iterator[Shown]:
    """What light meets of what a render shows, in as_rendered()'s depsgraph: light paths that are drawn are not there."""
    return (surface for surface in shown(scene, depsgraph) if not surface.original.get(PATHS_MARK))


def replaceable(depsgraph: bpy.types.Depsgraph) -> Callable[[Shown], bool]:
    """Function of a Shown in a depsgraph: whether a copy can stand in its place."""
    # hiding these, as a copy in their place asks for, would hide their instances
    sources = {
        instance.parent.original
        for instance in depsgraph.object_instances
        if instance.is_instance and not _is_own(instance)
    }
    return lambda surface: surface.single and surface.original not in sources and _can_be_replaced(surface.original)


def lacks_floor(scene: bpy.types.Scene) -> bool:
    """Whether something bends or mirrors light in a scene, and nothing is there for it to land on: a Tracer refuses that."""
    bent = False
    with as_rendered(scene) as depsgraph:
        can_shine = replaceable(depsgraph)
        for surface in met(scene, depsgraph):
            bent |= any(map(bends, surface.materials))
            if can_shine(surface) and any(map(lands, _used(surface))):
                return False
    return bent


def bodies(scene: bpy.types.Scene) -> NDArray:
    """(N, 3) the vertices, in the world, of all that bends or mirrors light in a scene."""
    with as_rendered(scene) as depsgraph:
        found = [
            meshes.vertices(surface.mesh, surface.matrix.copy())  # a frozen one is no array
            for surface in met(scene, depsgraph)
            if any(map(bends, surface.materials))
        ]
    return np.concatenate(found) if found else np.zeros((0, 3))


def _used(surface):
    """The materials that faces of a Shown have."""
    return [surface.materials[slot] for slot in np.unique(meshes.slots(surface.mesh, len(surface.materials)))]


def _is_own(instance):
    """Whether an instance is but the mesh that its object, a curve, a text or the like, becomes."""
    original = instance.object.original
    return instance.is_instance and original.type != "MESH" and instance.parent.original == original


def _can_be_replaced(obj):
    """Whether a copy of an object can stand in its place, which hides it: not in another scene, nor in a library."""
    # nor in an override of one: that it is hidden would be saved, but not the mark by which it comes back
    return not (obj.library or obj.override_library) and len(obj.users_scene) == 1 and not _comes_back(obj)


def _comes_back(obj):
    """Whether keyframes or a driver of its visibility would show an object again, beside its copy."""
    curves = [curve for curve, _ in curves_of(obj)]
    curves += obj.animation_data.drivers if obj.animation_data else []
    return any(curve.data_path == "hide_render" for curve in curves)

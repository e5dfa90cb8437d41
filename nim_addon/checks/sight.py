# SPDX-License-Identifier: GPL-3.0-or-later
"""What the checks look at: a scene as a render shows it, and the materials of ours in it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import bpy

from ..cycles import visibility
from ..cycles.material import asked_closures, asked_interfaces
from ..cycles.visibility import Shown

Measured = TypeVar("Measured")


class Sight(NamedTuple):
    """A scene as it is looked at; valid only as long as its depsgraph.

    scene, depsgraph: the bpy.types of these names
    shown:    the visibility.Shown in it
    lamps:    the lamps in it, objects of the file
    ours:     the materials in it that any of our closures is in
    worn:     {interface material: the Shown that wear it}; an empty list where all of them are hidden in the viewport
    limit:    meshes of more faces are left out, and their objects named in left_out; None for no limit
    left_out: names of objects, which checks add to
    kept:     {session_uid of an original object: dict}, in which a check may keep what it measured on that object's
              mesh for the next look; whoever looks empties it when the geometry of that object changes
    """

    scene: bpy.types.Scene
    depsgraph: bpy.types.Depsgraph
    shown: list[Shown]
    lamps: list[bpy.types.Object]
    ours: list[bpy.types.Material]
    worn: dict[bpy.types.Material, list[Shown]]
    limit: int | None
    left_out: set[str]
    kept: dict[Any, dict[str, Any]]

    def wearers(self) -> dict[Shown, list[bpy.types.Material]]:
        """{Shown: the interface materials that it wears}, an object of the file once for each that makes instances."""
        first, worn = {}, {}
        for material, wearers in self.worn.items():
            for shown in wearers:
                shown = first.setdefault((shown.original, shown.parent), shown)
                worn.setdefault(shown, {})[material] = None
        return {shown: list(materials) for shown, materials in worn.items()}

    def measured(self, shown: Shown, name: str, measure: Callable[[bpy.types.Mesh], Measured]) -> Measured | None:
        """measure(mesh) of a visibility.Shown, kept under that name; None, and left out, if over the limit."""
        known = self.kept.setdefault(shown.original.session_uid, {}) if shown.single else {}
        if name not in known:
            if self.limit is not None and len(shown.mesh.polygons) > self.limit:
                self.left_out.add(shown.original.name)
                return None
            known[name] = measure(shown.mesh)
        return known[name]


def look(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    limit: int | None = None,
    kept: dict[Any, dict[str, Any]] | None = None,
) -> Sight:
    """The Sight of a scene in a depsgraph: that of visibility.as_rendered(), or the viewport's while a panel shows it."""
    shown = list(visibility.shown(scene, depsgraph))
    override = scene.view_layers[0].material_override
    worn = {}
    for surface in shown:
        for material in dict.fromkeys(surface.materials):
            if material:
                worn.setdefault(material, []).append(surface)
    seen = {surface.parent or surface.original for surface in shown}
    hidden = [obj for obj in visibility.rendered(scene) if obj not in seen]
    for materials in visibility.declared(hidden).values():
        for material in dict.fromkeys(override or material for material in materials):
            worn.setdefault(material, [])
    ours = [material for material in worn if asked_closures(material)]
    worn = {material: wearers for material, wearers in worn.items() if asked_interfaces(material)}
    lamps = visibility.lamps(scene, depsgraph)
    return Sight(scene, depsgraph, shown, lamps, ours, worn, limit, set(), {} if kept is None else kept)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What the checks look at: a scene as a render shows it, and the interface materials in it."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from ..cycles import visibility
from ..cycles.material import asked_interfaces


class Sight(NamedTuple):
    """A scene as it is looked at; valid only as long as its depsgraph.

    scene, depsgraph: the bpy.types of these names
    shown:    the visibility.Shown in it
    lamps:    the lamps in it, objects of the file
    worn:     {interface material: the Shown that wear it}; an empty list where all of them are hidden in the viewport
    limit:    meshes of more faces are left out, and their objects named in left_out; None for no limit
    left_out: names of objects, which checks add to
    kept:     {session_uid of an original object: dict}, in which a check may keep what it measured on that object's
              mesh for the next look; whoever looks empties it when the geometry of that object changes
    """

    scene: bpy.types.Scene
    depsgraph: bpy.types.Depsgraph
    shown: list
    lamps: list
    worn: dict
    limit: int | None
    left_out: set
    kept: dict

    def wearers(self):
        """{Shown: the interface materials that it wears}, an object of the file once for each that makes instances."""
        first, worn = {}, {}
        for material, those in self.worn.items():
            for one in those:
                one = first.setdefault((one.original, one.parent), one)
                worn.setdefault(one, {})[material] = None
        return {one: list(materials) for one, materials in worn.items()}

    def measured(self, one, kind, measure):
        """measure(mesh) of a visibility.Shown, kept under the name `kind`; None, and left out, if over the limit."""
        known = self.kept.setdefault(one.original.session_uid, {}) if one.single else {}
        if kind not in known:
            if self.limit is not None and len(one.mesh.polygons) > self.limit:
                self.left_out.add(one.original.name)
                return None
            known[kind] = measure(one.mesh)
        return known[kind]


def look(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, limit: int | None = None, kept: dict | None = None
) -> Sight:
    """The Sight of a scene in a depsgraph: that of visibility.as_rendered(), or the viewport's while a panel shows it."""
    shown = list(visibility.shown(scene, depsgraph))
    override = scene.view_layers[0].material_override
    worn = {}
    for one in shown:
        for material in dict.fromkeys(one.materials):
            if material:
                worn.setdefault(material, []).append(one)
    for thing in visibility.rendered(scene):
        for material in visibility.materials_of(thing, override) if thing.type in ("MESH", "CURVE", "FONT") else ():
            if material:
                worn.setdefault(material, [])
    worn = {material: those for material, those in worn.items() if asked_interfaces(material)}
    lamps = visibility.lamps(scene, depsgraph)
    return Sight(scene, depsgraph, shown, lamps, worn, limit, set(), {} if kept is None else kept)

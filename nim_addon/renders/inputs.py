# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of the interface nodes of a .blend, by MATERIAL:INPUT, to be rendered in place of what stands there."""

from __future__ import annotations

import re

import bpy

from ..base.text import unknown
from ..cycles.material import asked_closures


def set_input(scene: bpy.types.Scene, key: str, number: float) -> None:
    """Give an input of all nodes of our closures in a material of a scene a number; what is linked to it is taken away.

    key: "MATERIAL:INPUT", such as "NIM:Index Inside"
    Raises ValueError, one sentence, where the scene has no such material, or that no such input.
    """
    name, _, label = key.partition(":")
    worn = {slot.material for thing in scene.objects for slot in thing.material_slots if slot.material}
    materials = {_own_name(material): material for material in worn}
    nodes = {own: [found.node for found in asked_closures(material)] for own, material in materials.items()}
    ours = sorted(own for own, found in nodes.items() if found)
    if not nodes.get(name):
        raise ValueError(
            unknown("NIM material", name, ours) if ours else f"the scene {scene.name!r} has no NIM material."
        )
    for node in nodes[name]:
        numbers = [socket.name for socket in node.inputs if socket.type == "VALUE"]
        if label not in numbers:
            raise ValueError(unknown(f"input of {name}", label, numbers))
        socket = node.inputs[label]
        for link in [*(socket.links or ())]:
            node.id_data.links.remove(link)
        socket.default_value = number


def _own_name(material):
    """The name that a material has in its own file: beside another of that name Blender numbers it."""
    return re.sub(r"\.\d{3}$", "", material.name)

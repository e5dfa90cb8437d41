# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of the interface nodes of a .blend, by MATERIAL:INPUT, to be rendered in place of what stands there."""

from __future__ import annotations

import re

import bpy

from ..base.text import unknown
from ..cycles.animation import curves_of
from ..cycles.material import asked_closures
from .used import used_by


def set_input(scene: bpy.types.Scene, key: str, number: float) -> None:
    """Give an input of all nodes of our closures in a material of a scene a number, in place of what is linked to it, of its
    keyframes and of its driver.

    key: "MATERIAL:INPUT", such as "NIM:Index Inside"
    Raises ValueError, one sentence, where the scene has no such material, or that no such input.
    """
    name, _, label = key.partition(":")
    materials = _by_own_name({data for data in used_by(scene) if isinstance(data, bpy.types.Material)})
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
        if _moves(socket):  # by an action that other materials may share: a node that it does not know decides instead
            value = node.id_data.nodes.new("ShaderNodeValue")
            value.name = "Set in place of its animation"
            value.outputs[0].default_value = number
            node.id_data.links.new(value.outputs[0], socket)


def _moves(socket):
    """Whether keyframes or a driver decide an input."""
    tree, path = socket.id_data, socket.path_from_id("default_value")
    drivers = tree.animation_data.drivers if tree.animation_data else ()
    return any(curve.data_path == path for curve in (*drivers, *(curve for curve, _ in curves_of(tree))))


def _by_own_name(materials):
    """Materials by the names that they have in their own file: beside another of that name Blender has numbered one."""
    found = {material.name: material for material in materials}
    for name in sorted(found):
        found.setdefault(re.sub(r"\.\d{3}$", "", name), found[name])
    return found

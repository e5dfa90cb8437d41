# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material reads of the object that wears it: given to the copies of the object that stand in its place.

A copy has another name, place and parent. Cycles looks for a name among the custom properties of an object first, so that
a value is the same on the copy as a property of that name, wherever the object had it from.
"""

from __future__ import annotations

from typing import Any

import bpy

from .nodes import Nodes
from .visibility import Shown, asked

RANDOM, LOCATION = "nim_random", "nim_location"  # properties of copies, for what Object Info says of the object
LIKE = ("color", "pass_index")  # the properties of an object that nodes ask for
Reads = set[tuple[str, str]]  # (type, name) of attributes, as of an Attribute node


def values_of(surface: Shown, scene: bpy.types.Scene, reads: Reads | None = None) -> dict[str, Any]:
    """Custom properties that a copy of what is Shown must have for its materials to look the same.

    reads: attributes_of() all its materials, where they are known

    Raises ValueError, one sentence, where a material reads an attribute of an instance, which cannot be known.
    """
    values = {RANDOM: surface.random, LOCATION: list(surface.matrix.translation)}
    if reads is None:
        reads = set().union(*(attributes_of(material) for material in surface.materials))
    for source, name in sorted(reads):
        if source == "INSTANCER" and not surface.single and _has_own_attributes(surface.parent):
            raise ValueError(
                f"a material of {surface.original.name} reads {name} of each instance that {surface.parent.name} makes, and "
                "such are not traced; realize the instances, or take the attribute out of it."
            )
        owners = [surface.object, surface.object.data]
        if source == "INSTANCER" and surface.parent:
            owners.insert(0, surface.parent)
        if source == "VIEW_LAYER":
            owners = [scene.view_layers[0], scene, scene.world]
        found = next((value for owner in owners if owner and (value := number(owner, name)) is not None), None)
        if found is not None:
            values[name] = found
    return values


def attributes_of(material: bpy.types.Material | None) -> Reads:
    """The attributes that a material reads of its object, its instancer or its view layer."""
    nodes = [node for socket in ("Surface", "Volume") for node, _ in asked(material, socket)]
    return {
        (node.attribute_type, node.attribute_name)
        for node in nodes
        if node.type == "ATTRIBUTE" and node.attribute_type != "GEOMETRY" and node.attribute_name
    }


def number(owner: bpy.types.bpy_struct, name: str) -> float | list[float] | None:
    """A property of that name or path, as Cycles reads it: a float or up to four of them, or None."""
    try:
        value = owner[name] if name in owner else owner.path_resolve(name)
    except (ValueError, KeyError, TypeError):
        return None
    if isinstance(value, (bool, int, float)):
        return float(value)
    try:
        parts = [float(part) for part in value]
    except (TypeError, ValueError):
        return None
    return parts if 0 < len(parts) <= 4 else None


def give(copy: bpy.types.Object, values: dict[str, Any], original: bpy.types.Object) -> None:
    """Let a copy of an object look the same to its materials; values: of values_of()."""
    for name in LIKE:
        setattr(copy, name, getattr(original, name))
    for name, value in values.items():
        copy[name] = value


def carry(material: bpy.types.Material) -> None:
    """Let a material, whose groups are its own, read from values_of() what it asks for of its object.

    A property of the view layer is one of the object then.
    """
    for node in {node for socket in ("Surface", "Volume") for node, _ in asked(material, socket)}:
        if node.type == "OBJECT_INFO":
            for output, name in (("Random", RANDOM), ("Location", LOCATION)):
                if node.outputs[output].is_linked:
                    nodes = Nodes(node.id_data)
                    read = nodes.add("ShaderNodeAttribute", attribute_type="OBJECT", attribute_name=name)
                    source = read.outputs["Vector" if output == "Location" else "Fac"]
                    for link in list(node.outputs[output].links):
                        node.id_data.links.new(source, link.to_socket)
        elif node.type == "ATTRIBUTE" and node.attribute_type in ("INSTANCER", "VIEW_LAYER"):
            node.attribute_type = "OBJECT"


def _has_own_attributes(parent):
    return bool(parent.particle_systems) or any(modifier.type == "NODES" for modifier in parent.modifiers)

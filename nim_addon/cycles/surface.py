# SPDX-License-Identifier: GPL-3.0-or-later
"""A material that is one node of ours: made, and taken out of the file again."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from .nodes import empty_tree


def surface_material(
    name: str, node_of: Callable[[bpy.types.NodeTree], bpy.types.Node], *, bends_backwards: bool
) -> bpy.types.Material:
    """A material whose surface is the BSDF of the node that `node_of` makes in its tree.

    bends_backwards: solid view shows such materials warm, others cool
    """
    material = bpy.data.materials.new(name)
    tree = empty_tree(material)
    node = node_of(tree)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    material.diffuse_color = (0.9, 0.6, 0.35, 0.5) if bends_backwards else (0.5, 0.7, 0.9, 0.5)
    return material


def remove_material(material: bpy.types.Material) -> None:
    """Take a material out of the file, with its animation and those of our groups, tables and shaders that only it used."""
    held = _held(material.node_tree) if material.node_tree else {}
    for owner in (material, material.node_tree):
        if owner and owner.animation_data and owner.animation_data.action:
            held[owner.animation_data.action] = bpy.data.actions
    bpy.data.materials.remove(material)
    for data, kind in held.items():  # those that hold others come first
        if not data.users and not data.library:
            kind.remove(data)


def _held(tree: bpy.types.NodeTree) -> dict[bpy.types.ID, bpy.types.bpy_prop_collection]:
    """{data-block: where it is kept} of our groups in a tree, and of what is in those."""
    found: dict[bpy.types.ID, bpy.types.bpy_prop_collection] = {}
    for node in tree.nodes:
        group = node.node_tree if node.type == "GROUP" else None
        if group and any(key.startswith("nim_") for key in group.keys()):  # noqa: SIM118
            found[group] = bpy.data.node_groups
            for inner in group.nodes:
                if inner.type == "TEX_IMAGE" and inner.image:
                    found[inner.image] = bpy.data.images
                elif inner.type == "SCRIPT" and inner.script:
                    found[inner.script] = bpy.data.texts
            found |= _held(group)
    return found

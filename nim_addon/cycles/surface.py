# SPDX-License-Identifier: GPL-3.0-or-later
"""A material that is one node of ours."""

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

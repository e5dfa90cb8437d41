# SPDX-License-Identifier: GPL-3.0-or-later
"""A material that is one node of ours: made, and taken out of the file again."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bpy

from .animation import actions_of
from .closures import preview
from .closures.closure import EEVEE
from .nodes import Nodes, empty_tree


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
    colour = preview.NEGATIVE if bends_backwards else preview.POSITIVE
    material.diffuse_color = (*colour, 1 - preview.VEIL)
    show_in_eevee(node, colour)
    return material


def show_in_eevee(node: bpy.types.Node, colour: Sequence[float] = preview.POSITIVE) -> None:
    """Give the material of a node of ours an output for EEVEE alone, where it has none, beside that of all engines.

    colour: of the veil, of a node that has no output of its own for it
    """
    tree = node.id_data
    if any(other.type == "OUTPUT_MATERIAL" and other.target == "EEVEE" for other in tree.nodes):
        return
    active = tree.nodes.active
    nodes = Nodes(tree)
    shown = node.outputs.get(EEVEE.name)
    if shown is None:
        veil = nodes.add("ShaderNodeBsdfDiffuse", inputs={"Color": colour})
        behind = nodes.add("ShaderNodeBsdfTransparent")
        mixed = {0: preview.VEIL, 1: behind.outputs[0], 2: veil.outputs[0]}
        shown = nodes.add("ShaderNodeMixShader", inputs=mixed).outputs[0]
    nodes.add("ShaderNodeOutputMaterial", inputs={"Surface": shown}, target="EEVEE")
    for place, added in enumerate(nodes.added):
        added.label = "for EEVEE" if added is nodes.added[-1] else ""
        added.location = (node.location.x + 300 - 220 * (len(nodes.added) - 1 - place), node.location.y - 420)
    tree.nodes.active = active


def remove_material(material: bpy.types.Material) -> None:
    """Take a material out of the file, with its animation and those of our groups, tables and shaders that only it used."""
    held = _held(material.node_tree) if material.node_tree else {}
    for owner in (material, material.node_tree):
        held.update(dict.fromkeys(actions_of(owner) if owner else (), bpy.data.actions))
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

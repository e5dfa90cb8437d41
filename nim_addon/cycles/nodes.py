# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials, worlds and lamps, built in a few words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import bpy

# in quotes: where the pages are made bpy is a mock, of which there is no union
Owner: TypeAlias = "bpy.types.Material | bpy.types.World | bpy.types.Light"


def uses_nodes(owner: Owner) -> bool:
    """Whether a render asks the node tree of a material, world or lamp.

    Where it always does, from Blender 5.0 on and for lamps from 5.1 on, it is not asked: that is deprecated.
    """
    if owner.node_tree is None:
        return False
    switch = owner.bl_rna.properties.get("use_nodes")
    return switch is None or getattr(switch, "is_deprecated", False) or owner.use_nodes


def empty_tree(owner: Owner) -> bpy.types.NodeTree:
    """The node tree of a material, world or lamp, made where it has none, with no node in it, and in use."""
    if not uses_nodes(owner):
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


class Nodes:
    """A short way to add nodes to a bpy.types.NodeTree and to link them, each to the right of the last one.

    Where an input is asked for, a bpy.types.NodeSocket is linked to it and anything else becomes its value.

    later: links are made by link() alone: Blender looks at the whole tree again for each thing that is added to it, so that
           a large one takes half as long where its nodes come first
    links: (output, input) of those that are still to be made
    """

    def __init__(self, tree: bpy.types.NodeTree, *, later: bool = False):
        self.tree, self.later = tree, later
        self.added: list[bpy.types.Node] = []
        self.links: list[tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]] = []

    def add(self, type_: str, *, inputs: Mapping[Any, Any] | None = None, **properties: Any) -> bpy.types.Node:
        """A node of that type; `inputs` maps a socket's name, identifier or index to what it gets."""
        node = self.tree.nodes.new(type_)
        node.location = (len(self.added) * 220, 0)
        self.added.append(node)
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            self.feed(_socket(node, key), value)
        return node

    def feed(self, socket: bpy.types.NodeSocket, value: Any) -> None:
        """Link `socket`, an input of a node, to the output `value`, or give it that value."""
        if isinstance(value, bpy.types.NodeSocket):
            if self.later:
                self.links.append((value, socket))
            else:
                self.tree.links.new(value, socket)
        elif socket.type == "RGBA" and len(value) == 3:
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def link(self) -> None:
        """Make the links that are still to be made."""
        for output, socket in self.links:
            self.tree.links.new(output, socket)
        self.links.clear()

    def math(self, operation: str, a: Any, b: Any = 0.0, c: Any = 0.0) -> bpy.types.NodeSocket:
        """The output of a Math node of numbers."""
        return self.add("ShaderNodeMath", operation=operation, inputs={0: a, 1: b, 2: c}).outputs[0]

    def vector(self, operation: str, *vectors: Any) -> bpy.types.NodeSocket:
        """The output of a Vector Math node of vectors or colours whose result is a vector."""
        return self.add("ShaderNodeVectorMath", operation=operation, inputs=dict(enumerate(vectors))).outputs[0]

    def scale(self, vector: Any, factor: Any) -> bpy.types.NodeSocket:
        """The output of a Vector Math node: factor times a vector or colour."""
        return self.add("ShaderNodeVectorMath", operation="SCALE", inputs={0: vector, "Scale": factor}).outputs[0]

    def mix(self, factor: Any, a: Any, b: Any) -> bpy.types.NodeSocket:
        """The colour (1 - factor) a + factor b."""
        inputs = {"Factor_Float": factor, "A_Color": a, "B_Color": b}
        node = self.add("ShaderNodeMix", data_type="RGBA", inputs=inputs)
        return next(socket for socket in node.outputs if socket.identifier == "Result_Color")

    def end(self, shader: bpy.types.Node, owner: str = "Material") -> None:
        """Let a node with one output be the whole shader of a "Material", a "World" or a "Light"."""
        self.add(f"ShaderNodeOutput{owner}", inputs={"Surface": shader.outputs[0]})


def _socket(node, key):
    # the sockets of a Mix node share their names: they are told apart by their identifiers
    if isinstance(key, str) and key not in node.inputs:
        return next(socket for socket in node.inputs if socket.identifier == key)
    return node.inputs[key]

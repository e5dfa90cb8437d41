# SPDX-License-Identifier: GPL-3.0-or-later
"""What everything that can be added has in common: an entry of a menu, an object at the 3D cursor, a node of a material."""

from typing import NamedTuple

import bpy
from bpy_extras.object_utils import object_data_add

from ..cycles.closures import closure_of, preview
from ..cycles.surface import show_in_eevee
from ..cycles.visibility import source_of
from .help import fail
from .translations import OWN


class Entry(NamedTuple):
    """A line of an Add menu: an operator, what is written there, its icon, and values of the operator's properties."""

    operator: str
    text: str
    icon: str = "NONE"
    values: dict = {}

    def draw(self, layout: bpy.types.UILayout) -> None:
        """Draw it."""
        button = layout.operator(self.operator, text=self.text, text_ctxt=OWN, icon=self.icon)
        for name, value in self.values.items():
            setattr(button, name, value)


class Addition:
    """An operator that adds something: its `add(context)` does, and returns what is said then.

    A ValueError or RuntimeError that it raises is said instead.
    """

    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Add it."""
        try:
            told = self.add(context)
        except (ValueError, RuntimeError) as error:
            return fail(self, str(error))
        self.report({"INFO"}, told)
        return {"FINISHED"}


class ObjectAddition(Addition):
    """One that adds an object at the 3D cursor."""

    @classmethod
    def poll(cls, context):
        """Only in Object Mode, in a scene that can be changed."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the mode you are in for Object Mode first")
            return False
        if context.collection is None or not context.collection.is_editable:
            cls.poll_message_set("The active collection is linked from a library: choose another one")
            return False
        return True


class NodeAddition(Addition):
    """One that adds a node to the material in the Shader editor, by its `node(context, tree)`, which adds it to a tree.

    `told(node)` is what is said then; `warm()`, whether EEVEE's veil over it is that of what bends backwards, of a node that
    has no output of its own for EEVEE.
    """

    def warm(self):
        """Not what bends light as glass does."""
        return False

    @classmethod
    def poll(cls, context):
        """Only in a shader tree that can be changed, and not within a closure's own group."""
        space = context.space_data
        tree = space.edit_tree if space and space.type == "NODE_EDITOR" else None
        if tree is None or tree.type != "SHADER":
            cls.poll_message_set("Open a material in the Shader Editor first")
            return False
        if not tree.is_editable:
            cls.poll_message_set("The node tree is linked from a library: make it local first")
            return False
        if closure_of(tree):
            cls.poll_message_set("Such a node cannot be put into its own group")
            return False
        return True

    def invoke(self, context, event):
        """Add it under the mouse and let it be moved, as Blender's own nodes are."""
        space = context.space_data
        if context.region.type == "WINDOW":
            space.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        else:
            space.cursor_location = space.edit_tree.view_center
        result = self.execute(context)
        if "FINISHED" in result:
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result

    def add(self, context):
        """Add it at the node editor's cursor, selected and active."""
        tree = context.space_data.edit_tree
        node = self.node(context, tree)
        node.location = context.space_data.cursor_location
        if _is_plain(tree):
            show_in_eevee(node, preview.NEGATIVE if self.warm() else preview.POSITIVE)
        for other in tree.nodes:
            other.select = other == node
        tree.nodes.active = node
        return self.told(node)


def _is_plain(tree):
    """Whether a tree is a material's own, and its surface no mixture: what EEVEE shows of one is what a person mixed."""
    if not any(material.node_tree == tree for material in bpy.data.materials):
        return False
    output = tree.get_output_node("CYCLES")
    source = source_of(output.inputs["Surface"]) if output else None
    return source is None or not any(socket.type == "SHADER" for socket in source[0].node.inputs)


def add_mesh(context: bpy.types.Context, name: str, vertices, faces, material: bpy.types.Material) -> bpy.types.Object:
    """An object at the 3D cursor, selected and active: vertices (N, 3) and faces, as scenes.shapes has them."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], faces)
    mesh.materials.append(material)
    mesh.update()
    return object_data_add(context, mesh)


def length_property(name: str, description: str, default: float):
    """A FloatProperty of a length above 0, for an operator."""
    return bpy.props.FloatProperty(
        name=name,
        description=description,
        default=default,
        min=0.001,
        soft_max=100.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )

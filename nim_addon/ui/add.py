# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Add menus gain: small NIM objects and other bodies that bend light, and their nodes."""

import bpy

from . import add_flat_lens, add_graded_ball, add_interface, add_lenslet_window, add_slab

# What can be added, in the order of the menus: a module each, with CLASSES and the entries of OBJECTS and NODES.
THINGS = (add_interface, add_flat_lens, add_lenslet_window, add_slab, add_graded_ball)


class NIM_MT_add_node(bpy.types.Menu):
    """Nodes that bend light, and ready media of the interface"""

    bl_idname = "NIM_MT_add_node"
    bl_label = "Negative Index"

    def draw(self, context):
        """Draw an entry for each node, then the interface once more for each medium."""
        self.layout.operator_context = "INVOKE_REGION_WIN"
        for entry in (entry for thing in THINGS for entry in thing.NODES):
            entry.draw(self.layout)
        for entries in add_interface.MEDIA_NODES:
            self.layout.separator()
            for entry in entries:
                entry.draw(self.layout)


class NIM_MT_add_mesh(bpy.types.Menu):
    """Bodies that bend light as no glass does"""

    bl_idname = "NIM_MT_add_mesh"
    bl_label = "Negative Index"

    def draw(self, context):
        """Draw an entry for each body: those of a NIM, then the rest."""
        for thing in THINGS:
            for entry in thing.OBJECTS:
                entry.draw(self.layout)
            if thing is add_interface:
                self.layout.separator()


def _node_menu(self, context):
    if context.space_data.tree_type == "ShaderNodeTree":
        self.layout.separator()
        self.layout.menu("NIM_MT_add_node")


def _mesh_menu(self, context):
    self.layout.separator()
    self.layout.menu("NIM_MT_add_mesh", icon="MATERIAL")


CLASSES = (*(cls for thing in THINGS for cls in thing.CLASSES), NIM_MT_add_node, NIM_MT_add_mesh)


def register():
    """Add the menus to Blender's own."""
    bpy.types.NODE_MT_add.append(_node_menu)
    bpy.types.VIEW3D_MT_mesh_add.append(_mesh_menu)


def unregister():
    """Take them back."""
    bpy.types.VIEW3D_MT_mesh_add.remove(_mesh_menu)
    bpy.types.NODE_MT_add.remove(_node_menu)

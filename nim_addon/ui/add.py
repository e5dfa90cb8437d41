# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Add menus gain: the interface node with ready media, and small NIM objects."""

import math

import bpy
from bpy.app.translations import pgettext_rpt
from bpy_extras.object_utils import object_data_add

from ..cycles.closures import INTERFACE
from ..cycles.material import interface_material, interface_node
from ..physics import MEDIA
from ..scenes import shapes
from ..scenes.sphere import make_round
from .media import (
    MEASURED_NUMBERS,
    MEDIUM_ITEMS,
    MEDIUM_NUMBERS,
    TAUGHT_NUMBERS,
    backend_for,
    chosen_medium,
    draw_choice,
    index_property,
    medium_property,
    number,
    permeability_property,
)
from .translations import OWN

SEGMENTS = 128


class NIM_OT_add_node(bpy.types.Operator):
    """Add an interface node between this medium and air"""

    bl_idname = "nim.add_node"
    bl_label = "Add Interface"
    bl_options = {"REGISTER", "UNDO"}

    medium: medium_property("nim-1.5", "Inside", "The medium behind the faces; outside is air")
    n: index_property(-1.5)
    mu: permeability_property()

    @classmethod
    def poll(cls, context):
        """Only in a shader tree that can be changed, and not within the interface's own group."""
        space = context.space_data
        tree = space.edit_tree if space and space.type == "NODE_EDITOR" else None
        if tree is None or tree.type != "SHADER":
            cls.poll_message_set("Open a material in the Shader Editor first")
            return False
        if not tree.is_editable:
            cls.poll_message_set("The node tree is linked from a library: make it local first")
            return False
        if INTERFACE.is_of(tree):
            cls.poll_message_set("The interface cannot be put into its own group")
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

    def execute(self, context):
        """Add it at the node editor's cursor."""
        tree = context.space_data.edit_tree
        try:
            medium = chosen_medium(self.medium, self.n, self.mu)
            node = interface_node(tree, medium, backend=backend_for(context.scene))
        except (ValueError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for other in tree.nodes:
            other.select = other == node
        tree.nodes.active = node
        node.location = context.space_data.cursor_location
        self.report({"INFO"}, pgettext_rpt("Interface of index {n} added").format(n=number(medium.n)))
        return {"FINISHED"}

    def draw(self, context):
        """Draw the redo panel: numbers only where the medium is of own values."""
        draw_choice(self.layout, self, "medium", "n", "mu")


def _slab(size):
    vertices, faces = shapes.box((-size / 2, -size / 2, -size / 20), (size / 2, size / 2, size / 20))
    return vertices, faces


def _prism(size):
    """An equilateral triangle of side `size` in the x-z plane, as deep along y; it rests on one side."""
    rise = size * math.sqrt(3) / 2
    x, y = size / 2, size / 2
    corners = [(-x, -rise / 3), (x, -rise / 3), (0.0, 2 * rise / 3)]
    vertices = [(cx, depth, cz) for depth in (-y, y) for cx, cz in corners]
    return vertices, [(0, 1, 2), (5, 4, 3), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]


def _liquid(size):
    r, h = size / 2, size / 4
    return shapes.revolve([(0, -h), (r, -h), (r, h), (0, h)], SEGMENTS)[:2]


def _sphere(size):
    vertices, faces = shapes.cube_sphere(8)
    return vertices * size / 2, faces


SHAPES = {"sphere": _sphere, "slab": _slab, "prism": _prism, "liquid": _liquid}
SHAPE_ITEMS = (
    ("sphere", "Sphere", "A ball, round to 1e-5 of its radius", "MESH_UVSPHERE", 0),
    ("slab", "Slab", "A plate with parallel faces, a tenth as thick as it is wide", "MESH_PLANE", 1),
    ("prism", "Prism", "A prism over an equilateral triangle", "MESH_CONE", 2),
    ("liquid", "Liquid", "A body of liquid: a closed cylinder with a flat top", "MESH_CYLINDER", 3),
)


class NIM_OT_add_object(bpy.types.Operator):
    """Add a body of a negative-index material at the 3D cursor"""

    bl_idname = "nim.add_object"
    bl_label = "Add Negative-Index Object"
    bl_options = {"REGISTER", "UNDO"}

    shape: bpy.props.EnumProperty(
        name="Shape", description="What body to add", items=SHAPE_ITEMS, translation_context=OWN
    )
    size: bpy.props.FloatProperty(
        name="Size",
        description="Its width: the sphere's and the liquid's diameter, the slab's and the prism's side",
        default=2.0,
        min=0.001,
        soft_max=100.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    medium: medium_property("nim-1.5", "Medium", "What it is made of; outside is air")
    n: index_property(-1.5)
    mu: permeability_property()

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

    def execute(self, context):
        """Add it, selected and active."""
        name = next(item[1] for item in SHAPE_ITEMS if item[0] == self.shape)
        try:
            medium = chosen_medium(self.medium, self.n, self.mu)
            # a name of no number: n changes later, and Blender takes what follows a dot for its own
            material = interface_material(f"{name} Interface", medium, backend=backend_for(context.scene))
        except (ValueError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        vertices, faces = SHAPES[self.shape](self.size)
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], faces)
        mesh.materials.append(material)
        if self.shape == "sphere":
            mesh.shade_smooth()
        elif self.shape == "liquid":
            mesh.shade_smooth()
            # Cycles keeps the flat ends apart from the round side only where the edges are sharp
            mesh.set_sharp_from_angle(angle=math.radians(40))
        mesh.update()
        object_ = object_data_add(context, mesh)
        if self.shape == "sphere":
            make_round(object_, self.size / 2)
        text = pgettext_rpt("{name} of index {n} added")
        self.report({"INFO"}, text.format(name=pgettext_rpt(name, OWN), n=number(medium.n)))
        return {"FINISHED"}

    def draw(self, context):
        """Draw the redo panel: numbers only where the medium is of own values."""
        self.layout.use_property_split = True
        self.layout.prop(self, "shape")
        self.layout.prop(self, "size")
        draw_choice(self.layout, self, "medium", "n", "mu")


class NIM_MT_add_node(bpy.types.Menu):
    """The interface node, with ready media"""

    bl_idname = "NIM_MT_add_node"
    bl_label = "Negative Index"

    def draw(self, context):
        """Draw an entry for each medium: those of one index, beside which it stands, the NIMs first; then the others."""
        layout = self.layout
        layout.operator_context = "INVOKE_REGION_WIN"
        layout.operator("nim.add_node", text="Interface").medium = "nim-1.5"
        items = {item[0]: item[1] for item in MEDIUM_ITEMS}
        plain = sorted((name for name in MEDIUM_NUMBERS if name != "air"), key=lambda name: not MEDIA[name].is_nim)
        for names in (plain, TAUGHT_NUMBERS, MEASURED_NUMBERS):
            layout.separator()
            for name in names:
                layout.operator("nim.add_node", text=items[name]).medium = name


class NIM_MT_add_mesh(bpy.types.Menu):
    """Bodies of a negative-index material"""

    bl_idname = "NIM_MT_add_mesh"
    bl_label = "Negative Index"

    def draw(self, context):
        """Draw an entry for each shape."""
        for identifier, name, _, icon, _ in SHAPE_ITEMS:
            self.layout.operator("nim.add_object", text=name, text_ctxt=OWN, icon=icon).shape = identifier


def _node_menu(self, context):
    if context.space_data.tree_type == "ShaderNodeTree":
        self.layout.separator()
        self.layout.menu("NIM_MT_add_node")


def _mesh_menu(self, context):
    self.layout.separator()
    self.layout.menu("NIM_MT_add_mesh", icon="MATERIAL")


CLASSES = (NIM_OT_add_node, NIM_OT_add_object, NIM_MT_add_node, NIM_MT_add_mesh)


def register():
    """Add the menus to Blender's own."""
    bpy.types.NODE_MT_add.append(_node_menu)
    bpy.types.VIEW3D_MT_mesh_add.append(_mesh_menu)


def unregister():
    """Take them back."""
    bpy.types.VIEW3D_MT_mesh_add.remove(_mesh_menu)
    bpy.types.NODE_MT_add.remove(_node_menu)

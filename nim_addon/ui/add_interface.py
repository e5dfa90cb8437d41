# SPDX-License-Identifier: GPL-3.0-or-later
"""What is added of the interface: its node with ready media, and small bodies of a negative-index material."""

import math

import bpy
from bpy.app.translations import pgettext_rpt

from ..cycles.material import interface_material, interface_node
from ..physics import MEDIA
from ..scenes import shapes
from ..scenes.sphere import make_round
from .adding import Entry, NodeAddition, ObjectAddition, add_mesh, length_property
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


class NIM_OT_add_node(NodeAddition, bpy.types.Operator):
    """Add an interface node between this medium and air"""

    bl_idname = "nim.add_node"
    bl_label = "Add Interface"

    medium: medium_property("nim-1.5", "Inside", "The medium behind the faces; outside is air")
    n: index_property(-1.5)
    mu: permeability_property()

    def node(self, context, tree):
        """The node, between that medium and air."""
        return interface_node(tree, chosen_medium(self.medium, self.n, self.mu), backend=backend_for(context.scene))

    def told(self, node):
        """Which index it is of."""
        n = chosen_medium(self.medium, self.n, self.mu).n
        return pgettext_rpt("Interface of index {n} added").format(n=number(n))

    def draw(self, context):
        """Draw the redo panel: numbers only where the medium is of own values."""
        draw_choice(self.layout, self, "medium", "n", "mu")


def _cube(size):
    return shapes.box((-size / 2,) * 3, (size / 2,) * 3)


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


SHAPES = {"sphere": _sphere, "cube": _cube, "slab": _slab, "prism": _prism, "liquid": _liquid}
SHAPE_ITEMS = (
    ("sphere", "Sphere", "A ball, round to 1e-5 of its radius", "MESH_UVSPHERE", 0),
    ("cube", "Cube", "A block with six square faces", "MESH_CUBE", 4),
    ("slab", "Slab", "A plate with parallel faces, a tenth as thick as it is wide", "MESH_PLANE", 1),
    ("prism", "Prism", "A prism over an equilateral triangle", "MESH_CONE", 2),
    ("liquid", "Liquid", "A body of liquid: a closed cylinder with a flat top", "MESH_CYLINDER", 3),
)


class NIM_OT_add_object(ObjectAddition, bpy.types.Operator):
    """Add a body of a negative-index material at the 3D cursor"""

    bl_idname = "nim.add_object"
    bl_label = "Add Negative-Index Object"

    shape: bpy.props.EnumProperty(
        name="Shape", description="What body to add", items=SHAPE_ITEMS, translation_context=OWN
    )
    size: length_property("Size", "Its width: the sphere's and the liquid's diameter, the side of the others", 2.0)
    medium: medium_property("nim-1.5", "Medium", "What it is made of; outside is air")
    n: index_property(-1.5)
    mu: permeability_property()

    def add(self, context):
        """Add it, selected and active."""
        name = next(item[1] for item in SHAPE_ITEMS if item[0] == self.shape)
        medium = chosen_medium(self.medium, self.n, self.mu)
        # a name of no number: n changes later, and Blender takes what follows a dot for its own
        material = interface_material(f"{name} Interface", medium, backend=backend_for(context.scene))
        object_ = add_mesh(context, name, *SHAPES[self.shape](self.size), material)
        if self.shape == "sphere":
            object_.data.shade_smooth()
            make_round(object_, self.size / 2)
        elif self.shape == "liquid":
            object_.data.shade_smooth()
            # Cycles keeps the flat ends apart from the round side only where the edges are sharp
            object_.data.set_sharp_from_angle(angle=math.radians(40))
        text = pgettext_rpt("{name} of index {n} added")
        return text.format(name=pgettext_rpt(name, OWN), n=number(medium.n))

    def draw(self, context):
        """Draw the redo panel: numbers only where the medium is of own values."""
        self.layout.use_property_split = True
        self.layout.prop(self, "shape")
        self.layout.prop(self, "size")
        draw_choice(self.layout, self, "medium", "n", "mu")


def _media(names):
    items = {item[0]: item[1] for item in MEDIUM_ITEMS}
    return tuple(Entry("nim.add_node", items[name], "NODE_MATERIAL", values={"medium": name}) for name in names)


OBJECTS = tuple(Entry("nim.add_object", name, icon, {"shape": shape}) for shape, name, _, icon, _ in SHAPE_ITEMS)
NODES = (Entry("nim.add_node", "Interface", "MATERIAL", values={"medium": "nim-1.5"}),)
# The media of one index, beside which it stands, the NIMs first; then the others.
MEDIA_NODES = (
    _media(sorted((name for name in MEDIUM_NUMBERS if name != "air"), key=lambda name: not MEDIA[name].is_nim)),
    _media(TAUGHT_NUMBERS),
    _media(MEASURED_NUMBERS),
)
CLASSES = (NIM_OT_add_node, NIM_OT_add_object)

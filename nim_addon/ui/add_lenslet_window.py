# SPDX-License-Identifier: GPL-3.0-or-later
"""A window of lenslets as an object, and its node."""

import bpy
from bpy.app.translations import pgettext_rpt

from ..cycles.lenslets import lenslet_material, lenslet_node
from ..physics.lenslet import LensletWindow
from .adding import Entry, NodeAddition, ObjectAddition, add_mesh, length_property
from .media import backend_for, number, plain
from .translations import OWN

NAME = "Lenslet Window"


def _eta_property():
    return bpy.props.FloatProperty(
        name="Eta",
        description="In the place of n2 / n1: tangents of angles are divided by it from the front; below 0 depth is turned over",
        min=-100.0,
        max=100.0,
        default=-1.0,
        step=1,
        precision=3,
    )


class NIM_OT_add_lenslet_window(ObjectAddition, bpy.types.Operator):
    """Add an upright window of two arrays of lenslets, through which things are seen in another depth and size"""

    bl_idname = "nim.add_lenslet_window"
    bl_label = "Add Lenslet Window"

    eta: _eta_property()
    width: length_property("Width", "Its width and height", 2.0)
    offset: bpy.props.FloatVectorProperty(
        name="Offset",
        description="How far each lens behind stands aside of the one in front, in its focal lengths: all is seen from aside",
        size=2,
        min=-100.0,
        max=100.0,
    )
    finite: bpy.props.BoolProperty(
        name="Finite Lenslets", description="Lose the light that misses the lenslet behind; ideal ones lose nothing"
    )
    aperture: bpy.props.FloatProperty(
        name="Aperture",
        description="Width of a lens, in focal lengths of the one in front; it counts as far as Losses do",
        min=0.0,
        max=1000.0,
        default=0.5,
        step=1,
    )

    def add(self, context):
        """Add it, its front towards -y."""
        eta, offset = plain(self.eta), tuple(map(plain, self.offset))
        window = LensletWindow(eta, offset, plain(self.aperture) if self.finite else None)
        material = lenslet_material(NAME, window, backend=backend_for(context.scene))
        half = self.width / 2
        corners = [(-half, 0, -half), (half, 0, -half), (half, 0, half), (-half, 0, half)]
        add_mesh(context, NAME, corners, [(0, 1, 2, 3)], material)
        return pgettext_rpt("{name} of eta {eta} added").format(name=pgettext_rpt(NAME, OWN), eta=number(eta))

    def draw(self, context):
        """Draw the redo panel."""
        self.layout.use_property_split = True
        for name in ("eta", "width", "offset", "finite"):
            self.layout.prop(self, name)
        if self.finite:
            self.layout.prop(self, "aperture")


class NIM_OT_add_lenslet_node(NodeAddition, bpy.types.Operator):
    """Add a node of a window of lenslets: faces that wear it bend light by a law of tangents"""

    bl_idname = "nim.add_lenslet_node"
    bl_label = "Add Lenslet Window"

    eta: _eta_property()

    def node(self, context, tree):
        """The node, of ideal lenslets."""
        return lenslet_node(tree, LensletWindow(plain(self.eta)), backend=backend_for(context.scene))

    def warm(self):
        """Where it bends backwards."""
        return self.eta < 0

    def told(self, node):
        """Which eta it is of."""
        text = pgettext_rpt("{name} of eta {eta} added")
        return text.format(name=pgettext_rpt(NAME, OWN), eta=number(plain(self.eta)))


OBJECTS = (Entry("nim.add_lenslet_window", NAME, "MESH_GRID"),)
NODES = (Entry("nim.add_lenslet_node", NAME, "MESH_GRID"),)
CLASSES = (NIM_OT_add_lenslet_window, NIM_OT_add_lenslet_node)

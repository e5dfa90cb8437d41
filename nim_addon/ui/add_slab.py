# SPDX-License-Identifier: GPL-3.0-or-later
"""A slab of a hyperbolic medium as an object, and its node."""

import bpy
from bpy.app.translations import pgettext_rpt

from ..cycles.slabs import slab_material, slab_node
from ..physics.uniaxial import UniaxialSlab
from ..scenes import shapes
from .adding import Entry, NodeAddition, ObjectAddition, add_mesh, length_property
from .media import backend_for, number, plain
from .translations import OWN

NAME = "Hyperbolic Slab"


def _permittivity_property(name, description, default):
    return bpy.props.FloatProperty(
        name=name, description=description, min=-100.0, max=100.0, default=default, step=1, precision=3
    )


def _across_property():
    text = "Relative permittivity within the plane of the slab; never 0"
    return _permittivity_property("Permittivity Across", text, 2.0)


def _along_property():
    text = "Relative permittivity along the normal; of another sign than across it, the slab is hyperbolic; never 0"
    return _permittivity_property("Permittivity Along", text, -3.0)


class NIM_OT_add_slab(ObjectAddition, bpy.types.Operator):
    """Add an upright plate through which all is seen twice, once bent backwards, though no index in it is negative"""

    bl_idname = "nim.add_slab"
    bl_label = "Add Hyperbolic Slab"

    across: _across_property()
    along: _along_property()
    thickness: length_property("Thickness", "The thicker, the farther apart the two images are", 0.5)
    width: length_property("Width", "Its width and height", 2.0)

    def add(self, context):
        """Add its two faces, towards -y and y: each is the whole slab, which needs no rim."""
        slab = UniaxialSlab(plain(self.across), plain(self.along), plain(self.thickness))
        material = slab_material(NAME, slab, backend=backend_for(context.scene))
        half, deep = self.width / 2, slab.thickness / 2
        front = [(-half, -deep, -half), (half, -deep, -half), (half, -deep, half), (-half, -deep, half)]
        back = [(x, deep, z) for x, _, z in front[::-1]]
        vertices, faces, _ = shapes.joined((front, [(0, 1, 2, 3)]), (back, [(0, 1, 2, 3)]))
        add_mesh(context, NAME, vertices, faces, material)
        return _told(self)

    def draw(self, context):
        """Draw the redo panel."""
        self.layout.use_property_split = True
        for name in ("across", "along", "thickness", "width"):
            self.layout.prop(self, name)


class NIM_OT_add_slab_node(NodeAddition, bpy.types.Operator):
    """Add a node of a uniaxial slab; its Thickness must be the distance of the faces that wear it"""

    bl_idname = "nim.add_slab_node"
    bl_label = "Add Hyperbolic Slab"

    across: _across_property()
    along: _along_property()

    def node(self, context, tree):
        """The node, of the usual thickness."""
        slab = UniaxialSlab(plain(self.across), plain(self.along), 0.25)
        return slab_node(tree, slab, backend=backend_for(context.scene))

    def warm(self):
        """Where one of its images is bent backwards."""
        return self.across * self.along < 0

    def told(self, node):
        """Which permittivities it is of."""
        return _told(self)


def _told(operator):
    text = pgettext_rpt("{name} of permittivity {across} across and {along} along added")
    across, along = number(plain(operator.across)), number(plain(operator.along))
    return text.format(name=pgettext_rpt(NAME, OWN), across=across, along=along)


OBJECTS = (Entry("nim.add_slab", NAME, "MESH_PLANE"),)
NODES = (Entry("nim.add_slab_node", NAME, "MESH_PLANE"),)
CLASSES = (NIM_OT_add_slab, NIM_OT_add_slab_node)

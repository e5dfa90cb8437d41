# SPDX-License-Identifier: GPL-3.0-or-later
"""The flat lens of Veselago and Pendry as an object: a plate of n = mu = -1, behind which what is before it has an image."""

import bpy
from bpy.app.translations import pgettext_rpt

from ..cycles.material import interface_material
from ..physics import Medium
from ..scenes import shapes
from .adding import Entry, ObjectAddition, add_mesh, length_property
from .media import MOST_N, backend_for, number, plain
from .translations import OWN

NAME = "Flat Lens"


class NIM_OT_add_flat_lens(ObjectAddition, bpy.types.Operator):
    """Add a plate that stands upright and images as a lens does: what is up to its thickness away has an image beyond it"""

    bl_idname = "nim.add_flat_lens"
    bl_label = "Add Flat Lens"

    thickness: length_property("Thickness", "What is behind it is seen nearer, at n = -1 by twice this", 1.0)
    width: length_property("Width", "Its width and height: the wider, the more of the light it gathers", 6.0)
    n: bpy.props.FloatProperty(
        name="n",
        description="Refractive index and permeability; -1 alone is sharp",
        min=-MOST_N,
        max=-0.01,
        default=-1.0,
        step=1,
        precision=3,
    )

    def add(self, context):
        """Add it, its faces towards -y and y."""
        n = plain(self.n)
        material = interface_material(f"{NAME} Interface", Medium(n, n), backend=backend_for(context.scene))
        half = self.width / 2, self.thickness / 2, self.width / 2
        add_mesh(context, NAME, *shapes.box([-side for side in half], half), material)
        text = pgettext_rpt("{name} of index {n} added")
        return text.format(name=pgettext_rpt(NAME, OWN), n=number(n))

    def draw(self, context):
        """Draw the redo panel."""
        self.layout.use_property_split = True
        for name in ("thickness", "width", "n"):
            self.layout.prop(self, name)


OBJECTS = (Entry("nim.add_flat_lens", NAME, "MOD_SOLIDIFY"),)
NODES = (Entry("nim.add_node", NAME, "MOD_SOLIDIFY", values={"medium": "custom", "n": -1.0, "mu": 1.0}),)
CLASSES = (NIM_OT_add_flat_lens,)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A floor below what bends light, on which its caustics are seen."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt

from ..caustics import landing
from ..cycles.meshes import bounds
from ..scenes import shapes, surfaces
from .adding import Addition

WIDE = 10  # times what bends light
GAP = 1e-3  # of its size: what touches is in one plane
SQUARES = 40  # across
LIGHT, DARK = (0.5, 0.5, 0.5), (0.36, 0.36, 0.36)


class NIM_OT_add_floor(Addition, bpy.types.Operator):
    """Add a chequered floor just below what bends light, for its caustics to land on"""

    bl_idname = "nim.add_floor"
    bl_label = "Add Floor"

    @classmethod
    def poll(cls, context):
        """Only in Object Mode, in a scene that can be changed."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the mode you are in for Object Mode first")
            return False
        if not context.scene.is_editable:
            cls.poll_message_set("The scene is linked from a library: make it local first")
            return False
        return True

    def add(self, context):
        """Add it, and leave selected what is: the caustics to come are those of that."""
        points = landing.bodies(context.scene)
        if not len(points):
            raise ValueError(pgettext_rpt("Nothing bends light here: make a mesh negative-index first"))
        low, high = bounds(points)
        size = float(max(high - low))
        x, y, _ = (low + high) / 2
        mesh = bpy.data.meshes.new("Floor")
        edge = size * WIDE / 2
        vertices, faces = shapes.rectangle((-edge, -edge), (edge, edge))
        mesh.from_pydata(np.asarray(vertices).tolist(), [], faces)
        mesh.materials.append(_chequered(2 * edge / SQUARES))
        floor = bpy.data.objects.new("Floor", mesh)
        floor.location = x, y, low[2] - GAP * size
        context.scene.collection.objects.link(floor)
        return pgettext_rpt("The scene has a floor: {name}").format(name=floor.name)


def _chequered(side):
    """A matt grey board of squares of that side, in object space."""

    def paint(nodes):
        place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
        inputs = {0: place, 1: (*LIGHT, 1.0), 2: (*DARK, 1.0), 3: 1 / side}  # Vector, the two colours, Scale
        return nodes.add("ShaderNodeTexChecker", inputs=inputs).outputs[0]

    material = surfaces.diffuse("Floor", paint)
    material.diffuse_color = (*LIGHT, 1.0)  # in solid shading
    return material


CLASSES = (NIM_OT_add_floor,)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A graded ball as an object, and its node: a lens, a fish-eye, a magnifier, or what nobody sees."""

import math

import bpy
from bpy.app.translations import pgettext_rpt

from ..cycles.graded import graded_ball_material, graded_core_material, profile_node
from ..physics.graded import Profile
from ..scenes import shapes
from ..scenes.ball import globe
from ..scenes.sphere import make_round
from .adding import Entry, NodeAddition, ObjectAddition, add_mesh, length_property
from .media import backend_for, plain
from .translations import OWN

NAME = "Graded Ball"
DIVISIONS = 32  # of its mesh, along a quarter of a circle: only its outline shows them
CORE_DIVISIONS = 8  # of a core's, which modifiers make round
# The numbers are in people's files.
DEVICE_ITEMS = (
    ("luneburg", "Luneburg", "A lens: it shows the half space behind it, upside down", "NONE", 0),
    ("fisheye", "Fisheye", "Maxwell's: every point of its rim is seen at the opposite one", "NONE", 1),
    ("eaton", "Eaton", "It sends all light back where it came from", "NONE", 2),
    ("invisible", "Invisible", "It leads light once round its middle, and on", "NONE", 3),
    ("magnifier", "Magnifier", "A mirror that a shell of a NIM makes larger", "NONE", 4),
    ("cloak", "Cloak", "It leads light around what is in its hollow", "NONE", 5),
    ("turn", "Turn", "It turns all light by the same angle", "NONE", 6),
)
SURFACE_ITEMS = (
    ("mirror", "Mirror", "It reflects all light", "NONE", 0),
    ("black", "Black", "It takes all light", "NONE", 1),
    ("textured", "Textured", "A ball of its own, of any material, seen through the rest", "NONE", 2),
)


class BallChoice:
    """What of a physics.graded.Profile a person chooses as a ball is added."""

    device: bpy.props.EnumProperty(
        name="Device",
        description="What the index of the ball does with light",
        items=DEVICE_ITEMS,
        translation_context=OWN,
    )
    use_core: bpy.props.BoolProperty(name="Own Core", description="Whether there is a core in it; a magnifier has one")
    core: bpy.props.FloatProperty(
        name="Core",
        description="Radius of a core in the ball, whose radius is 1",
        min=0.01,
        max=0.99,
        default=0.8,
        precision=3,
    )
    surface: bpy.props.EnumProperty(
        name="Surface", description="What the core is", items=SURFACE_ITEMS, translation_context=OWN
    )
    use_cap: bpy.props.BoolProperty(name="Own Cap", description="Whether there is a largest index; a cloak has none")
    cap: bpy.props.FloatProperty(
        name="Cap", description="The largest index in the ball", min=1.01, max=100.0, default=3.0, precision=2
    )
    angle: bpy.props.FloatProperty(
        name="Angle",
        description="By how much the device turn turns all light",
        min=math.radians(1),
        max=2 * math.pi,
        default=math.pi / 2,
        subtype="ANGLE",
    )
    hollow: bpy.props.FloatProperty(
        name="Hollow", description="Radius of the hollow in a cloak", min=0.05, max=0.95, default=0.6, precision=3
    )

    def profile(self) -> Profile:
        """The Profile that is chosen; what the device does not have is left out."""
        core = plain(self.core) if self.use_core or self.device == "magnifier" else None
        cap = plain(self.cap) if self.use_cap and self.device != "cloak" else None
        angle = min(self.angle, 2 * math.pi)
        return Profile(self.device, core, self.surface, cap, angle, plain(self.hollow))

    def draw_profile(self, layout):
        """Draw what there is to choose of this device."""
        layout.use_property_split = True
        layout.prop(self, "device")
        if self.device == "turn":
            layout.prop(self, "angle")
        if self.device == "cloak":
            layout.prop(self, "hollow")
        if self.device != "magnifier":
            layout.prop(self, "use_core")
        if self.use_core or self.device == "magnifier":
            layout.prop(self, "core")
            layout.prop(self, "surface")
        if self.device != "cloak":
            layout.prop(self, "use_cap")
            if self.use_cap:
                layout.prop(self, "cap")

    def said(self):
        """What is said when it has been added."""
        text = pgettext_rpt("{name} added: {device}")
        words = {word: label for word, label, *_ in DEVICE_ITEMS}
        return text.format(name=pgettext_rpt(NAME, OWN), device=pgettext_rpt(words[self.device], OWN))


class NIM_OT_add_graded_ball(BallChoice, ObjectAddition, bpy.types.Operator):
    """Add a ball whose index depends on the distance from its middle: a lens, a fish-eye, a magnifier, or not to be seen"""

    bl_idname = "nim.add_graded_ball"
    bl_label = "Add Graded Ball"

    radius: length_property("Radius", "Radius of the ball; scale the object evenly, if at all", 1.0)

    def add(self, context):
        """Add it around the 3D cursor."""
        radius = plain(self.radius)
        profile = self.profile()
        textured = profile.core is not None and profile.surface == "textured"
        make = graded_core_material if textured else graded_ball_material
        material = make(NAME, profile, backend=backend_for(context.scene), radius=radius)
        core = _ball(context, "Core", radius * profile.core, CORE_DIVISIONS, globe("Core")) if textured else None
        obj = _ball(context, NAME, radius, DIVISIONS, material)
        if core:
            make_round(core, radius * profile.core)
            core.parent, core.location, core.rotation_euler = obj, (0, 0, 0), (0, 0, 0)
        return self.said()

    def draw(self, context):
        """Draw the redo panel."""
        self.draw_profile(self.layout)
        self.layout.prop(self, "radius")


def _ball(context, name, radius, divisions, material):
    vertices, faces = shapes.cube_sphere(divisions)
    obj = add_mesh(context, name, vertices * radius, faces, material)
    obj.data.shade_smooth()
    return obj


class NIM_OT_add_graded_ball_node(BallChoice, NodeAddition, bpy.types.Operator):
    """Add a node of a graded ball; its Radius is that of a sphere around the origin of the object"""

    bl_idname = "nim.add_graded_ball_node"
    bl_label = "Add Graded Ball"

    def node(self, context, tree):
        """The node, of radius 1."""
        return profile_node(tree, self.profile(), backend=backend_for(context.scene))

    def warm(self):
        """Where a NIM is in it."""
        return self.device == "magnifier"

    def draw(self, context):
        """Draw the redo panel."""
        self.draw_profile(self.layout)

    def told(self, node):
        """Which device it is."""
        return self.said()


OBJECTS = (Entry("nim.add_graded_ball", NAME, "SHADING_RENDERED"),)
NODES = (Entry("nim.add_graded_ball_node", NAME, "SHADING_RENDERED"),)
CLASSES = (NIM_OT_add_graded_ball, NIM_OT_add_graded_ball_node)

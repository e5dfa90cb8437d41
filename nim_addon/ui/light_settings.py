# SPDX-License-Identifier: GPL-3.0-or-later
"""How light paths are drawn: the settings of a scene, which the operator takes, and how they are shown."""

import math
from functools import partial

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty

# Blender files hold these numbers.
SOURCES = (
    (
        "SIDE",
        "From the Side",
        "A narrow beam from outside, across the camera's view, that meets the surface at a slant and so is seen to bend",
        "AXIS_SIDE",
        3,
    ),
    (
        "CURSOR",
        "3D Cursor",
        "From the 3D cursor; from its left (-X) if it is in the target's middle",
        "PIVOT_CURSOR",
        0,
    ),
    ("CAMERA", "Camera", "From the scene's camera, against the light it sees", "OUTLINER_OB_CAMERA", 1),
    ("LAMP", "Lamps", "From every selected lamp; from the scene's only lamp, where none is selected", "LIGHT", 2),
    (
        "HANDLE",
        "Handle",
        "From an object that you move and turn, along its own Z axis, where its arrow points",
        "EMPTY_SINGLE_ARROW",
        4,
    ),
)
AIMS = (
    ("TARGET", "Object", "Towards the active object, or all that bends light if it does not", "PIVOT_BOUNDBOX", 0),
    ("FORWARD", "Forward", "Where the camera looks, the lamp shines or the cursor's -Z points", "FORWARD", 1),
    ("DIRECTION", "Direction", "Along a direction of your own", "ORIENTATION_GLOBAL", 2),
)
ARRANGEMENTS = (
    ("BEAM", "Beam", "Parallel rays side by side in a plane", "ALIGN_JUSTIFY", 0),
    ("FAN", "Fan", "Rays from one point in a plane", "IPO_LINEAR", 1),
    ("CONE", "Cone", "Rays from one point, evenly within a cone", "CONE", 2),
)

COLORS = (
    (
        "WAVELENGTH",
        "Wavelength",
        "Where a medium disperses, several wavelengths in their colors; else as Part",
        "SEQ_CHROMA_SCOPE",
        0,
    ),
    ("PART", "Part", "Yellow as it arrives, blue what is reflected, orange what goes on", "MOD_EDGESPLIT", 1),
    (
        "ENERGY",
        "Energy",
        "From white, with all the energy of its ray, over red to blue, with the least",
        "LIGHTPROBE_SPHERE",
        2,
    ),
)

# What a person sees of each, on one line.
LEGENDS = {
    "WAVELENGTH": "The colors are those of the light",
    "PART": "Yellow in, orange on, blue reflected",
    "ENERGY": "White: all the light; blue: least",
}

# An operator takes the settings of the scene, not those of the last time.
Bool = partial(BoolProperty, options={"SKIP_SAVE"})
Enum = partial(EnumProperty, options={"SKIP_SAVE"})
Float = partial(FloatProperty, options={"SKIP_SAVE"})
FloatVector = partial(FloatVectorProperty, options={"SKIP_SAVE"})
Int = partial(IntProperty, options={"SKIP_SAVE"})


class Settings:
    """The settings of the rays: those of a scene, and those of the operator while it can be redone."""

    source: Enum(name="Source", description="Where the rays start", items=SOURCES, default="SIDE")
    aim: Enum(name="Aim", description="Where the rays go; those of a sun always go where it shines", items=AIMS)
    direction: FloatVector(
        name="Direction",
        description="Direction of the rays in the scene's axes, of any length but zero",
        default=(1.0, 0.0, 0.0),
        subtype="XYZ",
    )
    arrangement: Enum(
        name="Shape", description="How the rays spread; those of a sun are always parallel", items=ARRANGEMENTS
    )
    rays: Int(name="Rays", description="How many rays start at each source", default=21, min=1, max=1000)
    width: Float(name="Width", description="Width of a beam", default=1.0, min=0.0, unit="LENGTH")
    angle: Float(
        name="Angle",
        description="Angle between the outermost rays of a fan or a cone",
        default=math.radians(30),
        min=0.0,
        max=math.radians(360),
        subtype="ANGLE",
    )
    roll: Float(
        name="Roll",
        description="Turns the plane of a beam or a fan about its middle ray; at 0 it stands upright",
        default=0.0,
        subtype="ANGLE",
    )
    bounces: Int(
        name="Bounces", description="How many surfaces a path may cross or be reflected by", default=8, min=0, max=64
    )
    least: Float(
        name="Least Energy",
        description="A branch with less than this share of its ray's energy is not drawn",
        default=0.001,
        min=0.00001,
        max=0.99,
        precision=4,
    )
    fit: Bool(
        name="Automatic Size",
        description="Choose the width of a beam, the thickness and the reach by the size of what the rays meet",
        default=True,
    )
    thickness: Float(
        name="Thickness",
        description="Thickness of a ray with all its energy; weaker ones are thinner",
        default=0.02,
        min=0.0,
        precision=4,
        unit="LENGTH",
    )
    reach: Float(
        name="Reach",
        description="How far a ray that meets nothing more is drawn",
        default=3.0,
        min=0.000001,
        unit="LENGTH",
    )
    through: Bool(
        name="Seen Inside",
        description="In a render, show the rays inside and behind what bends light too, bent as anything else",
        default=True,
    )


class NIM_PG_rays(Settings, bpy.types.PropertyGroup):
    """How the rays of a scene are drawn: Scene.nim_rays."""

    color: EnumProperty(
        name="Color By",
        description="What the color of a live ray says; the thicker it is, the more light it has",
        items=COLORS,
    )
    handle: PointerProperty(
        type=bpy.types.Object, name="Handle", description="The object that rays start from, along its own Z axis"
    )


def draw_settings(layout: bpy.types.UILayout, settings: Settings) -> None:
    """Draw all of them, but those that do not count beside the others."""
    draw_first(layout, settings)
    draw_others(layout, settings)


def draw_first(layout: bpy.types.UILayout, settings: Settings) -> None:
    """Draw those that a person needs at first: where rays start, and how many."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    column.prop(settings, "source")
    column.prop(settings, "rays")


def draw_others(layout: bpy.types.UILayout, settings: Settings) -> None:
    """Draw the others, but those that do not count beside them."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    if settings.source != "HANDLE":
        column.prop(settings, "aim")
    if settings.source != "HANDLE" and settings.aim == "DIRECTION":
        column.prop(settings, "direction")
    column = layout.column(align=True)
    column.prop(settings, "arrangement")
    if settings.arrangement != "BEAM":
        column.prop(settings, "angle")
    if settings.arrangement != "CONE":
        column.prop(settings, "roll")
    column = layout.column(align=True)
    column.prop(settings, "bounces")
    column.prop(settings, "least")
    column = layout.column(align=True)
    column.prop(settings, "fit")
    if not settings.fit:
        column.prop(settings, "width")
        column.prop(settings, "thickness")
        column.prop(settings, "reach")
    layout.prop(settings, "through")


CLASSES = (NIM_PG_rays,)


def register():
    """Add the settings that each scene keeps."""
    bpy.types.Scene.nim_rays = PointerProperty(
        type=NIM_PG_rays, name="Light Paths", description="How the light paths of this scene are drawn"
    )


def unregister():
    """Take them back."""
    del bpy.types.Scene.nim_rays

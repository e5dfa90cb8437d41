# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths: rays through the interfaces of a scene, drawn as curves."""

import math

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty

from ..cycles.casting import Meshes
from ..cycles.nodes import Nodes, empty_tree
from ..cycles.visibility import PATHS_MARK as MARK
from ..cycles.visibility import as_rendered, shown
from ..physics.rays import MOST_SEGMENTS, Fate, Kind, trace
from . import light_sources
from .panels import Sidebar

COLLECTION = "NIM Light Paths"
# MARK is the custom property of all we draw; that of an object holds the source it was drawn for.

# Linear colours: light arrives yellow, is reflected blue, and goes on orange.
COLORS = {Kind.INCIDENT: (1.0, 0.80, 0.25), Kind.REFLECTED: (0.10, 0.60, 1.0), Kind.TRANSMITTED: (1.0, 0.20, 0.02)}
# Thickness goes with this power of the energy: a branch of one per cent is still seen, a third as thick.
THINNING = 0.25
# Where this share of the light is cut off by the settings, that is said.
CUT = 0.5


class Settings:
    """The settings of the rays: those of a scene, and those of the operator while it can be redone."""

    source: EnumProperty(
        name="Source",
        description="Where the rays start",
        items=(
            (
                "SIDE",
                "From the Side",
                "From outside, beside the interface as the camera sees it; from above, at a slant, if it is flat",
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
            ("LAMP", "Selected Lamps", "From every selected lamp; from the only lamp, where none is", "LIGHT", 2),
        ),
        default="SIDE",
        options={"SKIP_SAVE"},
    )
    aim: EnumProperty(
        name="Aim",
        description="Where the rays go; those of a sun always go where it shines",
        items=(
            ("TARGET", "Interface", "Towards the active object, or all interfaces if it is none", "PIVOT_BOUNDBOX", 0),
            ("FORWARD", "Forward", "Where the camera looks, the lamp shines or the cursor's -Z points", "FORWARD", 1),
            ("DIRECTION", "Direction", "Along a direction of your own", "ORIENTATION_GLOBAL", 2),
        ),
        options={"SKIP_SAVE"},
    )
    direction: FloatVectorProperty(
        name="Direction",
        description="Direction of the rays in the scene's axes, of any length but zero",
        default=(1.0, 0.0, 0.0),
        subtype="XYZ",
        options={"SKIP_SAVE"},
    )
    arrangement: EnumProperty(
        name="Arrangement",
        description="How the rays spread; those of a sun are always parallel",
        items=(
            ("BEAM", "Beam", "Parallel rays side by side in a plane", "ALIGN_JUSTIFY", 0),
            ("FAN", "Fan", "Rays from one point in a plane", "IPO_LINEAR", 1),
            ("CONE", "Cone", "Rays from one point, evenly within a cone", "CONE", 2),
        ),
        options={"SKIP_SAVE"},
    )
    rays: IntProperty(
        name="Rays",
        description="How many rays start at each source",
        default=21,
        min=1,
        max=1000,
        options={"SKIP_SAVE"},
    )
    width: FloatProperty(
        name="Width",
        description="Width of a beam",
        default=1.0,
        min=0.0,
        unit="LENGTH",
        options={"SKIP_SAVE"},
    )
    angle: FloatProperty(
        name="Angle",
        description="Angle between the outermost rays of a fan or a cone",
        default=math.radians(30),
        min=0.0,
        max=math.radians(360),
        subtype="ANGLE",
        options={"SKIP_SAVE"},
    )
    roll: FloatProperty(
        name="Roll",
        description="Turns the plane of a beam or a fan about its middle ray; at 0 it stands upright",
        default=0.0,
        subtype="ANGLE",
        options={"SKIP_SAVE"},
    )
    bounces: IntProperty(
        name="Bounces",
        description="How many interfaces a path may cross or be reflected by",
        default=8,
        min=0,
        max=64,
        options={"SKIP_SAVE"},
    )
    least: FloatProperty(
        name="Least Energy",
        description="A branch with less than this share of its ray's energy is not drawn",
        default=0.001,
        min=0.00001,
        max=0.99,
        precision=4,
        options={"SKIP_SAVE"},
    )
    fit: BoolProperty(
        name="Fit to Interfaces",
        description="Choose the width of a beam, the thickness and the reach by the size of what the rays meet",
        default=True,
        options={"SKIP_SAVE"},
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Thickness of a ray with all its energy; weaker ones are thinner",
        default=0.02,
        min=0.0,
        precision=4,
        unit="LENGTH",
        options={"SKIP_SAVE"},
    )
    reach: FloatProperty(
        name="Reach",
        description="How far a ray that meets nothing more is drawn",
        default=3.0,
        min=0.000001,
        unit="LENGTH",
        options={"SKIP_SAVE"},
    )
    through: BoolProperty(
        name="Seen Inside",
        description="In a render, show the rays inside and behind an interface too, bent by it as anything else",
        default=True,
        options={"SKIP_SAVE"},
    )


class NIM_PG_rays(Settings, bpy.types.PropertyGroup):
    """How the rays of a scene are drawn: Scene.nim_rays."""


def _draw_settings(layout, settings):
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    column.prop(settings, "source")
    column.prop(settings, "aim")
    if settings.aim == "DIRECTION":
        column.prop(settings, "direction")
    column = layout.column(align=True)
    column.prop(settings, "arrangement")
    column.prop(settings, "rays")
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


class NIM_OT_light_paths(Settings, bpy.types.Operator):
    """Shoot rays through the interfaces of this scene and draw where they go, by energy, in place of the last ones"""

    bl_idname = "nim.light_paths"
    bl_label = "Draw Light Paths"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Light paths are drawn in Object Mode only")
            return False
        return True

    def draw(self, context):
        _draw_settings(self.layout, self)

    def execute(self, context):
        # what the caller leaves open is as the scene has it; what was drawn last is what the scene remembers
        settings = context.scene.nim_rays
        for name in Settings.__annotations__:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
        try:
            with as_rendered(context.scene) as depsgraph:
                surfaces, drawn = _traced(context, self, depsgraph)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for source, paths in drawn.items():
            _draw_paths(context.scene, source, paths, self.thickness, self.through)
        for name in Settings.__annotations__:
            setattr(settings, name, getattr(self, name))
        rays = sum(len(paths.lost) for paths in drawn.values())
        pieces = sum(len(paths.ray) for paths in drawn.values())
        self.report(
            {"INFO"}, pgettext_rpt("Light paths drawn; rays: {rays}, pieces: {pieces}").format(rays=rays, pieces=pieces)
        )
        warning = _warning(surfaces, drawn, self.bounces)
        if warning:
            self.report({"WARNING"}, warning)
        return {"FINISHED"}


class NIM_OT_light_paths_clear(bpy.types.Operator):
    """Remove all light paths of this scene, and what was made for them"""

    bl_idname = "nim.light_paths_clear"
    bl_label = "Clear Light Paths"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if _collection_of(context.scene) is None:
            cls.poll_message_set("This scene has no light paths")
            return False
        return True

    def execute(self, context):
        scene = context.scene
        _remove([thing for thing in scene.objects if thing.get(MARK)])
        collection = _collection_of(scene)
        # what a person has put there stays in the scene; what is in it already cannot be linked again, and two things
        # of one name, one of them from a library, are not the same
        for theirs, ours in (
            (scene.collection.objects, collection.objects),
            (scene.collection.children, collection.children),
        ):
            known = set(theirs)
            for thing in [one for one in ours if one not in known]:
                theirs.link(thing)
        bpy.data.collections.remove(collection)
        bpy.data.batch_remove([m for m in bpy.data.materials if m.get(MARK) and m.users == 0])
        self.report({"INFO"}, pgettext_rpt("Light paths cleared"))
        return {"FINISHED"}


class NIM_PT_light_paths(Sidebar, bpy.types.Panel):
    """Rays through the interfaces of the scene, drawn as curves"""

    bl_idname = "NIM_PT_light_paths"
    bl_label = "Light Paths"
    bl_order = 20

    def draw(self, context):
        settings = context.scene.nim_rays
        column = self.layout.column(align=True)
        column.operator(NIM_OT_light_paths.bl_idname, icon="LIGHT_SUN")
        column.operator(NIM_OT_light_paths_clear.bl_idname, icon="TRASH")
        if settings.source == "CAMERA" and context.scene.camera is None:
            self.layout.label(text="The scene has no camera", icon="ERROR")
        elif settings.source == "LAMP" and not light_sources.lamps(context):
            self.layout.label(text="Select a lamp", icon="ERROR")
        _draw_settings(self.layout, settings)


# ---------------------------------------------------------------- where they go


def _traced(context, settings, depsgraph):
    """The Meshes, and {source: Paths}; ValueError with a sentence where the settings lead nowhere."""
    # ours stop no rays
    surfaces = Meshes((one for one in shown(context.scene, depsgraph) if not one.original.get(MARK)), depsgraph)
    if not surfaces.bounds:
        raise ValueError(
            pgettext_rpt(
                "Light paths: no visible mesh of this scene has a NIM Interface material with media of its own; "
                "give one to an object first"
            )
        )
    drawn = {}
    for name, (origins, directions) in light_sources.starts(context, settings, surfaces, depsgraph).items():
        try:
            drawn[name] = trace(
                surfaces,
                origins,
                directions,
                bounces=settings.bounces,
                least=settings.least,
                reach=settings.reach,
                gap=surfaces.gap,
            )
        except ValueError:
            raise ValueError(
                pgettext_rpt(
                    "Light paths: the rays split into more than {most} pieces; "
                    "take fewer rays or bounces, or a higher least energy"
                ).format(most=MOST_SEGMENTS)
            ) from None
    return surfaces, drawn


def _warning(surfaces, drawn, bounces):
    """What there is to be said of these {source: Paths}, a sentence or None."""
    if surfaces.unknown:
        return pgettext_rpt(
            "Rays end at {materials}: a link decides its media, so that they are not known here"
        ).format(materials=", ".join(sorted(surfaces.unknown)))
    # of the rays that met an interface
    total = stopped = lost = 0.0
    for paths in drawn.values():
        met = np.isin(paths.fate, (Fate.SPLIT, Fate.STOPPED)) & (paths.depth == 0)
        total += met.sum()
        stopped += paths.energy[paths.fate == Fate.STOPPED].sum()
        lost += paths.lost.sum()
    if not total and all((paths.fate == Fate.LANDED).all() for paths in drawn.values()):
        return pgettext_rpt("All rays end at an opaque object before they meet an interface; move it, or the source")
    if not total:
        return pgettext_rpt("No ray met an interface; move the source, or aim it at one")
    if stopped >= CUT * total:
        return pgettext_rpt(
            "After {bounces} bounces {share:.0f} % of the light ends at an interface; raise Bounces to follow it on"
        ).format(bounces=bounces, share=100 * stopped / total)
    if lost >= CUT * total:
        return pgettext_rpt(
            "Branches with {share:.0f} % of the light have less than the Least Energy; lower it to follow them on"
        ).format(share=100 * lost / total)
    return None


# ---------------------------------------------------------------- how they are drawn


def _draw_paths(scene, source, paths, thickness, through):
    """Replace the curves of `source` in a bpy.types.Scene by those of physics.rays.Paths."""
    _remove([thing for thing in scene.objects if thing.get(MARK) == source])
    collection = _collection_of(scene)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[MARK] = True
        scene.collection.children.link(collection)
    radius = np.repeat((paths.energy**THINNING).astype(np.float32)[:, None], 2, axis=1)
    if source == "camera":
        # pointed at the lens: who looks through the camera would look into tubes, and see nothing else
        radius[paths.depth == 0, 0] = 0
    ends = np.stack([np.insert(paths.start, 3, 1, axis=1), np.insert(paths.end, 3, 1, axis=1)], axis=1)
    ends = ends.reshape(-1, 8).astype(np.float32)
    for kind in Kind:
        chosen = np.flatnonzero(paths.kind == kind)
        if not len(chosen):
            continue
        curve = bpy.data.curves.new(f"{kind.name.capitalize()} {source}", "CURVE")
        curve.dimensions = "3D"
        curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = thickness / 2, 1, True
        curve.materials.append(_material(kind, through))
        for segment in chosen:
            points = curve.splines.new("POLY").points
            points.add(1)
            points.foreach_set("co", ends[segment])
            points.foreach_set("radius", radius[segment])
        thing = bpy.data.objects.new(curve.name, curve)
        thing[MARK] = source
        # a camera sees them, and through interfaces if wished; nothing is lit or shaded by them
        thing.visible_diffuse = thing.visible_glossy = thing.visible_volume_scatter = thing.visible_shadow = False
        thing.visible_transmission = through
        collection.objects.link(thing)


def _material(kind, through):
    """The file's material for that kind of path, made on first use: it glows, and is not looked for as a lamp."""
    mark = kind.name if through else f"{kind.name}, not inside"
    material = next((m for m in bpy.data.materials if m.get(MARK) == mark and not m.library), None)
    if material is not None:
        return material
    material = bpy.data.materials.new(f"Light Path {kind.name.lower()}")
    material[MARK] = mark
    material.diffuse_color = (*COLORS[kind], 1.0)
    material.cycles.emission_sampling = "NONE"
    nodes = Nodes(empty_tree(material))
    shader = nodes.add("ShaderNodeEmission", inputs={"Color": COLORS[kind]})
    if not through:
        # a ray bent backwards still counts as the camera's; the bend counts as a transparent surface before this one
        before = nodes.add("ShaderNodeLightPath").outputs["Transparent Depth"]
        clear = nodes.add("ShaderNodeBsdfTransparent")
        behind = nodes.math("GREATER_THAN", before, 0.5)
        shader = nodes.add("ShaderNodeMixShader", inputs={0: behind, 1: shader.outputs[0], 2: clear.outputs[0]})
    nodes.end(shader)
    return material


def _collection_of(scene):
    """The collection of light paths in that scene, None where it has none."""
    return next((collection for collection in scene.collection.children_recursive if collection.get(MARK)), None)


def _remove(things):
    curves = {thing.data for thing in things}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove([curve for curve in curves if curve.users == 0])


CLASSES = (NIM_PG_rays, NIM_OT_light_paths, NIM_OT_light_paths_clear, NIM_PT_light_paths)


def register():
    """Add the settings that each scene keeps."""
    bpy.types.Scene.nim_rays = PointerProperty(
        type=NIM_PG_rays, name="Light Paths", description="How the light paths of this scene are drawn"
    )


def unregister():
    """Take them back."""
    del bpy.types.Scene.nim_rays

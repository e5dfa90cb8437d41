# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths: rays through the interfaces of a scene, drawn as curves."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt

from ..cycles.casting import Meshes
from ..cycles.visibility import PATHS_MARK, as_rendered, shown
from ..physics.rays import MOST_SEGMENTS, Fate, trace
from . import light_curves, light_sources
from .light_settings import Settings, draw_settings
from .panels import Sidebar

# Where this share of the light is cut off by the settings, that is said.
CUT = 0.5


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
        draw_settings(self.layout, self)

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
            light_curves.draw(context.scene, source, paths, self.thickness, self.through)
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
        if light_curves.collection_of(context.scene) is None:
            cls.poll_message_set("This scene has no light paths")
            return False
        return True

    def execute(self, context):
        light_curves.clear(context.scene)
        self.report({"INFO"}, pgettext_rpt("Light paths cleared"))
        return {"FINISHED"}


class NIM_PT_light_paths(Sidebar, bpy.types.Panel):
    """Rays through the interfaces of the scene, drawn as curves"""

    bl_idname = "NIM_PT_light_paths"
    bl_label = "Light Paths"
    bl_order = 30

    def draw(self, context):
        settings = context.scene.nim_rays
        column = self.layout.column(align=True)
        column.operator(NIM_OT_light_paths.bl_idname, icon="LIGHT_SUN")
        column.operator(NIM_OT_light_paths_clear.bl_idname, icon="TRASH")
        if settings.source == "CAMERA" and context.scene.camera is None:
            self.layout.label(text="The scene has no camera", icon="ERROR")
        elif settings.source == "LAMP" and not light_sources.lamps(context):
            self.layout.label(text="Select a lamp", icon="ERROR")
        draw_settings(self.layout, settings)


# ---------------------------------------------------------------- where they go


def _traced(context, settings, depsgraph):
    """The Meshes, and {source: Paths}; ValueError with a sentence where the settings lead nowhere."""
    # ours stop no rays
    surfaces = Meshes(
        (seen for seen in shown(context.scene, depsgraph) if not seen.original.get(PATHS_MARK)), depsgraph
    )
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
        stopped += paths.arriving[paths.fate == Fate.STOPPED].sum()
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
    if surfaces.rough:
        return pgettext_rpt(
            "{materials} is rough: rays are drawn as if it were smooth, where most of the light goes"
        ).format(materials=", ".join(sorted(surfaces.rough)))
    return None


CLASSES = (NIM_OT_light_paths, NIM_OT_light_paths_clear, NIM_PT_light_paths)

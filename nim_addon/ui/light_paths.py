# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths: rays through the interfaces of a scene, drawn live over the view or made curves that renders show."""

import bpy
from bpy.app.translations import pgettext_rpt

from ..cycles.visibility import as_rendered
from . import light_curves, light_handle, light_live, light_sources, light_view, live_look
from .help import fail
from .light_settings import Settings, draw_first, draw_others, draw_settings
from .light_tracing import follow, surfaces_of, warning
from .panels import Sidebar, draw_sentence


class NIM_OT_light_paths(Settings, bpy.types.Operator):
    """Shoot rays through what bends light in this scene and draw where they go, by energy, in place of the last ones"""

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
                surfaces = surfaces_of(context.scene, depsgraph)
                starts = light_sources.starts(context, self, surfaces, depsgraph)
                drawn = {source: follow(surfaces, start, self) for source, start in starts.items()}
        except ValueError as error:
            return fail(self, str(error))
        for source, paths in drawn.items():
            light_curves.draw(context.scene, source, paths, self.thickness, self.through)
        for name in Settings.__annotations__:
            setattr(settings, name, getattr(self, name))
        rays = sum(len(paths.lost) for paths in drawn.values())
        pieces = sum(len(paths.ray) for paths in drawn.values())
        self.report(
            {"INFO"}, pgettext_rpt("Light paths drawn; rays: {rays}, pieces: {pieces}").format(rays=rays, pieces=pieces)
        )
        said = warning(surfaces, list(drawn.values()), self.bounces)
        if said:
            self.report({"WARNING"}, said)
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
    """Rays through what bends light in the scene, live or as curves"""

    bl_idname = "NIM_PT_light_paths"
    bl_label = "Light Paths"
    page = "scenes#light-paths"
    bl_order = 30

    def draw(self, context):
        settings = context.scene.nim_rays
        live = light_live.is_on()
        column = self.layout.column(align=True)
        column.operator(light_live.NIM_OT_light_paths_live.bl_idname, icon="HIDE_OFF", depress=live)
        text = "Add Handle" if light_sources.handle_of(context.scene) is None else "Select Handle"
        column.operator(light_handle.NIM_OT_light_handle.bl_idname, text=text, icon="EMPTY_SINGLE_ARROW")
        if live or light_curves.collection_of(context.scene):
            view = light_view.NIM_OT_light_paths_view.bl_idname
            column.operator(view, text="View Rays from the Side", icon="VIEW_ORTHO")
        said = live and live_look.sentence(context.scene)
        if said:
            draw_sentence(self.layout, context, said, icon="INFO")
        if settings.source == "CAMERA" and context.scene.camera is None:
            self.layout.label(text="The scene has no camera", icon="ERROR")
        elif settings.source == "LAMP" and not light_sources.lamps(context):
            self.layout.label(text="Select a lamp", icon="ERROR")
        draw_first(self.layout.column(), settings)
        if live or light_curves.collection_of(context.scene):
            self.layout.label(text=live_look.legend(context.scene))
        row = self.layout.row(align=True)
        row.operator(NIM_OT_light_paths.bl_idname, text="Make Curves", icon="CURVE_DATA")
        row.operator(NIM_OT_light_paths_clear.bl_idname, text="", icon="TRASH")
        header, body = self.layout.panel("NIM_rays", default_closed=True)
        header.label(text="Options")
        if body:
            _draw_color(body, context.scene, live)
            draw_others(body, settings)


def _draw_color(layout, scene, live):
    """What the colours of live rays say, and what keeps them from saying it."""
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    row = column.row()
    row.active = live  # curves are coloured by part
    row.prop(scene.nim_rays, "color")
    if live and live_look.nothing_disperses(scene):
        column.label(text="Nothing disperses, so by part")


CLASSES = (NIM_OT_light_paths, NIM_OT_light_paths_clear, NIM_PT_light_paths)

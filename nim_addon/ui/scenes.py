# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes panel: choose, set, build, and the line that renders the same without a window."""

import dataclasses
import os
import shlex
import subprocess

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..scenes import SCENES
from ..scenes import stage as stages
from . import backends, built, standing, warnings
from .help import fail
from .panels import Sidebar, draw_sentence
from .presets import MENUS
from .scene_settings import (
    apply_quality,
    apply_spectral,
    backend_of,
    copy_settings,
    label_of,
    parameters_of,
    samples_of,
)
from .translations import OWN


def title_of(name: str) -> str:
    """What the menu calls the scene of that name, in English."""
    return name.title()


def ready(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """For a poll: whether the settings can be built; if not, the operator's class is told why."""
    if context.scene is None:
        operator.poll_message_set("There is no scene")
        return False
    problem = context.scene.nim_scenes.problem
    if problem:
        operator.poll_message_set(problem.rstrip("."))
    return not problem


class NIM_OT_build_scene(bpy.types.Operator):
    """Build the chosen scene in a Blender scene of its own, and show it through its camera"""

    bl_idname = "nim.build_scene"
    bl_label = "Build"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return ready(cls, context)

    def invoke(self, context, event):
        name = context.scene.nim_scenes.scene
        scene = stages.built(name)
        if scene is None or not built.holds(scene):
            if not _previews_render():
                return self.execute(context)
            self.timer = context.window_manager.event_timer_add(0.05, window=context.window)
            context.window_manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=pgettext_iface("Replace the scene?"),
            message=pgettext_iface(
                "{} was changed by hand. What you added stays, changes to its own objects and baked caustics go."
            ).format(scene.name),
            confirm_text=pgettext_iface("Replace"),
            icon="QUESTION",
        )

    def modal(self, context, event):
        if event.type != "TIMER" or _previews_render():
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        return self.execute(context)

    def execute(self, context):
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        try:
            scene = build(context.scene.nim_scenes)
        except (ValueError, RuntimeError) as error:
            return fail(self, str(error))
        if context.window:
            context.window.scene = scene
            _look_through_camera(context.window)
        self.report({"INFO"}, pgettext_rpt("Built {}").format(scene.name))
        return {"FINISHED"}


def build(settings: bpy.types.PropertyGroup) -> bpy.types.Scene:
    """Build what the settings, a Scene.nim_scenes, say; returns the bpy.types.Scene, which has them too.

    Raises ValueError or RuntimeError, one sentence, where they clash, or the scene cannot be built.
    """
    scene = SCENES[settings.scene].build(parameters_of(settings), backend_of(settings))
    if scene != settings.id_data:
        copy_settings(settings, scene.nim_scenes)
        copy_settings(settings.id_data.nim_variants, scene.nim_variants)
    apply_quality(scene)
    apply_spectral(scene)
    built.remember(scene, standing.built_of(scene.nim_scenes))
    standing.note_setting(scene)
    return scene


def _previews_render():
    """Whether a material's icon is being rendered: Blender hangs where a script sets a scene's engine meanwhile."""
    return bpy.app.is_job_running("RENDER_PREVIEW")


def _look_through_camera(window):
    for area in window.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"


class NIM_OT_copy_command(bpy.types.Operator):
    """Put the nimray command that renders this scene with these settings on the clipboard"""

    bl_idname = "nim.copy_command"
    bl_label = "Copy as Command"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return ready(cls, context)

    def execute(self, context):
        try:
            line = quoted(["nimray", *render_words(context.scene.nim_scenes)])
        except ValueError as error:
            return fail(self, str(error))
        context.window_manager.clipboard = line
        self.report({"INFO"}, pgettext_rpt("Copied: {}").format(line))
        return {"FINISHED"}


def render_words(settings: bpy.types.PropertyGroup) -> list[str]:
    """The words after `nimray` that render what the settings say."""
    assignments = parameters_of(settings).assignments()
    assignments += ["spectral=yes"] * settings.spectral
    parameters = ["--set", *assignments] if assignments else []
    samples, percent = samples_of(settings)
    size = [] if percent == 100 else ["--size", f"{percent}%"]
    quality = ["--samples", str(samples), *size, "--backend", backend_of(settings)]
    return ["render", settings.scene, *parameters, *quality]


def quoted(words: list[str]) -> str:
    """The words as one line for this system's shell."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


# ------------------------------------------------------------------------------------------------ the panel


def _draw_automatic(layout, group, name, label):
    """A number that a person may set, or leave to the rest."""
    row = layout.row(heading=label)
    row.prop(group, f"use_{name}", text="")
    value = row.row()
    value.active = getattr(group, f"use_{name}")
    value.prop(group, name, text="")


def _draw_words(layout, group, name):
    """A medium as a person writes it, below the menu that says so."""
    layout.prop(group, f"{name}_words", text=" ")  # beside which the menu's label stands already


def _draw_field(layout, group, field):
    kind, name = field.metadata["kind"], field.name
    if kind == "index":
        layout.prop(group, f"{name}_medium")
        if getattr(group, f"{name}_medium") == "words":
            _draw_words(layout, group, name)
        else:
            layout.prop(group, name)
    elif kind == "number" and field.default is None:
        _draw_automatic(layout, group, name, label_of(field))
    elif name == "view":
        row = layout.row()
        row.use_property_split = False  # three words need the whole width
        row.prop(group, name, expand=True)
    else:
        layout.prop(group, name)
    if kind == "liquid" and getattr(group, name) == "custom":
        layout.prop(group, f"{name}_n")
        if hasattr(group, f"use_{name}_mu"):
            _draw_automatic(layout, group, f"{name}_mu", "Permeability")
    elif kind == "liquid" and getattr(group, name) == "words":
        _draw_words(layout, group, name)
    elif kind == "mesh" and getattr(group, name) == "file":
        layout.prop(group, f"{name}_file")


def _draw_standing(layout, context):
    """Say where what stands in the view is not what the settings say, and why Live waits."""
    scene, live = context.scene, context.window_manager.nim_live
    name = scene.get(stages.STAGE_MARK)
    say = pgettext_iface
    if not standing.is_standing(scene):
        if name in SCENES and name != scene.nim_scenes.scene:
            text = say("The view shows {}: Build makes {}").format(say(title_of(name)), say(_chosen_title(scene)))
            draw_sentence(layout, context, text, "INFO")
        elif live:
            draw_sentence(layout, context, say("Live follows what is built: press Build once"), "INFO")
        return
    known = standing.LOOKS.known(scene)
    if known is None:
        return
    if known.changed:
        labels = ", ".join(say(label, OWN) for label in known.changed)
        draw_sentence(layout, context, say("Not in the view yet: {}").format(labels), "FILE_REFRESH")
    if known.holds and (live or known.changed):
        text = "Live waits" if live else "Build asks first"
        reason = say("it was changed by hand, or holds baked caustics")
        draw_sentence(layout, context, f"{say(text)}: {reason}", "INFO")


def _chosen_title(scene):
    return title_of(scene.nim_scenes.scene)


def begins_here(context: bpy.types.Context) -> bool:
    """Whether the example scenes are what a person works with: no interface is in the scene yet, or it is one of them."""
    if context.scene.get(stages.STAGE_MARK):
        return True
    known = warnings.known(context.scene)
    return known is not None and not known.backends


def open_and_folded(panel: type[bpy.types.Panel]) -> tuple[type[bpy.types.Panel], type[bpy.types.Panel]]:
    """A panel of the example scenes twice, not registered yet: as it is where begins_here(), else with its parts folded.

    Blender has no way to fold or open a panel that has been drawn once, and keeps for each of the two what a person did.
    """
    content = {name: value for name, value in vars(panel).items() if name not in ("__dict__", "__weakref__")}
    content["bl_idname"] = f"{panel.bl_idname}_folded"
    content["bl_options"] = {"DEFAULT_CLOSED"}
    if hasattr(panel, "bl_parent_id"):
        content["bl_parent_id"] = f"{panel.bl_parent_id}_folded"
    content["poll"] = classmethod(lambda cls, context: not begins_here(context))
    panel.poll = classmethod(lambda cls, context: begins_here(context))
    return panel, type(content["bl_idname"], panel.__bases__, content)


class NIM_MT_scene_backend(bpy.types.Menu):
    """What the optics of the materials are made of"""

    bl_idname = "NIM_MT_scene_backend"
    bl_label = "Backend"

    def draw(self, context):
        backends.draw_items(self.layout, context.scene.nim_scenes)


class NIM_PT_scenes(Sidebar, bpy.types.Panel):
    """Choose a scene, set it, build it."""

    bl_idname = "NIM_PT_scenes"
    bl_label = "Example Scenes"
    page = "scenes#build"
    bl_order = 90

    def draw(self, context):
        layout = self.layout
        settings = context.scene.nim_scenes
        scene_type = SCENES[settings.scene]
        # not all in one row, in which their names would be cut
        layout.grid_flow(columns=3, row_major=True, even_columns=True, align=True).prop(settings, "scene", expand=True)

        row = layout.row(align=True)
        menu = MENUS[scene_type.name]
        row.menu(menu.bl_idname, text=menu.bl_label)
        row.operator("nim.preset", text="", icon="ADD")
        row.operator("nim.preset", text="", icon="REMOVE").remove_active = True

        layout.use_property_split = True
        layout.use_property_decorate = False
        group = getattr(settings, scene_type.name)
        column = layout.column()
        for field in dataclasses.fields(scene_type.parameters):
            _draw_field(column, group, field)

        column = layout.column()
        column.prop(settings, "quality")
        backends.draw_choice(column, settings, NIM_MT_scene_backend.bl_idname)
        column.prop(settings, "spectral")
        column.prop(context.window_manager, "nim_live")
        if settings.problem:
            draw_sentence(layout, context, settings.problem, "ERROR")
        else:
            _draw_standing(layout, context)
        row = layout.row(align=True)
        row.scale_y = 1.4
        again = standing.is_standing(context.scene)
        row.operator("nim.build_scene", text="Build Again" if again else "Build", icon="SCENE_DATA")
        layout.operator("nim.copy_command", icon="COPYDOWN")


CLASSES = (NIM_OT_build_scene, NIM_OT_copy_command, NIM_MT_scene_backend, *open_and_folded(NIM_PT_scenes))

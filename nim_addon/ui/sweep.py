# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep of the chosen scene over one or two of its parameters, as `nimray sweep` carries it out in a second Blender."""

import dataclasses
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..renders.request import Request
from ..scenes import SCENES
from ..sweeps import axes, plan
from ..sweeps.plan import Task
from . import escape, jobs, scenes
from .help import fail
from .panels import Sidebar, draw_sentence
from .scene_settings import backend_of, label_of, parameters_of
from .translations import OWN

NONE = "NONE"
MOST = 10_000  # pictures that a button makes
NUMBERS = ("number", "integer", "index")

_items: dict[str, list] = {}  # Blender keeps no texts of items that a function gives


def parameters(scene: str) -> list[tuple[str, str, str]]:
    """(name, label, description) of what may be varied in a scene: its numbers, and n of its liquid."""
    fields = dataclasses.fields(SCENES[scene].parameters)
    found = [
        (field.name, label_of(field), field.metadata["description"].capitalize())
        for field in fields
        if field.metadata["kind"] in NUMBERS
    ]
    names = [name for name, *_ in found]
    if "n" not in names and sum(field.metadata["kind"] == "liquid" for field in fields) == 1:
        found.insert(0, ("n", "Index", "Refractive index of the liquid"))
    return found


def _first_items(self, _context):
    scene = self.id_data.nim_scenes.scene
    if scene not in _items:
        _items[scene] = [(*item, number) for number, item in enumerate(parameters(scene))]
    return _items[scene]


def _second_items(self, context):
    first = _first_items(self, context)
    key = self.id_data.nim_scenes.scene + "+"
    if key not in _items:
        others = [(*item[:3], number + 1) for *item, number in first]
        _items[key] = [(NONE, "None", "Vary one parameter only", 0), *others]
    return _items[key]


class NIM_PG_sweep(bpy.types.PropertyGroup):
    """What a sweep varies."""

    first: bpy.props.EnumProperty(
        name="Vary", description="The parameter that is varied", items=_first_items, translation_context=OWN
    )
    first_from: bpy.props.FloatProperty(name="From", description="Its first value", default=-1.5, precision=3)
    first_to: bpy.props.FloatProperty(name="To", description="Its last value", default=1.5, precision=3)
    first_count: bpy.props.IntProperty(name="Values", description="How many values", default=7, min=1, max=1000)
    second: bpy.props.EnumProperty(
        name="And",
        description="Another parameter, each value of which goes with each of the first",
        items=_second_items,
    )
    second_from: bpy.props.FloatProperty(name="From", description="Its first value", default=-1.0, precision=3)
    second_to: bpy.props.FloatProperty(name="To", description="Its last value", default=-10.0, precision=3)
    second_count: bpy.props.IntProperty(name="Values", description="How many values", default=2, min=1, max=1000)


def axes_of(sweep: NIM_PG_sweep) -> list[axes.Axis]:
    """The axes that the settings span."""
    found = []
    for which in ("first", "second"):
        name = getattr(sweep, which)
        if name and name != NONE:
            start, end, count = (getattr(sweep, f"{which}_{part}") for part in ("from", "to", "count"))
            step = (end - start) / max(count - 1, 1)
            # single precision has seven digits
            values = [f"{round(start + step * place, 6):g}" for place in range(count)]
            found.append(axes.Axis(name, tuple(dict.fromkeys(values))))
    return found


def tasks_of(scene: bpy.types.Scene) -> tuple[list[Task], list[str]]:
    """The tasks of a scene's settings, and a sentence for each point that is no render; ValueError where none is."""
    settings = scene.nim_scenes
    varied = axes_of(scene.nim_sweep)
    if axes.count(varied) > MOST:
        raise ValueError(
            pgettext_rpt("{} pictures are too many for a button; take fewer values").format(axes.count(varied))
        )
    request = jobs.request_of(settings)
    request = dataclasses.replace(request, backend=backend_of(settings))
    usual = parameters_of(settings)
    tasks, left_out = [], []
    for point in axes.points(varied):
        values = plan.settings_of(settings.scene, point)
        kept = [text for text in usual.assignments() if text.partition("=")[0] not in values]

        def at(_, values=values, kept=kept) -> Request:
            made = type(usual).read([*kept, *(f"{key}={value}" for key, value in values.items())])
            return dataclasses.replace(request, parameters=made)

        try:
            tasks.append(plan.task_at(point, at))
        except ValueError as error:
            left_out.append(str(error))
    if not tasks:
        raise ValueError(left_out[0])
    return list({task.key: task for task in tasks}.values()), left_out


class NIM_OT_sweep(bpy.types.Operator):
    """Render a picture for each value in a second Blender: a table, a contact sheet and a page with sliders. Esc ends it"""

    bl_idname = "nim.sweep"
    bl_label = "Sweep"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return scenes.ready(cls, context) and jobs.free(cls)

    def invoke(self, context, event):
        result = self.execute(context)
        if "FINISHED" not in result:
            return result
        self.job = jobs.job()
        context.window_manager.modal_handler_add(self)
        job = self.job
        escape.listen(escape.Listening(lambda: jobs.job() is job and job.running, jobs.end), beside=context.window)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if jobs.job() is not self.job or not self.job.running:
            return {"FINISHED"}
        if event.type == "ESC" and event.value == "PRESS":
            jobs.end()
            self.report({"INFO"}, pgettext_rpt("Stopped; the same sweep goes on from there"))
            return {"CANCELLED"}
        return {"PASS_THROUGH"}

    def execute(self, context):
        scene = context.scene
        folder = jobs.output_folder() / f"sweep_{scene.nim_scenes.scene}"
        try:
            tasks, left_out = tasks_of(scene)
            file = plan.write(folder, tasks)
            title = f"{folder.name} ({len(tasks)})"
            jobs.start(jobs.Work(title, words=("sweep", str(file), "--progress")), folder)
        except ValueError as error:
            return fail(self, str(error))
        except OSError as error:
            return fail(self, pgettext_rpt("The sweep could not be started: {}").format(error))
        said = pgettext_rpt("Rendering in the background (pictures: {})").format(len(tasks))
        if left_out:
            said += " " + pgettext_rpt("({} left out: {})").format(len(left_out), left_out[0].rstrip("."))
        self.report({"INFO"}, said)
        return {"FINISHED"}


def page_of(scene: bpy.types.Scene) -> Path:
    """The page of the last sweep of the chosen scene, whether it is there or not."""
    return jobs.output_folder() / f"sweep_{scene.nim_scenes.scene}" / "index.html"


class NIM_OT_open_sweep(bpy.types.Operator):
    """Show the pictures of the last sweep of this scene in the browser, with a slider for each parameter"""

    bl_idname = "nim.open_sweep"
    bl_label = "Open Page"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if context.scene is None or not page_of(context.scene).is_file():
            cls.poll_message_set("No sweep of this scene has been finished yet")
            return False
        return True

    def execute(self, context):
        page = page_of(context.scene)
        bpy.ops.wm.url_open(url=page.as_uri())
        self.report({"INFO"}, pgettext_rpt("Opened {}").format(page))
        return {"FINISHED"}


def _draw_axis(column, sweep, which):
    column.prop(sweep, which)
    if getattr(sweep, which) == NONE:
        return
    column.prop(sweep, f"{which}_from")
    column.prop(sweep, f"{which}_to")
    column.prop(sweep, f"{which}_count")


class NIM_PT_sweep(Sidebar, bpy.types.Panel):
    """Vary one or two parameters of the scene."""

    bl_idname = "NIM_PT_sweep"
    bl_label = "Sweep"
    page = "many-machines"
    bl_parent_id = "NIM_PT_scenes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        sweep = context.scene.nim_sweep
        _draw_axis(layout.column(align=True), sweep, "first")
        _draw_axis(layout.column(align=True), sweep, "second")
        count = axes.count(axes_of(sweep))
        if count > MOST:
            draw_sentence(layout, context, pgettext_iface("Too many pictures; take fewer values"), "ERROR")
        row = layout.row(align=True)
        text = pgettext_iface("Sweep (pictures: {})").format(count)
        row.operator("nim.sweep", text=text, icon="RENDER_ANIMATION", translate=False)
        row.operator("nim.open_sweep", text="", icon="URL")


CLASSES = (NIM_PG_sweep, NIM_OT_sweep, NIM_OT_open_sweep, *scenes.open_and_folded(NIM_PT_sweep))


def register():
    """Let scenes hold what a sweep varies."""
    bpy.types.Scene.nim_sweep = bpy.props.PointerProperty(
        name="Sweep", description="What a sweep varies", type=NIM_PG_sweep
    )


def unregister():
    """Take that away."""
    del bpy.types.Scene.nim_sweep
    _items.clear()

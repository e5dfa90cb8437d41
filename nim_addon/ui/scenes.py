# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes panel: choose, set, build, and the line that renders the same headlessly."""

import dataclasses
import os
import shlex
import subprocess
from pathlib import Path

import bpy
import numpy as np
from bl_operators.presets import AddPresetBase
from bpy.app.translations import pgettext_iface, pgettext_rpt
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..physics import MEDIA, Medium
from ..scenes import SCENES, scene_type
from ..scenes import stage as stages
from . import preferences
from .panels import Sidebar, draw_sentence
from .translations import OWN

PACKAGE = Path(__file__).parents[1]

# Blender files hold these numbers: they stay, and new names get new ones.
SCENE_NUMBERS = {"glass": 0, "pool": 1, "sphere": 2, "sea": 3}
LIQUID_NUMBERS = {"none": 0, "custom": 1, "water": 2, "nim": 3, "glass": 4, "diamond": 5}
LIQUID_NUMBERS |= {"nim-1.025": 6, "nim-1.5": 7, "nim-2.418": 8, "nim-4.1": 9, "nim-mu10": 10, "nim-mu25": 11}
FILE_NUMBER = 100  # a mesh file of one's own, after all the words there may ever be

# Samples a pixel (None: those of the preferences) and the part of the scene's own size in percent.
QUALITIES = {"DEFAULT": (None, 100), "DRAFT": (32, 50), "GOOD": (256, 100), "FINAL": (2048, 100)}

LABELS = {"n": "Index", "mu": "Permeability"}
# Where a number that is chosen from the others starts as a person takes it over: at a NIM's permeability.
FIRST = -1.0


# ------------------------------------------------------------------------------- the dataclasses as Blender's properties


def _label(field):
    degrees = " (°)" if field.metadata.get("unit") == "degrees" else ""
    return LABELS.get(field.name, field.name.replace("_", " ").title()) + degrees


def _description(field):
    data = field.metadata
    unit = f", in {data['unit']}" if data.get("unit") else ""
    return data["description"][0].upper() + data["description"][1:] + unit


def _float(name, description, low, high, default, unit=""):
    return FloatProperty(
        name=name,
        description=description,
        default=default,
        min=low,
        max=high,
        precision=3,
        step=1,
        unit={"m": "LENGTH", "s": "TIME_ABSOLUTE"}.get(unit, "NONE"),
        translation_context=OWN,
        update=_changed,
    )


def _properties(kind):
    """The annotations of a property group that holds what the dataclass of a SceneType does."""
    properties = {}
    names = [field.name for field in dataclasses.fields(kind.parameters)]
    for field in dataclasses.fields(kind.parameters):
        data, name = field.metadata, field.name
        label, description = _label(field), _description(field)
        texts = {"name": label, "description": description, "update": _changed}
        if data["kind"] == "number":
            start = FIRST if field.default is None else field.default
            properties[name] = _float(label, description, data["low"], data["high"], start, data["unit"])
            if field.default is None:
                properties[f"use_{name}"] = BoolProperty(
                    name=f"Own {label}",
                    description="Set it here, rather than leave it to the rest",
                    default=False,
                    update=_changed,
                )
        elif data["kind"] == "integer":
            properties[name] = IntProperty(default=field.default, min=data["low"], max=data["high"], **texts)
        elif data["kind"] == "switch":
            properties[name] = BoolProperty(default=field.default, **texts)
        elif data["kind"] == "liquid":
            items = [(word, _liquid_label(word), "", "NONE", number) for word, number in LIQUID_NUMBERS.items()]
            properties[name] = EnumProperty(items=items, default=_liquid_word(field.default), **texts)
            properties[f"{name}_n"] = _float(
                "Index", "Refractive index of the liquid; negative for a NIM", -10.0, 10.0, field.default.n
            )
            if "mu" not in names:
                properties[f"{name}_mu"] = _float(
                    "Permeability",
                    "Relative permeability of the liquid; it has the sign of the index",
                    -100,
                    100,
                    FIRST,
                )
                properties[f"use_{name}_mu"] = BoolProperty(
                    name="Own Permeability",
                    description="Set it here; else it is 1 with the sign of the index",
                    default=False,
                    update=_changed,
                )
        else:
            items = [(word, word.title(), "", "NONE", number) for number, word in enumerate(data["choices"])]
            if data["kind"] == "mesh":
                items.append(("file", "File", "", "NONE", FILE_NUMBER))
            texts["update"] = _view_changed if name == "view" else _changed
            properties[name] = EnumProperty(items=items, default=field.default, **texts)
            if data["kind"] == "mesh":
                properties[f"{name}_file"] = StringProperty(
                    name="File", description="A PLY, OBJ or STL file", subtype="FILE_PATH", update=_changed
                )
    return properties


def _liquid_word(medium):
    """The item for a Medium, or None, as a dataclass has it by default."""
    return next((word for word in LIQUID_NUMBERS if word in MEDIA and MEDIA[word] == medium), "none")


def _liquid_label(word):
    if word not in MEDIA:
        return {"none": "None (Empty)", "custom": "Own Index"}[word]
    kind = word.partition("-")[0]
    return f"{'NIM' if kind == 'nim' else kind.title()} ({str(MEDIA[word]).replace('=', ' = ').replace(',', ', ')})"


def _number(value):
    """The shortest decimal that Blender's single precision keeps: -1.33, not -1.3300000429."""
    return float(str(np.float32(value)))


def _value(group, field):
    kind, name = field.metadata["kind"], field.name
    value = getattr(group, name)
    if kind == "number":
        return None if field.default is None and not getattr(group, f"use_{name}") else _number(value)
    if kind == "liquid":
        if value != "custom":
            return None if value == "none" else MEDIA[value]
        own = hasattr(group, f"use_{name}_mu") and getattr(group, f"use_{name}_mu")
        return Medium(_number(getattr(group, f"{name}_n")), _number(getattr(group, f"{name}_mu")) if own else None)
    if kind == "mesh" and value == "file":
        return bpy.path.abspath(getattr(group, f"{name}_file"))
    return value


def parameters_of(settings):
    """The dataclass instance that the settings (a Scene.nim_scenes) hold; ValueError, one sentence, where they clash."""
    kind = scene_type(settings.scene)
    group = getattr(settings, kind.name)
    return kind.parameters(**{field.name: _value(group, field) for field in dataclasses.fields(kind.parameters)})


def samples_of(settings):
    """Samples a pixel, and percent of the scene's own size, of the chosen quality."""
    samples, percent = QUALITIES[settings.quality]
    return samples or preferences.settings().samples, percent


def backend_of(settings):
    """The backend to build with: "auto", "osl" or "nodes"."""
    return preferences.settings().backend if settings.backend == "default" else settings.backend


def _changed(self, context):
    """Keep the sentence that says what clashes, so that no redraw has to find out."""
    settings = self.id_data.nim_scenes
    try:
        parameters_of(settings)
        settings.problem = ""
    except ValueError as error:
        settings.problem = str(error)


def _view_changed(self, context):
    """Move the camera of a built scene; nothing else of it changes."""
    _changed(self, context)
    scene = self.id_data
    settings = scene.nim_scenes
    camera = scene.camera if scene.get(stages.OWNER) == settings.scene else None
    if camera is not None and camera.get(stages.OWNER) == settings.scene and not settings.problem:
        stages.aim(camera, *scene_type(settings.scene).pose(parameters_of(settings)))


def _quality_changed(self, context):
    scene = self.id_data
    if scene.get(stages.OWNER) == self.scene:
        _apply_quality(scene)


def _apply_quality(scene):
    scene.cycles.samples, scene.render.resolution_percentage = samples_of(scene.nim_scenes)


def copy_settings(source, target):
    """Give one property group the values of another of its type, groups within it too."""
    for name, value in ((name, getattr(source, name)) for name in type(source).__annotations__):
        if isinstance(value, bpy.types.PropertyGroup):
            copy_settings(value, getattr(target, name))
        else:
            setattr(target, name, value)


def _group(kind):
    return type(
        f"NIM_PG_{kind.name}",
        (bpy.types.PropertyGroup,),
        {"__doc__": f"Parameters of the {kind.name} scene.", "__annotations__": _properties(kind)},
    )


GROUPS = {name: _group(kind) for name, kind in SCENES.items()}


class NIM_PG_scenes(bpy.types.PropertyGroup):
    """What the scenes panel holds, in each Blender scene."""

    scene: EnumProperty(
        name="Scene",
        description="Which scene to build",
        items=[(name, name.title(), kind.shows, "NONE", SCENE_NUMBERS[name]) for name, kind in SCENES.items()],
        default="glass",
        update=_changed,
    )
    glass: PointerProperty(name="Glass", description="Parameters of the glass", type=GROUPS["glass"])
    pool: PointerProperty(name="Pool", description="Parameters of the pool", type=GROUPS["pool"])
    sphere: PointerProperty(name="Sphere", description="Parameters of the sphere", type=GROUPS["sphere"])
    sea: PointerProperty(name="Sea", description="Parameters of the sea", type=GROUPS["sea"])
    quality: EnumProperty(
        name="Quality",
        description="Samples a pixel and size of the picture; a built scene follows at once",
        items=[
            ("DEFAULT", "Default", "The samples of the add-on's preferences, full size", "NONE", 0),
            ("DRAFT", "Draft", "32 samples, half size: seconds", "NONE", 1),
            ("GOOD", "Good", "256 samples, full size: minutes", "NONE", 2),
            ("FINAL", "Final", "2048 samples, full size: as long as it takes", "NONE", 3),
        ],
        default="DEFAULT",
        update=_quality_changed,
    )
    backend: EnumProperty(
        name="Backend",
        description="What the optics of the materials are made of",
        items=[
            ("default", "Default", "As in the add-on's preferences", "NONE", 0),
            ("auto", "Automatic", "OSL where this Blender has it, else Blender's own nodes", "NONE", 1),
            ("osl", "OSL", "The closure written in Open Shading Language", "NONE", 2),
            ("nodes", "Nodes", "Blender's own nodes, which run in any build", "NONE", 3),
        ],
        default="default",
    )
    problem: StringProperty(
        name="Problem", description="What clashes in the settings; empty if nothing", options={"HIDDEN"}
    )


# ------------------------------------------------------------------------------------------------ operators


def ready(operator, context):
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
        if scene is None:
            if not _previews_render():
                return self.execute(context)
            self.timer = context.window_manager.event_timer_add(0.05, window=context.window)
            context.window_manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=pgettext_iface("Replace the scene?"),
            message=pgettext_iface("{} is there already. What you added stays, changes to its own objects go.").format(
                scene.name
            ),
            confirm_text=pgettext_iface("Replace"),
            icon="QUESTION",
        )

    def modal(self, context, event):
        if event.type != "TIMER" or _previews_render():
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        return self.execute(context)

    def execute(self, context):
        settings = context.scene.nim_scenes
        kind = scene_type(settings.scene)
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        try:
            scene = kind.build(parameters_of(settings), backend_of(settings))
        except (ValueError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if scene != context.scene:
            copy_settings(settings, scene.nim_scenes)
        _apply_quality(scene)
        if context.window:
            context.window.scene = scene
            _look_through_camera(context.window)
        self.report({"INFO"}, pgettext_rpt("Built {}").format(scene.name))
        return {"FINISHED"}


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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.clipboard = line
        self.report({"INFO"}, pgettext_rpt("Copied: {}").format(line))
        return {"FINISHED"}


def render_words(settings):
    """The words after `nimray` that render what the settings say."""
    assignments = parameters_of(settings).assignments()
    return ["render", settings.scene, *(["--set", *assignments] if assignments else []), *quality_words(settings)]


def quality_words(settings):
    """The words for samples, size and backend that the settings say."""
    samples, percent = samples_of(settings)
    size = [] if percent == 100 else ["--size", f"{percent}%"]
    return ["--samples", str(samples), *size, "--backend", backend_of(settings)]


def quoted(words):
    """The words as one line for this system's shell."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


# ------------------------------------------------------------------------------------------------ presets


def _subdir(name):
    return f"nim_addon/{name}"


def _shipped(name):
    return PACKAGE / "presets" / "nim_addon" / name


class NIM_OT_load_preset(bpy.types.Operator):
    """Take the settings of this preset; Build shows them"""

    bl_idname = "nim.load_preset"
    bl_label = "Load Preset"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    filepath: StringProperty(name="File", description="The preset's file", subtype="FILE_PATH", options={"SKIP_SAVE"})
    menu_idname: StringProperty(name="Menu", description="The menu it is chosen from", options={"SKIP_SAVE"})

    def execute(self, context):
        try:
            bpy.ops.script.execute_preset(filepath=self.filepath, menu_idname=self.menu_idname)
        except (RuntimeError, OSError, AttributeError):
            self.report({"ERROR"}, pgettext_rpt("{} is no preset of this scene.").format(Path(self.filepath).name))
            return {"CANCELLED"}
        return {"FINISHED"}


class NIM_OT_preset(AddPresetBase, bpy.types.Operator):
    """Save these settings as a preset of your own, or remove the one that was loaded last"""

    bl_idname = "nim.preset"
    bl_label = "Save Preset"

    preset_menu = property(lambda self: f"NIM_MT_{self._name}_presets")
    preset_subdir = property(lambda self: _subdir(self._name))
    preset_defines = property(lambda self: [f"settings = bpy.context.scene.nim_scenes.{self._name}"])
    preset_values = property(lambda self: [f"settings.{name}" for name in GROUPS[self._name].__annotations__])
    _name = property(lambda self: bpy.context.scene.nim_scenes.scene)

    @classmethod
    def description(cls, context, properties):
        if properties.remove_active:
            return pgettext_iface("Remove the preset that was loaded last, if it is one of your own")
        return pgettext_iface("Save these settings as a preset of your own")

    def execute(self, context):
        removes = self.remove_active or self.remove_name
        menu = getattr(bpy.types, self.preset_menu)
        name = menu.bl_label if self.remove_active else self.name.strip()
        file = bpy.utils.preset_find(name, self.preset_subdir, display_name=removes)
        problem = None
        if not name:
            problem = pgettext_rpt("Give the preset a name.")
        elif removes and (not file or (_shipped(self._name) / f"{name.replace(' ', '_')}.py").is_file()):
            problem = pgettext_rpt("{} is not one of your own presets, so it stays.").format(name)
        elif not removes and bpy.utils.preset_find(self.as_filename(name), self.preset_subdir):
            problem = pgettext_rpt("There is a preset {} already; choose another name.").format(name)
        if problem:
            self.report({"ERROR"}, problem)
            return {"CANCELLED"}
        done = super().execute(context)
        if "FINISHED" in done:
            template = pgettext_rpt("Removed the preset {}") if removes else pgettext_rpt("Saved the preset {}")
            self.report({"INFO"}, template.format(name))
        return done


def _draw_presets(self, context):
    """List the presets: a Blender without register_preset_path does not know of the shipped ones by itself."""
    paths = bpy.utils.preset_paths(self.preset_subdir)
    if str(self.shipped) not in paths:
        paths = [*paths, str(self.shipped)]
    self.path_menu(
        paths,
        "nim.load_preset",
        props_default={"menu_idname": self.bl_idname},
        filter_ext=lambda extension: extension == ".py",
    )


def _preset_menu(name):
    idname = f"NIM_MT_{name}_presets"
    content = {
        "__doc__": f"Presets of the {name} scene.",
        "bl_idname": idname,
        "bl_label": "Presets",
        "preset_subdir": _subdir(name),
        "shipped": _shipped(name),
        "draw": _draw_presets,
    }
    return type(idname, (bpy.types.Menu,), content)


PRESET_MENUS = {name: _preset_menu(name) for name in SCENES}


# ------------------------------------------------------------------------------------------------ the panel


def _draw_automatic(layout, group, name, label):
    """A number that a person may set, or leave to the rest."""
    row = layout.row(heading=label)
    row.prop(group, f"use_{name}", text="")
    value = row.row()
    value.active = getattr(group, f"use_{name}")
    value.prop(group, name, text="")


def _draw_field(layout, group, field):
    kind, name = field.metadata["kind"], field.name
    if kind == "number" and field.default is None:
        _draw_automatic(layout, group, name, _label(field))
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
    elif kind == "mesh" and getattr(group, name) == "file":
        layout.prop(group, f"{name}_file")


class NIM_PT_scenes(Sidebar, bpy.types.Panel):
    """Choose a scene, set it, build it."""

    bl_idname = "NIM_PT_scenes"
    bl_label = "Scenes"
    bl_order = 0

    def draw(self, context):
        layout = self.layout
        settings = context.scene.nim_scenes
        kind = SCENES[settings.scene]
        layout.row().prop(settings, "scene", expand=True)

        row = layout.row(align=True)
        menu = PRESET_MENUS[kind.name]
        row.menu(menu.bl_idname, text=menu.bl_label)
        row.operator("nim.preset", text="", icon="ADD")
        row.operator("nim.preset", text="", icon="REMOVE").remove_active = True

        layout.use_property_split = True
        layout.use_property_decorate = False
        group = getattr(settings, kind.name)
        column = layout.column()
        for field in dataclasses.fields(kind.parameters):
            _draw_field(column, group, field)

        column = layout.column()
        column.prop(settings, "quality")
        column.prop(settings, "backend")
        if settings.problem:
            draw_sentence(layout, context, settings.problem, "ERROR")
        row = layout.row(align=True)
        row.scale_y = 1.4
        row.operator("nim.build_scene", icon="SCENE_DATA")
        layout.operator("nim.copy_command", icon="COPYDOWN")


CLASSES = (
    *GROUPS.values(),
    NIM_PG_scenes,
    NIM_OT_build_scene,
    NIM_OT_copy_command,
    NIM_OT_load_preset,
    NIM_OT_preset,
    *PRESET_MENUS.values(),
    NIM_PT_scenes,
)


def register():
    """Give every scene its settings, and tell Blender of the presets."""
    bpy.types.Scene.nim_scenes = PointerProperty(
        name="NIM Scenes", description="Settings of the NIM scenes panel", type=NIM_PG_scenes
    )
    if hasattr(bpy.utils, "register_preset_path"):  # not in 4.2
        bpy.utils.register_preset_path(str(PACKAGE))


def unregister():
    """Take both back."""
    if hasattr(bpy.utils, "register_preset_path"):
        bpy.utils.unregister_preset_path(str(PACKAGE))
    del bpy.types.Scene.nim_scenes

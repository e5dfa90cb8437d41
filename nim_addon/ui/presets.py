# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu of presets of each scene: the pictures of the figures, and what a person has saved."""

import re
from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bpy.app.translations import pgettext_iface, pgettext_rpt
from bpy.props import StringProperty

from ..figures.recipes import Figure, Recipe
from ..renders.request import Request
from ..scenes import SCENES
from .help import fail
from .scene_settings import GROUPS, take
from .translations import OWN

# What captions spell out, since a terminal shows them too.
SYMBOLS = {"mu": "μ", "eta": "η"}


def recipes_of(scene: str) -> list[tuple[Figure, list[Recipe]]]:
    """The figures with pictures of that scene, and of each its recipes that are no more than settings of the panel."""
    from ..figures.registry import FIGURES  # which takes a moment, and only who opens a menu has to wait for it

    found = []
    for figure in FIGURES.values():
        # another camera, or a change to the built scene, is nothing that the panel can set
        recipes = [
            recipe
            for recipe in figure.recipes
            if recipe.scene == scene and recipe.shown and recipe.pose is None and recipe.change is None
        ]
        if recipes:
            found.append((figure, recipes))
    return found


class NIM_OT_load_figure(bpy.types.Operator):
    """Take the settings of this picture of the thesis; Build shows them"""

    bl_idname = "nim.load_figure"
    bl_label = "Load Figure"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    scene: StringProperty(name="Scene", description="Name of the scene", options={"HIDDEN", "SKIP_SAVE"})
    figure: StringProperty(name="Figure", description="Number of the figure", options={"HIDDEN", "SKIP_SAVE"})
    recipe: StringProperty(name="Recipe", description="Name of the picture in it", options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context):
        for figure, recipes in recipes_of(self.scene):
            for recipe in recipes:
                if (figure.number, recipe.name) == (self.figure, self.recipe):
                    request = Request.of(self.scene, recipe.settings)
                    settings = context.scene.nim_scenes
                    take(getattr(settings, self.scene), request.parameters)
                    settings.spectral = recipe.spectral
                    MENUS[self.scene].bl_label = _named(figure, recipe.caption)
                    return {"FINISHED"}
        name = f"{self.figure} {self.recipe}"
        return fail(self, pgettext_rpt("{} is no preset of this scene.").format(name))


def _named(figure, text):
    return pgettext_iface("Figure {number}: {text}").format(number=figure.number, text=caption(text))


def caption(text: str) -> str:
    """A figure's caption as a menu has it: in the user's language, symbols as symbols, the first word with a capital."""
    text = pgettext_iface(text, OWN)
    for word, symbol in SYMBOLS.items():
        text = re.sub(rf"\b{word}\b", symbol, text)
    # a quantity keeps its letter: n is an index, N is none
    return text if re.match(r"\w+\s=", text) else text[:1].upper() + text[1:]


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
            return fail(self, pgettext_rpt("{} is no preset of this scene.").format(Path(self.filepath).name))
        return {"FINISHED"}


class NIM_OT_preset(AddPresetBase, bpy.types.Operator):
    """Save these settings as a preset of your own, or remove the one that was loaded last"""

    bl_idname = "nim.preset"
    bl_label = "Save Preset"

    preset_menu = property(lambda self: MENUS[self._name].bl_idname)
    preset_subdir = property(lambda self: MENUS[self._name].preset_subdir)
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
        name = MENUS[self._name].bl_label if self.remove_active else self.name.strip()
        problem = None
        if not name:
            problem = pgettext_rpt("Give the preset a name.")
        elif removes and not bpy.utils.preset_find(name, self.preset_subdir, display_name=True):
            problem = pgettext_rpt("{} is not one of your own presets, so it stays.").format(name)
        elif not removes and bpy.utils.preset_find(self.as_filename(name), self.preset_subdir):
            problem = pgettext_rpt("There is a preset {} already; choose another name.").format(name)
        if problem:
            return fail(self, problem)
        done = super().execute(context)
        if "FINISHED" in done:
            template = pgettext_rpt("Removed the preset {}") if removes else pgettext_rpt("Saved the preset {}")
            self.report({"INFO"}, template.format(name))
        return done


def _draw(self, context):
    """List the pictures of each figure under its title, then the presets of one's own."""
    for figure, recipes in recipes_of(self.scene):
        self.layout.label(text=_named(figure, figure.title), translate=False)
        for recipe in recipes:
            button = self.layout.operator(
                "nim.load_figure", text=caption(recipe.caption), icon="BLANK1", translate=False
            )
            button.scene, button.figure, button.recipe = self.scene, figure.number, recipe.name
    if folders := bpy.utils.preset_paths(self.preset_subdir):
        self.layout.separator()
        self.path_menu(
            folders,
            "nim.load_preset",
            props_default={"menu_idname": self.bl_idname},
            filter_ext=lambda extension: extension == ".py",
        )


def _menu(name):
    idname = f"NIM_MT_{name}_presets"
    content = {
        "__doc__": f"Presets of the {name} scene.",
        "bl_idname": idname,
        "bl_label": "Presets",
        "scene": name,
        "preset_subdir": f"nim_addon/{name}",
        "draw": _draw,
    }
    return type(idname, (bpy.types.Menu,), content)


MENUS = {name: _menu(name) for name in SCENES}

CLASSES = (NIM_OT_load_figure, NIM_OT_load_preset, NIM_OT_preset, *MENUS.values())

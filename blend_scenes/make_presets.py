# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the presets of the scenes panel, nim_addon/presets/ (or into the folder given), from the figures' recipes."""

import json
import sys
from pathlib import Path

import bpy  # noqa: F401  the add-on's modules want it first

from nim_addon.figures.registry import FIGURES
from nim_addon.physics import Medium
from nim_addon.scenes import SCENES
from nim_addon.ui.scenes import GROUPS, _liquid_word

HOME = Path(__file__).resolve().parents[1] / "nim_addon" / "presets" / "nim_addon"


def settings_of(scene, parameters):
    """The settings of the panel's group of a scene that hold its Parameters, a dict: all, so that a preset sets all."""
    properties = GROUPS[scene].__annotations__
    settings = {name: one.keywords.get("default", "") for name, one in properties.items()}
    for name in (text.partition("=")[0] for text in parameters.assignments()):
        value = getattr(parameters, name)
        settings[name] = _liquid_word(value) if value is None or isinstance(value, Medium) else value
        if f"use_{name}" in settings:
            settings[f"use_{name}"] = True
    return settings


def text_of(scene, parameters):
    """The preset's file, as Blender writes it."""
    lines = [
        f"settings.{name} = {json.dumps(value) if isinstance(value, str) else value}"
        for name, value in settings_of(scene, parameters).items()
    ]
    opening = ["# SPDX-License-Identifier: GPL-3.0-or-later", "import bpy", ""]
    return "\n".join([*opening, f"settings = bpy.context.scene.nim_scenes.{scene}", *lines, ""])


home = Path(sys.argv[1]) if len(sys.argv) > 1 else HOME
for old in home.glob("*/Figure_*.py"):
    old.unlink()
for figure in FIGURES.values():
    for recipe in figure.recipes:
        # another camera, or a scene of the figure's own, is nothing that the panel can set
        if recipe.shown and recipe.scene in SCENES and recipe.pose is None:
            words = recipe.caption.replace(",", "").replace(" =", "")
            file = home / recipe.scene / f"Figure {figure.number} {words}.py".replace(" ", "_")
            file.parent.mkdir(parents=True, exist_ok=True)
            parameters = SCENES[recipe.scene].parameters.read(recipe.settings)
            file.write_text(text_of(recipe.scene, parameters), encoding="utf-8")

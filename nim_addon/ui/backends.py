# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of a backend where it is drawn: OSL stands there, greyed, where this build has none, and says why."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_tip as tip_

from ..cycles.closures.backends import osl_available

OSL_MISSING = "This Blender was built without OSL; choose nodes, or use a build from blender.org"
OSL = "The closure in the Open Shading Language" if osl_available() else OSL_MISSING


def draw_choice(layout: bpy.types.UILayout, owner: bpy.types.bpy_struct, menu: str = "") -> None:
    """Draw the property `backend` of something, beside others that are split from their names.

    menu: of whoever has no room for a row of buttons, the bl_idname of a menu that calls draw_items()
    """
    known = owner.bl_rna.properties["backend"]
    split = layout.split(factor=0.4)
    split.use_property_split = False
    name = split.row()
    name.alignment = "RIGHT"
    name.label(text=known.name)
    if menu:
        split.menu(menu, text=known.enum_items[owner.backend].name)
    else:
        draw_items(split.row(align=True), owner)


def draw_items(layout: bpy.types.UILayout, owner: bpy.types.bpy_struct) -> None:
    """Draw a button for each item of the property `backend` of something."""
    for item in owner.bl_rna.properties["backend"].enum_items:
        draw_cell(layout, item.identifier).prop_enum(owner, "backend", item.identifier)


def draw_cell(layout: bpy.types.UILayout, backend: str) -> bpy.types.UILayout:
    """Where in a layout the button of a backend goes: greyed if this build has none such."""
    cell = layout.row(align=True)
    cell.enabled = backend != "osl" or osl_available()
    return cell


def why_not(backend: str) -> str:
    """The tooltip of a backend that this build does not have, in the person's language; empty for one that it has."""
    return "" if backend != "osl" or osl_available() else tip_(OSL_MISSING)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of a backend where it is drawn: OSL stands there, greyed, where this build has none, and says why."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_tip as tip_

from ..cycles.closures.backends import osl_available

OSL_MISSING = "This Blender was built without OSL; choose nodes, or use a build from blender.org"
OSL = "The closure in the Open Shading Language" if osl_available() else OSL_MISSING


def draw_choice(layout: bpy.types.UILayout, owner: bpy.types.bpy_struct) -> None:
    """Draw the property `backend` of something as a row of buttons."""
    row = layout.row(align=True, heading=owner.bl_rna.properties["backend"].name)
    for item in owner.bl_rna.properties["backend"].enum_items:
        draw_cell(row, item.identifier).prop_enum(owner, "backend", item.identifier)


def draw_cell(row: bpy.types.UILayout, backend: str) -> bpy.types.UILayout:
    """Where in a row the button of a backend goes: greyed if this build has none such."""
    cell = row.row(align=True)
    cell.enabled = backend != "osl" or osl_available()
    return cell


def why_not(backend: str) -> str:
    """The tooltip of a backend that this build does not have, in the person's language; empty for one that it has."""
    return "" if backend != "osl" or osl_available() else tip_(OSL_MISSING)

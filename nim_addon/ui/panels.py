# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels share: the place of those in a 3D view's sidebar, and how a sentence is drawn."""

import functools
import textwrap

import bpy

# A panel is drawn over and over with the same sentences: breaking them took most of its time.
_lines = functools.lru_cache(maxsize=512)(textwrap.wrap)


class Helped:
    """For a panel that has a page: a "?" in its header opens that. `page` is the page's name, and its section's."""

    page = ""

    def draw_header_preset(self, context):
        draw_help(self.layout, self.page)


class Sidebar(Helped):
    """For a panel in the sidebar, of a 3D view where it does not say another, on the add-on's own tab."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "NIM"


def draw_help(layout: bpy.types.UILayout, page: str, text: str = "") -> None:
    """Draw the button that opens a page: a "?", and a text if there is room for one."""
    layout.operator("nim.help", text=text, icon="QUESTION", emboss=bool(text)).page = page


def draw_sentence(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """Draw a sentence, translated already, over as many lines as the region is too narrow for."""
    width = context.region.width / context.preferences.system.ui_scale if context.region else 300
    # a letter is at most about 6.4 units wide in a line; margins, tabs and the icon take the rest
    letters = int((width - (75 if icon != "NONE" else 50)) / 6.4)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in _lines(text, max(24, letters)):
        column.label(text=line, icon=icon, translate=False)
        icon = "BLANK1" if icon != "NONE" else "NONE"

# SPDX-License-Identifier: GPL-3.0-or-later
"""OSL, where this Blender has none: its button stands there greyed, in every row of backends, and says why."""

import bpy
import pytest

from nim_addon.ui import backends, preferences


class Layout:
    """Blender gives a layout only where it draws: this one notes which buttons it is given, and whether they are greyed."""

    def __init__(self, buttons):
        self.buttons, self.enabled = buttons, True

    def row(self, **_):
        return Layout(self.buttons)

    split = row

    def label(self, **_):
        pass

    def prop_enum(self, owner, name, value):
        self.buttons[value] = self.enabled


@pytest.mark.parametrize("there", (True, False))
def test_osl_is_greyed_where_there_is_none(addon, monkeypatch, there):
    monkeypatch.setattr(backends, "osl_available", lambda: there)
    for draw, owner in (
        (backends.draw_choice, preferences.NIM_AP_preferences),
        (backends.draw_items, bpy.context.scene.nim_scenes),
    ):
        buttons = {}
        draw(Layout(buttons), owner)
        assert {value for value, enabled in buttons.items() if not enabled} == (set() if there else {"osl"})
        assert {"auto", "osl", "nodes"} <= set(buttons)
    assert backends.why_not("osl") == ("" if there else backends.OSL_MISSING)
    assert backends.why_not("nodes") == ""


def test_the_tooltip_says_what_this_blender_has(addon):
    items = bpy.context.scene.nim_scenes.bl_rna.properties["backend"].enum_items
    built = bpy.app.build_options.cycles_osl
    assert (items["osl"].description == backends.OSL_MISSING) != built

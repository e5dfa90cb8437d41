# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons are where people look: in the Object menu, on the right click, in the search, and in a pie menu."""

import re
from types import SimpleNamespace

import bpy
import pytest


class Drawn:
    """A layout of a menu: (operator, text) of what is drawn on it."""

    def __init__(self):
        self.entries, self.menus, self.operator_context = [], [], None

    def menu_pie(self):
        return self

    def separator(self):
        pass

    def menu(self, name, icon="NONE"):
        self.menus.append(name)

    def operator(self, name, text=None, icon="NONE"):
        icons = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items
        assert icon in icons.keys()  # noqa: SIM118
        operator = getattr(bpy.ops.nim, name.removeprefix("nim.")).get_rna_type()
        self.entries.append((name, text or operator.name))


def drawn(name):
    layout = Drawn()
    getattr(bpy.types, name).draw(SimpleNamespace(layout=layout), SimpleNamespace(mode="OBJECT"))
    return layout


@pytest.mark.parametrize(
    "words, operator",
    [
        ("caustic", "nim.bake_caustics"),
        ("light path", "nim.light_paths_live"),
        ("light path", "nim.light_paths"),
        ("light path side", "nim.light_paths_view"),
        ("negative index", "nim.convert"),
        ("refraction", "nim.view_rendered"),
    ],
)
def test_the_search_finds(addon, words, operator):
    """Each word begins one of the entry's: so the search finds entries of menus (string_search.cc), and ours is one."""
    entries = dict(drawn("NIM_MT_object").entries)
    written = re.split(r"[\W_]+", entries[operator].lower())
    assert all(any(there.startswith(word) for there in written) for word in words.split())


def test_the_pie_has_eight_of_the_menu(addon):
    pie, menu = drawn("NIM_MT_pie_context_menu").entries, drawn("NIM_MT_object").entries
    assert len(pie) == len(dict(pie)) == 8 and set(pie) <= set(menu)


def test_the_search_lists_each_once(addon):
    """It collects what the menus of an editor and those of its keys hold, but no context menus, which it tells by name."""
    (item,) = bpy.context.window_manager.keyconfigs.addon.keymaps["Object Mode"].keymap_items
    assert item.active and item.properties.name.endswith("_context_menu")


def test_the_menu_is_in_the_object_menu_and_on_the_right_click_and_goes(addon):
    import addon_utils

    def ours():
        found = {}
        for name in ("VIEW3D_MT_object", "VIEW3D_MT_object_context_menu"):
            layout = Drawn()
            draws = getattr(bpy.types, name)._dyn_ui_initialize()
            for draw in (draw for draw in draws if draw.__module__.startswith("nim_addon")):
                draw(SimpleNamespace(layout=layout), SimpleNamespace(mode="OBJECT"))
            found[name] = layout.menus
        return found

    assert ours() == {"VIEW3D_MT_object": ["NIM_MT_object"], "VIEW3D_MT_object_context_menu": ["NIM_MT_object"]}
    addon_utils.disable(addon, default_set=True)
    assert not any(ours().values())
    addon_utils.enable(addon, default_set=True)


def test_the_pie_takes_no_key_and_can_be_given_one(addon):
    import addon_utils

    def ours():
        keymap = bpy.context.window_manager.keyconfigs.addon.keymaps.get("Object Mode")
        return [item for item in keymap.keymap_items if item.idname == "wm.call_menu_pie"] if keymap else []

    (item,) = ours()
    assert item.type == "NONE" and item.properties.name == "NIM_MT_pie_context_menu"
    addon_utils.disable(addon, default_set=True)
    assert not ours()
    addon_utils.enable(addon, default_set=True)
    assert len(ours()) == 1

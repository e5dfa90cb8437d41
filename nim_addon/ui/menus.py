# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a person looks for a button: the Object menu, the right click, the search (F3), and a pie menu to bind.

The search finds entries of the menus of an editor by their words and by those of the menu that they are in.
"""

import bpy

# Operators, what is written there where it is not their label, and icons; None: a line between.
ENTRIES = (
    ("nim.convert", None, "MATERIAL"),
    ("nim.revert", None, "LOOP_BACK"),
    None,
    ("nim.view_rendered", "Show Refraction (Rendered)", "SHADING_RENDERED"),
    ("nim.light_paths_live", None, "HIDE_OFF"),
    ("nim.light_paths_view", None, "VIEW_ORTHO"),
    ("nim.light_handle", None, "EMPTY_SINGLE_ARROW"),
    ("nim.light_paths", None, "CURVE_DATA"),
    ("nim.light_paths_clear", None, "TRASH"),
    None,
    ("nim.add_floor", None, "MESH_PLANE"),
    ("nim.bake_caustics", None, "OUTLINER_OB_LIGHT"),
    ("nim.clear_caustics", None, "TRASH"),
    None,
    ("nim.mend", "Mend All Problems", "TOOL_SETTINGS"),
)
# In the order of Blender's pies: left, right, below, above, and the corners between from the upper left.
PIE = (
    "nim.convert",
    "nim.revert",
    "nim.view_rendered",
    "nim.bake_caustics",
    "nim.light_paths_live",
    "nim.light_paths",
    "nim.mend",
    "nim.clear_caustics",
)
_keys = []


def _draw(layout, operator, text, icon):
    layout.operator(operator, **({"text": text} if text else {}), icon=icon)


class NIM_MT_object(bpy.types.Menu):
    """Bend the light of these objects backwards, see its paths and its caustics"""

    bl_idname = "NIM_MT_object"
    bl_label = "Negative Index"

    def draw(self, context):
        """Draw every entry."""
        self.layout.operator_context = "INVOKE_REGION_WIN"
        for entry in ENTRIES:
            if entry:
                _draw(self.layout, *entry)
            else:
                self.layout.separator()


class NIM_MT_pie_context_menu(bpy.types.Menu):
    """The same around the mouse; it has a key once you give it one, in the add-on's preferences"""

    # the search collects menus that keys open, but of these names: it has the entries from the Object menu
    bl_idname = "NIM_MT_pie_context_menu"
    bl_label = "Negative Index"

    def draw(self, context):
        """Draw one in each of the eight directions."""
        pie = self.layout.menu_pie()
        entries = {entry[0]: entry for entry in ENTRIES if entry}
        for operator in PIE:
            _draw(pie, *entries[operator])


def _menu(self, context):
    if context.mode == "OBJECT":
        self.layout.separator()
        self.layout.menu("NIM_MT_object", icon="MATERIAL")


def draw_key(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where a person gives the pie menu a key."""
    import rna_keymap_ui

    keymap = context.window_manager.keyconfigs.user.keymaps.get("Object Mode")
    items = keymap.keymap_items if keymap else ()
    item = next(
        (i for i in items if i.idname == "wm.call_menu_pie" and i.properties.name == "NIM_MT_pie_context_menu"), None
    )
    if item:
        layout.context_pointer_set("keymap", keymap)
        rna_keymap_ui.draw_kmi([], context.window_manager.keyconfigs.user, keymap, item, layout, 0)


CLASSES = (NIM_MT_object, NIM_MT_pie_context_menu)
MENUS = ("VIEW3D_MT_object", "VIEW3D_MT_object_context_menu")


def register():
    """Add the menu to Blender's own, and an entry without a key to its key map."""
    for menu in MENUS:
        getattr(bpy.types, menu).append(_menu)
    if keys := bpy.context.window_manager.keyconfigs.addon:  # none without a window
        keymap = keys.keymaps.new(name="Object Mode")
        item = keymap.keymap_items.new("wm.call_menu_pie", "NONE", "PRESS")
        item.properties.name = "NIM_MT_pie_context_menu"
        _keys.append((keymap, item))


def unregister():
    """Take them back."""
    while _keys:
        keymap, item = _keys.pop()
        keymap.keymap_items.remove(item)
    for menu in MENUS:
        getattr(bpy.types, menu).remove(_menu)

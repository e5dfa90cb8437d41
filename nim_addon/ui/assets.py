# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library: materials, liquids, objects and scenes, ready to drag into a file; offered once, added by one click."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..base import shipped

NAME = "Negative-Index Materials"
FOLDER = shipped.ASSETS


def library() -> bpy.types.UserAssetLibrary | None:
    """The entry of the preferences that is ours, or None."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((known for known in libraries if known.path and Path(bpy.path.abspath(known.path)) == FOLDER), None)


class NIM_OT_register_assets(bpy.types.Operator):
    """Show the add-on's materials and objects in the Asset Browser, as a library of their own"""

    bl_idname = "nim.register_assets"
    bl_label = "Add Asset Library"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if library():
            cls.poll_message_set("The asset library is registered already")
            return False
        return True

    def execute(self, context):
        if not (FOLDER / "nim_assets.blend").is_file():
            self.report(
                {"ERROR"}, rpt_("The asset library is missing from this installation: install the add-on again")
            )
            return {"CANCELLED"}
        entry = context.preferences.filepaths.asset_libraries.new(name=NAME, directory=str(FOLDER))
        if entry.import_method != "APPEND_REUSE":  # 5.2 packs, and what it has packed cannot be changed
            entry.import_method = "APPEND"
        context.preferences.is_dirty = True
        self.report({"INFO"}, rpt_("{name} is in the Asset Browser's list of libraries").format(name=NAME))
        return {"FINISHED"}


class NIM_OT_unregister_assets(bpy.types.Operator):
    """Take the add-on's library out of the Asset Browser; what was used of it stays in the files"""

    bl_idname = "nim.unregister_assets"
    bl_label = "Remove Asset Library"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if not library():
            cls.poll_message_set("The asset library is not registered")
            return False
        return True

    def execute(self, context):
        context.preferences.filepaths.asset_libraries.remove(library())
        bpy.ops.nim.decline_assets()
        context.preferences.is_dirty = True
        self.report({"INFO"}, rpt_("{name} is no longer in the Asset Browser").format(name=NAME))
        return {"FINISHED"}


# A library that a person has added to the preferences is theirs to remove: it stays where the add-on goes.
CLASSES = (NIM_OT_register_assets, NIM_OT_unregister_assets)

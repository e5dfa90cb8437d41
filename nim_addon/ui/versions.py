# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of earlier versions, brought up to date as they are opened."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..cycles import versions


class NIM_OT_update_file(bpy.types.Operator):
    """Bring the interface node groups of this file up to the present version; every material keeps its values and links"""

    bl_idname = "nim.update_file"
    bl_label = "Update This File"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not versions.outdated():
            cls.poll_message_set("Every interface in this file is up to date")
            return False
        return True

    def execute(self, context):
        done = versions.update()
        for sentence in done.left_alone:
            self.report({"WARNING"}, sentence)
        if done.updated:
            self.report({"INFO"}, rpt_("Updated {names}").format(names=", ".join(done.updated)))
        return {"FINISHED"} if done.updated else {"CANCELLED"}


@bpy.app.handlers.persistent
def update_opened_file(*_):
    """Called by Blender after it opened a file; does nothing, and takes no time, where all is up to date."""
    for sentence in versions.update().left_alone:
        print(f"NIM for Blender: {sentence}")


CLASSES = (NIM_OT_update_file,)


def register():
    """From now on every file that is opened is looked through."""
    bpy.app.handlers.load_post.append(update_opened_file)


def unregister():
    """And no longer."""
    bpy.app.handlers.load_post.remove(update_opened_file)

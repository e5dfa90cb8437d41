# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of earlier versions, brought up to date as they are opened, or as their materials are appended to another."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..cycles import versions
from . import deferred


class NIM_OT_update_file(bpy.types.Operator):
    """Bring the interface node groups of this file up to the present version; every material keeps its values and links"""

    bl_idname = "nim.update_file"
    bl_label = "Update This File"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not versions.outdated():
            cls.poll_message_set("Every NIM material in this file is up to date")
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
def update_opened_file(*_) -> None:
    """Called by Blender after it opened a file; does nothing, and takes no time, where all is up to date."""
    for sentence in versions.update().left_alone:
        print(f"Negative-Index Materials: {sentence}")


_groups = 0  # how many there were when they were last looked through


@bpy.app.handlers.persistent
def update_imported(*_) -> None:
    """Called by Blender after it appended or linked something; the rest waits until it is done with that."""
    deferred.do(update_opened_file)


@bpy.app.handlers.persistent
def update_if_more(*_) -> None:
    """The same where Blender does not call then, before 4.5: called after any change, of which few bring node groups."""
    global _groups
    before, _groups = _groups, len(bpy.data.node_groups)
    if _groups > before:
        deferred.do(update_opened_file)


CLASSES = (NIM_OT_update_file,)
# Every file that is opened is looked through, and every one that something is appended from.
HANDLERS = (
    ("load_post", update_opened_file),
    ("blend_import_post", update_imported)
    if hasattr(bpy.app.handlers, "blend_import_post")
    else ("depsgraph_update_post", update_if_more),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Live light paths, on and off. While they are off nothing of them is registered but the button.

They are on for a session, not for a file: another file ends them.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from . import live_look

_views = None  # the module that draws, while they are on


@persistent
def stop(*_) -> None:
    """Switch it off, and leave nothing of it behind."""
    global _views
    for name, handler in HANDLERS_WHILE_ON:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    live_look.on = False
    if _views:
        _views.stop()
        _views = None
    live_look.forget()


HANDLERS_WHILE_ON = (
    ("depsgraph_update_post", live_look.note_change),
    ("frame_change_post", live_look.note_change),
    ("undo_post", live_look.forget),
    ("redo_post", live_look.forget),
    ("load_post", stop),
)


def start() -> None:
    """Switch it on; there must be a window."""
    global _views
    # only where something is drawn: a Blender without a window has no gpu
    from . import live_views

    for name, handler in HANDLERS_WHILE_ON:
        getattr(bpy.app.handlers, name).append(handler)
    live_look.on, _views = True, live_views
    _views.start()


def is_on() -> bool:
    """Whether live paths are drawn."""
    return live_look.on


def point(context: bpy.types.Context, place: tuple[float, float]) -> None:
    """Note where in a view the mouse is."""
    if _views:
        _views.point(context, place)


class NIM_OT_light_paths_live(bpy.types.Operator):
    """Show where light goes, over the 3D views, and follow every change: of settings, materials and objects"""

    bl_idname = "nim.light_paths_live"
    bl_label = "Show Light Paths Live"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Only where there are views."""
        if bpy.app.background:
            cls.poll_message_set("Live light paths need a Blender with a window")
            return False
        return True

    def execute(self, context):
        """Switch it on or off."""
        stop() if is_on() else start()
        return {"FINISHED"}


CLASSES = (NIM_OT_light_paths_live,)
unregister = stop

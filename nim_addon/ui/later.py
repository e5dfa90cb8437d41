# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that a panel needs but must not do while it is drawn: done at once afterwards, and then drawn again.

While a panel is drawn Blender marks its data as read-only, and numpy lets other threads run: a Cycles preview that
starts or ends just then leaves the mark set for good, and no operator can change anything any more.
"""

import bpy

_waiting = {}


def do(function, *given):
    """Call function(*given) as soon as Blender is not drawing; once, however often it is asked for before."""
    if bpy.app.background:  # nothing is drawn there, and no timer runs
        function(*given)
        return
    _waiting[function, given] = None
    if not bpy.app.timers.is_registered(_work):
        bpy.app.timers.register(_work, first_interval=0.0)


def _work():
    while _waiting:
        function, given = next(iter(_waiting))
        del _waiting[function, given]
        function(*given)
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("PROPERTIES", "VIEW_3D", "NODE_EDITOR"):
                for region in area.regions:
                    if region.type == "UI" or area.type == "PROPERTIES" or _has_note(area):
                        region.tag_redraw()


def _has_note(area):
    """Whether a view may tell, in its picture, that it is wrong (ui.viewport)."""
    return area.type == "VIEW_3D" and area.spaces.active.shading.type in ("MATERIAL", "RENDERED")


def stop():
    """Forget what is waiting."""
    _waiting.clear()
    if bpy.app.timers.is_registered(_work):
        bpy.app.timers.unregister(_work)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that a panel needs but must not do while it is drawn: done at once afterwards, and then drawn again.

While a panel is drawn Blender marks its data as read-only, and numpy lets other threads run: a Cycles preview that
starts or ends just then leaves the mark set for good, and no operator can change anything any more.
"""

import time
from collections.abc import Callable
from typing import Any

import bpy

_waiting = {}  # functions with what they are given, and when each is due
_working = False


def do(function: Callable[..., None], *given: Any, after: float = 0.0) -> None:
    """Call function(*given) as soon as Blender is not drawing; once, however often it is asked for before.

    after: seconds that it waits, counted anew each time that it is asked for
    """
    if bpy.app.background:  # nothing is drawn there, and no timer runs
        function(*given)
        return
    _waiting[function, given] = time.monotonic() + after
    if not _working:
        if bpy.app.timers.is_registered(_work):
            bpy.app.timers.unregister(_work)
        bpy.app.timers.register(_work, first_interval=_wait())


def _wait():
    """Seconds until the first is due."""
    return max(0.0, min(_waiting.values()) - time.monotonic())


def _work():
    global _working
    _working = True
    try:
        while _waiting and _wait() == 0:
            function, given = min(_waiting, key=_waiting.get)
            del _waiting[function, given]
            function(*given)
    finally:
        _working = False
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("PROPERTIES", "VIEW_3D", "NODE_EDITOR"):
                for region in area.regions:
                    if region.type == "UI" or area.type == "PROPERTIES" or _has_note(area):
                        region.tag_redraw()
    return _wait() if _waiting else None


def _has_note(area):
    """Whether a view may tell, in its picture, that it is wrong (ui.viewport)."""
    return area.type == "VIEW_3D" and area.spaces.active.shading.type in ("MATERIAL", "RENDERED")


def stop() -> None:
    """Forget what is waiting."""
    _waiting.clear()
    if bpy.app.timers.is_registered(_work):
        bpy.app.timers.unregister(_work)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that a panel needs but must not do while it is drawn: done at once afterwards, and then drawn again.

While a panel is drawn Blender marks its data as read-only, and whatever lets other threads run, as numpy does, or a machine
that is busy: a Cycles preview that starts or ends just then leaves the mark set, for a while or for good, and what a timer
does can change nothing any more. By way of a property of the window manager, which has no such mark, it can.
"""

import time
from collections.abc import Callable
from typing import Any

import bpy

_waiting = {}  # functions with what they are given, and when each is due
_working = False
_acts = []  # what writing() has called


def do(function: Callable[..., None], *given: Any, after: float = 0.0) -> None:
    """Call function(*given) as soon as Blender is not drawing; once, however often it is asked for before.

    after: seconds that it waits, counted anew each time that it is asked for
    """
    if bpy.app.background:  # nothing is drawn there, and no timer runs
        writing(function, *given)
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
            writing(function, *given)
    finally:
        _working = False
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("PROPERTIES", "VIEW_3D", "NODE_EDITOR"):
                for region in area.regions:
                    if region.type == "UI" or area.type == "PROPERTIES" or _has_note(area):
                        region.tag_redraw()
    return _wait() if _waiting else None


def writing(function: Callable[..., Any], *given: Any) -> Any:
    """Call function(*given) from a timer so that it can change Blender's data, and return or raise what it does."""
    if not _is_read_only():
        return function(*given)
    done = []

    def act():
        try:
            done.append((function(*given), None))
        except Exception as error:
            done.append((None, error))

    _acts.append(act)
    bpy.context.window_manager.nim_acts = not bpy.context.window_manager.nim_acts
    ((result, error),) = done
    if error is not None:
        raise error
    return result


def _is_read_only():
    scene = bpy.data.scenes[0]
    try:
        scene.tag = scene.tag  # which nothing is told of
    except AttributeError:
        return True
    return False


def _act(_manager, _context):
    _acts.pop()()


def _has_note(area):
    """Whether a view may tell, in its picture, that it is wrong (ui.viewport)."""
    return area.type == "VIEW_3D" and area.spaces.active.shading.type in ("MATERIAL", "RENDERED")


def register() -> None:
    """Let timers change data."""
    bpy.types.WindowManager.nim_acts = bpy.props.BoolProperty(
        name="Negative Index", update=_act, options={"HIDDEN", "SKIP_SAVE"}
    )


def unregister() -> None:
    """Forget what is waiting."""
    _waiting.clear()
    if bpy.app.timers.is_registered(_work):
        bpy.app.timers.unregister(_work)
    del bpy.types.WindowManager.nim_acts

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's mark that its data is read-only, taken away where it stays set.

Blender sets it for the time that a panel is drawn. Where threads run then, as they do while a preview picture of a material is
rendered, each puts back what it found, in whatever order, and the mark may stay for good. A person presses all the same, since
what events do has no mark; the story is told by a timer, which could change nothing any more.
"""

import threading

import bpy

_within, _leave = threading.Event(), threading.Event()


class PRESS_OT_hold(bpy.types.Operator):
    """Nothing: what asks whether it can be done waits, and Blender notes the mark before that and puts it back afterwards."""

    bl_idname = "press.hold"
    bl_label = "Hold"

    @classmethod
    def poll(cls, _context):
        _within.set()
        return _leave.wait()


def hold():
    """A thread that has noted the mark as it is now, and puts it back once release() lets it."""
    _within.clear()
    _leave.clear()
    thread = threading.Thread(target=bpy.ops.press.hold.poll)
    thread.start()
    _within.wait()
    return thread


def release(thread):
    """Let the thread of hold() put back the mark that it found."""
    _leave.set()
    thread.join()


def is_set():
    """Whether a timer can change nothing now."""
    scene = bpy.data.scenes[0]
    try:
        scene.tag = scene.tag  # which nothing is told of
    except AttributeError:
        return True
    return False


def take_away():
    """Where the mark is set, take it away for good: begin to hold where there is none, as a property is told of a change."""
    if is_set():
        manager = bpy.context.window_manager
        manager.press_unmarked = not manager.press_unmarked
        release(_holding.pop())


_holding = []
bpy.utils.register_class(PRESS_OT_hold)
bpy.types.WindowManager.press_unmarked = bpy.props.BoolProperty(
    update=lambda _manager, _context: _holding.append(hold()), options={"HIDDEN", "SKIP_SAVE"}
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Esc in any window while something goes on: a modal operator in each of them, since one hears its own window only."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass

import bpy


@dataclass(eq=False)
class Listening:
    """What Esc ends.

    goes_on: whether it is still under way
    stop:    called where Esc is pressed meanwhile
    passing: types of the events that other operators may have; None: all
    """

    goes_on: Callable[[], bool]
    stop: Callable[[], object]
    passing: Container[str] | None = None

    def hears(self, event: bpy.types.Event) -> set[str]:
        """What the operator of a window answers to an event there."""
        if not self.goes_on():
            return {"FINISHED", "PASS_THROUGH"}
        if event.type == "ESC" and event.value == "PRESS":
            self.stop()
            return {"FINISHED"}
        return {"PASS_THROUGH"} if self.passing is None or event.type in self.passing else {"RUNNING_MODAL"}


_next: Listening | None = None  # that of the operator that is invoked


def listen(listening: Listening, beside: bpy.types.Window | None = None) -> None:
    """Hear Esc in all windows, but for the one `beside`, which hears it by itself."""
    global _next
    if bpy.app.background:
        return
    for window in bpy.context.window_manager.windows:
        if window != beside:
            _next = listening
            with bpy.context.temp_override(window=window):
                bpy.ops.nim.listen("INVOKE_DEFAULT")
    _next = None


class NIM_OT_listen(bpy.types.Operator):
    """Hear Esc while a bake or a render in the background is under way"""

    bl_idname = "nim.listen"
    bl_label = "Listen for Esc"
    bl_options = {"INTERNAL"}

    def invoke(self, context, event):
        if _next is None:
            return {"CANCELLED"}
        self.listening = _next
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        return self.listening.hears(event)


CLASSES = (NIM_OT_listen,)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What panels know of a scene: looked at after each change of it, yet never while a panel is drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from . import deferred


class Looks:
    """The result of the last look at each scene, for a panel to draw; no bpy data, which may be gone by the next drawing.

    look: function of a bpy.types.Scene, and of what else renew() is given, that returns what is to be known of it
    may_look: function that says whether a look can be taken now; until it can, the last one's result is shown
    settled: seconds without a redraw before a change is looked at; the first look is taken at once
    """

    def __init__(self, look: Callable[..., Any], may_look: Callable[[], bool], settled: float = 0.0):
        self.look, self.may_look, self.settled = look, may_look, settled
        # by session_uid of a scene, and those of them that nothing has changed since
        self._known, self._fresh = {}, set()

    def last(self, scene: bpy.types.Scene) -> Any:
        """What the last look at a scene gave, or None."""
        return self._known.get(scene.session_uid)

    def known(self, scene: bpy.types.Scene) -> Any:
        """The same; a look is asked for where something has changed since. Quick: it can be called while drawing."""
        uid = scene.session_uid
        if uid not in self._fresh and self.may_look():
            deferred.do(self.renew, uid, after=self.settled if uid in self._known else 0.0)
        return self.last(scene)

    def is_fresh(self, scene: bpy.types.Scene) -> bool:
        """Whether nothing has changed since the last look."""
        return scene.session_uid in self._fresh

    def renew(self, uid: int, *given: Any) -> None:
        """Look at the scene of that session_uid now, if it is still there, and no render has what is evaluated of it wait."""
        if bpy.app.is_job_running("RENDER"):
            return
        scene = next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)
        if scene:
            self._known[uid] = self.look(scene, *given)
            self._fresh.add(uid)

    def outdate(self, scene: bpy.types.Scene | None = None) -> None:
        """Note that a scene, or any of them, may have changed."""
        if scene is None:
            self._fresh.clear()
        else:
            self._fresh.discard(scene.session_uid)

    def forget(self) -> None:
        """Forget everything: another file, or another state of this one."""
        self._known.clear()
        self._fresh.clear()

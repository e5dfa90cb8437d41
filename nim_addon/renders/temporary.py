# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that is in Blender's file only for a render: what came with it goes with it, and nothing else is touched."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import bpy

from ..scenes.stage import STAGE_MARK


class TemporaryScene:
    """A bpy.types.Scene that `make` makes at the first look at `scene`, with `with`, at whose end it is removed.

    Gone then is all data that has come into Blender's file since, but for Blender's own image of the last render. A
    scene of ours that a person has built stays as it is, though a scene that is built takes the place of the former.
    """

    def __init__(self, make: Callable[[], bpy.types.Scene]) -> None:
        self._make = make
        self._scene: bpy.types.Scene | None = None
        self._before: set | None = None
        self._aside: dict[bpy.types.Scene, str] = {}
        self._names: dict[bpy.types.ID, str] = {}

    @property
    def scene(self) -> bpy.types.Scene:
        """The scene. Raises what `make` raises."""
        if self._scene is None:
            if self._before is None:
                self._before = set(bpy.data.user_map())
                self._aside = {scene: scene[STAGE_MARK] for scene in bpy.data.scenes if STAGE_MARK in scene}
                for scene in self._aside:
                    del scene[STAGE_MARK]
            self._scene = self._make()
        return self._scene

    def give_way(self, data: bpy.types.ID) -> None:
        """Let data of the open file be called otherwise meanwhile, so that what comes with the scene keeps its own name."""
        self._names[data] = data.name
        data.name = f"{len(self._names)} of the open file"

    def __enter__(self) -> TemporaryScene:
        return self

    def __exit__(self, *_) -> None:
        if self._before is None:
            return
        self._scene = None
        came = set(bpy.data.user_map()) - self._before
        # first what ties rigid bodies together: without it Blender may fall over as they go one by one
        for scene in [scene for scene in bpy.data.scenes if scene in came]:
            bpy.data.scenes.remove(scene)
        came = set(bpy.data.user_map()) - self._before
        bpy.data.batch_remove([data for data in came if not _is_render_result(data)])
        for data, name in self._names.items():
            with contextlib.suppress(ReferenceError):  # it is gone
                data.name = name
        for scene, name in self._aside.items():
            scene[STAGE_MARK] = name


def _is_render_result(data):
    return isinstance(data, bpy.types.Image) and data.type == "RENDER_RESULT"

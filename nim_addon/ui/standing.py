# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands in the view beside what the settings say now."""

from __future__ import annotations

import contextlib
import dataclasses
import json

import bpy
from bpy.app.handlers import persistent

from ..cycles.material import resolve
from ..scenes import SCENES
from ..scenes import stage as stages
from . import built
from .looks import Looks
from .scene_settings import FOLLOWERS, NIM_PG_scenes, backend_of, label_of, parameters_of

BACKEND = "Backend"
SETTLED = 0.3  # seconds without a redraw before a change is looked at


def built_of(settings: NIM_PG_scenes) -> dict[str, str]:
    """What Build would build of, as text, by names of parameters; ValueError, one sentence, where settings clash."""
    plain, backend = parameters_of(settings).plain(), backend_of(settings)
    # one that this Blender lacks is refused where it is built
    backend = resolve(backend) if backend == "auto" else backend
    return {name: json.dumps(value) for name, value in plain.items()} | {BACKEND: backend}


def is_standing(scene: bpy.types.Scene) -> bool:
    """Whether a scene is the one that its settings have chosen, and remembers what it was built of."""
    return built.BUILT in scene and scene.get(stages.STAGE_MARK) == scene.nim_scenes.scene


def changed(scene: bpy.types.Scene) -> list[str]:
    """The labels of the settings that a scene which is_standing() was not built of.

    Raises ValueError, one sentence, where the settings clash.
    """
    settings = scene.nim_scenes
    was, now = built.remembered(scene), built_of(settings)
    labels = {field.name: label_of(field) for field in dataclasses.fields(SCENES[settings.scene].parameters)}
    return [labels.get(name, name) for name in now if was.get(name) != now[name]]


class Standing:
    """What drawing needs to know of a scene that is_standing(): changed(), and built.holds(), of it."""

    def __init__(self, scene: bpy.types.Scene):
        self.changed, self.holds = [], False
        if is_standing(scene):
            self.holds = built.holds(scene)
            with contextlib.suppress(ValueError):  # settings that clash, which the panel says
                self.changed = changed(scene)


LOOKS = Looks(Standing, lambda: bpy.context.mode == "OBJECT", SETTLED)


def note_setting(scene: bpy.types.Scene) -> None:
    """Called after a change of a scene's settings."""
    LOOKS.outdate(scene)


@persistent
def note_change(scene: bpy.types.Scene, *_) -> None:
    """Called by Blender after a change."""
    LOOKS.outdate(scene)


@persistent
def forget(*_) -> None:
    """Forget what is known: another file, or another state of this one."""
    LOOKS.forget()


HANDLERS = (
    ("depsgraph_update_post", note_change),
    ("undo_post", forget),
    ("redo_post", forget),
    ("load_post", forget),
)


def register():
    """Follow the settings."""
    FOLLOWERS.append(note_setting)


def unregister():
    """Follow them no more, and forget what is known."""
    FOLLOWERS.remove(note_setting)
    forget()

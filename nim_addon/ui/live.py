# SPDX-License-Identifier: GPL-3.0-or-later
"""Live: what stands in the view is built anew while its settings are changed, as long as nothing of a person's is in the way.

It builds from a timer, where Blender neither draws nor evaluates, and pushes no step of its own onto the undo stack: the one
that Blender pushes for the setting brings the former settings back, and the scene that was built of them.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import bpy
from bpy.app.handlers import persistent

from . import built, caustics_bake, deferred, scenes, standing
from .scene_settings import FOLLOWERS

SHORTEST = 0.1  # seconds between two builds; else as long as the last one took, so that a slider still moves
RETRY = 0.3  # seconds, where Blender is busy
_took = 0.0


def is_on() -> bool:
    """Whether Live is on."""
    return bpy.context.window_manager.nim_live


def follow(scene: bpy.types.Scene) -> None:
    """Called after a change of a scene's settings: build it soon, if it is the one that a window shows."""
    if standing.is_standing(scene) and not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=max(SHORTEST, _took))


@persistent
def follow_undo(*_) -> None:
    """Called by Blender after undo and redo: what stands may be older than the settings."""
    if is_on():
        for window in bpy.context.window_manager.windows:
            follow(window.scene)


def busy() -> bool:
    """Whether Blender is at something that a new scene would break."""
    manager = bpy.context.window_manager
    if any(bpy.app.is_job_running(job) for job in ("RENDER", "RENDER_PREVIEW", "OBJECT_BAKE")):
        return True
    if caustics_bake.under_way() or any(window.screen.is_animation_playing for window in manager.windows):
        return True
    active = [window.view_layer.objects.active for window in manager.windows]
    return any(obj is not None and obj.mode != "OBJECT" for obj in active)


def tick() -> float | None:
    """Build what is shown anew where its settings have changed; a timer, which asks to be called again while that must wait."""
    global _took
    if not is_on():
        return None
    shown = dict.fromkeys(window.scene for window in bpy.context.window_manager.windows)
    for scene in shown:
        if not standing.is_standing(scene):
            continue
        try:
            if not standing.changed(scene):
                continue
            if busy():
                return RETRY
            if built.holds(scene):
                continue
            started = time.monotonic()
            deferred.writing(rebuild, scene)
            _took = time.monotonic() - started
        except (ValueError, RuntimeError):
            continue  # settings that clash, which the panel says
    return None


def rebuild(scene: bpy.types.Scene) -> None:
    """Build a scene that is shown anew of its settings: what is selected, what views look through, and its size stay.

    Raises ValueError or RuntimeError, one sentence, as the scene's build() does.
    """
    samples, percent = scene.cycles.samples, scene.render.resolution_percentage
    with _selection(scene), _views(scene):
        scenes.build(scene.nim_scenes)
    scene.cycles.samples, scene.render.resolution_percentage = samples, percent
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()


@contextlib.contextmanager
def _selection(scene) -> Iterator[None]:
    """What is selected, by its name, is so afterwards in each view layer."""
    layers = [
        (layer.name, getattr(layer.objects.active, "name", ""), {obj.name for obj in layer.objects.selected})
        for layer in scene.view_layers
    ]
    try:
        yield
    finally:
        for name, active, selected in layers:
            layer = scene.view_layers[name]
            layer.update()  # from Blender 5.0 on it has None in the place of an object that is removed until then
            for obj in layer.objects:
                if obj.name in selected:
                    obj.select_set(True, view_layer=layer)
            if active in layer.objects:  # a name that is empty is of none
                layer.objects.active = layer.objects[active]


@contextlib.contextmanager
def _views(scene) -> Iterator[None]:
    """Views that look through the camera do so afterwards: with the old one gone Blender lets go of it."""
    views = [
        area.spaces.active
        for window in bpy.context.window_manager.windows
        if window.scene == scene
        for area in window.screen.areas
        if area.type == "VIEW_3D" and area.spaces.active.region_3d.view_perspective == "CAMERA"
    ]
    try:
        yield
    finally:
        for view in views:
            if view.use_local_camera and view.camera is None:
                view.use_local_camera = False
            view.region_3d.view_perspective = "CAMERA"


def _switched(self, context):
    if self.nim_live and follow not in FOLLOWERS:
        FOLLOWERS.append(follow)
        follow_undo()
    elif not self.nim_live:
        _stop()


def _stop():
    if follow in FOLLOWERS:
        FOLLOWERS.remove(follow)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)


@persistent
def switch_off(*_) -> None:
    """Called by Blender after another file was opened."""
    bpy.context.window_manager.nim_live = False


HANDLERS = (
    ("undo_post", follow_undo),
    ("redo_post", follow_undo),
    ("load_post", switch_off),
)


def register():
    """Let Live be switched on."""
    bpy.types.WindowManager.nim_live = bpy.props.BoolProperty(
        name="Live",
        description="Build the scene in the view anew while a setting is changed. It waits where something was changed by "
        "hand, or caustics are baked",
        update=_switched,
    )


def unregister():
    """Switch it off."""
    _stop()
    del bpy.types.WindowManager.nim_live

# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of a scene in all wavelengths: those whose nodes tell the time drift by a hair, and the others stand still."""

from __future__ import annotations

import math
from collections.abc import Iterable

import bpy
import mathutils

from .animation import curves_of
from .closures.shutter import DRIFT, DRIFTS, REST
from .visibility import as_rendered

FORMER = "nim_spectral_former"  # of an object that drifts: the axis of its delta location that does, and what that was
HELD = "nim_spectral_held"  # of an object: it had motion blur, and has none as long as its scene is spectral
# Of a frame: as little as Blender takes, since whatever moves is seen in another place by each colour.
SHUTTER_TIME = 0.01


def hold(obj: bpy.types.Object) -> None:
    """Let an object stand still while the shutter is open, if it is not linked from another file.

    What moves would be seen in another place by each colour. And what could move is made anew for every render, which for
    the spheres of our scenes takes ten times as long as 64 samples of 64 x 64 pixels.
    """
    release(obj)
    if obj.cycles.use_motion_blur and not obj.library:
        obj.cycles.use_motion_blur = False
        obj[HELD] = True


def let_drift(scene: bpy.types.Scene, objects: Iterable[bpy.types.Object]) -> None:
    """Let objects of a scene drift by DRIFT metres while the shutter is open, so that nodes can tell the time.

    They stand DRIFT metres off where they did, for as long: Blender 5 does not see the drift of what begins it at 0.
    """
    objects = [obj for obj in objects if not (is_at_rest(obj) or obj.library)]
    for obj in objects:
        release(obj)
        axis = _free_axis(obj)
        if axis is None:
            continue
        way = mathutils.Vector.Fill(3)
        way[axis] = 1
        if obj.parent:
            way = (obj.parent.matrix_world @ obj.matrix_parent_inverse).to_3x3() @ way
        step = DRIFT / (way.length or math.inf)
        obj[DRIFTS], obj[FORMER] = 1.0, [axis, obj.delta_location[axis]]
        driver = obj.driver_add("delta_location", axis).driver
        start = obj.delta_location[axis] + step
        driver.expression = f"(frame - floor(frame)) * {step / SHUTTER_TIME:.9g} + {start:.9g}"
    objects = [obj for obj in objects if DRIFTS in obj]
    if objects:
        with as_rendered(scene) as depsgraph:
            for obj in objects:
                obj[REST] = list(obj.evaluated_get(depsgraph).matrix_world.translation)


def _free_axis(obj) -> int | None:
    """An axis of an object's delta location that no keyframe and no driver moves; None where each has one."""
    drivers = obj.animation_data.drivers if obj.animation_data else ()
    moved = {curve.array_index for curve in drivers if curve.data_path == "delta_location"}
    moved |= {curve.array_index for curve, _ in curves_of(obj) if curve.data_path == "delta_location"}
    return next((axis for axis in (2, 1, 0) if axis not in moved), None)


def lamps_drift() -> bool:
    """Whether the nodes of a lamp see that it drifts: before Blender 4.5 they are told one place at all times."""
    return bpy.app.version >= (4, 5)


def is_at_rest(obj: bpy.types.Object) -> bool:
    """Whether an object drifts, and stands where it did when it was let."""
    return REST in obj and (obj.matrix_world.translation - mathutils.Vector(obj[REST])).length < DRIFT / 4


def drifts(scene: bpy.types.Scene) -> bool:
    """Whether any object of a scene drifts, since materials tell the wavelength by nodes."""
    return any(DRIFTS in obj for obj in scene.objects)


def release(obj: bpy.types.Object) -> None:
    """Take back hold() and let_drift() of an object."""
    if HELD in obj:
        obj.cycles.use_motion_blur = True
        del obj[HELD]
    if DRIFTS in obj:
        axis, former = obj[FORMER]
        obj.driver_remove("delta_location", int(axis))
        obj.delta_location[int(axis)] = former
        for name in (REST, DRIFTS, FORMER):
            obj.pop(name, None)

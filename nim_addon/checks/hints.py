# SPDX-License-Identifier: GPL-3.0-or-later
"""What helps a picture though nothing in it is wrong: said in the panel, and never by a render."""

from __future__ import annotations

import math

import mathutils

from ..caustics import baking, lights, placing
from ..cycles.problem import Problem
from ..cycles.visibility import PATHS_MARK
from .sight import Sight

MOST = 3  # names in a sentence

TEXT = "The shadow of {names} stays black until caustics are baked: what shines is too narrow to be found by chance ({lamps})."


def _chance(angle):
    """The part of the paths from a surface that meet what is that wide, radians, above it."""
    return math.sin(min(angle, math.pi) / 2) ** 2


# Of one as wide as the sun that a render traces without being asked: one of 128 samples a pixel finds it.
NARROW = _chance(baking.NARROW)


def hints(sight: Sight) -> list[Problem]:
    """What would help, as Problems without a remedy of their own: code "caustics", where baking these does."""
    if placing.baked(sight.scene) is not None:
        return []
    places = {}
    for shown in sight.wearers():
        corners = [shown.matrix @ mathutils.Vector(corner) for corner in shown.original.bound_box]
        middle = sum(corners, mathutils.Vector()) / len(corners)
        places[shown.original.name] = middle, max((corner - middle).length for corner in corners)
    # else there is nothing that a shadow falls on
    if all(shown.original.name in places or shown.original.get(PATHS_MARK) for shown in sight.shown):
        return []
    lit = {}
    for lamp in sight.lamps:
        names = [name for name, place in places.items() if _is_narrow(lamp, *place)]
        if names:
            lit[lamp.name] = names
    sun = lights.sun_of(sight.scene)
    if sun is not None and _chance(sun.angle) < NARROW and places:
        lit[sight.scene.world.name] = list(places)
    if not lit:
        return []
    names = dict.fromkeys(name for those in lit.values() for name in those)
    return [Problem("caustics", (TEXT,), {"lamps": _list(lit), "names": _list(names)}, None, tuple(names))]


def _list(names):
    names = list(names)
    return ", ".join(names[:MOST]) + ("..." if len(names) > MOST else "")


def _is_narrow(lamp, middle, radius):
    """Whether a lamp that shines on what is there is hardly ever found by chance; one of no size is a Problem anyway."""
    light = lamp.data
    if light.energy <= 0 or light.cycles.is_portal:
        return False
    if light.type == "SUN":
        return 0 < _chance(light.angle) < NARROW
    matrix = lamp.matrix_world
    away = middle - matrix.translation
    distance = max(away.length - radius, 1e-6)
    if light.type == "AREA":
        width, height, _ = matrix.to_scale()
        square = light.shape in ("SQUARE", "DISK")
        size = light.size * width * (light.size if square else light.size_y) * height
        return 0 < size / (math.pi * distance**2) < NARROW
    if light.type == "SPOT":
        turned = away.angle(-(matrix.to_3x3() @ mathutils.Vector((0, 0, 1))), 0.0)
        if turned > light.spot_size / 2 + math.asin(min(radius / max(away.length, 1e-6), 1.0)):
            return False
    return 0 < (light.shadow_soft_size / distance) ** 2 < NARROW

# SPDX-License-Identifier: GPL-3.0-or-later
"""What there is for a body to bend, and whether anything shines: said in the panel where there is nothing, never by a render."""

from __future__ import annotations

import bpy

from ..cycles.problem import Problem
from ..cycles.visibility import CAUSTICS_MARK, PATHS_MARK, asked, has_nodes, value_of
from .sight import Sight

DIM = 0.2  # radiance of a sky in which things are hardly to be seen; Blender's own is 0.05
PLAIN = {"BACKGROUND", "VALUE", "RGB"}  # nodes of a sky that is the same all around
SHINING = {"EMISSION": "Strength", "BSDF_PRINCIPLED": "Emission Strength"}


def hints(sight: Sight) -> list[Problem]:
    """What a sky would help, as Problems without a remedy of their own: code "sky"."""
    radiance = _radiance(sight.scene.view_layers[0].world_override or sight.scene.world)
    ours = set(sight.ours)
    names = [surface.original.name for surface in sight.shown if ours.intersection(surface.materials)]
    # the copies that a bake puts in place of floors shine, and are there to be bent
    baked = any(obj.get(CAUSTICS_MARK) and obj.type == "MESH" for obj in sight.scene.objects)
    if radiance is None or not names or baked:
        return []
    others = [
        surface
        for surface in sight.shown
        if surface.original.name not in names and not surface.original.get(PATHS_MARK)
    ]
    if not others:
        text = "There is nothing to bend: {names} is alone in a world of one color."
    elif radiance < DIM and not any(map(_shines, sight.lamps)) and not any(map(_glows, _materials(others))):
        text = "Hardly anything shines in this scene: {names} stays in the dark."
    else:
        return []
    return [Problem("sky", (text,), {"names": names[0]}, None, tuple(dict.fromkeys(names)))]


def _radiance(world):
    """The brightest channel of a world that is the same all around; None of any other."""
    if world is None:
        return 0.0
    if not has_nodes(world):
        return max(world.color)
    nodes = asked(world)
    if {found.node.type for found in nodes} - PLAIN:
        return None
    background = next((found for found in nodes if found.node.type == "BACKGROUND"), None)
    if background is None:
        return 0.0
    color, strength = (_most(background.node.inputs[name], background.path) for name in ("Color", "Strength"))
    return None if color is None or strength is None else color * strength


def _most(socket, path):
    """The value of an input, the brightest channel of a colour, which may be linked to either; None where nodes decide it."""
    value = value_of(socket, path)
    return max(value[:3]) if isinstance(value, tuple) else value


def _shines(lamp: bpy.types.Object):
    return lamp.data.energy > 0 and not lamp.data.cycles.is_portal


def _materials(surfaces):
    return {material for surface in surfaces for material in surface.materials if material}


def _glows(material):
    sockets = [(node.inputs[SHINING[node.type]], path) for node, path in asked(material) if node.type in SHINING]
    return any(_most(socket, path) != 0 for socket, path in sockets)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the numbers of an interface: in its sockets, in what feeds them, and on the way of an animation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import bpy

from ..cycles.animation import curves_of
from ..cycles.material import asked_interfaces
from ..cycles.problem import LINKED, Problem
from ..cycles.visibility import asked, end_of, value_of
from ..physics.media import LEAST_MAGNITUDE, MOST_MAGNITUDE
from .sight import Sight

NUMBERS = ("Index Inside", "Permeability Inside", "Index Outside", "Permeability Outside")
# Of a Bump node, in pixels: beyond it, its normals may be those of no surface, and total reflection on them traps light.
WIDEST_FILTER, FILTER = 0.5, 0.1
# An animation is looked at on each of its frames, and on this many of them where it is longer.
FRAMES = 2000


class Setting(NamedTuple):
    """A number that an interface is given: the socket that holds it in the end, and its place in a colour or None."""

    material: bpy.types.Material
    name: str
    socket: bpy.types.NodeSocket
    place: int | None

    @property
    def value(self) -> float:
        """As it is on the frame that the file stands at."""
        return self.socket.default_value if self.place is None else self.socket.default_value[self.place]


def find(sight: Sight) -> list[Problem]:
    """The Problems of numbers, those of each material once."""
    found = {}
    for material in sight.worn:
        for setting in settings(material):
            problem = _wrong_tint(sight, setting) if setting.name == "Tint" else _wrong_number(sight, setting)
            if problem:
                found.setdefault((problem.code, material, setting.name), problem)
    return list(found.values())


def settings(material: bpy.types.Material) -> Iterator[Setting]:
    """The numbers that the interfaces of a material are given, where only Value and RGB nodes decide them."""
    for node, path in asked_interfaces(material):
        for name in (*NUMBERS, "Tint"):
            socket = node.inputs.get(name)
            end = end_of(socket, path)[0] if socket else None
            if end is None or (end.is_output and end.node.type not in ("VALUE", "RGB")):
                continue
            if not hasattr(end.default_value, "__len__"):
                yield Setting(material, name, end, None)
            elif name == "Tint":  # how much of a colour an index is, Cycles decides
                for place in range(3):
                    yield Setting(material, name, end, place)


def over_time(setting: Setting, scene: bpy.types.Scene) -> list[tuple[float | None, float]]:
    """(frame, value) of a Setting on the frames of a scene and at its keyframes; [(None, value)] if it stands still."""
    curve, first, last = _curve(setting, scene)
    if curve is None:
        return [(None, setting.value)]
    step = max(1, (last - first) // FRAMES)
    frames = {*range(first, last + 1, step), *(key.co.x for key in curve.keyframe_points if first <= key.co.x <= last)}
    return [(frame, curve.evaluate(frame)) for frame in sorted(frames)]


def _curve(setting, scene):
    """The bpy.types.FCurve that animates a Setting, or None, and the frames that it is seen on."""
    path, index = setting.socket.path_from_id("default_value"), setting.place or 0
    for curve, strip in curves_of(setting.socket.id_data):
        if curve.data_path == path and curve.array_index == index:
            start, end = scene.frame_start, scene.frame_end
            if strip:  # in its own time, which the strip moves
                start, end = math.floor(strip.action_frame_start), math.ceil(strip.action_frame_end)
            return curve, start, end
    return None, 0, 0


def _wrong_number(sight, setting):
    values = over_time(setting, sight.scene)
    where = {"material": setting.material.name, "socket": setting.name}
    for frame, value in values:
        if LEAST_MAGNITUDE <= abs(value) <= MOST_MAGNITUDE:  # which what is no number is not
            continue
        if abs(value) < LEAST_MAGNITUDE:
            text = "{material}: {socket} is {value}, which refracts nothing."
            if frame is not None:
                text = "{material}: {socket} is {value} on frame {frame}, which refracts nothing."
        else:
            text = "{material}: {socket} is {value}, which is out of range."
            if frame is not None:
                text = "{material}: {socket} is {value} on frame {frame}, which is out of range."
        return _about(setting, "number", text, None, value=f"{value:g}", frame=_frame(frame), **where)
    for (_, value), (frame, following) in itertools.pairwise(values):
        if value * following < 0 and "Index" in setting.name:
            text = "{material}: {socket} passes through 0 before frame {frame}, where nothing is refracted."
            return _about(setting, "number", text, None, frame=_frame(frame), **where)
    return None


def _wrong_tint(sight, setting):
    for frame, value in over_time(setting, sight.scene):
        if not 0 <= value <= 1:
            text = "{material}: the tint is {value}, but an interface passes between 0 and 1 of the light."
            if frame is not None:
                text = "{material}: on frame {frame} the tint is {value}, but it lies between 0 and 1."
            remedy = "Bring it into range" if frame is None else None
            where = {"material": setting.material.name, "value": f"{value:g}", "frame": _frame(frame)}
            return _about(setting, "tint", text, remedy, **where)
    return None


def bumps(sight: Sight) -> list[Problem]:
    """The Problems of bumps whose heights are taken so far apart that light is lost."""
    found = []
    for material in sight.worn:
        widths = [_filter_width(node, path) for node, path in asked(material) if node.type == "BUMP"]
        if any(width is not None and width > WIDEST_FILTER for width in widths):
            texts = (
                "{material} takes the heights of its bumps a whole pixel apart: small ones lose up to 8 % of the light.",
            )
            remedy = "Narrow the filter"
            if bpy.app.version < (4, 5):  # where it cannot be set
                texts, remedy = (*texts, "Render it larger, or in Blender 4.5 or later."), None
            elif material.library:
                texts, remedy = (*texts, LINKED), None
            found.append(Problem("bump_filter", texts, {"material": material.name}, remedy, (), (material.name,)))
    return found


def _filter_width(node, path):
    socket = node.inputs.get("Filter Width")
    return value_of(socket, path) if socket else 1.0


def _narrow(scene, problem):
    for name in problem.materials:
        for node, path in asked(bpy.data.materials[name, None]):
            if node.type == "BUMP" and (_filter_width(node, path) or 0) > WIDEST_FILTER:
                end_of(node.inputs["Filter Width"], path)[0].default_value = FILTER


def _frame(frame):
    return None if frame is None else f"{frame:g}"


def _about(setting, code, text, remedy, **values):
    linked = setting.socket.id_data.library
    texts = (text, LINKED) if linked else (text,)
    return Problem(code, texts, values, None if linked else remedy, materials=(setting.material.name,))


def _bring_into_range(scene, problem):
    for name in problem.materials:
        for setting in settings(bpy.data.materials[name, None]):
            if setting.name == "Tint" and not 0 <= setting.value <= 1:
                value = 1.0 if math.isnan(setting.value) else min(1.0, max(0.0, setting.value))
                if setting.place is None:
                    setting.socket.default_value = value
                else:
                    setting.socket.default_value[setting.place] = value


MENDS = {"tint": _bring_into_range, "bump_filter": _narrow}

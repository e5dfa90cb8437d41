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

SIDES = ("Inside", "Outside")
IMAGINARY = {"Index": "Extinction", "Permeability": "Permeability Loss"}  # of a quantity, by its socket
NUMBERS = ("Index Inside", "Permeability Inside", "Index Outside", "Permeability Outside")
# What has a least and a most value, to which a button may bring it.
MOST_ABSORPTION = 1e12  # per metre; that of a metal is 1e8
RANGES = {
    **{f"{loss} {side}": (0.0, MOST_MAGNITUDE) for loss in ("Extinction", "Permeability Loss") for side in SIDES},
    **{f"Absorption {side}": (0.0, MOST_ABSORPTION) for side in SIDES},
    "Roughness": (0.0, 1.0),
    "Tint": (0.0, 1.0),
}
# Of a Bump node, in pixels: beyond it, its normals may be those of no surface, and total reflection on them traps light.
WIDEST_FILTER, FILTER = 0.5, 0.1
# An animation is looked at on each of its frames, and on this many of them where it is longer.
FRAMES = 2000


class Setting(NamedTuple):
    """A number that an interface is given: the socket that holds it in the end, and its place in a colour or None.

    lossy: of an index or a permeability, whether it has an imaginary part too, which carries no wave where it is alone
    """

    material: bpy.types.Material
    name: str
    socket: bpy.types.NodeSocket
    place: int | None
    lossy: bool = False

    @property
    def value(self) -> float:
        """As it is on the frame that the file stands at."""
        return self.socket.default_value if self.place is None else self.socket.default_value[self.place]


def find(sight: Sight) -> list[Problem]:
    """The Problems of numbers, those of each material once."""
    found = {}
    for material in sight.worn:
        for setting in settings(material):
            problem = _out_of_range(sight, setting) if setting.name in RANGES else _wrong_number(sight, setting)
            if problem:
                found.setdefault((problem.code, material, setting.name), problem)
    return list(found.values())


def settings(material: bpy.types.Material) -> Iterator[Setting]:
    """The numbers that the interfaces of a material are given, where only Value and RGB nodes decide them."""
    for node, path in asked_interfaces(material):
        for name in (*NUMBERS, *RANGES):
            socket = node.inputs.get(name)
            end = end_of(socket, path)[0] if socket else None
            if end is None or (end.is_output and end.node.type not in ("VALUE", "RGB")):
                continue
            if not hasattr(end.default_value, "__len__"):
                yield Setting(material, name, end, None, _is_lossy(node, path, name))
            elif name == "Tint":  # how much of a colour an index is, Cycles decides
                for place in range(3):
                    yield Setting(material, name, end, place)


def _is_lossy(node, path, name):
    """Whether the imaginary part of an index or a permeability of that name is, or may be, another number than 0."""
    quantity, _, side = name.rpartition(" ")
    socket = node.inputs.get(f"{IMAGINARY[quantity]} {side}") if quantity in IMAGINARY else None
    return socket is not None and value_of(socket, path) != 0.0


def over_time(setting: Setting, scene: bpy.types.Scene) -> list[tuple[float | None, float]]:
    """(frame, value) of a Setting on the frames of a scene and at its keyframes; [(None, value)] if it stands still."""
    curve, strip = _curve(setting)
    if curve is None:
        return [(None, setting.value)]
    first, last = scene.frame_start, scene.frame_end
    if strip:  # in its own time, which the strip moves
        first, last = math.floor(strip.action_frame_start), math.ceil(strip.action_frame_end)
    step = max(1, (last - first) // FRAMES)
    frames = {*range(first, last + 1, step), *(key.co.x for key in curve.keyframe_points if first <= key.co.x <= last)}
    return [(_in_scene(frame, strip), curve.evaluate(frame)) for frame in sorted(frames)]


def _in_scene(frame, strip):
    """The frame of the scene at which a strip, or None, first comes to a frame of its action."""
    return frame if strip is None else strip.frame_start + (frame - strip.action_frame_start) * strip.scale


def _curve(setting):
    """The bpy.types.FCurve that animates a Setting, with its NLA strip or None; (None, None) where none does."""
    path, index = setting.socket.path_from_id("default_value"), setting.place or 0
    for curve, strip in curves_of(setting.socket.id_data):
        if curve.data_path == path and curve.array_index == index:
            return curve, strip
    return None, None


def _wrong_number(sight, setting):
    values = over_time(setting, sight.scene)
    where = {"material": setting.material.name, "socket": setting.name}
    for frame, value in values:
        least = 0.0 if setting.lossy else LEAST_MAGNITUDE
        if least <= abs(value) <= MOST_MAGNITUDE:  # which what is no number is not
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
        if value * following < 0 and "Index" in setting.name and not setting.lossy:
            text = "{material}: {socket} passes through 0 before frame {frame}, where nothing is refracted."
            return _about(setting, "number", text, None, frame=_frame(frame), **where)
    return None


def _out_of_range(sight, setting):
    low, high = RANGES[setting.name]
    for frame, value in over_time(setting, sight.scene):
        if not low <= value <= high:
            if setting.name == "Tint":
                text = "{material}: the tint is {value}, but a surface passes between 0 and 1 of the light."
                if frame is not None:
                    text = "{material}: on frame {frame} the tint is {value}, but it lies between 0 and 1."
            else:
                text = "{material}: {socket} is {value}, but it lies between {low} and {high}."
                if frame is not None:
                    text = "{material}: {socket} is {value} on frame {frame}, but it lies between {low} and {high}."
            remedy = "Bring it into range" if frame is None else None
            where = {"material": setting.material.name, "socket": setting.name, "frame": _frame(frame)}
            where |= {"value": f"{value:g}", "low": f"{low:g}", "high": f"{high:g}"}
            return _about(setting, "tint" if setting.name == "Tint" else "range", text, remedy, **where)
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
            low, high = RANGES.get(setting.name, (-math.inf, math.inf))
            if setting.name in RANGES and not low <= setting.value <= high:
                # a tint that is no number takes nothing, and a loss that is none loses nothing
                none = high if setting.name == "Tint" else low
                value = none if math.isnan(setting.value) else min(high, max(low, setting.value))
                if setting.place is None:
                    setting.socket.default_value = value
                else:
                    setting.socket.default_value[setting.place] = value


MENDS = {"tint": _bring_into_range, "range": _bring_into_range, "bump_filter": _narrow}

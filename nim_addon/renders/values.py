# SPDX-License-Identifier: GPL-3.0-or-later
"""The values that a render is asked for with: what each may be, in Python and in a file that anybody may have written."""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Callable

from ..base.options import (
    BACKENDS,
    CAUSTICS,
    LARGEST_SIDE,
    LAST_FRAME,
    MOST_PASSES,
    MOST_PHOTONS,
    MOST_SAMPLES,
    MOST_SEED,
)
from ..physics import VISIBLE_NM
from ..physics.spectra import wavelengths
from ..scenes.stage import Pose

FITS = ("AUTO", "HORIZONTAL", "VERTICAL")  # as bpy.types.Camera.sensor_fit has them


def _whole(low: int, high: int) -> Callable:
    def check(name, value):
        if not _is_whole(value):
            raise ValueError(f"{name} {value!r} is not a whole number.")
        if not low <= value <= high:
            raise ValueError(f"{name} {value} is out of range; it lies between {low} and {high}.")
        return int(value)

    return check


def _is_whole(value):
    return isinstance(value, numbers.Integral) and not isinstance(value, bool)


def _size(name, value):
    if not isinstance(value, (list, tuple)) or len(value) != 2 or not all(map(_is_whole, value)):
        raise ValueError(f"{name} {value!r} is not a size; give two whole numbers, width and height in pixels.")
    if not all(1 <= side <= LARGEST_SIDE for side in value):
        width, height = value
        raise ValueError(
            f"{name} {width}x{height} is out of range; each side lies between 1 and {LARGEST_SIDE} pixels."
        )
    return int(value[0]), int(value[1])


def _switch(name, value):
    if not isinstance(value, bool):
        raise ValueError(f"{name} = {value!r} is neither True nor False.")
    return value


def _choice(choices: tuple) -> Callable:
    def check(name, value):
        if value not in choices:
            raise ValueError(f"there is no {name} {value!r}; the ones that exist are {', '.join(choices)}.")
        return value

    return check


def _passes(name, value):
    value = _whole(1, MOST_PASSES)(name, value)
    if value & (value - 1):
        raise ValueError(f"{name} {value} is no power of two; give 1, 2, 4, 8 and so on, up to {MOST_PASSES}.")
    return value


def _wavelength(name, value):
    try:
        nm = float(wavelengths(_finite(value)))
    except (TypeError, OverflowError):
        raise ValueError(f"{name} {value!r} is not a number; give nanometres, such as 550.") from None
    low, high = VISIBLE_NM
    if not low <= nm <= high:
        raise ValueError(f"{name} {nm:g} is not visible; it lies between {low:g} and {high:g} nanometres.")
    return nm


def _text(name, value):
    if not isinstance(value, str):
        raise ValueError(f"{name} = {value!r} is not a text.")
    return value


def _point(value):
    x, y, z = map(_finite, value)
    return x, y, z


def _finite(value):
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise TypeError
    return float(value)


def _pose(name, value):
    try:
        eye, target, field_of_view, fit = value
        pose = Pose(_point(eye), _point(target), _finite(field_of_view), fit)
        if fit in FITS and 0 < pose.field_of_view < 180:
            return pose
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(
        f"{name} = {value!r} is no pose of a camera; give eye and target, three coordinates each, an angle of view below "
        f"180 degrees, and one of {', '.join(FITS)}."
    )


def _inputs(name, value):
    if not isinstance(value, (dict, list, tuple)) or not value:
        raise ValueError(f"{name} = {value!r} is no table; give numbers by MATERIAL:INPUT.")
    try:
        found = {str(key): _finite(number) for key, number in (value.items() if isinstance(value, dict) else value)}
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} has what is no number; give numbers by MATERIAL:INPUT.") from None
    if wrong := next((key for key in found if not all(key.partition(":"))), None):
        raise ValueError(
            f"{name}: {wrong!r} names no input of a material; write MATERIAL:INPUT, such as NIM:Index Inside."
        )
    return tuple(sorted(found.items()))


# What each value of a request must be: a function of its name and of it that returns it, or raises ValueError.
CHECKS: dict[str, Callable] = {
    "size": _size,
    "samples": _whole(1, MOST_SAMPLES),
    "seed": _whole(0, MOST_SEED),
    "denoise": _switch,
    "backend": _choice(BACKENDS),
    "caustics": _choice(CAUSTICS),
    "photons": _whole(1, MOST_PHOTONS),
    "texels": _whole(1, LARGEST_SIDE),
    "frame": _whole(0, LAST_FRAME),
    "keep_noise": _switch,
    "spectral": _switch,
    "spectral_passes": _passes,
    "wavelength": _wavelength,
    "pose": _pose,
    "inputs": _inputs,
    "change": _text,
    "code": _text,
}


def _version(name, value):
    if not version_numbers(value):
        raise ValueError(f"{name} = {value!r} is no version.")
    return value


def _table(name, value):
    if not isinstance(value, dict):
        raise ValueError(f"{name} = {value!r} is no table.")
    return value


def version_numbers(text: object) -> tuple[int, ...]:
    """A version of nimray as numbers to compare; () for what is none that we made."""
    if not isinstance(text, str) or not re.fullmatch(r"\d{1,4}(\.\d{1,4})*", text):
        return ()
    return tuple(map(int, text.split(".")))


# The same for a record: which scene it is, and with what parameters, they say themselves.
RECORDED: dict[str, Callable] = {
    "nimray": _version,
    "scene": _text,
    "parameters": _table,
    "blend": _table,
    "blender": _text,
    **CHECKS,
}

# SPDX-License-Identifier: GPL-3.0-or-later
"""What the media of an interface mean, in the user's language: the numbers of it, and what it does to light."""

import functools
import math

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface

from ..physics import Interface
from . import curve
from .media import number


@functools.lru_cache(maxsize=64)
def _readings(interface, _locale):
    back = interface.reversed()
    say = pgettext_iface
    lines = [(say("Bends backwards"), say("yes") if interface.bends_backwards else say("no"))]
    ratio = interface.inside.impedance / interface.outside.impedance
    lines.append((say("Impedance ratio Z_t / Z_i"), number(ratio)))
    R = float(interface.fresnel(1.0).R)
    lines.append((say("R at normal incidence"), f"{100 * R:.3g} %" if R > 1e-12 else "0 %"))
    lines.append((say("Critical angle"), _both_sides(interface.critical_angle(), back.critical_angle())))
    for polarization, label in (("p", "Brewster angle, p"), ("s", "Brewster angle, s")):
        angles = interface.brewster_angle(polarization), back.brewster_angle(polarization)
        if polarization == "p" or angles != (None, None):
            lines.append((say(label), _both_sides(*angles)))
    return tuple(lines)


def _both_sides(outside, inside):
    """An angle, in radians or None, seen from outside and from inside."""
    say = pgettext_iface
    parts = []
    if outside is not None:
        parts.append(say("{angle} from outside").format(angle=f"{math.degrees(outside):.1f}°"))
    if inside is not None:
        parts.append(say("{angle} from inside").format(angle=f"{math.degrees(inside):.1f}°"))
    return ", ".join(parts) or say("none")


def readings(interface: Interface) -> tuple[tuple[str, str], ...]:
    """What a physics.Interface means: pairs (label, value) of text, in the user's language, made once for each."""
    return _readings(interface, bpy.app.translations.locale)


@functools.lru_cache(maxsize=64)
def _summary(interface, _locale):
    say = pgettext_iface
    if interface.bends_backwards:
        bend = say("Light bends backwards here: n has another sign on the other side.")
    elif interface.inside.n == interface.outside.n:
        bend = say("Light goes straight on: n is the same on both sides.")
    else:
        bend = say("Light bends the usual way: n has the same sign on both sides.")
    if max(interface.fresnel(np.cos(curve.ANGLES[:-1:20])).R) < 1e-12:
        return bend, say("Nothing is reflected at any angle.")
    if interface.critical_angle() is not None:
        return bend, say("From {angle} on, all light from outside is reflected.").format(
            angle=f"{math.degrees(interface.critical_angle()):.1f}°"
        )
    if interface.reversed().critical_angle() is not None:
        return bend, say("From {angle} on, all light from inside is reflected.").format(
            angle=f"{math.degrees(interface.reversed().critical_angle()):.1f}°"
        )
    return bend, say("No angle reflects all light.")


def summary(interface: Interface) -> tuple[str, str]:
    """What a physics.Interface does to light, in two sentences."""
    return _summary(interface, bpy.app.translations.locale)

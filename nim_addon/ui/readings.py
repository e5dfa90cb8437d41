# SPDX-License-Identifier: GPL-3.0-or-later
"""What the media of an interface mean, in the user's language: the numbers of it, and what it does to light."""

import functools
import math

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface

from ..physics import REPRESENTATIVE_NM, Interface
from ..physics.media import OPAQUE, TRANSPARENT
from . import curve
from .media import number


@functools.lru_cache(maxsize=64)
def _readings(interface, wavelength, _locale):
    there = interface.at(wavelength)
    back = there.reversed()
    say = pgettext_iface
    lines = list(_media(interface, there, wavelength))
    lines.append((say("Bends backwards"), say("yes") if there.bends_backwards else say("no")))
    ratio = complex(there.inside.impedance / there.outside.impedance)
    lines.append((say("Impedance ratio Z₂ / Z₁"), _complex(ratio)))
    lines.append((say("R at normal incidence"), percent(float(there.fresnel(1.0).R))))
    lines.append((say("Critical angle"), _both_sides(_critical(there), _critical(back))))
    for polarization, label in (("p", "Brewster angle, p"), ("s", "Brewster angle, s")):
        angles = there.brewster_angle(polarization), back.brewster_angle(polarization)
        if polarization == "p" or angles != (None, None):
            lines.append((say(label), _both_sides(*angles)))
    return tuple(lines)


def _media(interface, there, wavelength):
    """The numbers of the media that are no real ones, at a wavelength."""
    say = pgettext_iface
    at = f"{wavelength:g}"
    sides = (
        (interface.inside, there.inside, "Inside at {wavelength} nm"),
        (interface.outside, there.outside, "Outside at {wavelength} nm"),
    )
    for medium, numbers, label in sides:
        if medium.is_real:
            continue
        text = f"n = {number(numbers.n)}, k = {number(numbers.k)}"
        if numbers.permeability != math.copysign(1, numbers.n):
            text += f", μ = {_complex(numbers.permeability)}"
        yield say(label).format(wavelength=at), text
        if (length := numbers.absorption_length(wavelength)) < math.inf:
            yield say("Absorption length"), length_text(length)


def _complex(value):
    """A complex number as a person writes it; a real one where the imaginary part does not show."""
    value = complex(value)
    if abs(value.imag) < 5e-5 * abs(value):
        return number(value.real)
    return f"{number(value.real)} {'-' if value.imag < 0 else '+'} {number(abs(value.imag))} i"


def percent(share: float) -> str:
    """A share of the light as a person reads it; 0 where rounding alone is left."""
    return f"{100 * share:.3g} %" if share > 1e-12 else "0 %"


def length_text(metres: float) -> str:
    """A length with the unit in which its number is easy to read, from nanometres to kilometres."""
    for unit, size in (("km", 1e3), ("m", 1), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6)):
        if metres >= 0.9995 * size:
            return f"{metres / size:.3g} {unit}"
    return f"{metres / 1e-9:.3g} nm"


def _critical(interface):
    """The angle from which all light from outside is reflected; None where there is none, or what is not is absorbed."""
    media = interface.inside, interface.outside
    lossy = any(max(medium.k, medium.mu_imag) > TRANSPARENT for medium in media)
    return None if lossy else interface.critical_angle()


def _both_sides(outside, inside):
    """An angle, in radians or None, seen from outside and from inside."""
    say = pgettext_iface
    parts = []
    if outside is not None:
        parts.append(say("{angle} from outside").format(angle=_degrees(outside)))
    if inside is not None:
        parts.append(say("{angle} from inside").format(angle=_degrees(inside)))
    return ", ".join(parts) or say("none")


def readings(interface: Interface, wavelength: float = REPRESENTATIVE_NM) -> tuple[tuple[str, str], ...]:
    """What a physics.Interface means: pairs (label, value) of text, in the user's language, made once for each.

    wavelength: in vacuum, nanometres; ValueError where a medium is not known there
    """
    return _readings(interface, wavelength, bpy.app.translations.locale)


@functools.lru_cache(maxsize=64)
def _summary(interface, wavelength, _locale):
    say = pgettext_iface
    there = interface.at(wavelength)
    limits = tuple(say(limit.text).format(**limit.values) for limit in interface.limits_told(wavelength))
    if there.inside.is_single_negative or there.inside.k > OPAQUE:
        return limits  # no light goes on, so no ray is bent
    if there.bends_backwards:
        bend = say("Light bends backwards here: n has another sign on the other side.")
    elif there.inside.n == there.outside.n:
        bend = say("Light goes straight on: n is the same on both sides.")
    else:
        bend = say("Light bends the usual way: n has the same sign on both sides.")
    if max(there.fresnel(np.cos(curve.ANGLES[:-1:20])).R) < 1e-12:
        return bend, say("Nothing is reflected at any angle."), *limits
    outside, inside = _critical(there), _critical(there.reversed())
    if outside is not None:
        total = say("From {angle} on, all light from outside is reflected.").format(angle=_degrees(outside))
    elif inside is not None:
        total = say("From {angle} on, all light from inside is reflected.").format(angle=_degrees(inside))
    elif limits:
        return bend, *limits
    else:
        total = say("No angle reflects all light.")
    return bend, total, *limits


def _degrees(radians):
    return f"{math.degrees(radians):.1f}°"


def summary(interface: Interface, wavelength: float = REPRESENTATIVE_NM) -> tuple[str, ...]:
    """What a physics.Interface does to light, in a few sentences; ValueError as readings()."""
    return _summary(interface, wavelength, bpy.app.translations.locale)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The curve of an interface, a probe on it, R, T and the transmitted ray at an angle that one drags, and the curve as CSV."""

import functools
import math
from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..physics import Interface
from ..physics.tables import HEAD, SPECTRAL_HEAD, as_csv, spectrum, table
from . import curve
from .help import fail
from .material_values import active_node, interface_shown, wavelength_of
from .panels import draw_sentence
from .readings import percent

# Of the angle of incidence, between rows of what is copied, degrees.
STEP = 1


class Probe(NamedTuple):
    """What light does that meets a surface at an angle: powers of Interface.fresnel(), and the signed angle behind it.

    theta_t: radians; NaN where no ray goes on
    """

    R_s: float
    R_p: float
    R: float
    T: float
    theta_t: float


def probe(interface: Interface, theta_i: float) -> Probe:
    """The Probe of an interface, of media at one wavelength, for light from outside at that angle, radians."""
    # the cosine of a right angle is no more than nearly 0
    cosine = 0.0 if theta_i >= math.pi / 2 - 1e-6 else math.cos(theta_i)
    return Probe(*map(float, interface.fresnel(cosine)), float(interface.theta_t(theta_i)))


def shown_of(scene: bpy.types.Scene, interface: Interface) -> curve.Shown:
    """What the picture shows of an interface, as a person has chosen it."""
    settings = scene.nim_curve
    over = settings.over == "WAVELENGTH" and _disperses(interface)
    from_inside = settings.side == "INSIDE"
    # the angle has few digits, so that what is the same for a person is one picture
    return curve.Shown(interface, wavelength_of(scene), over, round(settings.angle, 4), from_inside)


def _disperses(interface):
    return bool(interface.inside.dispersion or interface.outside.dispersion)


def draw_choices(layout: bpy.types.UILayout, scene: bpy.types.Scene, interface: Interface) -> None:
    """Draw what a person can choose of the curve, as far as the media leave a choice."""
    if _disperses(interface):
        layout.row().prop(scene.nim_curve, "over", expand=True)
    if not (interface.inside.is_real and interface.outside.is_real):
        layout.prop(scene.nim_curve, "wavelength")


def draw_probe(
    layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material, shown: curve.Shown
) -> None:
    """Draw the probe: the side and the angle to be chosen, and what happens there; and the button that copies the curve."""
    settings = context.scene.nim_curve
    column = layout.column(align=True)
    column.row(align=True).prop(settings, "side", expand=True)
    column.prop(settings, "angle", slider=True)
    lines = layout.column(align=True)
    for text in _told(shown, bpy.app.translations.locale):
        draw_sentence(lines, context, text)
    layout.operator("nim.copy_curve", icon="COPYDOWN").material = material.name_full


@functools.lru_cache(maxsize=64)
def _told(shown, _locale):
    """The lines of the probe."""
    say, there = pgettext_iface, shown.probed
    found = probe(there, shown.angle)
    lines = [
        f"R = {percent(found.R)}, T = {percent(found.T)}",
        f"Rₛ = {percent(found.R_s)}, Rₚ = {percent(found.R_p)}",
    ]
    if not math.isnan(found.theta_t):
        angle = f"{math.degrees(found.theta_t):.2f}°"
        if there.bends_backwards and shown.angle:
            lines.append(say("θ₂ = {angle}, bent backwards").format(angle=angle))
        else:
            lines.append(f"θ₂ = {angle}")
    elif there.is_complex:
        lines.append(say("No ray goes on: what is not reflected is absorbed."))
    else:
        lines.append(say("No ray goes on: all is reflected."))
    return tuple(lines)


class NIM_OT_copy_curve(bpy.types.Operator):
    """Put the curve on the clipboard as comma-separated values, with the columns of nimray fresnel"""

    bl_idname = "nim.copy_curve"
    bl_label = "Copy as CSV"
    bl_options = {"REGISTER"}

    material: bpy.props.StringProperty(name="Material", description="Name of the material", options={"HIDDEN"})

    def execute(self, context):
        """Copy, and say what."""
        material = next((known for known in bpy.data.materials if known.name_full == self.material), None)
        node = active_node(material)
        interface = interface_shown(node) if node else None
        if interface is None:
            text = pgettext_rpt("{name} is no NIM Interface material whose media are known")
            return fail(self, text.format(name=repr(self.material)))
        try:
            text = as_text(shown_of(context.scene, interface))
        except ValueError as error:  # a medium that is not known at that wavelength
            return fail(self, str(error))
        context.window_manager.clipboard = text
        rows = len(text.splitlines()) - 1
        self.report(
            {"INFO"}, pgettext_rpt("Copied: {columns}; rows: {rows}").format(columns=text.split("\n")[0], rows=rows)
        )
        return {"FINISHED"}


def as_text(shown: curve.Shown) -> str:
    """The curve as CSV: over the angle for light from the side that is probed, else over the wavelength.

    Raises ValueError where a medium is not known at the wavelength.
    """
    if not shown.by_wavelength:
        return as_csv(HEAD, table(shown.probed, STEP))
    nm = curve.spectrum(shown.interface)[0]
    # the table's n and k are of the inside; R at normal incidence is the same from both sides
    seen = shown.interface if shown.interface.inside.dispersion else shown.interface.reversed()
    return as_csv(SPECTRAL_HEAD, spectrum(seen, np.asarray(nm), 0.0))


CLASSES = (NIM_OT_copy_curve,)

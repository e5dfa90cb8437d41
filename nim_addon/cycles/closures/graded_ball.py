# SPDX-License-Identifier: GPL-3.0-or-later
"""A ball whose index depends on the radius alone: the same jump as osl/nim_graded_ball.osl in Blender's own nodes."""

from __future__ import annotations

from typing import NamedTuple

from .closure import Closure, Socket
from .formulas import Sheet, Value, choose, dot, length, maximum, normalize, sqrt

OUTWARDS, ONWARDS = 2e-6, 1e-5  # as in nim_graded_ball.osl

SWEEP = Socket(
    "sweep",
    "Sweep",
    "NodeSocketVector",
    (-1.0, 0.0, 1.0),
    None,
    None,
    "Cosine and sine of the angle between where a ray enters and where it leaves, and 1 where it does, 0 where it ends; those "
    "of the fish-eye, half a turn, where nothing is linked",
    hide_value=True,
)
RADIUS = Socket(
    "radius",
    "Radius",
    "NodeSocketFloat",
    1.0,
    0.0,
    1000.0,
    "Radius of the ball in the object's own space, around its origin",
)


class Entry(NamedTuple):
    """Where a ray meets the ideal sphere: its centre and radius in the world, sine and cosine of the angle of incidence.

    p, c: of a core, too, the sine and cosine of the angle at which a ray from within has left it
    f:    unit vector towards the point of the ray that is nearest to the centre; 0 of a ray through it
    d:    its direction; back: whether it meets the faces from within
    """

    centre: Value
    R: Value
    p: Value
    c: Value
    f: Value
    d: Value
    back: Value


def entry(sheet: Sheet, radius: Value, core: Value | None = None) -> Entry:
    """The nodes of where a ray meets the sphere of that radius, in the object's space, around the object's origin.

    core: radius of a core within, in parts of that radius
    """
    geometry = sheet.node("ShaderNodeNewGeometry", "I, P, which side")
    d, back = -geometry["Incoming"], geometry["Backfacing"]
    to_world = {"convert_from": "OBJECT", "convert_to": "WORLD"}
    centre = sheet.node("ShaderNodeVectorTransform", "centre", {0: (0.0, 0.0, 0.0)}, vector_type="POINT", **to_world)
    across = sheet.node("ShaderNodeVectorTransform", "scale", {0: (1.0, 0.0, 0.0)}, vector_type="VECTOR", **to_world)
    R = radius * length(across)
    from_centre = geometry["Position"] - centre
    F = from_centre - dot(from_centre, d) * d
    from_R = R if core is None else R * choose(back, core, 1.0)
    p = length(F) / from_R
    c = sqrt((1 - p) * (1 + p))
    f = normalize(F)
    sheet.name(locals())
    return Entry(centre, R, p, c, f, d, back)


def _twin(sheet: Sheet) -> None:
    """The formulas of nim_graded_ball.osl, in its words."""
    sheet.frame("Where the ray enters the ideal sphere: p = sin(theta_i), c = cos(theta_i)")
    (radius,) = sheet.inputs("radius")
    centre, R, p, c, f, d, back = entry(sheet, radius)

    sheet.frame("Turned by the sweep in the plane of incidence: x, where it leaves, and its direction", top=-560)
    (sweep,) = sheet.inputs("sweep")
    parts = sheet.node("ShaderNodeSeparateXYZ", "sweep", {0: sweep})
    flat = normalize(sheet.node("ShaderNodeCombineXYZ", "without the light", {"X": parts["X"], "Y": parts["Y"]}))
    turned = sheet.node("ShaderNodeSeparateXYZ", "cosine and sine", {0: flat})
    cosine, sine = turned["X"], turned["Y"]
    e1, e2 = p * f - c * d, c * f + p * d
    x, t = cosine * e1 + sine * e2, cosine * e2 - sine * e1
    leaving = c * x + p * t
    start = centre + R * ((1 + OUTWARDS) * x + ONWARDS * leaving)
    direction = normalize(leaving)
    goes_on = parts["Z"] > 0.5

    sheet.frame("From within, and beside the sphere, straight on", top=-1000)
    jump = sheet.node(
        "ShaderNodeBsdfRayPortal", "jumped", {"Color": goes_on, "Position": start, "Direction": direction}
    )
    straight = sheet.node("ShaderNodeBsdfTransparent", "straight on")
    passes = maximum(back, 1 - (p < 1))
    BSDF = choose(passes, straight, jump)
    sheet.name(locals())
    sheet.end(BSDF)


GRADED_BALL = Closure(
    shader="nim_graded_ball",
    label="NIM Graded Ball",
    sockets=(SWEEP, RADIUS),
    version=1,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
)

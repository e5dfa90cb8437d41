# SPDX-License-Identifier: GPL-3.0-or-later
"""A graded shell around a core: the same jumps as osl/nim_graded_core.osl in Blender's own nodes."""

from __future__ import annotations

from .closure import Closure, Socket
from .formulas import Sheet, choose, maximum, minimum, normalize, sqrt
from .graded_ball import ONWARDS, OUTWARDS, RADIUS, entry

BESIDE, STEEP = 1e-3, 0.995  # as in nim_graded_core.osl

SWEEP = Socket(
    "sweep",
    "Sweep",
    "NodeSocketVector",
    (1.0, 0.0, 1.0),
    None,
    None,
    "Cosine and sine of the angle by which a ray goes round, and 1 where it comes to the core, 0 where it leaves",
    hide_value=True,
)
CORE = Socket(
    "core",
    "Core",
    "NodeSocketFloat",
    0.5,
    0.0,
    1.0,
    "Radius of the core, a ball of its own in the middle, in parts of the radius",
)
CORE_INDEX = Socket(
    "core_index",
    "Core Index",
    "NodeSocketFloat",
    -4.0,
    -1000.0,
    1000.0,
    "Refractive index of the shell at the core; negative for a negative-index material",
)


def _twin(sheet: Sheet) -> None:
    """The formulas of nim_graded_core.osl, in its words."""
    sheet.frame("Where the ray comes from, the rim or the core: s = sin, c = cos of its angle to the radius there")
    radius, core, core_index = sheet.inputs("radius", "core", "core_index")
    met = entry(sheet, radius, core)
    centre, R, f, d, leaving = met.centre, met.R, met.f, met.d, met.back
    s = minimum(met.p, 1)
    c = sqrt((1 - s) * (1 + s))
    side = 1 - 2 * leaving

    sheet.frame("Turned in its plane by the table's angle, onto the core or out at the rim", top=-560)
    (sweep,) = sheet.inputs("sweep")
    parts = sheet.node("ShaderNodeSeparateXYZ", "sweep", {0: sweep})
    flat = normalize(sheet.node("ShaderNodeCombineXYZ", "cosine and sine", {"X": parts["X"], "Y": parts["Y"]}))
    turned = sheet.node("ShaderNodeSeparateXYZ", "of length 1", {0: flat})
    cosine, sine = turned["X"], turned["Y"]
    sc = side * c
    e1, e2 = s * f - sc * d, sc * f + s * d
    x, t = cosine * e1 + sine * e2, cosine * e2 - sine * e1
    lands = parts["Z"] > 0.5
    ratio = core_index * core
    same = lands * leaving + (1 - lands) * (1 - leaving)
    other = choose(leaving, s * ratio, s / ratio)
    most = 1 - (1 - STEEP) * lands
    across = maximum(minimum(choose(same, s, other), most), -most)
    along = sqrt(maximum((1 - across) * (1 + across), 0))
    way = normalize(((1 - 2 * lands) * along) * x + across * t)
    start = choose(lands, core * x - ONWARDS * way, (1 + OUTWARDS) * x + ONWARDS * way)
    place = centre + R * start

    sheet.frame("What comes from elsewhere goes straight on", top=-1100)
    jump = sheet.node("ShaderNodeBsdfRayPortal", "jumped", {"Position": place, "Direction": way})
    straight = sheet.node("ShaderNodeBsdfTransparent", "straight on")
    passes = 1 - (met.p < 1 + BESIDE * leaving)
    BSDF = choose(passes, straight, jump)
    sheet.name(locals())
    sheet.end(BSDF)


GRADED_CORE = Closure(
    shader="nim_graded_core",
    label="NIM Graded Core",
    sockets=(SWEEP, RADIUS, CORE, CORE_INDEX),
    version=1,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
)

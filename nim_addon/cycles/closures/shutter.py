# SPDX-License-Identifier: GPL-3.0-or-later
"""A number of the path, the same wherever it goes: the time within the shutter, as osl/nim_shutter.osl has it.

No node of Blender's own tells the time, but one tells where an object is: one that drifts by a hair while the shutter is
open is where the time says. `spectral.set_up` lets objects drift.
"""

from __future__ import annotations

from .closure import Closure, Output
from .formulas import Sheet, maximum, minimum

# How far an object drifts while the shutter is open, metres: far enough for single precision some metres from the origin,
# and a small part of a pixel.
DRIFT = 2e-4
# Custom properties of an object that drifts: where it is when the shutter opens, and 1.
REST, DRIFTS = "nim_rest", "nim_drifts"


def _twin(sheet: Sheet) -> None:
    """The formulas of nim_shutter.osl; an object that has not moved, or has no place of rest, stands still."""
    sheet.frame("Time within the shutter: how far the object has drifted")
    place = sheet.node("ShaderNodeObjectInfo", "where the object is")
    rest = sheet.node("ShaderNodeAttribute", "where it is at rest", attribute_type="OBJECT", attribute_name=REST)
    drifts = sheet.node("ShaderNodeAttribute", "whether it drifts", attribute_type="OBJECT", attribute_name=DRIFTS)
    moved = sheet.node(
        "ShaderNodeVectorMath", "drift", {0: place["Location"], 1: rest["Vector"]}, operation="DISTANCE"
    )["Value"]
    time = moved * (1 / DRIFT)
    sheet.frame("Share u, which is uniform: time = (255 u + 0.5) 255 / 65536", top=-360)
    share = minimum(maximum(time * (65536 / 255 / 255) - 0.5 / 255, 0.0), 1.0)
    moves = drifts["Fac"] * (time > 1e-3)
    still = 1 - moves
    sheet.name(locals())
    sheet.end(share, still)


SHUTTER = Closure(
    shader="nim_shutter",
    label="NIM Shutter",
    sockets=(),
    version=1,
    twin=_twin,
    heart="OBJECT_INFO",
    outputs=(Output("share", "Share", "NodeSocketFloat"), Output("still", "Still", "NodeSocketFloat")),
)

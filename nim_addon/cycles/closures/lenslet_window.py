# SPDX-License-Identifier: GPL-3.0-or-later
"""A window of confocal lenslets: the same law as osl/nim_lenslet_window.osl in Blender's own nodes."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from .closure import Closure, Socket
from .formulas import Sheet, Value, choose, cross, dot, maximum, minimum, normalize

GRAZING = 1e-6  # as in nim_lenslet_window.osl
FLOAT = "NodeSocketFloat"

SOCKETS = (
    Socket(
        "eta_u",
        "Eta U",
        FLOAT,
        -1.0,
        -100.0,
        100.0,
        "-f2 / f1 along u, in the place of n2 / n1: tangents of angles are divided by it from the front; never 0",
    ),
    Socket(
        "eta_v", "Eta V", FLOAT, -1.0, -100.0, 100.0, "-f2 / f1 along v, a quarter turn from u in the window; never 0"
    ),
    Socket(
        "offset_u",
        "Offset U",
        FLOAT,
        0.0,
        -100.0,
        100.0,
        "How far each lens behind stands aside of the one in front along u, in focal lengths of the latter",
    ),
    Socket(
        "offset_v",
        "Offset V",
        FLOAT,
        0.0,
        -100.0,
        100.0,
        "How far each lens behind stands aside of the one in front along v, in focal lengths of the latter",
    ),
    Socket(
        "aperture",
        "Aperture",
        FLOAT,
        0.5,
        0.0,
        1000.0,
        "Width of a lens, in focal lengths of the one in front; it counts as far as Losses do",
    ),
    Socket(
        "losses",
        "Losses",
        FLOAT,
        0.0,
        0.0,
        1.0,
        "1: light that misses the second lens is lost; 0: lenslets are ideal, and lose nothing",
    ),
    Socket(
        "tint",
        "Tint",
        "NodeSocketColor",
        (1.0, 1.0, 1.0, 1.0),
        None,
        None,
        "Factor on all light that passes; white loses nothing",
    ),
)


class Optics(NamedTuple):
    """What others may change in a group of the window in nodes: `portal`, the node of the closure that bends light."""

    portal: bpy.types.Node


def _twin(sheet: Sheet) -> Optics:
    """The formulas of nim_lenslet_window.osl, in its words."""
    axes = sheet.frame("Axes in the window: u, the object's x axis or y axis, and v = n x u")
    geometry = sheet.node("ShaderNodeNewGeometry", "I, Ng, which side")
    I, Ng, from_behind = geometry["Incoming"], geometry["True Normal"], geometry["Backfacing"]  # noqa: E741
    n = (1 - 2 * from_behind) * Ng
    to_world = {"vector_type": "VECTOR", "convert_from": "OBJECT", "convert_to": "WORLD"}
    x = sheet.node("ShaderNodeVectorTransform", "x axis", {0: (1.0, 0.0, 0.0)}, **to_world)
    y = sheet.node("ShaderNodeVectorTransform", "y axis", {0: (0.0, 1.0, 0.0)}, **to_world)
    along = dot(x, n)
    looks_along_x = along * along > (1 - 1e-6) * dot(x, x)
    axis = choose(looks_along_x, y, x)
    u_axis = normalize(axis - dot(axis, n) * n)
    v_axis = cross(n, u_axis)

    law = sheet.frame("Slopes w, and what becomes of them: (w - offset) / eta, from behind eta w - offset", after=axes)
    eta_u, eta_v, offset_u, offset_v = sheet.inputs("eta_u", "eta_v", "offset_u", "offset_v")
    c = maximum(dot(I, Ng), GRAZING)
    w_u, w_v = -dot(I, u_axis) / c, -dot(I, v_axis) / c
    t_u = choose(from_behind, eta_u * w_u - offset_u, (w_u - offset_u) / eta_u)
    t_v = choose(from_behind, eta_v * w_v - offset_v, (w_v - offset_v) / eta_v)
    d = normalize(t_u * u_axis + t_v * v_axis - Ng)

    sheet.frame(
        "What passes lenslets of a width: of the image of the first, what meets the second", after=law, top=-560
    )
    (aperture,) = sheet.inputs("aperture")

    def passed(w: Value, eta: Value, offset: Value) -> Value:
        in_front = choose(from_behind, offset - eta * w, w)
        middle = abs((1 - eta) * in_front - offset)
        image = abs(eta) * aperture
        overlap = minimum(maximum(0.5 * (aperture + image) - middle, 0.0), minimum(aperture, image))
        return overlap / choose(from_behind, aperture, image)  # 0 where both are

    share_u, share_v = passed(w_u, eta_u, offset_u), passed(w_v, eta_v, offset_v)
    share = share_u * share_v

    sheet.frame("The ray goes on along d; nothing where eta is 0", after=law)
    losses, tint = sheet.inputs("losses", "tint")
    is_window = abs(eta_u * eta_v) > 0
    # a product with a name, since Cycles drops all of it where losses are known to be 0
    missed = losses * (1 - share)
    weight = is_window * (1 - missed)
    BSDF = sheet.node("ShaderNodeBsdfRayPortal", "bent", {"Color": weight * tint, "Direction": d})
    sheet.name(locals())
    sheet.end(BSDF)
    return Optics(BSDF.node)


LENSLET_WINDOW = Closure(
    shader="nim_lenslet_window",
    label="NIM Lenslet Window",
    sockets=SOCKETS,
    # raise it with every change to SOCKETS, to the twin or to nim_lenslet_window.osl
    version=1,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
)

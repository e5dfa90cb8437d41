# SPDX-License-Identifier: GPL-3.0-or-later
"""A slab of a uniaxial medium, its axis along the normal: the same as osl/nim_uniaxial_slab.osl in Blender's own nodes."""

from __future__ import annotations

from .closure import Closure, Socket
from .formulas import Sheet, Value, choose, dot, length, maximum, minimum, sqrt

ONWARDS = 1e-5  # as in nim_uniaxial_slab.osl
FLOAT = "NodeSocketFloat"

SOCKETS = (
    Socket(
        "across",
        "Permittivity Across",
        FLOAT,
        2.0,
        -100.0,
        100.0,
        "Relative permittivity within the plane of the slab; never 0",
    ),
    Socket(
        "along",
        "Permittivity Along",
        FLOAT,
        -3.0,
        -100.0,
        100.0,
        "Relative permittivity along the normal; of another sign than across it, the slab is hyperbolic; never 0",
    ),
    Socket(
        "thickness",
        "Thickness",
        FLOAT,
        0.25,
        0.0,
        1e6,
        "How far behind its faces the slab ends, in the object's own space: it is scaled with the object",
    ),
    Socket(
        "tint",
        "Tint",
        "NodeSocketColor",
        (1.0, 1.0, 1.0, 1.0),
        None,
        None,
        "Factor on all light that meets the slab; white loses nothing",
    ),
)


def _twin(sheet: Sheet) -> None:
    """The formulas of nim_uniaxial_slab.osl, in its words."""
    waves = sheet.frame("Waves within: kz^2 of s and p, kx = sin(theta)")
    across, along = sheet.inputs("across", "along")
    geometry = sheet.node("ShaderNodeNewGeometry", "I, Ng, P, which side")
    I, Ng, P = geometry["Incoming"], geometry["True Normal"], geometry["Position"]  # noqa: E741
    back = geometry["Backfacing"]
    c = minimum(maximum(dot(I, Ng), 1e-6), 1.0)
    sideways = c * Ng - I
    kx2 = dot(sideways, sideways)
    s2, p2 = across - kx2, across * (1 - kx2 / along)

    faces = sheet.frame("Faces: R = r^2, 1 where the wave decays; slab: T = (1 - R) / (1 + R)", after=waves)

    def through(a: Value, kz2: Value) -> Value:
        kz = sqrt(kz2)  # 0 where the wave decays: R = 1
        r = (a - kz) / (a + kz)
        R = r * r
        return (1 - R) / (1 + R)

    T_s, T_p = through(c, s2), through(abs(across) * c, p2)

    places = sheet.frame("Where both leave: behind the slab, a slope of depth aside", after=waves, top=-560)
    (thickness,) = sheet.inputs("thickness")
    to_world = {"vector_type": "VECTOR", "convert_from": "OBJECT", "convert_to": "WORLD"}
    x, y, z = (
        dot(sheet.node("ShaderNodeVectorTransform", f"{name} axis", {0: axis}, **to_world), Ng)
        for name, axis in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0)))
    )
    # of planes that are one unit apart in the object's space, however that is scaled
    unit = sqrt(x * x + y * y + z * z)
    depth = thickness * unit
    below = P - depth * Ng - (ONWARDS * (depth + length(P))) * I
    exit_s = below + (depth / sqrt(maximum(s2, 1e-12))) * sideways
    exit_p = below + (depth * abs(across) / (along * sqrt(maximum(p2, 1e-12)))) * sideways

    sheet.frame("Half of the light for each, the rest reflected; from behind straight on", after=places)
    (tint,) = sheet.inputs("tint")
    is_slab = abs(across * along) > 0
    color = is_slab * tint
    onwards = -I
    portal_s = sheet.node(
        "ShaderNodeBsdfRayPortal", "s", {"Color": (0.5 * T_s) * color, "Position": exit_s, "Direction": onwards}
    )
    portal_p = sheet.node(
        "ShaderNodeBsdfRayPortal", "p", {"Color": (0.5 * T_p) * color, "Position": exit_p, "Direction": onwards}
    )
    mirrored = {"Color": (1 - 0.5 * (T_s + T_p)) * color, "Roughness": 0.0, "Normal": Ng}
    reflected = sheet.node("ShaderNodeBsdfAnisotropic", "reflected", mirrored, distribution="GGX")
    passed = sheet.node("ShaderNodeAddShader", "s and p", {0: portal_s, 1: portal_p})
    slab = sheet.node("ShaderNodeAddShader", "slab", {0: passed, 1: reflected})
    straight = sheet.node("ShaderNodeBsdfTransparent", "straight on")
    BSDF = choose(back, straight, slab)
    sheet.name(locals())
    sheet.end(BSDF)


UNIAXIAL_SLAB = Closure(
    shader="nim_uniaxial_slab",
    label="NIM Uniaxial Slab",
    sockets=SOCKETS,
    # raise it with every change to SOCKETS, to the twin or to nim_uniaxial_slab.osl
    version=1,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
)

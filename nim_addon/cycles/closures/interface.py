# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between two media: its sockets, and the same optics as osl/nim_interface.osl in Blender's own nodes.

The nodes are laid out to be read from left to right, a frame for each equation. What depends on the sockets alone Cycles
works out once, before it renders, as long as nothing is linked to them; and where the signs differ it drops the refraction.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy

from .closure import Closure, Socket
from .formulas import Sheet, choose, dot, equal, length, maximum, normalize, sqrt


class Optics(NamedTuple):
    """What others may change in a group of the interface in nodes (caustics.bending does, in one of its own).

    q_squared:                     output of (n_i / n_t)^2
    reflected, refraction, portal: nodes of the closures that mirror light, and that let it through where the signs of the
                                   indices agree and where they differ; Color is the tint
    glass_or_not:                  node of the mix of these, and of a Glass BSDF that is all of them where it can be
    """

    q_squared: bpy.types.NodeSocket
    reflected: bpy.types.Node
    refraction: bpy.types.Node
    portal: bpy.types.Node
    glass_or_not: bpy.types.Node


GLIDE = 1e-3  # as in nim_interface.osl

# The same labels, ranges and texts as the shader's metadata (a test holds them together).
SOCKETS = (
    Socket(
        "n_inside",
        "Index Inside",
        "NodeSocketFloat",
        -1.5,
        -10.0,
        10.0,
        "Refractive index behind the faces; negative for a negative-index material",
    ),
    Socket(
        "mu_inside",
        "Permeability Inside",
        "NodeSocketFloat",
        -1.0,
        -100.0,
        100.0,
        "Relative permeability behind the faces; its sign is that of the index and does not count here",
    ),
    Socket(
        "n_outside",
        "Index Outside",
        "NodeSocketFloat",
        1.0,
        -10.0,
        10.0,
        "Refractive index on the side the normals point to",
    ),
    Socket(
        "mu_outside",
        "Permeability Outside",
        "NodeSocketFloat",
        1.0,
        -100.0,
        100.0,
        "Relative permeability on the side the normals point to; its sign does not count here",
    ),
    Socket(
        "tint",
        "Tint",
        "NodeSocketColor",
        (1.0, 1.0, 1.0, 1.0),
        None,
        None,
        "Factor on all light that meets the interface; white loses nothing",
    ),
    Socket(
        "shading_normal",
        "Normal",
        "NodeSocketVector",
        (0.0, 0.0, 0.0),
        None,
        None,
        "Normal of the interface, from a bump or normal map; the surface's own where nothing is linked",
        hide_value=True,
    ),
)


def _twin(sheet: Sheet) -> Optics:
    """The formulas of nim_interface.osl, in its words; z = Z_t / Z_i, by which r_s and r_p are reduced."""
    sheet.frame("Media: q = n_i / n_t, z = Z_t / Z_i with Z = |mu| / |n|")
    n_inside, n_outside, mu_inside, mu_outside = sheet.inputs("n_inside", "n_outside", "mu_inside", "mu_outside")
    geometry = sheet.node("ShaderNodeNewGeometry", "I, N, Ng, which side")
    I, N, Ng = geometry["Incoming"], geometry["Normal"], geometry["True Normal"]  # noqa: E741
    from_inside = geometry["Backfacing"]
    q_from_outside = n_outside / n_inside
    q_from_inside = 1 / q_from_outside
    q = choose(from_inside, q_from_inside, q_from_outside)
    mu_ratio = mu_inside / mu_outside
    z_from_outside = abs(mu_ratio * q_from_outside)
    z_from_inside = 1 / z_from_outside
    z = choose(from_inside, z_from_inside, z_from_outside)

    normal = sheet.frame("Normal n (Ng where it would mirror the viewer inwards), cos_i", top=-360)
    (shading_normal,) = sheet.inputs("shading_normal")
    linked = length(shading_normal) > 0
    bent = choose(linked, normalize(shading_normal), N)
    cos_bent, cos_true, tilt = dot(I, bent), dot(I, Ng), dot(bent, Ng)
    # dot(2 * cos_bent * bent - I, Ng) > GLIDE, halved, with cos_bent > 0
    valid = maximum(cos_bent, 0) * tilt > 0.5 * cos_true + GLIDE / 2
    n = choose(valid, bent, Ng)
    cos_i = choose(valid, cos_bent, cos_true)

    snell = sheet.frame("Snell: cos_t^2 = 1 - q^2 sin_i^2", after=normal, top=-180)
    # in the form that is exact in single precision where |n_i| = |n_t|
    cos2_t = (1 - q * q) + q * q * (cos_i * cos_i)
    # the root of a negative number is 0 here, and then R = 1: total reflection needs no branch
    cos_t = sqrt(cos2_t)

    sheet.frame("Fresnel: R = (r_s^2 + r_p^2) / 2", after=snell)
    r_s = (z * cos_i - cos_t) / (z * cos_i + cos_t)
    r_p = (cos_i - z * cos_t) / (cos_i + z * cos_t)
    R = 0.5 * (r_s * r_s + r_p * r_p)

    ray = sheet.frame("Transmitted ray: d = (q cos_i - cos_t) n - q I", after=snell, top=-360)
    d = (q * cos_i - cos_t) * n - q * I
    height = dot(d, Ng)
    # a ray that a bent normal would send back glides along the surface, just inside
    excess = maximum(height, -GLIDE) + GLIDE
    d_inwards = d - excess * Ng
    direction = normalize(d_inwards)

    sheet.frame("R reflected, 1 - R transmitted: by a portal if signs differ", after=ray, top=-180)
    (tint,) = sheet.inputs("tint")
    same_signs = q_from_outside > 0
    # a refraction closure would drop a ray that a bent normal sends back
    inwards = height < 0
    # a product, since Cycles drops the refraction where one factor is known to be 0
    refracts = same_signs * inwards
    smooth = {"Color": tint, "Roughness": 0.0}
    refraction = sheet.node(
        "ShaderNodeBsdfRefraction",
        "transmitted, same signs",
        # q from inside is n_inside / n_outside, which the node turns round for a back face by itself
        smooth | {"IOR": q_from_inside, "Normal": n},
        distribution="GGX",
    )
    portal = sheet.node("ShaderNodeBsdfRayPortal", "transmitted, signs differ", {"Color": tint, "Direction": direction})
    transmitted = choose(refracts, refraction, portal)
    reflected = sheet.node("ShaderNodeBsdfAnisotropic", "reflected", smooth | {"Normal": n}, distribution="GGX")
    by_formulas = choose(R, reflected, transmitted)

    # Between plain dielectrics z = q, and Blender's Glass is the same equations in one closure, which is cheaper. Only
    # without a bent normal, though: it loses light on bumps.
    sheet.frame("The same where |mu| and signs agree: Glass", after=ray, top=-700)
    alike = equal(abs(mu_ratio), 1, within=1e-6)
    glass_does = alike * same_signs * (1 - linked)
    glass = sheet.node("ShaderNodeBsdfGlass", "Glass", smooth | {"IOR": q_from_inside}, distribution="GGX")
    BSDF = choose(glass_does, glass, by_formulas)

    sheet.name(locals())
    sheet.end(BSDF)
    return Optics((q * q).socket, reflected.node, refraction.node, portal.node, BSDF.node)


INTERFACE = Closure(
    shader="nim_interface",
    label="NIM Interface",
    sockets=SOCKETS,
    # raise it with every change to SOCKETS, to the twin or to nim_interface.osl
    version=2,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
)

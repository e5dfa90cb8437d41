# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between two media: its sockets, and the same optics as osl/nim_interface.osl in Blender's own nodes.

The nodes are laid out to be read from left to right, a frame for each equation. What depends on the sockets alone Cycles
works out once, before it renders, as long as nothing is linked to them; and where the signs differ it drops the refraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import bpy

from .closure import BSDF, EEVEE, Closure, Socket
from .formulas import (
    Complex,
    Frame,
    Sheet,
    Value,
    choose,
    cos,
    dot,
    equal,
    exp,
    length,
    maximum,
    minimum,
    normalize,
    sin,
    sqrt,
)
from .preview import preview


class Optics(NamedTuple):
    """What others may change in a group of the interface in nodes (caustics.bending does, in one of its own).

    q_squared:                     node of (n_i / n_t)^2
    stops:                         node that gives 1 where what is not reflected is absorbed in the surface, else 0
    reflected, refraction, portal: nodes of the closures that mirror light, and that let it through where the signs of the
                                   indices agree and where they differ; Color is the tint
    reflected_or_not:              node of the mix of these, whose factor is R
    glass_or_not:                  node of the mix of that, and of a Glass BSDF that is all of them where it can be
    absorbed_or_not:               node of the mix of that, and of nothing; its factor is what absorption takes
    """

    q_squared: bpy.types.Node
    stops: bpy.types.Node
    reflected: bpy.types.Node
    refraction: bpy.types.Node
    portal: bpy.types.Node
    reflected_or_not: bpy.types.Node
    glass_or_not: bpy.types.Node
    absorbed_or_not: bpy.types.Node


GLIDE, LEAST_INDEX, OPAQUE = 1e-3, 1e-6, 1e-3  # as in nim_interface.osl
LATER = {"since": 3}  # sockets that the groups of the first two versions did not have


def _losses(side: str, where: str) -> tuple[Socket, ...]:
    """The sockets of what light loses on the side "inside" or "outside"."""
    name, kind = side.capitalize(), "NodeSocketFloat"
    return (
        Socket(
            f"k_{side}",
            f"Extinction {name}",
            kind,
            0.0,
            0.0,
            100.0,
            f"Imaginary part k of the refractive index {where}; 0 where nothing is lost",
            **LATER,
        ),
        Socket(
            f"mu_imag_{side}",
            f"Permeability Loss {name}",
            kind,
            0.0,
            0.0,
            100.0,
            f"Imaginary part of the relative permeability {where}; 0 where nothing is lost",
            **LATER,
        ),
        Socket(
            f"absorption_{side}",
            f"Absorption {name}",
            kind,
            0.0,
            0.0,
            1e9,
            f"Absorption coefficient {where}, per metre, of light on a straight way to the surface",
            **LATER,
        ),
    )


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
        "Relative permeability behind the faces; its sign counts only where something is lost",
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
        "Relative permeability on the side the normals point to; its sign counts only where something is lost",
    ),
    *_losses("inside", "behind the faces"),
    *_losses("outside", "on the side the normals point to"),
    Socket(
        "roughness",
        "Roughness",
        "NodeSocketFloat",
        0.0,
        0.0,
        1.0,
        "Roughness of the surface, as in Blender's Glass; 0 is smooth, and at 0.5 up to 20 % of the light is lost between "
        "facets",
        **LATER,
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
    cos_view = choose(valid, cos_bent, cos_true)
    rough = _rough(sheet, normal, geometry, n, cos_view)
    m, cos_i = rough.m, rough.cos_i

    snell = sheet.frame("Snell: cos_t^2 = 1 - q^2 sin_i^2", after=rough.frame, top=-180)
    # in the form that is exact in single precision where |n_i| = |n_t|
    cos2_t = (1 - q * q) + q * q * (cos_i * cos_i)
    # the root of a negative number is 0 here, and then R = 1: total reflection needs no branch
    cos_t = sqrt(cos2_t)

    lossy = _lossy(sheet, from_inside, cos_i, cos2_t)
    sheet.frame("Fresnel: R = (r_s^2 + r_p^2) / 2", after=snell)
    r_s = (z * cos_i - cos_t) / (z * cos_i + cos_t)
    r_p = (cos_i - z * cos_t) / (cos_i + z * cos_t)
    R_clear = 0.5 * (r_s * r_s + r_p * r_p)
    R = choose(lossy.loses, lossy.R, R_clear)

    ray = sheet.frame("Transmitted ray: d = (q cos_i - cos_t) m - q I", after=snell, top=-360)
    d = (q * cos_i - cos_t) * m - q * I
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
    refracts = same_signs * inwards * (1 - rough.is_rough)
    # what a facet sends beyond the surface, or to another facet, is lost
    mirrored = 2 * cos_i * m - I
    kept_mirrored, kept_through = rough.kept(dot(mirrored, n)), rough.kept(dot(-d, n))
    smooth = {"Color": kept_mirrored * tint, "Roughness": 0.0, "Normal": m}
    refraction = sheet.node(
        "ShaderNodeBsdfRefraction",
        "transmitted, same signs",
        # q from inside is n_inside / n_outside, which the node turns round for a back face by itself
        smooth | {"IOR": q_from_inside},
        distribution="GGX",
    )
    passed = {"Color": kept_through * tint, "Direction": direction}
    portal = sheet.node("ShaderNodeBsdfRayPortal", "transmitted, signs differ", passed)
    transmitted = choose(refracts, refraction, portal)
    goes_on = sheet.node("ShaderNodeMixShader", "nothing where no ray goes on", {0: lossy.stops, 1: transmitted})
    reflected = sheet.node("ShaderNodeBsdfAnisotropic", "reflected", smooth, distribution="GGX")
    by_facets = choose(R, reflected, goes_on)

    # Where R is that of plain dielectrics, of the magnitudes, Blender's own facets are the same, and find lamps.
    sheet.frame(
        "Rough, |mu| agree, white: what is reflected by a Principled BSDF, black but for its gloss", after=ray, top=-680
    )
    alike = equal(abs(mu_ratio), 1, within=1e-6)
    plain = alike * (1 - lossy.loses)
    channels = sheet.node("ShaderNodeSeparateColor", "tint", {0: tint})
    # which has no colour of its own for all that it reflects
    white = minimum(minimum(channels["Red"], channels["Green"]), channels["Blue"]) > 1 - 1e-6
    lobe_does = rough.is_rough * plain * white
    gloss = {"Base Color": (0.0, 0.0, 0.0, 1.0), "Roughness": rough.roughness, "IOR": 1 / abs(q), "Normal": n}
    lobe = sheet.node("ShaderNodeBsdfPrincipled", "reflected by Blender's facets", gloss, distribution="GGX")
    rest = sheet.node("ShaderNodeMixShader", "1 - R of what goes on", {0: R, 1: goes_on})
    lobe_and_rest = sheet.node("ShaderNodeAddShader", "both", {0: lobe, 1: rest})
    by_formulas = choose(lobe_does, lobe_and_rest, by_facets)

    # Between plain dielectrics z = q, and Blender's Glass is the same equations in one closure, which is cheaper. Only
    # without a bent normal, though: it loses light on bumps.
    sheet.frame("The same where |mu| and signs agree: Glass", after=ray, top=-1080)
    glass_does = plain * same_signs * (1 - linked)
    blown = {"Color": tint, "Roughness": rough.roughness, "IOR": q_from_inside}
    glass = sheet.node("ShaderNodeBsdfGlass", "Glass", blown, distribution="GGX")
    clear = choose(glass_does, glass, by_formulas)

    sheet.frame("What is left of the way in a medium: exp(-absorption length)", after=ray, top=-1420)
    absorption_inside, absorption_outside = sheet.inputs("absorption_inside", "absorption_outside")
    # products with names, since Cycles drops all of it where both absorptions are known to be 0
    in_there, out_there = from_inside * absorption_inside, (1 - from_inside) * absorption_outside
    way = sheet.node("ShaderNodeLightPath", "length of the way")["Ray Length"]
    lost = 1 - exp(-((in_there + out_there) * way))
    whole = sheet.node("ShaderNodeMixShader", "nothing of what is lost", {0: lost, 1: clear})

    sheet.name(locals())
    sheet.end(whole, preview(sheet))
    return Optics(
        (q * q).node,
        lossy.stops.node,
        reflected.node,
        refraction.node,
        portal.node,
        by_facets.node,
        clear.node,
        whole.node,
    )


class _Rough(NamedTuple):
    """The facet that light meets: its normal m, and the cosine between it and the viewer; n where the surface is smooth.

    kept: function(cosine to n of a ray that leaves, on its side) -> how much of its light remains, 1 where it is smooth
    """

    frame: Frame
    roughness: Value
    is_rough: Value
    m: Value
    cos_i: Value
    kept: Callable[[Value], Value]


def _rough(sheet: Sheet, after: Frame, geometry: Value, n: Value, cos_view: Value) -> _Rough:
    """visible_facet() and unmasked() of the shader. Cycles drops all of it where the roughness is known to be 0."""
    chance = sheet.frame("Rough: a facet, by chance", after=after, top=-2300)
    (roughness,) = sheet.inputs("roughness")
    is_rough = roughness > 0
    alpha = minimum(roughness * roughness, 1)
    I, P = geometry["Incoming"], geometry["Position"]  # noqa: E741
    # white noise of the place and the way: no two samples meet the same facet
    way = sheet.node("ShaderNodeVectorMath", "a number of I", {0: I, 1: (1.0, 1.37, 1.71)}, operation="DOT_PRODUCT")
    place = {"Vector": P, "W": way["Value"]}
    noise = sheet.node("ShaderNodeTexWhiteNoise", "white noise", place, noise_dimensions="4D")["Color"]
    random = sheet.node("ShaderNodeSeparateXYZ", "random numbers", {0: noise})
    up = 2 * random["X"] - 1
    across, turn = sqrt(1 - up * up), 2 * math.pi * random["Y"]
    sphere = {"X": across * cos(turn), "Y": across * sin(turn), "Z": up}
    anywhere = sheet.node("ShaderNodeCombineXYZ", "anywhere", sphere)

    visible = sheet.frame("Rough: among those that the viewer sees", after=chance, top=-2300)
    viewer = normalize(alpha * I + ((1 - alpha) * cos_view) * n)
    height, lowest = dot(anywhere, n), -dot(viewer, n)
    cap = lowest + 0.5 * (1 - lowest) * (1 + height)
    h = cap * n + sqrt(1 - cap * cap) * normalize(anywhere - height * n) + viewer
    facet = normalize(alpha * h + ((1 - alpha) * dot(h, n)) * n)
    m = choose(is_rough, facet, n)
    cos_i = choose(is_rough, dot(I, facet), cos_view)

    def masking(cosine):
        square = maximum(cosine * cosine, 1e-12)
        return 0.5 * (sqrt(1 + (alpha * alpha) * (1 - square) / square) - 1)

    def kept(cosine):
        seen = 1 + masking(cos_view)
        return choose(is_rough, (cosine > 0) * (seen / (seen + masking(cosine))), 1.0)

    sheet.name(locals())
    return _Rough(visible, roughness, is_rough, m, cos_i, kept)


class _Lossy(NamedTuple):
    """What is different where a medium has loss: whether one has, R, and whether the rest is absorbed in the surface."""

    loses: Value
    R: Value
    stops: Value


def _lossy(sheet: Sheet, from_inside: Value, cos_i: Value, cos2_t: Value) -> _Lossy:
    """The same with complex n and mu. Cycles drops all of it where k and the losses of mu are known to be 0."""
    media = sheet.frame("With loss: complex q and z, where Z = mu / n with Re Z >= 0", top=-1300)
    k_inside, mu_imag_inside = sheet.inputs("k_inside", "mu_imag_inside")
    k_outside, mu_imag_outside = sheet.inputs("k_outside", "mu_imag_outside")
    n_inside, n_outside, mu_inside, mu_outside = sheet.inputs("n_inside", "n_outside", "mu_inside", "mu_outside")
    loses = k_inside + mu_imag_inside + k_outside + mu_imag_outside > 0
    c_inside, c_outside = Complex(n_inside, k_inside), Complex(n_outside, k_outside)
    m_inside, m_outside = Complex(mu_inside, mu_imag_inside), Complex(mu_outside, mu_imag_outside)
    c_from_outside = c_outside / c_inside
    # of the sign of Re Z; a permeability that no medium without gain has with this index counts as its negative
    side_inside = mu_inside * n_inside + mu_imag_inside * k_inside
    side_outside = mu_outside * n_outside + mu_imag_outside * k_outside
    turn = 1 - 2 * (side_inside * side_outside < 0)
    Z_from_outside = m_inside / m_outside * c_from_outside * turn
    c_q = choose(from_inside, 1 / c_from_outside, c_from_outside)
    c_z = choose(from_inside, 1 / Z_from_outside, Z_from_outside)

    snell = sheet.frame("With loss: cos_t, the principal root of (1 - q)(1 + q) + q^2 cos_i^2", after=media, top=-1300)
    c_q2 = c_q * c_q
    one_re = (1 - c_q.re) * (1 + c_q.re) + c_q.im * c_q.im
    # the imaginary part of 1 - q^2 is that of -q^2
    c_cos2_t = Complex(one_re + c_q2.re * (cos_i * cos_i), c_q2.im * (cos_i * cos_i - 1))
    c_cos_t = c_cos2_t.root()

    fresnel = sheet.frame("With loss: R = (|r_s|^2 + |r_p|^2) / 2, at most 1", after=snell, top=-1300)
    c_s, c_p = c_z * cos_i, c_z * c_cos_t
    R_s = (c_s - c_cos_t).square() / (c_s + c_cos_t).square()
    below, above, across = cos_i + c_p.re, cos_i - c_p.re, c_p.im * c_p.im
    R_p = (above * above + across) / (below * below + across)
    R_lossy = minimum(0.5 * (R_s + R_p), 1)

    sheet.frame(
        "With loss: no ray goes on beyond |sin| = |Re n|, and where light is gone at once", after=fresnel, top=-1300
    )
    k_t = choose(from_inside, k_outside, k_inside)
    n_t = choose(from_inside, n_outside, n_inside)
    goes = (cos2_t > 0) * (abs(n_t) > LEAST_INDEX) * (1 - (k_t > OPAQUE))
    stops = loses * (1 - goes)
    sheet.name(locals())
    return _Lossy(loses, R_lossy, stops)


INTERFACE = Closure(
    shader="nim_interface",
    label="NIM Interface",
    sockets=SOCKETS,
    # raise it with every change to SOCKETS, to the twin or to nim_interface.osl
    version=4,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
    outputs=(BSDF, EEVEE),
    preview=preview,
)

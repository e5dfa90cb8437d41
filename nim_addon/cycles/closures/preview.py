# SPDX-License-Identifier: GPL-3.0-or-later
"""What EEVEE shows of an interface: its rim, its tint, and a veil over what is behind it, which it cannot bend as light is bent.

EEVEE refracts on the screen and never to the side of a negative index, so no ray is bent here: nothing looks like a picture
that it is not. What is reflected is that of the media, and follows their values as they are changed, linked and animated.
"""

from __future__ import annotations

from .formulas import Complex, Sheet, Value, choose, dot, maximum, sqrt

VEIL = 0.5  # the share of what passes through that a veil takes
NEGATIVE, POSITIVE = (0.9, 0.6, 0.35), (0.5, 0.7, 0.9)  # its colours, as those of the solid view


def preview(sheet: Sheet) -> Value:
    """The closure for EEVEE, of the sockets of the interface, in frames of their own below the others."""
    first = sheet.frame("For EEVEE: q = |n_out / n_in|, z = Z_in / Z_out, seen from outside", top=-3400)
    names = ("n_inside", "n_outside", "mu_inside", "mu_outside")
    n_inside, n_outside, mu_inside, mu_outside = sheet.inputs(*names)
    losses = ("k_inside", "k_outside", "mu_imag_inside", "mu_imag_outside")
    k_inside, k_outside, mu_imag_inside, mu_imag_outside = sheet.inputs(*losses)
    geometry = sheet.node("ShaderNodeNewGeometry", "I, N of what is drawn")
    q = n_outside / n_inside
    index = Complex(n_outside, k_outside) / Complex(n_inside, k_inside)
    z = Complex(mu_inside, mu_imag_inside) / Complex(mu_outside, mu_imag_outside) * index
    clear_z = abs(mu_inside / mu_outside * q)
    cosine = abs(dot(geometry["Incoming"], geometry["Normal"]))

    second = sheet.frame(
        "For EEVEE: R of clear media at any angle, of others no less than straight on", after=first, top=-3400
    )
    cosine_t = sqrt(1 - q * q * (1 - cosine * cosine))  # 0 where all is reflected
    s = (clear_z * cosine - cosine_t) / (clear_z * cosine + cosine_t)
    p = (cosine - clear_z * cosine_t) / (cosine + clear_z * cosine_t)
    clear = 0.5 * (s * s + p * p)
    below, above, across = abs(z.re) + 1, abs(z.re) - 1, z.im * z.im
    straight_on = (above * above + across) / (below * below + across)
    loses = k_inside + k_outside + mu_imag_inside + mu_imag_outside > 0
    reflected = choose(loses, maximum(clear, straight_on), clear)

    sheet.frame("For EEVEE: reflected, and behind a veil what is there unbent", after=second, top=-3400)
    tint, roughness = sheet.inputs("tint", "roughness")
    warm, cool = (_colour(sheet, label, colour) for label, colour in (("negative", NEGATIVE), ("positive", POSITIVE)))
    veil = sheet.node("ShaderNodeBsdfDiffuse", "veil", {"Color": choose(q < 0, warm, cool) * tint})
    behind = sheet.node("ShaderNodeBsdfTransparent", "what is behind", {"Color": tint})
    through = sheet.node("ShaderNodeMixShader", "through the veil", {0: VEIL, 1: behind, 2: veil})
    gloss = {"Color": tint, "Roughness": roughness}
    mirror = sheet.node("ShaderNodeBsdfAnisotropic", "reflected", gloss, distribution="GGX")
    return sheet.node("ShaderNodeMixShader", "EEVEE", {0: reflected, 1: through, 2: mirror})


def _colour(sheet, label, colour):
    return sheet.node("ShaderNodeCombineXYZ", label, dict(zip("XYZ", colour, strict=True)))

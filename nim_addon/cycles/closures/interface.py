# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between two media: its sockets, and the same optics as osl/nim_interface.osl in Blender's own nodes.

The nodes are laid out to be read from left to right, a frame for each equation. What depends on the sockets alone Cycles
works out once, before it renders, as long as nothing is linked to them; and where the signs differ it drops the refraction.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy

from .closure import Closure, Socket


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


class _Frame:
    """A frame with a title, and the nodes in it: each to the right of those in the frame that feed it."""

    COLUMN, ROW, GAP = 180, 48, 90

    def __init__(self, tree, title, left, top):
        self.tree, self.left, self.top = tree, left, top
        self.frame = tree.nodes.new("NodeFrame")
        self.frame.label = title
        # a frame closes tightly around its nodes, over the title's place: this one keeps it free
        spacer = tree.nodes.new("NodeReroute")
        spacer.parent, spacer.location = self.frame, (left, top + 40)
        self.column = {}
        self.rows = {}

    @property
    def right(self):
        """Where the next frame may begin."""
        return self.left + self.COLUMN * len(self.rows) + self.GAP

    def node(self, kind, inputs, label, **properties):
        """A collapsed node; `inputs` maps socket identifiers or indices to values or to the outputs that feed them."""
        node = self.tree.nodes.new(kind)
        node.label = label
        node.hide = True
        node.width = 155
        node.parent = self.frame
        for key, value in properties.items():
            setattr(node, key, value)
        column = 0
        for key, value in inputs.items():
            socket = node.inputs[key] if isinstance(key, int) else next(s for s in node.inputs if s.identifier == key)
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
                column = max(column, self.column.get(value.node.name, -1) + 1)
            else:
                socket.default_value = value
        self.column[node.name] = column
        row = self.rows[column] = self.rows.get(column, -1) + 1
        # every second column lies half a row lower, so that links pass between the nodes
        node.location = (self.left + self.COLUMN * column, self.top - self.ROW * (row + 0.5 * (column % 2)))
        return node

    def math(self, label, operation, *values):
        """The output of a Math node."""
        return self.node("ShaderNodeMath", dict(enumerate(values)), label, operation=operation).outputs[0]

    def vector(self, label, operation, *vectors, scale=None):
        """The output of a Vector Math node, a vector or (dot product, length) a number."""
        inputs = dict(enumerate(vectors)) | ({} if scale is None else {"Scale": scale})
        node = self.node("ShaderNodeVectorMath", inputs, label, operation=operation)
        return node.outputs["Value" if operation in ("DOT_PRODUCT", "LENGTH") else "Vector"]

    def choose(self, label, kind, which, no, yes):
        """`no` where `which` is 0, `yes` where it is 1; kind is "Float" or "Vector"."""
        inputs = {"Factor_Float": which, f"A_{kind}": no, f"B_{kind}": yes}
        node = self.node("ShaderNodeMix", inputs, label, data_type=kind.upper(), clamp_factor=False)
        return next(socket for socket in node.outputs if socket.identifier == f"Result_{kind}")


def _twin(tree, sockets) -> Optics:
    """Build the optics in the empty group `tree`, whose interface has SOCKETS; sockets: their names by identifier."""

    def entry(left, top, *identifiers):
        """Outputs of a Group Input of its own, near its use, that shows these sockets only."""
        node = tree.nodes.new("NodeGroupInput")
        node.location = (left, top)
        for socket in node.outputs:
            socket.hide = socket.name not in {sockets[identifier] for identifier in identifiers}
        return [node.outputs[sockets[identifier]] for identifier in identifiers]

    n_inside, n_outside, mu_inside, mu_outside = entry(-220, 0, "n_inside", "n_outside", "mu_inside", "mu_outside")
    (shading_normal,) = entry(-220, -360, "shading_normal")
    frame = _Frame(tree, "Media: q = n_i / n_t, z = Z_t / Z_i with Z = |mu| / |n|", 0, 0)
    geometry = frame.node("ShaderNodeNewGeometry", {}, "I, N, Ng, which side")
    incoming, true_normal = geometry.outputs["Incoming"], geometry.outputs["True Normal"]
    inside = geometry.outputs["Backfacing"]
    q_out = frame.math("q from outside", "DIVIDE", n_outside, n_inside)
    q_in = frame.math("q from inside", "DIVIDE", 1.0, q_out)
    q = frame.choose("q", "Float", inside, q_out, q_in)
    mu = frame.math("mu_t / mu_i from outside", "DIVIDE", mu_inside, mu_outside)
    z_signed = frame.math("z from outside, signed", "MULTIPLY", mu, q_out)
    z_out = frame.math("z from outside", "ABSOLUTE", z_signed)
    z_in = frame.math("z from inside", "DIVIDE", 1.0, z_out)
    z = frame.choose("z", "Float", inside, z_out, z_in)

    frame = _Frame(tree, "Normal n (Ng where it would mirror the viewer inwards), cos_i", 0, -360)
    length = frame.vector("|Normal|", "LENGTH", shading_normal)
    linked = frame.math("is it linked?", "GREATER_THAN", length, 0.0)
    unit = frame.vector("Normal / |Normal|", "NORMALIZE", shading_normal)
    bent = frame.choose("bent normal b", "Vector", linked, geometry.outputs["Normal"], unit)
    cos_b = frame.vector("I . b", "DOT_PRODUCT", incoming, bent)
    cos_true = frame.vector("I . Ng", "DOT_PRODUCT", incoming, true_normal)
    tilt = frame.vector("b . Ng", "DOT_PRODUCT", bent, true_normal)
    # mirrored: (2 (I.b) b - I) . Ng > GLIDE, with I.b > 0
    facing = frame.math("max(I . b, 0)", "MAXIMUM", cos_b, 0.0)
    half = frame.math("(I . b) (b . Ng)", "MULTIPLY", facing, tilt)
    least = frame.math("(I . Ng + glide) / 2", "MULTIPLY_ADD", cos_true, 0.5, GLIDE / 2)
    valid = frame.math("mirrors outwards?", "GREATER_THAN", half, least)
    n = frame.choose("n", "Vector", valid, true_normal, bent)
    cos_i = frame.choose("cos_i", "Float", valid, cos_true, cos_b)

    frame = _Frame(tree, "Snell: cos_t^2 = 1 - q^2 sin_i^2", frame.right, -180)
    q2 = frame.math("q^2", "MULTIPLY", q, q)
    c2 = frame.math("cos_i^2", "MULTIPLY", cos_i, cos_i)
    # in the form that is exact in single precision where |n_i| = |n_t|
    rest = frame.math("1 - q^2", "SUBTRACT", 1.0, q2)
    cos2_t = frame.math("(1 - q^2) + q^2 cos_i^2", "MULTIPLY_ADD", q2, c2, rest)
    # the root of a negative number is 0 here, and then R = 1: total reflection needs no branch
    cos_t = frame.math("cos_t", "SQRT", cos2_t)

    frame = _Frame(tree, "Fresnel: R = (r_s^2 + r_p^2) / 2", frame.right, 0)
    z_cos_i = frame.math("z cos_i", "MULTIPLY", z, cos_i)
    z_cos_t = frame.math("z cos_t", "MULTIPLY", z, cos_t)
    s_above = frame.math("z cos_i - cos_t", "SUBTRACT", z_cos_i, cos_t)
    s_below = frame.math("z cos_i + cos_t", "ADD", z_cos_i, cos_t)
    r_s = frame.math("r_s", "DIVIDE", s_above, s_below)
    p_above = frame.math("cos_i - z cos_t", "SUBTRACT", cos_i, z_cos_t)
    p_below = frame.math("cos_i + z cos_t", "ADD", cos_i, z_cos_t)
    r_p = frame.math("r_p", "DIVIDE", p_above, p_below)
    R_p = frame.math("r_p^2", "MULTIPLY", r_p, r_p)
    both = frame.math("r_s^2 + r_p^2", "MULTIPLY_ADD", r_s, r_s, R_p)
    R = frame.math("R", "MULTIPLY", both, 0.5)

    fresnel_left = frame.left
    frame = _Frame(tree, "Transmitted ray: d = (q cos_i - cos_t) n - q I", fresnel_left, -360)
    q_cos_i = frame.math("q cos_i", "MULTIPLY", q, cos_i)
    along = frame.math("q cos_i - cos_t", "SUBTRACT", q_cos_i, cos_t)
    normal_part = frame.vector("(q cos_i - cos_t) n", "SCALE", n, scale=along)
    incoming_part = frame.vector("q I", "SCALE", incoming, scale=q)
    d = frame.vector("d", "SUBTRACT", normal_part, incoming_part)
    height = frame.vector("d . Ng", "DOT_PRODUCT", d, true_normal)
    # a ray that a bent normal would send back glides along the surface, just inside
    above = frame.math("max(d . Ng, -glide)", "MAXIMUM", height, -GLIDE)
    excess = frame.math("height over the glide", "ADD", above, GLIDE)
    push = frame.vector("push inwards", "SCALE", true_normal, scale=excess)
    inwards = frame.vector("d, inwards", "SUBTRACT", d, push)
    direction = frame.vector("d, of length 1", "NORMALIZE", inwards)

    frame = _Frame(tree, "R reflected, 1 - R transmitted: by a portal if signs differ", frame.right, -180)
    (tint,) = entry(frame.left - 200, -420, "tint")
    same = frame.math("have the indices one sign?", "GREATER_THAN", q_out, 0.0)
    # a refraction closure would drop a ray that a bent normal sends back
    falls = frame.math("does d go inwards?", "LESS_THAN", height, 0.0)
    # a product, since Cycles drops the refraction where one factor is known to be 0
    refracts = frame.math("refraction, not portal", "MULTIPLY", same, falls)
    refraction = frame.node(
        "ShaderNodeBsdfRefraction",
        # q from inside is n_inside / n_outside, which the node turns round for a back face by itself
        {"Color": tint, "Roughness": 0.0, "IOR": q_in, "Normal": n},
        "transmitted, same signs",
        distribution="GGX",
    )
    portal = frame.node("ShaderNodeBsdfRayPortal", {"Color": tint, "Direction": direction}, "transmitted, signs differ")
    transmitted = frame.node(
        "ShaderNodeMixShader", {0: refracts, 1: portal.outputs[0], 2: refraction.outputs[0]}, "transmitted"
    )
    reflected = frame.node(
        "ShaderNodeBsdfAnisotropic",
        {"Color": tint, "Roughness": 0.0, "Normal": n},
        "reflected",
        distribution="GGX",
    )
    mixed = frame.node("ShaderNodeMixShader", {0: R, 1: transmitted.outputs[0], 2: reflected.outputs[0]}, "R")
    # Between plain dielectrics z = q, and Blender's Glass is the same equations in one closure, which is cheaper. Only
    # without a bent normal, though: it loses light on bumps.
    glass_frame = _Frame(tree, "The same where |mu| and signs agree: Glass", frame.left, frame.top - 520)
    mu_ratio = glass_frame.math("|mu_t / mu_i|", "ABSOLUTE", mu)
    alike = glass_frame.math("is it 1?", "COMPARE", mu_ratio, 1.0, 1e-6)
    plain = glass_frame.math("and have the indices one sign?", "MULTIPLY", alike, same)
    unbent = glass_frame.math("is no normal linked?", "SUBTRACT", 1.0, linked)
    cheaper = glass_frame.math("Glass does", "MULTIPLY", plain, unbent)
    glass = glass_frame.node(
        "ShaderNodeBsdfGlass", {"Color": tint, "Roughness": 0.0, "IOR": q_in}, "Glass", distribution="GGX"
    )
    either = glass_frame.node("ShaderNodeMixShader", {0: cheaper, 1: mixed.outputs[0], 2: glass.outputs[0]}, "either")
    leave = tree.nodes.new("NodeGroupOutput")
    leave.location = (glass_frame.right, -420)
    tree.links.new(either.outputs[0], leave.inputs[0])
    return Optics(q2, reflected, refraction, portal, either)


INTERFACE = Closure(
    shader="nim_interface",
    label="NIM Interface",
    sockets=SOCKETS,
    # raise it with every change to SOCKETS, to the twin or to nim_interface.osl
    version=2,
    twin=_twin,
    heart="BSDF_RAY_PORTAL",
)

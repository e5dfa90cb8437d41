# SPDX-License-Identifier: GPL-3.0-or-later
"""What a crossing counts for a photon: a colour that tells it, and the groups of closures that give it.

Cycles takes radiance as the same on both sides of a surface, where really it grows as solid angles are compressed.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..cycles.closures import GRADED_CORE, LENSLET_WINDOW
from ..cycles.closures.closure import handles
from ..cycles.nodes import Nodes

# Within a medium light is counted for less (photons.Tracer). The share of a crossing, (n_i / n_t)^2, travels as a colour
# (1, 2 - s, s), which must stay positive and of mean 1, so that no path changes: s is the share to a small power.
POWER = 0.05
WHITE = (1.0, 1.0, 1.0)


def at_lenslets() -> bpy.types.NodeTree:
    """The group of a window of lenslets, of which a crossing counts as it stretches the solid angle of light.

    By (cos_t / cos_i)^4 / |eta_u eta_v| from in front, since cos d omega is cos^4 of the area of slopes: so much more or less
    light falls on what is behind it, seen through which everything is as bright as without it.
    """
    group = LENSLET_WINDOW.new_copy("NIM photons at lenslets")
    nodes, portal = Nodes(group), handles(group)["portal"]
    geometry, entry = nodes.add("ShaderNodeNewGeometry").outputs, nodes.add("NodeGroupInput").outputs
    cosines = [
        nodes.add("ShaderNodeVectorMath", operation="DOT_PRODUCT", inputs={0: one, 1: geometry["True Normal"]})
        for one in (fed(portal.inputs["Direction"]), geometry["Incoming"])
    ]
    ratio = nodes.math("ABSOLUTE", nodes.math("DIVIDE", *(cosine.outputs["Value"] for cosine in cosines)))
    eta = nodes.math("ABSOLUTE", nodes.math("MULTIPLY", entry["Eta U"], entry["Eta V"]))
    exponent = nodes.math("MULTIPLY_ADD", geometry["Backfacing"], 2 * POWER, -POWER)
    share = nodes.math("MULTIPLY", nodes.math("POWER", ratio, 4 * POWER), nodes.math("POWER", eta, exponent))
    color = portal.inputs["Color"]
    nodes.feed(color, nodes.mix(switch(nodes, "counted"), fed(color), count(nodes, share)))
    return group


def around_a_core() -> bpy.types.NodeTree:
    """The group of a graded shell, of which light that comes to the core counts as within the medium there: by 1 / n^2."""
    group = GRADED_CORE.new_copy("NIM photons at a core")
    nodes = Nodes(group)
    entry = nodes.add("NodeGroupInput").outputs
    sweep = nodes.add("ShaderNodeSeparateXYZ", inputs={0: entry["Sweep"]}).outputs
    from_core = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
    lands = nodes.math("GREATER_THAN", sweep["Z"], 0.5)
    # from the core back onto it nothing is crossed
    crossed = nodes.math("MULTIPLY", nodes.math("SUBTRACT", from_core, lands), 2 * POWER)
    share = nodes.math("POWER", nodes.math("ABSOLUTE", entry["Core Index"]), crossed)
    (portal,) = [node for node in group.nodes if node.type == GRADED_CORE.heart]
    nodes.feed(portal.inputs["Color"], nodes.mix(switch(nodes, "counted"), WHITE, count(nodes, share)))
    return group


def switch(nodes: Nodes, name: str) -> bpy.types.NodeSocket:
    """The output of a tree's Value node that Bending.set() finds by that name, made where there is none."""
    name = f"NIM {name}"
    node = nodes.tree.nodes.get(name)
    if node is None:
        node = nodes.add("ShaderNodeValue")
        node.name = name
        node.outputs[0].default_value = 0.0
    return node.outputs[0]


def fed(socket: bpy.types.NodeSocket) -> Any:
    """What feeds an input: the output that is linked to it, or its value, a float or a tuple of them."""
    if socket.is_linked:
        return socket.links[0].from_socket
    value = socket.default_value
    return value if isinstance(value, float) else tuple(value)


def count(nodes: Nodes, power: Any) -> bpy.types.NodeSocket:
    """The colour that counts a crossing whose share has that POWER."""
    rest = nodes.math("SUBTRACT", 2.0, power)
    return nodes.add("ShaderNodeCombineXYZ", inputs={0: 1.0, 1: rest, 2: power}).outputs[0]

# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands on a side of an interface node: its sockets, and the node of a medium that disperses."""

import math

import bpy

from ..cycles import dispersive
from ..physics import REPRESENTATIVE_NM


def sockets_by_output(node: bpy.types.Node, side: str) -> dict[str, bpy.types.NodeSocket]:
    """The sockets of a side, "inside" or "outside", by what goes into them, dispersive.OUTPUTS; those that there are."""
    sockets = {name: node.inputs.get(f"{name} {side.title()}") for name in dispersive.OUTPUTS}
    return {name: socket for name, socket in sockets.items() if socket}


def medium_node_of(node: bpy.types.Node, side: str) -> bpy.types.Node | None:
    """The node of a medium that disperses which decides the index of a side, or None."""
    links = node.inputs[f"Index {side.title()}"].links
    source = links[0].from_node if links else None
    return source if source and dispersive.is_medium_node(source) else None


def take_away(node: bpy.types.Node, side: str) -> None:
    """Unlink the medium's node of a side of an interface node, if there is one; it leaves the file if nothing else asks it.

    The side keeps the numbers that stand in the sockets.
    """
    tree, source = node.id_data, medium_node_of(node, side)
    if source is None:
        return
    for socket in sockets_by_output(node, side).values():
        for link in [link for link in socket.links if link.from_node == source]:
            tree.links.remove(link)
    if not any(socket.is_linked for socket in source.outputs):
        dispersive.remove(source)


def k_of_length(metres: float) -> float:
    """The extinction of light that falls to 1/e within so many metres, at 550 nm."""
    return REPRESENTATIVE_NM * 1e-9 / (4 * math.pi * metres)

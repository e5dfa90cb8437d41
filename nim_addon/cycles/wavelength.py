# SPDX-License-Identifier: GPL-3.0-or-later
"""The wavelength of a path, as a node: what media that disperse depend on, and what all that shines is multiplied by.

With motion blur each path has a wavelength of its own, the same wherever it goes (closures.SHUTTER); without it, in the
viewport and in bakes, all have the neutral one, and their weight is white. So it is of paths that have met no mirror and
nothing transparent: no interface, then, and what does not depend on the wavelength needs no noise of colours.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..physics import REPRESENTATIVE_NM, VISIBLE_NM
from ..physics.colour import CURVE_POINTS, Wavelengths
from .closures import CLEAR_PATH, SHUTTER
from .closures.backends import resolve
from .nodes import Nodes

MARK = "nim_wavelength"  # the custom property of the group: its backend
LABEL = "NIM Wavelength"
WAVELENGTH, WEIGHT = "Wavelength", "Weight"  # its outputs: nanometres; linear RGB
NEUTRAL, START, WIDTH = "Neutral wavelength", "Start of the stratum", "Width of the stratum"
CLEAR = "1 if clear paths are white"


def group(backend: str = "auto") -> bpy.types.NodeTree:
    """The group of that backend in this file, made on first use. Raises as closures.backends.resolve() does."""
    backend = resolve(backend)
    found = next((tree for tree in bpy.data.node_groups if tree.get(MARK) == backend and not tree.library), None)
    return found or _new_group(backend)


def new_node(tree: bpy.types.NodeTree, backend: str = "auto") -> bpy.types.Node:
    """A new node of the group in a shader's tree, unlinked. Raises as closures.backends.resolve() does."""
    inner = group(backend)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = inner
    node.name = node.label = LABEL
    return node


def is_node(node: bpy.types.Node) -> bool:
    """Whether a node is one of the group, of either backend."""
    return node.type == "GROUP" and node.node_tree is not None and MARK in node.node_tree


def groups() -> Iterator[bpy.types.NodeTree]:
    """The groups of this file that are its own."""
    return (tree for tree in bpy.data.node_groups if MARK in tree and not tree.library)


def set_neutral(wavelength_nm: float = REPRESENTATIVE_NM) -> None:
    """Give all paths without a wavelength of their own this one, nanometres: it is seen where motion blur is off."""
    _set(NEUTRAL, wavelength_nm)


def neutral() -> float:
    """The wavelength, nanometres, that is seen where motion blur is off."""
    return next((tree.nodes[NEUTRAL].outputs[0].default_value for tree in groups()), REPRESENTATIVE_NM)


def set_stratum(number: int = 0, count: int = 1) -> None:
    """Let paths have wavelengths of one of `count` equally likely parts of the spectrum alone, counted from 0."""
    _set(START, number / count)
    _set(WIDTH, 1 / count)


def set_clear_paths(white: bool) -> None:
    """Let light be white that has met no interface, or be weighted by its wavelength as all other."""
    _set(CLEAR, float(white))


def clear_paths_are_white() -> bool:
    """Whether any light that has met no interface is white."""
    return any(CLEAR in tree.nodes and tree.nodes[CLEAR].outputs[0].default_value > 0 for tree in groups())


def _set(name, value):
    for tree in groups():
        if name in tree.nodes and tree.nodes[name].outputs[0].default_value != np.float32(value):
            tree.nodes[name].outputs[0].default_value = value


def _new_group(backend: str) -> bpy.types.NodeTree:
    tree = bpy.data.node_groups.new(LABEL if backend == "osl" else f"{LABEL} (nodes)", "ShaderNodeTree")
    tree[MARK] = backend
    tree.interface.new_socket(
        WAVELENGTH, in_out="OUTPUT", socket_type="NodeSocketFloat"
    ).description = "Vacuum wavelength of this path, nanometres"
    tree.interface.new_socket(
        WEIGHT, in_out="OUTPUT", socket_type="NodeSocketColor"
    ).description = "What light of this wavelength adds to a picture; all that shines is multiplied by it"
    nodes = Nodes(tree)
    shutter = SHUTTER.new_node(tree, backend)
    met = CLEAR_PATH.new_node(tree, backend)
    nodes.added += [shutter, met]
    sampling = Wavelengths.by_importance()

    def value(name, number):
        node = nodes.add("ShaderNodeValue")
        node.name = node.label = name
        node.outputs[0].default_value = number
        return node.outputs[0]

    neutral_nm, start, width = value(NEUTRAL, REPRESENTATIVE_NM), value(START, 0.0), value(WIDTH, 1.0)
    u = nodes.add(
        "ShaderNodeMath",
        inputs={0: shutter.outputs["Share"], 1: width, 2: start},
        operation="MULTIPLY_ADD",
        label="u within the stratum",
    ).outputs[0]
    drawn = curve(nodes, u, sampling.points_nm, "wavelength (u)")
    still = shutter.outputs["Still"]
    wavelength = nodes.add(
        "ShaderNodeMix",
        inputs={"Factor_Float": still, "A_Float": drawn, "B_Float": neutral_nm},
        label="or the neutral one",
    )
    weighted = _colour_curve(nodes, u, sampling.points)
    clear = nodes.math("MULTIPLY", met.outputs["Clear"], value(CLEAR, 1.0))
    weight = nodes.add(
        "ShaderNodeMix",
        inputs={
            "Factor_Float": nodes.math("MAXIMUM", still, clear),
            "A_Vector": weighted,
            "B_Vector": (1.0, 1.0, 1.0),
        },
        data_type="VECTOR",
        label="or white",
    )
    leave = nodes.add("NodeGroupOutput")
    nodes.feed(leave.inputs[WAVELENGTH], _result(wavelength, "Float"))
    nodes.feed(leave.inputs[WEIGHT], _result(weight, "Vector"))
    return tree


def _result(node, type_):
    return next(socket for socket in node.outputs if socket.identifier == f"Result_{type_}")


def curve(nodes: Nodes, x: bpy.types.NodeSocket, points: NDArray, label: str) -> bpy.types.NodeSocket:
    """The output of a curve over x, an output in [0, 1]: the points (CURVE_POINTS,), evenly, straight lines between."""
    low, high = float(points.min()), float(points.max())
    node = nodes.add("ShaderNodeFloatCurve", inputs={"Value": x}, label=label)
    _give(node.mapping, [(points - low) / ((high - low) or 1)])
    return nodes.add(
        "ShaderNodeMath",
        inputs={0: node.outputs[0], 1: high - low, 2: low},
        operation="MULTIPLY_ADD",
        label="in its range",
    ).outputs[0]


def _colour_curve(nodes: Nodes, x: bpy.types.NodeSocket, points: NDArray) -> bpy.types.NodeSocket:
    """The same of three channels (CURVE_POINTS, 3), as a vector."""
    node = nodes.add("ShaderNodeRGBCurve", inputs={"Color": x}, label="weight (u)")
    _give(node.mapping, points.T)
    return node.outputs[0]


def _give(mapping: bpy.types.CurveMapping, columns: Sequence[NDArray]) -> None:
    """Let the first curves of a mapping run straight between the points (CURVE_POINTS,) of each column."""
    mapping.use_clip = False
    for channel, column in zip(mapping.curves, columns, strict=False):
        for place in range(1, CURVE_POINTS - 1):
            channel.points.new(place / (CURVE_POINTS - 1), float(column[place])).handle_type = "VECTOR"
        for end, place, number in ((channel.points[0], 0.0, column[0]), (channel.points[-1], 1.0, column[-1])):
            end.location, end.handle_type = (place, float(number)), "VECTOR"
    mapping.update()


def scaled(nodes: Nodes, wavelength: bpy.types.NodeSocket, low: float, high: float) -> bpy.types.NodeSocket:
    """A number that rises from `low` to `high` as a wavelength, an output in nanometres, does over VISIBLE_NM."""
    first, last = VISIBLE_NM
    rate = (high - low) / (last - first)
    return nodes.add(
        "ShaderNodeMath",
        inputs={0: wavelength, 1: rate, 2: low - rate * first},
        operation="MULTIPLY_ADD",
        label=f"{low:g} at {first:g} nm, {high:g} at {last:g} nm",
    ).outputs[0]

# SPDX-License-Identifier: GPL-3.0-or-later
"""A medium that disperses, as a node: its index, extinction, permeability and absorption at the wavelength of the path.

The group says in custom properties which medium it is. It holds a polynomial of the wavelength where one is as good as
single precision, and a curve of straight lines, 1.4 nm long, where the medium is given by a table that bends.
"""

from __future__ import annotations

import dataclasses
import functools

import bpy
import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray

from ..physics import VISIBLE_NM, Medium
from ..physics.colour import CURVE_POINTS
from . import wavelength
from .closures.backends import resolve
from .nodes import Nodes

MARK, CONTENT = "nim_medium", "nim_medium_content"  # custom properties of a group: the medium's name, and what it is
BACKEND = "nim_medium_backend"
# the outputs, which go to the sockets of that name, Inside or Outside, of an interface
OUTPUTS = ("Index", "Extinction", "Permeability", "Permeability Loss", "Absorption")
_DEGREES = range(1, 17)
_GOOD = 1e-7  # of a polynomial, in parts of the largest value: what single precision can tell


def medium_node(tree: bpy.types.NodeTree, medium: Medium, backend: str = "auto") -> bpy.types.Node:
    """A new node of a medium that disperses in a shader's tree, unlinked; its outputs are OUTPUTS.

    Raises ValueError for a medium that is not known over VISIBLE_NM, and as closures.backends.resolve() does.
    """
    group = _group(medium, resolve(backend))
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.name = node.label = str(group[MARK])
    return node


def is_medium_node(node: bpy.types.Node) -> bool:
    """Whether a node is one of a medium that disperses."""
    return node.type == "GROUP" and node.node_tree is not None and MARK in node.node_tree


def medium_of(node: bpy.types.Node) -> Medium | None:
    """The medium that a node is of; None where it is of none."""
    if not is_medium_node(node) or CONTENT not in node.node_tree:
        return None
    return _read(str(node.node_tree[MARK]), str(node.node_tree[CONTENT]))


@functools.lru_cache(maxsize=64)  # since panels ask while they are drawn
def _read(name, content):
    try:
        medium = Medium.parse(content)
    except ValueError:
        return None
    if medium.dispersion is None:
        return None
    return Medium.dispersive(dataclasses.replace(medium.dispersion, name=name))


def remove(node: bpy.types.Node) -> None:
    """Take a medium's node out of its tree; the groups and the shader's texts that nothing else uses leave the file."""
    group = node.node_tree
    node.id_data.nodes.remove(node)
    _remove_unused(group)


def _remove_unused(group):
    if group is None or group.users or group.library:
        return
    inner = {node.node_tree for node in group.nodes if node.type == "GROUP"}
    texts = {node.script for node in group.nodes if node.type == "SCRIPT" and node.script}
    bpy.data.node_groups.remove(group)
    for one in inner:
        _remove_unused(one)
    for text in texts:
        if text.users <= text.use_fake_user:  # which each new text has
            bpy.data.texts.remove(text)


def switch(material: bpy.types.Material, backend: str) -> int:
    """Give the medium and wavelength nodes of a material the groups of another backend; returns how many there were."""
    backend = resolve(backend)
    count = 0
    for node in material.node_tree.nodes if material.node_tree else ():
        if (medium := medium_of(node)) is not None:
            node.node_tree = _group(medium, backend)
        elif wavelength.is_node(node):
            node.node_tree = wavelength.group(backend)
        else:
            continue
        count += 1
    return count


def _group(medium: Medium, backend: str) -> bpy.types.NodeTree:
    """The group of that medium and backend in this file, made on first use."""
    if medium.dispersion is None:
        raise ValueError(
            f"{medium} is the same at all wavelengths, so it needs no node; set its numbers in the interface."
        )
    content = medium.content
    for tree in bpy.data.node_groups:
        if tree.get(CONTENT) == content and tree.get(BACKEND) == backend and not tree.library:
            return tree
    low, high = VISIBLE_NM
    nm = np.linspace(low, high, CURVE_POINTS)
    n, mu = medium.spectrum(nm)  # raises where it is not known
    tree = bpy.data.node_groups.new(f"NIM Medium {medium}" + ("" if backend == "osl" else " (nodes)"), "ShaderNodeTree")
    tree[MARK], tree[CONTENT], tree[BACKEND] = str(medium), content, backend
    nodes = Nodes(tree)
    path = wavelength.new_node(tree, backend)
    nodes.added.append(path)
    path = path.outputs[wavelength.WAVELENGTH]
    functions = (n.real, n.imag, mu.real, mu.imag, medium.absorptions(nm))
    units = ("", "", "", "", ", per metre")
    for name, unit in zip(OUTPUTS, units, strict=True):
        socket = tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketFloat")
        socket.description = f"{name} of {medium} at the wavelength of the path{unit}"
    leave = tree.nodes.new("NodeGroupOutput")
    for name, values in zip(OUTPUTS, functions, strict=True):
        nodes.feed(leave.inputs[name], _function(nodes, path, values, name))
    leave.location = (len(nodes.added) * 220, 0)
    return tree


def _function(nodes: Nodes, nm: bpy.types.NodeSocket, values: NDArray, name: str) -> bpy.types.NodeSocket:
    """The output that gives a function of the wavelength, of which there are the values (CURVE_POINTS,) over VISIBLE_NM."""
    if np.ptp(values) <= _GOOD * np.abs(values).max():
        node = nodes.add("ShaderNodeValue", label=name)
        node.outputs[0].default_value = float(values.mean())
        return node.outputs[0]
    coefficients = _polynomial(values)
    if coefficients is None:
        return wavelength.curve(nodes, wavelength.scaled(nodes, nm, 0, 1), values, name)
    # from -1 to 1, where powers cancel least
    x = wavelength.scaled(nodes, nm, -1, 1)
    *lower, total = coefficients  # Horner's way, from the highest power down
    for coefficient in reversed(lower):
        total = nodes.add(
            "ShaderNodeMath", inputs={0: total, 1: x, 2: coefficient}, operation="MULTIPLY_ADD", label=name
        ).outputs[0]
    return total


def _polynomial(values: NDArray) -> list[float] | None:
    """Coefficients, of rising powers of x in [-1, 1], of the least polynomial that meets the values; None without one."""
    x = np.linspace(-1, 1, len(values))
    largest = np.abs(values).max()
    for degree in _DEGREES:
        fit = Chebyshev.fit(x, values, degree, domain=(-1, 1))
        if np.abs(fit(x) - values).max() <= _GOOD * largest:
            return fit.convert(kind=np.polynomial.Polynomial).coef.tolist()
    return None

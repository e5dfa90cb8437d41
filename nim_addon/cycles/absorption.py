# SPDX-License-Identifier: GPL-3.0-or-later
"""What a medium absorbs, as a volume: for bodies in which something else stands, which light leaves on no straight way.

A volume that varies with the time of a path is rendered wrongly by Blender 5, so it is constant: of the neutral wavelength
where all paths have that one, and of three channels where each has its own. The node says in a custom property which medium
it is of.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from ..physics import REPRESENTATIVE_NM, Medium
from ..physics.colour import absorption_of_channels, weights
from .nodes import empty_tree

MARK, COLOURED = "nim_absorbs", "nim_absorbs_by_colour"  # custom properties of a node: its medium; whether in channels
SOCKET = "Absorption {}"  # of an interface, Inside or Outside


def absorbs(medium: Medium) -> bool:
    """Whether a medium absorbs any visible light."""
    index, _ = medium.spectrum(weights()[0])
    return bool((index.imag > 0).any())


def volume_material(name: str, medium: Medium) -> bpy.types.Material:
    """A material that has no surface, and within absorbs as that medium does.

    Raises ValueError for a medium that is not known over the visible wavelengths; nothing is made then.
    """
    absorbs(medium)
    material = bpy.data.materials.new(name)
    tree = empty_tree(material)
    absorb(tree.nodes.new("ShaderNodeOutputMaterial"), medium)
    material.diffuse_color = (0.5, 0.7, 0.9, 0.1)
    return material


def absorb(output: bpy.types.Node, medium: Medium, nm: float = REPRESENTATIVE_NM) -> bpy.types.Node:
    """Let the Volume of a material's output absorb as a medium does, at a wavelength; returns the new node."""
    tree = output.id_data
    node = tree.nodes.new("ShaderNodeVolumeAbsorption")
    node.location = (output.location.x - 260, output.location.y - 280)
    node[MARK] = medium.content
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    _show_one(node, medium, nm)
    return node


def leave_to_volume(interface: bpy.types.Node, *sides: str) -> None:
    """Let an interface node take nothing from light on its way to the sides "Inside" and "Outside": a volume does."""
    for socket in (interface.inputs[SOCKET.format(side)] for side in sides):
        for link in list(socket.links):
            interface.id_data.links.remove(link)
        socket.default_value = 0.0


def nodes_of(material: bpy.types.Material) -> Iterator[tuple[bpy.types.Node, Medium]]:
    """The nodes of a material that absorb as a medium does, and the media."""
    for node in material.node_tree.nodes if material.node_tree else ():
        if MARK in node:
            try:
                yield node, Medium.parse(node[MARK])
            except (ValueError, TypeError):  # it was changed by hand
                continue


def show_colours(material: bpy.types.Material) -> None:
    """Let the volumes of a material absorb in three channels, for paths of all wavelengths at once."""
    for node, medium in nodes_of(material):
        node[COLOURED] = True
        _show(node, absorption_of_channels(_coefficients(medium, weights()[0])))


def show_neutral(material: bpy.types.Material, nm: float = REPRESENTATIVE_NM) -> None:
    """Let the volumes of a material absorb as their media do at one wavelength again."""
    for node, medium in nodes_of(material):
        if COLOURED in node:
            del node[COLOURED]
        _show_one(node, medium, nm)


def set_neutral(nm: float = REPRESENTATIVE_NM) -> None:
    """Let all volumes of the file that do not absorb by colour do so as their media at a wavelength, nanometres."""
    for material in bpy.data.materials:
        for node, medium in nodes_of(material) if not material.library else ():
            if COLOURED not in node:
                _show_one(node, medium, nm)


def _show_one(node, medium, nm):
    _show(node, np.full(3, float(_coefficients(medium, np.array(nm)))))


def _coefficients(medium, nm):
    """What a medium absorbs, per metre, at wavelengths (...); where its k is one number, at all what it does at 550 nm.

    So it is in the socket of an interface.
    """
    if medium.dispersion is None:
        return np.full(np.shape(nm), medium.absorption())
    return medium.absorptions(nm)


def _show(node, alpha):
    """Let a node absorb alpha (3,) per metre of red, green and blue; only what differs is written."""
    density = float(alpha.max())
    colour = (*(1 - alpha / (density or 1.0)), 1.0)
    for socket, value in ((node.inputs["Density"], density), (node.inputs["Color"], colour)):
        if np.any(np.float32(value) != np.float32(socket.default_value)):
            socket.default_value = value

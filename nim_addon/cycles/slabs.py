# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of a uniaxial slab, for scripts: made, and read again as physics."""

from __future__ import annotations

import contextlib
import functools

import bpy

from ..physics.uniaxial import UniaxialSlab
from .closures import UNIAXIAL_SLAB
from .material import number_of
from .surface import surface_material

NUMBERS = ("Permittivity Across", "Permittivity Along", "Thickness")


def slab_material(name: str, slab: UniaxialSlab, *, backend: str = "auto") -> bpy.types.Material:
    """A material for the two faces of a slab of a uniaxial medium, both of which look out of it.

    name:    of the new material; Blender appends .001 where it is taken
    slab:    its thickness is in the object's own space, so that it is scaled with the object; it must be the distance of
             the faces there
    backend: "osl", the closure of osl/nim_uniaxial_slab.osl; "nodes", the same in Blender's own nodes; or "auto", the
             first where this build has OSL, else the second
    Each hit is the whole slab, so a plate needs no rim. The material renders without this add-on.
    Raises TypeError for what is no UniaxialSlab, ValueError for an unknown backend, RuntimeError for "osl" in a Blender
    without OSL; nothing is made then.
    """
    _check(slab)
    UNIAXIAL_SLAB.group(backend)  # raises, if it must, before there is a material
    make = functools.partial(slab_node, slab=slab, backend=backend)
    return surface_material(name, make, bends_backwards=slab.is_hyperbolic)


def slab_node(tree: bpy.types.NodeTree, slab: UniaxialSlab, *, backend: str = "auto") -> bpy.types.Node:
    """A new node of a uniaxial slab in a shader's tree, unlinked. Raises as slab_material() does."""
    _check(slab)
    node = UNIAXIAL_SLAB.new_node(tree, backend)
    for socket, number in zip(NUMBERS, (slab.across, slab.along, slab.thickness), strict=True):
        node.inputs[socket].default_value = number
    return node


def slab_of(node: bpy.types.Node, path: tuple = ()) -> UniaxialSlab | None:
    """The UniaxialSlab that the values of a node of one describe, its thickness in the object's own space.

    path: the groups that it is in, as material.asked_closures() gives them. None where a node other than a Value decides a
    number, or where one is out of range.
    """
    across, along, thickness = (number_of(node.inputs[socket], path) for socket in NUMBERS)
    if across is None or along is None or thickness is None:
        return None
    with contextlib.suppress(ValueError):
        return UniaxialSlab(across, along, thickness)
    return None


def _check(slab):
    if not isinstance(slab, UniaxialSlab):
        raise TypeError(f"slab = {slab!r} is no UniaxialSlab; give one, such as UniaxialSlab(2.0, -3.0, 0.25).")

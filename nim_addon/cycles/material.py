# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of an interface between two media, for scripts: made, and read again as physics."""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Sequence

import bpy
import numpy as np

from ..physics import MEDIA, REPRESENTATIVE_NM, VISIBLE_NM, AbsorptionLength, Interface, Medium
from ..physics.media import LEAST_MAGNITUDE, MOST_MAGNITUDE
from . import absorption, closures, dispersive, graded
from .closures import INTERFACE, closure_of_node
from .closures.backends import osl_available, resolve
from .surface import surface_material
from .visibility import Asked, asked, is_interface, value_of

__all__ = [
    "NODE_NAME",
    "absorb_by_volume",
    "absorbs",
    "asked_closures",
    "asked_interfaces",
    "glass_index",
    "interface_material",
    "interface_node",
    "interface_nodes",
    "interface_of",
    "is_rough",
    "medium_of",
    "number_of",
    "osl_available",
    "resolve",
    "set_medium",
    "switch_backend",
]

NODE_NAME = INTERFACE.label
GLASSES = ("BSDF_GLASS", "BSDF_REFRACTION", "BSDF_PRINCIPLED")  # nodes of Blender that let light through by an index
ROUNDING = 1e-6  # in parts of a number, of what a socket holds


def interface_material(
    name: str,
    inside: Medium,
    outside: Medium = MEDIA["air"],
    *,
    backend: str = "auto",
    tint: Sequence[float] = (1.0, 1.0, 1.0),
    volume: bool = False,
    roughness: float = 0.0,
) -> bpy.types.Material:
    """A material for the interface between two media.

    name:            of the new material; Blender appends .001 where it is taken
    inside, outside: Medium behind the faces, and on the side the normals point to
    backend:         "osl", the closure of osl/nim_interface.osl; "nodes", the same in Blender's own nodes; or "auto",
                     the first where this build has OSL, else the second
    tint:            linear RGB factor on all light that meets the interface, three numbers from 0 to 1
    volume:          whether what the inside absorbs is a volume of the material, for bodies in which something else
                     stands: constant along a path (cycles.absorption). Otherwise the interface takes it from light
                     that comes to it on a straight way from face to face, which is right for solid bodies
    roughness:       of the surface, from 0, smooth, to 1, as in Blender's Glass
    The material renders without this add-on, and its node "NIM Interface" holds the parameters.
    Raises TypeError for what is no Medium, ValueError for one that is not known over the visible wavelengths, for such a
    tint or roughness or an unknown backend, RuntimeError for "osl" in a Blender without OSL; nothing is made then.
    """
    _check_media(inside, outside)
    tint = _checked_tint(tint)
    if not 0 <= roughness <= 1:
        raise ValueError(f"roughness = {roughness!r} is out of range; give a number from 0, smooth, to 1.")
    INTERFACE.group(backend)  # raises, if it must, before there is a material
    make = functools.partial(interface_node, inside=inside, outside=outside, backend=backend)
    # how solid view shows it: NIMs warm, dielectrics cool
    material = surface_material(name, make, bends_backwards=inside.is_nim or outside.is_nim)
    (node,) = interface_nodes(material)
    node.inputs["Tint"].default_value = (*tint, 1.0)
    node.inputs["Roughness"].default_value = roughness
    if volume and absorption.absorbs(inside):
        absorb_by_volume(node, material.node_tree.get_output_node("ALL"))
    return material


def absorb_by_volume(node: bpy.types.Node, output: bpy.types.Node) -> None:
    """Let a volume, at an output of the material, take what an interface node absorbs inside, in its place."""
    alpha = number_of(node.inputs["Absorption Inside"])
    medium = medium_of(node, "Inside") or Medium.of_index(1.0, AbsorptionLength(1 / alpha) if alpha else 0.0)
    absorption.leave_to_volume(node, "Inside")
    absorption.absorb(output, medium)


def interface_node(
    tree: bpy.types.NodeTree, inside: Medium, outside: Medium = MEDIA["air"], *, backend: str = "auto"
) -> bpy.types.Node:
    """A new interface node between two media in a shader's node tree, unlinked.

    Raises TypeError for what is no Medium, ValueError for one that is not known over the visible wavelengths, and as
    resolve() does; nothing is made then.
    """
    _check_media(inside, outside)
    node = INTERFACE.new_node(tree, backend)
    for side, medium in (("Inside", inside), ("Outside", outside)):
        set_medium(node, side, medium)
    return node


def set_medium(node: bpy.types.Node, side: str, medium: Medium) -> None:
    """Let an interface node have a medium on a side, "Inside" or "Outside".

    One that disperses is a node of its own, linked to the sockets of that side; another one's numbers stand in them. What
    stood there is taken away. Raises ValueError for a medium that is not known over the visible wavelengths.
    """
    tree = node.id_data
    sockets = {name: node.inputs[f"{name} {side}"] for name in dispersive.OUTPUTS if f"{name} {side}" in node.inputs}
    # made before the other goes, since it may be refused
    disperses = medium.dispersion is not None and medium.dispersion.has_colours
    source = dispersive.medium_node(tree, medium, INTERFACE.backend_of(node.node_tree)) if disperses else None
    former = {link.from_node for socket in sockets.values() for link in socket.links}
    for link in [link for socket in sockets.values() for link in socket.links]:
        tree.links.remove(link)
    for other in former:
        if dispersive.is_medium_node(other) and not any(socket.is_linked for socket in other.outputs):
            dispersive.remove(other)
    numbers = (medium.n, medium.k, medium.mu, medium.mu_imag, medium.absorption())
    for name, number in zip(dispersive.OUTPUTS, numbers, strict=True):
        if name in sockets:
            sockets[name].default_value = number
            if source:
                tree.links.new(source.outputs[name], sockets[name])
    if source:
        source.location = (node.location.x - 320, node.location.y - (0 if side == "Inside" else 220))


def medium_of(node: bpy.types.Node, side: str) -> Medium | None:
    """The medium that disperses and is linked to a side, "Inside" or "Outside", of an interface node; else None."""
    links = node.inputs[f"Index {side}"].links
    return dispersive.medium_of(links[0].from_node) if links else None


def _check_media(inside, outside):
    for name, medium in (("inside", inside), ("outside", outside)):
        if not isinstance(medium, Medium):
            raise TypeError(f"{name} = {medium!r} is no Medium; give one, such as Medium(-1.5) or MEDIA['water'].")
        medium.spectrum(VISIBLE_NM)  # raises where it is not known


def _checked_tint(tint):
    """The three numbers of a tint; ValueError, one sentence, where it is anything else."""
    try:
        numbers = [float(number) for number in tint]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3 or not all(0 <= number <= 1 for number in numbers):
        raise ValueError(f"tint = {tint!r} is no colour; give three numbers from 0 to 1, such as (1.0, 0.5, 0.5).")
    return numbers


def interface_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The interface nodes of a material (or None), those of a group within a group not counted."""
    return INTERFACE.nodes_of(material)


def switch_backend(material: bpy.types.Material, backend: str) -> int:
    """Give every node of our closures, of media that disperse and of graded balls in a material the group of another backend.

    Values and links stay. Returns how many nodes there were. Raises as resolve() does.
    """
    backend = resolve(backend)
    return sum(kind.switch(material, backend) for kind in (dispersive, graded)) + sum(
        closure.switch(material, backend) for closure in closures.CLOSURES if closure.nodes_of(material)
    )


def asked_interfaces(material: bpy.types.Material | None) -> list[Asked]:
    """The interface nodes that a render asks for the surface of a material, those in a person's own groups too."""
    return [found for found in asked(material) if is_interface(found.node)]


def asked_closures(material: bpy.types.Material | None) -> list[Asked]:
    """The same for the nodes of any of our closures."""
    return [found for found in asked(material) if closure_of_node(found.node)]


def interface_of(node: bpy.types.Node, path: tuple = ()) -> Interface | None:
    """The physics.Interface that the values of an interface node describe, as both shaders read them.

    path: the groups that it is in, as asked_interfaces() gives them. Without loss the permeabilities count by magnitude.
    Returns None where a node other than a Value, or than that of a medium that disperses, decides an index or a
    permeability, or where one is 0 or out of a Medium's range.
    """
    inside, outside = (_medium_of_side(node, side, path) for side in ("Inside", "Outside"))
    return Interface(inside, outside) if inside and outside else None


def glass_index(material: bpy.types.Material | None) -> float | None:
    """The index of refraction of Blender's own glass in a material (or None), which may be a clear Principled BSDF.

    None where there is none, or where a node other than a Value decides it.
    """
    for node, path in asked(material):
        if node.type in GLASSES:
            through = node.inputs.get("Transmission Weight")  # of a Principled BSDF, which may be opaque
            n = number_of(node.inputs["IOR"], path)
            if n and (through is None or value_of(through, path) != 0):
                return n
    return None


def _medium_of_side(node, side, path):
    if (dispersed := medium_of(node, side)) is not None:
        return dispersed
    # groups of the first two versions have no losses
    held = (node.inputs.get(f"{quantity} {side}") for quantity in dispersive.OUTPUTS)
    n, k, mu, mu_imag, alpha = (0.0 if socket is None else number_of(socket, path) for socket in held)
    if n is None or k is None or mu is None or mu_imag is None:
        return None
    if not k and not mu_imag:
        if not all(LEAST_MAGNITUDE <= abs(value) <= MOST_MAGNITUDE for value in (n, mu)):
            return None
        mu, k = math.copysign(mu, n), alpha * REPRESENTATIVE_NM * 1e-9 / (4 * math.pi) if alpha else 0.0
    return _medium(complex(n, k), complex(mu, mu_imag))


def _medium(index, mu):
    """The Medium of a complex index and permeability, mu turned round as the shaders do it, or None.

    They are of single precision: what is within its rounding of a medium without gain is that medium.
    """
    if (mu * index.conjugate()).real < 0:
        mu = -mu
    with contextlib.suppress(ValueError):
        return Medium(index, mu)
    with contextlib.suppress(ValueError, ZeroDivisionError, OverflowError):
        epsilon = index * index / mu
        if -ROUNDING * abs(epsilon) < epsilon.imag < 0:
            near = Medium.of(epsilon.real, mu)
            return near if abs(near.index - index) <= ROUNDING * abs(index) else None
    return None


def absorbs(node: bpy.types.Node, side: str, path: tuple = ()) -> float:
    """What an interface node takes itself on a side, "Inside" or "Outside": per metre, the most of all wavelengths.

    path: as of interface_of(). inf where a node decides it that is not of a medium; 0 for groups of earlier versions.
    """
    socket = node.inputs.get(f"Absorption {side}")
    if socket is None:
        return 0.0
    links = socket.links
    if links and (dispersed := dispersive.medium_of(links[0].from_node)):
        return float(dispersed.absorptions(np.linspace(*VISIBLE_NM, 15)).max())
    alpha = number_of(socket, path)
    return math.inf if alpha is None else alpha


def is_rough(node: bpy.types.Node, path: tuple = ()) -> bool:
    """Whether the surface of an interface node is rough, or may be, since a node other than a Value decides that.

    path: as for interface_of(). A node of a group of an earlier version is smooth.
    """
    socket = node.inputs.get("Roughness")
    roughness = number_of(socket, path) if socket else 0.0
    return roughness is None or roughness > 0


def number_of(socket: bpy.types.NodeSocket, path: tuple = ()) -> float | None:
    """The number that an input is given where no node but a Value decides it; None where one does, a colour too."""
    value = value_of(socket, path)
    return None if isinstance(value, tuple) else value

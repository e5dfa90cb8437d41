# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of a window of lenslets, for scripts: made, and read again as physics."""

from __future__ import annotations

import contextlib
import functools

import bpy

from ..physics.lenslet import LensletWindow
from .closures import LENSLET_WINDOW
from .material import number_of
from .surface import surface_material

NUMBERS = ("Eta U", "Eta V", "Offset U", "Offset V", "Aperture", "Losses")


def lenslet_material(name: str, window: LensletWindow, *, backend: str = "auto") -> bpy.types.Material:
    """A material for a window of lenslets; each face that wears it is one, in front where its normal points.

    name:    of the new material; Blender appends .001 where it is taken
    window:  whose u is the object's x axis as it lies in the face, or its y axis where the face looks along x
    backend: "osl", the closure of osl/nim_lenslet_window.osl; "nodes", the same in Blender's own nodes; or "auto", the
             first where this build has OSL, else the second
    Nothing of it is a length: the object may be moved, turned and scaled. The material renders without this add-on.
    Raises TypeError for what is no LensletWindow, ValueError for an unknown backend, RuntimeError for "osl" in a Blender
    without OSL; nothing is made then.
    """
    _check(window)
    LENSLET_WINDOW.group(backend)  # raises, if it must, before there is a material
    make = functools.partial(lenslet_node, window=window, backend=backend)
    return surface_material(name, make, bends_backwards=min(window.eta) < 0)


def lenslet_node(tree: bpy.types.NodeTree, window: LensletWindow, *, backend: str = "auto") -> bpy.types.Node:
    """A new node of a window of lenslets in a shader's tree, unlinked. Raises as lenslet_material() does."""
    _check(window)
    node = LENSLET_WINDOW.new_node(tree, backend)
    set_window(node, window)
    return node


def set_window(node: bpy.types.Node, window: LensletWindow) -> None:
    """Give a node of a window of lenslets the numbers of a LensletWindow."""
    losses = 0.0 if window.aperture is None else 1.0
    # ideal lenslets keep the width that stands there
    aperture = node.inputs["Aperture"].default_value if window.aperture is None else window.aperture
    for socket, number in zip(NUMBERS, (*window.eta, *window.offset, aperture, losses), strict=True):
        node.inputs[socket].default_value = number


def window_of(node: bpy.types.Node, path: tuple = ()) -> LensletWindow | None:
    """The LensletWindow that the values of a node of one describe.

    path: the groups that it is in, as material.asked_closures() gives them. Losses of a half and more count as all.
    None where a node other than a Value decides a number, or where one is out of range.
    """
    numbers = [number_of(node.inputs[socket], path) for socket in NUMBERS]
    if None in numbers:
        return None
    eta_u, eta_v, offset_u, offset_v, aperture, losses = numbers
    with contextlib.suppress(ValueError):
        return LensletWindow((eta_u, eta_v), (offset_u, offset_v), aperture if losses >= 0.5 else None)
    return None


def _check(window):
    if not isinstance(window, LensletWindow):
        raise TypeError(f"window = {window!r} is no LensletWindow; give one, such as LensletWindow(-1.0).")

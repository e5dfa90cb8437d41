# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures: how a surface bends light, each as a shader in OSL and as the same formulas in Blender's own nodes.

A closure is a file in osl/, a file here with its sockets and its twin in nodes, and its name in CLOSURES.
"""

from __future__ import annotations

import bpy

from .clear_path import CLEAR_PATH
from .closure import Closure, Socket, version_of
from .graded_ball import GRADED_BALL
from .graded_core import GRADED_CORE
from .interface import INTERFACE
from .lenslet_window import LENSLET_WINDOW
from .shutter import SHUTTER
from .uniaxial_slab import UNIAXIAL_SLAB

__all__ = [
    "CLEAR_PATH",
    "CLOSURES",
    "GRADED_BALL",
    "GRADED_CORE",
    "INTERFACE",
    "LENSLET_WINDOW",
    "SHUTTER",
    "UNIAXIAL_SLAB",
    "Closure",
    "Socket",
    "closure_of",
    "closure_of_node",
    "version_of",
]

# SHUTTER and CLEAR_PATH bend no light: they tell the others, and all that shines, what path it is
CLOSURES = (INTERFACE, SHUTTER, CLEAR_PATH, GRADED_BALL, GRADED_CORE, LENSLET_WINDOW, UNIAXIAL_SLAB)


def closure_of(tree: bpy.types.NodeTree | None) -> Closure | None:
    """The closure whose shared group a node tree says that it is, whole or not; None where it says nothing."""
    return next((closure for closure in CLOSURES if closure.is_of(tree)), None)


def closure_of_node(node: bpy.types.Node) -> Closure | None:
    """The closure that a node is of, as Closure.is_node() has it; None where it is of none."""
    return next((closure for closure in CLOSURES if closure.is_node(node)), None)

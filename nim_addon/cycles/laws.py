# SPDX-License-Identifier: GPL-3.0-or-later
"""What our closures other than the interface do to rays, read from a material: the physics.laws.Law of a surface."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
from numpy.typing import NDArray

from ..physics.balls import Ball, Shell
from ..physics.laws import Law
from ..physics.lenslet import Pane
from ..physics.uniaxial import Plate
from .closures import GRADED_BALL, GRADED_CORE, LENSLET_WINDOW, UNIAXIAL_SLAB, closure_of_node
from .graded import profile_of
from .lenslets import window_of
from .material import asked_closures, number_of
from .slabs import slab_of
from .visibility import Asked


def asked_law(material: bpy.types.Material | None) -> Asked | None:
    """The node of a material that law_of() reads, the first that a render asks; None where there is none."""
    return next((found for found in asked_closures(material) if closure_of_node(found.node) in READERS), None)


def law_of(found: Asked, matrix: NDArray) -> Law | None:
    """The law of the surface of an object, by its closure's node; None where a link or a function decides what it is.

    found: as asked_law() gives it; matrix: (4, 4) of the object, from its own space to the world
    """
    closure = closure_of_node(found.node)
    return READERS[closure](found, np.asarray(matrix, float)) if closure in READERS else None


def _ball(found, matrix):
    # its node is within that of its profile
    profile = profile_of(found.path[-1]) if found.path else None
    radius = number_of(found.node.inputs["Radius"], found.path)
    if profile is None or radius is None:
        return None
    kind = Shell if closure_of_node(found.node) is GRADED_CORE else Ball
    return kind(profile, matrix[:3, 3], radius * float(np.linalg.norm(matrix[:3, 0])))


def _pane(found, matrix):
    window = window_of(*found)
    return window and Pane(window, matrix[:3, :2].T)


def _plate(found, matrix):
    slab = slab_of(*found)
    return slab and Plate(slab, matrix[:3, :3])


# {closure: function(its Asked, matrix) that gives the Law, or None where it cannot be told}
READERS: dict[object, Callable[[Asked, NDArray], Law | None]] = {
    GRADED_BALL: _ball,
    GRADED_CORE: _ball,
    LENSLET_WINDOW: _pane,
    UNIAXIAL_SLAB: _plate,
}

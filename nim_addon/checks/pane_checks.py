# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of lenslets and uniaxial slabs that a render cannot show: numbers that are none, plates of another thickness."""

from __future__ import annotations

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles import meshes
from ..cycles.closures import LENSLET_WINDOW, UNIAXIAL_SLAB, closure_of_node
from ..cycles.material import asked_closures, number_of
from ..cycles.problem import LINKED, Problem, about
from ..cycles.slabs import slab_of
from ..cycles.visibility import end_of
from .ray_checks import give_size, sizeless
from .sight import Sight

NEVER_ZERO = {
    LENSLET_WINDOW: ("Eta U", "Eta V"),
    UNIAXIAL_SLAB: ("Permittivity Across", "Permittivity Along", "Thickness"),
}
WITHIN = 1e-3  # of the thickness
MOST_NORMALS = 24  # of what is a plate, be it one with a bevelled rim


def find(sight: Sight) -> list[Problem]:
    """The Problems of the windows and slabs of a sight."""
    found = [problem for material in sight.ours for problem in _numbers(material)] + _plates(sight)
    # of interfaces and of graded balls others say it
    panes = {closure_of_node(node) for material in sight.ours for node, _ in asked_closures(material)}
    return found + (_lamps(sight) if panes and panes <= set(NEVER_ZERO) else [])


def _lamps(sight):
    text = "The light {name} has no size: a window casts a shadow in it, and is never seen to bend it."
    lights = [lamp for lamp in sight.lamps if not lamp.data.cycles.is_portal and sizeless(lamp.data)]
    return [about(lamp, "light_at_pane", text, "Give it a size") for lamp in lights]


def _numbers(material):
    for node, path in asked_closures(material):
        closure = closure_of_node(node)
        for name in NEVER_ZERO.get(closure, ()):
            if number_of(node.inputs[name], path) == 0:
                text = "{material}: {socket} is 0, so that nothing is seen through it: give it another value."
                yield _of(material, "pane_number", text, None, socket=name)
        if closure is LENSLET_WINDOW and _is_shut(node, path):
            text = "{material}: the aperture is 0, so that all light misses the second lenslets."
            yield _of(material, "aperture", text, "Lose nothing")


def _is_shut(node, path):
    return number_of(node.inputs["Aperture"], path) == 0 and number_of(node.inputs["Losses"], path) != 0


def _of(material, code, text, remedy, **values):
    texts = (text, LINKED) if material.library else (text,)
    values["material"] = material.name
    return Problem(code, texts, values, None if material.library else remedy, (), (material.name,))


def _plates(sight):
    found = {}
    for shown in sight.shown:
        for material in filter(None, shown.materials):
            slab = _slab(material)
            if not slab or (shown.original, material) in found:
                continue
            thickness = sight.measured(shown, "plate", _thickness)
            if thickness is None or math.isnan(thickness) or abs(thickness - slab.thickness) <= WITHIN * slab.thickness:
                continue
            found[shown.original, material] = _other_thickness(shown.original, material, thickness, slab.thickness)
    return list(found.values())


def _slab(material):
    nodes = [(node, path) for node, path in asked_closures(material) if closure_of_node(node) is UNIAXIAL_SLAB]
    return slab_of(*nodes[0]) if nodes else None


def _other_thickness(obj, material, thickness, said):
    values = {"is": f"{thickness:.4g}", "says": f"{said:.4g}"}
    if thickness == 0:
        text = "{name} has one face alone: from behind there is no slab, and light from there goes straight on."
        return about(obj, "slab_open", text, None, (material.name,), owner=obj)
    text = "{name} is {is} thick, but its slab has a thickness of {says}: light leaves it somewhere else."
    remedy = None if material.library else "Take the object's thickness"
    return about(obj, "slab_thickness", text, remedy, (material.name,), owner=obj, thickness=thickness, **values)


def _thickness(mesh: bpy.types.Mesh) -> float:
    """How far the two faces of a plate are apart, in its own space: 0 of one face alone, NaN of what is no plate."""
    normals = meshes.read(mesh.polygons, "normal", 3)
    normals = normals[np.unique(normals.round(4), axis=0, return_index=True)[1]] if len(normals) else normals
    if not 0 < len(normals) <= MOST_NORMALS:
        return math.nan
    heights: NDArray = meshes.vertices(mesh).astype(float) @ normals.T
    extents = np.ptp(heights, axis=0)
    # of a box the shortest side; what is left of rounding is none
    return 0.0 if extents.min() <= 1e-6 * extents.max() or len(normals) == 1 else float(extents.min())


def _lose_nothing(scene, problem):
    for name in problem.materials:
        for node, path in asked_closures(bpy.data.materials[name, None]):
            if closure_of_node(node) is LENSLET_WINDOW and _is_shut(node, path):
                end_of(node.inputs["Losses"], path)[0].default_value = 0.0


def _take_thickness(scene, problem):
    for name in problem.materials:
        for node, path in asked_closures(bpy.data.materials[name, None]):
            if closure_of_node(node) is UNIAXIAL_SLAB:
                end_of(node.inputs["Thickness"], path)[0].default_value = problem.values["thickness"]


MENDS = {"aperture": _lose_nothing, "slab_thickness": _take_thickness, "light_at_pane": give_size}

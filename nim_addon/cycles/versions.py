# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups of earlier versions, brought up to date in place: every material keeps its values and links."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from .closures import Closure, backends, closure_of, closure_of_node, version_of
from .closures.closure import EEVEE
from .surface import show_in_eevee


class Update(NamedTuple):
    """What update() did: the names of the groups it brought up to date, and a sentence on each that it left alone."""

    updated: list[str]
    left_alone: list[str]


def outdated() -> list[bpy.types.NodeTree]:
    """The closures' groups of this file, linked ones too, that are of another version or not whole."""
    return [group for group, _ in _outdated()]


def _outdated():
    ours = [(group, closure_of(group)) for group in bpy.data.node_groups]
    return [(group, closure) for group, closure in ours if closure and not closure.is_present(group)]


def update() -> Update:
    """Bring every closure's group of this file up to date.

    Left alone, with a sentence, is what cannot be changed here: a group linked from a library, one of a later version,
    and one whose shader has to be compiled in a Blender without OSL. Nothing is compiled unless the shader changed.
    """
    answer = Update([], [])
    for group, closure in _outdated():
        reason = _hindrance(group, closure)
        if reason:
            answer.left_alone.append(f"{group.name} {reason}")
        else:
            closure.refill(group)
            answer.updated.append(group.name)
    if answer.updated:
        for node in _alone():
            show_in_eevee(node)
    return answer


def _alone():
    """The nodes of ours that are all of a material, whose only output theirs is linked to."""
    for material in bpy.data.materials:
        nodes = material.node_tree.nodes if material.node_tree and not material.library else ()
        outputs = [node for node in nodes if node.type == "OUTPUT_MATERIAL"]
        for link in outputs[0].inputs["Surface"].links if len(outputs) == 1 else ():
            if EEVEE.name in link.from_node.outputs and closure_of_node(link.from_node):
                yield link.from_node


def _hindrance(group: bpy.types.NodeTree, closure: Closure) -> str | None:
    """Why a group cannot be brought up to date here, or None."""
    if group.library:
        return f"is linked from {bpy.path.basename(group.library.filepath)}: open that file, and save it."
    if version_of(group) > closure.version:
        return "was made by a later version of this add-on: install that one to change it."
    if closure.backend_of(group) == "osl" and not backends.osl_available() and closure.needs_compiling(group):
        return "holds an earlier shader, which only a Blender with OSL can compile: open the file there."
    return None

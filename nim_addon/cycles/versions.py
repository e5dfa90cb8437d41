# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups of earlier versions, brought up to date in place: every material keeps its values and links."""

from typing import NamedTuple

import bpy

from . import material, script_node
from .visibility import is_marked


class Update(NamedTuple):
    """What update() did: the names of the groups it brought up to date, and a sentence on each that it left alone."""

    updated: list
    left_alone: list


def outdated():
    """The interface groups of this file, linked ones too, that are of another version or not whole; a list."""
    return [group for group in bpy.data.node_groups if is_marked(group) and not material.is_present(group)]


def update():
    """Bring every interface group of this file up to date; returns an Update.

    Left alone, with a sentence, is what cannot be changed here: a group linked from a library, one of a later version,
    and one whose shader has to be compiled in a Blender without OSL. Nothing is compiled unless the shader changed.
    """
    answer = Update([], [])
    for group in outdated():
        reason = _hindrance(group)
        if reason:
            answer.left_alone.append(f"{group.name} {reason}")
        else:
            material.refill(group)
            answer.updated.append(group.name)
    return answer


def _hindrance(group):
    """Why a group cannot be brought up to date here, or None."""
    if group.library:
        return f"is linked from {bpy.path.basename(group.library.filepath)}: open that file, and save it."
    if material.version_of(group) > material.VERSION:
        return "was made by a later version of NIM for Blender: install that one to change it."
    if material.backend_of(group) == "osl" and not material.osl_available():
        script = material.script_of(group)
        if not (script and script.script and script.script.as_string() == script_node.shader_source()):
            return "holds an earlier shader, which only a Blender with OSL can compile: open the file there."
    return None

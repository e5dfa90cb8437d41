# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups of earlier versions, brought up to date in place: every material keeps its values and links."""

from typing import NamedTuple

import bpy

from . import material, script_node


class Update(NamedTuple):
    """What update() did: the names of the groups it brought up to date, and a sentence on each that it left alone."""

    updated: list
    left_alone: list


def outdated():
    """The interface groups of this file, linked ones too, whose version is not the present one; a list."""
    return [
        group
        for group in bpy.data.node_groups
        if group.get(material.MARK) and group.get(material.VERSION_MARK, 1) != material.VERSION
    ]


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
            _bring_up(group)
            answer.updated.append(group.name)
    return answer


def _backend(group):
    # the first version knew no nodes, and marked its groups with a 1
    return group[material.MARK] if group[material.MARK] in material.GROUP_NAMES else "osl"


def _script(group):
    return next((node for node in group.nodes if node.type == "SCRIPT"), None)


def _hindrance(group):
    """Why a group cannot be brought up to date here, or None."""
    if group.library:
        return f"is linked from {bpy.path.basename(group.library.filepath)}: open that file, and save it."
    if group.get(material.VERSION_MARK, 1) > material.VERSION:
        return "was made by a later version of NIM for Blender: install that one to change it."
    if _backend(group) == "osl" and not material.osl_available():
        script = _script(group)
        if not (script and script.script and script.script.as_string() == script_node.shader_source()):
            return "holds an earlier shader, which only a Blender with OSL can compile: open the file there."
    return None


def _bring_up(group):
    backend = _backend(group)
    script = _script(group)
    kept = (script.script, script.bytecode, script.bytecode_hash) if script else (None, "", "")
    had = {item.name for item in group.interface.items_tree}
    material.fill_group(group, backend)
    if backend == "osl":
        script_node.restore(group, *kept)
    # a socket that is new stands at 0 in the nodes that were there before it
    new = [socket for socket in material.SOCKETS if socket.name not in had]
    for node in _users(group) if new else ():
        for socket in new:
            node.inputs[socket.name].default_value = socket.default


def _users(group):
    trees = [*bpy.data.node_groups, *(one.node_tree for one in bpy.data.materials if one.node_tree)]
    return [node for tree in trees for node in tree.nodes if node.type == "GROUP" and node.node_tree == group]

# SPDX-License-Identifier: GPL-3.0-or-later
"""A closure as a script node: a shader of osl/, compiled into the file that uses it."""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections.abc import Iterable
from typing import NamedTuple

import bpy

from ...base import shipped
from ...base.files import temporary


class Compiled(NamedTuple):
    """What a script node holds of a shader: its text, its bytecode, and the md5 that Cycles keys it by."""

    text: bpy.types.Text | None
    bytecode: str
    hash: str


def source(shader: str) -> str:
    """The text of a shader of osl/: beside the package in a checkout, within it once installed."""
    return shipped.shader(shader).read_text(encoding="utf-8")


def bytecode_of(shader: str, text: str) -> str:
    """Bytecode of a shader's text. The only caller of the private compiler."""
    import _cycles

    with temporary() as folder:
        osl, oso = folder / f"{shader}.osl", folder / f"{shader}.oso"
        osl.write_text(text, encoding="utf-8")
        if not _cycles.osl_compile(str(osl), str(oso)):
            raise RuntimeError(f"this Blender's OSL compiler refused {shader}.osl; the console says where.")
        # the compiler notes its options and where sources lay: nothing of this machine goes into a user's file
        lines = oso.read_text(encoding="utf-8").splitlines(keepends=True)
    bytecode = "".join(line for line in lines if not line.startswith("#"))
    return re.sub(r'%filename\{"[^"]*/', '%filename{"', bytecode)


@contextlib.contextmanager
def _quiet_engine():
    """Cycles compiles a script node as soon as its text is set, through a module that the wheels hide: not wanted."""
    scene = bpy.context.scene
    engine = scene.render.engine
    scene.render.engine = "BLENDER_WORKBENCH"
    try:
        yield
    finally:
        scene.render.engine = engine


def script_of(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """The script node of a node group, or None."""
    return next((node for node in tree.nodes if node.type == "SCRIPT"), None)


def fill(tree: bpy.types.NodeTree, shader: str, sockets: Iterable, outputs: Iterable) -> None:
    """Put the script node into the empty group `tree`, linked to its interface; update() compiles it.

    sockets, outputs: closure.Socket and .Output of the interface, with the shader's parameters as identifiers
    """
    script = tree.nodes.new("ShaderNodeScript")
    script.name = script.label = f"{shader}.osl"
    script.width = 220
    entry, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    entry.location, leave.location = (-260, 0), (280, 0)
    for output in outputs:
        inner = script.outputs.new(output.type, output.name, identifier=output.identifier)
        tree.links.new(inner, leave.inputs[output.name])
    for socket in sockets:
        inner = script.inputs.new(socket.type, socket.name, identifier=socket.identifier)
        inner.default_value = socket.default
        tree.links.new(entry.outputs[socket.name], inner)


def update(tree: bpy.types.NodeTree, shader: str, text: str) -> None:
    """Give the script node of the group `tree` the shader's text and its bytecode, if it has another."""
    held = compiled_in(tree).text
    if held is None or held.as_string() != text:
        bytecode = bytecode_of(shader, text)
        held = held or bpy.data.texts.new(f"{shader}.osl")
        held.use_fake_user = False  # a new text has one, and would outlive its last material
        held.from_string(text)
        restore(tree, Compiled(held, bytecode, hashlib.md5(bytecode.encode(), usedforsecurity=False).hexdigest()))


def compiled_in(tree: bpy.types.NodeTree) -> Compiled:
    """What the script node of a group, if there is one, holds."""
    script = script_of(tree)
    return Compiled(script.script, script.bytecode, script.bytecode_hash) if script else Compiled(None, "", "")


def restore(tree: bpy.types.NodeTree, compiled: Compiled) -> None:
    """Give the script node of the group `tree`, filled anew, what it had before."""
    if compiled.text:
        script = script_of(tree)
        with _quiet_engine():
            script.script = compiled.text
        script.bytecode, script.bytecode_hash = compiled.bytecode, compiled.hash

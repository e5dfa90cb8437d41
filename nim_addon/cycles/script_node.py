# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface as a script node: the closure of osl/nim_interface.osl, compiled into the file that uses it."""

import contextlib
import hashlib
import re
from pathlib import Path

import bpy

from ..base.files import temporary

TEXT_NAME = "nim_interface.osl"


def shader_source():
    """The text of nim_interface.osl: beside the package in a checkout, within it once installed."""
    package = Path(__file__).resolve().parents[1]
    for root in (package, package.parent):
        path = root / "osl" / "nim_interface.osl"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise FileNotFoundError("osl/nim_interface.osl is missing from this installation of nim_addon; install it again.")


def _compile(source):
    """Bytecode of an OSL source, and the md5 that Cycles keys it by. The only caller of the private compiler."""
    import _cycles

    with temporary() as folder:
        osl, oso = folder / TEXT_NAME, folder / "nim_interface.oso"
        osl.write_text(source, encoding="utf-8")
        if not _cycles.osl_compile(str(osl), str(oso)):
            raise RuntimeError("this Blender's OSL compiler refused nim_interface.osl; the console says where.")
        # the compiler notes its options and where sources lay: nothing of this machine goes into a user's file
        lines = oso.read_text(encoding="utf-8").splitlines(keepends=True)
    bytecode = "".join(line for line in lines if not line.startswith("#"))
    bytecode = re.sub(r'%filename\{"[^"]*/', '%filename{"', bytecode)
    return bytecode, hashlib.md5(bytecode.encode(), usedforsecurity=False).hexdigest()


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


def fill(tree, sockets):
    """Put the script node into the empty group `tree`, linked to its interface; update() compiles it.

    sockets: material.SOCKETS
    """
    script = tree.nodes.new("ShaderNodeScript")
    script.name = script.label = TEXT_NAME
    script.width = 220
    entry, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    entry.location, leave.location = (-260, 0), (280, 0)
    closure = script.outputs.new("NodeSocketShader", "BSDF", identifier="BSDF")
    tree.links.new(closure, leave.inputs["BSDF"])
    for socket in sockets:
        inner = script.inputs.new(socket.type, socket.name, identifier=socket.identifier)
        inner.default_value = socket.default
        tree.links.new(entry.outputs[socket.name], inner)


def update(tree):
    """Give the script node of the group `tree` the shader's present text and bytecode, if it has another."""
    source = shader_source()
    script = next(node for node in tree.nodes if node.type == "SCRIPT")
    if script.script is None or script.script.as_string() != source:
        text = script.script or bpy.data.texts.new(TEXT_NAME)
        text.use_fake_user = False  # a new text has one, and would outlive its last material
        text.from_string(source)
        with _quiet_engine():
            script.script = text
        script.bytecode, script.bytecode_hash = _compile(source)


def restore(tree, text, bytecode, bytecode_hash):
    """Give the script node of the group `tree`, filled anew, what it had before; then as update() does."""
    script = next(node for node in tree.nodes if node.type == "SCRIPT")
    if text:
        with _quiet_engine():
            script.script = text
        script.bytecode, script.bytecode_hash = bytecode, bytecode_hash
    update(tree)

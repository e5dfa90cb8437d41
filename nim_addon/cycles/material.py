# SPDX-License-Identifier: GPL-3.0-or-later
"""The material: the OSL closure in a node group whose sockets carry ranges and tooltips."""

import contextlib
import hashlib
import re
import tempfile
from pathlib import Path
from typing import NamedTuple

import bpy

from ..physics import MEDIA

GROUP_NAME = "NIM Interface"
TEXT_NAME = "nim_interface.osl"


class Socket(NamedTuple):
    """An input of the group: `identifier` is the shader's parameter, the rest what a person sees."""

    identifier: str
    name: str
    type: str
    default: object
    min: float | None
    max: float | None
    description: str


# The same labels, ranges and texts as the shader's metadata (a test holds them together).
SOCKETS = (
    Socket(
        "n_inside",
        "Index Inside",
        "NodeSocketFloat",
        -1.5,
        -10.0,
        10.0,
        "Refractive index behind the faces; negative for a negative-index material",
    ),
    Socket(
        "mu_inside",
        "Permeability Inside",
        "NodeSocketFloat",
        -1.0,
        -100.0,
        100.0,
        "Relative permeability behind the faces; its sign is that of the index and does not count here",
    ),
    Socket(
        "n_outside",
        "Index Outside",
        "NodeSocketFloat",
        1.0,
        -10.0,
        10.0,
        "Refractive index on the side the normals point to",
    ),
    Socket(
        "mu_outside",
        "Permeability Outside",
        "NodeSocketFloat",
        1.0,
        -100.0,
        100.0,
        "Relative permeability on the side the normals point to; its sign does not count here",
    ),
    Socket(
        "tint",
        "Tint",
        "NodeSocketColor",
        (1.0, 1.0, 1.0, 1.0),
        None,
        None,
        "Factor on all light that meets the interface; white loses nothing",
    ),
    Socket(
        "shading_normal",
        "Normal",
        "NodeSocketVector",
        (0.0, 0.0, 0.0),
        None,
        None,
        "Normal of the interface, from a bump or normal map; the surface's own where nothing is linked",
    ),
)


def shader_source():
    """The text of nim_interface.osl: beside the package in a checkout, within it once installed."""
    package = Path(__file__).resolve().parents[1]
    for root in (package, package.parent):
        path = root / "osl" / "nim_interface.osl"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise FileNotFoundError("osl/nim_interface.osl is missing from this installation of nim_addon; install it again.")


def osl_available():
    """Whether this build of Blender can compile and render OSL (shading_system alone does not tell)."""
    return bool(bpy.app.build_options.cycles and bpy.app.build_options.cycles_osl)


def without_osl():
    """The sentence for a Blender in which osl_available() is False."""
    return (
        f"Blender {bpy.app.version_string} here was built without OSL, which the material needs; "
        "use a build from blender.org or the bpy package from PyPI."
    )


def _compile(source):
    """Bytecode of an OSL source, and the md5 that Cycles keys it by. The only caller of the private compiler."""
    import _cycles

    with tempfile.TemporaryDirectory() as folder:
        osl, oso = Path(folder, TEXT_NAME), Path(folder, "nim_interface.oso")
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


def interface_group():
    """The node group "NIM Interface" of this file, made on first use; every material shares it.

    A group that holds an older shader is brought up to date in place. Raises RuntimeError in a Blender without OSL.
    """
    if not osl_available():
        raise RuntimeError(without_osl())
    source = shader_source()
    group = next((g for g in bpy.data.node_groups if g.get("nim_interface") and not g.library), None)
    if group is None:
        group = _new_group()
    script = next(node for node in group.nodes if node.type == "SCRIPT")
    if script.script is None or script.script.as_string() != source:
        text = script.script or bpy.data.texts.new(TEXT_NAME)
        text.use_fake_user = False  # a new text has one, and would outlive its last material
        text.from_string(source)
        with _quiet_engine():
            script.script = text
        script.bytecode, script.bytecode_hash = _compile(source)
    return group


def _new_group():
    group = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    group["nim_interface"] = 1
    script = group.nodes.new("ShaderNodeScript")
    script.name = script.label = "nim_interface.osl"
    script.width = 220
    source, sink = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    source.location, sink.location = (-260, 0), (280, 0)
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    closure = script.outputs.new("NodeSocketShader", "BSDF", identifier="BSDF")
    group.links.new(closure, sink.inputs["BSDF"])
    for socket in SOCKETS:
        item = group.interface.new_socket(socket.name, in_out="INPUT", socket_type=socket.type)
        item.description = socket.description
        item.default_value = socket.default
        if socket.min is not None:
            item.min_value, item.max_value = socket.min, socket.max
        item.hide_value = socket.identifier == "shading_normal"
        inner = script.inputs.new(socket.type, socket.name, identifier=socket.identifier)
        inner.default_value = socket.default
        group.links.new(source.outputs[socket.name], inner)
    return group


def interface_material(name, inside, outside=MEDIA["air"], *, backend="osl", tint=(1.0, 1.0, 1.0)):
    """A material for the interface between two media.

    name:            of the new material; Blender appends .001 where it is taken
    inside, outside: Medium behind the faces, and on the side the normals point to
    backend:         "osl", the closure of osl/nim_interface.osl
    tint:            linear RGB factor on all light that meets the interface
    Returns a bpy.types.Material: it renders without this add-on, and its node "NIM Interface" holds the parameters.
    Raises ValueError for an unknown backend, RuntimeError in a Blender without OSL.
    """
    if backend != "osl":
        raise ValueError(f"there is no backend {backend!r}; the one that exists is 'osl'.")
    group = interface_group()
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # from 5.0 a new material comes with its tree
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.name = node.label = GROUP_NAME
    node.width = 220
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    node.inputs["Index Inside"].default_value = inside.n
    node.inputs["Permeability Inside"].default_value = inside.mu
    node.inputs["Index Outside"].default_value = outside.n
    node.inputs["Permeability Outside"].default_value = outside.mu
    node.inputs["Tint"].default_value = (*tint, 1.0)
    # how solid view shows it: NIMs warm, dielectrics cool
    material.diffuse_color = (0.9, 0.6, 0.35, 0.5) if inside.is_nim or outside.is_nim else (0.5, 0.7, 0.9, 0.5)
    return material

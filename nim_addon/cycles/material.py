# SPDX-License-Identifier: GPL-3.0-or-later
"""The material: a node group whose sockets carry ranges and tooltips, with the optics in OSL or in Blender's own nodes."""

import math
from types import MappingProxyType
from typing import NamedTuple

import bpy

from ..physics import MEDIA, Interface, Medium
from ..physics.media import LEAST, MOST
from . import native_nodes, script_node
from .nodes import empty_tree
from .visibility import INTERFACE as MARK
from .visibility import Asked, asked, is_interface, is_marked, value_of

NODE_NAME = "NIM Interface"
GROUP_NAMES = MappingProxyType({"osl": "NIM Interface", "nodes": "NIM Interface (nodes)"})
BACKENDS = ("auto", *GROUP_NAMES)
# MARK is the custom property of our groups that holds their backend.
# The custom property that holds which form of sockets and optics a group was filled with; what has none is older.
VERSION_MARK = "nim_version"
# Raise it with every change to SOCKETS, native_nodes or nim_interface.osl: cycles.versions then mends older files.
VERSION = 2


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


def osl_available():
    """Whether this build of Blender can compile and render OSL (shading_system alone does not tell)."""
    return bool(bpy.app.build_options.cycles and bpy.app.build_options.cycles_osl)


def without_osl():
    """The sentence for a Blender in which osl_available() is False."""
    return (
        f"Blender {bpy.app.version_string} here was built without OSL, which the material needs; "
        "use a build from blender.org or the bpy package from PyPI."
    )


def resolve(backend, scene=None):
    """The backend, "osl" or "nodes", that `backend` stands for.

    "auto" is "osl" where this build has it and the device of `scene` (a bpy.types.Scene, or None for the CPU) allows
    it, else "nodes". Raises ValueError for an unknown one, RuntimeError for "osl" in a Blender without OSL.
    """
    if backend not in BACKENDS:
        raise ValueError(f"there is no backend {backend!r}; the ones that exist are {', '.join(BACKENDS)}.")
    if backend == "osl" and not osl_available():
        raise RuntimeError(without_osl())
    if backend != "auto":
        return backend
    return "osl" if osl_available() and (scene is None or device_runs_osl(scene)) else "nodes"


def device_runs_osl(scene):
    """Whether the device that `scene` renders on can run OSL: of the GPUs only OptiX can."""
    if scene.cycles.device == "CPU":
        return True
    cycles = bpy.context.preferences.addons.get("cycles")
    return cycles is None or cycles.preferences.compute_device_type in ("NONE", "OPTIX")


def interface_group(backend="auto"):
    """The node group of that backend in this file, made on first use; every material shares it.

    One that is of an earlier version, or that was emptied, is filled anew in place; one of a later version is not ours to
    touch, and one is made beside it. Raises as resolve() does.
    """
    backend = resolve(backend)
    ours = (g for g in bpy.data.node_groups if is_marked(g) and backend_of(g) == backend and not g.library)
    group = next((g for g in ours if version_of(g) <= VERSION), None)
    if group is None:
        group = _new_group(backend)
    elif not is_present(group):
        refill(group)
    if backend == "osl":
        script_node.update(group)
    return group


def _new_group(backend):
    group = bpy.data.node_groups.new(GROUP_NAMES[backend], "ShaderNodeTree")
    fill_group(group, backend)
    return group


def backend_of(group):
    """The backend, "osl" or "nodes", of a node group that visibility.is_marked()."""
    # the first version knew no nodes, and marked its groups with a 1
    return group[MARK] if group[MARK] in GROUP_NAMES else "osl"


def version_of(group):
    """The version of a node group that visibility.is_marked(); 0 where what stands there is no version."""
    version = group.get(VERSION_MARK, 1)
    return version if isinstance(version, int) else 0


def is_present(group):
    """Whether a node group that visibility.is_marked() is of this version, and has the sockets and the optics of it."""
    sockets = {(item.in_out, item.name): item.socket_type for item in _sockets(group)}
    wanted = {("INPUT", socket.name): socket.type for socket in SOCKETS} | {("OUTPUT", "BSDF"): "NodeSocketShader"}
    heart = "SCRIPT" if backend_of(group) == "osl" else "BSDF_RAY_PORTAL"
    return (
        version_of(group) == VERSION
        and wanted.items() <= sockets.items()
        and any(node.type == heart for node in group.nodes)
        and any(node.type == "GROUP_OUTPUT" and node.inputs["BSDF"].is_linked for node in group.nodes)
    )


def script_of(group):
    """The script node of a node group, or None."""
    return next((node for node in group.nodes if node.type == "SCRIPT"), None)


def refill(group):
    """Give a node group that visibility.is_marked() its present form; what materials set and linked there stays.

    The shader is compiled only if it is another one. Raises RuntimeError where that cannot be, in a Blender without OSL.
    """
    backend, script = backend_of(group), script_of(group)
    kept = (script.script, script.bytecode, script.bytecode_hash) if script else (None, "", "")
    had = {(item.name, item.socket_type) for item in _sockets(group) if item.in_out == "INPUT"}
    fill_group(group, backend)
    if backend == "osl":
        script_node.restore(group, *kept)
    # a socket that is new stands at 0 in the nodes that were there before it
    new = [socket for socket in SOCKETS if (socket.name, socket.type) not in had]
    for node in _users(group) if new else ():
        for socket in new:
            node.inputs[socket.name].default_value = socket.default


def _users(group):
    trees = [*bpy.data.node_groups, *(one.node_tree for one in bpy.data.materials if one.node_tree)]
    return [node for tree in trees for node in tree.nodes if node.type == "GROUP" and node.node_tree == group]


def _sockets(group):
    return [item for item in group.interface.items_tree if item.item_type == "SOCKET"]


def fill_group(group, backend):
    """Give a node group, new or of an earlier version, the present sockets and optics.

    Sockets that it has are kept, found by name, and with them what every material set or linked there.
    """
    group[MARK], group[VERSION_MARK] = backend, VERSION
    types = {socket.name: socket.type for socket in SOCKETS} | {"BSDF": "NodeSocketShader"}
    for item in _sockets(group):  # another one of that name
        if types.get(item.name, item.socket_type) != item.socket_type:
            group.interface.remove(item)
    kept = {(item.in_out, item.name): item for item in _sockets(group)}
    if ("OUTPUT", "BSDF") not in kept:
        group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    for place, socket in enumerate(SOCKETS, start=1):
        item = kept.get(("INPUT", socket.name))
        if item is None:
            item = group.interface.new_socket(socket.name, in_out="INPUT", socket_type=socket.type)
        item.description = socket.description
        item.default_value = socket.default
        if socket.min is not None:
            item.min_value, item.max_value = socket.min, socket.max
        item.hide_value = socket.identifier == "shading_normal"
        if item.index != place:
            group.interface.move(item, place)
    group.nodes.clear()
    if backend == "osl":
        script_node.fill(group, SOCKETS)
    else:
        native_nodes.fill(group, {socket.identifier: socket.name for socket in SOCKETS})


def interface_material(name, inside, outside=MEDIA["air"], *, backend="auto", tint=(1.0, 1.0, 1.0)):
    """A material for the interface between two media.

    name:            of the new material; Blender appends .001 where it is taken
    inside, outside: Medium behind the faces, and on the side the normals point to
    backend:         "osl", the closure of osl/nim_interface.osl; "nodes", the same in Blender's own nodes; or "auto",
                     the first where this build has OSL, else the second
    tint:            linear RGB factor on all light that meets the interface, three numbers from 0 to 1
    Returns a bpy.types.Material: it renders without this add-on, and its node "NIM Interface" holds the parameters.
    Raises TypeError for what is no Medium, ValueError for such a tint or an unknown backend, RuntimeError for "osl" in a
    Blender without OSL; nothing is made then.
    """
    _check_media(inside, outside)
    tint = _checked_tint(tint)
    interface_group(backend)  # raises, if it must, before there is a material
    material = bpy.data.materials.new(name)
    tree = empty_tree(material)
    node = interface_node(tree, inside, outside, backend=backend)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    node.inputs["Tint"].default_value = (*tint, 1.0)
    # how solid view shows it: NIMs warm, dielectrics cool
    material.diffuse_color = (0.9, 0.6, 0.35, 0.5) if inside.is_nim or outside.is_nim else (0.5, 0.7, 0.9, 0.5)
    return material


def interface_node(tree, inside, outside=MEDIA["air"], *, backend="auto"):
    """A new interface node between two media in a shader bpy.types.NodeTree, unlinked.

    Raises TypeError for what is no Medium, and as resolve() does; nothing is made then.
    """
    _check_media(inside, outside)
    group = interface_group(backend)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.name = node.label = NODE_NAME
    node.width = 220
    node.inputs["Index Inside"].default_value = inside.n
    node.inputs["Permeability Inside"].default_value = inside.mu
    node.inputs["Index Outside"].default_value = outside.n
    node.inputs["Permeability Outside"].default_value = outside.mu
    return node


def _check_media(inside, outside):
    for name, medium in (("inside", inside), ("outside", outside)):
        if not isinstance(medium, Medium):
            raise TypeError(f"{name} = {medium!r} is no Medium; give one, such as Medium(-1.5) or MEDIA['water'].")


def _checked_tint(tint):
    """The three numbers of a tint; ValueError, one sentence, where it is anything else."""
    try:
        numbers = [float(one) for one in tint]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3 or not all(0 <= one <= 1 for one in numbers):
        raise ValueError(f"tint = {tint!r} is no colour; give three numbers from 0 to 1, such as (1.0, 0.5, 0.5).")
    return numbers


def interface_nodes(material):
    """The interface nodes of a bpy.types.Material (or None), those of a group within a group not counted; a list."""
    nodes = material.node_tree.nodes if material and material.node_tree else ()
    return [node for node in nodes if is_interface(node)]


def asked_interfaces(material: bpy.types.Material | None) -> list[Asked]:
    """The interface nodes that a render asks for the surface of a material, those in a person's own groups too."""
    return [one for one in asked(material) if is_interface(one.node)]


def interface_of(node: bpy.types.Node, path: tuple = ()) -> Interface | None:
    """The physics.Interface that the values of an interface node describe, as both shaders read them.

    path: the groups that it is in, as asked_interfaces() gives them. The permeabilities count by magnitude. Returns None
    where a node other than a Value decides an index or a permeability, or where one is 0 or out of a Medium's range.
    """
    media = []
    for side in ("Inside", "Outside"):
        n, mu = (number_of(node.inputs[f"{kind} {side}"], path) for kind in ("Index", "Permeability"))
        if n is None or mu is None or not all(LEAST <= abs(value) <= MOST for value in (n, mu)):
            return None
        media.append(Medium(n, math.copysign(mu, n)))
    return Interface(*media)


def number_of(socket: bpy.types.NodeSocket, path: tuple = ()) -> float | None:
    """The number that an input is given where no node but a Value decides it; None where one does, a colour too."""
    value = value_of(socket, path)
    return None if isinstance(value, tuple) else value


def switch_backend(material, backend):
    """Give every interface node of a bpy.types.Material the group of another backend; values and links stay.

    Returns how many nodes there were. Raises as resolve() does.
    """
    group = interface_group(backend)
    nodes = interface_nodes(material)
    for node in nodes:
        node.node_tree = group
    return len(nodes)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials of graded balls, and of graded shells around a core, for scripts: made of a profile, and read again as one.

A person sees one node, the group of a profile: within it the sine of the angle of incidence reads a table of sweeps, an
image that is packed into the file, and the closure, GRADED_BALL or GRADED_CORE, jumps by what it finds there. The group says
in a custom property which profile it is of; materials of the same profile and backend share it.
"""

from __future__ import annotations

import functools
import json
from dataclasses import asdict

import bpy
import numpy as np
from numpy.typing import NDArray

from ..physics import graded
from ..physics.graded import Profile
from .closures import GRADED_BALL, GRADED_CORE, Closure, closure_of_node
from .closures.backends import resolve
from .closures.formulas import Sheet, Value, minimum
from .closures.graded_ball import RADIUS, entry
from .packed import packed_image, remember
from .surface import surface_material

# The custom property of a group, and of its table: the profile as JSON, "" of a function that no text tells.
CONTENT = "nim_profile"
TEXELS = 1024
TABLE = "Sweep of {}"  # what an image is called


def graded_ball_material(
    name: str, profile: Profile, *, backend: str = "auto", radius: float = 1.0
) -> bpy.types.Material:
    """A material for a graded ball: a sphere around its object's origin, which may be moved, turned and scaled evenly.

    name:    of the new material; Blender appends .001 where it is taken
    profile: of the index
    backend: "osl", the closure of osl/nim_graded_ball.osl; "nodes", the same in Blender's own nodes; or "auto", the first
             where this build has OSL, else the second
    radius:  of the sphere in the object's own space, above 0
    The material renders without this add-on.
    Raises TypeError for what is no Profile, ValueError for a radius out of range, a core that is to be seen or an unknown
    backend, RuntimeError for "osl" in a Blender without OSL; nothing is made then.
    """
    if isinstance(profile, Profile) and closure_of_profile(profile) is GRADED_CORE:
        raise ValueError(
            "what a graded ball has in it is not seen, so that its core is a mirror or black; make a core that is to be seen "
            "a ball of its own within a graded_core_material."
        )
    return _material(name, profile, backend, radius)


def graded_core_material(
    name: str, profile: Profile, *, backend: str = "auto", radius: float = 1.0
) -> bpy.types.Material:
    """A material for a graded shell around a core: both balls around one point, the core of any material of its own.

    The core's radius is profile.core of the shell's. What light meets on it, it meets as in vacuum, by the angle that it has
    within the shell. The arguments are those of graded_ball_material(), and what is raised; ValueError, too, for a profile
    without a core that is textured.
    """
    if isinstance(profile, Profile) and closure_of_profile(profile) is not GRADED_CORE:
        raise ValueError(
            "a graded shell is seen around a core of a material of its own; give the profile a core, and surface='textured', "
            "or take graded_ball_material."
        )
    return _material(name, profile, backend, radius)


def _material(name, profile, backend, radius):
    if not RADIUS.min < radius <= RADIUS.max:
        raise ValueError(f"radius = {radius!r} of a graded ball is out of range; give a number above 0, such as 1.0.")
    group(profile, backend)  # raises, if it must, before there is a material

    def make(tree: bpy.types.NodeTree) -> bpy.types.Node:
        node = profile_node(tree, profile, backend=backend)
        node.inputs[RADIUS.name].default_value = radius
        return node

    return surface_material(name, make, bends_backwards=profile.n == "magnifier")


def profile_node(tree: bpy.types.NodeTree, profile: Profile, *, backend: str = "auto") -> bpy.types.Node:
    """A new node of a graded ball in a shader's tree, unlinked: its input is the radius. Raises as group() does."""
    inner = group(profile, backend)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = inner
    node.name = node.label = closure_of_profile(profile).label
    node.width = 220
    return node


def set_profile(node: bpy.types.Node, profile: Profile) -> None:
    """Let a node of a graded ball be of another profile; its links and its radius stay. Raises TypeError as group()."""
    former = node.node_tree
    node.node_tree = group(profile, backend_of(former))
    _remove_unused(former)


def is_profile_node(node: bpy.types.Node) -> bool:
    """Whether a node is one of a graded ball of a profile."""
    return node.type == "GROUP" and node.node_tree is not None and bool(_jumps(node.node_tree))


def profile_of(node: bpy.types.Node) -> Profile | None:
    """The profile that a node is of; None where it is of none, or of one whose index was a function."""
    return _read(str(node.node_tree.get(CONTENT, ""))) if is_profile_node(node) else None


def profile_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The nodes of graded balls of a material (or None), those of a group within a group not counted."""
    nodes = material.node_tree.nodes if material and material.node_tree else ()
    return [node for node in nodes if is_profile_node(node)]


def switch(material: bpy.types.Material, backend: str) -> int:
    """Give every node of a graded ball in a material the group of another backend; returns how many there were."""
    backend = resolve(backend)
    nodes = profile_nodes(material)
    for node in nodes:
        if backend_of(node.node_tree) != backend:
            former = node.node_tree
            node.node_tree = _of_backend(former, backend)
            _remove_unused(former)
    return len(nodes)


# ------------------------------------------------------------------------------------------------ its group and its table


def closure_of_profile(profile: Profile) -> Closure:
    """GRADED_CORE for a profile with a core that is textured, and so seen; else GRADED_BALL."""
    return GRADED_CORE if profile.core is not None and profile.surface == "textured" else GRADED_BALL


def backend_of(tree: bpy.types.NodeTree) -> str:
    """The backend, "osl" or "nodes", of the group of a profile."""
    (node,) = _jumps(tree)
    return closure_of_node(node).backend_of(node.node_tree)


def _jumps(tree):
    """The node of the closure in the group of a profile, in a list; none in any other group."""
    if CONTENT not in tree:
        return []
    return [node for node in tree.nodes if closure_of_node(node) in (GRADED_BALL, GRADED_CORE)]


def group(profile: Profile, backend: str = "auto") -> bpy.types.NodeTree:
    """The node group of a profile and a backend in this file, made on first use; every material shares it.

    One of a function n(r) is made anew each time. Raises TypeError for what is no Profile, ValueError for a cloak
    around a core that is textured, and as backends.resolve() does.
    """
    if not isinstance(profile, Profile):
        raise TypeError(f"profile = {profile!r} is no Profile; give one, such as Profile('luneburg').")
    if profile.is_cloak and closure_of_profile(profile) is GRADED_CORE:
        raise ValueError(
            "a cloak hides what is in it, and has no core that could be seen; make its surface a mirror or black."
        )
    backend, content = resolve(backend), _text(profile)
    found = _found(content, backend)
    return found or _new_group(profile, content, backend, _image(profile, content))


def _found(content: str, backend: str) -> bpy.types.NodeTree | None:
    ours = (tree for tree in bpy.data.node_groups if content and tree.get(CONTENT) == content and not tree.library)
    return next((tree for tree in ours if _jumps(tree) and backend_of(tree) == backend), None)


def _of_backend(tree: bpy.types.NodeTree, backend: str) -> bpy.types.NodeTree:
    """The group of another backend that is otherwise the same: it reads the same table."""
    content = tree[CONTENT]
    image = next(node.image for node in tree.nodes if node.type == "TEX_IMAGE")
    return _found(content, backend) or _new_group(_read(content), content, backend, image)


def _new_group(profile, content, backend, image):
    """A group of a profile, None for one of a function."""
    closure = closure_of_profile(profile) if profile else GRADED_BALL
    name = f"{closure.label}: {title(profile)}"
    tree = bpy.data.node_groups.new(name if backend == "osl" else f"{name} (nodes)", "ShaderNodeTree")
    tree[CONTENT] = content
    tree.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    item = tree.interface.new_socket(RADIUS.name, in_out="INPUT", socket_type=RADIUS.type)
    item.default_value, item.min_value, item.max_value = RADIUS.default, RADIUS.min, RADIUS.max
    item.description = RADIUS.description
    sheet = Sheet(tree, {RADIUS.identifier: RADIUS.name})
    sheet.frame("Where the ray comes from: h = tan(angle / 2) = p / (1 + c)")
    (radius,) = sheet.inputs("radius")
    inputs, row = {RADIUS.name: radius}, 0.5
    if closure is GRADED_CORE:
        core_index = float(profile.index(np.array([profile.core]))[0])
        core = _constant(sheet, "core", profile.core)
        inputs |= {"Core": core, "Core Index": _constant(sheet, "index at the core", core_index)}
        met = entry(sheet, radius, core)
        row = 0.25 + 0.5 * met.back  # the upper one is of rays from the core
    else:
        met = entry(sheet, radius)
    h = minimum(met.p / (1 + met.c), 1.0)
    u = h * ((TEXELS - 1) / TEXELS) + 0.5 / TEXELS
    sheet.name(locals())
    sheet.frame("Table of the sweep, and the jump", top=-560)
    place = sheet.node("ShaderNodeCombineXYZ", "its place in the table", {"X": u, "Y": row})
    texture = sheet.node("ShaderNodeTexImage", "sweep", {"Vector": place}, image=image, extension="EXTEND")
    inputs["Sweep"] = texture
    sheet.end(sheet.node("ShaderNodeGroup", closure.label, inputs, node_tree=closure.group(backend)))
    return tree


def _constant(sheet: Sheet, label: str, number: float) -> Value:
    value = sheet.node("ShaderNodeValue", label)
    value.socket.default_value = number
    return value


def _image(profile: Profile, content: str) -> bpy.types.Image:
    """The tables of a profile as a packed image of float, TEXELS wide, a row each: from the rim, and from the core."""
    found = next((image for image in bpy.data.images if content and image.get(CONTENT) == content), None)
    if found:
        return found
    rows = np.stack(
        _core_tables(profile) if closure_of_profile(profile) is GRADED_CORE else [graded.table(profile, TEXELS)]
    )
    image = packed_image(TABLE.format(title(profile)), rows)
    image[CONTENT] = content
    return image


def _core_tables(profile: Profile) -> list[NDArray]:
    """Of rays from the rim, and from the core: cosine and sine of the angle they go round, and whether they come to the core."""
    h = np.arange(TEXELS) / (TEXELS - 1)
    sines = np.minimum(2 * h / (1 + h * h), 1)
    landing = graded.landing(profile, sines)
    angle, leaves = graded.leaving(profile, sines)
    # in the sense of p, against which light goes in a NIM
    angle = angle * np.sign(profile.index(np.array([profile.core])))
    inwards = np.where(landing.reached, landing.angle, graded.sweep(profile, sines))
    return [
        np.stack([np.cos(a), np.sin(a), to_core], -1) for a, to_core in ((inwards, landing.reached), (angle, ~leaves))
    ]


def _remove_unused(tree: bpy.types.NodeTree) -> None:
    """Take a group that nothing uses out of the file, with its table."""
    if tree.users or tree.library:
        return
    remember()
    images = {node.image for node in tree.nodes if node.type == "TEX_IMAGE"}
    bpy.data.node_groups.remove(tree)
    for image in images:
        if image and not image.users:
            bpy.data.images.remove(image)


# ------------------------------------------------------------------------------------------------ profiles as text


def title(profile: Profile | None) -> str:
    """What a person reads of a profile: its device, or what its index is given by."""
    if profile is None or callable(profile.n):
        return "function"
    return profile.n if isinstance(profile.n, str) else "table"


def _text(profile: Profile) -> str:
    return "" if callable(profile.n) else json.dumps(asdict(profile), sort_keys=True)


@functools.lru_cache(maxsize=64)  # since panels ask while they are drawn
def _read(content: str) -> Profile | None:
    try:
        values = json.loads(content)
        if not isinstance(values["n"], str):
            values["n"] = tuple(map(tuple, values["n"]))
        return Profile(**{**values, "breaks": tuple(values["breaks"])})
    except (ValueError, TypeError, KeyError):
        return None

# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that is rendered in all wavelengths at once: motion blur gives each path one, and all that shines is weighted.

A picture in which nothing disperses is the same as before, in the mean; what disperses shows its colours. All that is set is
written in the scene, so that undo() finds it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

import bpy

from ..physics import REPRESENTATIVE_NM
from . import absorption, drift, wavelength
from .closures import INTERFACE, SHUTTER
from .closures.backends import device_runs_osl, osl_available, resolve
from .drift import SHUTTER_TIME
from .material import asked_interfaces, is_rough
from .nodes import Owner, uses_nodes
from .settings import put
from .visibility import CAUSTICS_MARK, as_rendered, asked, lamps, shown
from .wavelength import set_stratum

__all__ = [
    "Done",
    "done",
    "is_flat",
    "is_spectral",
    "is_weight",
    "open_shutter",
    "scattering",
    "set_neutral",
    "set_stratum",
    "set_up",
    "undo",
    "unweighted",
    "weighted",
]

MARK = "nim_spectral"  # of a scene: what its settings were; of nodes: that they are ours
DONE = "nim_spectral_done"  # of a scene: the numbers of Done
DIM = "nim_spectral_dim"  # of a material: whether its triangles are lamps was for Cycles to choose
LAMP = 0.5  # of light, from which on Cycles makes lamps of triangles (Shader::estimate_emission)
# Settings that let the time of a path be its wavelength; the curve of the shutter is flat besides.
SETTINGS: dict[str, Any] = {
    "render.use_motion_blur": True,
    "render.motion_blur_shutter": SHUTTER_TIME,
    "render.motion_blur_position": "START",
    "cycles.rolling_shutter_type": "NONE",
    "cycles.use_adaptive_sampling": False,
}
KEPT = (*SETTINGS, "cycles.shading_system")  # which is turned on where OSL tells the wavelength
# Where the colour of what shines stands, and what decides whether it does.
EMITTERS = {
    "EMISSION": ("Color", "Strength"),
    "BACKGROUND": ("Color", "Strength"),
    "BSDF_PRINCIPLED": ("Emission Color", "Emission Strength"),
}


class Done(NamedTuple):
    """What set_up() gave weights to: how many lamps and materials, and whether the sky."""

    lamps: int
    materials: int
    sky: bool


def set_neutral(nm: float = REPRESENTATIVE_NM) -> None:
    """Let all media of the file be shown at this wavelength, nanometres, where motion blur is off, and their volumes too."""
    wavelength.set_neutral(nm)
    absorption.set_neutral(nm)


def is_spectral(scene: bpy.types.Scene) -> bool:
    """Whether a scene was set up to be rendered in all wavelengths at once."""
    return MARK in scene


def done(scene: bpy.types.Scene) -> Done | None:
    """What set_up() gave weights to when it was last done; None of a scene that was not set up."""
    if not is_spectral(scene) or DONE not in scene:
        return None
    lamps, materials, sky = scene[DONE]
    return Done(lamps, materials, bool(sky))


def _backend_of(scene, materials):
    """The backend that tells the wavelength: nodes where all our materials are made of them, else as resolve() has it."""
    used = {INTERFACE.backend_of(node.node_tree) for material in materials for node in INTERFACE.nodes_of(material)}
    return "nodes" if used == {"nodes"} else resolve("auto", scene)


def set_up(scene: bpy.types.Scene, backend: str = "auto") -> Done:
    """Let a scene be rendered in all wavelengths at once, from now on, with this add-on or without.

    What it gives weights to may be shared with other scenes: where motion blur is off it is white, as it was. Done anew it
    finds what has come since. Raises as closures.backends.resolve() does.
    """
    resolve(backend)  # raises, if it must, before anything is changed
    with as_rendered(scene) as depsgraph:
        meshes = list(dict.fromkeys(surface.original for surface in shown(scene, depsgraph)))
        materials = {material for surface in shown(scene, depsgraph) for material in surface.materials if material}
        shining = lamps(scene, depsgraph)
    backend = _backend_of(scene, materials) if backend == "auto" else backend
    if not is_spectral(scene):
        _keep_settings(scene)
    open_shutter(scene)
    for obj in (
        obj for obj in scene.objects if obj.get(CAUSTICS_MARK)
    ):  # which stand for others while caustics are baked
        (shining if obj.type == "LIGHT" else meshes).append(obj)
        materials.update(slot.material for slot in obj.material_slots if slot.material)
    # nodes cannot tell a sky the time, OSL can
    above = "osl" if osl_available() and device_runs_osl(scene) else backend
    lamps_by = backend if drift.lamps_drift() else above
    weighed = Done(
        sum(_weigh(light, lamps_by) for light in {lamp.data for lamp in shining}),
        sum(_weigh(material, backend) for material in materials),
        bool(scene.world) and _weigh(scene.world, above),
    )
    for material in materials:
        absorption.show_colours(material)
    wavelength.set_clear_paths(white=not scattering())
    if "osl" in (backend, above if weighed.sky else backend, lamps_by if weighed.lamps else backend):
        put(scene, "cycles.shading_system", True)
    # all together, so that what touches still does
    drifting = list(dict.fromkeys((*meshes, *shining))) if backend == "nodes" else []
    for obj in set(scene.objects).union(meshes, shining).difference(drifting):
        drift.hold(obj)
    drift.let_drift(scene, drifting)
    scene[DONE] = list(map(int, weighed))
    return weighed


def scattering() -> list[bpy.types.Material]:
    """The materials of the file that disperse and are rough: Cycles asks lamps for the light on them as for that on a floor.

    So no path may be white where there are any, or lamps lit them without colours.
    """
    return [material for material in bpy.data.materials if _scatters(material)]


def _scatters(material):
    disperses = any(SHUTTER.is_node(found.node) for found in asked(material))
    return disperses and any(is_rough(*found) for found in asked_interfaces(material))


def open_shutter(scene: bpy.types.Scene) -> None:
    """Set a scene so that each path has a time of its own, which is its wavelength."""
    for path, value in SETTINGS.items():
        put(scene, path, value)
    _flatten(scene)


def weighted(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Where the own colour of what shines stands: an input that set_up() did not change, or what it puts in its place."""
    product = next((link.from_node for link in socket.links if link.from_node.get(MARK)), None)
    return _mix_sockets(product)[1] if product else socket


def is_weight(node: bpy.types.Node) -> bool:
    """Whether a node is one that set_up() put into a tree."""
    return bool(node.get(MARK))


def undo(scene: bpy.types.Scene) -> None:
    """Take back what set_up() did: the scene's settings, the weights of what shines in it, and how its objects move."""
    if not is_spectral(scene):
        return
    for path, value in json.loads(scene[MARK]).items():
        if path == "curve":
            _draw(scene.render.motion_blur_shutter_curve, value)
        else:
            put(scene, path, value)
    del scene[MARK]
    scene.pop(DONE, None)
    for owner in {*_owners(scene)}:
        _unweigh(owner)
        if isinstance(owner, bpy.types.Material):
            absorption.show_neutral(owner)
    for obj in scene.objects:
        drift.release(obj)
    set_neutral()
    set_stratum()
    wavelength.set_clear_paths(white=True)


# ------------------------------------------------------------------------------------------------ the scene's settings


def _keep_settings(scene):
    curve = [
        (tuple(point.location), point.handle_type) for point in scene.render.motion_blur_shutter_curve.curves[0].points
    ]
    scene[MARK] = json.dumps({path: scene.path_resolve(path) for path in KEPT} | {"curve": curve})


def is_flat(scene: bpy.types.Scene) -> bool:
    """Whether the curve of a scene's shutter is open all the time alike, so that all wavelengths are as likely as meant."""
    mapping = scene.render.motion_blur_shutter_curve
    mapping.initialize()
    return all(abs(mapping.evaluate(mapping.curves[0], x / 32) - 1) < 1e-6 for x in range(33))


def _flatten(scene):
    if not is_flat(scene):
        _draw(scene.render.motion_blur_shutter_curve, [((0.0, 1.0), "VECTOR"), ((1.0, 1.0), "VECTOR")])


def _draw(mapping, points):
    curve = mapping.curves[0]
    while len(curve.points) > max(2, len(points)):
        curve.points.remove(curve.points[1])
    while len(curve.points) < len(points):
        curve.points.new(0.5, 0.5)
    for point, (location, handle) in zip(curve.points, points, strict=True):
        point.location, point.handle_type = location, handle
    mapping.update()


# ------------------------------------------------------------------------------------------------ what shines


def _owners(scene) -> Iterator[Owner]:
    """All materials, lamps and skies of the file that may hold weights of a scene's."""
    yield from bpy.data.materials
    yield from (obj.data for obj in scene.objects if obj.type == "LIGHT")
    if scene.world:
        yield scene.world


def _weigh(owner: Owner, backend: str) -> bool:
    """Multiply all that shines in a material, lamp or sky by the weight of the wavelength; returns whether anything does.

    What is linked from another file stays as it is.
    """
    if owner.library:
        return False
    if not uses_nodes(owner):
        if isinstance(owner, bpy.types.Material):
            return False  # plain ones do not shine
        _use_nodes(owner)
    colours = _colours(owner)
    if isinstance(owner, bpy.types.Material) and owner.cycles.emission_sampling == "AUTO" and _is_dim(colours):
        owner[DIM], owner.cycles.emission_sampling = True, "NONE"
    own = [(node, colour) for node, colour in colours if not node.id_data.library]
    for node, colour in own:
        _weigh_socket(node.id_data, node, colour, backend)
    return bool(own)


def _is_dim(colours) -> bool:
    """Whether a material shines so little that Cycles, if it knows how much, makes no lamps of its triangles.

    It cannot know once a weight is linked, and a ball of 100,000 triangles is a second of making a tree of lamps.
    """
    strengths = [node.inputs[EMITTERS[node.type][1]] for node, _ in colours]
    if not colours or any(socket.is_linked for socket in (*strengths, *(colour for _, colour in colours))):
        return False
    brightest = (
        max(colour.default_value[:3]) * strength.default_value
        for (_, colour), strength in zip(colours, strengths, strict=True)
    )
    return sum(brightest) <= LAMP


def unweighted(owner: Owner) -> bool:
    """Whether a material, lamp or sky shines with light that has no wavelength yet."""
    if not uses_nodes(owner):
        return not isinstance(owner, bpy.types.Material)
    return any(weighted(colour) == colour for _, colour in _colours(owner))


def _colours(owner: Owner) -> list[tuple[bpy.types.Node, bpy.types.NodeSocket]]:
    """The nodes of a material, lamp or sky that shine, and the input of each for its colour."""
    found = []
    sockets = ("Surface",) if isinstance(owner, bpy.types.Light) else ("Surface", "Volume")
    for node in {found.node for socket in sockets for found in asked(owner, socket)}:
        if node.type not in EMITTERS:
            continue
        colour, strength = (node.inputs[name] for name in EMITTERS[node.type])
        if not strength.is_linked and strength.default_value == 0:
            continue
        found.append((node, colour))
    return found


def _use_nodes(owner):
    owner.use_nodes = True
    if isinstance(owner, bpy.types.World):
        background = next(node for node in owner.node_tree.nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value = (*owner.color, 1.0)
    owner.node_tree[MARK] = True


def _weigh_socket(tree, node, socket, backend):
    if any(link.from_node.get(MARK) for link in socket.links):
        return
    weight = wavelength.new_node(tree, backend)
    product = tree.nodes.new("ShaderNodeMix")
    product.data_type, product.blend_type, product.clamp_result = "RGBA", "MULTIPLY", False
    product.name = product.label = "times the wavelength's weight"
    product.location = (node.location.x - 200, node.location.y)
    weight.location = (node.location.x - 400, node.location.y - 200)
    weight[MARK] = product[MARK] = True
    factor, first, second, result = _mix_sockets(product)
    factor.default_value = 1.0
    if socket.is_linked:
        tree.links.new(socket.links[0].from_socket, first)
    else:
        first.default_value = socket.default_value
    tree.links.new(weight.outputs[wavelength.WEIGHT], second)
    tree.links.new(result, socket)


def _mix_sockets(mix):
    inputs = {socket.identifier: socket for socket in mix.inputs}
    result = next(socket for socket in mix.outputs if socket.identifier == "Result_Color")
    return inputs["Factor_Float"], inputs["A_Color"], inputs["B_Color"], result


def _unweigh(owner):
    if owner.node_tree is None:
        return
    if DIM in owner:
        owner.cycles.emission_sampling = "AUTO"
        del owner[DIM]
    trees, seen = [owner.node_tree], set()
    while trees:
        tree = trees.pop()
        if tree in seen or tree.library:
            continue
        seen.add(tree)
        for node in [node for node in tree.nodes if node.get(MARK) and node.type == "MIX"]:
            _take_out(tree, node)
        for node in [node for node in tree.nodes if node.get(MARK)]:
            tree.nodes.remove(node)
        trees += [node.node_tree for node in tree.nodes if node.type == "GROUP" and node.node_tree]
    if owner.node_tree.get(MARK):
        del owner.node_tree[MARK]
        owner.use_nodes = False


def _take_out(tree, product):
    _, first, _, result = _mix_sockets(product)
    for link in list(result.links):
        target = link.to_socket
        if first.is_linked:
            tree.links.new(first.links[0].from_socket, target)
        else:
            target.default_value = first.default_value
    tree.nodes.remove(product)

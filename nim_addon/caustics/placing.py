# SPDX-License-Identifier: GPL-3.0-or-later
"""What shines in a scene with baked caustics: copies of the surfaces that took light, and lamps; and how all that goes again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ..cycles.nodes import Nodes, empty_tree
from ..cycles.object_values import carry, give
from ..cycles.packed import packed_image, remember
from ..cycles.visibility import CAUSTICS_HIDDEN, CAUSTICS_MARK, asked, has_nodes
from . import lights
from .atlas import Chart, Part
from .bending import kind_of, lands, own_groups
from .counting import fed
from .density import LEVELS, Texture
from .digest import OBJECT_PROPERTIES
from .photons import PLACE_ATTRIBUTE, set_materials

COLLECTION = "NIM Caustics"  # the name of the collection of all that a bake puts into a scene
# custom properties, of files that people have: they keep their names
SAMPLING = "nim_caustics_multiple"  # of a lamp: whether it was found by chance too; of a sky: how it was sampled
SKY = "nim_caustics_sky"  # of the collection: the world whose sun the caustics are of
SEEN_FOR = "nim_caustics_lamp"  # of a lamp that is only seen: the bpy.types.Light of the one it is seen for
DISKS = 6  # lamps for a Gaussian sun


def baked(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """The collection of the caustics in a scene, None where it has none."""
    return next(iter(_collections(scene)), None)


def _collections(scene):
    return [collection for collection in scene.collection.children_recursive if collection.get(CAUSTICS_MARK)]


def left(scene: bpy.types.Scene) -> bool:
    """Whether there is anything in a scene for clear() to take back, if only what stays hidden without its copy."""
    return baked(scene) is not None or any(
        obj.get(CAUSTICS_HIDDEN) or (obj.type == "LIGHT" and obj.data.get(SAMPLING) is not None)
        for obj in scene.objects
    )


def standing(scene: bpy.types.Scene) -> str:
    """A mark of which copies there are and where: one that was taken for its surface may be moved, or deleted."""
    copies = [obj for obj in scene.objects if obj.get(CAUSTICS_MARK) and obj.type == "MESH"]
    # as they are saved: a matrix is made anew by each machine
    return repr(sorted([*obj.location, *obj.rotation_euler, *obj.scale] for obj in copies))


def clear(scene: bpy.types.Scene) -> None:
    """Take baked caustics out of `scene`: the copies and lamps go, and what they stood for is rendered again."""
    objects, collections = [obj for obj in scene.objects if obj.get(CAUSTICS_MARK)], _collections(scene)
    data = {obj.data for obj in objects}
    worn = {slot.material for obj in objects for slot in obj.material_slots if slot.material}
    materials = {material for material in worn if material.get(CAUSTICS_MARK)}
    groups = {node.node_tree for material in materials for node in _nodes(material.node_tree) if node.type == "GROUP"}
    groups = {group for group in groups if group and group.get(CAUSTICS_MARK)}
    trees = [*(material.node_tree for material in materials), *groups]
    images = {
        node.image for tree in trees for node in tree.nodes if node.get(CAUSTICS_MARK) and node.type == "TEX_IMAGE"
    }
    for light in {obj[SEEN_FOR] for obj in objects if obj.get(SEEN_FOR)}:
        _found_by_chance(light)
    for obj in scene.objects:
        if obj.get(CAUSTICS_HIDDEN):
            obj.hide_render, obj.hide_viewport = False, obj[CAUSTICS_HIDDEN] > 1
            del obj[CAUSTICS_HIDDEN]
        if obj.type == "LIGHT":
            _found_by_chance(obj.data)
    for world in {scene.world, *(collection.get(SKY) for collection in collections)} - {None}:
        if world.get(SAMPLING) is not None:
            _switch_sun(world, hidden=False)
            world.cycles.sampling_method = world[SAMPLING]
            del world[SAMPLING]
    for collection in collections:
        _hand_back(scene, collection)
    remember()
    bpy.data.batch_remove([*objects, *collections])
    unused: list[Any] = [*data, *materials, *groups, *images]
    bpy.data.batch_remove(unused)


def _found_by_chance(light):
    """Let a bpy.types.Light be found by chance again, if it was before."""
    if light.get(SAMPLING) is not None:
        light.cycles.use_multiple_importance_sampling = light[SAMPLING]
        del light[SAMPLING]


def _nodes(tree):
    """All nodes of a tree, those in the groups in it too."""
    for node in tree.nodes:
        yield node
        if node.type == "GROUP" and node.node_tree:
            yield from _nodes(node.node_tree)


def _hand_back(scene, collection):
    """Leave what a person put into the collection of the caustics to the scene."""
    keeps, others = scene.collection, set(collection.children)
    held = {obj for other in scene.collection.children_recursive if other != collection for obj in other.objects}
    for obj in collection.objects:
        if not obj.get(CAUSTICS_MARK) and obj not in held and obj not in set(keeps.objects):
            keeps.objects.link(obj)
    for child in others - set(keeps.children):
        keeps.children.link(child)


def _switch_sun(world, hidden):
    node = world.node_tree and world.node_tree.nodes.get(lights.SUN_HIDDEN)
    if node:  # unless the sky was made anew
        node.outputs[0].default_value = float(hidden)


def hide_sun(world: bpy.types.World) -> None:
    """Leave the sun in a sky to where nothing was scattered: a lamp and the photons stand for it elsewhere."""
    world[SAMPLING] = world.cycles.sampling_method
    _switch_sun(world, hidden=True)
    world.cycles.sampling_method = "NONE"  # without its sun the sky is smooth, and is found by chance


def color(light: lights.Light) -> NDArray:
    """(3,) the colour of a light, its strongest channel 1."""
    strength = np.asarray(light.irradiance if isinstance(light, lights.Sun) else light.intensity)
    return strength / strength.max()


def layers(texture: Texture) -> list[tuple[int, int]]:
    """The (back, level) of the windows of a texture: 1 for the back of faces, and which of those nested, 0 the finest."""
    return sorted({(key // LEVELS % 2, key % LEVELS) for key in texture.windows})


def names(back: int, level: int) -> list[str]:
    """Names of the corner attributes for those windows: the place in the texture, and the window's two corners there."""
    return [f"nim_caustics_{what}_{'back' if back else 'front'}_{level}" for what in ("place", "low", "high")]


def copies(
    parts: Iterable[Part], charts: Sequence[Chart], name: str, texture: Texture
) -> Iterator[tuple[bpy.types.Mesh, Part]]:
    """A mesh for each Part of the object of that name, with its windows' places in its texture: the attributes of names()."""
    height, width = texture.shape
    for part in (part for part in parts if part.name == name):
        mesh = part.mesh.copy()
        set_materials(mesh, part.materials)
        mesh.attributes.remove(mesh.attributes[PLACE_ATTRIBUTE])
        for back, level in layers(texture):
            place = np.full((len(part.charts), 3), -1.0, np.float32)
            bounds = np.zeros((2, len(part.charts), 3), np.float32)
            for number in np.unique(part.charts):
                window = texture.windows.get(LEVELS * (2 * number + back) + level) if number >= 0 else None
                if window is None:
                    continue
                own = part.charts == number
                flat = np.delete(part.corners[own], charts[number].axis // 2, axis=1)
                place[own, :2] = ((flat - window.low) / window.texel + window.at) / (width, height)
                # half a texel within, so that no neighbour shines through
                bounds[0, own, :2] = (window.at + 0.5) / (width, height)
                bounds[1, own, :2] = (window.at + window.cells - 0.5) / (width, height)
            for attribute, values in zip(names(back, level), (place, *bounds), strict=True):
                data = mesh.attributes.new(attribute, "FLOAT_VECTOR", "CORNER").data
                data.foreach_set("vector", values.ravel())
        yield mesh, part


def replace(
    scene: bpy.types.Scene,
    collection: bpy.types.Collection,
    name: str,
    copies: Iterable[tuple[bpy.types.Mesh, Part]],
    irradiance: NDArray,
    layers: Sequence[tuple[int, int]],
) -> None:
    """Put a copy of the object of that name, which also shines, in its place.

    collection: that gets the copy
    copies:     of copies()
    irradiance: (H, W, 3) W/m^2, of the texture whose windows have those layers()
    """
    group = _light(packed_image(f"{COLLECTION} {name}", irradiance, half=True), layers)
    original = next(obj for obj in scene.objects if obj.name == name and not obj.library)
    for mesh, part in copies:
        copy = bpy.data.objects.new(f"{COLLECTION} {name}", mesh)
        copy.matrix_world = part.matrix
        _look_alike(copy, original)
        give(copy, part.values, original)
        copy[CAUSTICS_MARK] = True
        for index, material in enumerate(part.materials):
            if lands(material):
                mesh.materials[index] = _shining(material, group)
        collection.objects.link(copy)
        _link_to_lamps(copy, original)
    original[CAUSTICS_HIDDEN] = 2 if original.hide_viewport else 1
    original.hide_render = original.hide_viewport = True


def _look_alike(copy, original):
    """Give an object what decides, beside mesh and materials, how another one is rendered."""
    for key, value in original.items():
        if isinstance(value, (bool, int, float, str)) and not key.startswith("nim_"):
            copy[key] = value
    for name in OBJECT_PROPERTIES:
        setattr(copy, name, getattr(original, name))
    for name in ("receiver_collection", "blocker_collection"):
        setattr(copy.light_linking, name, getattr(original.light_linking, name))


def _link_to_lamps(copy, original):
    """Let the lamps that shine on some objects only take a copy for its original."""
    lamps = [obj for obj in bpy.data.objects if obj.type == "LIGHT"]
    for linked in {lamp.light_linking.receiver_collection for lamp in lamps} - {None}:
        for held in (linked, *linked.children_recursive):
            at = list(held.objects).index(original) if original in set(held.objects) else None
            if at is not None and copy not in set(held.objects):
                held.objects.link(copy)
                state = held.collection_objects[at].light_linking.link_state
                held.collection_objects[list(held.objects).index(copy)].light_linking.link_state = state


def lamps(collection: bpy.types.Collection, light: lights.Light) -> None:
    """Put lamps into a collection for what a light shines on straight; a Gaussian sun is made of some disks."""
    if isinstance(light, lights.Sun):
        halves = light.half_angles(DISKS if light.gaussian else 1, np.random.default_rng(0))
        for half in halves:
            data = bpy.data.lights.new(COLLECTION, "SUN")
            data.angle = 2 * half
            data.energy = max(light.irradiance) / len(halves)
            _lamp(collection, data, light, light.direction)
    elif isinstance(light, lights.Area):
        data = bpy.data.lights.new(COLLECTION, "AREA")
        data.shape = "ELLIPSE" if light.round else "RECTANGLE"
        data.size, data.size_y = light.size
        data.energy = max(light.intensity) * math.pi
        _lamp(collection, data, light).matrix_world = mathutils.Matrix(light.frame)
    else:
        data = bpy.data.lights.new(COLLECTION, "SPOT" if light.axis else "POINT")
        data.shadow_soft_size = light.radius
        data.energy = max(light.intensity) * 4 * math.pi
        if light.axis:
            data.spot_size, data.spot_blend = 2 * math.acos(light.edge), light.blend
        _lamp(collection, data, light, light.axis).location = light.place


def _lamp(collection, data, light, direction=None):
    data.color = color(light)
    # met by shadow rays only, which end at an interface: by chance it would be met through one, and counted twice
    data.cycles.use_multiple_importance_sampling = False
    lamp = bpy.data.objects.new(COLLECTION, data)
    lamp[CAUSTICS_MARK] = True
    if direction:
        lamp.rotation_euler = mathutils.Vector(direction).to_track_quat("-Z", "Y").to_euler()
    collection.objects.link(lamp)
    return lamp


def split(collection: bpy.types.Collection, placed: lights.Placed) -> None:
    """Let a lamp be met by shadow rays only, and a copy of it, in a collection, only be seen, where nothing was scattered."""
    lamp, data = placed.lamp, placed.lamp.data
    if data.get(SAMPLING) is None:
        data[SAMPLING] = data.cycles.use_multiple_importance_sampling
    data.cycles.use_multiple_importance_sampling = False
    seen = lamp.copy()
    seen.name = f"{COLLECTION} {lamp.name}"
    light: Any = data.copy()
    light.cycles.use_multiple_importance_sampling = True
    seen.data = light
    seen.visible_diffuse = False
    seen[CAUSTICS_MARK], seen[SEEN_FOR] = True, data
    if not placed.single:
        seen.parent = None
        seen.animation_data_clear()
        seen.constraints.clear()
        seen.matrix_world = placed.matrix
    own = lights.emitted(lamp)
    nodes = Nodes(empty_tree(light))
    path = nodes.add("ShaderNodeLightPath").outputs
    straight = nodes.math("MAXIMUM", path["Is Camera Ray"], path["Is Singular Ray"])
    scattered = nodes.math("LESS_THAN", path["Diffuse Depth"], 0.5)
    strength = nodes.math("MULTIPLY", straight, scattered)
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": own, "Strength": strength}), "Light")
    collection.objects.link(seen)


def _plain_diffuse(material):
    """Give a material without nodes those of what Cycles renders in its place."""
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfDiffuse", inputs={"Color": tuple(material.diffuse_color)}))


def _light(image, layers):
    """A node group: what a white surface would send out of the light in `image`, whose windows are those layers()."""
    group = bpy.data.node_groups.new(COLLECTION, "ShaderNodeTree")
    group[CAUSTICS_MARK] = True
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    nodes = Nodes(group)
    back = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
    light, left = None, [nodes.math("SUBTRACT", 1.0, back), back]
    for side, level in layers:
        place, *limits = (
            nodes.add("ShaderNodeAttribute", attribute_name=name).outputs["Vector"] for name in names(side, level)
        )
        inside = None
        for limit, operation in zip(limits, ("GREATER_THAN", "LESS_THAN"), strict=True):
            a, b = (nodes.add("ShaderNodeSeparateXYZ", inputs={0: vector}) for vector in (place, limit))
            for axis in (0, 1):
                within = nodes.math(operation, a.outputs[axis], b.outputs[axis])
                inside = nodes.math("MULTIPLY", inside, within) if inside else within
        here = nodes.math("MULTIPLY", left[side], inside)
        # what a finer window shows, a coarser one does not
        left[side] = nodes.math("SUBTRACT", left[side], here)
        shown = nodes.add("ShaderNodeTexImage", inputs={"Vector": place}, image=image, interpolation="Linear")
        shown[CAUSTICS_MARK] = True
        scaled = nodes.scale(shown.outputs["Color"], here)
        light = nodes.vector("ADD", light, scaled) if light else scaled
    nodes.add("NodeGroupOutput", inputs={0: nodes.scale(light, 1 / np.pi)})
    return group


def _shining(material, group):
    """A copy of `material` whose diffuse parts also send out what they would of the light of the _light() group."""
    copy: Any = material.copy() if material else bpy.data.materials.new(COLLECTION)
    copy[CAUSTICS_MARK] = True
    if not has_nodes(material):
        _plain_diffuse(copy)
    for owned in own_groups(copy.node_tree):
        owned[CAUSTICS_MARK] = True
    carry(copy)
    for node, path in asked(copy):
        if kind_of(node, path) == "diffuse":
            _glow(node, group)
    copy.cycles.emission_sampling = "NONE"
    return copy


def _glow(node, group):
    """Let a diffuse closure also send out its part of the light of a group."""
    nodes = Nodes(node.id_data)
    color = node.inputs["Color"] if "Color" in node.inputs else node.inputs["Base Color"]
    albedo = fed(color) if color.is_linked else fed(color)[:3]
    light = nodes.vector("MULTIPLY", nodes.add("ShaderNodeGroup", node_tree=group).outputs[0], albedo)
    if node.type == "BSDF_PRINCIPLED":  # of its metal nothing is diffuse
        light = nodes.scale(light, nodes.math("SUBTRACT", 1.0, fed(node.inputs["Metallic"])))
    glow = nodes.add("ShaderNodeEmission", inputs={"Color": light})
    places = [link.to_socket for link in node.outputs[0].links]
    both = nodes.add("ShaderNodeAddShader", inputs={0: node.outputs[0], 1: glow.outputs[0]})
    for place in places:
        nodes.feed(place, both.outputs[0])

# SPDX-License-Identifier: GPL-3.0-or-later
"""What shines in a scene with baked caustics: copies of the surfaces that took light, and lamps; and how all that goes again."""

import math

import bpy
import mathutils
import numpy as np

from ..cycles.nodes import Nodes, empty_tree
from ..cycles.object_values import carry, give
from ..cycles.visibility import HIDDEN, OWNER, asked, has_nodes
from . import lights
from .bending import fed, kind_of, lands, own_groups
from .density import LEVELS
from .digest import ALIKE

MULTIPLE = "nim_caustics_multiple"  # of a lamp: whether it was found by chance too; of a sky: how it was sampled
SKY = "nim_caustics_sky"  # of the collection: the world whose sun the caustics are of
STANDS = "nim_caustics_lamp"  # of a lamp that is only seen: the bpy.types.Light of the one it is seen for
COLLECTION = "NIM Caustics"
DISKS = 6  # lamps for a Gaussian sun


def baked(scene):
    """The collection of the caustics in `scene`, or None."""
    return next((one for one in scene.collection.children_recursive if one.get(OWNER)), None)


def left(scene):
    """Whether there is anything in `scene` for clear() to take back, if only what stays hidden without its copy."""
    return baked(scene) is not None or any(
        thing.get(HIDDEN) or (thing.type == "LIGHT" and thing.data.get(MULTIPLE) is not None) for thing in scene.objects
    )


def standing(scene):
    """A mark of which copies there are and where: one that was taken for its surface may be moved, or deleted."""
    copies = [thing for thing in scene.objects if thing.get(OWNER) and thing.type == "MESH"]
    # as they are saved: a matrix is made anew by each machine
    return repr(sorted([*thing.location, *thing.rotation_euler, *thing.scale] for thing in copies))


def clear(scene):
    """Take baked caustics out of `scene`: the copies and lamps go, and what they stood for is rendered again."""
    things = [thing for thing in scene.objects if thing.get(OWNER)]
    collections = [one for one in scene.collection.children_recursive if one.get(OWNER)]
    data = {thing.data for thing in things}
    materials = {
        slot.material for thing in things for slot in thing.material_slots if slot.material and slot.material.get(OWNER)
    }
    groups = {node.node_tree for one in materials for node in _nodes(one.node_tree) if node.type == "GROUP"}
    groups = {group for group in groups if group and group.get(OWNER)}
    trees = [*(one.node_tree for one in materials), *groups]
    images = {node.image for tree in trees for node in tree.nodes if node.get(OWNER) and node.type == "TEX_IMAGE"}
    for lamp in {thing[STANDS] for thing in things if thing.get(STANDS)}:
        _found_by_chance(lamp)
    for thing in scene.objects:
        if thing.get(HIDDEN):
            thing.hide_render, thing.hide_viewport = False, thing[HIDDEN] > 1
            del thing[HIDDEN]
        if thing.type == "LIGHT":
            _found_by_chance(thing.data)
    for world in {scene.world, *(one.get(SKY) for one in collections)} - {None}:
        if world.get(MULTIPLE) is not None:
            _switch_sun(world, hidden=False)
            world.cycles.sampling_method = world[MULTIPLE]
            del world[MULTIPLE]
    for collection in collections:
        _hand_back(scene, collection)
    bpy.data.batch_remove([*things, *collections])
    bpy.data.batch_remove([*data, *materials, *groups, *images])


def _found_by_chance(lamp):
    """Let a lamp be found by chance again, if it was before."""
    if lamp.get(MULTIPLE) is not None:
        lamp.cycles.use_multiple_importance_sampling = lamp[MULTIPLE]
        del lamp[MULTIPLE]


def _nodes(tree):
    """All nodes of a tree, those in the groups in it too."""
    for node in tree.nodes:
        yield node
        if node.type == "GROUP" and node.node_tree:
            yield from _nodes(node.node_tree)


def _hand_back(scene, collection):
    """Leave what a person put into the collection of the caustics to the scene."""
    keeps, others = scene.collection, set(collection.children)
    held = {thing for one in scene.collection.children_recursive if one != collection for thing in one.objects}
    for thing in collection.objects:
        if not thing.get(OWNER) and thing not in held and thing not in set(keeps.objects):
            keeps.objects.link(thing)
    for child in others - set(keeps.children):
        keeps.children.link(child)


def _switch_sun(world, hidden):
    node = world.node_tree and world.node_tree.nodes.get(lights.HIDDEN)
    if node:  # unless the sky was made anew
        node.outputs[0].default_value = float(hidden)


def hide_sun(world):
    """Leave the sun in a sky to where nothing was scattered: a lamp and the photons stand for it elsewhere."""
    world[MULTIPLE] = world.cycles.sampling_method
    _switch_sun(world, hidden=True)
    world.cycles.sampling_method = "NONE"  # without its sun the sky is smooth, and is found by chance


def color(light):
    """(3,) the colour of a light, its strongest channel 1."""
    strength = np.asarray(light.irradiance if isinstance(light, lights.Sun) else light.intensity)
    return strength / strength.max()


def layers(texture):
    """The (back, level) of the windows of a density.Texture: whether of the back of faces, and which of those nested."""
    return sorted({(key // LEVELS % 2, key % LEVELS) for key in texture.windows})


def names(back, level):
    """Names of the corner attributes for those windows: the place in the texture, and the window's two corners there."""
    return [f"nim_caustics_{what}_{'back' if back else 'front'}_{level}" for what in ("place", "low", "high")]


def replace(scene, collection, name, copies, irradiance, layers):
    """Put a copy of the object `name`, which also shines, in its place."""
    image = bpy.data.images.new(f"{COLLECTION} {name}", *irradiance.shape[1::-1], alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.ones((*irradiance.shape[:2], 4), np.float32)
    pixels[..., :3] = irradiance
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    group = _light(image, layers)
    original = next(thing for thing in scene.objects if thing.name == name and not thing.library)
    for mesh, part in copies:
        thing = bpy.data.objects.new(f"{COLLECTION} {name}", mesh)
        thing.matrix_world = part.matrix
        _look_alike(thing, original)
        give(thing, part.values, original)
        thing[OWNER] = True
        for index, material in enumerate(part.materials):
            if lands(material):
                mesh.materials[index] = _shining(material, group)
        collection.objects.link(thing)
        _link_to_lamps(thing, original)
    original[HIDDEN] = 2 if original.hide_viewport else 1
    original.hide_render = original.hide_viewport = True


def _look_alike(thing, original):
    """Give an object what decides, beside mesh and materials, how another one is rendered."""
    for key, value in original.items():
        if isinstance(value, (bool, int, float, str)) and not key.startswith("nim_"):
            thing[key] = value
    for name in ALIKE:
        setattr(thing, name, getattr(original, name))
    for kind in ("receiver_collection", "blocker_collection"):
        setattr(thing.light_linking, kind, getattr(original.light_linking, kind))


def _link_to_lamps(thing, original):
    """Let the lamps that shine on some things only take a copy for its original."""
    lamps = [one for one in bpy.data.objects if one.type == "LIGHT"]
    for linked in {one.light_linking.receiver_collection for one in lamps} - {None}:
        for held in (linked, *linked.children_recursive):
            at = list(held.objects).index(original) if original in set(held.objects) else None
            if at is not None and thing not in set(held.objects):
                held.objects.link(thing)
                state = held.collection_objects[at].light_linking.link_state
                held.collection_objects[list(held.objects).index(thing)].light_linking.link_state = state


def lamps(collection, light):
    """Lamps for what a lights.Sun, Lamp or Area shines on straight; a Gaussian sun is made of some disks."""
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
    lamp[OWNER] = True
    if direction:
        lamp.rotation_euler = mathutils.Vector(direction).to_track_quat("-Z", "Y").to_euler()
    collection.objects.link(lamp)
    return lamp


def split(collection, placed):
    """Let a lights.Placed be met by shadow rays only, and a copy of it only be seen, where nothing was scattered."""
    lamp, data = placed.thing, placed.thing.data
    if data.get(MULTIPLE) is None:
        data[MULTIPLE] = data.cycles.use_multiple_importance_sampling
    data.cycles.use_multiple_importance_sampling = False
    seen = lamp.copy()
    seen.name = f"{COLLECTION} {lamp.name}"
    seen.data = data.copy()
    seen.data.cycles.use_multiple_importance_sampling = True
    seen.visible_diffuse = False
    seen[OWNER], seen[STANDS] = True, data
    if not placed.single:
        seen.parent = None
        seen.animation_data_clear()
        seen.constraints.clear()
        seen.matrix_world = placed.matrix
    own = lights.emitted(lamp)
    nodes = Nodes(empty_tree(seen.data))
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
    group[OWNER] = True
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
            a, b = (nodes.add("ShaderNodeSeparateXYZ", inputs={0: one}) for one in (place, limit))
            for axis in (0, 1):
                within = nodes.math(operation, a.outputs[axis], b.outputs[axis])
                inside = nodes.math("MULTIPLY", inside, within) if inside else within
        here = nodes.math("MULTIPLY", left[side], inside)
        # what a finer window shows, a coarser one does not
        left[side] = nodes.math("SUBTRACT", left[side], here)
        shown = nodes.add("ShaderNodeTexImage", inputs={"Vector": place}, image=image, interpolation="Linear")
        shown[OWNER] = True
        scaled = nodes.scale(shown.outputs["Color"], here)
        light = nodes.vector("ADD", light, scaled) if light else scaled
    nodes.add("NodeGroupOutput", inputs={0: nodes.scale(light, 1 / np.pi)})
    return group


def _shining(material, group):
    """A copy of `material` whose diffuse parts also send out what they would of the light of the _light() group."""
    copy = material.copy() if material else bpy.data.materials.new(COLLECTION)
    copy[OWNER] = True
    if not has_nodes(material):
        _plain_diffuse(copy)
    for owned in own_groups(copy.node_tree):
        owned[OWNER] = True
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

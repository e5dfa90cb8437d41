# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render of a scene shows, whatever the viewport shows: one idea for renders, bakes, checks and light paths.

Objects are read from the evaluated dependency graph, since materials may sit in the slots of an object or of its mesh,
come from geometry nodes, from an instance, or from the view layer; nodes are read through the groups they are in.
"""

from __future__ import annotations

import contextlib
from collections.abc import Container, Iterable, Iterator
from typing import Any, NamedTuple

import bpy
import mathutils

from .closures import INTERFACE, closure_of_node
from .nodes import Owner, uses_nodes

CAUSTICS_MARK = "nim_caustics"  # marks what a bake (caustics.Bake) put into the scene
CAUSTICS_HIDDEN = "nim_caustics_hidden"  # and what it put a copy in the place of
SURFACES = ("MESH", "CURVE", "SURFACE", "FONT", "META")  # types of objects that are meshes as they are rendered
PATHS_MARK = "nim_light_paths"  # of the curves that show light paths (ui.light_paths), which neither light nor shade


class Shown(NamedTuple):
    """A mesh that a render shows, once for each instance; valid only as long as its depsgraph.

    object:    evaluated; of an instance that geometry nodes made without an object, the object that makes it
    original:  the object of the file that it is, or that it is an instance of
    matrix:    of this instance; frozen, so that a copy of it is what can be decomposed
    materials: original materials or None, by the material index of faces; at least one
    single:    whether it is that object itself, not an instance of it
    parent:    the original object that makes the instances, or None
    mesh:      the evaluated bpy.types.Mesh that is rendered
    random:    of this instance, 0 to 1, as Object Info gives it
    """

    object: bpy.types.Object
    original: bpy.types.Object
    matrix: mathutils.Matrix
    materials: tuple[bpy.types.Material | None, ...]
    single: bool
    parent: bpy.types.Object | None
    mesh: bpy.types.Mesh
    random: float = 0.0


class Asked(NamedTuple):
    """A node that a render asks, and `path`, the group nodes that it lies within, the outermost first."""

    node: bpy.types.Node
    path: tuple[bpy.types.Node, ...]


# ------------------------------------------------------------------------------------------------ objects


def is_rendered(obj: bpy.types.Object) -> bool:
    """Whether an object is seen in renders without baked caustics, wherever one of its collections or instances is."""
    return not obj.get(CAUSTICS_MARK) and (not obj.hide_render or bool(obj.get(CAUSTICS_HIDDEN)))


def rendered(scene: bpy.types.Scene, view: bpy.types.ViewLayer | None = None) -> list[bpy.types.Object]:
    """The objects, in the order of the scene, that a render of `scene` without baked caustics shows by themselves.

    view: the view layer that is rendered; None for the first
    """
    held = set()
    for layer in _layers(scene, view):
        held.update(layer.collection.objects)
    return [obj for obj in scene.objects if obj in held and is_rendered(obj)]


def _layers(scene, view=None):
    """The layer collections of a view layer, the first if None, that are rendered."""
    view = view or scene.view_layers[0]
    if view.layer_collection is None:  # from 5.2, until a new scene's view layer has been asked for
        view.update()
    found, queue = [], [view.layer_collection]
    while queue:
        layer = queue.pop()
        if not layer.collection.hide_render:
            queue += layer.children  # which can be there where what holds them is excluded
            if not layer.exclude:
                found.append(layer)
    return found


@contextlib.contextmanager
def as_rendered(scene: bpy.types.Scene) -> Iterator[bpy.types.Depsgraph]:
    """The depsgraph of `scene` with its objects and modifiers as a render sees them, not as the viewport shows them.

    Where the two differ it changes the scene for as long, so it is for operators and commands, not for drawing.
    """
    changed, eyes, view = [], [], scene.view_layers[0]

    def put(owner, name, value):
        if getattr(owner, name) != value:
            changed.append((owner, name, getattr(owner, name)))
            setattr(owner, name, value)

    closed = [place for place, layer in enumerate(_layers(scene)) if layer.hide_viewport]
    asleep = [obj for obj in scene.objects if not obj.visible_get(view_layer=view)]
    try:
        for layer in _layers(scene):
            put(layer.collection, "hide_viewport", False)
        _close_eyes(scene, closed, False)
        shown = set(rendered(scene))
        # of what its keyframes may show now, that is known only once it is evaluated
        shown.update(obj for obj in asleep if obj.animation_data and obj.name in view.objects)
        for obj in scene.objects:
            if obj in shown:
                put(obj, "hide_viewport", False)
                if obj.hide_get(view_layer=view):
                    eyes.append(obj)
                    obj.hide_set(False, view_layer=view)
            for modifier in obj.modifiers:
                put(modifier, "show_viewport", modifier.show_render)
                if obj.mode == "EDIT":  # a render leaves it
                    put(modifier, "show_in_editmode", True)
                if hasattr(modifier, "render_levels"):
                    put(modifier, "levels", modifier.render_levels)
        for obj in asleep:
            if obj in shown:
                _wake(obj)
        # not the context's, which a render that changes the frame, in a thread of its own, must not touch
        view.update()
        yield view.depsgraph
    finally:
        for obj in eyes:
            obj.hide_set(True, view_layer=view)
        for owner, name, value in reversed(changed):
            setattr(owner, name, value)
        _close_eyes(scene, closed, True)


def _wake(obj):
    """Let keyframes and drivers give an object that was hidden, its data and its materials the values of the scene's frame.

    Blender evaluates what appears, but its animation not before the frame changes, or something of the animation itself.
    """
    materials = [slot.material for slot in obj.material_slots if slot.material]
    held = [obj, obj.data, getattr(obj.data, "shape_keys", None), *materials]
    for owner in (*held, *(getattr(one, "node_tree", None) for one in held)):
        if animation := getattr(owner, "animation_data", None):
            animation.use_nla = animation.use_nla


def _close_eyes(scene, places, closed):
    """Open or close the eyes of layer collections, by their places in _layers(): Blender may have made them anew."""
    for place in places:
        _layers(scene)[place].hide_viewport = closed


def shown(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, *, overridden: bool = True) -> Iterator[Shown]:
    """Each mesh, curves and texts as the meshes they become, that a render of `scene` without baked caustics shows.

    depsgraph:  as_rendered()'s, for all that a render shows; the viewport's, while drawing, for what is evaluated there
    overridden: whether the view layer's material stands in the place of others, as in a render
    """
    override = scene.view_layers[0].material_override if overridden else None
    alone = set(rendered(scene))
    for instance in depsgraph.object_instances:
        obj = instance.object
        original, parent = obj.original, instance.parent and instance.parent.original
        own = instance.is_instance and original.type != "MESH" and parent == original
        single = not instance.is_instance or own
        there = original in alone if single else is_instance_rendered(original, parent, alone)
        # curves, texts and the like are there a second time, as the mesh that they become
        if obj.type == "MESH" and instance.show_self and there:
            if original.mode == "EDIT":  # its data is empty, or as it was before, until a mesh is asked for
                obj.to_mesh()
                obj.to_mesh_clear()
            materials = materials_of(obj, override)
            matrix = instance.matrix_world.copy().freeze()
            random = (instance.random_id if instance.is_instance else _hash(original.name)) % 2**32 / (2**32 - 1)
            # `obj` of an instance lasts until the next one, which takes its place
            lasting = instance.instance_object or obj
            yield Shown(lasting, original, matrix, materials, single, parent or None, obj.data, random)


def _hash(name):
    """The number that Cycles makes of an object's name (hash_string() of it, and lookup3 by Bob Jenkins, public domain)."""
    number = 0
    for byte in name.encode():
        number = number * 37 + (byte if byte < 128 else byte - 256)
    a = b = c = 0xDEADBEEF + (2 << 2) + 13
    a = (a + number) % 2**32

    def less(p, q, turn):  # (p xor q) - q turned to the left
        return ((p ^ q) - (q << turn | q >> 32 - turn)) % 2**32

    c = less(c, b, 14)
    a = less(a, c, 11)
    b = less(b, a, 25)
    c = less(c, b, 16)
    a = less(a, c, 4)
    b = less(b, a, 14)
    return less(c, b, 24)


def lamps(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> list[bpy.types.Object]:
    """The lamps, as objects of the file, that a render shows: by themselves or as instances; each once."""
    alone = rendered(scene)
    found = [obj for obj in alone if obj.type == "LIGHT"]
    alone = set(alone)
    for instance in depsgraph.object_instances:
        if instance.is_instance and instance.object.type == "LIGHT":
            lamp = instance.object.original
            if is_instance_rendered(lamp, instance.parent and instance.parent.original, alone):
                found.append(lamp)
    return list(dict.fromkeys(found))


def is_instance_rendered(
    obj: bpy.types.Object, parent: bpy.types.Object | None, alone: Container[bpy.types.Object]
) -> bool:
    """Whether a render shows an instance of an object that `parent` makes; alone: the objects that it shows by themselves."""
    if parent not in alone or obj.get(CAUSTICS_MARK):
        return False
    # geometry nodes render an object that they make instances of even where it is hidden itself
    return is_rendered(obj) or parent.instance_type == "NONE"


def materials_of(
    obj: bpy.types.Object, override: bpy.types.Material | None = None
) -> tuple[bpy.types.Material | None, ...]:
    """The original materials, or None, in the slots of an evaluated object; `override`: what a view layer puts there."""
    worn = [slot.material for slot in obj.material_slots] or [None]
    return tuple(override or (material and material.original) for material in worn)


def declared(objects: Iterable[bpy.types.Object]) -> dict[bpy.types.Object, list[bpy.types.Material]]:
    """{object: the materials that it may wear, or what it makes instances of}, as its slots, geometry nodes and collection say.

    Nothing is evaluated: this is for what no depsgraph at hand shows. What a node tree holds counts, used there or not.
    """
    uses, found = None, {}
    for obj in objects:
        things = [obj]
        if _makes_others(obj):
            uses = uses or _uses()
            things = _reached(obj, uses)
        own = {thing: None for thing in things if isinstance(thing, bpy.types.Material)}
        for thing in things:
            if isinstance(thing, bpy.types.Object) and thing.type in SURFACES:
                own |= dict.fromkeys(material for material in materials_of(thing) if material)
        found[obj] = list(own)
    return found


def _makes_others(obj):
    return obj.instance_collection or (obj.modifiers and any(modifier.type == "NODES" for modifier in obj.modifiers))


def _uses():
    """{data-block: those of these kinds that it uses}, what modifiers are given too: Blender's map of users, turned round."""
    kinds, uses = {"OBJECT", "COLLECTION", "NODETREE", "MATERIAL"}, {}
    for used, users in bpy.data.user_map(key_types=kinds, value_types=kinds).items():
        for user in users:
            uses.setdefault(user, []).append(used)
    return uses


def _reached(obj, uses):
    """An object, and what its geometry nodes and its collection hold."""
    found, queue = {obj: None}, [obj]
    while queue:
        thing = queue.pop()
        if isinstance(thing, bpy.types.Collection):
            inner = [held for held in thing.all_objects if is_rendered(held)]
        elif isinstance(thing, bpy.types.NodeTree):
            inner = uses.get(thing, [])
        elif isinstance(thing, bpy.types.Object) and _makes_others(thing):
            # others that it uses may be what it is parented or bound to
            inner = [used for used in uses.get(thing, []) if not isinstance(used, bpy.types.Object)]
        else:
            inner = []
        queue += [held for held in inner if held not in found]
        found |= dict.fromkeys(inner)
    return found


# ------------------------------------------------------------------------------------------------ nodes


def has_nodes(material: Owner | None) -> bool:
    """Whether a material, or none, is made of nodes; else it is a plain diffuse one. Or a lamp, or a sky."""
    return material is not None and uses_nodes(material)


def is_interface(node: bpy.types.Node) -> bool:
    """Whether a node is an interface of ours: it holds a marked group, and the numbers that describe one."""
    return INTERFACE.is_node(node)


def asked(material: Owner | None, socket: str = "Surface") -> list[Asked]:
    """The nodes that a render asks, those within groups too: linked, in the end, to that socket of the output.

    material: or a lamp, or a sky

    Reroutes and muted nodes are followed and not named; one of our closures is named, its inner nodes are not.
    """
    output = material.node_tree.get_output_node("CYCLES") if has_nodes(material) else None
    found, queue, seen = {}, [(output.inputs[socket], ())] if output else [], set()
    while queue:
        entry, path = queue.pop(0)
        key = (entry, tuple(path))
        if key in seen:
            continue
        seen.add(key)
        source = source_of(entry, path)
        if source is None:
            continue
        node, path = source[0].node, source[1]
        if (node, path) not in found:
            found[node, path] = Asked(node, path)
            queue += [(own, path) for own in node.inputs]
    return list(found.values())


def source_of(socket: bpy.types.NodeSocket, path: tuple = ()) -> tuple[bpy.types.NodeSocket, tuple] | None:
    """The output that feeds an input in the end, and the path of its node, through reroutes, muted nodes and groups.

    None where nothing does: the value is then that of value_of().
    """
    end = end_of(socket, path)
    return end if end[0].is_output else None


def end_of(socket: bpy.types.NodeSocket, path: tuple = ()) -> tuple[bpy.types.NodeSocket, tuple]:
    """The output that feeds an input in the end, or the unlinked input whose value counts; and its path."""
    while True:
        if socket.is_output or not socket.is_linked:  # quick, where `links` looks through all of the tree's
            return socket, path
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return socket, path
        output = links[0].from_socket
        node = output.node
        if node.type == "GROUP_INPUT" and path:
            socket, path = _named(path[-1].inputs, output), path[:-1]
        elif node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.mute:
            inner = next((link.from_socket for link in node.internal_links if link.to_socket == output), None)
            if inner is None:
                return socket, path  # as if nothing were linked
            socket = inner
        elif node.type == "GROUP" and node.node_tree and not closure_of_node(node):
            leave = next(
                (end for end in node.node_tree.nodes if end.type == "GROUP_OUTPUT" and end.is_active_output), None
            )
            if leave is None:
                return socket, path
            socket, path = _named(leave.inputs, output), (*path, node)
        else:
            return output, path
        if socket is None:
            return output, path


def _named(sockets, other):
    return next((socket for socket in sockets if socket.identifier == other.identifier), None)


def value_of(socket: bpy.types.NodeSocket, path: tuple = ()) -> Any:
    """The value of an input where no node but Value and RGB nodes decides it, a number or a tuple; else None."""
    end, _ = end_of(socket, path)
    if end.is_output and end.node.type not in ("VALUE", "RGB"):
        return None
    value = end.default_value
    return value if isinstance(value, (bool, int, float, str)) else tuple(value)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render of a scene shows, whatever the viewport shows: its objects, and which nodes of a material count."""

import contextlib

import bpy

OWNER = "nim_caustics"  # marks what a bake (caustics.Bake) put into the scene
HIDDEN = "nim_caustics_hidden"  # and what it put a copy in the place of
ALWAYS_NODES = (5, 0)  # the Blender from which on a material's nodes cannot be switched off


def is_rendered(thing):
    """Whether an object is seen in renders without baked caustics, wherever one of its collections or instances is."""
    return not thing.get(OWNER) and (not thing.hide_render or bool(thing.get(HIDDEN)))


def rendered(scene):
    """The objects, in the order of the scene, that a render of `scene` without baked caustics shows by themselves."""
    held = set()
    for layer in _layers(scene):
        held.update(layer.collection.objects)
    return [thing for thing in scene.objects if thing in held and is_rendered(thing)]


def _layers(scene):
    """The layer collections of the first view layer that are rendered."""
    found, queue = [], [scene.view_layers[0].layer_collection]
    while queue:
        layer = queue.pop()
        if not layer.collection.hide_render:
            queue += layer.children  # which can be there where what holds them is excluded
            if not layer.exclude:
                found.append(layer)
    return found


@contextlib.contextmanager
def as_rendered(scene):
    """The depsgraph of `scene` with its objects and modifiers as a render sees them, not as the viewport shows them."""
    changed, eyes, view = [], [], scene.view_layers[0]

    def put(owner, name, value):
        if getattr(owner, name) != value:
            changed.append((owner, name, getattr(owner, name)))
            setattr(owner, name, value)

    for layer in _layers(scene):
        put(layer, "hide_viewport", False)
        put(layer.collection, "hide_viewport", False)
    shown = set(rendered(scene))
    for thing in scene.objects:
        if thing in shown:
            put(thing, "hide_viewport", False)
            if thing.hide_get(view_layer=view):
                eyes.append(thing)
                thing.hide_set(False, view_layer=view)
        for modifier in thing.modifiers:
            put(modifier, "show_viewport", modifier.show_render)
            if hasattr(modifier, "render_levels"):
                put(modifier, "levels", modifier.render_levels)
    try:
        with bpy.context.temp_override(scene=scene, view_layer=view):
            yield bpy.context.evaluated_depsgraph_get()
    finally:
        for thing in eyes:
            thing.hide_set(True, view_layer=view)
        for owner, name, value in reversed(changed):
            setattr(owner, name, value)


def has_nodes(material):
    """Whether a bpy.types.Material, or None, is made of nodes; else it is a plain diffuse one."""
    if material is None or material.node_tree is None:
        return False
    return bpy.app.version >= ALWAYS_NODES or material.use_nodes


def counting(material):
    """The nodes of a bpy.types.Material that a render asks: those linked, in the end, to the Surface of its output."""
    output = material.node_tree.get_output_node("CYCLES") if has_nodes(material) else None
    found, queue = [], _sources(output.inputs["Surface"]) if output else []
    while queue:
        node = queue.pop()
        if node not in found:
            found.append(node)
            for socket in node.inputs:
                queue += _sources(socket)
    return found


def _sources(socket):
    return [link.from_node for link in socket.links]

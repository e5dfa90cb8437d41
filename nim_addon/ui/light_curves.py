# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths as curves: a collection of them in the scene, in three materials that glow."""

import bpy
import numpy as np

from ..cycles.nodes import Nodes, empty_tree
from ..cycles.visibility import PATHS_MARK
from ..physics.rays import Kind, Paths

COLLECTION = "NIM Light Paths"
# PATHS_MARK is the custom property of all that is made here; that of an object holds the source it was drawn for.

# Linear colours: light arrives yellow, is reflected blue, and goes on orange.
COLORS = {Kind.INCIDENT: (1.0, 0.80, 0.25), Kind.REFLECTED: (0.10, 0.60, 1.0), Kind.TRANSMITTED: (1.0, 0.20, 0.02)}
# Thickness goes with this power of the energy: a branch of one per cent is still seen, a third as thick. In what absorbs
# it tapers from the energy at its start to what arrives.
THINNING = 0.25


def draw(scene: bpy.types.Scene, source: str, paths: Paths, thickness: float, through: bool) -> None:
    """Replace the curves of `source` in a scene; `through`: whether they are seen inside and behind interfaces, too."""
    _remove([object_ for object_ in scene.objects if object_.get(PATHS_MARK) == source])
    collection = collection_of(scene)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[PATHS_MARK] = True
        scene.collection.children.link(collection)
    radius = (np.stack([paths.energy, paths.arriving], axis=1) ** THINNING).astype(np.float32)
    if source == "camera":
        # pointed at the lens: who looks through the camera would look into tubes, and see nothing else
        radius[paths.depth == 0, 0] = 0
    ends = np.stack([np.insert(paths.start, 3, 1, axis=1), np.insert(paths.end, 3, 1, axis=1)], axis=1)
    ends = ends.reshape(-1, 8).astype(np.float32)
    for kind in Kind:
        chosen = np.flatnonzero(paths.kind == kind)
        if not len(chosen):
            continue
        curve = bpy.data.curves.new(f"{kind.name.capitalize()} {source}", "CURVE")
        curve.dimensions = "3D"
        curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = thickness / 2, 1, True
        curve.materials.append(_material(kind, through))
        for segment in chosen:
            points = curve.splines.new("POLY").points
            points.add(1)
            points.foreach_set("co", ends[segment])
            points.foreach_set("radius", radius[segment])
        object_ = bpy.data.objects.new(curve.name, curve)
        object_[PATHS_MARK] = source
        # a camera sees them, and through interfaces if wished; nothing is lit or shaded by them
        object_.visible_diffuse = object_.visible_glossy = object_.visible_volume_scatter = object_.visible_shadow = (
            False
        )
        object_.visible_transmission = through
        collection.objects.link(object_)


def _material(kind, through):
    """The file's material for that kind of path, made on first use: it glows, and is not looked for as a lamp."""
    mark = kind.name if through else f"{kind.name}, not inside"
    material = next(
        (known for known in bpy.data.materials if known.get(PATHS_MARK) == mark and not known.library), None
    )
    if material is not None:
        return material
    material = bpy.data.materials.new(f"Light Path {kind.name.lower()}")
    material[PATHS_MARK] = mark
    material.diffuse_color = (*COLORS[kind], 1.0)
    material.cycles.emission_sampling = "NONE"
    nodes = Nodes(empty_tree(material))
    shader = nodes.add("ShaderNodeEmission", inputs={"Color": COLORS[kind]})
    if not through:
        # a ray bent backwards still counts as the camera's; the bend counts as a transparent surface before this one
        before = nodes.add("ShaderNodeLightPath").outputs["Transparent Depth"]
        clear = nodes.add("ShaderNodeBsdfTransparent")
        behind = nodes.math("GREATER_THAN", before, 0.5)
        shader = nodes.add("ShaderNodeMixShader", inputs={0: behind, 1: shader.outputs[0], 2: clear.outputs[0]})
    nodes.end(shader)
    return material


def collection_of(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """The collection of light paths in that scene, None where it has none."""
    return next((collection for collection in scene.collection.children_recursive if collection.get(PATHS_MARK)), None)


def clear(scene: bpy.types.Scene) -> None:
    """Remove all light paths of a scene that has some, and what was made for them."""
    _remove([object_ for object_ in scene.objects if object_.get(PATHS_MARK)])
    collection = collection_of(scene)
    # what a person has put there stays in the scene; what is in it already cannot be linked again, and two objects of one
    # name, one of them from a library, are not the same
    for theirs, ours in (
        (scene.collection.objects, collection.objects),
        (scene.collection.children, collection.children),
    ):
        known = set(theirs)
        for item in [item for item in ours if item not in known]:
            theirs.link(item)
    bpy.data.collections.remove(collection)
    materials = bpy.data.materials
    bpy.data.batch_remove([material for material in materials if material.get(PATHS_MARK) and material.users == 0])


def _remove(objects):
    curves = {object_.data for object_ in objects}
    bpy.data.batch_remove(objects)
    bpy.data.batch_remove([curve for curve in curves if curve.users == 0])

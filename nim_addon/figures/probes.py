# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes: what the figures' changes to a built scene have in common, so that something can be measured in its picture."""

import bpy
import numpy as np

from ..cycles.nodes import Nodes, empty_tree
from ..scenes import surfaces
from ..scenes.stage import STAGE_MARK


def set_up(scene: bpy.types.Scene) -> None:
    """Set up a scene to be measured: a pixel is the mean over its own square.

    Cycles puts the first sample of every pixel at its centre, for every seed; so the render begins at the second one.
    """
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    scene.cycles.sample_offset = 1
    if hasattr(scene.cycles, "use_sample_subset"):  # from 4.5
        scene.cycles.use_sample_subset = True
        scene.cycles.sample_subset_length = scene.cycles.samples
        scene.cycles.samples *= 4


def through_the_middles(scene: bpy.types.Scene) -> None:
    """Let the rays of a picture go through the middles of its pixels.

    Cycles' box is a pixel wide, whatever its width is set to: all rays but those of the first sample lie anywhere in the
    pixel. Of this Gaussian all but one in some hundreds lie within 0.01 pixels of the middle.
    """
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01


def find(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The object that was built under that name: Blender appends a number where another scene of the file has it too."""
    return next(object_ for object_ in scene.objects if _built_as(object_) == name)


def _built_as(object_):
    return object_.name.partition(".")[0]


def add(scene: bpy.types.Scene, name: str, data: bpy.types.ID, location: tuple = (0, 0, 0)) -> bpy.types.Object:
    """A new object of a built scene, which goes when that is built anew."""
    object_ = bpy.data.objects.new(name, data)
    object_[STAGE_MARK] = scene[STAGE_MARK]
    object_.location = location
    scene.collection.objects.link(object_)
    return object_


def show_only(scene: bpy.types.Scene, *names: str) -> None:
    """Hide from the render all meshes but those of the objects of these names."""
    for object_ in scene.objects:
        object_.hide_render = object_.type == "MESH" and _built_as(object_) not in names


def unlit(scene: bpy.types.Scene) -> None:
    """Let every diffuse surface shine with its own colour instead: what a ray meets is then known."""
    for material in {slot.material for object_ in scene.objects for slot in object_.material_slots}:
        tree = material.node_tree
        for node in [node for node in tree.nodes if node.type == "BSDF_DIFFUSE"]:
            shining = tree.nodes.new("ShaderNodeEmission")
            shining.location = node.location
            shining.inputs["Color"].default_value = node.inputs["Color"].default_value
            for link in node.inputs["Color"].links:
                tree.links.new(link.from_socket, shining.inputs["Color"])
            for link in list(node.outputs[0].links):
                tree.links.new(shining.outputs[0], link.to_socket)
            tree.nodes.remove(node)
            material.cycles.emission_sampling = "NONE"  # nothing is left that it could light


def glow(name: str, color: tuple = (0, 0, 0)) -> bpy.types.Material:
    """A material that sends out light of one colour and reflects none; black by default."""
    return surfaces.shining(name, lambda nodes: color)


def paint(object_: bpy.types.Object, material: bpy.types.Material) -> None:
    """Give an object that material in place of all it has."""
    for slot in range(len(object_.data.materials)):
        object_.data.materials[slot] = material


def sky(scene: bpy.types.Scene, color=lambda nodes, direction: (0, 0, 0)) -> None:
    """Give a scene a sky whose colour is `color(nodes, direction)`, RGB or an output; a black one by default."""
    world = bpy.data.worlds.new("Sky")
    nodes = Nodes(empty_tree(world))
    direction = nodes.add("ShaderNodeTexCoord").outputs["Generated"]
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": color(nodes, direction)}), "World")
    scene.world = world
    world.cycles.sampling_method = "NONE"  # it is found by the paths alone: shadow rays end at an interface


def coded(nodes: Nodes, vector, scale: float):
    """The colour (1/2 + scale x, 1/2 + scale y, 1) of a vector, an output: light that tells where it came from."""
    inputs = {0: vector, 1: (scale, scale, 0.0), 2: (0.5, 0.5, 1.0)}
    return nodes.add("ShaderNodeVectorMath", operation="MULTIPLY_ADD", inputs=inputs).outputs[0]


def decoded(pixels: np.ndarray, scale: float) -> np.ndarray:
    """The (H, W, 2) x and y that coded() put into a picture, whatever share of the light came; NaN where none did."""
    blue = pixels[..., 2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(blue > 0, (pixels[..., :2] / blue - 0.5) / scale, np.nan)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels without their noise, by OpenImageDenoise as Cycles has it, for what is no single render: means of several."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base.files import temporary
from . import render
from .nodes import Nodes

# What it takes of a render's passes, by the names of the node's inputs.
INPUTS = {"Image": "Combined", "Albedo": "Denoising Albedo", "Normal": "Denoising Normal"}


def denoised(layers: Mapping[str, NDArray]) -> NDArray:
    """The picture (height, width, 3) of render.layers_of() a scene, without its noise, as Cycles itself would clean it.

    layers: "Combined", linear, and what guides the denoiser where it is there: "Denoising Albedo", "Denoising Normal"
    Raises RuntimeError, one sentence, where Blender did not clean it.
    """
    height, width = layers["Combined"].shape[:2]
    with temporary() as folder, _scene(width, height) as (scene, nodes, leave):
        loaded = {}
        for socket, name in INPUTS.items():
            if name in layers:
                render.write_linear(folder / f"{socket}.exr", layers[name])
                image = bpy.data.images.load(str(folder / f"{socket}.exr"))
                image.colorspace_settings.name = "Non-Color"
                loaded[socket] = image
        try:
            inputs = {
                socket: nodes.add("CompositorNodeImage", image=image).outputs[0] for socket, image in loaded.items()
            }
            node = nodes.add("CompositorNodeDenoise", inputs=inputs)
            _set(node, "use_hdr", "HDR", True, True)
            _set(node, "prefilter", "Prefilter", "ACCURATE", "Accurate")
            _set(node, "quality", "Quality", "HIGH", "High")
            nodes.feed(leave.inputs[0], node.outputs[0])
            pixels = render.pixels_of(scene)[::-1]
        finally:
            for image in loaded.values():
                bpy.data.images.remove(image)
    if pixels.shape != layers["Combined"].shape or not np.isfinite(pixels).all():
        raise RuntimeError("Blender did not denoise: it gave no picture.")
    return pixels


def _set(node, name, label, value, text):
    """Set what is a property of the node or, from Blender 5.0 on, an input of it."""
    if hasattr(node, name):
        setattr(node, name, value)
    elif label in node.inputs:
        node.inputs[label].default_value = text


@contextlib.contextmanager
def _scene(width: int, height: int) -> Iterator[tuple[bpy.types.Scene, Nodes, bpy.types.Node]]:
    """A scene that renders nothing but its compositor's nodes, with the node that its picture goes to."""
    scene = bpy.data.scenes.new("NIM denoising")
    group = None
    try:
        scene.render.engine = "CYCLES"  # another one would start the graphics
        scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
        scene.render.use_compositing, scene.render.use_sequencer = True, False
        if hasattr(scene, "compositing_node_group"):  # from 5.0
            group = scene.compositing_node_group = bpy.data.node_groups.new("NIM denoising", "CompositorNodeTree")
            group.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
            nodes = Nodes(group)
            leave = nodes.add("NodeGroupOutput")
        else:
            scene.use_nodes = True
            scene.node_tree.nodes.clear()
            nodes = Nodes(scene.node_tree)
            leave = nodes.add("CompositorNodeComposite")
        yield scene, nodes, leave
    finally:
        bpy.data.scenes.remove(scene)
        if group:
            bpy.data.node_groups.remove(group)

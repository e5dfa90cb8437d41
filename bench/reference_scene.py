# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference sphere (tests/data/README.md) as a Blender scene, and a render of it that times only the rendering."""

import resource
import tempfile
import time
from pathlib import Path

import bpy

from nim_addon.base.streams import quiet
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.sphere import ball
from nim_addon.scenes.stage import Stage

SKY_HORIZON, SKY_ZENITH = (1.0, 0.9, 0.75), (0.25, 0.45, 0.9)
LIGHT, DARK, RED, BLUE = (0.8,) * 3, (0.2,) * 3, (0.8, 0.05, 0.05), (0.05, 0.1, 0.8)
THREADS = 2


def build(n, lit, size, backend="osl"):
    """The scene as a bpy.types.Scene.

    n:       index of the sphere in vacuum; mu is its sign
    lit:     ground and balls reflect the light of the sky; or else they are black and shine in their colours
    size:    pixels along an edge of the square picture
    backend: of the sphere's material
    """

    opaque = surfaces.diffuse if lit else surfaces.shining

    def checks(nodes):
        xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeTexCoord").outputs["Object"]})
        cells = nodes.math("ADD", *(nodes.math("FLOOR", xyz.outputs[axis]) for axis in (0, 1)))
        return nodes.mix(nodes.math("FLOORED_MODULO", cells, 2.0), LIGHT, DARK)

    stage = Stage("reference", (size, size), backend)
    stage.mesh("Ground", *shapes.rectangle((-40, -40), (40, 40)), opaque("Ground", checks))
    ball(stage, "Sphere", (0, 0, 1), 1.0, interface_material("Sphere", Medium(n), backend=stage.backend))
    ball(stage, "Red", (0.5, 2.5, 0.6), 0.6, opaque("Red", lambda nodes: RED))
    ball(stage, "Blue", (-0.9, -2.2, 0.35), 0.35, opaque("Blue", lambda nodes: BLUE))
    stage.world(surfaces.sky("Sky", SKY_HORIZON, SKY_ZENITH))
    stage.camera((0, -6, 1.6), (0, 0, 1), 40)
    scene = stage.scene
    scene.render.use_persistent_data = True  # what is built once is no part of the time
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    return scene


def render(scene, samples, seed):
    """Render `scene`; returns linear float32 pixels (height, width, 3), seconds on the clock and on the processors."""
    import OpenImageIO as oiio

    scene.cycles.samples, scene.cycles.seed = samples, seed
    image = scene.render.image_settings
    with tempfile.TemporaryDirectory() as folder, quiet():
        file = str(Path(folder, "picture.exr"))
        clock, processors = time.perf_counter(), _processor_seconds()
        bpy.ops.render.render(scene=scene.name)
        clock, processors = time.perf_counter() - clock, _processor_seconds() - processors
        if hasattr(image, "media_type"):  # from 5.0
            image.media_type = "IMAGE"
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        bpy.data.images["Render Result"].save_render(file, scene=scene)
        pixels = oiio.ImageBuf(file).get_pixels(oiio.FLOAT)[..., :3]
    return pixels, clock, processors


def _processor_seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime

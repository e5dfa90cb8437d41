# SPDX-License-Identifier: GPL-3.0-or-later
"""What a goniometer in Cycles is made of: a beam, strips, a floor that says where it was hit; and what it has measured.

A parallel beam is an orthographic camera, seen backwards. Above is a red world, below at depth 1 a floor that glows with the x
where it was hit.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from . import settings
from .nodes import Nodes, empty_tree

SAMPLES = 64  # a pixel
ACROSS, ALONG = 32, 16  # pixels of a strip: 512 of them make 32,768 samples
PITCH = 0.002  # width of a strip, where the floor lies at depth 1
OFFSET = 64.0  # added to x on the floor, so that what glows is positive
LANDING_TOLERANCE = 1e-3  # of the depth
FURNACE_TOLERANCE = 1e-3
SIGMAS = 4.0
# of bpy.data, in which the rig makes something
COLLECTIONS = ("objects", "meshes", "materials", "worlds", "cameras", "node_groups", "texts", "scenes", "images")


@dataclass(frozen=True)
class Check:
    """One measured number beside the equation's: `error` is its standard error, or the tolerance where `z` is None."""

    what: str  # "R", "T", "landing", "R of 40", "R + T", "furnace", "slab"; "line", how far off its line a ray leaves a ball
    incident: str
    transmitted: str
    signs: str
    side: str  # the side of the faces the beam comes from
    angle: float  # degrees
    equation: float
    measured: float
    error: float
    z: float | None
    passed: bool

    def row(self) -> str:
        """One line of the printed table."""
        z = "" if self.z is None else f"{self.z:+7.2f}"
        verdict = "" if self.passed else "  FAIL"
        pair = f"{self.incident} -> {self.transmitted}"
        return (
            f"{self.what:8} {pair:30} {self.side:8} {self.angle:5.1f} "
            f"{self.equation:12.6f} {self.measured:12.6f} {self.error:10.2g} {z:7}{verdict}"
        )


HEADER = f"{'what':8} {'media':30} {'from':8} {'angle':>5} {'equation':>12} {'measured':>12} {'std error':>10} {'z':>7}"


@contextlib.contextmanager
def rig(backend: str) -> Iterator[bpy.types.Scene]:
    """An empty scene set up for measuring: it, and all data made for it, is taken away at the end."""
    before = {name: set(getattr(bpy.data, name)) for name in COLLECTIONS}
    scene = bpy.data.scenes.new("NIM goniometer")
    settings.lossless(scene, backend)
    scene.cycles.samples = SAMPLES
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.seed = 1
    try:
        yield scene
    finally:
        new = [data for name in COLLECTIONS for data in set(getattr(bpy.data, name)) - before[name]]
        bpy.data.batch_remove([data for data in new if data.name != "Render Result"])


def world(scene: bpy.types.Scene, color: Sequence[float]) -> None:
    """Light a scene evenly."""
    sky = scene.world = bpy.data.worlds.new("NIM goniometer")
    nodes = Nodes(empty_tree(sky))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": color}), "World")
    sky.cycles.sampling_method = "NONE"


def glowing_floor() -> bpy.types.Material:
    """A material that emits (0, x + OFFSET, 1)."""
    material = bpy.data.materials.new("NIM floor")
    nodes = Nodes(empty_tree(material))
    place = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    x = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs["X"]
    color = nodes.add("ShaderNodeCombineXYZ", inputs={1: nodes.math("ADD", x, OFFSET), 2: 1.0}).outputs[0]
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": color}))
    material.cycles.emission_sampling = "NONE"
    return material


def strip(
    scene: bpy.types.Scene, material: bpy.types.Material, low: float, high: float, z: float, flipped: bool = False
) -> None:
    """A quad across all x at height z, between y = low and high, its normal up or (flipped) down."""
    reach = 1.25 * OFFSET  # not farther: single precision places a hit to 1e-7 of the quad's size
    corners = [(-reach, low, z), (reach, low, z), (reach, high, z), (-reach, high, z)]
    mesh = bpy.data.meshes.new("NIM strip")
    mesh.from_pydata(corners, [], [(3, 2, 1, 0) if flipped else (0, 1, 2, 3)])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("NIM strip", mesh))


def beam(scene: bpy.types.Scene, angle: float, strips: int) -> None:
    """Aim an orthographic camera: light travels along (sin, 0, -cos) of the angle; strip after strip up the image."""
    theta = math.radians(angle)
    data = bpy.data.cameras.new("NIM beam")
    data.type = "ORTHO"
    data.sensor_fit = "VERTICAL"
    data.ortho_scale = strips * PITCH
    data.clip_start = 1e-3
    camera = bpy.data.objects.new("NIM beam", data)
    right, up = (math.cos(theta), 0, math.sin(theta)), (0, 1, 0)
    back = (-math.sin(theta), 0, math.cos(theta))
    frame = mathutils.Matrix((right, up, back)).transposed().to_4x4()
    frame.translation = mathutils.Vector(back) * 4 + mathutils.Vector((0, strips * PITCH / 2, 0))
    camera.matrix_world = frame
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = ACROSS, strips * ALONG
    scene.render.resolution_percentage = 100


def reflectance(what: str, labels: Mapping[str, str], angle: float, equation: float, red: NDArray) -> Check:
    """The Check of a mean of pixels (N,) against R; each pixel is an independent estimate from SAMPLES paths."""
    measured = float(red.mean())
    # The sampler spreads a pixel's paths evenly, so pixels scatter less than a binomial; where they do not scatter at
    # all, one path of all is what can be told.
    error = max(float(red.std(ddof=1)) / math.sqrt(red.size), 1.0 / (red.size * SAMPLES))
    z = (measured - equation) / error
    return Check(
        what, **labels, angle=angle, equation=equation, measured=measured, error=error, z=z, passed=abs(z) <= SIGMAS
    )


def within(
    what: str, labels: Mapping[str, str], angle: float, equation: float, measured: float, tolerance: float
) -> Check:
    """The Check of a number that must be within a tolerance of the equation's."""
    passed = abs(measured - equation) <= tolerance
    return Check(
        what, **labels, angle=angle, equation=equation, measured=measured, error=tolerance, z=None, passed=passed
    )


def landing(block: NDArray, angle: float) -> float:
    """Where rays of a beam at that angle, degrees, land on the floor, from where they met z = 0: pixels (M, ACROSS, 3)."""
    entry = (np.arange(ACROSS) + 0.5 - ACROSS / 2) * PITCH / ALONG / math.cos(math.radians(angle))
    green, blue = block[..., 1], block[..., 2]
    return float(np.sum(green - blue * (OFFSET + entry)) / max(np.sum(blue), 1e-9))


def ball(scene: bpy.types.Scene, material: bpy.types.Material, segments: int = 128, radius: float = 1.0) -> None:
    """A smooth sphere at the origin."""
    import bmesh

    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=radius)
    mesh = bpy.data.meshes.new("NIM furnace")
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("NIM furnace", mesh))

# SPDX-License-Identifier: GPL-3.0-or-later
"""A graded ball in a garden: a lens, a fish-eye, what sends all light back, a magnifier, or what nobody sees.

Before it and behind it there is something to see: a fence, trees and a hedge behind, a house and trees where the camera is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np

from ..cycles.graded import graded_ball_material, graded_core_material
from ..physics.graded import Profile
from . import shapes, surfaces
from .parameters import Parameters, choice, number, switch
from .sphere import ball
from .stage import Pose, Stage, staged

SIZE = (800, 600)  # pixels of its picture, where nothing else is asked for
# Lengths in metres, colours linear RGB. The ball rests on the lawn, 1 mm above it.
CENTER, RADIUS = (0.0, 0.0, 1.001), 1.0
FAR = 200.0  # half the side of the lawn
LIGHT_LAWN, DARK_LAWN, STRIPE = (0.105, 0.22, 0.035), (0.055, 0.135, 0.02), 0.9
PATH, JOINT, SLAB, PATH_HALF = (0.55, 0.5, 0.42), (0.16, 0.15, 0.12), 0.6, 0.9
LEAVES, NEEDLES, BARK = (0.05, 0.15, 0.03), (0.02, 0.075, 0.035), (0.12, 0.07, 0.04)
FENCE, HEDGE, WALL, ROOF = (0.75, 0.74, 0.7), (0.03, 0.1, 0.025), (0.78, 0.6, 0.3), (0.42, 0.08, 0.04)
FLOWERS = (0.75, 0.03, 0.02), (0.8, 0.5, 0.02), (0.3, 0.05, 0.5)
GLOBE = (0.75, 0.55, 0.2), (0.08, 0.12, 0.35)
HORIZON, ZENITH = (0.62, 0.80, 1.0), (0.03, 0.14, 0.55)
TOWARDS_SUN, SUN_IRRADIANCE = (-0.56, -0.36, 0.75), (3.748, 3.265, 2.539)
# x, y, height: round trees and pointed ones, behind the ball and behind the camera
ROUND = (-4.6, 9.0, 4.2), (6.5, 12.0, 5.0), (-11.0, 13.0, 5.5), (5.0, -13.0, 4.5), (-9.0, -6.0, 4.0)
POINTED = (2.6, 10.5, 4.6), (-1.6, 14.0, 5.2), (10.5, 9.0, 4.4), (9.0, -2.5, 4.6), (-4.5, -14.0, 5.0)
MEANINGS = {
    "luneburg": "A lens: it shows the half space behind it, upside down",
    "fisheye": "Maxwell's: every point of its rim is seen at the opposite one",
    "eaton": "It sends all light back where it came from",
    "invisible": "It leads light once round its middle, and on",
    "magnifier": "A mirror that a shell of a NIM makes larger",
    "cloak": "It leads light around what is in its hollow",
    "turn": "It turns all light by the same angle",
}
CORE_MEANINGS = {
    "mirror": "It reflects all light",
    "black": "It takes all light",
    "textured": "A painted ball, to be seen through the index around it",
}
HEAD_IN = 0.55  # of the space within: half the height of the head


@dataclass(frozen=True)
class BallParameters(Parameters):
    """Parameters of the ball scene: those of physics.graded.Profile, the angle in degrees."""

    device: str = choice("luneburg", "what the index of the ball does with light", MEANINGS)
    core: float | None = number(None, "radius of a core in the ball, whose radius is 1", 0.015625, 0.984375)
    surface: str = choice("mirror", "what the core is", CORE_MEANINGS)
    cap: float | None = number(None, "the largest index in the ball; as large as it gets if left out", 1.125, 100.0)
    angle: float = number(90.0, "by how much the device turn turns all light", 1.0, 360.0, "degrees")
    hollow: float = number(0.6, "radius of the hollow in a cloak", 0.0625, 0.9375)
    head: bool = switch(False, "a head inside the ball, which is not seen")

    sun_angle: float = number(16.0, "width of the sun; its light stays the same", 0.25, 30.0, "degrees")

    def __post_init__(self):
        super().__post_init__()
        _ = self.profile  # raises for what goes with nothing else

    @cached_property
    def profile(self) -> Profile:
        """The Profile of the ball."""
        return Profile(self.device, self.core, self.surface, self.cap, math.radians(self.angle), self.hollow)


@staged(BallParameters)
def build(parameters: BallParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from BallParameters; returns the bpy.types.Scene. The radius is 1 m, the camera looks along +y."""
    stage = Stage("ball", SIZE, backend)
    garden(stage)
    profile = parameters.profile
    if profile.core is not None and profile.surface == "textured":
        ball(stage, "Core", CENTER, RADIUS * profile.core, globe("Core"))
        material = graded_core_material("Ball", profile, backend=stage.backend)
    else:
        material = graded_ball_material("Ball", profile, backend=stage.backend)
    ball(stage, "Ball", CENTER, RADIUS, material)
    if parameters.head:
        head(stage, HEAD_IN * RADIUS * (profile.hollow if profile.is_cloak else profile.core or 1.0))
    stage.world(surfaces.sky("Sky", HORIZON, ZENITH, glow=sun(parameters)), aim=256)
    stage.camera(*pose(parameters))
    return stage.scene


def sun(parameters: BallParameters) -> surfaces.Glow:
    """The sun of these BallParameters."""
    return surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, parameters.sun_angle)


def pose(parameters: BallParameters | None = None) -> Pose:
    """The Pose of the camera, the same for all BallParameters."""
    return Pose((0, -7.0, 1.9), (0, 0, 1.08), 34)


def head(stage: Stage, half_height: float) -> bpy.types.Object:
    """A monkey's head in the middle of the ball, which looks at the camera."""
    # imported here: the wheel has bmesh only once bpy is imported
    import bmesh

    data = bpy.data.meshes.new("Head")
    mesh = bmesh.new()
    bmesh.ops.create_monkey(mesh)
    mesh.to_mesh(data)
    mesh.free()
    data.shade_smooth()
    data.materials.append(surfaces.plain("Head", (0.7, 0.25, 0.12)))
    object_ = stage.object("Head", data, CENTER)
    object_.scale = (half_height,) * 3
    return object_


# ------------------------------------------------------------------------------------------------ the garden


def garden(stage: Stage) -> None:
    """All that stands around the ball."""
    stage.mesh("Lawn", *shapes.rectangle((-FAR, -FAR), (FAR, FAR)), surfaces.diffuse("Lawn", _lawn))
    leaves, needles = surfaces.plain("Leaves", LEAVES), surfaces.plain("Needles", NEEDLES)
    bark = surfaces.plain("Bark", BARK)
    for x, y, height in ROUND:
        crown = 0.3 * height
        stage.mesh("Trunk", *shapes.tube((x, y, 0), (x, y, height - crown), 0.05 * height, 16), bark)
        _round(stage, "Crown", (x, y, height - crown), crown, leaves)
    for x, y, height in POINTED:
        cone = shapes.revolve([(0.0, 0.25), (0.22 * height, 0.25), (0.0, height)], 32)[:2]
        stage.mesh("Trunk", *shapes.tube((x, y, 0), (x, y, 0.5), 0.04 * height, 16), bark)
        stage.mesh("Cypress", *cone, needles, location=(x, y, 0))
    hedge = [shapes.box((x, 17.0, 0), (x + 19.0, 18.5, 2.4)) for x in (-21.0, 2.0)]
    hedge.append(shapes.box((-16.0, -17.5, 0), (16.0, -16.0, 2.4)))
    stage.mesh("Hedge", *shapes.joined(*hedge)[:2], surfaces.plain("Hedge", HEDGE))
    stage.mesh("Fence", *_fence(), surfaces.plain("Fence", FENCE))
    stage.mesh("House", *shapes.box((-2.2, -13.0, 0), (2.6, -10.0, 2.6)), surfaces.plain("House", WALL))
    roof = np.array(
        [
            (-2.5, -13.3, 2.6),
            (2.9, -13.3, 2.6),
            (2.9, -9.7, 2.6),
            (-2.5, -9.7, 2.6),
            (-2.5, -11.5, 4.0),
            (2.9, -11.5, 4.0),
        ]
    )
    faces = [(3, 2, 5, 4), (1, 0, 4, 5), (0, 3, 4), (2, 1, 5), (0, 1, 2, 3)]
    stage.mesh("Roof", roof, faces, surfaces.plain("Roof", ROOF))
    panes = [shapes.box((x, -10.02, z), (x + 0.7, -9.98, z + 0.9)) for x, z in ((-1.8, 1.1), (1.5, 1.1), (-0.75, 1.1))]
    stage.mesh("Windows", *shapes.joined(*panes)[:2], surfaces.plain("Windows", (0.04, 0.09, 0.16)))
    stage.mesh("Door", *shapes.box((0.25, -10.02, 0), (1.15, -9.98, 2.0)), surfaces.plain("Door", (0.05, 0.2, 0.12)))
    for k, color in enumerate(FLOWERS):
        bed = surfaces.plain(f"Flowers {k + 1}", color)
        for place in range(k, 12, 3):
            x = (-1) ** place * (1.35 + 0.33 * (place // 2))
            _round(stage, "Flower", (x, 2.3 + 0.2 * ((5 * place) % 7) / 7, 0.16), 0.16, bed)


def _round(stage, name, center, radius, material):
    vertices, faces = shapes.cube_sphere(16)
    stage.mesh(name, vertices * radius, faces, material, smooth=True, location=center)


def _fence():
    """Posts and two rails, behind the ball, with a gate where the path goes through."""
    sides = (-9.0, -PATH_HALF - 0.15), (PATH_HALF + 0.15, 9.0)
    pieces = [shapes.box((a, 6.02, z), (b, 6.06, z + 0.09)) for a, b in sides for z in (0.3, 0.75)]
    for a, b in sides:
        pieces += [shapes.box((x, 5.98, 0.05), (x + 0.12, 6.02, 1.1)) for x in np.arange(a, b - 0.11, 0.3)]
    return shapes.joined(*pieces)[:2]


def globe(name: str) -> bpy.types.Material:
    """A material of squares between circles of longitude and latitude, of 15 degrees, for an upright ball."""
    return surfaces.diffuse(name, _squares)


def _squares(nodes):
    place = nodes.add("ShaderNodeTexCoord").outputs["Normal"]
    x, y, z = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs
    angles = nodes.math("ARCTAN2", y, x), nodes.math("ARCSINE", z)
    cells = [nodes.math("FLOOR", nodes.math("DIVIDE", angle, math.radians(15))) for angle in angles]
    return nodes.mix(nodes.math("FLOORED_MODULO", nodes.math("ADD", *cells), 2.0), *GLOBE)


def _lawn(nodes):
    """Stripes as a mower leaves them, and a path of slabs along y that runs under the ball."""
    place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
    x, y, _ = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs
    stripe = nodes.math("FLOORED_MODULO", nodes.math("FLOOR", nodes.math("DIVIDE", y, STRIPE)), 2.0)
    grass = nodes.mix(stripe, LIGHT_LAWN, DARK_LAWN)
    # of which no joint runs under the middle of the ball
    slabs = surfaces.tiles(
        nodes, nodes.math("ADD", x, SLAB / 2), nodes.math("ADD", y, SLAB / 3), SLAB, PATH, PATH, JOINT, 0.03
    )
    on_path = nodes.math("LESS_THAN", nodes.math("ABSOLUTE", x), PATH_HALF)
    return nodes.mix(on_path, grass, slabs)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A flat lens in a frame on a table: a ball behind it, and before it a hoop, in which the image of the ball floats.

Of n = mu = -1 all rays of a point meet again (Veselago 1968): what stands less than the thickness behind the plate has an image
before it, at physics.flat_lens.image(), and that is where the hoop stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

from ..cycles.material import interface_material
from ..physics import Medium, flat_lens
from . import shapes, surfaces
from .parameters import Parameters, choice, number
from .sphere import ball
from .stage import Pose, Stage, staged

SIZE = (900, 675)  # pixels of its picture, where nothing else is asked for
# Lengths in metres. The plate's near face is in the plane y = 0, its far one at y = thickness; the table is at z = 0.
HALF, MIDDLE = (0.56, 0.32), 0.37  # half its width and height, and how high its middle is
BAR, SUNK = 0.04, 0.01  # of the frame: its width, and how deep the plate sits in it, so that no light gets to its sides
RADIUS, HOOP, WIRE = 0.12, 0.16, 0.008  # of the ball, of the hoop and of its wire
POLE, TOP, KNOB = 0.014, 0.9, 0.045  # of the pole that the ball is on: its radius, and what rises over the frame
TABLE, BOARD, SQUARE = ((-1.2, -0.8), (1.2, 1.6)), 0.06, 0.1  # corners (x, y), thickness, side of its squares
FLOOR, FAR = -0.75, 60.0
COLOURS = ((0.80, 0.05, 0.03), (0.85, 0.80, 0.70), (0.03, 0.16, 0.60), (0.90, 0.45, 0.02))  # of the ball's sectors
LIGHT, DARK, WOOD, BRASS = (0.72, 0.66, 0.54), (0.10, 0.17, 0.18), (0.05, 0.028, 0.016), (0.62, 0.40, 0.10)
STONE, RED, WHITE = (0.46, 0.40, 0.33), (0.62, 0.03, 0.02), (0.80, 0.78, 0.74)
HORIZON, ZENITH = (0.80, 0.86, 0.92), (0.22, 0.38, 0.62)
TOWARDS_SUN, SUN_IRRADIANCE = (-0.55, -0.45, 0.70), (3.2, 2.9, 2.4)

VIEWS = {
    "front": "From before the plate, through it at the ball",
    "side": "From its side and above: the ball, the plate, and where the image is",
}


@dataclass(frozen=True)
class LensParameters(Parameters):
    """Parameters of the lens scene."""

    n: float = number(
        -1.0, "refractive index of the plate, and its permeability: nearly nothing is reflected", -4.0, 4.0
    )
    thickness: float = number(0.3, "thickness of the plate", 0.125, 0.75, "m")
    distance: float = number(0.15, "how far behind the plate the middle of the ball is", 0.125, 3.0, "m")
    view: str = choice("front", "from before the plate, or from its side and above", VIEWS)

    def __post_init__(self):
        super().__post_init__()
        _ = self.medium  # refuses n = 0

    @property
    def medium(self) -> Medium:
        """The Medium of the plate, of impedance 1."""
        return Medium(self.n, self.n)

    @property
    def ball(self) -> tuple[float, float, float]:
        """The middle of the ball."""
        return 0.0, self.thickness + self.distance, MIDDLE

    @property
    def image(self) -> tuple[float, float, float]:
        """The middle of its image, by rays near the axis: before the plate where y < 0."""
        return 0.0, -float(flat_lens.image(self.n, self.thickness, self.distance)), MIDDLE


@staged(LensParameters)
def build(parameters: LensParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from LensParameters; returns the bpy.types.Scene. The camera looks along +y."""
    stage = Stage("lens", SIZE, backend)
    _table(stage)
    (x, z), d = np.add(HALF, SUNK), parameters.thickness
    low, high = (-x, 0.0, MIDDLE - z), (x, d, MIDDLE + z)
    material = interface_material("Lens", parameters.medium, backend=stage.backend)
    stage.mesh("Lens", *shapes.box(low, high), material)
    _frame(stage, d)
    _ball_on_a_pole(stage, parameters.ball)
    if parameters.image[1] < 0:
        _hoop(stage, parameters.image)
    glow = surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, 30.0)
    stage.world(surfaces.sky("Sky", HORIZON, ZENITH, strength=0.7, glow=glow))
    stage.camera(*pose(parameters))
    return stage.scene


def pose(parameters: LensParameters) -> Pose:
    """The Pose of the camera for LensParameters."""
    if parameters.view == "side":
        return Pose((1.75, -1.3, 1.35), (0.0, 0.1, 0.42), 40)
    return Pose((0.5, -2.4, 0.90), (0.03, 0.05, 0.45), 33)


def _frame(stage, thickness):
    """Four bars about the plate, a little deeper than it is thick."""
    (x, z), (wide, high) = HALF, np.add(HALF, BAR)
    edges = [(-wide, -high, wide, -z), (-wide, z, wide, high), (-wide, -z, -x, z), (x, -z, wide, z)]
    bars = [
        shapes.box((left, -SUNK, MIDDLE + bottom), (right, thickness + SUNK, MIDDLE + top))
        for left, bottom, right, top in edges
    ]
    vertices, faces, _ = shapes.joined(*bars)
    stage.mesh("Frame", vertices, faces, surfaces.plain("Wood", WOOD))


def _table(stage):
    low, high = TABLE
    vertices, faces = shapes.box((*low, -BOARD), (*high, 0.0))
    stage.mesh("Table", vertices, faces, surfaces.checker("Table", LIGHT, DARK, SQUARE))
    floor = shapes.rectangle((-FAR, -FAR), (FAR, FAR), FLOOR)
    stage.mesh("Floor", *floor, surfaces.plain("Stone", STONE))


def _ball_on_a_pole(stage, middle):
    x, y, _ = middle
    ball(stage, "Ball", middle, RADIUS, surfaces.diffuse("Ball", _sectors))
    pole = shapes.tube((x, y, 0.0), (x, y, TOP), POLE)
    stage.mesh("Pole", *pole, surfaces.spiral("Pole", WHITE, RED, 0.1))
    ball(stage, "Knob", (x, y, TOP), KNOB, surfaces.plain("Red", RED))


def _hoop(stage, middle):
    """A ring of wire on a rod and a foot."""
    turn = np.linspace(0, 2 * math.pi, 97)
    ring = np.array(middle) + HOOP * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=-1)
    x, y, z = middle
    rod, foot = shapes.tube((x, y, 0.0), (x, y, z - HOOP), 0.006, 24), shapes.tube((x, y, 0.0), (x, y, 0.008), 0.06)
    vertices, faces, _ = shapes.joined(shapes.sweep(ring, WIRE), rod, foot)
    stage.mesh("Hoop", vertices, faces, surfaces.plain("Brass", BRASS))


def _sectors(nodes):
    """A beach ball: eight sectors about its z axis, in turn of COLOURS, and a pale cap on top."""
    place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
    x, y, z = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs
    turn = nodes.math("MULTIPLY", nodes.math("ARCTAN2", y, x), 2 / math.pi)
    which = nodes.math("FLOORED_MODULO", nodes.math("FLOOR", nodes.math("MULTIPLY", turn, 2.0)), 4.0)
    colour = COLOURS[0]
    for index, other in enumerate(COLOURS[1:], 1):
        colour = nodes.mix(nodes.math("COMPARE", which, float(index), 0.5), colour, other)
    return nodes.mix(nodes.math("GREATER_THAN", z, 0.9 * RADIUS), colour, COLOURS[1])

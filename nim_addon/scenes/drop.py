# SPDX-License-Identifier: GPL-3.0-or-later
"""A drop in parallel light, before a wall that its light falls on: the globe of Theodoric and Descartes.

The light comes through a round hole in the wall, as wide as the drop. What the drop sends back draws the rainbow on the wall,
a ring about the hole. Where light of an index n lands, by how often it was reflected within, physics.deviation says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

from ..cycles.material import interface_material
from ..physics import Medium
from . import shapes, surfaces
from .parameters import Parameters, choice, liquid, number
from .sphere import ball
from .stage import Pose, Stage, staged

SIZE = (800, 800)  # pixels of its picture, where nothing else is asked for
# Metres: a large drop, and small enough that its water is as good as clear; a metre of it is blue.
RADIUS = 0.01
# Other lengths are in radii of the drop, which is in the origin; light travels along -y.
HOLE, HALF_WALL, SEGMENTS = 1.02, 9.0, 64
USUAL = 4.0  # distance of the wall
EYE, ASIDE, VIEW = (5.1, -14.4, 3.5), 0.0, 5.4  # with that; where it looks, beside the hole; half of what it sees there
FAR = 200.0  # of the camera that stands where the sun does: for it the sun's light is parallel, too
SEEN = 1.15  # half of what that camera sees
WALL, ROOM = (0.8, 0.8, 0.8), (0.012, 0.012, 0.012)
TOWARDS_SUN = (0.0, 1.0, 0.0)
SUN_IRRADIANCE = (400.0, 400.0, 400.0)  # of which a ten-thousandth or so gets to a place on the wall

VIEWS = {
    "wall": "From the room towards the wall, on which the bow is",
    "sun": "From where the sun is, through the hole in the wall, at the drop",
}


@dataclass(frozen=True)
class DropParameters(Parameters):
    """Parameters of the drop scene."""

    liquid: Medium | None = liquid(Medium.parse("water-daimon"), "what the drop is made of, or none")
    distance: float = number(USUAL, "how far the wall is from the drop, in its radii", 1.5, 100.0)
    view: str = choice("wall", "from the room towards the wall, or from the sun through the hole", VIEWS)

    sun_angle: float = number(0.53, "width of the sun; its light stays the same", 0.25, 30.0, "degrees")


@staged(DropParameters)
def build(parameters: DropParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from DropParameters; returns the bpy.types.Scene. The drop's radius is 1 cm."""
    stage = Stage("drop", SIZE, backend)
    stage.mesh(
        "Wall",
        *wall(RADIUS * HOLE, RADIUS * HALF_WALL * parameters.distance / USUAL),
        surfaces.diffuse("Wall", _white_before_black_behind),
        location=(0, RADIUS * parameters.distance, 0),
    )
    if parameters.liquid:
        ball(stage, "Drop", (0, 0, 0), RADIUS, interface_material("Drop", parameters.liquid, backend=stage.backend))
    sun = surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, parameters.sun_angle)
    stage.world(surfaces.sky("Room", ROOM, ROOM, glow=sun), aim=1024)
    stage.scene.view_settings.look = "AgX - Punchy"  # a bow is pale
    if parameters.view == "sun":  # whose own disk is what is seen then
        stage.scene.view_settings.exposure = -math.log2(max(sun.color))
    stage.camera(*pose(parameters))
    return stage.scene


def pose(parameters: DropParameters) -> Pose:
    """The Pose of the camera for DropParameters."""
    if parameters.view == "sun":
        return Pose((0, RADIUS * FAR, 0), (0, 0, 0), math.degrees(2 * math.atan(SEEN / FAR)))
    # what is to be seen grows with the distance of the wall
    scale = RADIUS * parameters.distance / USUAL
    (x, y, z), across = EYE, VIEW
    return Pose(
        (x * scale, y * scale, z * scale),
        (ASIDE * scale, RADIUS * parameters.distance, 0),
        math.degrees(2 * math.atan(across / (USUAL - y))),
    )


def _white_before_black_behind(nodes):
    """What the sun makes of the back of the wall would outshine all else."""
    return nodes.mix(nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"], WALL, (0.0, 0.0, 0.0))


def wall(hole: float, half: float) -> shapes.Shape:
    """Vertices and faces of a square in the plane y = 0, `half` its side, that faces -y, with a round hole in its middle."""
    turn = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    ring = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=-1)
    square = ring * (half / np.abs(ring).max(axis=1, keepdims=True))
    index = np.arange(SEGMENTS)
    ahead = np.roll(index, -1)
    faces = np.stack([index, ahead, ahead + SEGMENTS, index + SEGMENTS], axis=-1)
    return np.concatenate([hole * ring, square]), faces[:, ::-1].tolist()

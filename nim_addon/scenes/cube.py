# SPDX-License-Identifier: GPL-3.0-or-later
"""An opaque ball in a cube of glass, all under water (thesis figure 2.2). Made by figures only: it is not in SCENES."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from ..cycles.material import interface_material
from ..physics import MEDIA, Interface
from . import shapes, surfaces
from .parameters import Parameters, number
from .sphere import ball
from .stage import Pose, Stage, staged

SIZE = (640, 640)  # pixels of its picture, where nothing else is asked for
# Lengths in metres. The cube floats above the ground: what is seen through its bottom is then well apart from it.
HALF, LIFT = 1.0, 0.35
CENTER = (0.0, 0.0, LIFT + HALF)
# low, so that the mirror that the bottom can be shows it
BALL, BALL_RADIUS = (0.0, 0.0, LIFT + 0.5), 0.42
GROUND = 60.0
DISTANCE = 7.0

INTERFACE = Interface(MEDIA["glass"], MEDIA["water"])


@dataclass(frozen=True)
class CubeParameters(Parameters):
    """Parameters of the cube scene."""

    elevation: float = number(25.0, "how far the camera stands above the horizon", 1.0, 89.0, "degrees")
    turn: float = number(18.0, "how far it has walked around the cube, 0 in front of a face", -180.0, 180.0, "degrees")


@staged(CubeParameters)
def build(parameters: CubeParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from CubeParameters; returns the bpy.types.Scene. The water has no surface: it is everywhere."""
    stage = Stage("cube", SIZE, backend)
    ground = surfaces.checker("Ground", (0.60, 0.66, 0.60), (0.10, 0.17, 0.20), 0.5)
    stage.mesh("Ground", *shapes.rectangle((-GROUND, -GROUND), (GROUND, GROUND)), ground)
    glass = interface_material("Glass in water", INTERFACE.inside, INTERFACE.outside, backend=stage.backend)
    stage.mesh("Cube", *shapes.box((-HALF, -HALF, LIFT), (HALF, HALF, LIFT + 2 * HALF)), glass)
    ball(stage, "Ball", BALL, BALL_RADIUS, surfaces.plain("Ball", (0.80, 0.22, 0.03)))
    glow = surfaces.Glow((-0.45, -0.55, 0.70), (16.0, 15.0, 12.0), 12.0)
    stage.world(surfaces.sky("Sky", (0.25, 0.55, 0.62), (0.75, 0.95, 1.0), glow=glow), aim=256)
    stage.camera(*pose(parameters))
    return stage.scene


def pose(parameters: CubeParameters) -> Pose:
    """The Pose of the camera for CubeParameters."""
    up, turn = math.radians(parameters.elevation), math.radians(parameters.turn)
    away = (math.cos(up) * math.sin(turn), -math.cos(up) * math.cos(turn), math.sin(up))
    x, y, z = (middle + DISTANCE * part for middle, part in zip(CENTER, away, strict=True))
    return Pose((x, y, z), CENTER, 31)

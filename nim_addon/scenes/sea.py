# SPDX-License-Identifier: GPL-3.0-or-later
"""The open sea from below its surface: Snell's window, and darkness around it (thesis figure 2.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cycles.absorption import absorbs
from ..physics import Medium
from . import liquids, shapes, surfaces, waves
from .parameters import Parameters, choice, integer, liquid, number
from .stage import Pose, Stage, staged

SIZE = (960, 720)  # pixels of its picture, where nothing else is asked for
# In metres: how deep the eye and the ground are; the level at rest is z = 0.
DEPTH = 4.0
GROUND = 30.0
# The walls of the deep end this far above the level, above the crests that meet them.
RIM = 0.3
# The surface is this far from its middle to its sides, with fine steps near the window and ever wider ones beyond.
HALF, FINE, STEP = 60.0, 6.0, 0.125
WAVELENGTHS = (1.2, 6.0)
# How far the oblique view leans, in degrees; the window's far edge must stay in the picture.
TILT = 20.0

VIEWS = {"up": "Straight up, at the whole sky", "oblique": "Obliquely up, to the edge of the sky"}


@dataclass(frozen=True)
class SeaParameters(Parameters):
    """Parameters of the sea."""

    liquid: Medium | None = liquid(
        Medium(1.33), "what the sea is made of: none, water, nim, n=-1.33,mu=-10 or any medium"
    )
    view: str = choice("up", "where the eye under water looks: straight up, or obliquely", VIEWS)
    waves: float = number(0.1, "height of the waves, four times the standard deviation; 0 is calm", 0.0, 0.5, "m")
    seed: int = integer(1, "which waves: the same number gives the same surface", 0, 2**31 - 1)
    time: float = number(0.0, "how long the waves have moved on", 0.0, 3600.0, "s")


@staged(SeaParameters)
def build(parameters: SeaParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from SeaParameters; returns the bpy.types.Scene. Metres, z up, the eye below the middle."""
    stage = Stage("sea", SIZE, backend)
    corner = np.array([HALF, HALF])
    vertices, faces = shapes.box((*-corner, -GROUND), (*corner, RIM))
    faces = [face[::-1] for i, face in enumerate(faces) if i != 1]  # open above, seen from inside
    stage.mesh("Deep", vertices, faces, surfaces.plain("Deep", (0.010, 0.050, 0.085)))
    if parameters.liquid is not None:
        # what absorbs has sides, which are not to lie in the walls
        half = HALF + liquids.OVERLAP if absorbs(parameters.liquid) else HALF
        surface = liquid_surface(parameters.waves, parameters.seed, parameters.time, half)
        liquids.fill(stage, parameters.liquid, surface, bool(parameters.waves), -GROUND)
    # a veiled sun in a blue sky
    towards = np.array([0.45, 0.35, 0.82]) / math.hypot(0.45, 0.35, 0.82)
    glow = surfaces.Glow(towards.tolist(), (3.0, 2.8, 2.4), 14)
    stage.world(surfaces.sky("Sea sky", (0.55, 0.75, 1.00), (0.07, 0.22, 0.75), glow=glow))
    stage.camera(*pose(parameters))
    return stage.scene


def swell(x: ArrayLike, y: ArrayLike, height: float, seed: int, time: float = 0.0) -> tuple[NDArray, NDArray]:
    """Heights and unit normals of the surface at x and y: a sum of sines of random directions, lengths and phases.

    x, y: (...) metres; height: metres, four times the standard deviation; seed: int; time: seconds
    Returns (...) and (..., 3).
    """
    k, phase, omega, length = waves.random_waves(seed, WAVELENGTHS)
    # amplitude grows with the length: all waves are equally steep
    amplitude = height / 4 * length / math.sqrt(np.sum(np.square(length)) / 2)
    z = np.zeros(np.shape(x))
    normals = np.zeros((*np.shape(x), 3))
    normals[..., 2] = 1
    for a, kx, ky, start in zip(amplitude, *k, phase - omega * time, strict=True):
        argument = kx * x + ky * y + start
        z += a * np.sin(argument)
        normals[..., 0] -= a * kx * np.cos(argument)
        normals[..., 1] -= a * ky * np.cos(argument)
    return z, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def liquid_surface(
    height: float, seed: int, time: float = 0.0, half: float = HALF
) -> tuple[NDArray, shapes.Faces, NDArray]:
    """The surface as a mesh: vertices (N, 3) in metres, quads facing up, and the normals (N, 3) of swell() there.

    half: metres from its middle to its sides
    """
    if height:
        beyond = np.geomspace(FINE, HALF, 25)[1:]
        beyond[-1] = half
        line = np.concatenate([-beyond[::-1], np.linspace(-FINE, FINE, round(2 * FINE / STEP) + 1), beyond])
    else:
        line = np.array([-half, half])
    x, y = np.meshgrid(line, line, indexing="ij")
    index = np.arange(x.size).reshape(x.shape)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1)
    z, normals = swell(x, y, height, seed, time)
    return np.stack([x, y, z], -1).reshape(-1, 3), quads.reshape(-1, 4).tolist(), normals.reshape(-1, 3)


def pose(parameters: SeaParameters) -> Pose:
    """The Pose of the camera for SeaParameters."""
    eye = (0.0, 0.0, -DEPTH)
    # a little off the vertical, so that x points right in the picture
    if parameters.view == "up":
        return Pose(eye, (0.0, 0.003, 0.0), 112, "VERTICAL")
    return Pose(eye, (0.0, DEPTH * math.tan(math.radians(TILT)), 0.0), 146, "VERTICAL")

# SPDX-License-Identifier: GPL-3.0-or-later
"""A window in a garden, of lenslets or of a hyperbolic medium, and behind it a chess piece on a plinth.

After the windows of Courtial (2008): through one of eta < 0 the piece floats before the window, upright, and what is farther is
nearer; where it is seen, and how large, physics.lenslet says. Through a slab of physics.uniaxial it is seen twice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cycles.lenslets import lenslet_material
from ..cycles.slabs import slab_material
from ..physics.lenslet import LensletWindow
from ..physics.uniaxial import UniaxialSlab
from . import shapes, surfaces
from .parameters import Parameters, choice, number
from .stage import Pose, Stage, staged

SIZE = (900, 675)  # pixels of its picture, where nothing else is asked for
# Lengths in metres. The ground is z = 0; the window turns about the z axis, its middle in the plane y = 0.
EYE = 5.0  # from the eye to the window, which looks along +y
MIDDLE, HALF, BAR, DEEP = (
    1.05,
    (1.0, 0.85),
    0.09,
    0.05,
)  # height of the middle of the window; the frame's width, and half its depth
PLINTH, PIECE = 0.63, 0.84  # heights
SQUARE, FAR = 0.75, 60.0  # of the ground's board
IVORY, EBONY, WOOD = (0.80, 0.72, 0.55), (0.03, 0.022, 0.018), (0.16, 0.07, 0.03)
LIGHT, DARK, STONE, HEDGE = (0.66, 0.60, 0.48), (0.10, 0.16, 0.12), (0.42, 0.40, 0.37), (0.035, 0.10, 0.02)
HORIZON, ZENITH = (0.55, 0.72, 0.95), (0.10, 0.24, 0.60)
TOWARDS_SUN, SUN_IRRADIANCE = (-0.55, -0.60, 0.70), (3.2, 2.9, 2.4)
# of a queen, radius and height in its own: from its foot to its crown
QUEEN = (
    (0.0, 0.0), (0.215, 0.0), (0.215, 0.035), (0.19, 0.06), (0.2, 0.09), (0.135, 0.14), (0.1, 0.22), (0.075, 0.36),
    (0.065, 0.52), (0.07, 0.62), (0.13, 0.635), (0.13, 0.66), (0.075, 0.675), (0.075, 0.7), (0.11, 0.77), (0.14, 0.87),
    (0.115, 0.885), (0.075, 0.865), (0.03, 0.905), (0.025, 0.92), (0.05, 0.95), (0.035, 0.99), (0.0, 1.0),
)  # fmt: skip
BALUSTER = (
    (0.0, 0.0),
    (0.3, 0.0),
    (0.3, 0.1),
    (0.2, 0.14),
    (0.16, 0.5),
    (0.2, 0.86),
    (0.3, 0.9),
    (0.3, 1.0),
    (0.0, 1.0),
)

PANES = {
    "lenslets": "A window of lenslets, which refracts as the border of two media would",
    "slab": "A slab of a medium whose permittivity differs along its normal: what is behind is seen twice",
    "none": "Nothing: the piece as it is",
}


@dataclass(frozen=True)
class WindowParameters(Parameters):
    """Parameters of the window scene."""

    pane: str = choice(
        "lenslets",
        "what is in the frame: lenslets, a slab of a uniaxial medium, or nothing",
        PANES,
    )
    eta: float = number(
        -1.0, "of the lenslets, in the place of n2 / n1: tangents are divided by it; not 0", -10.0, 10.0
    )
    aperture: float | None = number(
        None, "width of a lenslet in its focal lengths, with what it loses; ideal if left out", 0.015625, 100.0
    )
    across: float = number(2.0, "permittivity of the slab within its plane; not 0", -100.0, 100.0)
    along: float = number(-3.0, "permittivity of the slab along its normal; not 0", -100.0, 100.0)
    thickness: float = number(0.5, "thickness of the slab", 0.0625, 1.0, "m")
    turn: float = number(0.0, "how far the window is turned about the vertical", -80.0, 80.0, "degrees")
    distance: float = number(1.5, "how far behind the middle of the window the piece stands", 1.0, 20.0, "m")
    aside: float = number(0.0, "how far the eye stands to the right", -5.0, 5.0, "m")

    def __post_init__(self):
        super().__post_init__()
        _ = self.lenslets, self.slab  # which refuse what is none

    @property
    def lenslets(self) -> LensletWindow:
        """The window of lenslets."""
        return LensletWindow(self.eta, aperture=self.aperture)

    @property
    def slab(self) -> UniaxialSlab:
        """The slab."""
        return UniaxialSlab(self.across, self.along, self.thickness)

    @property
    def piece(self) -> tuple[float, float, float]:
        """The middle of the piece."""
        return 0.0, self.distance, PLINTH + PIECE / 2


@staged(WindowParameters)
def build(parameters: WindowParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from WindowParameters; returns the bpy.types.Scene. The camera looks along +y."""
    stage = Stage("window", SIZE, backend)
    ground = shapes.rectangle((-FAR, -FAR), (FAR, FAR))
    stage.mesh("Ground", *ground, surfaces.checker("Ground", LIGHT, DARK, SQUARE))
    _hedge(stage, parameters)
    _queen(stage, parameters.distance)
    _window(stage, parameters)
    glow = surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, 30.0)
    stage.world(surfaces.sky("Sky", HORIZON, ZENITH, strength=0.7, glow=glow))
    stage.camera(*pose(parameters))
    return stage.scene


def pose(parameters: WindowParameters) -> Pose:
    """The Pose of the camera for WindowParameters: at the height of the middle of the window."""
    return Pose((parameters.aside, -EYE, MIDDLE), (0.0, 0.0, MIDDLE), 37)


def pane(parameters: WindowParameters) -> tuple[list[float], NDArray]:
    """The middle of the window's front (3,), and unit vectors (3, 3): its x axis, upwards, and its normal to the front."""
    turn = math.radians(parameters.turn)
    axes = np.array([(math.cos(turn), math.sin(turn), 0), (0, 0, 1), (math.sin(turn), -math.cos(turn), 0)])
    forward = parameters.thickness / 2 if parameters.pane == "slab" else 0.0
    return (np.array((0, 0, MIDDLE)) + forward * axes[2]).tolist(), axes


def _window(stage, parameters):
    """The pane, in an upright plane of its own space, and its frame, both turned."""
    depth = max(parameters.thickness / 2, DEEP) if parameters.pane == "slab" else DEEP
    x, z = HALF
    low, high = (-x, -z), (x, z)
    front, face = shapes.rectangle(low, high)
    made = []
    if parameters.pane == "lenslets":
        material = lenslet_material("Lenslets", parameters.lenslets, backend=stage.backend)
        made.append(stage.mesh("Window", front, face, material))
    elif parameters.pane == "slab":
        half = parameters.thickness / 2
        front, back = (shapes.rectangle(low, high, z)[0] for z in (half, -half))
        vertices, faces, _ = shapes.joined((front, face), (back, [face[0][::-1]]))
        made.append(
            stage.mesh("Window", vertices, faces, slab_material("Slab", parameters.slab, backend=stage.backend))
        )
    wide, tall = x + BAR, z + BAR
    bars = [(-wide, -tall, wide, -z), (-wide, z, wide, tall), (-wide, -z, -x, z), (x, -z, wide, z)]
    bars += [(side * 0.7 - BAR / 2, -MIDDLE, side * 0.7 + BAR / 2, -tall) for side in (-1, 1)]  # it stands on two
    boxes = [shapes.box((left, bottom, -depth), (right, top, depth)) for left, bottom, right, top in bars]
    made.append(stage.mesh("Frame", *shapes.joined(*boxes)[:2], surfaces.plain("Wood", WOOD)))
    for one in made:
        one.location = (0, 0, MIDDLE)
        one.rotation_euler = (math.pi / 2, 0, math.radians(parameters.turn))


def _queen(stage, y):
    """The piece, on a baluster of stone and a slab of ebony."""
    baluster = np.array(BALUSTER) * (1, PLINTH - 0.04)
    vertices, faces, _ = shapes.revolve(baluster, 64)
    top, sides = shapes.box((-0.3, -0.3, PLINTH - 0.04), (0.3, 0.3, PLINTH))
    stage.mesh("Plinth", vertices, faces, surfaces.plain("Stone", STONE), location=(0, y, 0))
    stage.mesh("Top", top, sides, surfaces.plain("Ebony", EBONY), location=(0, y, 0))
    vertices, faces, _ = shapes.revolve(_turned(QUEEN) * PIECE, 96)
    stage.mesh("Queen", vertices, faces, surfaces.plain("Ivory", IVORY), smooth=True, location=(0, y, PLINTH))


def _turned(profile: ArrayLike) -> NDArray:
    """A profile (N, 2) with its corners cut twice, as a lathe leaves them (Chaikin 1974)."""
    points = np.asarray(profile, float)
    for _ in range(2):
        a, b = points[:-1], points[1:]
        cut = np.stack([0.8 * a + 0.2 * b, 0.2 * a + 0.8 * b], axis=1).reshape(-1, 2)
        points = np.concatenate([points[:1], cut[1:-1], points[-1:]])
    return points


def _hedge(stage, parameters):
    """What is behind all: farther than the eye is from the window, so that lenslets of eta -1 show it upside down."""
    y = parameters.distance + 9.0
    stage.mesh("Hedge", *shapes.box((-FAR, y, 0), (FAR, y + 0.5, 0.8)), surfaces.plain("Leaves", HEDGE))

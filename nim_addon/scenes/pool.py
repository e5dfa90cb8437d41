# SPDX-License-Identifier: GPL-3.0-or-later
"""A tiled swimming pool, empty or full of a liquid with waves on it (thesis figures 5.3, 5.7, 5.9 and 5.10)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..physics import Medium
from . import liquids, shapes, surfaces, waves
from .parameters import Parameters, choice, integer, liquid, number
from .stage import Pose, Stage, staged

SIZE = (960, 640)  # pixels of its picture, where nothing else is asked for
# The basin, in metres: half its length and width, its floor, and the liquid's level at rest; the deck is at z = 0.
HALF = (4.0, 2.25)
FLOOR = -1.75
LEVEL = -0.15
TILE = 0.25
GRID = 0.05
WAVELENGTHS = (0.5, 2.5)

# From this direction, 51 degrees up, the sun gives this irradiance across its rays, whatever its width.
TOWARDS_SUN = np.array([0.5, -0.38, 0.78]) / math.hypot(0.5, -0.38, 0.78)
SUN_IRRADIANCE = np.array([9.0, 8.3, 7.2])

VIEWS = {
    "side": "Beside the pool, looking down into it",
    "top": "Above the pool, looking straight down",
    "window": "Under the surface, looking up and out",
}
SKIES = {
    "overcast": "A gray sky, which shines from everywhere: soft light, no sharp shadows",
    "sunny": "A blue sky with the sun, whose light through the surface draws patterns on the floor once caustics are baked",
}
BLUE, PALE, JOINT = (0.14, 0.40, 0.55), (0.22, 0.52, 0.64), (0.72, 0.74, 0.72)
NAVY, ORANGE = (0.012, 0.03, 0.12), (0.80, 0.27, 0.04)


@dataclass(frozen=True)
class PoolParameters(Parameters):
    """Parameters of the pool; `mu`, where given, is put into `liquid`, so that `liquid` is what fills the pool."""

    liquid: Medium | None = liquid(Medium(-1.33), "what fills the pool: none, water, nim, n=-1.33,mu=-10 or any medium")
    mu: float | None = number(None, "relative permeability of the liquid; the liquid's own if left out", -100.0, 100.0)
    view: str = choice("side", "where the eye is: beside the pool, above it, under water", VIEWS)
    sky: str = choice("overcast", "the light: a gray sky, or a blue one with the sun", SKIES)
    sun_angle: float = number(0.53, "width of the sun; its light stays the same", 0.25, 20.0, "degrees")
    waves: float = number(
        0.02, "height of the waves, lowest trough to highest crest at time 0; 0 is calm", 0.0, 0.25, "m"
    )
    seed: int = integer(1, "which waves: the same number gives the same surface", 0, 2**31 - 1)
    time: float = number(0.0, "how long the waves have moved on", 0.0, 3600.0, "s")

    def __post_init__(self):
        super().__post_init__()
        if self.mu is not None:
            if self.liquid is None:
                raise ValueError(f"mu = {self.mu:g} needs a liquid; an empty pool has none, so leave mu out.")
            object.__setattr__(self, "liquid", self.liquid.with_mu(self.mu))
        # where waves meet later, crests were seen to rise to 0.92 of the height at time 0, in 40 seeds over two minutes
        look = self.time and self.waves > -LEVEL and self.liquid is not None
        if look and liquid_surface(self.waves, self.seed, self.time)[0][:, 2].max() >= 0:
            raise ValueError(
                f"waves = {self.waves:g} m wash over the deck at time = {self.time:g} s; keep them at {-LEVEL:g} m or less."
            )


@staged(PoolParameters)
def build(parameters: PoolParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from PoolParameters; returns the bpy.types.Scene. Metres, z up, the pool's long side along x."""
    stage = Stage("pool", SIZE, backend)
    _basin(stage)
    _ground(stage)
    if parameters.liquid is not None:
        surface = liquid_surface(parameters.waves, parameters.seed, parameters.time)
        liquids.fill(stage, parameters.liquid, surface, bool(parameters.waves), FLOOR)
    _ladder(stage, (1.25, HALF[1]))
    _parasol(stage, (2.5, 3.1))
    _tree(stage, (-2.0, 4.2))
    if parameters.sky == "sunny":
        stage.world(sunny(parameters.sun_angle), aim=1024)
        stage.scene.view_settings.exposure = -0.6
    else:
        stage.world(surfaces.overcast("Overcast", (1.0, 1.02, 1.05)))
        stage.scene.view_settings.exposure = 0.6
    stage.camera(*pose(parameters))
    return stage.scene


def liquid_surface(height: float, seed: int, time: float = 0.0) -> tuple[NDArray, shapes.Faces, NDArray]:
    """The liquid's surface: a sum of sines of random directions, lengths and phases, over the basin and a little more.

    height: metres from the lowest vertex to the highest at time 0, when their mean is LEVEL; seed: int
    time:   seconds; each wave travels on, its amplitude stays, so that height and mean of the sum vary a little
    Returns vertices (N, 3) in metres, quads facing up, and the exact unit normals (N, 3) of the sines at the vertices.
    """
    edge = np.add(HALF, liquids.OVERLAP)
    vertices, faces = shapes.grid(-edge, edge, GRID if height else 2 * edge.max())
    normals = np.zeros_like(vertices)
    if height:
        k, phase, omega, length = waves.random_waves(seed, WAVELENGTHS)
        argument = vertices[:, :2] @ k + phase
        # amplitude grows with the length: all waves are equally steep
        first = np.sin(argument) @ length
        scale = height / np.ptp(first)
        argument -= omega * time
        vertices[:, 2] = scale * (np.sin(argument) @ length - first.mean())
        normals[:, :2] = -scale * (np.cos(argument) * length) @ k.T
    vertices[:, 2] += LEVEL
    normals[:, 2] = 1
    return vertices, faces, _unit(normals)


def sunny(width: float) -> bpy.types.World:
    """A World: a blue sky and the sun() of that width in it."""
    return surfaces.sky("Sunny", (0.48, 0.70, 1.00), (0.10, 0.28, 0.80), glow=sun(width))


def sun(width: float) -> surfaces.Glow:
    """The sun of the sunny sky, a Gaussian `width` degrees wide from 1/e to 1/e."""
    return surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, width)


def pose(parameters: PoolParameters) -> Pose:
    """The Pose of the camera for PoolParameters."""
    return {
        "side": Pose((-1.2, -7.4, 2.6), (-0.1, 0.0, 1.3), 66),
        # a little off the vertical, so that y points up in the picture
        "top": Pose((0, -0.01, 7.0), (0, 0, 0), 70),
        # The whole window is 97.5 degrees wide: it has to fit the lower side of the picture too. Leaning towards the
        # far side, the picture's bottom, leaves x pointing right.
        "window": Pose((0, 0.35, FLOOR + 0.3), (0, 0.40, 0), 108, "VERTICAL"),
    }[parameters.view]


def _xyz(nodes):
    place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
    xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place})
    return [xyz.outputs[axis] for axis in "XYZ"]


def _within(nodes, value, middle, half):
    return nodes.add("ShaderNodeMath", operation="COMPARE", inputs={0: value, 1: middle, 2: half}).outputs[0]


def _basin(stage):
    def tiled(nodes, u, v, *marks):
        low, high = BLUE, PALE
        for mark, color in marks:
            low, high = nodes.mix(mark, low, color), nodes.mix(mark, high, color)
        return surfaces.tiles(nodes, u, v, TILE, low, high, JOINT, 0.02)

    def floor(nodes):
        # a lane along the middle; only its right end has a bar, so that left and right can be told apart
        x, y, _ = _xyz(nodes)
        line = nodes.math("MULTIPLY", _within(nodes, x, 0.0, 3.0), _within(nodes, y, 0.0, TILE))
        bar = nodes.math("MULTIPLY", _within(nodes, x, 3.0, TILE), _within(nodes, y, 0.0, 3 * TILE))
        return tiled(nodes, x, y, (nodes.math("MAXIMUM", line, bar), NAVY))

    def walls(nodes):
        x, y, z = _xyz(nodes)
        # navy edges: the lowest row and the columns at the corners
        middle = nodes.math("MAXIMUM", _within(nodes, x, 0.0, HALF[0] - TILE), _within(nodes, y, 0.0, HALF[1] - TILE))
        edge = nodes.math("MAXIMUM", nodes.math("SUBTRACT", 1.0, middle), _within(nodes, z, FLOOR, TILE))
        # an orange band marks the wall below the eye of the side view, which only a NIM shows from there
        band = nodes.math("MULTIPLY", _within(nodes, y, -HALF[1], TILE / 2), _within(nodes, z, -0.75, TILE))
        # on a wall one of x and y is a whole number of tiles: their sum runs along it
        return tiled(nodes, nodes.math("ADD", x, y), z, (band, ORANGE), (edge, NAVY))

    vertices, faces = shapes.box((-HALF[0], -HALF[1], FLOOR), (*HALF, 0))
    faces = [face[::-1] for i, face in enumerate(faces) if i != 1]  # open above, seen from inside
    materials = [surfaces.diffuse("Floor", floor), surfaces.diffuse("Walls", walls)]
    stage.mesh("Basin", vertices, faces, materials, slots=[0, 1, 1, 1, 1])


def _ground(stage):
    def paving(nodes):
        x, y, _ = _xyz(nodes)
        return surfaces.tiles(nodes, x, y, 0.5, (0.42, 0.36, 0.29), (0.54, 0.47, 0.38), (0.25, 0.22, 0.19), 0.016)

    rim, deck, lawn = (tuple(np.add(HALF, width)) for width in (0.25, 2.25, 300))
    rings = [shapes.frame(HALF, rim), shapes.frame(rim, deck), shapes.frame(deck, lawn)]
    vertices, faces, slots = shapes.joined(*rings)
    materials = [
        surfaces.plain("Rim", (0.66, 0.64, 0.60)),
        surfaces.diffuse("Paving", paving),
        surfaces.plain("Lawn", (0.10, 0.20, 0.04)),
    ]
    stage.mesh("Ground", vertices, faces, materials, slots=slots)


def _ladder(stage, foot):
    x, y = foot
    # over the edge in a half circle, from the deck into the pool
    bend = shapes.arc((0.1, 0.65), 0.35, 0, 180, 16)
    outline = np.array([(0.45, -0.02), (0.45, 0.3), *bend, (-0.25, 0.2), (-0.25, -0.4), (-0.25, -1.2)])
    pieces = []
    for side in (-0.26, 0.26):
        points = np.column_stack([np.full(len(outline), x + side), y + outline[:, 0], outline[:, 1]])
        pieces.append(shapes.sweep(points, 0.026, 10))
    for height in (-0.3, -0.55, -0.8, -1.05):
        low = (x - 0.26, y - 0.29, height - 0.015)
        pieces.append(shapes.box(low, (x + 0.26, y - 0.21, height + 0.015)))
    vertices, faces, origin = shapes.joined(*pieces)
    white = surfaces.plain("Ladder", (0.75, 0.76, 0.78))
    rungs = origin > 1
    ladder = stage.mesh("Ladder", vertices, faces, white, smooth=True)
    ladder.data.polygons.foreach_set("use_smooth", ~rungs)


def _parasol(stage, foot):
    segments, panel, radius, top, fall = 8, 8, 1.5, 2.55, 0.55
    angle = 2 * np.pi * np.arange(segments * panel) / (segments * panel)
    # between two ribs the cloth is straight, and its hem hangs in a curve
    across = np.abs(np.sin(segments * angle / 2))
    reach = 1 - 0.05 * across
    rings = [(r * reach, top - fall * r**0.9) for r in (0.02, 0.25, 0.5, 0.75, 1.0)]
    rings.append((1.0 * reach, top - fall - 0.10 - 0.07 * across))
    vertices = np.concatenate(
        [
            np.column_stack([radius * r * np.cos(angle), radius * r * np.sin(angle), np.broadcast_to(z, angle.shape)])
            for r, z in rings
        ]
    )
    index = np.arange(len(vertices)).reshape(len(rings), -1)
    ahead = np.roll(index, -1, axis=1)
    faces = np.stack([index[1:], ahead[1:], ahead[:-1], index[:-1]], -1).reshape(-1, 4).tolist()
    red, white = surfaces.plain("Red cloth", (0.62, 0.03, 0.03)), surfaces.plain("White cloth", (0.78, 0.76, 0.72))
    slots = np.tile(np.arange(segments * panel) // panel % 2, len(rings) - 1)
    stage.mesh("Parasol", vertices, faces, [red, white], slots=slots, location=(*foot, 0))
    pole, base = shapes.tube((0, 0, 0), (0, 0, top + 0.08), 0.03, 12), shapes.tube((0, 0, 0), (0, 0, 0.09), 0.3, 24)
    vertices, faces, _ = shapes.joined(pole, base)
    stage.mesh("Parasol pole", vertices, faces, white, location=(*foot, 0))


def _tree(stage, foot):
    # the crown: spheres of leaves, centre and radius
    crown = np.array(
        [
            (0.0, 0.0, 3.65, 0.80),
            (0.7, 0.15, 3.1, 0.68),
            (-0.75, -0.1, 3.0, 0.72),
            (0.1, -0.62, 2.9, 0.62),
            (-0.1, 0.7, 2.95, 0.62),
            (0.48, -0.4, 3.7, 0.48),
            (-0.5, 0.25, 3.75, 0.50),
            (-1.2, 0.15, 2.5, 0.40),
        ]
    )
    trunk = [(0, 0, -0.05), (0.05, 0.02, 0.5), (-0.03, 0, 1.2), (0.02, 0, 2.0), (0, 0, 3.2)]
    wood = [shapes.sweep(trunk, [0.19, 0.13, 0.11, 0.10, 0.04])]
    for center in crown[1:, :3]:
        points = [(0, 0, 1.5), (0.5 * center[0], 0.5 * center[1], 2.0), center]
        wood.append(shapes.sweep(points, [0.07, 0.055, 0.02], 8))
    vertices, faces, _ = shapes.joined(*wood)
    bark = surfaces.plain("Bark", (0.12, 0.075, 0.045))
    stage.mesh("Trunk", vertices, faces, bark, smooth=True, location=(*foot, 0))
    # a dark ball within each sphere closes it
    ball, quads = shapes.cube_sphere(4)
    balls = shapes.joined(*((center[:3] + 0.8 * center[3] * ball, quads) for center in crown))[:2]
    leaves, blades, shade = _leaves(crown)
    vertices, faces, piece = shapes.joined(balls, (leaves, blades))
    slots = np.zeros(len(faces), int)
    slots[piece == 1] = 1 + shade
    greens = [(0.025, 0.06, 0.012), (0.06, 0.15, 0.02), (0.09, 0.20, 0.03), (0.14, 0.26, 0.05)]
    materials = [surfaces.plain(f"Leaf {i}", green) for i, green in enumerate(greens)]
    stage.mesh("Crown", vertices, faces, materials, slots=slots, location=(*foot, 0))


def _leaves(crown):
    """Diamonds strewn about spheres (x, y, z, radius), the same each time: vertices, faces, a shade 0 to 2 each."""
    rng = np.random.default_rng(5)
    around = np.repeat(crown, (650 * crown[:, 3] ** 2).astype(int), axis=0)
    out, tilt, twist = rng.normal(size=(3, len(around), 3))
    out = _unit(out)
    middle = around[:, :3] + around[:, 3:] * rng.uniform(0.8, 1.12, (len(around), 1)) * out
    facing = _unit(out + 0.6 * tilt)
    along = _unit(np.cross(facing, twist))
    size = rng.uniform(0.08, 0.135, (len(around), 1))
    across = 0.55 * np.cross(facing, along)
    vertices = np.stack([middle + size * way for way in (along, across, -along, -across)], axis=1).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 4).tolist(), rng.integers(0, 3, len(around))


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What an eye sees in the pool and what the sun does there, by Snell's law in numpy: still liquid, and liquid in waves."""

import math

import numpy as np

from ..physics import Interface, Medium
from ..scenes import pool
from .measure import Camera
from .sunlight import sun_directions


def window_radius(liquid: Medium) -> float:
    """The critical angle from the liquid to air, in degrees: the radius of Snell's window (thesis 2.9)."""
    return math.degrees(Interface(liquid).reversed().critical_angle())


def reflectance(liquid: Medium, camera: Camera, parts: int = 4) -> np.ndarray:
    """R (H, W) that an eye in the liquid sees in a level surface, the mean over parts x parts points of each pixel."""
    total = np.zeros(camera.size[::-1])
    for x in range(parts):
        for y in range(parts):
            _, look = camera.pixel_rays(((x + 0.5) / parts, (y + 0.5) / parts))
            total = total + Interface(liquid).reversed().fresnel(np.clip(look[..., 2], 0, 1)).R
    return total / parts**2


def mirrored_place(camera: Camera) -> np.ndarray:
    """The place in the basin, (H, W, 3), that an eye in the liquid sees mirrored in a level surface."""
    eye, look = camera.pixel_rays()
    start = eye + (pool.LEVEL - eye[2]) / look[..., 2:] * look
    return basin_met(start, look * (1, 1, -1))


def place_below(camera: Camera, liquid: Medium | None) -> np.ndarray:
    """The place in the basin, (H, W, 3), that an eye in the air sees through a level surface; NaN for the ground and dry
    walls. `liquid` is a Medium, or None for an empty pool."""
    eye, look = camera.pixel_rays()
    level = pool.LEVEL if liquid else 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = look[..., 2] < 0
        for z in (0.0, level):
            start = eye + (z - eye[2]) / look[..., 2:] * look
            seen &= np.all(np.abs(start[..., :2]) < pool.HALF, axis=-1)
        onward = Interface(liquid).refract(look, (0, 0, 1)) if liquid else look
        return np.where(seen[..., None], basin_met(start, onward), np.nan)


class Waves:
    """The liquid's surface of PoolParameters between its vertices: heights and unit normals at x and y (N)."""

    def __init__(self, parameters: pool.PoolParameters):
        vertices, _, normals = pool.liquid_surface(parameters.waves, parameters.seed)
        self.x, self.y = (np.unique(vertices[:, axis].round(9)) for axis in (0, 1))
        self.values = np.column_stack([vertices[:, 2], normals]).reshape(len(self.x), len(self.y), 4)

    def at(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Heights (N) and normals (N, 3), bilinear between the vertices."""
        i = np.clip((x - self.x[0]) / (self.x[1] - self.x[0]), 0, len(self.x) - 1.001)
        j = np.clip((y - self.y[0]) / (self.y[1] - self.y[0]), 0, len(self.y) - 1.001)
        u, v = (i % 1)[..., None], (j % 1)[..., None]
        i, j = i.astype(int), j.astype(int)
        here = (1 - u) * (1 - v) * self.values[i, j] + u * (1 - v) * self.values[i + 1, j]
        here = here + (1 - u) * v * self.values[i, j + 1] + u * v * self.values[i + 1, j + 1]
        return here[..., 0], here[..., 1:] / np.linalg.norm(here[..., 1:], axis=-1, keepdims=True)

    def mirrored_place(self, camera: Camera) -> np.ndarray:
        """As mirrored_place(), in waves."""
        eye, look = camera.pixel_rays()
        start = eye + (pool.LEVEL - eye[2]) / look[..., 2:] * look
        for _ in range(5):
            height, normal = self.at(start[..., 0], start[..., 1])
            start = eye + ((height - eye[2]) / look[..., 2])[..., None] * look
        onward = look - 2 * np.sum(look * normal, axis=-1, keepdims=True) * normal
        return np.where(onward[..., 2:] < 0, basin_met(start, onward), np.nan)


def floor_in_the_sun(
    parameters: pool.PoolParameters, reach: float, cells: int, side: int = 1400, seed: int = 0
) -> np.ndarray:
    """What the sun alone brings to the middle of the floor: irradiance (cells, cells), its red channel, rows from +y.

    Divided by n^2: Cycles leaves radiance as it is at an interface, where it grows by n^2 into the liquid. It is the same
    for all that an eye in the liquid sees, sky and floor.
    Light goes from the sun through side x side points of the waves to the floor, -reach to reach.
    """
    random = np.random.default_rng(seed)
    # of the length no more than can send light there
    edge = 0.999 * np.minimum(pool.HALF, reach + 1.5)
    count = side**2
    # one at random in each square of a grid: less noise than anywhere at random
    x, y = edge[:, None] * (2 * (np.indices((side, side)).reshape(2, -1) + random.random((2, count))) / side - 1)
    height, normal = Waves(parameters).at(x, y)
    light = -sun_directions(random, pool.TOWARDS_SUN, parameters.sun_angle, count)
    cosine = np.clip(-np.sum(light * normal, axis=1), 0, 1)
    interface = Interface(parameters.liquid)
    power = pool.SUN_IRRADIANCE[0] * cosine / normal[:, 2] * interface.fresnel(cosine).T
    end = basin_met(np.column_stack([x, y, height]), interface.refract(light, normal))
    landed = end[:, 2] < pool.FLOOR + 1e-9
    borders = np.linspace(-reach, reach, cells + 1)
    total, _, _ = np.histogram2d(-end[landed, 1], end[landed, 0], (borders, borders), weights=power[landed])
    return total * (4 * edge.prod() / count) / (2 * reach / cells) ** 2 / parameters.liquid.n**2


def basin_met(start: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Where rays (..., 3) that run downwards inside the basin meet its floor or walls, (..., 3)."""
    low, high = np.array([-pool.HALF[0], -pool.HALF[1], pool.FLOOR]), np.array([*pool.HALF, np.inf])
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.min((np.where(direction > 0, high, low) - start) / direction, axis=-1, keepdims=True)
    return start + distance * direction


def ball_in_window(camera: Camera, liquid: Medium, center: tuple, radius: float) -> np.ndarray:
    """Which pixels (H, W) show a ball in the air to an eye in the liquid, by rays through their middles."""
    eye, look = camera.pixel_rays()
    start = eye + (pool.LEVEL - eye[2]) / look[..., 2:] * look
    onward = Interface(liquid).refract(look, (0, 0, 1))
    away = np.array(center) - start
    along = np.sum(away * onward, axis=-1)
    with np.errstate(invalid="ignore"):
        return (along > 0) & (np.sum(away * away, axis=-1) - along**2 < radius**2)

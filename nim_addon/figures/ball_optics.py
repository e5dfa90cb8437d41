# SPDX-License-Identifier: GPL-3.0-or-later
"""What the figures of graded balls need of theory: what every pixel must show, by rays in double precision. No bpy."""

import numpy as np

from ..physics import graded
from ..physics.graded import Profile
from .measure import Camera

# The board that the ball stands on, in place of the garden, linear RGB: no joint runs under the middle of the ball.
LIGHT, DARK, TILE, JOINT, HALF = (0.78, 0.70, 0.56), (0.11, 0.09, 0.075), 0.8, (0.3, 0.2), 200.0


def sky(directions) -> np.ndarray:
    """The light (..., 3) of a sky that tells where a ray goes: (1 + d) / 2 along unit directions d (..., 3)."""
    return (1 + np.asarray(directions)) / 2


def directions_of(pixels) -> np.ndarray:
    """The unit directions (..., 3) that pixels (..., 3) of sky() tell of; NaN where they are black."""
    d = 2 * np.asarray(pixels, float) - 1
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return np.where(np.max(pixels, axis=-1, keepdims=True) > 0, d, np.nan)


def carried(profile: Profile, center, radius: float, eye, directions) -> tuple[np.ndarray, np.ndarray]:
    """Where rays from an eye (3,) along unit directions (N, 3) go on, and in which direction, (N, 3) each.

    NaN for what ends on the core; what misses the ball goes on as it came.
    """
    at = (np.asarray(eye, float) - center) / radius
    along = -directions @ at
    misses = (along < 0) | (at @ at - np.square(along) >= 1)
    points, onward = np.broadcast_to(np.asarray(eye, float), directions.shape).copy(), directions.copy()
    out = graded.carry(profile, at, directions[~misses])
    points[~misses], onward[~misses] = np.asarray(center) + radius * out.points, out.directions
    return points, onward


def predicted_board(profile: Profile, center, radius: float, camera: Camera, count: int, seed: int = 0) -> np.ndarray:
    """Pictures (count, H, W, 3) of the ball on the board, under the sky of sky(): one ray at random in every pixel each."""
    random = np.random.default_rng(seed)
    width, height = camera.size
    rows, columns = np.indices((height, width))
    pictures = []
    for _ in range(count):
        x, y = random.random((2, height, width))
        eye, directions = camera.rays(columns + x, rows + y)
        points, onward = carried(profile, center, radius, eye, directions.reshape(-1, 3))
        with np.errstate(divide="ignore", invalid="ignore"):
            landed = points - (points[:, 2:] / onward[:, 2:]) * onward
        lands = (onward[:, 2] < 0) & (np.abs(landed[:, :2] - JOINT) < HALF).all(axis=1)
        with np.errstate(invalid="ignore"):
            odd = np.floor((landed[:, :2] - JOINT) / TILE).sum(axis=1) % 2 != 0
        light = np.where(lands[:, None], np.where(odd[:, None], DARK, LIGHT), sky(onward))
        pictures.append(np.nan_to_num(light).reshape(height, width, 3))
    return np.stack(pictures)

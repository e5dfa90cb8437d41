# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a sun on a white ground: the directions that it comes from, and how much of it a picture shows."""

import math

import numpy as np

from .measure import blocks


def sun_directions(random: np.random.Generator, towards, width: float, count: int) -> np.ndarray:
    """Unit vectors (count, 3) towards random points of a Gaussian sun, `width` degrees wide from 1/e to 1/e.

    towards: unit vector (3,) towards the sun's middle, which is not overhead
    """
    # the sky about so narrow a sun counts as flat
    angle = np.radians(width / 2) * np.sqrt(-np.log(1 - random.random(count)))
    turn = random.uniform(0, 2 * np.pi, count)
    level = np.cross(towards, (0, 0, 1)) / np.linalg.norm(np.cross(towards, (0, 0, 1)))
    across = np.cos(turn)[:, None] * level + np.sin(turn)[:, None] * np.cross(level, towards)
    return np.cos(angle)[:, None] * towards + np.sin(angle)[:, None] * across


def irradiance(pixels: np.ndarray, cells: int) -> np.ndarray:
    """The irradiance (cells, cells) of a white ground that fills a square picture (H, W, C), its red channel."""
    return math.pi * blocks(pixels[..., :1], len(pixels) // cells)[:cells, :cells, 0]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a sun on a white ground: its directions, its colours, and how much of it a picture shows."""

import math

import numpy as np

from ..physics.colour import Wavelengths
from .measure import blocks


def sun_directions(random: np.random.Generator, towards, width: float, count: int, *, disk: bool = False) -> np.ndarray:
    """Unit vectors (count, 3) towards random points of a sun, a Gaussian `width` degrees wide from 1/e to 1/e, or a disk.

    towards: unit vector (3,) towards the sun's middle, which is not overhead
    """
    # the sky about so narrow a sun counts as flat
    share = random.random(count)
    angle = np.radians(width / 2) * np.sqrt(share if disk else -np.log(1 - share))
    turn = random.uniform(0, 2 * np.pi, count)
    level = np.cross(towards, (0, 0, 1)) / np.linalg.norm(np.cross(towards, (0, 0, 1)))
    across = np.cos(turn)[:, None] * level + np.sin(turn)[:, None] * np.cross(level, towards)
    return np.cos(angle)[:, None] * towards + np.sin(angle)[:, None] * across


def strata(random: np.random.Generator, count: int) -> list[tuple[float, np.ndarray]]:
    """Wavelengths that are white light together, nanometres, each with its weight (3,) in linear RGB, whose mean is 1.

    One from each of `count` equally likely parts of the spectrum.
    """
    wavelengths = Wavelengths.by_importance()
    u = (np.arange(count) + random.random(count)) / count
    weights = wavelengths.weight(u)
    return list(zip(wavelengths.wavelength(u).tolist(), weights / weights.mean(axis=0), strict=True))


def irradiance(pixels: np.ndarray, cells: int) -> np.ndarray:
    """The irradiance (cells, cells) of a white ground that fills a square picture (H, W, C), its red channel."""
    return math.pi * blocks(pixels[..., :1], len(pixels) // cells)[:cells, :cells, 0]

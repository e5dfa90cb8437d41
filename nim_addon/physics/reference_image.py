# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole picture by rays.trace: what each pixel must show where every surface and the sky shine by a known law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dispersion import REPRESENTATIVE_NM
from .rays import Fate, Surfaces, trace

Radiance = Callable[[NDArray, NDArray, NDArray], NDArray]


class Camera(Protocol):
    """What passes() looks through."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        ...

    def rays(self, columns: NDArray, rows: NDArray, /) -> tuple[ArrayLike, NDArray]:
        """The eye (3,), and the directions (..., 3) to places (...) in the picture, counted in pixels."""
        ...


def picture(
    surfaces: Surfaces,
    radiance: Radiance,
    eye: ArrayLike,
    directions: NDArray,
    *,
    bounces: int = 40,
    least: float = 1e-5,
    branches: bool = True,
    batch: int = 50_000,
    wavelength_nm: float = REPRESENTATIVE_NM,
) -> NDArray:
    """What an eye sees along some rays.

    surfaces:   as trace() takes them; what has no interface is opaque and shines
    radiance:   function of where rays end (N, 3), their unit directions (N, 3) and whether they land there or escape
                (N,) that returns the light (N, C) which comes from there
    eye:        (3,); directions: (N, 3), of any length but zero
    bounces, least, branches: as trace() takes them; what is not followed comes back as missing light
    batch:      how many rays are followed at once
    wavelength_nm: as trace() takes it
    Returns (N, C).
    """
    parts = []
    for start in range(0, len(directions), batch):
        rays = directions[start : start + batch]
        paths = trace(
            *(surfaces, eye, rays),
            bounces=bounces,
            least=least,
            branches=branches,
            most=10**9,
            wavelength_nm=wavelength_nm,
        )
        # what comes from infinitely far away through a medium that absorbs does not arrive
        gone = (paths.fate == Fate.ESCAPED) & (paths.arriving == paths.energy)
        ends = (paths.fate == Fate.LANDED) | gone
        light = radiance(paths.end[ends], paths.direction[ends], paths.fate[ends] == Fate.LANDED)
        share = paths.arriving[ends, None] * light
        ray = paths.ray[ends]
        parts.append(np.stack([np.bincount(ray, channel, len(rays)) for channel in share.T], axis=-1))
    return np.concatenate(parts)


def passes(
    surfaces: Surfaces, radiance: Radiance, camera: Camera, count: int, *, seed: int = 0, **limits: Any
) -> NDArray:
    """Pictures (count, H, W, C), each of one ray at a random place in every pixel: their scatter is the mean's error.

    limits: as picture() takes them
    """
    width, height = camera.size
    rows, columns = np.indices((height, width))
    random = np.random.default_rng(seed)
    pictures = []
    for _ in range(count):
        x, y = random.random((2, height, width))
        eye, directions = camera.rays(columns + x, rows + y)
        pictures.append(
            picture(surfaces, radiance, eye, directions.reshape(-1, 3), **limits).reshape(height, width, -1)
        )
    return np.stack(pictures)

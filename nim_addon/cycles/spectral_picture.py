# SPDX-License-Identifier: GPL-3.0-or-later
"""A spectral picture: renders that each have a part of the wavelengths, their mean, cleaned of noise, and as displayed.

A render draws one wavelength for each sample. Renders of a part of the wavelengths each, *strata*, draw them more evenly:
each takes a range of one sequence of samples, so that together they are the samples of the one render, and their mean is its
picture with less noise. Colours of the spectrum lie outside sRGB: what is linear keeps its negative values.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ..physics import colour
from . import denoising, settings, spectral
from .render import Drawing, Progress, layers_of, write_linear, write_shown

MOST_STRATA = 16  # more of them have hardly less noise
START = 1 << 17  # samples of a pixel each in the time that Cycles takes to start: each stratum costs it
WORTH = 4  # times that time a stratum's own samples should take


def usual_strata(samples: int, pixels: int) -> int:
    """How many strata suit so many samples of each of so many pixels, a power of two.

    As many as each has samples, at most, so that wavelengths and places in the pixel are spread alike; all have the same
    number of samples; and their starts do not cost more than they gain.
    """
    strata = 1
    while (
        (more := 2 * strata) <= MOST_STRATA
        and samples % more == 0
        and more * more <= samples
        and more * START * WORTH <= samples * pixels
    ):
        strata = more
    return strata


def drawing(strata: int) -> Drawing:
    """What renders a spectral scene as the mean of so many strata, which the scene's samples are a multiple of."""

    def draw(scene, linear, shown, progress):
        cleaned, kept = scene.cycles.use_denoising, scene.view_layers[0].cycles.denoising_store_passes
        with guided(scene, cleaned):
            layers = _merged(scene, strata, progress)
            noisy = layers["Combined"]
            clean = denoised(layers) if cleaned else noisy
        write_linear(linear, noisy if kept else clean)
        write_shown(scene, shown, colour.into_gamut(clean))

    return draw


def picture_of(scene: bpy.types.Scene, strata: int, progress: Progress | None = None) -> NDArray:
    """The linear picture (height, width, 3), the first row at the top, of a scene as drawing() renders it, with its noise."""
    return _merged(scene, strata, progress)["Combined"]


@contextlib.contextmanager
def guided(scene, cleaned):
    """Let Cycles keep its noise, with what guides the denoiser where one comes after."""
    cycles, layer = scene.cycles, scene.view_layers[0].cycles
    former = cycles.use_denoising, layer.denoising_store_passes
    cycles.use_denoising, layer.denoising_store_passes = False, cleaned
    try:
        yield
    finally:
        cycles.use_denoising, layer.denoising_store_passes = former


def _merged(scene, strata, progress):
    """The mean of the layers of all strata, in double precision; the scene is at the end as it was."""
    total: dict[str, NDArray] = {}
    with settings.samples_kept(scene), contextlib.ExitStack() as stack:
        if strata > 1:
            stack.callback(spectral.set_stratum, 0, 1)
        samples = scene.cycles.samples
        for index in range(strata):
            if strata > 1:
                spectral.set_stratum(index, strata)
                settings.sample_range(scene, index * (samples // strata), samples // strata, samples)
            for name, pixels in layers_of(scene, part_of(progress, index, strata)).items():
                total[name] = total.get(name, 0) + pixels / strata
    return total


def part_of(progress: Progress | None, index: int, parts: int) -> Progress | None:
    """What reports of render `index` of so many equal ones as of a part of one; None for None."""
    if progress is None:
        return None

    def report(done: int, total: int, left: float | None) -> None:
        if left is not None and index < parts - 1:  # the renders to come take as long as this one
            left = left + left / (1 - done / total) * (parts - index - 1) if done < total else None
        progress(index * total + done, parts * total, left)

    return report


# ------------------------------------------------------------------------------------------------ noise


def denoised(layers: Mapping[str, NDArray]) -> NDArray:
    """The picture (height, width, 3) of layers_of() a spectral scene without its noise, by OpenImageDenoise with its guides.

    That takes no negative values, which colours of the spectrum have in sRGB: it is cleaned between wider primaries.
    Raises as denoising.denoised() does.
    """
    to_wide = _to_wide()
    colours = {name: layers[name] @ to_wide.T for name in ("Combined", "Denoising Albedo") if name in layers}
    return denoising.denoised({**layers, **colours}) @ np.linalg.inv(to_wide).T


@functools.cache
def _to_wide() -> NDArray:
    """The matrix (3, 3) of linear sRGB to red, green and blue between which all colours of the spectrum lie, white to 1.

    They are those of ACES (SMPTE ST 2065-1), with the white of sRGB.
    """
    to_xyz = np.linalg.inv(colour.xyz_to_srgb(np.eye(3)).T)
    primaries = np.array([(x, y, 1 - x - y) for x, y in ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.077))]).T
    white = to_xyz.sum(axis=1)
    return np.linalg.solve(primaries * np.linalg.solve(primaries, white), to_xyz)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure D.3: the light of the real sun that figure C.1 has of one index, through spheres that disperse: in colours."""

import dataclasses
import math

import bpy
import numpy as np

from ..cycles import spectral
from ..scenes import sphere
from .caustics import CELLS, DOWN, REAL_SUN, ground_in_the_sun, shadow, white_ground
from .claims import Claim
from .measure import blocks, compare, misplaced
from .recipes import Figure, Image, Recipe
from .sunlight import strata

MEDIA = {
    "fused-silica": "fused silica",
    "diamond-peter": "diamond",
    "nim-mirror": "nim-mirror",
    "nim-causal": "nim-causal",
}
MEASURED = "fused-silica", "nim-causal"
COLOURS = "red", "green", "blue"
STRATA, RAYS = 24, 20_000  # of the wavelengths that theory takes, and rays of each


# changes to the scene


def white_ground_in_colours(scene: bpy.types.Scene) -> None:
    """The ground that figure C.1 measures, in all wavelengths."""
    white_ground(scene)
    spectral.set_up(scene)


# what theory says


def ground_in_colours(parameters: sphere.SphereParameters, seed: int) -> np.ndarray:
    """Irradiance (CELLS, CELLS, 3), linear RGB, of the ground under a sphere that disperses, rows from +y: by traced rays."""
    total = np.zeros((CELLS, CELLS, 3))
    for nm, weight in strata(np.random.default_rng(seed), STRATA):
        medium = parameters.medium.at(nm)
        at = dataclasses.replace(parameters, n=medium.n, mu=medium.mu)
        # the same rays for all, so that their noise has no colour
        share = ground_in_the_sun(at, seed, rays=RAYS) / sphere.SUN_IRRADIANCE[0]
        total += share[..., None] * weight * sphere.SUN_IRRADIANCE
    return total / STRATA


# the claims


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of the figure."""
    claims, dark = [], shadow()
    for name in MEASURED:
        image = images[f"ground_{name}"]
        wanted = np.stack([ground_in_colours(image.parameters, seed) for seed in range(4)])
        found = math.pi * blocks(image.each, image.each.shape[1] // CELLS)[:, :CELLS, :CELLS]
        for channel, colour in enumerate(COLOURS):

            def numbers(cells, channel=channel):
                one = cells[..., channel]
                inside = np.where(dark, one, 0)
                return one.mean(), inside.sum() / dark.sum(), (inside * np.arange(len(one))).sum() / inside.sum()

            texts = (
                f"{colour} light on the ground, mean",
                f"{colour} light within the shadow, mean",
                f"column about which the shadow's {colour} light lies",
            )
            for text, triple, unit in zip(
                texts, compare(numbers, (wanted,), (found,)), ("W/m2", "W/m2", "cells"), strict=True
            ):
                predicted, value, allowed = triple
                # as in figure C.1: the kernel spreads each photon a little, and the mesh is round to 1e-5
                claims.append(Claim(f"{MEDIA[name]}: {text}", predicted, value, allowed + 0.002 * abs(predicted), unit))
        text = f"{MEDIA[name]}: share of the light in other cells or colours than what numpy traces (predicted: noise alone)"
        claims.append(Claim(text, *misplaced(found, wanted), 0.005))
    return claims


FIGURES = (
    Figure(
        "D.3",
        "What spheres that disperse make of the real sun",
        "Figure C.1 in colours: spheres of fused silica and diamond above, of two negative-index media below, in a sun half a "
        "degree wide. nim-mirror, a glass with its sign turned, throws its light aside almost without colour; nim-causal, "
        "which disperses as little as causality allows without loss, sends each colour elsewhere.",
        (
            "The light on the ground is that of rays which numpy sends through the same sphere, each colour by its own index.",
            "Within the shadow there is as much light of each colour, and where, as those rays bring.",
        ),
        (
            *(
                Recipe(
                    f"sphere_{name}",
                    "sphere",
                    (f"n={name}", f"sun_angle={REAL_SUN:g}"),
                    draft=((400, 300), 32),
                    final=((800, 600), 64),
                    photons=(1 << 20, 1 << 22),
                    spectral=True,
                    caption=called,
                )
                for name, called in MEDIA.items()
            ),
            *(
                Recipe(
                    f"ground_{name}",
                    "sphere",
                    (f"n={name}", f"sun_angle={REAL_SUN:g}"),
                    draft=((128, 128), 64),
                    change=white_ground_in_colours,
                    photons=(1 << 20, 1 << 20),
                    pose=DOWN,
                    seeds=4,
                    shown=False,
                )
                for name in MEASURED
            ),
        ),
        measure,
        columns=2,
    ),
)

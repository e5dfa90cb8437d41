# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of our own: what a sphere (C.1) and a glass (C.2) do to the light of the real sun on the ground beneath them.

A path tracer does not find the sun through them; photons do. What lands on a white ground is measured against rays that
numpy sends through the same sphere, and, for the glass, against the path tracer in a sun wide enough to be found.
"""

import math

import bpy
import numpy as np

from ..caustics import lights
from ..physics import Interface
from ..physics.rays import Fate, Plane, Shapes, Sphere, trace
from ..scenes import glass, sphere, surfaces
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .measure import compare, misplaced
from .recipes import Figure, Image, Recipe
from .sunlight import irradiance, sun_directions

INDICES = (1.5, -1.5, -1.33, -1.025)
REAL_SUN = 0.53  # degrees
# The ground that is measured, about the sphere's shadow: its middle and half its side, in metres; cells a side.
MIDDLE, REACH, CELLS = (0.75, 0.48), 2.0, 16
HEIGHT = 30.0
DOWN = Pose(
    (*MIDDLE, HEIGHT), (MIDDLE[0], MIDDLE[1] + 1e-3, 0.0), 2 * math.degrees(math.atan(REACH / HEIGHT)), "VERTICAL"
)
RAYS = 60_000  # of each picture that numpy traces
# The table that is measured, beside the glass, away from the sun.
TABLE = Pose((0.06, -0.03, 2.0), (0.06, -0.03 + 1e-4, 0.0), 2 * math.degrees(math.atan(0.12 / 2.0)), "VERTICAL")


# changes to the scene


def white_ground(scene: bpy.types.Scene) -> None:
    """A white ground that light leaves once, under nothing but the sun, and no sphere to be seen before it."""
    _only_the_sun(scene, "Ground")
    probes.find(scene, "Sphere").visible_camera = False
    scene.cycles.max_bounces = 0


def white_table(scene: bpy.types.Scene) -> None:
    """The same of the table, for paths: what the glass mirrors or bends stays, what the table scattered twice does not."""
    _only_the_sun(scene, "Table")
    probes.find(scene, "Glass").visible_camera = False
    table = probes.find(scene, "Table")
    table.visible_diffuse = table.visible_glossy = table.visible_transmission = False
    scene.cycles.diffuse_bounces = 1


def traced_table(scene: bpy.types.Scene) -> None:
    """And for photons, with which the table shines by itself."""
    white_table(scene)
    scene.cycles.max_bounces = 0


def _only_the_sun(scene, name):
    probes.set_up(scene)
    probes.paint(probes.find(scene, name), surfaces.plain("White", (1, 1, 1)))
    sun = lights.sun_of(scene)
    width = math.degrees(sun.angle) / 2
    glow = tuple(np.negative(sun.direction)), tuple(np.divide(sun.irradiance, surfaces.gaussian(width))), width
    scene.world = surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=glow)
    scene.world.cycles.sampling_method = "MANUAL"
    scene.world.cycles.sample_map_resolution = 1024
    bpy.context.view_layer.update()


WAYS = {"found": (white_table, None), "traced": (traced_table, (1 << 19, 1 << 19))}


# what theory says


def ground_in_the_sun(
    parameters: sphere.SphereParameters, seed: int, reach: float = REACH, cells: int = CELLS, rays: int = RAYS
) -> np.ndarray:
    """Irradiance (cells, cells) of the ground under the sphere of SphereParameters, its red channel, rows from +y.

    Rays start where they are to pass a square about the measured ground or the sphere, each from another place of a
    Gaussian sun, and are followed in both branches.
    """
    random = np.random.default_rng(seed)
    sun = np.asarray(sphere.TOWARDS_SUN) / np.linalg.norm(sphere.TOWARDS_SUN)
    # through the plane z = 0, all that can meet the square or the sphere
    low, high = np.array(MIDDLE) - reach - 0.3, np.array(MIDDLE) + reach + 0.3
    side = math.isqrt(rays)
    place = np.indices((side, side)).reshape(2, -1) + random.random((2, side**2))
    aim = np.column_stack([*(low[:, None] + place / side * (high - low)[:, None]), np.zeros(side**2)])
    towards = sun_directions(random, sun, parameters.sun_angle, side**2)
    shapes = Shapes(Sphere(sphere.CENTER, sphere.RADIUS, Interface(parameters.medium)), Plane((0, 0, 0), (0, 0, 1)))
    paths = trace(shapes, aim + 10 * towards, -towards, bounces=30, least=1e-5, most=10**9)
    landed = paths.fate == Fate.LANDED
    power = sphere.SUN_IRRADIANCE[0] * towards[paths.ray[landed], 2] * paths.arriving[landed]
    end = paths.end[landed]
    borders = [np.linspace(middle - reach, middle + reach, cells + 1) for middle in MIDDLE]
    total, _, _ = np.histogram2d(end[:, 1], end[:, 0], borders[::-1], weights=power)
    return total[::-1] * np.prod(high - low) / side**2 / (2 * reach / cells) ** 2


def shadow(cells: int = CELLS) -> np.ndarray:
    """Which cells (cells, cells) lie wholly in the sphere's shadow, or what lights it: rows from +y."""
    sun = np.asarray(sphere.TOWARDS_SUN) / np.linalg.norm(sphere.TOWARDS_SUN)
    step = 2 * REACH / cells
    across = MIDDLE[0] - REACH + step * (np.arange(cells) + 0.5)
    along = MIDDLE[1] + REACH - step * (np.arange(cells) + 0.5)
    place = np.stack([*np.broadcast_arrays(across[None, :], along[:, None]), np.zeros((cells, cells))], axis=-1)
    away = np.asarray(sphere.CENTER) - place
    distance = np.linalg.norm(away - (away @ sun)[..., None] * sun, axis=-1)
    return distance < sphere.RADIUS - step


# the claims


def measure_sphere(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure C.1."""
    claims, dark = [], shadow()
    for n in INDICES:
        image = images[f"ground_{n:g}"]
        wanted = np.stack([ground_in_the_sun(image.parameters, seed) for seed in range(4)])
        found = np.stack([irradiance(pixels, CELLS) for pixels in image.each])
        of_all = wanted.mean(axis=0)

        def numbers(cells, of_all=of_all):
            inside = np.where(dark, cells, 0)
            columns = np.arange(len(cells))
            spread = np.polyfit(of_all.ravel(), cells.ravel(), 1)[0]
            return cells.mean(), inside.sum() / dark.sum(), (inside * columns).sum() / inside.sum(), spread

        texts = (
            "irradiance of the ground, mean",
            "irradiance within the shadow, mean",
            "column about which the shadow's light lies",
            "contrast in what numpy traces",
        )
        units = "W/m2", "W/m2", "cells", ""
        for text, numbers_of_it, unit in zip(texts, compare(numbers, (wanted,), (found,)), units, strict=True):
            predicted, value, allowed = numbers_of_it
            text = f"n = {n:g}: {text}"
            # the kernel spreads each photon a little, and the sphere's mesh is round to 1e-5
            claims.append(Claim(text, predicted, value, allowed + 0.002 * abs(predicted), unit))
        text = f"n = {n:g}: share of the light in other cells than what numpy traces (predicted: noise alone)"
        claims.append(Claim(text, *misplaced(found, wanted), 0.003))
    return claims


def measure_glass(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure C.2."""
    claims = []
    for key in LIQUIDS:
        found, traced = (
            np.stack([irradiance(pixels, CELLS) for pixels in images[f"{key}_{way}"].each]) for way in WAYS
        )
        of_all = found.mean(axis=0)

        def numbers(cells, of_all=of_all):
            return cells.mean(), np.polyfit(of_all.ravel(), cells.ravel(), 1)[0]

        for text, pair, unit in zip(
            ("irradiance of the table, mean", "contrast"),
            compare(numbers, (found,), (traced,)),
            ("W/m2", ""),
            strict=True,
        ):
            # a kernel spreads each photon a little, and the noise of what is fitted to flattens the slope
            blur = 0.0 if unit else 0.02
            claims.append(Claim(f"{LIQUIDS[key]}, photons for paths: {text}", *pair[:2], pair[2] + blur, unit))
    return claims


# the figures

LIQUIDS = {"none": "empty", "water": "water", "nim": "NIM"}
SUNNY = f"sun_angle={REAL_SUN:g}"

FIGURES = (
    Figure(
        "C.1",
        "What a sphere makes of the real sun",
        "The four spheres of figure 5.4 in a sun half a degree wide. Glass gathers its light into one bright spot. The NIM "
        "spheres send most of it sideways and back: what reaches their shadows is faint, and fades as n goes to -1.",
        (
            "The light on the ground is that of rays which numpy sends through the same sphere, cell by cell.",
            "Within the shadow there is as much light, and where, as those rays bring.",
        ),
        (
            *(
                Recipe(
                    f"sphere_{n:g}",
                    "sphere",
                    (f"n={n:g}", SUNNY),
                    draft=((400, 300), 32),
                    final=((1280, 960), 24),
                    photons=(1 << 20, 1 << 23),
                    caption=f"n = {n:g}",
                )
                for n in INDICES
            ),
            *(
                Recipe(
                    f"ground_{n:g}",
                    "sphere",
                    (f"n={n:g}", SUNNY),
                    draft=((128, 128), 16),
                    photons=(1 << 19, 1 << 19),
                    change=white_ground,
                    pose=DOWN,
                    seeds=4,
                    shown=False,
                )
                for n in INDICES
            ),
        ),
        measure_sphere,
        columns=2,
    ),
    Figure(
        "C.2",
        "What a glass makes of the real sun: empty, with water, with a NIM",
        "The glass of figure 5.1 in a sun half a degree wide, whose light crosses air, glass and liquid. Its walls draw "
        "fine lines on the table; water gathers light into a bright streak behind the glass, and a NIM sends it elsewhere. "
        "Here one renderer is measured against another: what is predicted is what Cycles' path tracer finds by chance, in "
        f"a sun of {glass.GlassParameters().sun_angle:g} degrees, without the straw.",
        ("In a sun wide enough for the path tracer, photons bring the same light to the table.",),
        (
            *(
                Recipe(
                    f"glass_{key}",
                    "glass",
                    (f"liquid={key}", SUNNY),
                    draft=((240, 240), 32),
                    final=((800, 800), 24),
                    photons=(1 << 20, 1 << 23),
                    caption=name,
                )
                for key, name in LIQUIDS.items()
            ),
            *(
                Recipe(
                    f"{key}_{way}",
                    "glass",
                    (f"liquid={key}", "straw=off"),
                    draft=((64, 64), 64),
                    photons=photons,
                    change=change,
                    pose=TABLE,
                    seeds=4,
                    shown=False,
                )
                for key in LIQUIDS
                for way, (change, photons) in WAYS.items()
            ),
        ),
        measure_glass,
    ),
)

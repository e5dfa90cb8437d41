# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure E.6: the caustic of a point source over a NIM (Shendeleva 2008), in a pool that a lamp hangs over.

What is measured of its shape is measured by a pinhole in the place of the lamp: each pixel is a ray, and a basin whose colour is
its place says where that ray lands. The caustic is where landings turn.
"""

import math

import bpy
import numpy as np

from ..physics import Interface, half_space
from ..scenes import pool, surfaces
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .measure import misplaced
from .pool import CODE, STRAIGHT_DOWN, basin_of_places
from .recipes import Figure, Image, Recipe

DEPTH = pool.LEVEL - pool.FLOOR
HEIGHT, POWER = 0.5, 60.0  # of the lamp, over the liquid, metres; watts
POINTS = ((1.5, 2.0), (1.5, 3.0), (2.0, 3.5), (0.8, 0.5), (0.8, 0.7))  # -n, and the depth in heights of the source
STRIP, HALF_VIEW = (512, 8), 48.0  # pixels of the pinhole's picture, and half of what it sees, degrees
UNDER_WATER = Pose((-2.2, -1.4, -0.45), (0.15, 0.1, pool.FLOOR + 0.2), 70)
RINGS = np.linspace(0, 1.4, 57)  # borders on the floor, about the lamp's foot, metres
LIQUIDS = {"water": "water", "nim": "NIM"}


# changes to the scene


def at_night(scene: bpy.types.Scene) -> None:
    """The pool in the light of a lamp that hangs over its middle."""
    _lamp(scene)
    scene.world = surfaces.sky("Night", (0.006, 0.010, 0.022), (0.002, 0.004, 0.012))
    scene.world.cycles.sampling_method = "NONE"
    scene.view_settings.exposure = 0.0


def white_floor(scene: bpy.types.Scene) -> None:
    """The liquid in a basin of black walls and a white floor that light leaves once, under nothing but that lamp."""
    probes.set_up(scene)
    probes.show_only(scene, "Liquid", "Basin")
    basin = probes.find(scene, "Basin")
    basin.data.materials[0] = surfaces.plain("White", (1, 1, 1))
    basin.data.materials[1] = probes.glow("Black")
    scene.cycles.diffuse_bounces = 0  # what the floor shines with is the first time that light leaves it
    _lamp(scene)
    probes.sky(scene)


def _lamp(scene):
    data = bpy.data.lights.new("Lamp", "POINT")
    data.energy, data.shadow_soft_size = POWER, 0.0
    probes.add(scene, "Lamp", data, (0, 0, pool.LEVEL + HEIGHT))


# what the picture says, and what theory does


def _pinhole(m, ratio):
    """The Pose of a pinhole so high over an index of -m that the floor is `ratio` heights deep."""
    return Pose((0, 0, pool.LEVEL + DEPTH / ratio), (0, 0.001, pool.FLOOR), 2 * HALF_VIEW, "HORIZONTAL")


def landings(image: Image) -> tuple[np.ndarray, np.ndarray]:
    """tan(theta) (N,), in order, of the rays of a picture by a pinhole, and where they land on the floor."""
    look = image.camera.pixel_rays()[1]
    way = look[..., :2] / -look[..., 2:]
    tangent = np.linalg.norm(way, axis=-1)
    x = np.sum(probes.decoded(image.pixels, 1 / CODE) * way, axis=-1) / tangent
    order = np.argsort(tangent, axis=None)
    tangent, x = tangent.ravel()[order], x.ravel()[order]
    return tangent[np.isfinite(x)], x[np.isfinite(x)]


def turning(tangent: np.ndarray, x: np.ndarray, towards: float) -> float:
    """The landing furthest to the side `towards`, 1 or -1, before landings turn: by a curve through those about it."""
    inner = tangent < 0.98 * tangent[-1]
    top = tangent[inner][np.argmax(towards * x[inner])]
    near = np.abs(tangent - top) < 0.12
    curve = np.polynomial.Polynomial.fit(tangent[near], towards * x[near], 4)
    return float(curve(np.linspace(top - 0.1, top + 0.1, 4001)).max())


def rings(pixels: np.ndarray, camera) -> np.ndarray:
    """The irradiance of RINGS on the white floor that a camera sees."""
    eye, look = camera.pixel_rays()
    place = eye + (pool.FLOOR - eye[2]) / look[..., 2:] * look
    which = np.digitize(np.hypot(place[..., 0], place[..., 1]), RINGS).ravel()
    count, light = (np.bincount(which, weights, len(RINGS) + 1)[1:-1] for weights in (None, pixels[..., 0].ravel()))
    return math.pi * light / count


def rings_of_theory(liquid) -> np.ndarray:
    """The same by the landings of rays, even in their direction; / n^2, which Cycles leaves out at an interface."""
    cosine = np.linspace(0, 1, 400_001)[1:]
    x = np.abs(half_space.landing(liquid.n, np.arccos(cosine), HEIGHT, DEPTH))
    # light that comes in far from the lamp does so along the pool alone
    radius = HEIGHT * np.sqrt(1 - cosine**2) / cosine
    beside = sum(2 / math.pi * np.arccos(np.minimum(half / np.maximum(radius, half), 1)) for half in pool.HALF)
    power = POWER / 2 / len(cosine) * Interface(liquid).fresnel(cosine).T * np.maximum(1 - beside, 0)
    light, _ = np.histogram(x, RINGS, weights=power)
    return light / (math.pi * np.diff(np.square(RINGS))) / liquid.n**2


# the claims


def point_claims(image: Image, m: float, ratio: float) -> list[Claim]:
    """The caustic's radius at a depth, and the depth of its cusp, of a picture by a pinhole; in heights of the source."""
    height = DEPTH / ratio
    tangent, x = landings(image)
    near = tangent < 0.3
    # near the axis x = (a - z / |n|) tan(theta), and further powers are odd
    powers = np.stack([tangent[near] ** power for power in (1, 3, 5)], axis=-1)
    cusp = DEPTH / (height - np.linalg.lstsq(powers, x[near], rcond=None)[0][0])
    found = turning(tangent, x / height, 1.0 if m < 1 else -1.0)
    return [
        Claim(
            f"n = {-m:g}: radius of the caustic at depth {ratio:g} a",
            half_space.caustic_at(-m, ratio),
            found,
            5e-4,
            "a",
        ),
        Claim(f"n = {-m:g}: depth of the cusp, seen from {1 / ratio:.3g} of the depth", m, cusp, 0.001, "a"),
    ]


def rim(light: np.ndarray, about: float) -> float:
    """The radius about a given one at which the light of RINGS falls most steeply."""
    middle = RINGS[1:-1]
    here = np.abs(middle - about) < about / 3
    return float(middle[here][np.argmin(np.diff(light)[here])])


def floor_claims(image: Image, name: str) -> list[Claim]:
    """The light on the floor, ring by ring."""
    liquid = image.parameters.liquid
    area, bands = np.diff(np.square(RINGS)), (-1, len(RINGS) // 4, 4)  # of four: a kernel spreads each photon a little
    found = np.stack([rings(pixels, image.camera) for pixels in image.each])
    wanted = rings_of_theory(liquid)
    text = f"{name}: share of the light in other rings of the floor than theory has it (predicted: noise alone)"
    in_bands = [(light * area).reshape(bands).sum(axis=-1) for light in (found, np.stack([wanted] * 2))]
    claims = [Claim(text, *misplaced(*in_bands), 0.002)]
    if liquid.is_nim:
        radius, width = half_space.caustic_at(liquid.n, DEPTH, HEIGHT), RINGS[1]
        claims.append(
            Claim(f"{name}: where the light of the disc ends", radius, rim(found.mean(axis=0), radius), width, "m")
        )
    return claims


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of the figure."""
    claims = [claim for m, ratio in POINTS for claim in point_claims(images[_name(m, ratio)], m, ratio)]
    return [*claims, *(claim for key, name in LIQUIDS.items() for claim in floor_claims(images[f"floor_{key}"], name))]


def _name(m, ratio):
    return f"landings_{m:g}_{ratio:g}"


# the figure

FIGURES = (
    Figure(
        "E.6",
        "A lamp over the pool: the caustic of a point source",
        "A lamp hangs half a metre over a pool, seen from under water. Water spreads its light. In a NIM each ray crosses back "
        "under the lamp, and neighbouring ones meet on a surface that begins in a cusp, |n| times as deep as the lamp is high, "
        "and opens downwards: the floor cuts it in a ring, where the disc of light is brightest but for its middle and ends; "
        "beyond there is a fiftieth of it.",
        (
            "The caustic's radius at five depths, of three indices, is what Snell's law has it, and so is the depth of its cusp.",
            "The lamp's light on the floor is that of theory, ring by ring, and that of the NIM ends at the caustic.",
        ),
        (
            *(
                Recipe(
                    f"night_{key}",
                    "pool",
                    (f"liquid={key}", "waves=0"),
                    draft=((360, 270), 32),
                    final=((640, 480), 128),
                    change=at_night,
                    pose=UNDER_WATER,
                    photons=(1 << 20, 1 << 22),
                    caption=name,
                )
                for key, name in LIQUIDS.items()
            ),
            *(
                Recipe(
                    _name(m, ratio),
                    "pool",
                    (f"liquid=n={-m:g},mu={-m:g}", "waves=0"),
                    draft=(STRIP, 16),
                    change=basin_of_places,
                    pose=_pinhole(m, ratio),
                    shown=False,
                )
                for m, ratio in POINTS
            ),
            *(
                Recipe(
                    f"floor_{key}",
                    "pool",
                    (f"liquid={key}", "waves=0"),
                    draft=((256, 256), 16),
                    change=white_floor,
                    pose=STRAIGHT_DOWN,
                    photons=(1 << 20, 1 << 20),
                    seeds=2,
                    shown=False,
                )
                for key in LIQUIDS
            ),
        ),
        measure,
    ),
)

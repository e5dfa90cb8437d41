# SPDX-License-Identifier: GPL-3.0-or-later
"""What bench/spectrum.py renders, as numbers for every program, and what must be seen of it. Nothing here needs Blender.

The world is grey, since programs differ in how they make a spectrum of a painted colour: all colour is dispersion's.

  ball   the reference sphere (tests/data/README.md); ground, balls and sky shine
  lit    the same; ground and balls are Lambertian, lit by the sky
  prism  a slit of white light, far away, seen through a prism with its edge upright: its spectrum on the camera's screen
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from nim_addon.physics import Interface, Medium
from nim_addon.physics.colour import Wavelengths, weights
from nim_addon.physics.interface import unit
from nim_addon.physics.rays import Plane, Shapes, Sphere
from nim_addon.physics.reference_image import picture

SCENES = ("ball", "lit", "prism")
MEDIA = ("n-bk7", "nim-mirror")
FIRST_NM, LAST_NM = 360, 830  # of the curves for peers: Mitsuba draws wavelengths from all of these
NEUTRAL_NM = 550.0
BOUNCES = 64

CHECKS, GROUND, HORIZON, ZENITH = (0.8, 0.2), 40, 0.9, 0.4  # the ground ends so far away, each way
SPHERE = ((0.0, 0.0, 1.0), 1.0)
OTHERS = (((0.5, 2.5, 0.6), 0.6, 0.25), ((-0.9, -2.2, 0.35), 0.35, 0.12))  # centre, radius, grey

# Degrees; the ray in the middle of the picture passes symmetrically at the neutral wavelength. At this distance only
# the slit's direction counts. Metres: the length of a face, and of the edge each way.
APEX, SLIT, VIEW = {"n-bk7": 60.0, "nim-mirror": 24.0}, 0.3, 3.0
FAR, SIDE, TALL = 1e5, 1.0, 2.0
STRATA = 128  # wavelengths of a truth by rays
# Steps by which the places within a pixel go on from one wavelength to the next: a Kronecker sequence of the plastic
# number, so that places and wavelengths are spread evenly together.
STEPS = np.array([0.7548776662466927, 0.5698402909980532])


def medium_of(name):
    """The Medium of that name, without loss: these bodies are metres thick, where even glass is dark, and peers let it be
    clear."""
    dispersion = Medium.parse(name).dispersion
    return Medium.dispersive(dataclasses.replace(dispersion, k=0.0, name=None))


class Camera(NamedTuple):
    """A square picture without distortion: eye and target in metres, the field of view in degrees, pixels an edge."""

    eye: tuple
    target: tuple
    fov: float
    pixels: int

    def rays(self, columns, rows):
        """Directions (..., 3) to places (...) in the picture, counted in pixels from its upper left corner."""
        forward = unit(np.subtract(self.target, self.eye))
        right = unit(np.cross(forward, (0, 0, 1)))
        up = np.cross(right, forward)
        half = math.tan(math.radians(self.fov / 2))
        x, y = (half * (2 * np.asarray(place) / self.pixels - 1)[..., None] for place in (columns, rows))
        return unit(forward + x * right - y * up)


class Prism(NamedTuple):
    """Its faces and black walls, and the slit: each vertices (N, 3) and triangles (M, 3). `normals` of the two faces
    point outwards; `towards` (3,) and `across` (3,) are the slit's direction and the one in which it is narrow."""

    faces: tuple
    walls: tuple
    slit: tuple
    normals: tuple
    towards: np.ndarray
    across: np.ndarray
    camera: Camera


def camera(scene, medium, pixels):
    """The Camera of a scene."""
    return prism(medium, pixels).camera if scene == "prism" else Camera((0, -6, 1.6), SPHERE[0], 40.0, pixels)


def prism(medium, pixels):
    """The Prism of a medium. Its first face lies in y = 0 around the origin, its edge is at +x."""
    n, apex = medium_of(medium).at(NEUTRAL_NM).n, math.radians(APEX[medium])
    incidence = math.asin(n * math.sin(apex / 2))  # negative for a negative index: from the edge's side of the normal
    leaving = apex - incidence
    into, towards = (np.array([math.sin(angle), math.cos(angle), 0]) for angle in (incidence, leaving))
    edge = np.array([SIDE / 2, 0, 0])
    back = edge + SIDE * np.array([-math.cos(apex), math.sin(apex), 0])
    corners = (-edge, edge, back)
    up = np.array([0, 0, TALL])
    ring = np.array([corner + side * up for corner in corners for side in (-1, 1)])
    faces = [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]]  # normals outwards
    walls = [[4, 0, 1], [4, 1, 5], [0, 4, 2], [1, 3, 5]]
    across = np.array([towards[1], -towards[0], 0])
    middle = (edge + back) / 2 + FAR * towards
    wide, high = FAR * math.tan(math.radians(SLIT / 2)) * across, FAR * math.tan(math.radians(5)) * up / TALL
    slit = np.array([middle + i * wide + j * high for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    normals = (np.array([0.0, -1, 0]), np.array([math.sin(apex), math.cos(apex), 0]))
    # the camera looks along the ray in the middle
    view = Camera(tuple(-2 * into), (0.0, 0.0, 0.0), VIEW, pixels)
    return Prism((ring, faces), (ring, walls), (slit, [[0, 1, 2], [0, 2, 3]]), normals, towards, across, view)


def job(options):
    """What the peers' programs need, for JSON. Lengths in metres, n every nanometre, cameras by "SCENE MEDIUM"."""
    nanometres = np.arange(FIRST_NM, LAST_NM + 1.0)
    prisms = {medium: prism(medium, options.size) for medium in MEDIA}
    return {
        "size": options.size,
        "samples": options.samples,
        "threads": options.threads,
        "backend": options.backend,
        "bounces": BOUNCES,
        "first_nm": FIRST_NM,
        "curves": {medium: medium_of(medium).spectrum(nanometres)[0].real.tolist() for medium in MEDIA},
        "checks": CHECKS,
        "ground": GROUND,
        "sky": (HORIZON, ZENITH),
        "sphere": SPHERE,
        "others": OTHERS,
        "prisms": {
            medium: {part: [np.asarray(a).tolist() for a in getattr(own, part)] for part in ("faces", "walls", "slit")}
            for medium, own in prisms.items()
        },
        "cameras": {
            f"{scene} {medium}": camera(scene, medium, options.size)._asdict() for scene in SCENES for medium in MEDIA
        },
    }


# ------------------------------------------------------------------------------------------------------- the truth


def truths(scene, medium, pixels):
    """What must be seen, twice (pixels, pixels, 3) in linear sRGB: of the prism by its closed form, of the ball by rays, with
    noise of their own; None of the lit scene."""
    if scene == "lit":
        return None
    return [spectrum(medium, pixels)] * 2 if scene == "prism" else [ball(medium, pixels, seed) for seed in (1, 2)]


def spectrum(medium, pixels, step=1.0):
    """The slit through the prism, of rays at four places across each pixel, each with its own wavelengths.

    step: between the wavelengths of a ray, nanometres
    """
    own = prism(medium, pixels)
    places, table = weights()
    rows, columns = np.indices((pixels, pixels))
    half = math.tan(math.radians(SLIT / 2))
    total = np.zeros((pixels, pixels, 3))
    rays = [own.camera.rays(columns + (k + 0.5) / 4, rows + 0.5) for k in range(4)]
    for start in np.arange(places[0], places[-1], step):
        for k, directions in enumerate(rays):
            nanometres = start + (k + 0.5) / 4 * step
            surface = Interface(medium_of(medium).at(nanometres))
            inside = surface.refract(directions, own.normals[0])
            share = surface.fresnel(-directions @ own.normals[0]).T
            outside = surface.refract(inside, own.normals[1])
            share = share * surface.reversed().fresnel(np.clip(inside @ own.normals[1], 0, 1)).T
            seen = np.abs(outside @ own.across) <= half * (outside @ own.towards)
            weight = np.array([np.interp(nanometres, places, channel) for channel in table.T])
            total += np.where(seen, share, 0)[..., None] * weight
    return total * step / (places[-1] - places[0]) / len(rays)


def ball(medium, pixels, seed):
    """The ball by a tree of rays in double precision, one in each pixel and stratum of wavelengths."""
    random, drawn = np.random.default_rng(seed), Wavelengths.by_importance()
    u = (np.arange(STRATA) + random.random(STRATA)) / STRATA
    share = drawn.weight(u)
    share /= share.sum(axis=0)  # white stays white
    view = camera("ball", medium, pixels)
    rows, columns = np.indices((pixels, pixels))
    total = np.zeros((pixels * pixels, 3))
    shift = random.random((2, pixels, pixels))
    for k, (nanometres, weight) in enumerate(zip(drawn.wavelength(u), share, strict=True)):
        surface = Interface(medium_of(medium).at(float(nanometres)))
        shapes = Shapes(
            Sphere(*SPHERE, surface), Plane((0, 0, 0), (0, 0, 1)), *(Sphere(center, r) for center, r, _ in OTHERS)
        )
        x, y = (shift + k * STEPS[:, None, None]) % 1
        directions = view.rays(columns + x, rows + y).reshape(-1, 3)
        total += picture(shapes, radiance, view.eye, directions, least=1e-3) * weight
    return total.reshape(pixels, pixels, 3)


def radiance(ends, directions, landed):
    """The light (N, 1) of where rays end (N, 3), along directions (N, 3), landed or not (N,)."""
    elevation = np.maximum(np.arcsin(np.clip(directions[:, 2], -1, 1)), 0) / (math.pi / 2)
    light = HORIZON + (ZENITH - HORIZON) * elevation
    odd = np.floor(ends[:, 0]) + np.floor(ends[:, 1])
    # the plane of rays.py has no end: beyond the ground they see the sky below the horizon
    on_ground = landed & (np.abs(ends[:, :2]) <= GROUND).all(axis=1)
    light = np.where(on_ground, np.where(odd % 2 == 0, *CHECKS), light)
    for center, radius, grey in OTHERS:
        light = np.where(landed & (np.abs(np.linalg.norm(ends - center, axis=1) - radius) < 1e-6), grey, light)
    return light[:, None]

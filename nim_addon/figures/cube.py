# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 2.2: a ball in a cube of glass under water. The bottom of the cube mirrors beyond the critical angle."""

import math

import bpy
import numpy as np

from ..scenes.cube import HALF, INTERFACE, LIFT
from . import probes
from .claims import Claim
from .measure import Camera
from .recipes import Figure, Image, Recipe

ELEVATIONS = (55, 40, 25, 10)


def bottom(scene: bpy.types.Scene) -> None:
    """Only the cube, over a ground that shines red, under a sky that shines green; its ball is gone."""
    probes.set_up(scene)
    probes.find(scene, "Ball").hide_render = True
    probes.paint(probes.find(scene, "Ground"), probes.glow("Ground", (1, 0, 0)))
    probes.sky(scene, lambda nodes, direction: (0, 1, 0))


def at_the_bottom(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What becomes of each pixel's ray that enters the cube by its front face and meets its bottom next, (H, W) each.

    Returns whether it does, its angle of incidence at the bottom in degrees, and the transmittance of the front face.
    """
    eye, directions = camera.pixel_rays()
    with np.errstate(invalid="ignore", divide="ignore"):
        entry = eye + ((-HALF - eye[1]) / directions[..., 1])[..., None] * directions
        within = INTERFACE.refract(directions, (0, -1, 0))
        foot = entry + ((LIFT - entry[..., 2]) / within[..., 2])[..., None] * within
    near = 0.97 * HALF  # a pixel on an edge sees more than one face
    enters = (np.abs(entry[..., 0]) < near) & (np.abs(entry[..., 2] - LIFT - HALF) < near)
    lands = (within[..., 2] < 0) & (np.abs(foot[..., 0]) < near) & (np.abs(foot[..., 1]) < near)
    angle = np.degrees(np.arccos(np.clip(-within[..., 2], 0, 1)))
    return enters & lands, angle, INTERFACE.fresnel(np.clip(directions[..., 1], 0, 1)).T


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 2.2."""
    image = images["bottom"]
    met, angle, front = at_the_bottom(image.camera)
    red = image.pixels[..., 0] - (1 - front)  # without the ground that the front face mirrors
    inner = INTERFACE.reversed()
    critical = math.degrees(inner.critical_angle())
    through = front * inner.fresnel(np.cos(np.radians(angle))).T
    shares = [_onset(angle[met], values[met]) for values in (through, red)]
    claims = [
        Claim("total reflection at the bottom sets in at the critical angle", critical, shares[1], 0.25, "degrees"),
        Claim("the same, where the curve of Fresnel's equations is read in the same way", *shares, 0.15, "degrees"),
    ]
    beyond = met & (angle > critical + 0.5)
    claims.append(Claim("light from the ground beyond that angle", 0, float(red[beyond].mean()), 0.002))
    for low, high in ((59, 60), (60, 61), (61, 62)):
        band = met & (angle > low) & (angle < high)
        values = float(through[band].mean()), float(red[band].mean())
        claims.append(Claim(f"light from the ground at {low} to {high} degrees", *values, 0.01))
    return claims


def _onset(angle, light):
    """The angle of incidence (degrees) up to which light comes through, read in bins of 0.1 degrees."""
    edges = np.arange(55, 70, 0.1)
    which = np.digitize(angle, edges)
    means = np.bincount(which, light, len(edges) + 1) / np.maximum(np.bincount(which, minlength=len(edges) + 1), 1)
    bright = np.flatnonzero(means[1:-1] > 0.1)
    return float(edges[bright[-1] + 1]) if len(bright) else math.nan


FIGURES = (
    Figure(
        "2.2",
        "A ball in a cube of glass, under water, from four heights",
        "From 55 and 40 degrees above the horizon (top) the ground is seen through the bottom of the cube; from 25 and 10 "
        "degrees (bottom) much of it, and then all, is a mirror, which shows the sky and the ball a second time.",
        (
            "Total reflection at the bottom sets in at the critical angle of glass in water, 62.46 degrees.",
            "Below that angle the light is refracted, as much as Fresnel's equations say.",
        ),
        (
            *(
                Recipe(
                    f"from_{elevation}",
                    "cube",
                    (f"elevation={elevation}",),
                    draft=((300, 300), 48),
                    final=((960, 960), 48),
                    caption=f"from {elevation} degrees above the horizon",
                )
                for elevation in ELEVATIONS
            ),
            Recipe(
                "bottom",
                "cube",
                ("elevation=26", "turn=0"),
                draft=((240, 240), 128),
                change=bottom,
                shown=False,
            ),
        ),
        measure,
        columns=2,
    ),
)

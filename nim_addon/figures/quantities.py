# SPDX-License-Identifier: GPL-3.0-or-later
"""What figures measure, one quantity by name: a number read off a picture, or off a probe of the same scene."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ..base.text import unknown
from ..cycles.images import image_of
from ..renders import changes
from ..renders.request import Request
from ..scenes import scene_type
from . import pool, sphere
from .measure import Camera, off_vertical, pixel_width, steepest
from .pool_optics import window_radius
from .recipes import Image


@dataclass(frozen=True)
class Quantity:
    """A number of a render.

    name:     as a person asks for it
    means:    what it is, with its unit, and on what it is read off
    read:     function(Image) -> float
    scene:    name of the scene that it is of; None: of any
    change, pose, settings, effort: of the probe, as figures.recipes.Recipe has them, the effort being size and samples; None:
              it is read off the picture itself
    """

    name: str
    means: str
    read: Callable[[Image], float]
    scene: str | None = None
    change: Callable | None = None
    pose: tuple | None = None
    settings: tuple[tuple[str, object], ...] = ()
    effort: tuple = ((160, 160), 64)

    def probe(self, request: Request) -> Request:
        """What is to be rendered for it beside a request: the request itself where it is read off the picture.

        Raises ValueError, one sentence, for a request of another scene than it is of.
        """
        if self.scene and request.scene != self.scene:
            raise ValueError(f"{self.name} is a quantity of the {self.scene}, not of {request.scene or request.name}.")
        if self.change is None:
            return request
        assert request.parameters is not None
        size, samples = self.effort
        return dataclasses.replace(
            request,
            parameters=dataclasses.replace(request.parameters, **dict(self.settings)),
            size=size,
            samples=samples,
            denoise=False,
            keep_noise=False,
            caustics="path",
            photons=None,
            spectral=False,
            spectral_passes=None,
            pose=self.pose,
            change=changes.name_of(self.change),
            code=changes.code_mark(changed=True),
        )

    def of(self, request: Request, exr: Path) -> float | None:
        """Its number for a request, of the EXR of its probe(); None where it has none."""
        import OpenImageIO as oiio

        pixels = image_of(exr).get_pixels(oiio.FLOAT)[..., :3].astype(float)
        probe = self.probe(request)
        if probe.parameters is None or probe.scene is None:
            camera = Camera((0, 0, 0), (0, 1, 0), 40, "AUTO", pixels.shape[1::-1])  # of a .blend it is not asked for
        else:
            pose = probe.pose or scene_type(probe.scene, of_figures=True).pose(probe.parameters)
            camera = Camera(*pose, pixels.shape[1::-1])
        number = float(self.read(Image(pixels[None], camera, probe.parameters)))
        return number if math.isfinite(number) else None


def _window(image):
    angle, radius = off_vertical(image.camera), window_radius(image.parameters.liquid)
    return steepest(image.pixels[..., 2], angle, pixel_width(image.camera, radius) / 2)


def _inner_radius(image):
    if image.parameters.medium.n >= 0:
        return math.nan  # which has no such region
    return sphere.radius_of_inner(image.pixels, sphere.impact_of(image.camera))


def _reflectance(image):
    angle = off_vertical(image.camera)
    return image.pixels[..., 2][angle < 10].mean()


_BASIN = {
    "scene": "pool",
    "change": pool.basin_of_places,
    "pose": pool.STRAIGHT_UP,
    "settings": (("view", "window"), ("waves", 0.0)),
    "effort": pool.UP,
}
_ALL = (
    Quantity("mean", "mean of all pixels and colours, linear", lambda image: image.pixels.mean()),
    Quantity("red", "mean of the red of all pixels, linear", lambda image: image.pixels[..., 0].mean()),
    Quantity("green", "the same of the green", lambda image: image.pixels[..., 1].mean()),
    Quantity("blue", "the same of the blue", lambda image: image.pixels[..., 2].mean()),
    Quantity("brightest", "largest of all pixels and colours, linear", lambda image: np.max(image.pixels)),
    Quantity("R", "reflectance of still liquid from below, up to 10 degrees off the vertical", _reflectance, **_BASIN),
    Quantity("window", "radius of Snell's window in still liquid, degrees", _window, **_BASIN),
    Quantity(
        "inner-radius",
        "radius of the inner region of a NIM sphere, in the sphere's",
        _inner_radius,
        scene="sphere",
        change=sphere.probe,
        pose=sphere.PROBE_POSE,
        effort=sphere.PROBE,
    ),
)
QUANTITIES = MappingProxyType({quantity.name: quantity for quantity in _ALL})


def quantity(name: str) -> Quantity:
    """The Quantity of a name; ValueError names those that exist, the nearest first."""
    if name not in QUANTITIES:
        raise ValueError(unknown("quantity", name, list(QUANTITIES)))
    return QUANTITIES[name]

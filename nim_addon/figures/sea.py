# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 2.4: Snell's window from the open sea, a circle seen straight up, an ellipse seen obliquely, ragged by waves."""

import math

import bpy
import numpy as np

from ..physics import Interface
from ..scenes import sea
from . import probes
from .claims import Claim
from .measure import Camera
from .pool_optics import window_radius
from .recipes import Figure, Image, Recipe

SECTORS = 24
# Less of the sky's light than this is no window: within a hundredth of a degree of its edge.
SEEN = 0.1


def white_sky(scene: bpy.types.Scene) -> None:
    """A sky that is 1 in blue over a black deep."""
    probes.set_up(scene)
    probes.paint(probes.find(scene, "Deep"), probes.glow("Black"))
    probes.sky(scene, lambda nodes, direction: probes.coded(nodes, direction, 0.5))


# ------------------------------------------------------------------------------------------------ what theory says


def axes(angle: float, tilt: float, scale: float) -> tuple[float, float]:
    """Half the axes, across the tilt and along it, of the ellipse that a cone makes in a picture.

    angle: of the cone from its axis; tilt: of the camera from that axis, both in degrees and together below 90
    scale: pixels that a unit at distance 1 covers
    """
    inside, lean = math.sin(math.radians(angle)) ** 2, math.cos(math.radians(tilt)) ** 2
    gap = lean - inside
    return scale * math.sqrt(inside / gap), scale * math.sqrt(inside * (1 - inside)) / gap


def window_in_waves(camera: Camera, parameters: sea.SeaParameters) -> np.ndarray:
    """What share of the sky's light each pixel's middle brings to an eye in the waves of SeaParameters, (H, W)."""
    eye, look = camera.pixel_rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        start = eye - eye[2] / look[..., 2:] * look
    # the window is nearer than that
    near = (look[..., 2] > 0) & np.all(np.abs(start[..., :2]) < sea.FINE, axis=-1)
    look, start = look[near], start[near]
    for _ in range(6):
        height, normal = sea.swell(start[:, 0], start[:, 1], parameters.waves, parameters.seed)
        start = eye + ((height - eye[2]) / look[:, 2])[:, None] * look
    cosine = np.clip(np.sum(look * normal, axis=-1), 0, 1)
    onward = Interface(parameters.liquid).refract(look, normal)
    with np.errstate(invalid="ignore"):
        T = np.where(onward[:, 2] > 0, Interface(parameters.liquid).reversed().fresnel(cosine).T, 0.0)
    shares = np.zeros(near.shape)
    shares[near] = T
    return shares


# ------------------------------------------------------------------------------------------------ what is read off


def radii(window: np.ndarray, camera: Camera) -> np.ndarray:
    """The angular radius of a window (H, W) of True in SECTORS directions from the vertical, in degrees.

    By the solid angle that its pixels cover: 2 pi (1 - cos(radius)), or as much of it as a sector has.
    """
    _, ahead = camera.rays(camera.size[0] / 2, camera.size[1] / 2)
    _, look = camera.pixel_rays()
    solid = np.where(window, (look @ ahead) ** 3 / camera.scale**2, 0.0)
    turn = np.arctan2(look[..., 1], look[..., 0]) / (2 * np.pi) + 0.5
    each = np.bincount((turn * SECTORS).astype(int).ravel() % SECTORS, solid.ravel(), SECTORS)
    return np.degrees(np.arccos(1 - each * SECTORS / (2 * np.pi)))


def half_axes(window: np.ndarray) -> tuple[float, float]:
    """Half the axes, horizontal and vertical, of the ellipse with the second moments of a window (H, W) of True."""
    rows, columns = np.nonzero(window)
    return 2 * columns.std(), 2 * rows.std()


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 2.4."""
    claims = []
    for view, name in (("up", "straight up"), ("oblique", "obliquely")):
        image = images[f"{view}_calm"]
        edge = window_radius(image.parameters.liquid)
        window = image.pixels[..., 2] > SEEN
        angular = float(np.mean(radii(window, image.camera)))
        claims.append(Claim(f"{name}, calm: angular radius of the window", edge, angular, 0.3, "degrees"))
        tilt = sea.TILT if view == "oblique" else 0.0
        expected = axes(edge, tilt, image.camera.scale)
        for word, *pair in zip(("across", "along"), expected, half_axes(window), strict=True):
            claims.append(Claim(f"{name}, calm: half the window's axis {word} the tilt", *pair, 0.5, "px"))
        ratios = expected[1] / expected[0], half_axes(window)[1] / half_axes(window)[0]
        claims.append(Claim(f"{name}, calm: the window's length over its width", *ratios, 0.02))
    image = images["up_waves"]
    expected, found = (
        radii(shares > SEEN, image.camera)
        for shares in (window_in_waves(image.camera, image.parameters), image.pixels[..., 2])
    )
    text = "straight up, in waves: how far the window's edge strays, standard deviation"
    claims.append(Claim(text, expected.std(), found.std(), 0.15 * expected.std(), "degrees"))
    text = "straight up, in waves: likeness of that edge to the one traced in the same waves"
    claims.append(Claim(text, 1.0, float(np.corrcoef(expected, found)[0, 1]), 0.03))
    return claims


def _shown(view, caption):
    settings = (f"view={view}",)
    return Recipe(view, "sea", settings, draft=((360, 270), 32), final=((1280, 960), 64), caption=caption)


def _measured(name, *settings):
    return Recipe(name, "sea", settings, draft=((320, 240), 16), change=white_sky, shown=False)


FIGURES = (
    Figure(
        "2.4",
        "Snell's window from the open sea, straight up and obliquely",
        "Four metres under the waves. The whole sky is pressed into a disc 97.5 degrees wide, and the deep, which sends up "
        "hardly any light, makes the rest dark. Seen straight up the window is round, obliquely it is stretched into an "
        "ellipse; the waves fray its edge.",
        (
            "Under calm water the window's angular radius is 48.75 degrees, within 0.3.",
            "It is a circle straight up, and obliquely the ellipse in which the picture cuts its cone.",
            "In waves its edge is ragged, as much and where rays traced in the same waves have it.",
        ),
        (
            _shown("up", "straight up"),
            _shown("oblique", f"{sea.TILT:g} degrees off the vertical"),
            _measured("up_calm", "view=up", "waves=0"),
            _measured("oblique_calm", "view=oblique", "waves=0"),
            _measured("up_waves", "view=up"),
        ),
        measure,
    ),
)

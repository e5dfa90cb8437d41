# SPDX-License-Identifier: GPL-3.0-or-later
"""What must be seen of the prism scene, by closed forms: where each wavelength goes, and what an eye sees through the prism."""

import math

import numpy as np

from ..caustics.density import ENOUGH
from ..physics import REPRESENTATIVE_NM, Interface, Medium
from ..physics.colour import weights
from ..physics.deviation import prism
from ..scenes import prism as scene_of
from ..scenes.prism import PrismParameters, outline, screen, way
from ..scenes.stage import Pose
from .measure import Camera

BACK = 0.2  # metres from the prism to a camera whose rays are followed back through it
RAYS = 20_000  # by which the light of a slit is predicted


def deviation(parameters: PrismParameters, wavelengths) -> np.ndarray:
    """The angles (...), degrees, by which light of wavelengths (...), nm, is turned that comes along the table."""
    return _turned(parameters, wavelengths, math.radians(parameters.incidence))


def deviation_back(parameters: PrismParameters, wavelengths) -> np.ndarray:
    """The same of light that goes the other way, against where green light leaves the prism."""
    return _turned(parameters, wavelengths, _leaving(parameters))


def _leaving(parameters):
    """The angle, radians, between green light that has left the prism and its second face's normal."""
    return math.radians(float(deviation(parameters, REPRESENTATIVE_NM)) + parameters.apex - parameters.incidence)


def _turned(parameters, wavelengths, incidence):
    n = parameters.medium.spectrum(wavelengths)[0].real
    return np.degrees(prism(n, math.radians(parameters.apex), incidence))


def passed_back(parameters: PrismParameters, wavelengths) -> np.ndarray:
    """The shares (...) of light that goes so, which the two faces of the prism let through."""
    return _passed(parameters, wavelengths, _leaving(parameters), deviation_back(parameters, wavelengths))


def _passed(parameters, wavelengths, first, turned):
    """Of light (...) that meets the first face at an angle, radians, and is turned by so many degrees in all."""
    second = np.radians(turned) + math.radians(parameters.apex) - first
    shares = []
    n, mu = (values.real for values in parameters.medium.spectrum(wavelengths))
    for index, permeability, angle in zip(np.ravel(n), np.ravel(mu), np.ravel(second), strict=True):
        face = Interface(Medium(float(index), float(permeability)))
        shares.append(float(face.fresnel(math.cos(first)).T * face.fresnel(math.cos(angle)).T))
    return np.reshape(shares, np.shape(second))


def looking_back(parameters: PrismParameters, wavelength: float) -> Pose:
    """The Pose of a camera that meets a wavelength's light head-on, behind the prism."""
    leaves = way(parameters, parameters.medium.at(wavelength).n)
    assert leaves is not None
    ahead = np.array([math.cos(leaves.angle), math.sin(leaves.angle)])
    eye, height = leaves.start + BACK * ahead, scene_of.HEIGHT / 2
    return Pose((*eye.tolist(), height), (*leaves.start.tolist(), height), 1.0)


def turned(camera: Camera, before: np.ndarray) -> np.ndarray:
    """By how many degrees (...) light was turned on its way to a camera of parallel rays, positive towards the base.

    before: (...), radians, the direction that it came in, from +x towards +y
    """
    ahead = np.subtract(camera.target, camera.eye)
    after = math.atan2(-ahead[1], -ahead[0])
    return np.degrees(np.remainder(before - after + math.pi, 2 * math.pi) - math.pi)


def on_the_screen(parameters: PrismParameters, wavelength: float, seed: int = 0) -> tuple[float, np.ndarray]:
    """Where on the screen a wavelength lands: its middle from the screen's, and rays (RAYS,) from that, sorted; metres."""
    random = np.random.default_rng(seed)
    board = screen(parameters)
    n = parameters.medium.at(wavelength).n if parameters.medium else 1.0
    # straight lines in both are as good as the ways of all rays: the slit and the sun are narrow
    step, turn = parameters.opening / 2, math.radians(parameters.sun_angle) / 2
    middle, aside, inclined = (way(parameters, n, *shift) for shift in ((0.0, 0.0), (step, 0.0), (0.0, turn)))
    assert middle and aside and inclined
    place = board.place(middle)
    across, of_sun = board.place(aside) - place, board.place(inclined) - place
    offsets = random.uniform(-1, 1, RAYS) * across
    # a Gaussian that has fallen to 1 / e at `turn`; the slit's own depth is nothing beside its width
    return place, np.sort(offsets + random.normal(0, math.sqrt(0.5), RAYS) * of_sun)


def landing(parameters: PrismParameters, wavelength: float, photons: int) -> float:
    """How many of so many photons that a sun sends at the prism land on the screen, for each metre of its height."""
    # the box about the prism is upright, and the sun sees it a little from above
    deep, wide = np.ptp(outline(parameters), axis=0)
    tall = scene_of.HEIGHT * math.cos(parameters.slope) + deep * math.sin(parameters.slope)
    upright = photons * math.cos(parameters.slope) / (wide * tall)  # of a square metre across x
    first = math.radians(parameters.incidence)
    passed = _passed(parameters, wavelength, first, deviation(parameters, wavelength))
    return float(upright * parameters.opening * passed)


def spread(places: np.ndarray, number: float) -> tuple[float, float]:
    """By how much, at least and at most, photons that land at places (N,), sorted, are spread, metres, a standard deviation.

    number: of them, for each metre of height. Half of them choose how the others are spread (caustics.density): over the
    least box that holds ENOUGH. The next one is at most 5 / 3 as wide.
    """
    low, high = np.zeros(len(places)), np.ones(len(places))  # sides of the boxes: what they hold grows with them
    for _ in range(40):
        side = (low + high) / 2
        within = np.searchsorted(places, places + side / 2) - np.searchsorted(places, places - side / 2)
        enough = number / 2 * side * within / len(places) >= ENOUGH
        low, high = np.where(enough, low, side), np.where(enough, side, high)
    least = math.sqrt(np.mean(np.square(high)) / 12)
    return least, least * 5 / 3


def through_the_prism(parameters: PrismParameters, camera: Camera, wavelengths: np.ndarray) -> np.ndarray:
    """The light (L, W) that each column of a camera's middle row sees of the glowing slit, by wavelengths (L,)."""
    columns = np.arange(camera.size[0] * 8) / 8 + 1 / 16
    eye, rays = camera.rays(columns, np.full_like(columns, camera.size[1] / 2))
    corners = outline(parameters)
    seen = []
    for wavelength in wavelengths:
        medium = parameters.medium.at(float(wavelength))
        light = _seen(corners, Interface(Medium(medium.n, medium.mu)), eye[:2], rays[:, :2], parameters.opening)
        seen.append(light.reshape(-1, 8).mean(axis=1))
    return np.array(seen)


def _seen(corners, interface, eye, rays, slit):
    """How much of the glow behind the slit comes back along rays (N, 2) from the eye through the prism: (N,)."""
    point, ray, light = np.broadcast_to(eye, rays.shape), rays / np.linalg.norm(rays, axis=1, keepdims=True), 1.0
    apex, right, left = corners
    for start, end, entering in ((apex, right, True), (left, apex, False)):
        face = (end - start) / np.linalg.norm(end - start)
        normal = np.array([-face[1], face[0]])  # out of the prism, as its corners run clockwise
        distance = ((start - point) @ normal) / (ray @ normal)
        point = point + distance[:, None] * ray
        along = (point - start) @ face
        hits = (distance > 0) & (along > 0) & (along < np.linalg.norm(end - start))
        facing = normal if entering else -normal
        side = interface if entering else interface.reversed()
        cosine = np.clip(-(ray @ facing), 0, 1)
        light = light * np.where(hits, side.fresnel(cosine).T, 0)
        sines = (ray + cosine[:, None] * facing) / (interface.inside.n if entering else 1 / interface.inside.n)
        ray = sines - np.sqrt(np.maximum(1 - np.sum(sines**2, axis=1), 0))[:, None] * facing
    for x in (scene_of.WALL, scene_of.WALL - scene_of.THICK):
        with np.errstate(divide="ignore", invalid="ignore"):
            y = point[:, 1] + (x - point[:, 0]) / ray[:, 0] * ray[:, 1]
        light = np.where((np.abs(y) < slit / 2) & (ray[:, 0] < 0), light, 0)
    return light * scene_of.GLOW


def in_colour(light: np.ndarray, wavelengths: np.ndarray) -> np.ndarray:
    """Linear sRGB (W, 3) of light (L, W) by wavelengths (L,) that are evenly spaced over the visible."""
    places, table = weights()
    w = np.stack([np.interp(wavelengths, places, column) for column in table.T], axis=-1)
    w /= w.mean(axis=0)
    return np.einsum("lw,lc->wc", light, w) / len(wavelengths)


def centroids(row: np.ndarray) -> np.ndarray:
    """The columns (3,) about which each channel of a row (W, 3) of a picture lies."""
    return (np.arange(len(row)) + 0.5) @ row / row.sum(axis=0)

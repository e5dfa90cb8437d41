# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures E.1 and E.7: a queen behind a window of lenslets, and behind a hyperbolic slab, through which she is seen twice."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..scenes import shapes, window
from ..scenes.window import MIDDLE, WindowParameters
from . import probes
from .claims import Claim
from .measure import Camera
from .recipes import Figure, Image, Recipe

ETAS = (-1.0, -1.2, 0.8)
RADIUS, SPOT, ROD = 0.3, 0.04, 0.008  # metres: of the disc, of the spot, of the rod that are measured
ASIDE = 0.4
APERTURE = 1.0
TURNS, THIN = (20, 40, 60, 75), 0.2  # of the slab that is measured: degrees, and its thickness
PREVIEW, FINAL = ((450, 338), 64), ((640, 480), 96)


# ------------------------------------------------------------------------------------------------ what is measured


def disc(scene: bpy.types.Scene) -> None:
    """Only the window, and in the place of the piece a disc, its upper half red and its lower one green, in the dark."""
    _instead(scene, RADIUS)


def spot(scene: bpy.types.Scene) -> None:
    """The same, small."""
    _instead(scene, SPOT)


def rod(scene: bpy.types.Scene) -> None:
    """Only the window, and in the middle of the piece an upright rod that shines, in the dark."""
    queen = probes.find(scene, "Queen")
    vertices, faces = shapes.tube((0, 0, -1), (0, 0, 1), ROD, 64)
    _shows(scene, queen, vertices, faces, probes.glow("White", (1, 1, 1)))


def _instead(scene, radius):
    turn = np.linspace(0, np.pi, 129)
    half = radius * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=-1)
    index = list(range(len(half)))
    vertices, faces, slots = shapes.joined((half, [index]), (half * (1, 1, -1), [index[::-1]]))
    queen = probes.find(scene, "Queen")
    _shows(scene, queen, vertices, faces, probes.glow("Red", (1, 0, 0)), probes.glow("Green", (0, 1, 0)))
    queen.data.polygons.foreach_set("material_index", slots.astype(np.int32))


def _shows(scene, queen, vertices, faces, *materials):
    probes.set_up(scene)
    probes.show_only(scene, "Window", "Queen")
    probes.sky(scene)
    mesh = bpy.data.meshes.new("Probe")
    lifted = np.asarray(vertices) + np.array((0, 0, MIDDLE - queen.location.z))
    mesh.from_pydata(lifted.tolist(), [], faces)
    for material in materials:
        mesh.materials.append(material)
    queen.data = mesh


# ------------------------------------------------------------------------------------------------ lenslets


def measure_lenslets(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure E.1."""
    claims = []
    for eta in ETAS:
        image = images[f"disc_{eta:g}"]
        law, depth = image.parameters.lenslets, image.parameters.distance
        bare = RADIUS * image.camera.scale / (window.EYE + depth)  # pixels
        light = image.pixels[..., :2].sum(axis=-1)
        size = math.sqrt(light.sum() / math.pi) / bare
        expected = float(law.apparent_size(window.EYE, depth))
        claims.append(Claim(f"size through eta = {eta:g}, of that without a window", expected, size, 0.001))
        # the middles of the halves of a disc are 8 / 3 pi of its radius apart
        apart = _row(image.pixels[..., 1]) - _row(image.pixels[..., 0])
        text = f"upright: the red half over the green one through eta = {eta:g}"
        claims.append(Claim(text, 8 / (3 * math.pi) * expected * bare, apart, 0.1, "pixels"))
        found = _depth(images[f"spot_{eta:g}"])
        text = f"depth of the image behind the window of eta = {eta:g}, from {ASIDE:g} m aside"
        claims.append(Claim(text, float(law.image_depth(depth)), found, 0.005, "m"))
    image = images["losses"]
    law, camera = image.parameters.lenslets, image.camera
    size = float(law.apparent_size(window.EYE, image.parameters.distance)) * RADIUS
    from_middle = np.hypot(*np.moveaxis(_places(camera) - np.divide(camera.size, 2), -1, 0))
    inner = from_middle < 0.9 * size * camera.scale / (window.EYE + image.parameters.distance)
    _, axes = window.pane(image.parameters)
    share = law.transmittance(camera.pixel_rays()[1], axes[2], axes[0])
    pair = float(share[inner].mean()), float(image.pixels[..., :2].sum(axis=-1)[inner].mean())
    text = f"light through lenslets of eta = {ETAS[1]:g} and a width of {APERTURE:g} f1"
    return [*claims, Claim(text, *pair, 0.002)]


def _row(weights):
    rows = np.arange(len(weights)) + 0.5
    return float((weights.sum(axis=1) * rows).sum() / weights.sum())


def _depth(image):
    """How far behind the window a point of the plane x = 0 is, as it is seen from aside."""
    light = image.pixels[..., :2].sum(axis=-1)
    column = float((light.sum(axis=0) * (np.arange(light.shape[1]) + 0.5)).sum() / light.sum())
    eye, direction = image.camera.rays(np.array(column), np.array(image.camera.size[1] / 2))
    return float(eye[1] - eye[0] * direction[1] / direction[0])


def _places(camera):
    return np.stack(np.meshgrid(*(np.arange(side) + 0.5 for side in camera.size)), axis=-1)


# ------------------------------------------------------------------------------------------------ the slab


def measure_slab(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure E.7."""
    claims, slopes, shares = [], [], []
    for turn in TURNS:
        image = images[f"rod_{turn}"]
        light = image.pixels[..., 0].mean(axis=0)
        seen = [seen(image.camera, image.parameters, way) for way in (0, 1)]
        # the light of each ends half way to the other
        border = sum(seen) / 2
        for name, place in zip("sp", seen, strict=True):
            own = np.sign(np.arange(len(light)) + 0.5 - border) == np.sign(place - border)
            column = float((light * own * (np.arange(len(light)) + 0.5)).sum() / (light * own).sum())
            aside = [_at_the_rod(image.camera, image.parameters, x) for x in (place, column)]
            text = f"the image of {name}, aside of the rod, through a slab turned by {turn} degrees"
            claims.append(Claim(text, *aside, 0.5, "mm"))
            if name == "p":
                theta, slope = _within(image.camera, image.parameters, column)
                expected = float(image.parameters.slab.slopes(theta).p)
                slopes.append(Claim(f"slope of p within at {math.degrees(theta):.0f} degrees", expected, slope, 0.01))
            if turn == TURNS[2]:
                theta = _within(image.camera, image.parameters, place)[0]
                whole = images["bare"].pixels[..., 0].mean(axis=0).sum()
                T = getattr(image.parameters.slab.transmittances(theta), name)
                # the rod looks wider through the slab, as it looks nearer
                edges = [seen(image.camera, image.parameters, "sp".index(name), side * ROD) for side in (-1, 1)]
                wider = (
                    (edges[1] - edges[0]) / (2 * ROD * image.camera.scale) * (window.EYE + image.parameters.distance)
                )
                share = float((light * own).sum() / whole / wider)
                text = f"light of the image of {name} at {math.degrees(theta):.0f} degrees"
                shares.append(Claim(text, T / 2, share, 0.01))
    return claims + slopes + shares


def _through(parameters: WindowParameters, directions: np.ndarray, eye: np.ndarray, aside: float = 0.0):
    """Of horizontal rays from the eye, in metres from the middle of the slab's front along its x axis and behind it:
    where they enter, (N,); their tangents there, (N,); and what is so far aside of the middle of the rod, (2,)."""
    middle, axes = window.pane(parameters)
    across, inwards = directions @ axes[0], -directions @ axes[2]
    tangents = across / inwards
    start = eye - middle
    entries = start @ axes[0] + (start @ axes[2]) * tangents
    x, y, z = parameters.piece
    away = np.array((x + aside, y, z)) - middle
    return entries, tangents, np.array([away @ axes[0], -(away @ axes[2])])


def _rays(camera, columns):
    eye, directions = camera.rays(np.asarray(columns, float), np.array(camera.size[1] / 2))
    return directions.reshape(-1, 3), eye


def seen(camera: Camera, parameters: WindowParameters, way: int, aside: float = 0.0) -> float:
    """The column where the rod, or what is so far aside of it, is seen through the slab, by s (way 0) or by p (1)."""
    columns = np.linspace(0, camera.size[0], 4001)
    directions, eye = _rays(camera, columns)
    entries, tangents, (x, depth) = _through(parameters, directions, eye, aside)
    slopes = np.sign(tangents) * parameters.slab.slopes(np.arctan(np.abs(tangents)))[way]
    beyond = entries + parameters.thickness * slopes + (depth - parameters.thickness) * tangents
    return float(np.interp(x, *(np.array(pair)[np.argsort(beyond)] for pair in (beyond, columns))))


def _at_the_rod(camera, parameters, column):
    """How far aside of the rod a column is, mm, in the rod's plane across the camera's view."""
    (direction,), eye = _rays(camera, [column])
    return 1000 * float(eye[0] + (parameters.distance - eye[1]) * direction[0] / direction[1])


def _within(camera, parameters, column):
    """The angle of incidence of the ray of a column in which the rod is seen, and its slope within the slab."""
    directions, eye = _rays(camera, [column])
    entries, tangents, (x, depth) = _through(parameters, directions, eye)
    leaves = x - (depth - parameters.thickness) * tangents
    slope = (leaves - entries) / parameters.thickness * np.sign(tangents)
    return float(np.arctan(np.abs(tangents))[0]), float(slope[0])


def _measured(name, change, settings, size=(240, 240), samples=64):
    return Recipe(name, "window", settings, draft=(size, samples), change=change, shown=False)


FIGURES = (
    Figure(
        "E.1",
        "A queen behind windows of lenslets",
        "A queen in a garden, 1.5 m behind the window and seen from 5 m before it; through lenslets of eta = -1 and -1.2, where "
        "she is upright, larger, and floats before the window, while what is farther behind it than the eye is before is "
        "upside down; and through eta = 0.8 (after Courtial 2008; the scene is our own).",
        (
            "The queen looks 1.8571, 1.7333 and 0.9455 times as large as without a window, (D + a) / (D + a / eta), and upright.",
            "Her image is a / eta behind the window, so for eta < 0 before it: depth is turned over.",
            "Lenslets of a width lose what misses the second one, and nothing else.",
        ),
        (
            Recipe("none", "window", ("pane=none",), PREVIEW, FINAL, caption="the frame alone"),
            *(
                Recipe(f"eta_{eta:g}", "window", (f"eta={eta:g}",), PREVIEW, FINAL, caption=f"eta = {eta:g}")
                for eta in ETAS
            ),
            *(_measured(f"disc_{eta:g}", disc, (f"eta={eta:g}",)) for eta in ETAS),
            *(_measured(f"spot_{eta:g}", spot, (f"eta={eta:g}", f"aside={ASIDE:g}")) for eta in ETAS),
            _measured("losses", disc, (f"eta={ETAS[1]:g}", f"aperture={APERTURE:g}")),
        ),
        measure_lenslets,
        columns=2,
    ),
    Figure(
        "E.7",
        "A queen behind a hyperbolic slab",
        "The frame turned by 40 degrees: empty; with a slab of permittivity 2 all over, through which the queen is displaced a "
        "little; and with one of -3 along its normal. Half of the light, polarised across the plane of incidence, is bent as "
        "before; the other half is bent backwards, so that she is seen twice (media after Rakhmanov 2010; the scene is our own).",
        (
            "Both images are displaced as the slab's thickness and the slopes of the two rays within it say.",
            "The ray of p is bent backwards at every angle, and no index is negative.",
            "Each image has half of the light, times what passes both faces.",
        ),
        (
            Recipe("frame", "window", ("pane=none", "turn=40"), PREVIEW, FINAL, caption="the frame alone"),
            Recipe(
                "plain", "window", ("pane=slab", "turn=40", "along=2"), PREVIEW, FINAL, caption="2 across and along"
            ),
            Recipe("hyperbolic", "window", ("pane=slab", "turn=40"), PREVIEW, FINAL, caption="2 across, -3 along"),
            *(
                _measured(f"rod_{turn}", rod, ("pane=slab", f"thickness={THIN:g}", f"turn={turn}"), (960, 12))
                for turn in TURNS
            ),
            _measured("bare", rod, ("pane=none",), (960, 12)),
        ),
        measure_slab,
    ),
)

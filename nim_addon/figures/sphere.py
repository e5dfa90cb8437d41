# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 5.4 and 5.6: the transparent sphere, alone and with a red one behind it and a blue one in front.

Light that enters a sphere at b radii from its axis turns by D = 2 (asin b + asin(b / |n|)) - asin(b / d) where n < 0,
for an eye at d radii. It goes on to what lies behind while D < 90 degrees, the inner region; beyond, the outer region, it
comes back to the front. Seen from afar the border is at b = 1 / sqrt(1 + (1 + sqrt(2) / |n|)^2).
"""

import math
from itertools import pairwise

import bpy
import numpy as np

from ..physics import Interface
from ..physics.rays import Plane, Shapes, Sphere
from ..physics.reference_image import passes
from ..scenes import sphere as scene_of
from ..scenes.sphere import SphereParameters
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .measure import Camera, block_scores, impact, smooth
from .recipes import Figure, Image, Recipe

ALONE = (1.5, -1.5, -1.33, -1.025)
ACCOMPANIED = (1.5, -1.5, -2.418, -4.1)

# Impact, in the sphere's radius, from which the outside mirrors what is ahead: 45 degrees of incidence.
RIM = math.sqrt(0.5)

PROBE = ((160, 160), 64)
UNLIT = ((128, 96), 8)
SEEDS = 12
# Rays a pixel in a prediction: for its statistics, and where only an edge is looked for.
PASSES, FEW_PASSES = 24, 8

# Straight at the middle of the sphere, so that the picture is round.
EYE = scene_of.pose(None).eye
PROBE_POSE = Pose(EYE, scene_of.CENTER, 18)


# ------------------------------------------------------------------------------------------------ changes to the scene


def unlit(scene: bpy.types.Scene) -> None:
    """The scene as it is, but every surface shines with its own colour."""
    probes.set_up(scene)
    probes.unlit(scene)


def probe(scene: bpy.types.Scene) -> None:
    """Only the sphere, under a sky that codes directions: red from above the eye's axis, green from ahead, blue always."""
    probes.set_up(scene)
    probes.show_only(scene, "Sphere")
    up, ahead = _probe_axes()

    def color(nodes, direction):
        def half(axis):
            along = nodes.add("ShaderNodeVectorMath", operation="DOT_PRODUCT", inputs={0: direction, 1: tuple(axis)})
            return nodes.math("GREATER_THAN", along.outputs["Value"])

        return nodes.add("ShaderNodeCombineXYZ", inputs={0: half(up), 1: half(ahead), 2: 1.0}).outputs[0]

    probes.sky(scene, color)


def companions(scene: bpy.types.Scene) -> None:
    """Only the companions shine, red and blue; all else is black."""
    unlit(scene)
    probes.show_only(scene, "Sphere", "Red", "Blue")
    scene.world = None
    for name, color in (("Red", (1, 0, 0, 1)), ("Blue", (0, 0, 1, 1))):
        for node in probes.find(scene, name).active_material.node_tree.nodes:
            if node.type == "EMISSION":
                node.inputs["Color"].default_value = color


def _probe_axes():
    ahead = np.subtract(PROBE_POSE.target, PROBE_POSE.eye)
    ahead = ahead / np.linalg.norm(ahead)
    up = np.array([0, 0, 1]) - ahead[2] * ahead
    return up / np.linalg.norm(up), ahead


# ------------------------------------------------------------------------------------------------ the same, without Cycles


def _sphere(medium):
    return Sphere(scene_of.CENTER, scene_of.RADIUS, Interface(medium))


def _balls():
    return [Sphere(ball.center, ball.radius) for ball in scene_of.COMPANIONS]


def _on_ball(ends, ball):
    return np.abs(np.linalg.norm(ends - ball.center, axis=1) - ball.radius) < 1e-6


def predicted_unlit(parameters: SphereParameters, camera: Camera, count: int = PASSES) -> np.ndarray:
    """Pictures (count, H, W, 3) of the unlit scene by rays.trace."""
    balls = _balls() if parameters.companions else []
    shapes = Shapes(_sphere(parameters.medium), Plane((0, 0, 0), (0, 0, 1)), *balls)

    def radiance(ends, directions, landed):
        cells = np.floor((ends[:, :2] - scene_of.JOINT) / scene_of.TILE).sum(axis=1)
        ground = np.where((cells % 2 == 0)[:, None], scene_of.LIGHT, scene_of.DARK)
        within = (np.abs(ends[:, :2] - scene_of.JOINT) < scene_of.GROUND).all(axis=1)
        light = np.where((landed & within)[:, None], ground, _sky(parameters, directions))
        for ball in scene_of.COMPANIONS if parameters.companions else ():
            light[landed & _on_ball(ends, ball)] = ball.color
        return light

    return passes(shapes, radiance, camera, count)


def _sky(parameters, directions):
    towards, tone, width = scene_of.sun(parameters)
    towards = towards / np.linalg.norm(towards)
    elevation = np.maximum(np.arcsin(np.clip(directions[:, 2], -1, 1)) / (math.pi / 2), 0)[:, None]
    angle = np.arccos(np.clip(directions @ towards, -1, 1))
    glow = np.exp(-np.square(angle / math.radians(width)))[:, None] * tone
    return (1 - elevation) * scene_of.HORIZON + elevation * np.asarray(scene_of.ZENITH) + glow


def predicted_probe(parameters: SphereParameters, camera: Camera, count: int = FEW_PASSES) -> np.ndarray:
    """The picture (H, W, 3) of the probe's sky by rays.trace."""
    up, ahead = _probe_axes()

    def radiance(ends, directions, landed):
        return np.stack([directions @ up > 0, directions @ ahead > 0, np.ones(len(ends))], axis=-1).astype(float)

    return passes(Shapes(_sphere(parameters.medium)), radiance, camera, count, least=1e-4).mean(axis=0)


def predicted_companions(parameters: SphereParameters, camera: Camera, count: int = FEW_PASSES) -> np.ndarray:
    """The picture (H, W, 3) of nothing but the companions by rays.trace."""

    def radiance(ends, directions, landed):
        light = np.zeros((len(ends), 3))
        for channel, ball in ((0, scene_of.COMPANIONS[0]), (2, scene_of.COMPANIONS[1])):
            light[landed & _on_ball(ends, ball), channel] = 1
        return light

    return passes(Shapes(_sphere(parameters.medium), *_balls()), radiance, camera, count, least=1e-4).mean(axis=0)


# ------------------------------------------------------------------------------------------------ what is read off


def impact_of(camera: Camera) -> np.ndarray:
    """How far each pixel's ray passes the middle of the sphere, (H, W), in its radii."""
    return impact(camera, scene_of.CENTER, scene_of.RADIUS)


def radius_of_inner(pixels: np.ndarray, b: np.ndarray) -> float:
    """Radius, in the sphere's, of the disc with as many pixels as see what is ahead (a probe's picture, its impacts)."""
    ahead = pixels[..., 1]
    # half way between the two regions: at -4.1 a good part of the light is mirrored
    level = (ahead[b < 0.3].mean() + ahead[(b > 0.65) & (b < RIM)].mean()) / 2
    return float(np.sort(b, axis=None)[np.sum((ahead > level) & (b < RIM))])


def _share(chosen, region):
    return float(np.sum(chosen & region) / np.sum(region))


def _probe_claims(images, indices):
    """Claims on the probes of some indices, and by index the radius of the inner region, (predicted, measured)."""
    claims, radii = [], {}
    for n in indices:
        image = images[f"probe_{n:g}"]
        b = impact_of(image.camera)
        upper = np.indices(b.shape)[0] < b.shape[0] / 2
        pair = predicted_probe(image.parameters, image.camera), image.pixels
        name, inner = f"n = {n:g}", RIM
        if n < 0:
            radii[n] = tuple(radius_of_inner(pixels, b) for pixels in pair)
            inner = radii[n][0]
            claims.append(Claim(f"{name}: radius of the inner region, in the sphere's", *radii[n], 0.005))
            front = [_share(pixels[..., 1] < 0.5, (b > 1.05 * inner) & (b < RIM)) for pixels in pair]
            claims.append(Claim(f"{name}: share of the outer region that shows the front", *front, 0.01))
        behind = [_share(pixels[..., 1] > 0.5, b < 0.95 * inner) for pixels in pair]
        claims.append(Claim(f"{name}: share of the inner region that shows what is behind", *behind, 0.01))
        down = [_share(pixels[..., 0] < 0.5, (b < 0.95 * inner) & upper) for pixels in pair]
        claims.append(Claim(f"{name}: share of the inner region's upper half that looks down", *down, 0.01))
        # every ray of a lossless sphere ends in this sky, whatever way it takes
        claims.append(
            Claim(f"{name}: share of the light that comes through", 1.0, float(pair[1][b < 1, 2].mean()), 0.001)
        )
    return claims, radii


def _unlit_claims(images, indices):
    claims = []
    for n in indices:
        image = images[f"unlit_{n:g}"]
        scores, expected = block_scores(image.each, predicted_unlit(image.parameters, image.camera))
        rms = float(np.sqrt(np.mean(np.square(scores))))
        text = f"n = {n:g}: distance to the picture traced without Cycles, rms of 8 x 8 pixels in each colour"
        claims.append(Claim(text, expected, rms, 0.15, "standard errors"))
    return claims


def measure_alone(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.4."""
    claims, radii = _probe_claims(images, ALONE)
    for wide, narrow in ((-1.5, -1.33), (-1.33, -1.025)):
        shrinks = [radii[wide][k] - radii[narrow][k] for k in (0, 1)]
        claims.append(Claim(f"the inner region shrinks from n = {wide:g} to {narrow:g} by", *shrinks, 0.005))
    return claims + _unlit_claims(images, ALONE)


def measure_accompanied(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.6."""
    nims = [n for n in ACCOMPANIED if n < 0]
    _, radii = _probe_claims(images, nims)
    claims = [
        Claim(f"n = {n:g}: width of the outer region, in the sphere's radius", *(1 - r for r in radii[n]), 0.005)
        for n in nims
    ]
    for wide, narrow in pairwise(nims):
        shrinks = [radii[narrow][k] - radii[wide][k] for k in (0, 1)]
        claims.append(Claim(f"the outer region shrinks from n = {wide:g} to {narrow:g} by", *shrinks, 0.005))
    air = images["companions_1"]
    through_air = [
        np.sum(smooth(pixels)[..., 0] > 0.5)
        for pixels in (predicted_companions(air.parameters, air.camera), air.pixels)
    ]
    for n in ACCOMPANIED:
        claims += _companion_claims(images[f"companions_{n:g}"], n, radii.get(n, (RIM,))[0], through_air)
    return claims + _unlit_claims(images, ACCOMPANIED)


def _companion_claims(image, n, inner, through_air):
    b, away = impact_of(image.camera), _away_from_blue(image.camera)
    pair = predicted_companions(image.parameters, image.camera), image.pixels
    # half of what comes straight through two surfaces; at -4.1 what is mirrored within is not far below
    level = 0.5 * float(Interface(image.parameters.medium).fresnel(1.0).T) ** 2
    red = [(smooth(pixels)[..., 0] > level) & (b < 1) for pixels in pair]
    name, claims = f"n = {n:g}", []
    if n < 0:
        only = [_share(b < inner, image) for image in red]
        claims.append(Claim(f"{name}: share of the red sphere's image that lies in the inner region", *only, 0.01))
        # on this side nothing is mirrored by the front of the sphere
        ring = [float(pixels[away & (b > inner), 2].sum() / pixels[away, 2].sum()) for pixels in pair]
        claims.append(
            Claim(f"{name}: share of the blue light, away from the blue sphere, in the outer region", *ring, 0.005)
        )
    area = [float(np.sum(image) / size) for image, size in zip(red, through_air, strict=True)]
    text = f"{name}: size of the red sphere's image, in that through air"
    claims.append(Claim(text, *area, max(0.003, 0.03 * area[0])))
    light = [100 * float(pixels[b < 1, 2].mean()) for pixels in pair]
    text = f"{name}: blue light in the whole sphere, of what the blue one gives"
    claims.append(Claim(text, *light, 0.05 * light[0], "%"))
    return claims


def _away_from_blue(camera):
    """The pixels (H, W) of the sphere in the half that is turned away from the blue one."""
    middle, blue = camera.pixels_of([scene_of.CENTER, scene_of.COMPANIONS[1].center])
    rows, columns = np.indices(camera.size[::-1])
    across = np.stack([columns + 0.5, rows + 0.5], axis=-1) - middle
    return (across @ (blue - middle) < 0) & (impact_of(camera) < 1)


# ------------------------------------------------------------------------------------------------ the figures


def _recipes(indices, companion):
    common = ("companions=yes",) if companion else ()
    recipes = []
    for n in indices:
        settings = (f"n={n:g}", *common)
        recipes += [
            Recipe(
                f"sphere_{n:g}",
                "sphere",
                settings,
                draft=((400, 300), 48),
                final=((1280, 960), 96),
                caption=f"n = {n:g}",
            ),
            Recipe(f"unlit_{n:g}", "sphere", settings, draft=UNLIT, change=unlit, seeds=SEEDS, shown=False),
        ]
    for n in indices if not companion else [n for n in indices if n < 0]:
        recipes.append(
            Recipe(f"probe_{n:g}", "sphere", (f"n={n:g}",), draft=PROBE, change=probe, pose=PROBE_POSE, shown=False)
        )
    for n in (1.0, *indices) if companion else ():
        recipes.append(
            Recipe(
                f"companions_{n:g}",
                "sphere",
                (f"n={n:g}", "companions=yes"),
                draft=((320, 240), 128),
                change=companions,
                shown=False,
            )
        )
    return tuple(recipes)


FIGURES = (
    Figure(
        "5.4",
        "A transparent sphere, from glass to a NIM of index near -1",
        "One sphere, four indices: 1.5 and -1.5 above, -1.33 and -1.025 below. Glass turns the landscape upside down. "
        "A NIM does so in the middle only, and wraps the middle in a ring that shows what stands before the sphere. (The "
        "middle is what looks ahead here. The thesis divides by the half of the sphere that a ray leaves from, which for "
        "n = -1.5 is further out, at 0.638 of the radius: figure B.1 has it).",
        (
            "The inner region of a NIM sphere shows what is behind it, upside down; the glass sphere does everywhere.",
            "The outer region shows what is in front.",
            "The radius of the inner region is that of theory, and shrinks as n goes to -1.",
            "No light is lost.",
            "The whole picture, unlit, is the one that numpy traces, to its own noise.",
        ),
        _recipes(ALONE, False),
        measure_alone,
        columns=2,
    ),
    Figure(
        "5.6",
        "A transparent sphere with a red one behind and a blue one in front",
        "Indices 1.5 and -1.5 above, -2.418 and -4.1 below. Behind a NIM the red sphere is seen in the middle, small; the "
        "blue one, which stands before it, appears in the ring around it, narrower the larger the index. The larger the "
        "index, the more of it is mirrored, too, by the front of the sphere: below the middle, on the blue one's side.",
        (
            "The red sphere is seen in the inner region only, and smaller than through air.",
            "The blue sphere is seen in the outer region, in the half turned away from it, where nothing mirrors it.",
            "The outer region shrinks as the magnitude of n grows.",
            "The whole picture, unlit, is the one that numpy traces, to its own noise.",
        ),
        _recipes(ACCOMPANIED, True),
        measure_accompanied,
        columns=2,
    ),
)

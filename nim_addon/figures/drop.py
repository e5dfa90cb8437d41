# SPDX-License-Identifier: GPL-3.0-or-later
"""The figure of the drop: water has its rainbow, a NIM has none of any order, but sends a ring of light straight back.

Two things are measured. An orthographic camera in the place of the sun sees one ray a pixel, which tells where it leaves the
drop to, after how many reflections within, and of which wavelength it is: each is held against its own deviation. And what
lands on the wall is held against rays in closed form.
"""

import functools
import math
from itertools import pairwise
from typing import NamedTuple

import bpy
import mathutils
import numpy as np

from ..cycles import spectral, wavelength
from ..cycles.material import interface_nodes
from ..physics import VISIBLE_NM, Medium, deviation
from ..scenes import drop as scene_of
from ..scenes import surfaces
from ..scenes.stage import STAGE_MARK, Pose
from . import probes
from .claims import Claim
from .drop_optics import leaving, on_the_wall
from .measure import compare, misplaced
from .recipes import Figure, Image, Recipe

WATER, NIM = "water-daimon", "nim-mirror"
COLOURS = 400.0, 550.0, 700.0  # nanometres
SUN = 0.53  # degrees
# The wall that is measured: half its side, in radii of the drop, and the rings about the hole that its light is read in.
REACH, FROM = 6.4, 30.0
RINGS = np.arange(1.8, 6.35, 0.1)  # from where no kernel of a photon reaches into the hole
BOW, DARK = (4.0, 5.5), (5.8, 6.3)  # where the bow of water is on it, and where it is dark
STRAIGHT = Pose(
    (0, scene_of.RADIUS * (scene_of.USUAL - FROM), 0),
    (0, scene_of.RADIUS * scene_of.USUAL, 0),
    2 * math.degrees(math.atan(REACH / FROM)),
    "VERTICAL",
)
ACROSS = 2.02  # of the view of the camera in the place of the sun, in radii of the drop
BOWS, NEAR_A_BOW = {1: 0.86, 2: 0.95}, 0.03  # where light of the first and the second bow arrives, and how far about
FINER = 5  # divisions of the drop's quads: its normals are the sphere's to 0.02 degrees
BAND, BANDS, FROM_THE_AXIS = 60, 24, 0.3  # rays in a band, bands at most, and from which b on
ALL_BUT_THE_RIM = 0.98  # where a mesh's own normals are the sphere's


# ------------------------------------------------------------------------------------------------ changes to the scene


def reporting(scene: bpy.types.Scene) -> None:
    """One ray a pixel, through its middle, of light as it arrives; its colour tells where it goes and what became of it.

    The colour of a ray that has crossed the surface twice is its direction, times 1 + how often it was reflected within +
    half the place of its wavelength in VISIBLE_NM, from 0 to 1. So nothing may be lost on its way: the drop absorbs nothing.
    """
    probes.show_only(scene, "Drop")
    spectral.set_up(scene)
    probes.through_the_middles(scene)
    drop = probes.find(scene, "Drop")
    (interface,) = interface_nodes(drop.active_material)
    for link in list(interface.inputs["Absorption Inside"].links):
        drop.active_material.node_tree.links.remove(link)
    interface.inputs["Absorption Inside"].default_value = 0.0
    for modifier in drop.modifiers:
        if modifier.type == "SUBSURF":
            modifier.render_levels = FINER
    camera = scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", ACROSS * scene_of.RADIUS
    camera.location = (0, 5 * scene_of.RADIUS, 0)
    camera.rotation_euler = mathutils.Vector((0, -1, 0)).to_track_quat("-Z", "Y").to_euler()

    def color(nodes, direction):
        path = nodes.add("ShaderNodeLightPath").outputs
        # a bend backwards counts as transparent, any other as a transmission
        crossed = nodes.math("ADD", path["Transmission Depth"], path["Transparent Depth"])
        through = nodes.math("COMPARE", crossed, 2.0, 0.5)
        own = wavelength.new_node(nodes.tree, "osl").outputs[wavelength.WAVELENGTH]
        place = wavelength.scaled(nodes, own, 1.0, 1.5)
        return nodes.scale(direction, nodes.math("MULTIPLY", nodes.math("ADD", path["Glossy Depth"], place), through))

    probes.sky(scene, color)


def white_wall(scene: bpy.types.Scene) -> None:
    """A white wall that light leaves once, under nothing but the disk of a sun, and no drop to be seen before it."""
    probes.set_up(scene)
    probes.paint(probes.find(scene, "Wall"), surfaces.plain("White", (1, 1, 1)))
    probes.find(scene, "Drop").visible_camera = False
    probes.sky(scene)
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = scene_of.SUN_IRRADIANCE[0], math.radians(SUN)
    lamp = bpy.data.objects.new("Sun", sun)
    lamp.rotation_euler = mathutils.Vector(np.negative(scene_of.TOWARDS_SUN)).to_track_quat("-Z", "Y").to_euler()
    lamp[STAGE_MARK] = scene[STAGE_MARK]  # it goes when the scene is built anew
    scene.collection.objects.link(lamp)
    scene.cycles.max_bounces = 0
    spectral.set_up(scene)
    bpy.context.view_layer.update()


# ------------------------------------------------------------------------------------------------ what is read off


class Rays(NamedTuple):
    """Rays that have come through the drop, but for its rim.

    b:          (N,) how far from the axis they arrive, in radii
    order:      (N,) how often they were reflected within
    turned:     (N,) by which angle they were turned, radians, in [0, 2 pi)
    wavelength: (N,) nanometres
    all:        (M,) b of all rays that were sent, those too that did not come through
    """

    b: np.ndarray
    order: np.ndarray
    turned: np.ndarray
    wavelength: np.ndarray
    all: np.ndarray

    def of(self, chosen: np.ndarray) -> "Rays":
        """Those of a mask (N,)."""
        return Rays(*(column[chosen] for column in self[:-1]), self.all)


def rays_of(pixels: np.ndarray) -> Rays:
    """The Rays that a picture (H, W, 3) of reporting() tells of."""
    side = len(pixels)
    place = ((np.arange(side) + 0.5) / side - 0.5) * ACROSS
    across, up = np.meshgrid(place, -place)
    aside = np.stack([-across, 0 * across, up], axis=-1)  # the camera looks along -y, and has x to its left
    b = np.linalg.norm(aside, axis=-1)
    told = np.linalg.norm(pixels, axis=-1)
    met = b < ALL_BUT_THE_RIM
    through = met & (told > 0.5)
    aside, direction, told = aside[through], pixels[through] / told[through][:, None], told[through]
    outwards = np.sum(direction * aside, axis=-1) / b[through]
    turned = np.arctan2(-outwards, -direction[:, 1]) % (2 * math.pi)
    order = np.floor(told + 1e-5).astype(int)
    first, last = VISIBLE_NM
    return Rays(b[through], order - 1, turned, first + 2 * (told - order) * (last - first), b[met])


def off(rays: Rays, medium: Medium) -> np.ndarray:
    """By how much (N,) each of the rays is turned further than its own deviation, degrees."""
    wanted = np.empty(len(rays.b))
    n = medium.spectrum(rays.wavelength)[0].real
    for order in np.unique(rays.order):
        here = rays.order == order
        wanted[here] = deviation.drop(n[here], np.arcsin(rays.b[here]), order)
    return np.degrees((rays.turned - wanted + math.pi) % (2 * math.pi) - math.pi)


def bow_of(rays: Rays, wavelength_nm: float, order: int = 1) -> float:
    """The radius of the rainbow at a wavelength, degrees, as rays (b, turned, wavelength) tell of it.

    By the largest angle, over b, of a surface of the third degree that is laid through those about the bow.
    """
    near = rays.of((rays.order == order) & (np.abs(rays.b - BOWS[order]) < NEAR_A_BOW))
    seen = np.degrees(np.abs(math.pi - near.turned))
    sign = 1 if order == 1 else -1  # the first bow is an outer edge, the second an inner one
    coefficients = _fitted(near.b - BOWS[order], near.wavelength, seen)
    x = np.linspace(-NEAR_A_BOW, NEAR_A_BOW, 20_001)
    return float(sign * np.max(sign * _terms(x, np.full_like(x, wavelength_nm)) @ coefficients))


def ring_of(rays: Rays, wavelength_nm: float) -> float:
    """How far from the axis light of a wavelength arrives that comes straight back without a reflection within, in radii."""
    near = rays.of((rays.order == 0) & (np.abs(rays.turned - math.pi) < 0.3))
    coefficients = _fitted(near.turned - math.pi, near.wavelength, near.b)
    return float(_terms(np.zeros(1), np.array([wavelength_nm]))[0] @ coefficients)


def _fitted(x, wavelength_nm, values):
    """Coefficients of _terms() that are nearest to values (N,), without the few that a seam of the mesh has turned aside."""
    return _laid(_terms(x, wavelength_nm), values)


def _laid(terms, values):
    chosen = np.ones(len(values), bool)
    for _ in range(3):
        coefficients = np.linalg.lstsq(terms[chosen], values[chosen], rcond=None)[0]
        left = np.abs(values - terms @ coefficients)
        chosen = left < 5 * np.median(left)
    return coefficients


def _terms(x, wavelength_nm):
    """(N, 10) powers of x and of 1 / wavelength^2, in which indices are nearly straight, to the third."""
    y = (500 / wavelength_nm) ** 2 - 1
    return np.stack([x**i * y**j for i in range(4) for j in range(4 - i)], axis=-1)


def growth(rays: Rays, order: int, medium: Medium) -> tuple[float, float]:
    """The least growth of the angle that light of an order is turned by with its angle of incidence: predicted, measured.

    dD/di = 2 + 2 (k + 1) cos i / (|n| cos r) of a NIM, here and there over b: in bands of as many rays each, BAND at least,
    through which a parabola is laid. Where it is 0 there is a bow.
    """
    of_it = rays.of((rays.order == order) & (rays.b > FROM_THE_AXIS))
    borders = np.quantile(of_it.b, np.linspace(0, 1, min(BANDS, len(of_it.b) // BAND) + 1))
    predicted, measured = [], []
    for low, high in pairwise(borders):
        here = of_it.of((of_it.b >= low) & (of_it.b < high))
        x, middle = here.b - (low + high) / 2, (low + high) / 2
        first = np.angle(np.mean(np.exp(1j * here.turned)))
        turned = (here.turned - first + math.pi) % (2 * math.pi)
        terms = np.stack([x, x**2, (500 / here.wavelength) ** 2 - 1, np.ones_like(x)], axis=-1)
        cosine = math.sqrt(1 - middle**2)
        measured.append(cosine * float(_laid(terms, turned)[0]))
        predicted.append(2 + 2 * (order + 1) * cosine / math.sqrt(medium.n**2 - middle**2))
    return min(predicted), min(measured)


def profile(pixels: np.ndarray) -> np.ndarray:
    """The irradiance (N, 3) of RINGS on a white wall in a square picture (H, W, 3), where the sun's is 1."""
    side = len(pixels)
    place = ((np.arange(side) + 0.5) / side * 2 - 1) * REACH
    which = np.digitize(np.hypot(*np.meshgrid(place, place)), RINGS).ravel()
    count = np.bincount(which, minlength=len(RINGS) + 1)[1:-1]
    means = [np.bincount(which, channel, len(RINGS) + 1)[1:-1] / count for channel in pixels.reshape(-1, 3).T]
    return math.pi * np.stack(means, axis=-1) / scene_of.SUN_IRRADIANCE


def _further_out(light, channel):
    """By how much the light (N, 3) of RINGS about the bow lies further out in a channel than in the next one, on average.

    The kernel that spreads a photon shifts both alike: where so little light comes back, that is more than they differ by.
    """
    middle, area = (RINGS[1:] + RINGS[:-1]) / 2, np.diff(np.square(RINGS))
    here = (middle > BOW[0]) & (middle < BOW[1])
    weight = light[here, channel : channel + 2] * area[here, None]
    first, second = np.sum(weight * middle[here, None], axis=0) / np.sum(weight, axis=0)
    return float(first - second)


def _wide(rings):
    """The rings (..., N, 3) in bands, five in each, so wide that no kernel of a photon matters: (..., N / 5, 3)."""
    count = rings.shape[-2] // 5
    area = np.diff(np.square(RINGS))[: 5 * count, None]
    power = (rings[..., : 5 * count, :] * area).reshape(*rings.shape[:-2], count, 5, 3).sum(axis=-2)
    return power / area.reshape(count, 5, 1).sum(axis=1)


def _in_the_dark(rings):
    """Light of the wall where neither of water's bows is, in that about the bow."""
    middle = (RINGS[1:] + RINGS[:-1]) / 2
    dark, bow = ((middle > low) & (middle < high) for low, high in (DARK, BOW))
    return rings[dark].mean() / rings[bow].mean()


def _falling(rings):
    """At which share of the steps from a band of the wall to the next outwards light falls."""
    return float(np.mean(np.diff(_wide(rings).mean(axis=1)) < 0))


def _steepness(rings):
    """The power of the radius that the light of the bands goes by, on average."""
    middle = (RINGS[1:] + RINGS[:-1])[: len(rings) // 5 * 5].reshape(-1, 5).mean(axis=1) / 2
    return np.polyfit(np.log(middle), np.log(_wide(rings).mean(axis=1)), 1)[0]


# ------------------------------------------------------------------------------------------------ the claims


def _ray_claims(rays, medium, name):
    """Of all rays: where they go, and how many."""
    claims, left = [], np.abs(off(rays, medium))
    for order in range(3):
        of_it = rays.order == order
        text = f"{name}, k = {order}: how far a ray is turned beside what is its own of its wavelength, median"
        claims.append(Claim(text, 0, float(np.median(left[of_it])), 0.02, "degrees"))
        wanted = float(leaving(Medium(medium.n, medium.mu), rays.all, order).energy.mean())
        noise = math.sqrt(wanted * (1 - wanted) / len(rays.all))
        text = f"{name}, k = {order}: share of the light"
        claims.append(Claim(text, wanted, float(np.mean(of_it)) * len(rays.b) / len(rays.all), 4 * noise))
    return claims


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of the figure."""
    water, nim = (images[f"rays_{name}"] for name in ("water", "nim"))
    return [
        *water_claims(rays_of(water.pixels), water.parameters.liquid),
        *nim_claims(rays_of(nim.pixels), nim.parameters.liquid),
        *wall_claims(images["ring_water"], images["ring_nim"]),
    ]


def water_claims(rays, medium):
    claims = []
    for order, allowed in ((1, 0.02), (2, 0.05)):
        for nm in COLOURS:
            bow = deviation.bow(medium.at(nm).n, order)
            assert bow is not None
            text = f"water, k = {order}: radius of the rainbow at {nm:g} nm"
            claims.append(Claim(text, math.degrees(bow.radius), bow_of(rays, nm, order), allowed, "degrees"))
    return claims + _ray_claims(rays, medium, "water")


def nim_claims(rays, medium):
    claims = []
    for order in range(3):
        text = f"NIM, k = {order}: least growth of the angle that light is turned by with that of incidence; 0 is a bow"
        claims.append(Claim(text, *growth(rays, order, medium), 0.05))
    for nm in COLOURS:
        text = f"NIM: light of {nm:g} nm that arrives this far from the axis comes straight back"
        claims.append(Claim(text, deviation.glory(medium.at(nm).n), ring_of(rays, nm), 0.0005, "radii"))
    return claims + _ray_claims(rays, medium, "NIM")


def wall_claims(water, nim):
    """Of the light on the wall, ring by ring, in red, green and blue."""
    claims = []
    traced_water, found_water = _on_the_wall(water)
    for channel, (colour, other) in enumerate(pairwise(("red", "green", "blue"))):
        *pair, noise = compare(functools.partial(_further_out, channel=channel), (traced_water,), (found_water,))
        text = f"water: on the wall {colour} light of the bow is further out than {other}, by"
        claims.append(Claim(text, *pair, noise, "radii"))
    *pair, noise = compare(_in_the_dark, (traced_water,), (found_water,))
    claims.append(Claim("water: light beyond the bow on the wall, in that of the bow", *pair, noise + 0.005))
    traced_nim, found_nim = _on_the_wall(nim)
    text = "NIM: share of the steps of half a radius, outwards on the wall, at which light falls; at a bow it rises"
    claims.append(Claim(text, *(_falling(rings.mean(axis=0)) for rings in (traced_nim, found_nim)), 0))
    *pair, noise = compare(_steepness, (traced_nim,), (found_nim,))
    claims.append(Claim("NIM: power of the radius with which light on the wall falls", *pair, noise + 0.02))
    area = np.diff(np.square(RINGS[::5]))[:, None]
    shares = misplaced(_wide(found_nim) * area, _wide(traced_nim) * area)
    text = "NIM: share of the light in other bands of the wall, or colours, than theory has it (predicted: noise alone)"
    claims.append(Claim(text, *shares, 0.02))
    return claims


def _on_the_wall(image):
    """The rings (4, N, 3) of theory, and those found (seeds, N, 3)."""
    parameters = image.parameters
    of_theory = [
        on_the_wall(parameters.liquid, scene_of.RADIUS, parameters.distance, SUN, RINGS, seed) for seed in range(4)
    ]
    return np.stack(of_theory), np.stack([profile(pixels) for pixels in image.each])


# ------------------------------------------------------------------------------------------------ the figure


# at draft and at final quality: of water but a twentieth of the light comes back
PHOTONS = {"water": (1 << 22, 1 << 25), "nim": (1 << 20, 1 << 23)}
NAMES = {"water": (WATER, "water"), "nim": (NIM, "NIM")}

FIGURES = (
    Figure(
        "D.2",
        "A drop of water has a rainbow, a drop of a NIM has none",
        "Light of a sun a quarter of a degree wide comes through a hole in a wall onto a drop, which throws some of it back onto "
        "the wall (above). Water draws its rainbow: light that was reflected once within is turned back by up to 42.4 degrees in "
        "red, 40.6 in violet, and crowds there. In a NIM nothing crowds: the further out light arrives, the more it is turned, "
        "whatever its colour and however often it is reflected. From where a sun of three degrees stands (below), water shows a "
        "faint dot in its middle, and the NIM a ring of light that comes straight back after two refractions, at |n| / "
        "sqrt(1 + n^2) = 0.8 of its radius, each colour by its own n; the faint ring at the rim was reflected once.",
        (
            "Water's first two rainbows stand where theory has them, in each colour, the first with red outside.",
            "Each ray goes where it is to go by its own wavelength, and as many of them as Fresnel's equations say.",
            "In a NIM the angle of deviation grows with that of incidence, for each order: no bow.",
            "Light of all colours comes straight back from a NIM, each from a ring of its own index.",
            "On the wall water's red is further out than its green, and that than its blue, by as much as in theory.",
            "The light of the NIM on the wall is that of theory, band by band and colour by colour, and falls off outwards.",
        ),
        (
            *(
                Recipe(
                    f"wall_{name}",
                    "drop",
                    (f"liquid={medium}", "sun_angle=0.25"),
                    draft=((480, 480), 32),
                    final=((900, 900), 256),
                    spectral=True,
                    photons=PHOTONS[name],
                    caption=f"{called}, the wall",
                )
                for name, (medium, called) in NAMES.items()
            ),
            *(
                Recipe(
                    f"sun_{name}",
                    "drop",
                    (f"liquid={medium}", "view=sun", "sun_angle=3"),
                    draft=((480, 480), 64),
                    final=((900, 900), 1024),
                    spectral=True,
                    caption=f"{called}, from the sun",
                )
                for name, (medium, called) in NAMES.items()
            ),
            *(
                Recipe(
                    f"rays_{name}", "drop", (f"liquid={medium}",), draft=((512, 512), 1), change=reporting, shown=False
                )
                for name, (medium, _) in NAMES.items()
            ),
            *(
                Recipe(
                    f"ring_{name}",
                    "drop",
                    (f"liquid={medium}",),
                    draft=((128, 128), 8),
                    change=white_wall,
                    pose=STRAIGHT,
                    photons=(1 << 19, 1 << 19),
                    seeds=4,
                    shown=False,
                )
                for name, (medium, _) in NAMES.items()
            ),
        ),
        measure,
        columns=2,
    ),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool's figures: from outside (5.3), from under water on a grey day and a sunny one (5.7, 5.9), and mu varied (5.10).

What is measured is measured on still liquid, where the mirror image and Snell's law say in closed form what each pixel
shows, and in light that carries its own origin: a sky whose colour is its direction, a basin whose colour is its place.
"""

import math

import bpy
import numpy as np

from ..caustics import lights
from ..scenes import pool, shapes, surfaces
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .measure import Camera, centroid, compare, correlation, misplaced, off_vertical, pixel_width, slope, steepest
from .pool_optics import (
    Waves,
    ball_in_window,
    floor_in_the_sun,
    mirrored_place,
    place_below,
    reflectance,
    window_radius,
)
from .recipes import Figure, Image, Recipe
from .sunlight import irradiance

# The eye of the measurements under water looks straight up; half a turn of its picture is a turn about the vertical.
EYE = (0.0, 0.35, pool.FLOOR + 0.3)
STRAIGHT_UP = Pose(EYE, (0.0, 0.351, 0.0), 108, "VERTICAL")
# A place in the basin is coded as 1/2 + place / CODE, which lies between 0 and 1.
CODE = 16.0
# The suns of the measured caustics, in degrees: a wide one is found by chance often enough, the real one is traced.
SUNS = {"found": 10.0, "traced": 0.53}
# From above the floor, under the liquid, straight down.
STRAIGHT_DOWN = Pose((0.0, 0.0, -0.3), (0.0, 0.001, pool.FLOOR), 90, "VERTICAL")
# Two balls in the air, where the parasol's cloth and the tree's crown are: centre and radius.
RED_BALL, GREEN_BALL = ((2.5, 3.1, 2.3), 0.6), ((-2.0, 4.2, 3.2), 0.8)


# changes to the scene


def sky_of_directions(scene: bpy.types.Scene) -> None:
    """Only the liquid in a black basin, under a sky that is red by x, green by y, and 1 in blue."""
    _bare(scene)
    probes.paint(probes.find(scene, "Basin"), probes.glow("Black"))
    probes.sky(scene, lambda nodes, direction: probes.coded(nodes, direction, 0.5))


def basin_of_places(scene: bpy.types.Scene) -> None:
    """Only the liquid and its basin, which is red by x, green by y, and 1 in blue, under a black sky."""

    def place(nodes):
        return probes.coded(nodes, nodes.add("ShaderNodeNewGeometry").outputs["Position"], 1 / CODE)

    _bare(scene)
    probes.paint(probes.find(scene, "Basin"), surfaces.shining("Place", place))
    probes.sky(scene)


def two_balls(scene: bpy.types.Scene) -> None:
    """Only the liquid in a black basin under a black sky, and a red and a green ball in the air."""
    _bare(scene)
    probes.paint(probes.find(scene, "Basin"), probes.glow("Black"))
    probes.sky(scene)
    for name, (center, radius), color in (("Red", RED_BALL, (1, 0, 0)), ("Green", GREEN_BALL, (0, 1, 0))):
        vertices, faces = shapes.cube_sphere(16)
        data = bpy.data.meshes.new(name)
        data.from_pydata((np.array(center) + radius * vertices).tolist(), [], faces)
        data.materials.append(probes.glow(name, color))
        scene.collection.objects.link(bpy.data.objects.new(name, data))


def near_wall(scene: bpy.types.Scene) -> None:
    """The basin glows in blue, its wall below the eye of the side view in red too; all else is black."""
    _bare(scene, ("Liquid", "Basin", "Ground"))
    basin = probes.find(scene, "Basin")
    probes.paint(probes.find(scene, "Ground"), probes.glow("Black"))
    probes.paint(basin, probes.glow("Basin", (0, 0, 1)))
    basin.data.materials[1] = probes.glow("Near wall", (1, 0, 1))
    for face in basin.data.polygons:
        face.material_index = face.center.y < -pool.HALF[1] + 1e-6
    probes.sky(scene)


def sun_on_white(scene: bpy.types.Scene) -> None:
    """The liquid in a basin of black walls and a white floor that light leaves once, under nothing but the sun."""
    _bare(scene, ("Liquid", "Basin", "Ground"))
    basin = probes.find(scene, "Basin").data
    basin.materials[0] = surfaces.plain("White", (1, 1, 1))
    basin.materials[1] = probes.glow("Black")
    scene.cycles.diffuse_bounces = 1
    width = math.degrees(lights.sun_of(scene).angle)
    scene.world = surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=pool.sun(width))
    scene.world.cycles.sampling_method = "NONE"  # shadow rays end at the liquid


def traced_on_white(scene: bpy.types.Scene) -> None:
    """The same for photons: what the floor shines with is the first time that light leaves it."""
    sun_on_white(scene)
    scene.cycles.diffuse_bounces = 0


def _bare(scene, kept=("Liquid", "Basin")):
    """Show only the objects `kept`; without the ground the basin ends at the liquid's level, not to stand in its way."""
    probes.set_up(scene)
    probes.show_only(scene, *kept)
    if "Ground" not in kept:
        for vertex in probes.find(scene, "Basin").data.vertices:
            vertex.co.z = min(vertex.co.z, pool.LEVEL)


# what the picture says


def _distance(found, wanted, region):
    """The median distance, in metres, of places in a basin_of_places() picture from where they are wanted."""
    return float(np.median(np.linalg.norm(found - wanted[..., :2], axis=-1)[region]))


def _footprint(wanted, region):
    """What a pixel spans in the basin, in metres: the median distance to the next pixel's place."""
    return float(np.nanmedian(np.linalg.norm(np.diff(wanted[..., :2], axis=1), axis=-1)[region[:, 1:]]))


# the claims


LIQUIDS = {"water": "water", "nim": "NIM"}
PERMEABILITIES = (-10, -25)
# The floor that STRAIGHT_DOWN sees: half its side in metres; and into how many cells a side is cut.
REACH, CELLS = 1.45, 16


def measure_window(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.7."""
    claims = []
    for key, name in LIQUIDS.items():
        sky, basin, balls = (images[f"{key}_{part}"] for part in ("sky", "basin", "balls"))
        liquid = sky.parameters.liquid
        radius, angle = window_radius(liquid), off_vertical(sky.camera)
        pixel = pixel_width(sky.camera, radius)
        edges = [steepest(image.pixels[..., 2], angle, pixel / 2) for image in (sky, basin)]
        claims.append(Claim(f"{name}: radius of the window", radius, edges[0], pixel, "degrees"))
        claims.append(Claim(f"{name}: where the blanket begins", radius, edges[1], pixel, "degrees"))
        well_inside = angle < radius - 2 * pixel
        direction = probes.decoded(sky.pixels, 0.5)
        look = sky.camera.pixel_rays()[1]
        for axis, word in enumerate(("along", "across")):
            found = slope(direction[well_inside, axis], look[well_inside, axis])
            text = f"{name}: sine in the air over sine in the liquid, {word} the pool"
            # a tenth of a pixel at the window's edge
            allowed = 0.1 * math.radians(pixel) / math.tan(math.radians(radius)) * abs(liquid.n)
            claims.append(Claim(text, liquid.n, found, allowed))
        for channel, (word, (center, size)) in enumerate((("red", RED_BALL), ("green", GREEN_BALL))):
            wanted = centroid(ball_in_window(balls.camera, liquid, center, size))
            found = centroid(balls.pixels[..., channel] > 0.4)
            for side, a, b in zip(("column", "row"), wanted, found, strict=True):
                claims.append(Claim(f"{name}: {side} of the {word} ball above the deck", a, b, 0.5, "px"))
    water, nim = (images[f"{key}_sky"] for key in LIQUIDS)
    inside = off_vertical(water.camera) < window_radius(water.parameters.liquid) - 1
    for channel, word in enumerate(("along", "across")):
        turned = nim.pixels[::-1, ::-1, channel]
        text = f"likeness of the water's window and the NIM's after half a turn, in the colour {word} the pool"
        claims.append(Claim(text, 1.0, correlation(water.pixels[..., channel], turned, inside), 0.02))
    return claims


def measure_permeability(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.10."""
    claims = []
    for mu in PERMEABILITIES:
        image = images[f"basin_{mu:g}"]
        liquid = image.parameters.liquid
        radius, angle = window_radius(liquid), off_vertical(image.camera)
        pixel = pixel_width(image.camera, radius)
        wanted, found = reflectance(liquid, image.camera), image.pixels[..., 2]
        for low, high in ((0, 10), (20, 30), (35, 45)):
            ring = (angle >= low) & (angle < high)
            # one of two ways is taken at random: four standard errors
            allowed = 4 * (found - wanted)[ring].std() / math.sqrt(ring.sum())
            text = f"mu = {mu:g}: reflectance from {low} to {high} degrees off the vertical"
            claims.append(Claim(text, float(wanted[ring].mean()), float(found[ring].mean()), float(allowed)))
        claims.append(
            Claim(f"mu = {mu:g}: radius of the window", radius, steepest(found, angle, pixel / 2), pixel, "degrees")
        )
        window = angle < radius - pixel
        place = mirrored_place(image.camera)
        text = f"mu = {mu:g}: the floor in the window, its distance from where a mirror shows it, median"
        distance = _distance(probes.decoded(image.pixels, 1 / CODE), place, window)
        claims.append(Claim(text, 0.0, distance, _footprint(place, window) / 4, "m"))
    return claims


def measure_outside(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.3."""
    claims, magnified = [], {}
    for key, name in {"empty": "empty", **LIQUIDS}.items():
        side, top = images[f"{key}_side_wall"], images[f"{key}_top_places"]
        liquid = side.parameters.liquid
        place = place_below(side.camera, liquid)
        wanted = np.isclose(place[..., 1], -pool.HALF[1]) & (place[..., 2] < pool.LEVEL)
        found = (side.pixels[..., 0] > 0.4) & (side.pixels[..., 0] > 0.5 * side.pixels[..., 2])
        text = f"{name}, from the side: share of the picture that shows the inside of the near wall"
        claims.append(Claim(text, wanted.mean(), found.mean(), 0.002))
        if wanted.any():
            pairs = zip(("column", "row"), centroid(wanted), centroid(found), strict=True)
            claims += [
                Claim(f"{name}, from the side: {text} of the wall's middle", *pair, 0.5, "px") for text, *pair in pairs
            ]
        place = place_below(top.camera, liquid)
        look = top.camera.pixel_rays()[1]
        floor = place[..., 2] < pool.FLOOR + 1e-6
        found = probes.decoded(top.pixels, 1 / CODE)
        text = f"{name}, from the top: what is seen of the floor, its distance from where Snell puts it, median"
        claims.append(Claim(text, 0.0, _distance(found, place, floor), _footprint(place, floor) / 4, "m"))
        middle = np.all(np.abs(look[..., :2] / look[..., 2:]) < 0.1, axis=-1)
        magnified[key] = 1 / slope(found[middle, 0], (look[..., 0] / -look[..., 2])[middle])
    air, depth = TOP_EYE - pool.LEVEL, pool.LEVEL - pool.FLOOR
    for key, name in LIQUIDS.items():
        n = images[f"{key}_top_places"].parameters.liquid.n
        text = f"{name}, from the top: the middle of the floor, magnified against the empty pool"
        # near the vertical a depth h of index n looks h / n deep
        claims.append(Claim(text, (air + depth) / (air + depth / n), magnified[key] / magnified["empty"], 0.005))
    return claims


def measure_sunny(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.9."""
    return [claim for key, name in LIQUIDS.items() for claim in sunny_claims(key, name, images)]


def sunny_claims(key: str, name: str, images: dict[str, Image]) -> list[Claim]:
    """Those claims of figure 5.9 that are on one of LIQUIDS, by its key and its name."""
    claims = []
    for way, width in SUNS.items():
        floor = images[f"{key}_{way}"]
        wanted = np.stack([floor_in_the_sun(floor.parameters, REACH, CELLS, seed=seed) for seed in range(4)])
        found = np.stack([on_floor(pixels, floor.camera, REACH, CELLS) for pixels in floor.each])
        of_all = wanted.mean(axis=0)
        mean, contrast = compare(lambda cells, of_all=of_all: (cells.mean(), slope(cells, of_all)), (wanted,), (found,))
        what = f"{name}, a sun of {width:g} degrees, {way}"
        claims.append(Claim(f"{what}: irradiance of the floor / n^2, as Cycles counts it, mean", *mean, "W/m2"))
        if way == "traced":
            # its noise is so small that the surface shows, bilinear there and triangles here, and that a kernel spreads
            # each photon over a tenth of a cell or so
            mean, contrast = (*mean[:2], mean[2] + 0.001 * mean[0]), (*contrast[:2], contrast[2] + 0.02)
        claims.append(Claim(f"{what}: contrast of its caustics in those that numpy traces", *contrast))
        text = f"{what}: share of the light in other cells than what numpy traces (predicted: noise alone)"
        claims.append(Claim(text, *misplaced(found, wanted), 0.005))
    basin = images[f"{key}_blanket"]
    place = Waves(basin.parameters).mirrored_place(basin.camera)
    radius, angle = window_radius(basin.parameters.liquid), off_vertical(basin.camera)
    # beyond what the waves' slopes let through
    blanket = (angle > radius + 6) & (angle < 65) & np.isfinite(place[..., 0])
    text = f"{name}: the floor in the blanket, its distance from where the waves mirror it, median"
    distance = _distance(probes.decoded(basin.pixels, 1 / CODE), place, blanket)
    # all light of the blanket goes one way, so less is left to chance than in the window
    return [*claims, Claim(text, 0.0, distance, _footprint(place, blanket) / 10, "m")]


def on_floor(pixels: np.ndarray, camera: Camera, reach: float, cells: int) -> np.ndarray:
    """The irradiance of the middle of the white floor in sun_on_white() pixels: (cells, cells), red, rows from +y."""
    (left, top), (right, bottom) = camera.pixels_of([(-reach, reach, pool.FLOOR), (reach, -reach, pool.FLOOR)]).round()
    return irradiance(pixels[int(top) : int(bottom), int(left) : int(right)], cells)


# the figures

UP = ((256, 256), 16)


def _measured(name, change, *settings, draft=UP, **more):
    return Recipe(name, "pool", settings, draft=draft, change=change, shown=False, **more)


def _shown(name, caption, *settings, draft=((360, 240), 32), final=((1296, 864), 64), photons=None):
    return Recipe(name, "pool", settings, draft=draft, final=final, photons=photons, caption=caption)


def _pairs(settings, caption, **frames):
    """The two shown renders of the window, with water and with a NIM."""
    return tuple(
        _shown(key, caption.format(name=name), f"liquid={key}", "view=window", *settings, **frames)
        for key, name in LIQUIDS.items()
    )


WAVES = "waves=0.04"  # of figure 5.9


def _lit(key, way):
    return f"liquid={key}", WAVES, "sky=sunny", f"sun_angle={SUNS[way]:g}"


TOP_EYE = pool.pose(pool.PoolParameters(view="top")).eye[2]
FILLINGS = {"empty": "none", "water": "water", "nim": "nim"}

FIGURES = (
    Figure(
        "5.3",
        "The pool from the side and from the top: empty, with water, with a NIM",
        "Above from beside the pool, below from over it. The wall at our feet is out of sight while the pool is empty, and "
        "with water, which only lifts the floor. A NIM folds the sight lines back towards us: that wall's orange band and "
        "its edges appear. From the top the NIM's floor looks larger than the empty pool's by almost half.",
        (
            "Only the NIM shows the inside of the near wall, as large and where the traced rays put it.",
            "Each place of the floor is seen from the top where Snell's law puts it.",
            "The floor is magnified as apparent depth says: h / n, above the surface where n is negative.",
        ),
        (
            *(
                _shown(f"{key}_{view}", f"{LIQUIDS.get(key, key)}, from the {view}", f"liquid={liquid}", f"view={view}")
                for view in ("side", "top")
                for key, liquid in FILLINGS.items()
            ),
            *(
                _measured(
                    f"{key}_{view}_{part}",
                    change,
                    f"liquid={liquid}",
                    f"view={view}",
                    "waves=0",
                    draft=((240, 160), 16),
                )
                for view, part, change in (("side", "wall", near_wall), ("top", "places", basin_of_places))
                for key, liquid in FILLINGS.items()
            ),
        ),
        measure_outside,
        columns=3,
    ),
    Figure(
        "5.7",
        "Snell's window in the pool on an overcast day, with water and with a NIM",
        "An eye near the floor looks up. The whole sky is pressed into a disc, Snell's window; around it, in the blanket, "
        "the surface mirrors the pool. Disc and blanket are as wide with a NIM, but the parasol and the tree have changed "
        "sides: each sight line leaves the NIM on the wrong side of the vertical.",
        (
            "The window's radius, and the blanket's beginning, are the critical angle for both signs of the index.",
            "The sine in the air is n times that in the liquid, so what is seen through a NIM is turned by half a turn.",
            "Two balls in the air are seen where Snell's law puts them.",
        ),
        (
            *_pairs((), "{name}, overcast"),
            *(
                _measured(f"{key}_{part}", change, f"liquid={key}", "view=window", "waves=0", pose=STRAIGHT_UP)
                for key in LIQUIDS
                for part, change in (("sky", sky_of_directions), ("basin", basin_of_places), ("balls", two_balls))
            ),
        ),
        measure_window,
    ),
    Figure(
        "5.9",
        "The pool on a sunny day, with water and with a NIM",
        "Above the same eye, in the sun, half a degree wide; below the pool from the top. The waves gather "
        "the light into webs on floor and walls, and the blanket shows them a second time, mirrored. A NIM bends the light "
        "the other way and by five times as much, so its webs are sharp and close where water's are wide and faint.",
        (
            "The caustics on the floor are those that rays from the sun make in the same waves: in a sun so wide that the "
            "path tracer finds it by chance, and in the real one, traced from the light.",
            "The blanket mirrors the floor, each place where the waves' slopes put it.",
        ),
        (
            *_pairs(("sky=sunny", WAVES), "{name}, sunny", photons=(1 << 20, 1 << 24)),
            *(
                _shown(
                    f"{key}_top",
                    f"{name}, sunny, from the top",
                    f"liquid={key}",
                    "view=top",
                    "sky=sunny",
                    WAVES,
                    photons=(1 << 20, 1 << 24),
                )
                for key, name in LIQUIDS.items()
            ),
            *(
                _measured(f"{key}_{way}", change, *_lit(key, way), pose=STRAIGHT_DOWN, **more)
                for key in LIQUIDS
                for way, change, more in (
                    ("found", sun_on_white, {"draft": ((64, 64), 256), "seeds": 8}),
                    ("traced", traced_on_white, {"draft": ((128, 128), 16), "seeds": 4, "photons": (1 << 19, 1 << 19)}),
                )
            ),
            *(
                _measured(f"{key}_blanket", basin_of_places, f"liquid={key}", "view=window", WAVES, pose=STRAIGHT_UP)
                for key in LIQUIDS
            ),
        ),
        measure_sunny,
        columns=2,
    ),
    Figure(
        "5.10",
        "Snell's window in a NIM of high permeability: mu = -10 and -25",
        "The NIM of figure 5.7 with two other permeabilities. Index, window and blanket stay; the impedance does not, and "
        "with it the interface turns into a mirror: less of the sky comes in, the pool is darker, and the tiles of the floor "
        "show in the window.",
        (
            "The reflectance in the window is that of Fresnel's equations in impedances.",
            "The window keeps its radius: that is the index's alone.",
            "The floor is seen in the window, each place where a mirror shows it.",
        ),
        (
            *(_shown(f"mu_{mu}", f"NIM, mu = {mu}", "liquid=nim", f"mu={mu}", "view=window") for mu in PERMEABILITIES),
            *(
                _measured(
                    f"basin_{mu}", basin_of_places, "liquid=nim", f"mu={mu}", "view=window", "waves=0", pose=STRAIGHT_UP
                )
                for mu in PERMEABILITIES
            ),
        ),
        measure_permeability,
    ),
)

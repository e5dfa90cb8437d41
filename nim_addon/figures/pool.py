# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool's figures: from outside (5.3), from under water on a grey day and a sunny one (5.7, 5.9), and mu varied (5.10).

What is measured is measured on still liquid, where the mirror image and Snell's law say in closed form what each pixel
shows, and in light that carries its own origin: a sky whose colour is its direction, a basin whose colour is its place.
"""

import math

import bpy
import numpy as np

from ..caustics import lights
from ..cycles.nodes import Nodes, empty_tree
from ..physics import Interface
from ..scenes import pool, surfaces
from ..scenes.stage import Pose
from .claims import Claim
from .measure import blocks, compare, measured, misplaced
from .recipes import Figure, Recipe

# The eye of the measurements under water looks straight up; half a turn of its picture is a turn about the vertical.
EYE = (0.0, 0.35, pool.FLOOR + 0.3)
STRAIGHT_UP = Pose(EYE, (0.0, 0.351, 0.0), 108, "VERTICAL")
# A basin's place is coded as 1/2 + place / CODE, which lies between 0 and 1.
CODE = 16.0
# The suns of the measured caustics, in degrees: a wide one is found by chance often enough, the real one is traced.
SUNS = {"found": 10.0, "traced": 0.53}
# From above the floor, under the liquid, straight down.
STRAIGHT_DOWN = Pose((0.0, 0.0, -0.3), (0.0, 0.001, pool.FLOOR), 90, "VERTICAL")
# Two balls in the air, where the parasol's cloth and the tree's crown are: centre and radius.
RED_BALL, GREEN_BALL = ((2.5, 3.1, 2.3), 0.6), ((-2.0, 4.2, 3.2), 0.8)


# changes to the scene


def sky_of_directions(scene):
    """Only the liquid in a black basin, under a sky that is red by x, green by y, and 1 in blue."""
    _bare(scene)
    _paint(_thing(scene, "Basin"), _glow("Black"))
    _sky(scene, 0.5)


def basin_of_places(scene):
    """Only the liquid and its basin, which is red by x, green by y, and 1 in blue, under a black sky."""
    _bare(scene)
    _paint(_thing(scene, "Basin"), _glow("Place", place=True))
    _sky(scene, 0.0)


def two_balls(scene):
    """Only the liquid in a black basin under a black sky, and a red and a green ball in the air."""
    _bare(scene)
    _paint(_thing(scene, "Basin"), _glow("Black"))
    _sky(scene, 0.0)
    for name, (center, radius), color in (("Red", RED_BALL, (1, 0, 0)), ("Green", GREEN_BALL, (0, 1, 0))):
        vertices, faces = pool.shapes.cube_sphere(16)
        data = bpy.data.meshes.new(name)
        data.from_pydata((np.array(center) + radius * vertices).tolist(), [], faces)
        data.materials.append(_glow(name, color))
        scene.collection.objects.link(bpy.data.objects.new(name, data))


def near_wall(scene):
    """The basin glows in blue, its wall below the eye of the side view in red too; all else is black."""
    _bare(scene, ("Liquid", "Basin", "Ground"))
    basin = _thing(scene, "Basin")
    _paint(_thing(scene, "Ground"), _glow("Black"))
    _paint(basin, _glow("Basin", (0, 0, 1)))
    basin.data.materials[1] = _glow("Near wall", (1, 0, 1))
    for face in basin.data.polygons:
        face.material_index = face.center.y < -pool.HALF[1] + 1e-6
    _sky(scene, 0.0)


def sun_on_white(scene):
    """The liquid in a basin of black walls and a white floor that light leaves once, under nothing but the sun."""
    _bare(scene, ("Liquid", "Basin", "Ground"))
    basin = _thing(scene, "Basin").data
    basin.materials[0] = surfaces.plain("White", (1, 1, 1))
    basin.materials[1] = _glow("Black")
    scene.cycles.diffuse_bounces = 1
    width = math.degrees(lights.sun_of(scene).angle)
    scene.world = surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=pool.sun(width))
    scene.world.cycles.sampling_method = "NONE"  # shadow rays end at the liquid


def traced_on_white(scene):
    """The same for photons: what the floor shines with is the first time that light leaves it."""
    sun_on_white(scene)
    scene.cycles.diffuse_bounces = 0


def _bare(scene, kept=("Liquid", "Basin")):
    """Leave only the objects `kept`; without the ground the basin ends at the liquid's level, not to stand in its way."""
    measured(scene)
    for thing in list(scene.objects):
        if thing.type == "MESH" and _word(thing) not in kept:
            bpy.data.objects.remove(thing)
    if "Ground" not in kept:
        for vertex in _thing(scene, "Basin").data.vertices:
            vertex.co.z = min(vertex.co.z, pool.LEVEL)


def _word(thing):
    """An object's name, without the number that Blender appends where another scene of the file has that name too."""
    return thing.name.partition(".")[0]


def _thing(scene, name):
    return next(thing for thing in scene.objects if _word(thing) == name)


def _paint(thing, material):
    for slot in range(len(thing.data.materials)):
        thing.data.materials[slot] = material


def _glow(name, color=(0, 0, 0), place=False):
    """A material that only emits: a colour, or the place itself as _coded() has it."""

    def coded(nodes):
        return _coded(nodes, nodes.add("ShaderNodeNewGeometry").outputs["Position"], 1 / CODE)

    return surfaces.shining(name, coded if place else lambda nodes: color)


def _sky(scene, scale):
    """A black sky, or with `scale` one whose colour is its direction."""
    world = bpy.data.worlds.new("Sky")
    nodes = Nodes(empty_tree(world))
    color = (0, 0, 0)
    if scale:
        color = _coded(nodes, nodes.add("ShaderNodeTexCoord").outputs["Generated"], scale)
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": color}), "World")
    scene.world = world
    world.cycles.sampling_method = "NONE"


def _coded(nodes, vector, scale):
    """The colour (1/2 + scale x, 1/2 + scale y, 1) of a vector."""
    inputs = {0: vector, 1: (scale, scale, 0.0), 2: (0.5, 0.5, 1.0)}
    return nodes.add("ShaderNodeVectorMath", operation="MULTIPLY_ADD", inputs=inputs).outputs[0]


def _decoded(pixels, scale):
    """The (H, W, 2) x and y that _coded() put into a picture, whatever share of the light came; NaN where none did."""
    blue = pixels[..., 2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(blue > 0, (pixels[..., :2] / blue - 0.5) / scale, np.nan)


# what theory says


def window_radius(liquid):
    """The critical angle from the liquid to air, in degrees: the radius of Snell's window (thesis 2.9)."""
    return math.degrees(Interface(liquid).reversed().critical_angle())


def reflectance(liquid, camera, parts=4):
    """R (H, W) that an eye in the liquid sees in a level surface, the mean over parts x parts points of each pixel."""
    total = 0
    for x in range(parts):
        for y in range(parts):
            _, look = camera.pixel_rays(((x + 0.5) / parts, (y + 0.5) / parts))
            total = total + Interface(liquid).reversed().fresnel(np.clip(look[..., 2], 0, 1)).R
    return total / parts**2


def mirrored_place(camera):
    """The place in the basin, (H, W, 3), that an eye in the liquid sees mirrored in a level surface."""
    eye, look = camera.pixel_rays()
    start = eye + (pool.LEVEL - eye[2]) / look[..., 2:] * look
    return _wall(start, look * (1, 1, -1))


def place_below(camera, liquid):
    """The place in the basin, (H, W, 3), that an eye in the air sees through a level surface; NaN for the ground and dry
    walls. `liquid` is a Medium, or None for an empty pool."""
    eye, look = camera.pixel_rays()
    level = pool.LEVEL if liquid else 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = look[..., 2] < 0
        for z in (0.0, level):
            start = eye + (z - eye[2]) / look[..., 2:] * look
            seen &= np.all(np.abs(start[..., :2]) < pool.HALF, axis=-1)
        onward = Interface(liquid).refract(look, (0, 0, 1)) if liquid else look
        return np.where(seen[..., None], _wall(start, onward), np.nan)


class Waves:
    """The liquid's surface of PoolParameters between its vertices: heights and unit normals at x and y (N)."""

    def __init__(self, parameters):
        vertices, _, normals = pool.liquid_surface(parameters.waves, parameters.seed)
        self.x, self.y = (np.unique(vertices[:, axis].round(9)) for axis in (0, 1))
        self.values = np.column_stack([vertices[:, 2], normals]).reshape(len(self.x), len(self.y), 4)

    def at(self, x, y):
        """Heights (N) and normals (N, 3), bilinear between the vertices."""
        i = np.clip((x - self.x[0]) / (self.x[1] - self.x[0]), 0, len(self.x) - 1.001)
        j = np.clip((y - self.y[0]) / (self.y[1] - self.y[0]), 0, len(self.y) - 1.001)
        u, v = (i % 1)[..., None], (j % 1)[..., None]
        i, j = i.astype(int), j.astype(int)
        here = (1 - u) * (1 - v) * self.values[i, j] + u * (1 - v) * self.values[i + 1, j]
        here = here + (1 - u) * v * self.values[i, j + 1] + u * v * self.values[i + 1, j + 1]
        return here[..., 0], here[..., 1:] / np.linalg.norm(here[..., 1:], axis=-1, keepdims=True)

    def mirrored_place(self, camera):
        """As mirrored_place(), in waves."""
        eye, look = camera.pixel_rays()
        start = eye + (pool.LEVEL - eye[2]) / look[..., 2:] * look
        for _ in range(5):
            height, normal = self.at(start[..., 0], start[..., 1])
            start = eye + ((height - eye[2]) / look[..., 2])[..., None] * look
        onward = look - 2 * np.sum(look * normal, axis=-1, keepdims=True) * normal
        return np.where(onward[..., 2:] < 0, _wall(start, onward), np.nan)


def caustics(parameters, reach, cells, side=1400, seed=0):
    """What the sun alone brings to the middle of the floor: irradiance (cells, cells), its red channel, rows from +y.

    Divided by n^2: Cycles leaves radiance as it is at an interface, where it grows by n^2 into the liquid. It is the same
    for all that an eye in the liquid sees, sky and floor.
    Light goes from the sun through side x side points of the waves to the floor, -reach to reach.
    """
    random = np.random.default_rng(seed)
    # of the length no more than can send light there
    edge = 0.999 * np.minimum(pool.HALF, reach + 1.5)
    count = side**2
    # one at random in each square of a grid: less noise than anywhere at random
    x, y = edge[:, None] * (2 * (np.indices((side, side)).reshape(2, -1) + random.random((2, count))) / side - 1)
    height, normal = Waves(parameters).at(x, y)
    # a Gaussian of the angle, about the sun's direction
    angle = np.radians(parameters.sun_angle / 2) * np.sqrt(-np.log(1 - random.random(count)))
    turn = random.uniform(0, 2 * np.pi, count)
    level = np.cross(pool.SUN, (0, 0, 1)) / np.linalg.norm(np.cross(pool.SUN, (0, 0, 1)))
    steep = np.cross(level, pool.SUN)
    across = np.cos(turn)[:, None] * level + np.sin(turn)[:, None] * steep
    light = -(np.cos(angle)[:, None] * pool.SUN + np.sin(angle)[:, None] * across)
    cosine = np.clip(-np.sum(light * normal, axis=1), 0, 1)
    interface = Interface(parameters.liquid)
    power = pool.SUN_IRRADIANCE[0] * cosine / normal[:, 2] * interface.fresnel(cosine).T
    end = _wall(np.column_stack([x, y, height]), interface.refract(light, normal))
    landed = end[:, 2] < pool.FLOOR + 1e-9
    borders = np.linspace(-reach, reach, cells + 1)
    total, _, _ = np.histogram2d(-end[landed, 1], end[landed, 0], (borders, borders), weights=power[landed])
    return total * (4 * edge.prod() / count) / (2 * reach / cells) ** 2 / parameters.liquid.n**2


def _wall(start, direction):
    """Where rays that run downwards inside the basin meet its floor or walls."""
    low, high = np.array([-pool.HALF[0], -pool.HALF[1], pool.FLOOR]), np.array([*pool.HALF, np.inf])
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.min((np.where(direction > 0, high, low) - start) / direction, axis=-1, keepdims=True)
    return start + distance * direction


def ball_in_window(camera, liquid, center, radius):
    """Which pixels (H, W) show a ball in the air to an eye in the liquid, by rays through their middles."""
    eye, look = camera.pixel_rays()
    start = eye + (pool.LEVEL - eye[2]) / look[..., 2:] * look
    onward = Interface(liquid).refract(look, (0, 0, 1))
    away = np.array(center) - start
    along = np.sum(away * onward, axis=-1)
    with np.errstate(invalid="ignore"):
        return (along > 0) & (np.sum(away * away, axis=-1) - along**2 < radius**2)


# what the picture says


def off_vertical(camera):
    """The angle of each pixel's line of sight from the vertical, (H, W), in degrees."""
    return np.degrees(np.arccos(np.clip(camera.pixel_rays()[1][..., 2], -1, 1)))


def pixel_width(camera, angle):
    """How many degrees a pixel spans along the radius, at that angle from the axis of a camera."""
    across = camera.size[1] if camera.fit == "VERTICAL" else camera.size[0]
    return (
        math.degrees(2 * math.tan(math.radians(camera.field_of_view) / 2) / across) * math.cos(math.radians(angle)) ** 2
    )


def steepest(values, angles, width, reach=(35.0, 52.0)):
    """The angle where the mean of `values` over rings `width` wide changes fastest, in degrees."""
    edges = np.arange(*reach, width)
    count, _ = np.histogram(angles, edges)
    total, _ = np.histogram(angles, edges, weights=values)
    profile = total / count
    # half way between the two rings
    return edges[1 + np.argmax(np.abs(np.diff(profile)))]


def centroid(mask):
    """Column and row of the middle of a mask, in pixels."""
    rows, columns = np.nonzero(mask)
    return (columns + 0.5).mean(), (rows + 0.5).mean()


def coincidence(one, other, region):
    """The correlation of two pictures (H, W) within a region (H, W)."""
    return float(np.corrcoef(one[region], other[region])[0, 1])


def slope(values, against):
    """The slope of the straight line that fits `values` best."""
    return float(np.polyfit(np.ravel(against), np.ravel(values), 1)[0])


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


def measure_window(images):
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
        direction = _decoded(sky.pixels, 0.5)
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
        claims.append(Claim(text, 1.0, coincidence(water.pixels[..., channel], turned, inside), 0.02))
    return claims


def measure_permeability(images):
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
        distance = _distance(_decoded(image.pixels, 1 / CODE), place, window)
        claims.append(Claim(text, 0.0, distance, _footprint(place, window) / 4, "m"))
    return claims


def measure_outside(images):
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
        found = _decoded(top.pixels, 1 / CODE)
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


def measure_sunny(images):
    """The claims of figure 5.9."""
    return [claim for key, name in LIQUIDS.items() for claim in _sunny_claims(key, name, images)]


def _sunny_claims(key, name, images):
    claims = []
    for way, width in SUNS.items():
        floor = images[f"{key}_{way}"]
        wanted = np.stack([caustics(floor.parameters, REACH, CELLS, seed=seed) for seed in range(4)])
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
    distance = _distance(_decoded(basin.pixels, 1 / CODE), place, blanket)
    # all light of the blanket goes one way, so less is left to chance than in the window
    return [*claims, Claim(text, 0.0, distance, _footprint(place, blanket) / 10, "m")]


def on_floor(pixels, camera, reach, cells):
    """The irradiance of the middle of the white floor in sun_on_white() pixels: (cells, cells), red, rows from +y."""
    (left, top), (right, bottom) = camera.pixels_of([(-reach, reach, pool.FLOOR), (reach, -reach, pool.FLOOR)]).round()
    square = pixels[int(top) : int(bottom), int(left) : int(right), :1]
    return math.pi * blocks(square, len(square) // cells)[:cells, :cells, 0]


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

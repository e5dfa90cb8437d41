# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 5.1, 5.2 and 5.5: a straw in a glass, from the side and from above, and three statues around the glass.

The renders that are measured show things that shine and nothing else. What they must show is traced in numpy through the
glass as cylinders and discs, without its rounded edges: the claims stay clear of those.
"""

import math
from dataclasses import dataclass

import bpy
import numpy as np

from ..cycles.casting import Faces
from ..cycles.meshes import triangles, vertices
from ..physics import MEDIA, Interface
from ..physics.rays import Cylinder, Plane, Shapes
from ..physics.reference_image import picture
from ..scenes import glass as scene_of
from ..scenes import shapes as meshes
from ..scenes import surfaces
from ..scenes.stage import Pose
from .claims import Claim
from .measure import compare, measured
from .recipes import Figure, Recipe

AIR, GLASS = MEDIA["air"], MEDIA["glass"]
LIQUIDS = ("none", "water", "nim")
NAMES = {"none": "empty", "water": "water", "nim": "NIM"}

# heights of the glass as it stands on the table
FOOT, BASE, LEVEL, RIM = (scene_of.GAP + z for z in (0, scene_of.BASE, scene_of.LEVEL, scene_of.HEIGHT))
RADIUS, INNER = scene_of.RADIUS, scene_of.RADIUS - scene_of.WALL

# A disc that lies on the bottom, inside the rounded corner, and tells whether the bottom is seen.
MARK_RADIUS, MARK = INNER - scene_of.INNER_EDGE, BASE + scene_of.GAP

# From where the scene's own cameras stand, but nearer to what matters.
SIDE = Pose(scene_of.pose(scene_of.GlassParameters(view="side")).eye, (0, 0, 0.053), 7, "VERTICAL")
TOP = Pose(scene_of.pose(scene_of.GlassParameters(view="top")).eye, (0, 0, 0.065), 9, "VERTICAL")
BEHIND = Pose(SIDE.eye, (0, 0, 0.050), 3.5, "VERTICAL")
ZOOM = Pose(TOP.eye, (0.012, 0.013, 0.065), 6.6, "VERTICAL")

# Pictures of one thing whose scatter decides how near render and prediction must come: of different noise, and traced by
# other rays, GRID x GRID in a pixel in all, a power of two each way.
SEEDS, GRID = 8, 4
# The relative gap between a facet and the circle: a length in the render may be off by it.
FACET = 1 - math.cos(math.pi / scene_of.SEGMENTS)
# Energy of the faintest branch that is traced. The many fainter than 0.03 bring a statue's light a tenth of what lies
# outside its image; those fainter than this, a hundredth.
LEAST = 0.003
PROBE = ((96, 96), 8)

# Radius of the part of the table that is painted where its magnification is measured.
PAINTED = 0.060

# Of the straw, metres from its foot: a piece near the bottom, and one near the surface of the liquid.
PIECES = {"near the bottom": (0.014, 0.034), "near the surface": (0.055, 0.075)}


# ------------------------------------------------------------------------------------------------ changes to the scene


def _only(scene, *names):
    """Hide all meshes but the glass and those named, and put out the sky."""
    measured(scene)
    scene.world = None
    for thing in scene.objects:
        thing.hide_render = thing.type == "MESH" and thing.name not in ("Glass", *names)


def _direct(scene):
    """Let nothing be seen by reflection: thousands of faint mirror images shift a mean that is to hold three digits."""
    scene.cycles.glossy_bounces = 0
    for thing in scene.objects:
        thing.visible_glossy = False


def _glow(name, paint):
    """A material that shines with `paint(x, y, z)`, RGB of numbers or outputs, of the object's own coordinates."""

    def color(nodes):
        place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
        x, y, z = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs
        return nodes.add("ShaderNodeCombineXYZ", inputs=dict(enumerate(paint(nodes, x, y, z)))).outputs[0]

    return surfaces.shining(name, color)


def painted_side(scene):
    """The straw shines red, a disc on the bottom green; the surface of the liquid is opaque and shines blue."""
    _only(scene, "Straw")
    scene.objects["Straw"].data.materials[0] = _glow("Red", lambda nodes, x, y, z: (1, 0, 0))
    glass = scene.objects["Glass"]
    if len(glass.data.materials) == 3:
        glass.data.materials[2] = _glow("Blue", lambda nodes, x, y, z: (0, 0, 1))
    vertices, faces, _ = meshes.revolve([(MARK_RADIUS, 0), (0, 0)], 128)
    disc = bpy.data.meshes.new("Mark")
    disc.from_pydata(vertices.tolist(), [], faces)
    disc.materials.append(_glow("Green", lambda nodes, x, y, z: (0, 1, 0)))
    mark = bpy.data.objects.new("Mark", disc)
    mark.location = (0, 0, MARK)
    scene.collection.objects.link(mark)


def painted_straw(scene):
    """The straw shines red and, the further from its foot, the more green."""
    _only(scene, "Straw")

    def paint(nodes, x, y, z):
        return 1, nodes.math("DIVIDE", z, scene_of.STRAW_LENGTH), 0

    scene.objects["Straw"].data.materials[0] = _glow("Length", paint)


def painted_table(scene):
    """The table near the glass shines with its own coordinates: red grows along x, green along y, blue is 1."""
    _only(scene, "Table")
    _direct(scene)

    def paint(nodes, x, y, z):
        # what is far away is seen by reflection only, and would be nothing but noise
        square = nodes.math("ADD", nodes.math("MULTIPLY", x, x), nodes.math("MULTIPLY", y, y))
        near = nodes.math("LESS_THAN", square, PAINTED**2)

        def coordinate(value):
            return nodes.math("MULTIPLY", nodes.math("ADD", nodes.math("DIVIDE", value, 2 * PAINTED), 0.5), near)

        return coordinate(x), coordinate(y), near

    scene.objects["Table"].data.materials[0] = _glow("Place", paint)


def painted_statues(scene):
    """Each statue shines in the colour of its name."""
    _only(scene, "Red", "Green", "Blue")
    for axis, name in enumerate(("Red", "Green", "Blue")):
        thing = scene.objects[name]
        thing.modifiers.clear()  # the mesh that the prediction traces
        thing.material_slots[0].material = _glow(name, lambda nodes, x, y, z, axis=axis: np.eye(3)[axis].tolist())


def painted_green(scene):
    """The green statue alone: red is where it shines, green grows from its left to its right, blue upwards."""
    _only(scene, "Green")
    _direct(scene)
    thing = scene.objects["Green"]
    thing.modifiers.clear()

    def paint(nodes, x, y, z):
        # its own axes are turned against the scene's
        across = nodes.math(
            "SUBTRACT",
            nodes.math("MULTIPLY", x, math.cos(thing.rotation_euler.z)),
            nodes.math("MULTIPLY", y, math.sin(thing.rotation_euler.z)),
        )
        high = nodes.math("DIVIDE", z, 2 * scene_of.STATUE_SIZE)
        return 1, nodes.math("ADD", nodes.math("DIVIDE", across, 2 * scene_of.STATUE_SIZE), 0.5), high

    thing.material_slots[0].material = _glow("Across", paint)


# ------------------------------------------------------------------------------------------------ the same, without Cycles


@dataclass(frozen=True)
class Disc:
    """A flat ring about `center` between the radii `hole` and `radius`; opaque where `interface` is None."""

    center: tuple
    normal: tuple
    radius: float
    interface: Interface | None = None
    hole: float = 0.0

    def meet(self, origins, directions):
        """As rays.Sphere.meet."""
        distance, normals = Plane(self.center, self.normal).meet(origins, directions)
        at = origins + np.where(np.isfinite(distance), distance, 0)[:, None] * directions
        away = np.linalg.norm(at - np.asarray(self.center, float), axis=1)
        return np.where((away <= self.radius) & (away >= self.hole), distance, np.inf), normals


def vessel(filling, opaque_surface=False):
    """Shapes of the glass and the liquid (a Medium, or None) in it, their edges sharp; a list."""
    liquid = filling or AIR
    up, down = (0, 0, 1), (0, 0, -1)

    def wall(low, high, radius, inside, outside):
        return Cylinder((0, 0, low), (0, 0, high), radius, Interface(inside, outside))

    made = [
        wall(FOOT, RIM, RADIUS, GLASS, AIR),
        wall(BASE, LEVEL, INNER, liquid, GLASS),
        wall(LEVEL, RIM, INNER, AIR, GLASS),
        Disc((0, 0, FOOT), down, RADIUS, Interface(GLASS, AIR)),
        Disc((0, 0, BASE), up, INNER, Interface(GLASS, liquid)),
        Disc((0, 0, RIM), up, RADIUS, Interface(GLASS, AIR), INNER),
    ]
    if filling is not None:
        made.append(Disc((0, 0, LEVEL), up, INNER, None if opaque_surface else Interface(filling, AIR)))
    return made


def _straw_axis():
    """The lower end of the straw's axis and the unit vector along it, (3,) each."""
    start, tilt = scene_of.straw_pose()
    return start, np.array([-math.sin(tilt), 0, math.cos(tilt)])


def straw():
    """The straw as a shape."""
    start, axis = _straw_axis()
    return Cylinder(tuple(start), tuple(start + scene_of.STRAW_LENGTH * axis), scene_of.STRAW_RADIUS)


def _along_straw(points):
    """How far points (N, 3) lie along the straw (N,), and whether they are on it."""
    start, axis = _straw_axis()
    along = (points - start) @ axis
    across = np.linalg.norm(points - start - along[:, None] * axis, axis=1)
    return along, np.abs(across - scene_of.STRAW_RADIUS) < 1e-6


def _traced(image, things, light, opaque_surface=False, branches=True):
    """Pictures (GRID, H, W, 3) like a measured Image's, where `light(ends)` (N, 3) shines from what rays land on.

    branches: whether to follow what is reflected too
    """

    def radiance(ends, directions, landed):
        return np.where(landed[:, None], light(ends), 0)

    traced, made = Shapes(*vessel(image.parameters.liquid, opaque_surface), *things), 0
    for row in range(GRID):
        # each picture has one ray in every row and one in every column, so their middle is the pixel's
        offsets = [((column + 0.5) / GRID, (row + 0.5) / GRID) for column in np.arange(GRID) ^ row]
        directions = np.stack([image.camera.pixel_rays(offset)[1] for offset in offsets])
        seen = picture(
            traced, radiance, image.camera.eye, directions.reshape(-1, 3), bounces=8, least=LEAST, branches=branches
        )
        made = made + seen.reshape(directions.shape) / GRID
    return made


def traced_side(image):
    """What painted_side() must show."""

    def light(ends):
        on_straw = _along_straw(ends)[1]
        low = np.abs(ends[:, 2] - MARK) < 1e-9
        return np.stack([on_straw, low & ~on_straw, ~low & ~on_straw], axis=-1).astype(float)

    return _traced(image, [straw(), Disc((0, 0, MARK), (0, 0, 1), MARK_RADIUS)], light, opaque_surface=True)


def traced_straw(image):
    """What painted_straw() must show."""

    def light(ends):
        along = _along_straw(ends)[0] / scene_of.STRAW_LENGTH
        return np.stack([np.ones(len(ends)), along, np.zeros(len(ends))], axis=-1)

    return _traced(image, [straw()], light)


def traced_table(image):
    """What painted_table() must show."""

    def light(ends):
        x, y = ends[:, :2].T / (2 * PAINTED) + 0.5
        near = np.linalg.norm(ends[:, :2], axis=1) < PAINTED
        return np.stack([x, y, np.ones(len(ends))], axis=-1) * near[:, None]

    return _traced(image, [Disc((0, 0, 0), (0, 0, 1), scene_of.TABLE_RADIUS)], light, branches=False)


def _solids(names):
    """The statues of those names as opaque shapes."""
    mesh = scene_of.statue_mesh("monkey")
    # a bent quad is two triangles, and the way it is cut shows
    points, faces = vertices(mesh).astype(float), triangles(mesh).tolist()
    bpy.data.meshes.remove(mesh)
    made = []
    for name in names:
        place, turn, _ = scene_of.STATUES[name]
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        made.append(Faces(points @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)]) + place, faces))
    return made


def traced_statues(image):
    """What painted_statues() must show."""

    def light(ends):
        behind, left = ends[:, 1] > 0, ends[:, 0] < 0
        return np.stack([~behind & left, behind, ~behind & ~left], axis=-1).astype(float)

    return _traced(image, _solids(["Red", "Green", "Blue"]), light)


def traced_green(image):
    """What painted_green() must show."""

    def light(ends):
        across = (ends[:, 0] - scene_of.STATUES["Green"][0][0]) / (2 * scene_of.STATUE_SIZE) + 0.5
        return np.stack([np.ones(len(ends)), across, ends[:, 2] / (2 * scene_of.STATUE_SIZE)], axis=-1)

    return _traced(image, _solids(["Green"]), light, branches=False)


# ------------------------------------------------------------------------------------------------ what is read off


def _met(camera, point, normal):
    """Where each pixel's ray meets a plane, (H, W, 3)."""
    eye, directions = camera.pixel_rays()
    distance = np.dot(np.subtract(point, eye), normal) / (directions @ np.asarray(normal, float))
    return eye + distance[..., None] * directions


def _wall(camera, low, high, width):
    """Mask (H, W) of the rays that meet the front of the glass between two heights, |x| below `width` radii."""
    eye, directions = camera.pixel_rays()
    distance, _ = Cylinder((0, 0, low), (0, 0, high), RADIUS).meet(
        np.broadcast_to(eye, directions.shape).reshape(-1, 3), directions.reshape(-1, 3)
    )
    distance = distance.reshape(directions.shape[:2])
    met = np.isfinite(distance)
    at = eye + np.where(met, distance, 0)[..., None] * directions
    return met & (at[..., 1] < 0) & (np.abs(at[..., 0]) < width * RADIUS)


def _solid(values):
    """1 where the direct image is, 0 where only reflections are, for values that noise and edges blur."""
    return np.clip((values - 0.35) / 0.3, 0, 1)


def _scale(camera, point):
    """Millimetres that a pixel covers at a point."""
    left, right = camera.pixels_of(np.add(point, [(-0.005, 0, 0), (0.005, 0, 0)]))
    return 10 / (right[0] - left[0])


def straw_columns(pixels, camera):
    """The column of the straw in each row that shows it through the liquid, 12 to 24 mm below the level: (H,), else NaN."""
    seen = np.where(_wall(camera, LEVEL - 0.028, LEVEL - 0.008, 0.9), _solid(pixels[..., 0]), 0)
    top, bottom = camera.pixels_of([(0, -RADIUS, LEVEL - 0.012), (0, -RADIUS, LEVEL - 0.024)])[:, 1]
    rows = np.arange(len(seen)) + 0.5
    with np.errstate(invalid="ignore", divide="ignore"):
        columns = seen @ (np.arange(seen.shape[1]) + 0.5) / seen.sum(axis=1)
    return np.where((rows > top) & (rows < bottom), columns, np.nan)


def bottom_share(pixels, camera):
    """Share of the liquid's wall, clear of its lower corner, through which the mark on the bottom is seen."""
    window = _wall(camera, BASE + scene_of.INNER_EDGE + 0.0015, LEVEL - 0.002, 0.6)
    return float(_solid(pixels[..., 1])[window].mean())


def lip_depth(pixels, camera, x):
    """Millimetres below the level, on the front of the glass, down to which the liquid's surface is seen at x (radii)."""
    y = -math.sqrt(1 - x * x) * RADIUS
    column, top = camera.pixels_of((x * RADIUS, y, LEVEL))
    bottom = camera.pixels_of((x * RADIUS, y, LEVEL - 0.025))[1]
    columns = np.abs(np.arange(pixels.shape[1]) + 0.5 - column) < 4
    rows = np.arange(len(pixels))
    # a row that the level cuts counts with the part below
    weight = np.clip(rows + 1 - top, 0, 1) * np.clip(bottom - rows, 0, 1)
    return float(weight @ _solid(pixels[:, columns, 2]).mean(axis=1)) * 25 / (bottom - top)


def _opening(camera):
    """Mask (H, W) of the rays that come through the mouth of the glass to the level of the liquid."""
    masks = []
    for height, radius in ((RIM, INNER - 0.001), (LEVEL, INNER - 0.001)):
        masks.append(np.linalg.norm(_met(camera, (0, 0, height), (0, 0, 1))[..., :2], axis=-1) < radius)
    return masks[0] & masks[1]


def piece_area(pixels, camera, piece):
    """Pixels that show the piece of the straw between two distances from its foot, through the mouth of the glass."""
    with np.errstate(invalid="ignore", divide="ignore"):
        along = pixels[..., 1] / pixels[..., 0] * scene_of.STRAW_LENGTH
    seen = _solid(pixels[..., 0]) * (_opening(camera) & (along > piece[0]) & (along < piece[1]))
    return float(seen.sum())


def _gradients(values, weights):
    """Slopes (2,) of values (H, W) along columns and rows, by weighted least squares."""
    rows, columns = np.indices(values.shape)
    chosen = weights > 0
    root = np.sqrt(weights[chosen])[:, None]
    table = np.stack([np.ones(chosen.sum()), columns[chosen], rows[chosen]], axis=-1)
    return np.linalg.lstsq(table * root, values[chosen] * root[:, 0], rcond=None)[0][1:]


def table_magnification(pixels, camera, liquid):
    """How much wider and how much deeper (2,) the table appears through the liquid than with no glass there."""
    directions = camera.pixel_rays()[1]
    level, up = _met(camera, (0, 0, LEVEL), (0, 0, 1)), (0, 0, 1)
    down = Interface(liquid, AIR).refract(directions, up)
    bottom = level + ((BASE - LEVEL) / down[..., 2])[..., None] * down
    # in by the mouth, and out by the flat part of the bottom
    flat = np.linalg.norm(bottom[..., :2], axis=-1) < 0.8 * MARK_RADIUS
    middle = np.linalg.norm(level[..., :2], axis=-1) < 0.8 * MARK_RADIUS
    weights = (flat & middle & _opening(camera)).astype(float)
    bare = _met(camera, (0, 0, 0), up)
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = [2 * PAINTED * pixels[..., axis] / pixels[..., 2] for axis in (0, 1)]
    return np.array([_gradients(bare[..., k], weights)[k] / _gradients(seen[k], weights)[k] for k in (0, 1)])


def statue_magnification(pixels, camera):
    """How much wider and how much higher (2,) the green statue appears in the middle of the liquid; negative: flipped."""
    window = _wall(camera, 0.022, LEVEL - 0.004, 0.6)
    weights = np.where(window & (pixels[..., 0] > 0.35), pixels[..., 0], 0)
    place = scene_of.STATUES["Green"][0]
    bare = _met(camera, place, (0, 1, 0))
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = [2 * scene_of.STATUE_SIZE * pixels[..., axis] / pixels[..., 0] for axis in (1, 2)]
    return np.array(
        [_gradients(bare[..., axis], weights)[k] / _gradients(seen[k], weights)[k] for k, axis in ((0, 0), (1, 2))]
    )


def light_shares(pixels, camera, channel):
    """Shares of a statue's light in the liquid: from its right half, and from further out than half its radius."""
    low, high = 0.022, LEVEL - 0.004
    light = np.where(_wall(camera, low, high, 1), pixels[..., channel], 0)
    right = np.arange(light.shape[1]) + 0.5 > camera.pixels_of((0, -RADIUS, low))[0]
    return float(light[:, right].sum() / light.sum()), float(
        1 - light[_wall(camera, low, high, 0.5)].sum() / light.sum()
    )


def _claim(text, predicted, measured, allowed, unit=""):
    return Claim(text, predicted, measured, allowed + FACET * abs(predicted), unit)


def measure_side(images):
    """The claims of figure 5.1."""
    claims = []
    empty = images["side_none"]
    camera, traced_empty = empty.camera, traced_side(empty)
    scale = _scale(camera, (0, 0, LEVEL))

    def straw_break(filled, bare):
        return scale * np.nanmean(straw_columns(filled, camera) - straw_columns(bare, camera))

    for liquid in LIQUIDS:
        image = images[f"side_{liquid}"]
        traced = traced_empty if liquid == "none" else traced_side(image)
        pair = (traced,), (image.each,)
        if liquid != "none":
            shift = compare(straw_break, (traced, traced_empty), (image.each, empty.each))
            claims.append(
                _claim(f"{NAMES[liquid]}: the straw breaks to the right by (left where negative)", *shift, "mm")
            )
        share = compare(lambda pixels: bottom_share(pixels, camera), *pair)
        text = f"{NAMES[liquid]}: share of the side of the glass, up to the level, that shows the bottom"
        claims.append(_claim(text, *share))
        if liquid != "none":
            for x in (0.0, 0.6):
                depth = compare(lambda pixels, x=x: lip_depth(pixels, camera, x), *pair)
                place = f"{x:g} radii off" if x else "in the middle"
                text = f"{NAMES[liquid]}: depth of the lip, the surface seen from below, {place}"
                claims.append(_claim(text, *depth, "mm"))
    return claims


def measure_table(images):
    """Those claims of figure 5.2 that are on the table: they hold the third digit of the index."""
    claims = []
    for liquid in LIQUIDS[1:]:
        image = images[f"table_{liquid}"]

        def magnification(pixels, image=image):
            return table_magnification(pixels, image.camera, image.parameters.liquid)

        larger = compare(magnification, (traced_table(image),), (image.each,))
        for way, numbers in zip(("wider", "deeper"), larger, strict=True):
            claims.append(
                _claim(f"{NAMES[liquid]}: the table under the glass appears {way} than it is, times", *numbers)
            )
    return claims


def measure_top(images):
    """The claims of figure 5.2."""
    nim, water = (images[f"straw_{liquid}"] for liquid in ("nim", "water"))

    def ratios(in_nim, in_water):
        low, high = (
            piece_area(in_nim, nim.camera, piece) / piece_area(in_water, water.camera, piece)
            for piece in PIECES.values()
        )
        return low, high, low / high

    larger = compare(ratios, (traced_straw(nim), traced_straw(water)), (nim.each, water.each))
    texts = [f"the straw {name}: its area in the NIM, times that in water" for name in PIECES]
    texts.append("the straw is larger the deeper it is: those two, one by the other")
    straw_claims = [_claim(text, *numbers) for text, numbers in zip(texts, larger, strict=True)]
    return straw_claims + measure_table(images)


def measure_statues(images):
    """The claims of figure 5.5."""
    claims = []
    image = images["statues_nim"]
    traced = traced_statues(image)
    for channel, name in ((0, "red, in front on the left"), (2, "blue, in front on the right"), (1, "green, behind")):

        def shares(pixels, channel=channel):
            return light_shares(pixels, image.camera, channel)

        right, off = compare(shares, (traced,), (image.each,))
        start = f"NIM: share of the light of the {name},"
        claims.append(_claim(f"{start} that comes from further out than half the radius", *off))
        claims.append(_claim(f"{start} that comes from the right half", *right))
    for liquid in LIQUIDS[1:]:
        image = images[f"green_{liquid}"]

        def magnification(pixels, camera=image.camera):
            return statue_magnification(pixels, camera)

        larger = compare(magnification, (traced_green(image),), (image.each,))
        for way, numbers in zip(("width", "height"), larger, strict=True):
            text = f"{NAMES[liquid]}: {way} of the green statue in the middle, negative where flipped, times its own"
            claims.append(_claim(text, *numbers))
    return claims


# ------------------------------------------------------------------------------------------------ the figures


def _shown(name, settings, captions, pose=None):
    return tuple(
        Recipe(
            f"{name}_{liquid}",
            "glass",
            (f"liquid={liquid}", *settings),
            draft=((240, 240), 32),
            final=((800, 800), 48),
            pose=pose,
            caption=captions.format(NAMES[liquid]),
        )
        for liquid in LIQUIDS
    )


def _probe(name, settings, change, pose, liquids, draft=PROBE):
    return tuple(
        Recipe(
            f"{name}_{liquid}",
            "glass",
            (f"liquid={liquid}", *settings),
            draft=draft,
            change=change,
            pose=pose,
            seeds=SEEDS,
            shown=False,
        )
        for liquid in liquids
    )


_BOTH = LIQUIDS[1:]
_STATUES = ("figures=monkey", "straw=off")

FIGURES = (
    Figure(
        "5.1",
        "A straw in a glass, from the side",
        "Empty, with water, and with a NIM of index -1.33. Below the level, water shows the straw further to the left, the "
        "NIM on the other side of the glass. What comes in through the wall runs upwards in the NIM: it hides the bottom "
        "of the glass, and shows the liquid's surface from below, as a lip.",
        (
            "The straw breaks to the left in water and to the right in the NIM, each by the predicted amount.",
            "The NIM hides the bottom of the glass.",
            "The underside of the NIM's surface is seen through the side of the glass, as a lip that is deepest in its middle.",
        ),
        _shown("glass", (), "{}") + _probe("side", (), painted_side, SIDE, LIQUIDS),
        measure_side,
    ),
    Figure(
        "5.2",
        "A straw in a glass, from above",
        "Empty, with water, and with a NIM of index -1.33; below, the same from the same place, closer. In the NIM the "
        "straw turns at the level to the other side and grows towards its foot; the board under the glass is larger too.",
        (
            "The straw is larger in the NIM than in water, the more so the deeper, by the predicted ratio.",
            "The table under the glass is magnified as predicted, more through the NIM than through water.",
        ),
        _shown("glass", ("view=top",), "{}")
        + _shown("zoom", ("view=top",), "{}, closer", ZOOM)
        + _probe("straw", ("view=top",), painted_straw, TOP, _BOTH, ((144, 144), 8))
        + _probe("table", ("view=top", "straw=off"), painted_table, TOP, _BOTH),
        measure_top,
        columns=3,
    ),
    Figure(
        "5.5",
        "Three statues and a glass",
        "With water and with a NIM of index -1.33. The green statue stands behind the glass, the red and the blue one "
        "before it. The sides of the NIM show the two in front; its middle shows the one behind, narrow and turned round.",
        (
            "The red and the blue statue, in front, appear in the sides of the NIM.",
            "The green statue, behind, appears in its middle.",
            "It is flipped from left to right there, not upside down.",
        ),
        _shown("glass", _STATUES, "{}")[1:]
        + _probe("statues", _STATUES, painted_statues, SIDE, ("nim",))
        + _probe("green", _STATUES, painted_green, BEHIND, _BOTH),
        measure_statues,
    ),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pictures of the glass must show, traced in numpy, and what is read off them, traced and rendered alike.

The glass is traced as cylinders and discs, without its rounded edges: what is read off stays clear of those.
"""

import math
from dataclasses import dataclass

import bpy
import numpy as np

from ..cycles.casting import Faces
from ..cycles.meshes import triangles, vertices
from ..physics import MEDIA, Interface, Medium
from ..physics.rays import Cylinder, Plane, Shapes
from ..physics.reference_image import picture
from ..scenes import glass as scene_of
from .measure import Camera
from .recipes import Image

AIR, GLASS = MEDIA["air"], MEDIA["glass"]

# heights of the glass as it stands on the table
FOOT, BASE, LEVEL, RIM = (scene_of.GAP + z for z in (0, scene_of.BASE, scene_of.LEVEL, scene_of.HEIGHT))
RADIUS, INNER = scene_of.RADIUS, scene_of.RADIUS - scene_of.WALL

# A disc that lies on the bottom, inside the rounded corner, and tells whether the bottom is seen.
MARK_RADIUS, MARK_HEIGHT = INNER - scene_of.INNER_EDGE, BASE + scene_of.GAP
# Radius of the part of the table that is painted where its magnification is measured.
PAINTED = 0.060

# Rays in a pixel: GRID pictures of GRID rays each, a power of two.
GRID = 4
# Energy of the faintest branch that is traced. The many fainter than 0.03 bring a statue's light a tenth of what lies
# outside its image; those fainter than this, a hundredth.
FAINTEST = 0.003


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


def vessel(filling: Medium | None, opaque_surface: bool = False) -> list:
    """Shapes of the glass and the liquid (a Medium, or None) in it, their edges sharp; a list."""
    liquid = filling or AIR
    up, down = (0, 0, 1), (0, 0, -1)

    def wall(low, high, radius, inside, outside):
        return Cylinder((0, 0, low), (0, 0, high), radius, Interface(inside, outside))

    shapes = [
        wall(FOOT, RIM, RADIUS, GLASS, AIR),
        wall(BASE, LEVEL, INNER, liquid, GLASS),
        wall(LEVEL, RIM, INNER, AIR, GLASS),
        Disc((0, 0, FOOT), down, RADIUS, Interface(GLASS, AIR)),
        Disc((0, 0, BASE), up, INNER, Interface(GLASS, liquid)),
        Disc((0, 0, RIM), up, RADIUS, Interface(GLASS, AIR), INNER),
    ]
    if filling is not None:
        shapes.append(Disc((0, 0, LEVEL), up, INNER, None if opaque_surface else Interface(filling, AIR)))
    return shapes


def _straw_axis():
    """The lower end of the straw's axis and the unit vector along it, (3,) each."""
    start, tilt = scene_of.straw_pose()
    return start, np.array([-math.sin(tilt), 0, math.cos(tilt)])


def straw() -> Cylinder:
    """The straw as a shape."""
    start, axis = _straw_axis()
    return Cylinder(tuple(start), tuple(start + scene_of.STRAW_LENGTH * axis), scene_of.STRAW_RADIUS)


def _along_straw(points):
    """How far points (N, 3) lie along the straw (N,), and whether they are on it."""
    start, axis = _straw_axis()
    along = (points - start) @ axis
    across = np.linalg.norm(points - start - along[:, None] * axis, axis=1)
    return along, np.abs(across - scene_of.STRAW_RADIUS) < 1e-6


def _traced(image, opaque, light, opaque_surface=False, branches=True):
    """Pictures (GRID, H, W, 3) like a measured Image's, of the glass and `opaque` shapes: `light(ends)` (N, 3) shines from what
    rays land on.

    branches: whether to follow what is reflected too
    """

    def radiance(ends, directions, landed):
        return np.where(landed[:, None], light(ends), 0)

    shapes = Shapes(*vessel(image.parameters.liquid, opaque_surface), *opaque)
    pictures = 0
    for row in range(GRID):
        # each picture has one ray in every row and one in every column, so their middle is the pixel's
        offsets = [((column + 0.5) / GRID, (row + 0.5) / GRID) for column in np.arange(GRID) ^ row]
        directions = np.stack([image.camera.pixel_rays(offset)[1] for offset in offsets])
        seen = picture(
            shapes, radiance, image.camera.eye, directions.reshape(-1, 3), bounces=8, least=FAINTEST, branches=branches
        )
        pictures = pictures + seen.reshape(directions.shape) / GRID
    return pictures


def traced_side(image: Image) -> np.ndarray:
    """What painted_side() must show."""

    def light(ends):
        on_straw = _along_straw(ends)[1]
        low = np.abs(ends[:, 2] - MARK_HEIGHT) < 1e-9
        return np.stack([on_straw, low & ~on_straw, ~low & ~on_straw], axis=-1).astype(float)

    return _traced(image, [straw(), Disc((0, 0, MARK_HEIGHT), (0, 0, 1), MARK_RADIUS)], light, opaque_surface=True)


def traced_straw(image: Image) -> np.ndarray:
    """What painted_straw() must show."""

    def light(ends):
        along = _along_straw(ends)[0] / scene_of.STRAW_LENGTH
        return np.stack([np.ones(len(ends)), along, np.zeros(len(ends))], axis=-1)

    return _traced(image, [straw()], light)


def traced_table(image: Image) -> np.ndarray:
    """What painted_table() must show."""

    def light(ends):
        x, y = ends[:, :2].T / (2 * PAINTED) + 0.5
        near = np.linalg.norm(ends[:, :2], axis=1) < PAINTED
        return np.stack([x, y, np.ones(len(ends))], axis=-1) * near[:, None]

    return _traced(image, [Disc((0, 0, 0), (0, 0, 1), scene_of.TABLE_RADIUS)], light, branches=False)


def _statues(names):
    """The statues of those names as opaque shapes."""
    mesh = scene_of.statue_mesh("monkey")
    # a bent quad is two triangles, and the way it is cut shows
    points, faces = vertices(mesh).astype(float), triangles(mesh).tolist()
    bpy.data.meshes.remove(mesh)
    statues = []
    for name in names:
        place, turn, _ = scene_of.STATUES[name]
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        statues.append(Faces(points @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)]) + place, faces))
    return statues


def traced_statues(image: Image) -> np.ndarray:
    """What painted_statues() must show."""

    def light(ends):
        behind, left = ends[:, 1] > 0, ends[:, 0] < 0
        return np.stack([~behind & left, behind, ~behind & ~left], axis=-1).astype(float)

    return _traced(image, _statues(["Red", "Green", "Blue"]), light)


def traced_green(image: Image) -> np.ndarray:
    """What painted_green() must show."""

    def light(ends):
        across = (ends[:, 0] - scene_of.STATUES["Green"][0][0]) / (2 * scene_of.STATUE_SIZE) + 0.5
        return np.stack([np.ones(len(ends)), across, ends[:, 2] / (2 * scene_of.STATUE_SIZE)], axis=-1)

    return _traced(image, _statues(["Green"]), light, branches=False)


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


def millimetres(camera: Camera, point: tuple) -> float:
    """Millimetres that a pixel covers at a point."""
    left, right = camera.pixels_of(np.add(point, [(-0.005, 0, 0), (0.005, 0, 0)]))
    return 10 / (right[0] - left[0])


def straw_columns(pixels: np.ndarray, camera: Camera) -> np.ndarray:
    """The column of the straw in each row that shows it through the liquid, 12 to 24 mm below the level: (H,), else NaN."""
    seen = np.where(_wall(camera, LEVEL - 0.028, LEVEL - 0.008, 0.9), _solid(pixels[..., 0]), 0)
    top, bottom = camera.pixels_of([(0, -RADIUS, LEVEL - 0.012), (0, -RADIUS, LEVEL - 0.024)])[:, 1]
    rows = np.arange(len(seen)) + 0.5
    with np.errstate(invalid="ignore", divide="ignore"):
        columns = seen @ (np.arange(seen.shape[1]) + 0.5) / seen.sum(axis=1)
    return np.where((rows > top) & (rows < bottom), columns, np.nan)


def bottom_share(pixels: np.ndarray, camera: Camera) -> float:
    """Share of the liquid's wall, clear of its lower corner, through which the mark on the bottom is seen."""
    window = _wall(camera, BASE + scene_of.INNER_EDGE + 0.0015, LEVEL - 0.002, 0.6)
    return float(_solid(pixels[..., 1])[window].mean())


def lip_depth(pixels: np.ndarray, camera: Camera, x: float) -> float:
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


def piece_area(pixels: np.ndarray, camera: Camera, piece: tuple[float, float]) -> float:
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


def table_magnification(pixels: np.ndarray, camera: Camera, liquid: Medium) -> np.ndarray:
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


def statue_magnification(pixels: np.ndarray, camera: Camera) -> np.ndarray:
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


def light_shares(pixels: np.ndarray, camera: Camera, channel: int) -> tuple[float, float]:
    """Shares of a statue's light in the liquid: from its right half, and from further out than half its radius."""
    low, high = 0.022, LEVEL - 0.004
    light = np.where(_wall(camera, low, high, 1), pixels[..., channel], 0)
    right = np.arange(light.shape[1]) + 0.5 > camera.pixels_of((0, -RADIUS, low))[0]
    return float(light[:, right].sum() / light.sum()), float(
        1 - light[_wall(camera, low, high, 0.5)].sum() / light.sum()
    )

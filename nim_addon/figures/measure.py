# SPDX-License-Identifier: GPL-3.0-or-later
"""Measuring in pictures: what lies on a pixel's ray, what is read off, and how far noise may set it apart. No bpy."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# How far noise may set a prediction and a measurement apart. The error itself is known from some eight pictures: further
# off by chance is one number in two thousand (Student's t).
STANDARD_ERRORS = 6


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in a scenes.stage.Pose with a picture of `size` (width, height); rows count from the top."""

    eye: tuple
    target: tuple
    field_of_view: float
    fit: str
    size: tuple

    @property
    def scale(self) -> float:
        """How many pixels a length of 1 covers at distance 1, in the middle of the picture."""
        width, height = self.size
        across = {"HORIZONTAL": width, "VERTICAL": height}.get(self.fit, max(width, height))
        return across / 2 / math.tan(math.radians(self.field_of_view) / 2)

    def _frame(self):
        """Unit vectors to the right, up and ahead, (3,) each."""
        ahead = np.subtract(self.target, self.eye).astype(float)
        ahead /= np.linalg.norm(ahead)
        # Blender's to_track_quat: y stands for up where the camera looks along z
        right = np.cross(ahead, (0, 0, 1))
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-7 else np.array([1.0, 0, 0])
        return right, np.cross(right, ahead), ahead

    def rays(self, columns, rows) -> tuple[np.ndarray, np.ndarray]:
        """The eye (3,) and unit directions (..., 3) through the points (columns, rows) of the picture, floats.

        (0, 0) is the upper left corner of the upper left pixel, whose middle is (0.5, 0.5). The arguments broadcast.
        """
        right, up, ahead = self._frame()
        x = (np.asarray(columns, float) - self.size[0] / 2) / self.scale
        y = (self.size[1] / 2 - np.asarray(rows, float)) / self.scale
        directions = ahead + x[..., None] * right + y[..., None] * up
        return np.array(self.eye, float), directions / np.linalg.norm(directions, axis=-1, keepdims=True)

    def pixel_rays(self, offsets: tuple[float, float] = (0.5, 0.5)) -> tuple[np.ndarray, np.ndarray]:
        """The eye, and directions (H, W, 3) through each pixel, at `offsets` (x, y) from its upper left corner."""
        rows, columns = np.indices(self.size[::-1])
        return self.rays(columns + offsets[0], rows + offsets[1])

    def pixels_of(self, points) -> np.ndarray:
        """(..., 2) column and row at which points (..., 3) appear; NaN for what lies behind the eye."""
        right, up, ahead = self._frame()
        away = np.asarray(points, float) - np.array(self.eye, float)
        depth = away @ ahead
        depth = np.where(depth > 0, depth, np.nan)
        x = self.size[0] / 2 + self.scale * (away @ right) / depth
        return np.stack([x, self.size[1] / 2 - self.scale * (away @ up) / depth], axis=-1)


def impact(camera: Camera, center: tuple, radius: float) -> np.ndarray:
    """How far each pixel's ray (H, W) passes the centre of a sphere, in radii: below 1 it meets the sphere."""
    eye, directions = camera.pixel_rays()
    away = np.subtract(center, eye)
    along = directions @ away
    nearest = along[..., None] * directions - away
    return np.where(along > 0, np.linalg.norm(nearest, axis=-1) / radius, np.inf)


def off_vertical(camera: Camera) -> np.ndarray:
    """The angle of each pixel's line of sight from the vertical, (H, W), in degrees."""
    return np.degrees(np.arccos(np.clip(camera.pixel_rays()[1][..., 2], -1, 1)))


def pixel_width(camera: Camera, angle: float) -> float:
    """How many degrees a pixel spans along the radius, at that angle from the axis of a camera."""
    return math.degrees(math.cos(math.radians(angle)) ** 2 / camera.scale)


def steepest(values: np.ndarray, angles: np.ndarray, width: float, reach=(35.0, 52.0)) -> float:
    """The angle where the mean of `values` over rings `width` wide changes fastest, in degrees."""
    edges = np.arange(*reach, width)
    count, _ = np.histogram(angles, edges)
    total, _ = np.histogram(angles, edges, weights=values)
    profile = total / count
    # half way between the two rings
    return float(edges[1 + np.argmax(np.abs(np.diff(profile)))])


def centroid(mask: np.ndarray) -> tuple[float, float]:
    """Column and row of the middle of a mask, in pixels."""
    rows, columns = np.nonzero(mask)
    return (columns + 0.5).mean(), (rows + 0.5).mean()


def correlation(picture: np.ndarray, other: np.ndarray, region: np.ndarray) -> float:
    """The correlation of two pictures (H, W) within a region (H, W)."""
    return float(np.corrcoef(picture[region], other[region])[0, 1])


def slope(values: np.ndarray, against: np.ndarray) -> float:
    """The slope of the straight line that fits `values` best."""
    return float(np.polyfit(np.ravel(against), np.ravel(values), 1)[0])


def smooth(pixels: np.ndarray) -> np.ndarray:
    """Means (H, W, C) over the 3 x 3 pixels about each, the edge repeated: for a threshold that noise must not cross."""
    height, width = pixels.shape[:2]
    wide = np.pad(pixels, ((1, 1), (1, 1), (0, 0)), mode="edge")
    return sum(wide[y : y + height, x : x + width] for y in range(3) for x in range(3)) / 9


def blocks(pixels: np.ndarray, side: int = 8) -> np.ndarray:
    """Means over square blocks of `side` pixels, (..., H / side, W / side, C), of pixels (..., H, W, C)."""
    *more, height, width, channels = pixels.shape
    cut = pixels[..., : height // side * side, : width // side * side, :].astype(float)
    cut = cut.reshape(*more, height // side, side, width // side, side, channels)
    return cut.mean(axis=(-4, -2))


def block_scores(
    each: np.ndarray, predicted: np.ndarray, *, side: int = 8, quiet: float = 1e-4
) -> tuple[np.ndarray, float]:
    """How far a picture lies from its prediction, block by block, in the standard error of the two.

    each:      (S, H, W, C), renders of different noise; S of 4 or more
    predicted: (P, H, W, C), predictions of different noise; P of 4 or more
    quiet:     blocks whose standard error is below this hold no noise to measure in: they count only where they are
               further off than STANDARD_ERRORS of this size
    Returns the scores (N,), and the rms they have where there is nothing but noise: a little above 1, as their errors
    are known from few renders only (Student's t, its degrees of freedom by Welch and Satterthwaite).
    """
    means, variances, freedom = [], [], []
    for pictures in (each, predicted):
        means.append((values := blocks(np.asarray(pictures), side)).mean(axis=0))
        variances.append(values.var(axis=0, ddof=1) / len(values))
        freedom.append(len(values) - 1)
    total = variances[0] + variances[1]
    noisy = np.sqrt(total) >= quiet
    scores = (means[0] - means[1]) / np.maximum(np.sqrt(total), quiet)
    with np.errstate(invalid="ignore"):
        degrees = np.square(total) / sum(np.square(v) / f for v, f in zip(variances, freedom, strict=True))
    degrees = degrees[noisy]
    counts = noisy | (np.abs(scores) > STANDARD_ERRORS)
    return scores[counts], float(np.sqrt(np.mean(degrees / (degrees - 2))))


def misplaced(each: np.ndarray, predicted: np.ndarray) -> tuple[float, float]:
    """The share of light that lies in other cells than predicted, and what noise alone makes of it.

    each, predicted: (S, ...) and (P, ...), irradiance of cells in pictures of different noise; S and P even
    Returns the share by chance, and that found: half the sum of all differences, in the light of all.
    """
    whole = np.mean(predicted, axis=0).sum()

    def share(*signs):
        means = [np.tensordot(np.resize(signs, len(stack)), stack, 1) / len(stack) for stack in (each, predicted)]
        return float(np.abs(means[0] - means[1]).sum() / 2 / whole)

    # with every second picture turned round nothing is left but noise, and as much of it
    return share(1, -1), share(1, 1)


def estimate(statistic: Callable, *stacks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A statistic of pictures, and its standard error, by leaving out one of them after the other (the jackknife).

    statistic: function of one picture (H, W, C) of each stack that returns a number, or an array of numbers
    stacks:    (S, H, W, C), pictures of different noise whose mean is measured; the same S of 4 or more for all
    """
    count = len(stacks[0])
    whole = np.asarray(statistic(*(stack.mean(axis=0) for stack in stacks)), float)
    without = [statistic(*(np.delete(stack, k, axis=0).mean(axis=0) for stack in stacks)) for k in range(count)]
    return whole, np.sqrt((count - 1) * np.var(without, axis=0))


def compare(statistic: Callable, traced: tuple, rendered: tuple) -> tuple | list[tuple]:
    """A statistic of the traced and of the rendered pictures, and by how much noise may set the two apart.

    traced, rendered: tuples of stacks, as estimate() takes them
    Returns predicted, measured and allowed, as a Claim has them: a tuple, or where the statistic is an array of
    numbers a list of tuples.
    """
    predicted, error_traced = estimate(statistic, *traced)
    measured, error_rendered = estimate(statistic, *rendered)
    triples = np.stack([predicted, measured, STANDARD_ERRORS * np.hypot(error_traced, error_rendered)], axis=-1)
    return tuple(triples.tolist()) if triples.ndim == 1 else [tuple(triple) for triple in triples.tolist()]

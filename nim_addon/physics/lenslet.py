# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of lenslets: two arrays of small lenses, face to face, which bend rays by a law of tangents.

The lenses of the two arrays share their focal planes: f1 in front, f2 behind, at the distance f1 + f2. A ray of slope tan(theta1)
in front has tan(theta2) = tan(theta1) / eta behind, eta = -f2 / f1 in the place of n2 / n1 (Courtial 2008). Nothing is
reflected, and as tangents reach from -90 to 90 degrees nothing is totally reflected either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .interface import unit
from .laws import Branch

Pair = tuple[float, float]


class _Slopes(NamedTuple):
    """Rays in the frame of a window: slopes (..., 2) along u and v, whether they come from behind, and u, v, the way on."""

    slopes: NDArray
    from_behind: NDArray
    u: NDArray
    v: NDArray
    onwards: NDArray


@dataclass(frozen=True)
class LensletWindow:
    """A flat window of confocal lenslets.

    eta:      -f2 / f1, of u and of v, two axes in the window; one number for both; positive or negative, never 0
    offset:   by how much each lens behind stands aside of the one in front, along u and v, in f1 (Hamilton and Courtial 2009)
    aperture: width of a lens, in f1; None for ideal lenslets, of which no ray misses the second
    In front is where the normal points. Raises ValueError for an eta or an aperture out of its range.
    """

    eta: float | Pair = -1.0
    offset: Pair = (0.0, 0.0)
    aperture: float | None = None

    def __post_init__(self):
        eta = (self.eta, self.eta) if isinstance(self.eta, (int, float)) else tuple(self.eta)
        if len(eta) != 2 or not all(math.isfinite(one) and one for one in eta):
            raise ValueError(f"eta = {self.eta!r} is no window; give one number or two, of either sign, but not 0.")
        if len(self.offset) != 2 or not all(map(math.isfinite, self.offset)):
            raise ValueError(f"offset = {self.offset!r} is no pair of numbers; give two, along u and v, in f1.")
        if self.aperture is not None and not 0 < self.aperture < math.inf:
            raise ValueError(
                f"aperture = {self.aperture!r} lets nothing through; give the width of a lens in f1, above 0, or None for "
                "ideal lenslets."
            )
        object.__setattr__(self, "eta", eta)
        object.__setattr__(self, "offset", tuple(self.offset))

    @property
    def keeps_solid_angle(self) -> bool:
        """Whether light fills as large a solid angle behind as in front: eta is 1 or -1, and nothing stands aside."""
        return bool(np.all(np.abs(self.eta) == 1)) and not any(self.offset)

    def bend(self, d: ArrayLike, normal: ArrayLike, u: ArrayLike) -> NDArray:
        """Directions (..., 3), unit vectors, in which rays go on.

        d:      (..., 3) directions, of any length but zero
        normal: (..., 3) towards the front; u: (..., 3) the first axis in the window, what of it lies along the normal not
                counted; the second is normal x u
        Slopes w become (w - offset) / eta from in front; from behind, where the same path runs back, eta w - offset. NaN for
        rays within the plane. The arguments broadcast. Raises ValueError for a vector that is zero or not finite.
        """
        ray = _slopes(d, normal, u)
        eta, offset = np.array(self.eta), np.array(self.offset)
        bent = np.where(ray.from_behind, eta * ray.slopes - offset, (ray.slopes - offset) / eta)
        return _of_length_1(bent[..., :1] * ray.u + bent[..., 1:] * ray.v + ray.onwards)

    def transmittance(self, d: ArrayLike, normal: ArrayLike, u: ArrayLike) -> NDArray:
        """The share (...) of such rays, spread evenly over a lens, that passes the one behind it; the rest misses it.

        The arguments of bend(). Lenses are squares along u and v. A ray of slope w that meets the first at x1 (in f1, from its
        middle) meets the second at eta x1 + (1 - eta) w, so that of the whole width of the first an interval |eta| times as
        wide falls onto the plane of the second. Where rays that miss it get to in real windows is not followed.
        """
        ray = _slopes(d, normal, u)
        if self.aperture is None:
            return np.where(np.isfinite(ray.slopes).all(axis=-1), 1.0, np.nan)
        eta, offset = np.array(self.eta), np.array(self.offset)
        # of a path that runs back, the slope in front; the two senses of travel have opposite signs
        in_front = np.where(ray.from_behind, offset - eta * ray.slopes, ray.slopes)
        middle = np.abs((1 - eta) * in_front - offset)
        lens, image = self.aperture, np.abs(eta) * self.aperture
        overlap = np.clip((lens + image) / 2 - middle, 0, np.minimum(lens, image))
        return np.prod(overlap / np.where(ray.from_behind, lens, image), axis=-1)

    def image_depth(self, depth: ArrayLike) -> NDArray:
        """How far behind the window (...) an object at `depth` (...) behind it appears, by the eta of u.

        Negative in front of it. All rays of a point meet there: the law makes sharp images for any eta.
        """
        return np.asarray(depth, float) / np.array(self.eta)[0]

    def apparent_size(self, distance: float, depth: ArrayLike) -> NDArray:
        """How large (...) an object at `depth` (...) behind looks from `distance` in front, in its size without a window."""
        depth = np.asarray(depth, float)
        return (distance + depth) / (distance + self.image_depth(depth))


def _slopes(d: ArrayLike, normal: ArrayLike, u: ArrayLike) -> _Slopes:
    d, normal, u = np.broadcast_arrays(unit(d), unit(normal), unit(u))
    u = unit(u - np.sum(u * normal, axis=-1, keepdims=True) * normal)
    v = np.cross(normal, u)
    along = np.sum(d * normal, axis=-1, keepdims=True)
    across = np.stack([np.sum(d * axis, axis=-1) for axis in (u, v)], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.where(along == 0, np.nan, across / np.abs(along))
    return _Slopes(slopes, along > 0, u, v, np.where(along > 0, normal, -normal))


def _of_length_1(vectors: NDArray) -> NDArray:
    """Vectors (..., 3) made of length 1, those with a NaN all NaN."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@dataclass(frozen=True, eq=False)
class Pane:
    """A window as rays meet it, a laws.Law: on faces of an object, whose axes x and y are `axes` (2, 3) in the world.

    u is x as it lies in a face, or y where the face looks along x.
    """

    window: LensletWindow
    axes: ArrayLike

    def branches(self, points: NDArray, directions: NDArray, normals: NDArray) -> Sequence[Branch]:
        """As laws.Law.branches: through the window, where there are any lenslets that let a ray pass."""
        x, y = unit(self.axes)
        within = np.linalg.norm(x - np.sum(x * normals, axis=1, keepdims=True) * normals, axis=1, keepdims=True)
        u = np.where(within < 1e-3, y, x)
        share = np.nan_to_num(self.window.transmittance(directions, normals, u))
        return [Branch(share, points, self.window.bend(directions, normals, u))]

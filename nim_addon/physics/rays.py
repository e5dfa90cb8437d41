# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through any number of interfaces: each splits into a reflected and a transmitted branch, until nothing is left.

Rays are straight, media isotropic, light unpolarised at every interface (thesis 4.16). With loss, the surfaces are those of
complex media, and the energy falls along a ray as exp(-4 pi k L / lambda) (Beer and Lambert); what is a mirror for all that
one can see ends the rays that enter it.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dispersion import REPRESENTATIVE_NM
from .interface import Interface, unit
from .media import OPAQUE

# More segments than this are a mistake in the settings rather than a drawing.
MOST_SEGMENTS = 100_000


class Kind(enum.IntEnum):
    """How a segment begins: at the source, by reflection, or by transmission."""

    INCIDENT = 0
    REFLECTED = 1
    TRANSMITTED = 2


class Fate(enum.IntEnum):
    """How a segment ends: at an interface, at something opaque, nowhere, or at the last interface it may meet."""

    SPLIT = 0
    LANDED = 1
    ESCAPED = 2
    STOPPED = 3


class Hit(NamedTuple):
    """Where N rays meet a surface first.

    distance: (N,) along the unit direction, inf where there is nothing
    normal:   (N, 3) unit normals into `outside`; the sign of direction . normal tells the side a ray comes from
    which:    (N,) index into the surfaces' `interfaces`, -1 where the surface is opaque
    """

    distance: NDArray
    normal: NDArray
    which: NDArray


class Paths(NamedTuple):
    """The S segments of N rays, each after the one it comes from.

    start, end: (S, 3)
    energy:     (S,) share of the ray's energy, where it starts
    arriving:   (S,) what is left of that where it ends: the same but in a medium that absorbs
    n:          (S,) refractive index of the medium it runs in, 1 where no interface before or after tells
    depth:      (S,) how many interfaces lie before it
    kind, fate: (S,) values of Kind and Fate
    ray:        (S,) index of the source's ray
    parent:     (S,) index of the segment it comes from, -1 at the source
    lost:       (N,) energy of the branches that were not followed; with `absorbed` and what arrives at all ends of a ray
                it makes 1
    """

    start: NDArray
    end: NDArray
    energy: NDArray
    arriving: NDArray
    n: NDArray
    depth: NDArray
    kind: NDArray
    fate: NDArray
    ray: NDArray
    parent: NDArray
    lost: NDArray

    @property
    def direction(self) -> NDArray:
        """(S, 3) unit vectors the light travels in."""
        return unit(self.end - self.start)

    @property
    def absorbed(self) -> NDArray:
        """(N,) energy that media have absorbed on the ways of each ray."""
        return np.bincount(self.ray, self.energy - self.arriving, len(self.lost))


class _Front(NamedTuple):
    """The segments of one depth before it is known where they end; `cast` is where the search for that begins.

    n, alpha: refractive index and absorption coefficient, per metre, of what they run in, as far as is known
    """

    start: NDArray
    cast: NDArray
    direction: NDArray
    energy: NDArray
    n: NDArray
    alpha: NDArray
    kind: NDArray
    ray: NDArray
    parent: NDArray

    def chosen(self, rows: NDArray) -> _Front:
        """Those of some rows: their indices, or a mask."""
        return _Front(*(column[rows] for column in self))


class _Sides(NamedTuple):
    """An interface at one wavelength, and numbers of what lies on its two sides, inside and outside.

    n, alpha: refractive index, and absorption coefficient per metre; opaque: whether nothing is seen through it
    """

    interface: Interface
    n: tuple[float, float]
    alpha: tuple[float, float]
    opaque: tuple[bool, bool]

    @classmethod
    def of(cls, interface: Interface, wavelength_nm: float) -> _Sides:
        there = interface.at(wavelength_nm)
        inside, outside = there.inside, there.outside
        return cls(
            there,
            (inside.n, outside.n),
            (inside.absorption(wavelength_nm), outside.absorption(wavelength_nm)),
            (inside.k > OPAQUE, outside.k > OPAQUE),
        )


class Surfaces(Protocol):
    """What trace() takes: Shapes here, or anything else that can cast rays.

    interfaces: those that Hit.which counts; None at the places of what is opaque
    """

    @property
    def interfaces(self) -> Sequence[Interface | None]: ...

    def hit(self, origins: NDArray, directions: NDArray, /) -> Hit:
        """The nearest Hit of rays from origins (N, 3) along unit directions (N, 3)."""
        ...


def trace(
    surfaces: Surfaces,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    bounces: int = 8,
    least: float = 1e-3,
    branches: bool = True,
    reach: float = 1.0,
    gap: float = 1e-9,
    most: int = MOST_SEGMENTS,
    wavelength_nm: float = REPRESENTATIVE_NM,
) -> Paths:
    """Follow rays through interfaces.

    origins:    (N, 3) or (3,); directions: (N, 3) or (3,), of any length but zero; they broadcast
    bounces:    how many interfaces one path may cross or be reflected by
    least:      a branch with less of the ray's energy is not followed
    branches:   whether to follow both; else only the transmitted branch, or the reflected one in total reflection
    reach:      length that is given to a segment which meets nothing
    gap:        how far off a surface the search starts as a ray leaves it; more than the rounding of `hit`
    most:       ValueError where the rays split into more segments
    wavelength_nm: in vacuum, nanometres; where media absorb, lengths are metres
    Raises ValueError for a direction that is zero or not finite, numbers out of range, a medium not known at that wavelength.
    """
    if not bounces >= 0 or not 0 <= least < 1 or not reach > 0 or not gap >= 0:
        raise ValueError("bounces and gap must be 0 or more, least in [0, 1) and reach above 0.")
    origins, directions = np.broadcast_arrays(
        np.atleast_2d(np.asarray(origins, float)), np.atleast_2d(unit(directions))
    )
    count = len(origins)
    interfaces = [one and _Sides.of(one, wavelength_nm) for one in surfaces.interfaces]
    sources, ones = np.full(count, -1), np.ones(count)
    front = _Front(origins, origins, directions, ones, ones, 0 * ones, sources + 1, np.arange(count), sources)
    lost = np.zeros(count)
    levels, total = [], 0
    for depth in range(bounces + 1):
        hit = surfaces.hit(front.cast, front.direction)
        end, fate = _ends(front, hit, reach, depth == bounces)
        crossings = _crossings(interfaces, front, hit)
        front = _known(front, crossings)
        arriving = front.energy * np.exp(-front.alpha * np.linalg.norm(end - front.start, axis=1))
        ways = front.start, end, front.energy, arriving, front.n
        levels.append((*ways, np.full(len(end), depth), front.kind, fate, front.ray, front.parent))
        children = [] if depth == bounces else _cross(front, crossings, hit.normal, end, arriving, total, gap)
        total += len(end)
        if not children:
            break
        front = _Front(*(np.concatenate(columns) for columns in zip(*children, strict=True)))
        followed = _followed(front, least, branches)
        np.add.at(lost, front.ray[~followed], front.energy[~followed])
        front = front.chosen(followed)
        if total + len(front.ray) > most:
            raise ValueError(
                f"the rays split into more than {most} segments; take fewer rays or bounces, or a higher least energy."
            )
        if not len(front.ray):
            break
    return Paths(*(np.concatenate(columns) for columns in zip(*levels, strict=True)), lost=lost)


def _ends(front: _Front, hit: Hit, reach: float, is_last: bool) -> tuple[NDArray, NDArray]:
    """Where segments end, (N, 3), and their fates (N,)."""
    met = np.isfinite(hit.distance)
    end = np.where(
        met[:, None],
        front.cast + np.where(met, hit.distance, 0)[:, None] * front.direction,
        front.start + reach * front.direction,
    )
    at_interface = Fate.STOPPED if is_last else Fate.SPLIT
    return end, np.select([~met, hit.which < 0], [Fate.ESCAPED, Fate.LANDED], at_interface)


class _Crossing(NamedTuple):
    """Which rows (K,) of a front meet an interface, and whether they do from inside, (K,)."""

    sides: _Sides
    rows: NDArray
    from_inside: NDArray


def _crossings(interfaces: Sequence[_Sides | None], front: _Front, hit: Hit) -> list[_Crossing]:
    """One for each interface that is met."""
    crossed, found = np.isfinite(hit.distance) & (hit.which >= 0), []
    for which in np.unique(hit.which[crossed]):
        sides = interfaces[which]
        assert sides is not None  # by Hit.which
        rows = np.flatnonzero(crossed & (hit.which == which))
        found.append(_Crossing(sides, rows, np.sum(front.direction[rows] * hit.normal[rows], axis=1) > 0))
    return found


def _known(front: _Front, crossings: list[_Crossing]) -> _Front:
    """The front with what its segments turn out to run in."""
    # an interface knows the medium a ray comes from; where there is none, the one it was last seen in
    n, alpha = front.n.copy(), front.alpha.copy()
    for sides, rows, from_inside in crossings:
        n[rows] = np.where(from_inside, *sides.n)
        alpha[rows] = np.where(from_inside, *sides.alpha)
    return front._replace(n=n, alpha=alpha)


def _cross(
    front: _Front,
    crossings: list[_Crossing],
    normal: NDArray,
    end: NDArray,
    arriving: NDArray,
    total: int,
    gap: float,
) -> list[_Front]:
    """The _Fronts that come of one.

    normal, end, arriving: (N, 3), (N, 3) and (N,) of its segments: normals and places where they end, and energies there
    total: how many segments lie before the first of them
    """
    children = []
    for sides, rows, _ in crossings:
        chosen = front.chosen(rows)._replace(energy=arriving[rows])
        children += _split(sides, chosen, end[rows], normal[rows], rows + total, gap)
    return children


def _followed(front: _Front, least: float, branches: bool) -> NDArray:
    """Which branches, (N,), are followed: `least` and `branches` as trace() takes them."""
    goes_on = np.isfinite(front.direction).all(axis=1)
    followed = (front.energy > 0) & (front.energy >= least) & goes_on
    if not branches:
        # where the transmitted branch has no energy, or no way on, the reflected one is all there is
        transmitted = front.kind == Kind.TRANSMITTED
        splits = np.isin(front.parent, front.parent[transmitted & (front.energy > 0) & goes_on])
        followed &= transmitted | ~splits
    return followed


def _split(sides: _Sides, front: _Front, point: NDArray, normal: NDArray, parent: NDArray, gap: float) -> list[_Front]:
    """The reflected and the transmitted _Front of rays that meet an interface at `point` (N, 3)."""
    d, interface = front.direction, sides.interface
    along = np.sum(d * normal, axis=1)
    from_inside = along > 0
    cos_i = np.minimum(np.abs(along), 1.0)
    R = np.where(from_inside, interface.reversed().fresnel(cos_i).R, interface.fresnel(cos_i).R)
    mirrored = unit(d - 2 * along[:, None] * normal)
    refracted = interface.refract(d, normal)
    if any(sides.opaque):
        refracted = np.where(np.where(from_inside, *sides.opaque[::-1])[:, None], np.nan, refracted)
    passes = np.isfinite(refracted).all(axis=1)
    if not interface.is_complex:  # with loss, what is neither reflected nor goes on is absorbed at once
        R = np.where(passes, R, 1.0)
    away = np.where(from_inside, -gap, gap)[:, None] * normal  # back to the side the rays came from
    n, n_ahead = (np.where(from_inside, *pair) for pair in (sides.n, sides.n[::-1]))
    alpha, alpha_ahead = (np.where(from_inside, *pair) for pair in (sides.alpha, sides.alpha[::-1]))
    kinds = np.full_like(parent, Kind.REFLECTED), np.full_like(parent, Kind.TRANSMITTED)
    return [
        _Front(point, point + away, mirrored, front.energy * R, n, alpha, kinds[0], front.ray, parent),
        _Front(
            point, point - away, refracted, front.energy * (1 - R), n_ahead, alpha_ahead, kinds[1], front.ray, parent
        ),
    ]


def _dot(a: NDArray, b: NDArray) -> NDArray:
    return np.sum(a * b, axis=-1)


def _first(roots: NDArray) -> NDArray:
    """The smallest of the distances (K, N) that lies ahead, inf where none does."""
    with np.errstate(invalid="ignore"):
        return np.min(np.where(roots > 0, roots, np.inf), axis=0)


def _roots(away: NDArray, along: NDArray, radius: float, square: NDArray | float = 1.0) -> NDArray:
    """Distances (2, N), in order, at which away + distance * along, each (N, 3), is of length `radius`; NaN where never.

    square: (N,) of the lengths of `along`
    """
    b = _dot(away, along) / square
    # where it is nearest, by the vector and not by |away|^2 - b^2, which cancels far away
    nearest = away - b[:, None] * along
    half = np.sqrt((np.square(radius) - _dot(nearest, nearest)) / square)
    return np.stack([-b - half, -b + half])


@dataclass(frozen=True)
class Sphere:
    """A sphere whose normals point away from `center`; opaque where `interface` is None."""

    center: ArrayLike
    radius: float
    interface: Interface | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """Distances (N,), inf where there is nothing, and normals (N, 3) of rays from o (N, 3) along unit d (N, 3)."""
        away = o - np.asarray(self.center, float)
        with np.errstate(invalid="ignore"):
            distance = _first(_roots(away, d, self.radius))
        reached = np.where(np.isfinite(distance), distance, 0)[:, None]
        return distance, (away + reached * d) / self.radius


@dataclass(frozen=True)
class Plane:
    """A plane without end through `point`, its normal of any length; opaque where `interface` is None."""

    point: ArrayLike
    normal: ArrayLike
    interface: Interface | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        normal = unit(self.normal)
        along = _dot(d, normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = _first(_dot(np.asarray(self.point, float) - o, normal)[None] / along)
        return distance, np.broadcast_to(normal, o.shape)


@dataclass(frozen=True)
class Cylinder:
    """The wall of a cylinder from `start` to `end`, without its caps; normals point away from the axis."""

    start: ArrayLike
    end: ArrayLike
    radius: float
    interface: Interface | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        start, end = np.asarray(self.start, float), np.asarray(self.end, float)
        axis = unit(end - start)
        # across the axis it is a circle
        away = (o - start) - _dot(o - start, axis)[:, None] * axis
        across = d - _dot(d, axis)[:, None] * axis
        with np.errstate(divide="ignore", invalid="ignore"):
            roots = _roots(away, across, self.radius, _dot(across, across))
            height = _dot(o - start, axis) + roots * _dot(d, axis)
        distance = _first(np.where((height >= 0) & (height <= np.linalg.norm(end - start)), roots, np.inf))
        reached = np.where(np.isfinite(distance), distance, 0)[:, None]
        return distance, (away + reached * across) / self.radius


@dataclass(frozen=True)
class Convex:
    """A solid with flat faces and no hollow, each face by a point on it and its normal, of any length, outwards."""

    points: ArrayLike
    normals: ArrayLike
    interface: Interface | None = None

    def meet(self, o: NDArray, d: NDArray) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        normals = unit(self.normals)
        along = d @ normals.T
        gap = np.sum(np.asarray(self.points, float) * normals, axis=1) - o @ normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = gap / along
        # A line is inside the solid from the last of the planes that it enters by (their normals are against it) to the
        # first of those it leaves by; if it leaves before it has entered, it passes by, as it does beside a parallel plane.
        entries = np.where(along < 0, distances, -np.inf)
        exits = np.where(along > 0, distances, np.inf)
        first, last = np.max(entries, axis=1), np.min(exits, axis=1)
        beside = np.any((along == 0) & (gap < 0), axis=1)
        meets = (first < last) & (last > 0) & ~beside
        enters = first > 0
        face = np.where(enters, np.argmax(entries, axis=1), np.argmin(exits, axis=1))
        return np.where(meets, np.where(enters, first, last), np.inf), normals[face]


class Shape(Protocol):
    """One of the Shapes; opaque where `interface` is None."""

    @property
    def interface(self) -> Interface | None: ...

    def meet(self, o: NDArray, d: NDArray, /) -> tuple[NDArray, NDArray]:
        """As Sphere.meet."""
        ...


class Shapes:
    """Several shapes as one: what trace() takes."""

    def __init__(self, *shapes: Shape):
        self.shapes = shapes
        self.interfaces = [shape.interface for shape in shapes]
        self._which = np.array([-1 if shape.interface is None else i for i, shape in enumerate(shapes)])

    def hit(self, origins: NDArray, directions: NDArray) -> Hit:
        """The nearest Hit of rays from origins (N, 3) along unit directions (N, 3)."""
        distances, normals = zip(*(shape.meet(origins, directions) for shape in self.shapes), strict=True)
        nearest = np.argmin(distances, axis=0)
        rows = np.arange(len(origins))
        return Hit(np.stack(distances)[nearest, rows], np.stack(normals)[nearest, rows], self._which[nearest])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through any number of interfaces: each splits into a reflected and a transmitted branch, until nothing is left.

Rays are straight, media isotropic, light unpolarised at every interface (thesis 4.16). With loss, the surfaces are those of
complex media, and the energy falls along a ray as exp(-4 pi k L / lambda) (Beer and Lambert); what is a mirror for all that
one can see ends the rays that enter it. A surface of another law (laws.Law) takes rays up and lets them go on elsewhere.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dispersion import REPRESENTATIVE_NM
from .interface import Interface, amplitudes, reflectances, refracted, unit
from .laws import Branch, Law
from .media import OPAQUE
from .shapes import Convex, Cylinder, Hit, Plane, Shape, Shapes, Sphere

__all__ = [
    "MOST_SEGMENTS",
    "Branch",
    "Convex",
    "Cylinder",
    "Fate",
    "Hit",
    "Kind",
    "Law",
    "Paths",
    "Plane",
    "Shape",
    "Shapes",
    "Sphere",
    "Surfaces",
    "trace",
]

# More segments than this are a mistake in the settings rather than a drawing.
MOST_SEGMENTS = 100_000


class Kind(enum.IntEnum):
    """How a segment begins: at the source, by reflection, or by transmission."""

    INCIDENT = 0
    REFLECTED = 1
    TRANSMITTED = 2


class Fate(enum.IntEnum):
    """How a segment ends: at an interface, at something opaque, nowhere, or at the last interface it may meet.

    A piece of the way on which a law takes a ray ends SPLIT, too, where the next one begins.
    """

    SPLIT = 0
    LANDED = 1
    ESCAPED = 2
    STOPPED = 3


class Paths(NamedTuple):
    """The S segments of N rays, each after the one it comes from; the way on which a law takes a ray is one of several.

    start, end: (S, 3)
    energy:     (S,) share of the ray's energy, where it starts
    arriving:   (S,) what is left of that where it ends: the same but in a medium that absorbs
    n:          (S,) refractive index of the medium it runs in, 1 where no interface before or after tells
    depth:      (S,) how many interfaces lie before it
    kind, fate: (S,) values of Kind and Fate
    ray:        (S,) index of the source's ray
    parent:     (S,) index of the segment it comes from, -1 at the source
    normal:     (S, 3) of the surface that it ends at, as Hit has them; zeros where that is none
    which:      (S,) which of the interfaces that is, as Hit counts them; -1 where it is none
    lost:       (N,) energy of the branches that were not followed, and what laws absorb; with `absorbed` and what arrives
                at all ends of a ray it makes 1
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
    normal: NDArray
    which: NDArray
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
    """An interface at W wavelengths: numbers of what lies on its two sides, (W, 2), inside and outside.

    n, alpha:   refractive index, 0 of what carries no wave, and absorption coefficient per metre
    q, Z:       the complex index over that of the other side, and the impedance
    opaque:     whether nothing is seen through it
    is_complex: (W,) whether the interface has loss
    """

    n: NDArray
    alpha: NDArray
    q: NDArray
    Z: NDArray
    opaque: NDArray
    is_complex: NDArray

    @classmethod
    def of(cls, interface: Interface, wavelengths_nm: NDArray) -> _Sides:
        rows = []
        for nm in wavelengths_nm.tolist():
            there = interface.at(nm)
            sides = there.inside, there.outside
            q = sides[0].index / sides[1].index
            rows.append(
                (
                    [side.n for side in sides],
                    [side.absorption(nm) for side in sides],
                    [q, sides[1].index / sides[0].index],
                    [complex(side.impedance) if there.is_complex else abs(side.impedance) for side in sides],
                    [side.k > OPAQUE for side in sides],
                    there.is_complex,
                )
            )
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    def reflectance(self, cos_i: NDArray, which: NDArray, side: NDArray) -> NDArray:
        """R (K,) of rays by the cosines of their angles of incidence, their wavelengths, and the sides they come from.

        (K,) each; of wavelengths that all have loss, or all have none
        """
        Z_i, Z_t = self.Z[which, side], self.Z[which, 1 - side]
        if self.is_complex[which[0]]:
            r_s, r_p, _ = amplitudes(cos_i, self.q[which, side], Z_i, Z_t)
            return np.minimum((r_s.real**2 + r_s.imag**2 + r_p.real**2 + r_p.imag**2) / 2, 1.0)
        R_s, R_p = reflectances(cos_i, self.n[which, side], self.n[which, 1 - side], Z_i.real, Z_t.real)
        return (R_s + R_p) / 2


class Surfaces(Protocol):
    """What trace() takes: Shapes here, or anything else that can cast rays.

    interfaces: those that Hit.which counts, or other laws; None at the places of what is opaque
    """

    @property
    def interfaces(self) -> Sequence[Interface | Law | None]: ...

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
    wavelength_nm: ArrayLike = REPRESENTATIVE_NM,
) -> Paths:
    """Follow rays through interfaces.

    origins:    (N, 3) or (3,); directions: (N, 3) or (3,), of any length but zero; they broadcast
    bounces:    how many interfaces one path may cross or be reflected by
    least:      a branch with less of the ray's energy is not followed
    branches:   whether to follow both; else only the transmitted branch, or the reflected one in total reflection
    reach:      length that is given to a segment which meets nothing
    gap:        how far off a surface the search starts as a ray leaves it; more than the rounding of `hit`
    most:       ValueError where the rays split into more segments
    wavelength_nm: in vacuum, nanometres, of all rays or of each, (N,); where media absorb, lengths are metres
    Raises ValueError for a direction that is zero or not finite, numbers out of range, a medium not known at that wavelength.
    """
    if not bounces >= 0 or not 0 <= least < 1 or not reach > 0 or not gap >= 0:
        raise ValueError("bounces and gap must be 0 or more, least in [0, 1) and reach above 0.")
    front = _sent(origins, directions)
    wavelengths, of_ray = np.unique(np.broadcast_to(wavelength_nm, len(front.ray)), return_inverse=True)
    interfaces = [_Sides.of(one, wavelengths) if isinstance(one, Interface) else one for one in surfaces.interfaces]
    lost = np.zeros(len(front.ray))
    levels, total = [], 0
    for depth in range(bounces + 1):
        hit = surfaces.hit(front.cast, front.direction)
        end, fate = _ends(front, hit, reach, depth == bounces)
        crossings, taken = _met(interfaces, of_ray, front, hit)
        front = _known(front, crossings)
        arriving = front.energy * np.exp(-front.alpha * np.linalg.norm(end - front.start, axis=1))
        ways = front.start, end, front.energy, arriving, front.n
        levels.append((*ways, np.full(len(end), depth), front.kind, fate, front.ray, front.parent, *_of_ends(hit)))
        first, total = total, total + len(end)
        children = [] if depth == bounces else _cross(front, crossings, hit.normal, end, arriving, first, gap)
        taken = [] if depth == bounces else taken
        for pieces, child in _take(taken, front, hit.normal, end, arriving, first, depth, least, branches, gap, lost):
            levels.append(pieces)
            children.append(child)
            total += len(pieces[0])
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


def _sent(origins: ArrayLike, directions: ArrayLike) -> _Front:
    """The rays as they leave the source; the arguments of trace()."""
    origins, directions = np.broadcast_arrays(
        np.atleast_2d(np.asarray(origins, float)), np.atleast_2d(unit(directions))
    )
    count = len(origins)
    sources, ones = np.full(count, -1), np.ones(count)
    return _Front(origins, origins, directions, ones, ones, 0 * ones, sources + 1, np.arange(count), sources)


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


def _of_ends(hit: Hit) -> tuple[NDArray, NDArray]:
    """Paths.normal and Paths.which of segments that end so."""
    met = np.isfinite(hit.distance)
    return np.where(met[:, None], hit.normal, 0.0), np.where(met, hit.which, -1)


class _Crossing(NamedTuple):
    """Which rows (K,) of a front meet an interface, which of its wavelengths they have, and the sides that they come from.

    side: (K,) 0 inside, 1 outside; the wavelengths all have loss, or all have none
    """

    sides: _Sides
    rows: NDArray
    wavelength: NDArray
    side: NDArray


def _met(
    interfaces: Sequence[_Sides | Law | None], of_ray: NDArray, front: _Front, hit: Hit
) -> tuple[list[_Crossing], list[tuple[Law, NDArray]]]:
    """A _Crossing or two for each interface that is met; each other law that is, and the rows (K,) that meet it.

    of_ray: (N,) which of the wavelengths each ray has
    """
    crossed, crossings, taken = np.isfinite(hit.distance) & (hit.which >= 0), [], []
    for which in np.unique(hit.which[crossed]):
        one = interfaces[which]
        assert one is not None  # by Hit.which
        rows = np.flatnonzero(crossed & (hit.which == which))
        if not isinstance(one, _Sides):
            taken.append((one, rows))
            continue
        side = np.where(_dot(front.direction[rows], hit.normal[rows]) > 0, 0, 1)
        wavelength = of_ray[front.ray[rows]]
        has_loss = one.is_complex[wavelength]
        for some in (has_loss, ~has_loss):
            if some.all():
                crossings.append(_Crossing(one, rows, wavelength, side))
            elif some.any():
                crossings.append(_Crossing(one, rows[some], wavelength[some], side[some]))
    return crossings, taken


def _known(front: _Front, crossings: list[_Crossing]) -> _Front:
    """The front with what its segments turn out to run in."""
    # an interface knows the medium a ray comes from; where there is none, the one it was last seen in
    n, alpha = front.n.copy(), front.alpha.copy()
    for sides, rows, wavelength, side in crossings:
        n[rows], alpha[rows] = sides.n[wavelength, side], sides.alpha[wavelength, side]
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
    for crossing in crossings:
        rows = crossing.rows
        chosen = front.chosen(rows)._replace(energy=arriving[rows], parent=rows + total)
        children += _split(crossing, chosen, end[rows], normal[rows], gap)
    return children


def _take(
    taken: list[tuple[Law, NDArray]],
    front: _Front,
    normal: NDArray,
    end: NDArray,
    arriving: NDArray,
    total: int,
    depth: int,
    least: float,
    branches: bool,
    gap: float,
    lost: NDArray,
) -> Iterator[tuple[tuple[NDArray, ...], _Front]]:
    """What laws make of a front that has met them: for each way on, a level of the pieces of the way, and a _Front.

    normal, end, arriving, total: as _cross() takes them; depth: of the front; lost: (N,) of the rays, which grows by what
    laws absorb; least, branches, gap: as trace() takes them
    """
    number = total + len(end)
    for law, rows in taken:
        met = front.chosen(rows)._replace(energy=arriving[rows], parent=rows + total)
        ways = law.branches(end[rows], met.direction, normal[rows])
        if not branches:
            passes = sum(way.share for way in ways if not way.reflected) > 0
            ways = [way._replace(share=way.share * np.logical_not(passes)) if way.reflected else way for way in ways]
        np.add.at(lost, met.ray, met.energy * (1 - sum(way.share for way in ways)))
        for way in ways:
            pieces, gone = _taken(way, met, number, depth + 1, least, gap)
            number += len(pieces[0])
            yield pieces, gone


def _taken(
    branch: Branch, front: _Front, number: int, depth: int, least: float, gap: float
) -> tuple[tuple[NDArray, ...], _Front]:
    """The level of pieces of a branch, the first of which has that number, and the _Front that goes on after them."""
    energy, parent = front.energy * branch.share, front.parent.copy()
    kind = np.full_like(parent, Kind.REFLECTED if branch.reflected else Kind.TRANSMITTED)
    # those that are not followed have no way either
    rows = np.flatnonzero((energy > 0) & (energy >= least))
    way = np.zeros((len(rows), 1, 3)) if branch.way is None else branch.way[rows]
    count, each = len(rows), way.shape[1] - 1
    # one ray after the other, each piece after the one before
    numbers = np.concatenate([parent[rows, None], number + np.arange(count * each).reshape(count, each)], axis=1)
    of, ones = np.repeat(rows, each), np.ones(count * each, int)
    ends = way[:, :-1].reshape(-1, 3), way[:, 1:].reshape(-1, 3)
    pieces = *ends, energy[of], energy[of], front.n[of], depth * ones, kind[of], Fate.SPLIT * ones, front.ray[of]
    parent[rows] = numbers[:, -1]
    cast = branch.start + gap * branch.direction
    gone = _Front(branch.start, cast, branch.direction, energy, front.n, front.alpha, kind, front.ray, parent)
    return (*pieces, numbers[:, :-1].ravel(), np.zeros((count * each, 3)), -ones), gone


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


def _split(crossing: _Crossing, front: _Front, point: NDArray, normal: NDArray, gap: float) -> list[_Front]:
    """The reflected and the transmitted _Front of rays that meet an interface at `point` (N, 3)."""
    sides, _, wavelength, side = crossing
    here, ahead = (wavelength, side), (wavelength, 1 - side)
    against = np.where(side == 0, -1.0, 1.0)[:, None] * normal  # stands against the rays, as in thesis figure 2.1
    cos_i = np.minimum(np.abs(_dot(front.direction, normal)), 1.0)
    R = sides.reflectance(cos_i, wavelength, side)
    mirrored = _unit(front.direction + 2 * cos_i[:, None] * against)
    n_i, n_t = (np.where(n == 0, np.nan, n)[:, None] for n in (sides.n[here], sides.n[ahead]))
    gone = _unit(refracted(front.direction, against, cos_i[:, None], n_i, n_t))
    gone[sides.opaque[ahead]] = np.nan
    if not sides.is_complex[wavelength[0]]:  # with loss, what is neither reflected nor goes on is absorbed at once
        R = np.where(np.isnan(gone[:, 0]), 1.0, R)
    away, parent = gap * against, front.parent  # back to the side the rays came from
    kinds = np.full_like(parent, Kind.REFLECTED), np.full_like(parent, Kind.TRANSMITTED)
    own, other = ((front.energy * share) for share in (R, 1 - R))
    return [
        _Front(point, point + away, mirrored, own, sides.n[here], sides.alpha[here], kinds[0], front.ray, parent),
        _Front(point, point - away, gone, other, sides.n[ahead], sides.alpha[ahead], kinds[1], front.ray, parent),
    ]


def _dot(a: NDArray, b: NDArray) -> NDArray:
    return np.einsum("ij,ij->i", a, b)


def _unit(vectors: NDArray) -> NDArray:
    """Vectors (N, 3) that are nearly of length 1 made so."""
    return vectors / np.sqrt(_dot(vectors, vectors))[:, None]

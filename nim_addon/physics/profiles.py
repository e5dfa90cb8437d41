# SPDX-License-Identifier: GPL-3.0-or-later
"""Profiles of graded balls: an index that depends on the distance from the centre alone, as a device, function or table.

The ball has radius 1, in a medium of index 1. What decides its rays is the optical radius rho = abs(n) r: the invariant
p = n r sin(angle to the radius) makes a ray turn back where rho = p (Bouguer; Born and Wolf 3.2.3). Angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..base.text import unknown

Index = Callable[[NDArray], NDArray]

CORES = ("mirror", "black", "textured")
CENTRE = 1e-15  # nearer to it no ray is followed
MATCHED = 1e-6  # how far abs(n) may be from 1 at the rim, and from itself across a jump
_NEAREST = 1e-4  # rays that pass the centre this near must come out again
_PROBES = 2048  # radii at which an index is looked at, spaced evenly, and as many evenly in the logarithm


def _luneburg(r: NDArray, _: Profile) -> NDArray:
    return np.sqrt(2 - r * r)


def _fisheye(r: NDArray, _: Profile) -> NDArray:
    return 2 / (1 + r * r)


def _eaton(r: NDArray, _: Profile) -> NDArray:
    return np.sqrt(2 / r - 1)


def _invisible(r: NDArray, _: Profile) -> NDArray:
    # sqrt(n) = s solves s^3 + s = 2 / r, by Cardano's formula
    q = np.cbrt(1 / r + np.sqrt(1 / (r * r) + 1 / 27))
    return np.square(q - 1 / (3 * q))


def _turn(r: NDArray, profile: Profile) -> NDArray:
    share = profile.angle / math.pi
    # ln r = ln rho - share arcosh(1 / rho) grows with rho; with rho = 1 / cosh(w) it is a sum that falls as w does
    target = -np.log(r)
    low, high = np.zeros_like(target), target / share
    for _ in range(60):
        w = (low + high) / 2
        less = np.logaddexp(w, -w) - math.log(2) + share * w < target
        low, high = np.where(less, w, low), np.where(less, high, w)
    return np.exp(share * (low + high) / 2)


def _magnifier(r: NDArray, _: Profile) -> NDArray:
    return -1 / (r * r)


def _cloak(r: NDArray, profile: Profile) -> NDArray:
    return (r - profile.hollow) / r / (1 - profile.hollow)  # sqrt(eps_r eps_t), which rho is made of


_INDICES = {
    "luneburg": _luneburg,
    "fisheye": _fisheye,
    "eaton": _eaton,
    "invisible": _invisible,
    "magnifier": _magnifier,
    "cloak": _cloak,
    "turn": _turn,
}
DEVICES = tuple(_INDICES)


@dataclass(frozen=True)
class Profile:
    """A ball whose index depends on the radius r, from 0 to 1, alone; in an index of 1, and of impedance 1 throughout.

    n:       one of DEVICES, a function of radii (N,), or pairs (r, n) between which it is straight; two of one r are a jump
    core:    radius of a ball within, above 0 and below 1, or None
    surface: what the core is, one of CORES: a mirror, black, or textured, of any material that is seen through the rest
    cap:     abs(n) is nowhere more than this, or None
    angle:   by how much the device "turn" turns every ray, above 0 and up to 2 pi
    hollow:  radius that the device "cloak" leads light around
    breaks:  radii where a function n jumps, or has a kink
    The devices are those of Luneburg 1944, Maxwell 1854, Eaton 1952, Minano 2006, Qiu 2012 (its profile derived), Pendry 2006
    and, to turn light by any angle, Hannay and Haeusser 1993; docs/physics.md derives each. The magnifier has a core, a
    mirror of 0.8 where none is given; the cloak is uniaxial, eps = mu = eps_r along the radius, eps_t across it.
    Raises ValueError, one sentence, for what no ray could pass.
    """

    n: str | Index | tuple[tuple[float, float], ...]
    core: float | None = None
    surface: str = "mirror"
    cap: float | None = None
    angle: float = math.pi / 2
    hollow: float = 0.6
    breaks: tuple[float, ...] = ()

    def __post_init__(self):
        if isinstance(self.n, str) and self.n not in DEVICES:
            raise ValueError(unknown("device", self.n, DEVICES))
        if not isinstance(self.n, str) and not callable(self.n):
            try:
                object.__setattr__(self, "n", tuple((float(r), float(n)) for r, n in self.n))
            except (TypeError, ValueError):
                raise ValueError(
                    f"{self.n!r} is no profile; give the name of a device, a function of r, or a table of pairs (r, n)."
                ) from None
        if self.n == "magnifier" and self.core is None:
            object.__setattr__(self, "core", 0.8)
        self._check_numbers()
        if not isinstance(self.n, str) and not callable(self.n):
            self._check_table()
        self._check_index()

    # ---------------------------------------------------------------------------------------------------- what it refuses

    def _check_numbers(self):
        if self.core is not None and not 0 < self.core < 1:
            raise ValueError(
                f"core = {self.core:g} of a ball of radius 1 must be above 0 and below 1; leave it out for none."
            )
        if self.surface not in CORES:
            raise ValueError(unknown("surface of a core", self.surface, CORES))
        if self.cap is not None and not 1 < self.cap < math.inf:
            raise ValueError(f"cap = {self.cap:g} must be above 1, the index at the rim; leave it out for none.")
        if self.cap is not None and self.is_cloak:
            raise ValueError("a cloak has two indices, along the radius and across it, and no cap; leave cap out.")
        if not 0 < self.angle <= 2 * math.pi:
            raise ValueError(f"angle = {self.angle:g} that a ball turns light by must be above 0 and at most 2 pi.")
        if not 0 < self.hollow < 1:
            raise ValueError(f"hollow = {self.hollow:g} in a cloak of radius 1 must be above 0 and below 1.")
        if self.is_cloak and self.core is not None and self.core <= self.hollow:
            object.__setattr__(self, "core", None)  # no light gets there
        for radius in self.breaks:
            if not 0 < radius < 1:
                raise ValueError(f"breaks has {radius:g}, and a ball of radius 1 jumps above 0 and below 1.")

    def _check_table(self):
        pairs = np.array(self.n, float).reshape(-1, 2)
        if not np.isfinite(pairs).all() or len(pairs) < 2:
            raise ValueError("a table of n has a gap: it takes two or more pairs (r, n), all of them finite numbers.")
        r, first = pairs[:, 0], self.core or 0.0
        if (np.diff(r) < 0).any():
            raise ValueError("a table of n must have its radii in growing order.")
        if r[0] > first or r[-1] < 1:
            raise ValueError(
                f"a table of n has a gap: it tells n from r = {r[0]:g} to {r[-1]:g}, and must from {first:g} to 1."
            )

    def _check_index(self):
        r = self.radii
        with np.errstate(all="ignore"):
            n = np.asarray(self.index(r), float)
        if n.shape != r.shape:
            raise ValueError(
                "a function n(r) must give one number for each of the radii that it is called with, an array."
            )
        for at, bad in zip(r[(n == 0) | ~np.isfinite(n)], n[(n == 0) | ~np.isfinite(n)], strict=True):
            raise ValueError(f"n = {bad:g} at r = {at:.4g}: an index is a finite number, and nowhere 0.")
        if abs(abs(n[-1]) - 1) > MATCHED:
            raise ValueError(
                f"n = {n[-1]:g} at the rim does not match the index 1 around the ball; it must be 1 or -1 at r = 1."
            )
        for radius in self.edges:
            before, after = self.beside(radius)
            if abs(abs(before) - abs(after)) > MATCHED * abs(after):
                raise ValueError(
                    f"n jumps from {before:g} to {after:g} at r = {radius:g}, where light would be reflected; "
                    "it may change its sign there, and nothing else."
                )
        jumps = np.searchsorted(self.edges, r[1:], "right") > np.searchsorted(self.edges, r[:-1], "left")
        for at in r[1:][(n[1:] * n[:-1] < 0) & ~jumps]:
            raise ValueError(
                f"n passes through 0 near r = {at:.4g}, where rays turn back before they get there; let it jump from n to -n, "
                "and name that radius in breaks."
            )
        least = self.rho(r[:1])[0]
        if self.core is None and least > _NEAREST:
            raise ValueError(
                f"rays of p below {least:.2g} run into the centre and never come out: abs(n) grows too fast there; "
                "give a core or a cap."
            )

    # ------------------------------------------------------------------------------------------------------- what it is

    @property
    def is_cloak(self) -> bool:
        """Whether it is uniaxial: its index along the radius is another than across it."""
        return self.n == "cloak"

    @property
    def inner(self) -> float:
        """The radius within which no ray is followed: of the core, or next to nothing."""
        return self.core or (self.hollow + 1e-9 if self.is_cloak else CENTRE)

    @cached_property
    def edges(self) -> tuple[float, ...]:
        """The radii, from within, where n jumps or has a kink: each piece between them is integrated on its own."""
        found = set(self.breaks)
        if isinstance(self.n, tuple):
            found |= {r for r, _ in self.n}
        if self.cap is not None:
            found |= set(self._capped())
        return tuple(sorted(radius for radius in found if self.inner < radius < 1))

    def _capped(self) -> list[float]:
        """Where abs(n) passes the cap."""
        r = _probes(self.inner)
        over = np.abs(self._raw(r)) > self.cap
        (places,) = np.nonzero(over[1:] != over[:-1])
        found = []
        for low, high, low_over in zip(r[places], r[places + 1], over[places], strict=True):
            for _ in range(60):
                middle = math.sqrt(low * high)
                if bool(abs(self._raw(np.array([middle]))[0]) > self.cap) == low_over:
                    low = middle
                else:
                    high = middle
            found.append(float(high))
        return found

    @cached_property
    def radii(self) -> NDArray:
        """Radii (N,), from within to the rim, at which the index is looked at."""
        return np.unique([*_probes(self.inner), *self.edges])

    def _raw(self, r: NDArray) -> NDArray:
        if isinstance(self.n, str):
            return _INDICES[self.n](r, self)
        if callable(self.n):
            return np.asarray(self.n(r), float)
        radii, indices = np.array(self.n).T
        return np.interp(r, radii, indices)

    def index(self, r: NDArray) -> NDArray:
        """n (N,) at radii (N,) from `inner` to 1; of the cloak sqrt(eps_r eps_t)."""
        n = self._raw(np.asarray(r, float))
        return n if self.cap is None else np.clip(n, -self.cap, self.cap)

    def rho(self, r: NDArray) -> NDArray:
        """The optical radius abs(n) r (N,) at radii (N,): rays of p turn back where it is p."""
        return np.abs(self.index(r)) * r

    def sense(self, r: NDArray) -> NDArray:
        """How fast a ray goes round at radii (N,), as a factor: the sign of n; sqrt(eps_t / eps_r) of the cloak."""
        return r / (r - self.hollow) if self.is_cloak else np.sign(self.index(r))

    def beside(self, radius: float) -> tuple[float, float]:
        """n just within and just outside of a radius."""
        before, after = self.index(np.array([radius * (1 - 1e-9), radius * (1 + 1e-9)]))
        return float(before), float(after)


def _probes(inner: float) -> NDArray:
    """Radii from `inner` to 1, dense both near the rim and near the centre."""
    return np.unique(
        [*np.linspace(max(inner, CENTRE), 1, _PROBES), *np.geomspace(max(inner, CENTRE), 1, _PROBES)[:-1], 1.0]
    )

# SPDX-License-Identifier: GPL-3.0-or-later
"""Slabs of a uniaxial medium whose axis stands along the normal: each polarisation has a ray of its own.

epsilon is `across` in the plane of the slab and `along` on the axis, mu is 1. Where the two differ in sign the medium is
hyperbolic, as stacks of superconducting layers are (Rakhmanov and others 2010): p-polarised rays bend backwards, at every
angle where along < 0 < across, and no index is negative. Formulas from the dispersion of the extraordinary wave,
kx^2 / along + kz^2 / across = 1, in units of the wave number of vacuum; energy runs along its gradient.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .laws import Branch


class Polarised(NamedTuple):
    """A number (...) of each polarisation: s, across the plane of incidence, and p, within it."""

    s: NDArray
    p: NDArray


@dataclass(frozen=True)
class UniaxialSlab:
    """A slab of a uniaxial medium in vacuum.

    across, along: epsilon within the slab's plane, and along the axis, which is its normal; neither 0
    thickness:     a length, above 0
    Raises ValueError for a number out of its range.
    """

    across: float
    along: float
    thickness: float = 1.0

    def __post_init__(self):
        for name, value in (("across", self.across), ("along", self.along)):
            if not math.isfinite(value) or not value:
                raise ValueError(f"{name} = {value!r} is no permittivity; give a number of either sign, but not 0.")
        if not 0 < self.thickness < math.inf:
            raise ValueError(f"thickness = {self.thickness!r} is no slab; give a length above 0.")

    @property
    def is_hyperbolic(self) -> bool:
        """Whether the two permittivities differ in sign."""
        return self.across * self.along < 0

    def slopes(self, theta: ArrayLike) -> Polarised:
        """Tangents of the angles, signed, at which rays of each polarisation run within; NaN where none does.

        theta: (...) angles of incidence in [0, pi/2), radians
        s: sin(theta) / sqrt(across - sin^2(theta)). p: sin(theta) |across| / (along kz), kz = sqrt(across (1 - sin^2 / along)):
        negative, on the side that the ray came from, where along < 0.
        """
        sine, normal = self._waves(theta)
        return Polarised(sine / normal.s, sine * abs(self.across) / (self.along * normal.p))

    def reflectances(self, theta: ArrayLike) -> Polarised:
        """R (...) of one face, of each polarisation; 1 where no ray runs within. theta: as of slopes()."""
        _, normal = self._waves(theta)
        cosine = np.cos(theta)
        r_s = (cosine - normal.s) / (cosine + normal.s)
        r_p = (abs(self.across) * cosine - normal.p) / (abs(self.across) * cosine + normal.p)
        return Polarised(*(np.where(np.isnan(r), 1.0, np.square(r)) for r in (r_s, r_p)))

    def transmittances(self, theta: ArrayLike) -> Polarised:
        """T (...) of the whole slab, of each polarisation, all inner reflections summed without interference.

        T = (1 - R) / (1 + R), R of one face. theta: as of slopes(). The rest is reflected: nothing is absorbed.
        """
        return Polarised(*((1 - R) / (1 + R) for R in self.reflectances(theta)))

    def shifts(self, theta: ArrayLike) -> Polarised:
        """How far (...) a ray leaves from where it would without the slab, within its far face, in the sense of travel.

        thickness (slope - tan(theta)); NaN where none runs within. theta: as of slopes(). It leaves in the direction that it
        came in, so that what lies behind is seen displaced by as much, however far away.
        """
        straight = np.tan(theta)
        return Polarised(*(self.thickness * (slope - straight) for slope in self.slopes(theta)))

    def _waves(self, theta):
        """sin(theta), and |kz| of s and p within, NaN where the wave decays."""
        theta = np.asarray(theta, float)
        if not np.all((theta >= 0) & (theta < np.pi / 2)):
            raise ValueError("theta must lie in [0, pi/2): an angle of incidence, in radians.")
        sine = np.sin(theta)
        with np.errstate(invalid="ignore"):
            squares = self.across - sine**2, self.across * (1 - sine**2 / self.along)
            return sine, Polarised(*(np.sqrt(np.where(square > 0, square, np.nan)) for square in squares))


@dataclass(frozen=True, eq=False)
class Plate:
    """A slab as rays meet it, a laws.Law: faces of an object that its thickness is in the space of.

    matrix: (3, 3) from there to the world, which may scale it
    """

    slab: UniaxialSlab
    matrix: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def branches(self, points: NDArray, directions: NDArray, normals: NDArray) -> Sequence[Branch]:
        """As laws.Law.branches: s, p, what is reflected, and straight on from behind."""
        along = np.sum(directions * normals, axis=1, keepdims=True)
        behind = along[:, 0] > 0
        cosine = np.clip(-along, 1e-9, 1)
        theta = np.arccos(cosine[:, 0])
        sideways = directions + cosine * normals  # as long as sin(theta)
        # of planes that are one unit apart in that space
        unit = np.linalg.norm(normals @ np.asarray(self.matrix, float), axis=1, keepdims=True)
        thickness = self.slab.thickness * unit
        shares = self.slab.transmittances(theta)
        found = []
        for slope, share in zip(self.slab.slopes(theta), shares, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                way = np.nan_to_num(slope / np.sin(theta))[:, None]
            start = points + thickness * (way * sideways - normals)
            found.append(Branch(np.where(behind, 0, share / 2), start, directions, np.stack([points, start], axis=1)))
        left = np.where(behind, 0, 1 - (shares.s + shares.p) / 2)
        return [
            *found,
            Branch(left, points, directions - 2 * along * normals, reflected=True),
            Branch(behind * 1.0, points, directions),
        ]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between two media: signed Snell law and Fresnel equations in impedances, for all four pairs of signs.

With loss the equations are the same, of complex numbers; rays are refracted by the real parts of n.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dispersion import REPRESENTATIVE_NM
from .limits import Limit, limits
from .media import TRANSPARENT, Medium


class Fresnel(NamedTuple):
    """Power reflectances of s- and p-polarised light, and reflectance and transmittance of unpolarised light."""

    R_s: NDArray
    R_p: NDArray
    R: NDArray
    T: NDArray


class Amplitudes(NamedTuple):
    """Complex amplitude reflectances of s- and p-polarised light, and the complex cosine of the transmitted wave."""

    r_s: NDArray
    r_p: NDArray
    cos_t: NDArray


def _cos_t(n_i, n_t, cos_i):
    """cos(theta_t) by Snell's law (thesis 2.2); 0 in total reflection and where the ray would graze the surface.

    Written so that it is cos(theta_i) to the last bit where |n_i| = |n_t|, which 1 - sin^2 is not near grazing.
    """
    q = n_i / n_t
    cos2_t = (1 - q * q) + q * q * cos_i * cos_i
    return np.sqrt(np.maximum(cos2_t, 0))


def _ratio(a, b):
    """(a - b) / (a + b); -1 where both are 0, or so small that complex numbers overflow in dividing."""
    total = a + b
    none = np.abs(total) < 1e-300
    return np.where(none, -1, (a - b) / np.where(none, 1, total))


def _cosine(cos_i):
    cos_i = np.asarray(cos_i, float)
    if not np.all((cos_i >= 0) & (cos_i <= 1)):
        raise ValueError("cos_i must lie in [0, 1]: the cosine of an angle of incidence from 0 to 90 degrees.")
    return cos_i


def unit(vectors: ArrayLike) -> NDArray:
    """Vectors (..., 3), of any length but zero, made of length 1; ValueError where one is zero or not finite."""
    vectors = np.asarray(vectors, float)
    longest = np.max(np.abs(vectors), axis=-1, keepdims=True)
    if not np.all((longest > 0) & np.isfinite(longest)):
        raise ValueError("a direction or a normal that is zero or not finite points nowhere; give finite vectors.")
    vectors = vectors / longest  # so that the squares in the norm neither overflow nor vanish
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def refracted(d: NDArray, normal: NDArray, cos_i: NDArray, n_i: NDArray, n_t: NDArray) -> NDArray:
    """Interface.refract of rays between media of their own: directions (..., 3), NaN where none goes on.

    d, normal: (..., 3) unit vectors, the normals against the rays; cos_i, n_i, n_t: (..., 1)
    """
    cos_t = _cos_t(n_i, n_t, cos_i)
    t = (n_i / n_t) * (d + cos_i * normal) - cos_t * normal
    return np.where(cos_t > 0, t, np.nan)


def reflectances(
    cos_i: NDArray, n_i: NDArray | float, n_t: NDArray | float, Z_i: NDArray | float, Z_t: NDArray | float
) -> tuple[NDArray, NDArray]:
    """R_s and R_p (...) between media without loss, of indices n and impedances Z (thesis 4.2, 4.3); all broadcast."""
    cos_t = _cos_t(n_i, n_t, cos_i)
    total = cos_t == 0
    with np.errstate(invalid="ignore", divide="ignore"):
        r_s = (Z_t * cos_i - Z_i * cos_t) / (Z_t * cos_i + Z_i * cos_t)
        r_p = (Z_i * cos_i - Z_t * cos_t) / (Z_i * cos_i + Z_t * cos_t)
    return np.where(total, 1.0, np.square(r_s)), np.where(total, 1.0, np.square(r_p))


def amplitudes(cos_i: NDArray, q: NDArray | complex, Z_i: NDArray | complex, Z_t: NDArray | complex) -> Amplitudes:
    """Interface.amplitudes of rays between media of their own: q = n_i / n_t and impedances Z, complex; all broadcast."""
    cos2_t = (1 - q) * (1 + q) + q * q * cos_i * cos_i
    cos_t = np.sqrt(cos2_t + 0j)  # which makes an imaginary part of -0.0, whose root lies below, 0.0
    return Amplitudes(_ratio(Z_t * cos_i, Z_i * cos_t), _ratio(Z_i * cos_i, Z_t * cos_t), cos_t)


@dataclass(frozen=True)
class Interface:
    """A surface between two media: `inside` lies behind its faces, `outside` where the normals point.

    Light arrives from `outside` unless a method says otherwise; `reversed()` looks from the other side.
    """

    inside: Medium
    outside: Medium = Medium(1.0)

    def reversed(self) -> Interface:
        """The same surface seen from inside."""
        return Interface(self.outside, self.inside)

    def at(self, wavelength_nm: float) -> Interface:
        """The interface of plain numbers at a vacuum wavelength, nanometres; ValueError where a medium is not known."""
        return Interface(self.inside.at(wavelength_nm), self.outside.at(wavelength_nm))

    @property
    def is_complex(self) -> bool:
        """Whether one of the two media has loss, or carries no wave."""
        return self.inside.is_complex or self.outside.is_complex

    @property
    def bends_backwards(self) -> bool:
        """Whether a ray leaves on the same side of the normal it came from: the two indices differ in sign."""
        return self.inside.is_nim != self.outside.is_nim

    def refract(self, d: ArrayLike, normal: ArrayLike) -> NDArray:
        """Directions of the transmitted rays, by the signed Snell law (thesis 2.2 to 2.4) of the real parts of n.

        d:      (..., 3) directions the light travels in, of any length but zero
        normal: (..., 3) normals, pointing into `outside`, of any length but zero
        Returns (..., 3) unit vectors, NaN where the light is totally reflected, or no ray goes on in a medium with
        loss: Fresnel's T is absorbed there. A ray with d . normal > 0 arrives from inside. The arguments broadcast.
        Raises ValueError for a vector that is zero or not finite.
        """
        d, normal = np.broadcast_arrays(unit(d), unit(normal))
        along = np.sum(d * normal, axis=-1, keepdims=True)
        # from here on the normal stands against the ray, as in thesis figure 2.1
        normal = np.where(along > 0, -normal, normal)
        inside, outside = (medium.n or math.nan for medium in (self.inside, self.outside))  # 0 where it carries no wave
        n_i = np.where(along > 0, inside, outside)
        n_t = np.where(along > 0, outside, inside)
        return refracted(d, normal, np.minimum(np.abs(along), 1.0), n_i, n_t)

    def fresnel(self, cos_i: ArrayLike) -> Fresnel:
        """Reflectance and transmittance for light arriving from outside (thesis 4.2, 4.3, 4.16, 4.21).

        cos_i: (...) cosines of the angle of incidence, in [0, 1]; ValueError otherwise.
        Returns Fresnel(R_s, R_p, R, T) of the same shape; R = 1 in total reflection and at grazing incidence.
        T = 1 - R is what a renderer takes also of light that arrives in a medium with loss, where the incident and the
        reflected wave interfere and no split of the power is unique; R is held to 1 there.
        """
        cos_i = _cosine(cos_i)
        if self.is_complex:
            R_s, R_p = (np.square(np.abs(r)) for r in self.amplitudes(cos_i)[:2])
            R = np.minimum((R_s + R_p) / 2, 1.0)
            return Fresnel(np.minimum(R_s, 1.0), np.minimum(R_p, 1.0), R, 1 - R)
        Z_i, Z_t = abs(self.outside.impedance), abs(self.inside.impedance)
        R_s, R_p = reflectances(cos_i, self.outside.n, self.inside.n, Z_i, Z_t)
        R = (R_s + R_p) / 2
        return Fresnel(R_s, R_p, R, 1 - R)

    def amplitudes(self, cos_i: ArrayLike) -> Amplitudes:
        """Complex amplitudes for light arriving from outside (thesis 4.2, 4.3), of any two media.

        cos_i: (...) cosines of the angle of incidence, in [0, 1]; ValueError otherwise.
        Returns Amplitudes(r_s, r_p, cos_t) of the same shape. cos_t is the principal root, Re cos_t >= 0: the wave that
        carries energy away and decays, for either sign of n, wherever the outside has no loss. r = -1 at grazing
        incidence, where the equations say nothing. In total reflection without any loss |r| = 1 is right for all, the
        phase of r for a positive n_t.
        """
        cos_i = _cosine(cos_i)
        Z_i, Z_t = complex(self.outside.impedance), complex(self.inside.impedance)
        return amplitudes(cos_i, self.outside.index / self.inside.index, Z_i, Z_t)

    def transmittances(self, cos_i: ArrayLike) -> tuple[NDArray, NDArray]:
        """Shares of the power, T_s and T_p (...), that the transmitted waves carry away from the surface.

        T_s = Re(cos_t / Z_t) |1 + r_s|^2 / Re(cos_i / Z_i), T_p = Re(cos_t Z_t) |1 + r_p|^2 / Re(cos_i Z_i), by
        Poynting's vector along the normal. cos_i: (...), in (0, 1]; ValueError otherwise, and where the outside is no
        medium without loss, since no split of the power is unique there.
        """
        cos_i = _cosine(cos_i)
        if self.outside.is_complex or not np.all(cos_i > 0):
            raise ValueError("power is split at a surface only for light from a medium without loss, not grazing it.")
        r_s, r_p, cos_t = self.amplitudes(cos_i)
        Z_i, Z_t = complex(self.outside.impedance), complex(self.inside.impedance)
        T_s = np.real(cos_t / Z_t) * np.square(np.abs(1 + r_s)) / np.real(cos_i / Z_i)
        # p by its magnetic field, of which r_p is the ratio
        T_p = np.real(cos_t * Z_t) * np.square(np.abs(1 + r_p)) / np.real(cos_i * Z_i)
        return T_s, T_p

    def limits(self, wavelength_nm: float = REPRESENTATIVE_NM) -> tuple[str, ...]:
        """Sentences on where rays end being the physics of this surface, for a person; none where all is well.

        wavelength_nm: in vacuum, nanometres; ValueError where a medium is not known
        """
        return tuple(limit.sentence for limit in self.limits_told(wavelength_nm))

    def limits_told(self, wavelength_nm: float = REPRESENTATIVE_NM) -> tuple[Limit, ...]:
        """The same as templates and what fills them in, for another language."""
        critical = self.at(wavelength_nm).critical_angle()
        return tuple(limits(self.inside, self.outside, critical, wavelength_nm))

    def theta_t(self, theta_i: ArrayLike) -> NDArray:
        """Signed angle of transmission, radians, for light from outside at `theta_i` (...) in [0, pi/2] (thesis 2.3).

        Negative where the interface bends backwards, NaN in total reflection, or where no ray goes on. By the real parts
        of n.
        """
        theta_i = np.asarray(theta_i, float)
        ratio = self.outside.n / self.inside.n if self.inside.n else math.nan
        sine = ratio * np.sin(theta_i)
        with np.errstate(invalid="ignore"):
            return np.where(np.abs(sine) < 1, np.arcsin(sine), np.nan)

    def critical_angle(self) -> float | None:
        """Angle of incidence, radians, from which light from outside is totally reflected (thesis 2.9); None if never.

        With loss, from which no ray goes on.
        """
        if not self.outside.n:
            return None
        ratio = abs(self.inside.n / self.outside.n)
        return math.asin(ratio) if ratio < 1 else None

    def brewster_angle(self, polarization: str = "p") -> float | None:
        """Angle of incidence, radians, at which light of that polarisation ("p" or "s") is not reflected; None if nowhere.

        Setting r_p = 0 (thesis 4.3) and Snell's law give sin^2 = (Z_i^2 - Z_t^2) / (Z_i^2 - q^2 Z_t^2), q = n_i / n_t;
        r_s = 0 the same with the impedances exchanged. With |mu| = 1 on both sides only "p" has one. Where the
        impedances and |n| agree nothing is reflected at any angle, and no single one is named. With a k above TRANSPARENT,
        or where a medium carries no wave, there is none.
        """
        if polarization not in ("p", "s"):
            raise ValueError(f"polarization {polarization!r} is neither 'p' nor 's'.")
        if any(not medium.n or max(medium.k, medium.mu_imag) > TRANSPARENT for medium in (self.inside, self.outside)):
            return None
        Z_i, Z_t = abs(self.outside.impedance), abs(self.inside.impedance)
        if polarization == "s":
            Z_i, Z_t = Z_t, Z_i
        q = self.outside.n / self.inside.n
        above, below = Z_i**2 - Z_t**2, Z_i**2 - (q * Z_t) ** 2
        # above = 0: no reflection at normal incidence only, which is not Brewster's effect
        if above == 0 or below == 0 or not 0 < above / below < 1:
            return None
        return math.asin(math.sqrt(above / below))


def povray_reflectance(n_i: ArrayLike, n_t: ArrayLike, cos_i: ArrayLike) -> NDArray:
    """Unpolarised reflectance as POV-Ray computes it (thesis A.1 to A.3), for comparison.

    n_i, n_t, cos_i: (...), broadcast. It knows no permeability: it agrees with Interface.fresnel where |mu| is the same
    on both sides (or |epsilon|, which exchanges s and p), for either sign of the indices. Thesis A.3 prints
    (n_i / n_t)^2; POV-Ray's source, and agreement with Fresnel, want (n_t / n_i)^2.
    """
    n_i, n_t, c = np.broadcast_arrays(np.asarray(n_i, float), np.asarray(n_t, float), _cosine(cos_i))
    g2 = np.square(n_t / n_i) + np.square(c) - 1
    g = np.sqrt(np.maximum(g2, 0))
    with np.errstate(invalid="ignore", divide="ignore"):
        R = 0.5 * np.square((g - c) / (g + c)) * (1 + np.square((c * (g + c) - 1) / (c * (g - c) + 1)))
    return np.where(g2 > 0, R, 1.0)

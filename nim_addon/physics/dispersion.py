# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispersion: complex n and mu as functions of the wavelength, and the branch of n that a passive medium has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .notation import shortest
from .spectra import AbsorptionLength, Range, Spectrum, Table, wavelengths

# The wavelength, nanometres, whose n and mu stand for a dispersive medium where one number is wanted: green, the peak
# of daylight vision to 5 nm.
REPRESENTATIVE_NM = 550.0
# The wavelengths, nanometres, between which pictures are made.
VISIBLE_NM: Range = (380.0, 730.0)
# Of |n|, |epsilon| and |mu|: where a curve passes through 0 it is held off it, as n = 0 has no impedance.
_LEAST = 2e-6
_ROUNDING = 8 * np.finfo(float).eps


def upper_root(z: ArrayLike) -> NDArray:
    """The square roots (...) of numbers (...) of the closed upper half plane, each in its first quadrant."""
    return np.sqrt(np.asarray(z, complex) + 0j)  # which makes an imaginary part of -0.0, whose root lies below, 0.0


def refractive_index(epsilon: ArrayLike, mu: ArrayLike) -> NDArray:
    """n = sqrt(epsilon) sqrt(mu) of a passive medium, each root by itself in the upper half plane.

    So Im n >= 0 and Re (mu / n) >= 0, always (Veselago 1968; Smith and Kroll 2000): -1 for epsilon = mu = -1.
    epsilon, mu: (...), broadcast, with imaginary parts of 0 or more; ValueError for a medium with gain.
    """
    for name, values in (("epsilon", epsilon), ("mu", mu)):
        check_passive(name, values)
    return upper_root(epsilon) * upper_root(mu)


def check_passive(name: str, values: ArrayLike) -> None:
    """ValueError where one of the complex values (...) of epsilon, mu or n has an imaginary part below 0."""
    values = np.atleast_1d(np.asarray(values, complex))
    for value in values[~np.isfinite(values)][:1]:
        raise ValueError(f"{name} = {value:g} is not finite; give a number such as -1.5+0.01j.")
    for value in values[values.imag < 0][:1]:
        raise ValueError(
            f"{name} = {shortest(value)} has an imaginary part below 0: such a medium gives light (gain) instead of "
            "absorbing it; time goes as exp(-iwt), so loss is above 0."
        )


def permittivity(n: ArrayLike, mu: ArrayLike) -> NDArray:
    """epsilon = n^2 / mu, complex, of a passive medium; ValueError where n and mu (...) are of none.

    They are of none where Im epsilon < 0, or where n is not sqrt(epsilon) sqrt(mu), as -1.5 with mu = 1 is not.
    """
    n, mu = np.broadcast_arrays(np.atleast_1d(np.asarray(n, complex)), np.atleast_1d(np.asarray(mu, complex)))
    check_passive("n", n)
    check_passive("mu", mu)
    epsilon = n * n / mu
    slack = _ROUNDING * np.abs(epsilon)
    bad = epsilon.imag < -slack
    epsilon = epsilon.real + 1j * np.maximum(epsilon.imag, 0)
    expected = upper_root(epsilon) * upper_root(mu)
    bad |= np.abs(expected - n) > 1e-6 * np.abs(n)
    for one_n, one_mu in zip(n[bad][:1], mu[bad][:1], strict=True):
        raise ValueError(
            f"mu = {shortest(one_mu)} does not go with n = {shortest(one_n)}: no medium without gain has both; "
            "leave mu out to get the sign of n, or give epsilon and mu."
        )
    return epsilon


def default_mu(n: NDArray) -> NDArray:
    """mu (...) where only n (...) is known: the sign of its real part, as in Medium."""
    return np.where(np.real(n) < 0, -1.0, 1.0) + 0j


@dataclass(frozen=True)
class Dispersion:
    """A medium by n, k and mu, or by epsilon and mu, each a number or a function of the wavelength.

    n:       refractive index, complex or with k apart
    k:       extinction, added to n as i k
    mu:      relative permeability; the sign of n where it is None and n is given, 1 where epsilon is
    epsilon: relative permittivity, in the place of n and k
    name:    the word that a person writes for it, a path or one of the catalogue; of no weight in comparing
    source:  where the numbers come from
    Raises ValueError where there is gain, and where the functions share no wavelengths, or not 550 nm.
    """

    n: Spectrum | complex | None = None
    k: Spectrum | complex = 0.0
    mu: Spectrum | complex | None = None
    epsilon: Spectrum | complex | None = None
    name: str | None = field(default=None, compare=False)
    source: str = field(default="", compare=False)

    def __post_init__(self):
        if (self.n is None) == (self.epsilon is None) or (self.n is None and self.k != 0):
            raise ValueError("a medium is given by n, k and mu or by epsilon and mu.")
        least, most = self.range_nm
        if not least <= REPRESENTATIVE_NM <= most:
            hint = " and wavelengths in such files are in micrometres" if least > 1e5 else ""
            raise ValueError(
                f"{self.name or 'the medium'} is known from {least:g} to {most:g} nm, which does not cover "
                f"{REPRESENTATIVE_NM:g} nm, the wavelength that stands for it{hint}."
            )
        knots = {REPRESENTATIVE_NM}
        for _, part in self._parts():
            knots.update(part.wavelengths_nm if isinstance(part, Table) else ())
        self(np.array(sorted(knot for knot in knots if least <= knot <= most)))

    def _parts(self) -> Iterator[tuple[str, Spectrum | complex]]:
        """(key, number or function) of what is given."""
        for key in ("n", "k", "epsilon", "mu"):
            part = getattr(self, key)
            if part is not None and not (key == "k" and part == 0):
                yield key, part

    @property
    def range_nm(self) -> Range:
        """The wavelengths that all its functions are known at, nanometres; LEAST above MOST where there are none."""
        ranges = [part.range_nm for _, part in self._parts() if not isinstance(part, complex | float | int)]
        return max((least for least, _ in ranges), default=0.0), min((most for _, most in ranges), default=np.inf)

    @property
    def has_colours(self) -> bool:
        """Whether anything to be seen changes with the wavelength: more than the k, of parts in a million, of a length."""
        return any(callable(part) and not isinstance(part, AbsorptionLength) for _, part in self._parts())

    def __call__(self, wavelength_nm: ArrayLike) -> tuple[NDArray, NDArray]:
        """Complex n and mu, each (...), at vacuum wavelengths (...), nanometres.

        Raises ValueError for wavelengths outside `range_nm`, and for gain.
        """
        places = wavelengths(wavelength_nm)
        least, most = self.range_nm
        for outside in places[(places < least) | (places > most)][:1]:
            raise ValueError(
                f"{self.name or 'the medium'} is known from {least:g} to {most:g} nm, which does not cover {outside:g} nm."
            )
        parts = {
            key: np.broadcast_to(part(places) if callable(part) else part, places.shape).astype(complex)
            for key, part in self._parts()
        }
        if "epsilon" in parts:
            epsilon, mu = _off_zero(parts["epsilon"]), _off_zero(parts.get("mu", np.ones(places.shape, complex)))
            return refractive_index(epsilon, mu), mu
        n = parts["n"] + 1j * parts.get("k", np.zeros(places.shape))
        if "k" in parts:
            check_passive("n", n)
        n = _off_zero(n)
        mu = parts.get("mu", default_mu(n))
        permittivity(n, mu)
        return n, mu

    def __str__(self) -> str:
        """The name, or what Medium.parse() reads: "epsilon=drude(360 0),mu=drude(360 0)"."""
        return self.name or ",".join(_pair(key, part) for key, part in self._parts())


def _pair(key: str, part: Spectrum | complex) -> str:
    if isinstance(part, AbsorptionLength):
        return f"length={shortest(part.metres)}"
    return f"{key}={shortest(part) if isinstance(part, complex | float | int) else part}"


def _off_zero(values: NDArray) -> NDArray:
    """Complex values (...), of a curve that may pass through 0, none of them too near to it."""
    return np.where(np.abs(values) < _LEAST, np.where(values.real < 0, -_LEAST, _LEAST), values)

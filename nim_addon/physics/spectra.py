# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions of the wavelength, as values: what epsilon, mu, n and k of a dispersive medium are made of.

Each is called with vacuum wavelengths (...) in nanometres and gives numbers (...), complex ones where it may be; is
frozen, hashable and equal by content; has the `range_nm` that it is known in; and str() of it is what read() reads.
The time goes as exp(-i w t), so that loss is a positive imaginary part.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .notation import shortest, to_complex, to_number

Range = tuple[float, float]
EVERYWHERE: Range = (0.0, math.inf)
# Below this many nanometres a wavelength is taken for one in micrometres.
LEAST_NM = 10.0


class Spectrum(Protocol):
    """A function of the wavelength."""

    @property
    def range_nm(self) -> Range:
        """The wavelengths between which it is known, nanometres."""
        ...

    def __call__(self, wavelength_nm: NDArray, /) -> NDArray:
        """Its values (...) at vacuum wavelengths (...), nanometres."""
        ...


def wavelengths(values: ArrayLike) -> NDArray:
    """Vacuum wavelengths (...), nanometres; ValueError for what is none, with a word on micrometres."""
    found = np.asarray(values, float)
    for value in found[~(np.isfinite(found) & (found >= LEAST_NM))][:1]:
        if 0 < value < LEAST_NM:
            raise ValueError(
                f"a wavelength of {value:g} nm is none of light; wavelengths are in nanometres: for {value:g} micrometres "
                f"write {value * 1000:g}."
            )
        raise ValueError(f"a wavelength of {value:g} nm is none; give one such as 550.")
    return found


def positive(name: str, value: float) -> float:
    """A float above 0; ValueError where it is none."""
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} = {value:g} must be above 0.")
    return float(value)


def _text(name: str, *numbers: complex) -> str:
    return f"{name}({' '.join(map(shortest, numbers))})"


@dataclass(frozen=True)
class Drude:
    """Free charges: 1 - w_p^2 / (w^2 + i g w), of epsilon as of mu (Drude 1900; Pendry 1996 for arrays of wires).

    plasma_nm: the wavelength of w_p; damping: g / w_p, 0 without loss
    """

    plasma_nm: float
    damping: float = 0.0
    range_nm = EVERYWHERE

    def __post_init__(self):
        positive("the plasma wavelength of a Drude model", self.plasma_nm)
        _check_damping(self.damping)

    def __call__(self, wavelength_nm: NDArray) -> NDArray:
        w = self.plasma_nm / wavelength_nm  # in units of w_p
        return 1 - 1 / (w * w + 1j * self.damping * w)

    def __str__(self) -> str:
        return _text("drude", self.plasma_nm, self.damping)


@dataclass(frozen=True)
class SplitRing:
    """Split rings: mu = 1 - F w^2 / (w^2 - w_0^2 + i G w) (Pendry 1999, Smith 2000), a Lorentz resonance.

    strength: F, the share of the area that the rings fill, in (0, 1); resonance_nm: the wavelength of w_0;
    damping: G / w_0, 0 without loss
    A model of low frequencies: far above w_0 it goes to 1 - F rather than to 1, and without loss it disperses less than
    causality demands where w^2 > 2 w_0^2.
    """

    strength: float
    resonance_nm: float
    damping: float = 0.0
    range_nm = EVERYWHERE

    def __post_init__(self):
        if not 0 < self.strength < 1:
            raise ValueError(f"F = {self.strength:g} of a split ring must lie between 0 and 1.")
        positive("the resonance of a split ring", self.resonance_nm)
        _check_damping(self.damping)

    def __call__(self, wavelength_nm: NDArray) -> NDArray:
        w = self.resonance_nm / wavelength_nm  # in units of w_0
        with np.errstate(divide="ignore", invalid="ignore"):  # on the resonance itself it is infinite without damping
            return 1 - self.strength * w * w / (w * w - 1 + 1j * self.damping * w)

    def __str__(self) -> str:
        return _text("split-ring", self.strength, self.resonance_nm, self.damping)


def _check_damping(damping: float):
    if not (math.isfinite(damping) and damping >= 0):
        raise ValueError(f"a damping of {damping:g} would give light instead of absorbing it; give 0 or more.")


@dataclass(frozen=True)
class AbsorptionLength:
    """The k of a medium that is grey: light falls to 1/e within so many metres at all wavelengths, k = lambda / (4 pi L)."""

    metres: float
    range_nm = EVERYWHERE

    def __post_init__(self):
        positive("an absorption length, in metres,", self.metres)

    def __call__(self, wavelength_nm: NDArray) -> NDArray:
        return wavelength_nm * 1e-9 / (4 * math.pi * self.metres)

    def __str__(self) -> str:
        return _text("length", self.metres)


@dataclass(frozen=True)
class Table:
    """Numbers at some wavelengths, rising, and on straight lines between them.

    wavelengths_nm: (N,); values: (N,), complex ones too; N is 2 or more
    """

    wavelengths_nm: tuple[float, ...]
    values: tuple[complex, ...]

    def __init__(self, wavelengths_nm: ArrayLike, values: ArrayLike):
        places, numbers = wavelengths(wavelengths_nm), np.asarray(values)
        if places.ndim != 1 or places.shape != numbers.shape or len(places) < 2:
            raise ValueError("a table of the wavelength has two rows or more, each a wavelength and a number.")
        if not np.isfinite(numbers).all():
            where = places[~np.isfinite(numbers)][0]
            raise ValueError(f"a table of the wavelength has a value that is not finite, at {where:g} nm.")
        if not (np.diff(places) > 0).all():
            where = places[1:][np.diff(places) <= 0][0]
            raise ValueError(f"the wavelengths of a table must rise from row to row, which {where:g} nm does not.")
        object.__setattr__(self, "wavelengths_nm", tuple(places.tolist()))
        object.__setattr__(self, "values", tuple(numbers.tolist()))

    @classmethod
    def sampled(cls, function: Callable[[NDArray], ArrayLike], wavelengths_nm: ArrayLike) -> Table:
        """The table of any function of wavelengths (N,), nanometres."""
        places = wavelengths(wavelengths_nm)
        return cls(places, function(places))

    @property
    def range_nm(self) -> Range:
        """The first and the last wavelength, nanometres."""
        return self.wavelengths_nm[0], self.wavelengths_nm[-1]

    def __call__(self, wavelength_nm: NDArray) -> NDArray:
        return np.interp(wavelength_nm, self.wavelengths_nm, self.values)

    def __str__(self) -> str:
        rows = zip(self.wavelengths_nm, self.values, strict=True)
        return _text("table", *(number for row in rows for number in row))


# How many coefficients each formula has, by its number: the fewest, then the least and the most that go with those.
_FEWEST = {1: 3, 2: 3, 3: 3, 4: 1, 5: 1, 6: 3, 7: 1, 8: 1, 9: 6}
_MOST = {4: 17, 7: 6, 8: 4, 9: 6}


@dataclass(frozen=True)
class Formula:
    """n by one of the nine formulas of the refractiveindex.info database, with its coefficients, of micrometres.

    1 Sellmeier, 2 Sellmeier-2, 3 polynomial, 4 RefractiveIndex.INFO, 5 Cauchy, 6 gases, 7 Herzberger, 8 retro, 9 exotic
    (M. N. Polyanskiy, "Dispersion formulas", refractiveindex.info). Coefficients that are left out are 0.
    """

    number: int
    coefficients: tuple[float, ...]
    range_nm: Range = EVERYWHERE

    def __post_init__(self):
        object.__setattr__(self, "coefficients", tuple(map(float, self.coefficients)))
        if self.number not in _FEWEST:
            raise ValueError(f"there is no formula {self.number}; refractiveindex.info has formulas 1 to 9.")
        count, pairs = len(self.coefficients), self.number in (1, 2, 3, 5, 6)
        most = _MOST.get(self.number, math.inf)
        if not _FEWEST[self.number] <= count <= most or (pairs and count % 2 == 0):
            raise ValueError(f"formula {self.number} does not take {count} coefficients.")
        if not all(map(math.isfinite, self.coefficients)):
            raise ValueError(f"a coefficient of formula {self.number} is not finite.")
        least, most = self.range_nm
        if not 0 <= least < most:
            raise ValueError(f"a range of {least:g} to {most:g} nm holds no wavelength.")

    def __call__(self, wavelength_nm: NDArray) -> NDArray:
        with np.errstate(all="ignore"):
            n = _formula(self.number, self.coefficients, wavelength_nm / 1000)
        if not np.isfinite(n).all():
            where = np.atleast_1d(wavelength_nm)[~np.isfinite(np.atleast_1d(n))][0]
            raise ValueError(f"formula {self.number} gives no index at {where:g} nm.")
        return n

    def __str__(self) -> str:
        text = _text(f"formula{self.number}", *self.coefficients)
        return text if self.range_nm == EVERYWHERE else f"{text}@{':'.join(map(shortest, self.range_nm))}"


def _formula(number: int, c: Sequence[float], x: NDArray) -> NDArray:
    """n at wavelengths x, micrometres."""
    first, pairs = c[0], list(zip(c[1::2], c[2::2], strict=False))
    c = (*c, *[0.0] * (17 - len(c)))
    x2 = x * x
    if number == 1:
        return np.sqrt(1 + first + sum(b * x2 / (x2 - d * d) for b, d in pairs))
    if number == 2:
        return np.sqrt(1 + first + sum(b * x2 / (x2 - d) for b, d in pairs))
    if number == 3:
        return np.sqrt(first + sum(b * x**d for b, d in pairs))
    if number == 4:
        poles = sum(c[i] * x ** c[i + 1] / (x2 - c[i + 2] ** c[i + 3]) for i in (1, 5))
        return np.sqrt(first + poles + sum(c[i] * x ** c[i + 1] for i in range(9, 17, 2)))
    if number == 5:
        return np.full_like(x, first) + sum((b * x**d for b, d in pairs), np.zeros_like(x))
    if number == 6:
        return 1 + first + sum((b / (d - 1 / x2) for b, d in pairs), np.zeros_like(x))
    if number == 7:
        pole = 1 / (x2 - 0.028)
        return first + c[1] * pole + c[2] * pole**2 + c[3] * x2 + c[4] * x2**2 + c[5] * x2**3
    if number == 8:
        ratio = first + c[1] * x2 / (x2 - c[2]) + c[3] * x2  # (n^2 - 1) / (n^2 + 2)
        return np.sqrt((1 + 2 * ratio) / (1 - ratio))
    return np.sqrt(first + c[1] / (x2 - c[2]) + c[3] * (x - c[4]) / ((x - c[4]) ** 2 + c[5]))


def cauchy(*coefficients: float) -> Formula:
    """n = A + B / lambda^2 + C / lambda^4 + ..., lambda in micrometres (Cauchy 1836)."""
    return Formula(5, tuple(_with_powers(coefficients)))


def _with_powers(coefficients: Sequence[float]):
    yield from coefficients[:1]
    for i, coefficient in enumerate(coefficients[1:], 1):
        yield from (coefficient, -2.0 * i)


def sellmeier(*coefficients: float) -> Formula:
    """n^2 = 1 + B_1 lambda^2 / (lambda^2 - C_1) + ..., of B_1, C_1, B_2, C_2, ..., C in micrometres^2 (Sellmeier 1871)."""
    return Formula(2, (0.0, *coefficients))


def _table(*numbers: complex) -> Table:
    if len(numbers) % 2 or any(number.imag for number in map(complex, numbers[::2])):
        raise ValueError("a table of the wavelength has two rows or more, each a wavelength and a number.")
    return Table([complex(number).real for number in numbers[::2]], numbers[1::2])


_MADE: dict[str, Callable[..., Spectrum]] = {
    "drude": Drude,
    "split-ring": SplitRing,
    "length": AbsorptionLength,
    "cauchy": cauchy,
    "sellmeier": sellmeier,
    "table": _table,
}


def read(text: str) -> Spectrum:
    """The function of the wavelength that str() wrote, or a person: "drude(360 0.01)", "cauchy(1.5 0.004)", ...

    Raises ValueError, with the names that there are, where it is none.
    """
    match = re.fullmatch(r"([a-z-]+?)(\d?)\(([^()]*)\)(?:@([^:]+):([^:]+))?", text.strip(), re.IGNORECASE)
    names = ", ".join((*_MADE, "formula1 to formula9"))
    if not match:
        raise ValueError(f"{text!r} is no function of the wavelength; write one as drude(360 0.01), of {names}.")
    name, digit, words, least, most = match.groups()
    try:
        numbers = [to_complex(word) for word in words.replace(",", " ").split()]
        limits = (to_number(least), to_number(most)) if least else EVERYWHERE
    except ValueError:
        raise ValueError(f"{text!r} holds what is not a number; write it as drude(360 0.01).") from None
    name = name.lower()
    if name == "formula" and digit and not any(map(np.iscomplex, numbers)):
        return Formula(int(digit), tuple(complex(value).real for value in numbers), limits)
    if name not in _MADE or digit or least:
        raise ValueError(f"{text!r} is no function of the wavelength; write one as drude(360 0.01), of {names}.")
    try:
        return _MADE[name](*numbers)
    except TypeError:
        raise ValueError(f"{text!r} has too many or too few numbers, or complex ones, for {name}.") from None

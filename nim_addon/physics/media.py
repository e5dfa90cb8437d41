# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: isotropic and homogeneous, described by a signed refractive index and a permeability.

Both are real numbers without loss, complex ones with it, and functions of the wavelength where the medium disperses.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .catalogue import DISPERSIVE, named
from .dispersion import REPRESENTATIVE_NM, Dispersion, permittivity, refractive_index
from .notation import plain_minus, shortest, to_complex, to_number
from .refractiveindex import SUFFIXES, load
from .spectra import AbsorptionLength, Spectrum, read, wavelengths

__all__ = [
    "LEAST_MAGNITUDE",
    "MEDIA",
    "MOST_MAGNITUDE",
    "OPAQUE",
    "TRANSPARENT",
    "Medium",
    "plain_minus",
    "to_number",
]

# Of |n| and |mu|: beyond, their squares and ratios leave the numbers that are computed with.
LEAST_MAGNITUDE, MOST_MAGNITUDE = 1e-6, 1e6
# Of k. Below the first, what absorbs reflects and refracts as if it did not; beyond the second, light is gone within some
# wavelengths, so that a surface shows its reflection and nothing else.
TRANSPARENT, OPAQUE = 1e-5, 1e-3

_KEYS = ("n", "k", "length", "mu", "epsilon")


def _finite(name: str, value: Any) -> float | complex:
    """The number, a complex one only where it has an imaginary part."""
    try:
        if isinstance(value, str):
            number = to_complex(value)
        elif np.iscomplexobj(value):
            number = complex(value)
            number = number if number.imag else number.real
        else:
            number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} is not a number; write it like -1.5.") from None
    if not (math.isfinite(number.real) and math.isfinite(number.imag)):
        raise ValueError(f"{name} = {value} is not finite; give a number such as -1.5.")
    return number


def _check_range(name: str, value: complex):
    if not LEAST_MAGNITUDE <= abs(value) <= MOST_MAGNITUDE:
        raise ValueError(
            f"{name} = {value:g} is out of range; |{name}| lies between {LEAST_MAGNITUDE:g} and {MOST_MAGNITUDE:g}."
        )


def _sign(n: complex) -> float:
    """mu where nothing is said of it."""
    return -1.0 if n.real < 0 else 1.0


@dataclass(frozen=True, init=False)
class Medium:
    """A medium of refractive index n + i k and relative permeability mu + i mu_imag, all without unit.

    `mu` defaults to the sign of `n`: 1 for a dielectric, -1 for a negative-index material (thesis 4, after Veselago).
    Both may be complex, Medium(-1.33+0.01j), or the words of a person, such as "-1.33". Time goes as exp(-i w t): loss
    is a positive imaginary part. A medium with a `dispersion` has the numbers of 550 nm; at() gives those of another
    wavelength.
    Raises ValueError for n = 0, for NaN and infinities, for what is not between LEAST_MAGNITUDE and MOST_MAGNITUDE,
    for gain, and for an n and a mu that no medium has together, as real ones of different sign.
    """

    n: float
    mu: float
    k: float
    mu_imag: float
    dispersion: Dispersion | None

    def __init__(self, n: complex | str, mu: complex | str | None = None):
        index = _finite("n", n)
        if index == 0:
            raise ValueError("n = 0 refracts nothing; give a positive index, or a negative one for a NIM.")
        _check_range("n", index)
        permeability = _sign(index) if mu is None else _finite("mu", mu)
        if isinstance(index, complex) or isinstance(permeability, complex):
            _check_range("mu", permeability)  # before it divides
            permittivity(index, permeability)
        elif permeability * index <= 0:
            word, sign = ("negative", "below") if index < 0 else ("positive", "above")
            raise ValueError(
                f"mu = {permeability:g} does not go with n = {index:g}: a {word} index needs mu {sign} 0 "
                f"(leave mu out to get {math.copysign(1, index):+.0f})."
            )
        _check_range("mu", permeability)
        self._set(index, permeability)

    def _set(self, n: complex, mu: complex, dispersion: Dispersion | None = None):
        put = object.__setattr__  # since it is frozen
        put(self, "n", n.real + 0.0)  # 0.0 for -0.0
        put(self, "mu", mu.real + 0.0)
        put(self, "k", n.imag)
        put(self, "mu_imag", mu.imag)
        put(self, "dispersion", dispersion)

    @classmethod
    def of(cls, epsilon: complex | Spectrum, mu: complex | Spectrum = 1.0) -> Medium:
        """The medium of a relative permittivity and permeability, numbers or functions of the wavelength.

        n = sqrt(epsilon) sqrt(mu), each root in the upper half plane. Raises ValueError as Medium() does.
        """
        if callable(epsilon) or callable(mu):
            return cls.dispersive(Dispersion(epsilon=epsilon, mu=mu))
        permeability = _finite("mu", mu)
        n = complex(refractive_index(_finite("epsilon", epsilon), permeability))
        return cls(n, permeability)

    @classmethod
    def of_index(
        cls, n: complex | Spectrum, k: complex | Spectrum = 0.0, mu: complex | Spectrum | None = None
    ) -> Medium:
        """The medium of a refractive index and an extinction, numbers or functions of the wavelength.

        mu: the sign of n at each wavelength if None. Raises ValueError as Medium() does.
        """
        if callable(n) or callable(k) or callable(mu):
            return cls.dispersive(Dispersion(n=n, k=k, mu=mu))
        return cls(_finite("n", n) + 1j * _finite("k", k), mu)

    @classmethod
    def dispersive(cls, dispersion: Dispersion) -> Medium:
        """The medium of a dispersion, with the n and mu of 550 nm."""
        n, mu = dispersion(REPRESENTATIVE_NM)
        medium = cls(complex(n), complex(mu))
        medium._set(complex(n), complex(mu), dispersion)
        return medium

    def at(self, wavelength_nm: float) -> Medium:
        """The medium of plain numbers at a vacuum wavelength, nanometres; ValueError where it is not known there."""
        if self.dispersion is None:
            wavelengths(wavelength_nm)
            return self
        n, mu = self.dispersion(wavelength_nm)
        return Medium(complex(n), complex(mu))

    def spectrum(self, wavelength_nm: ArrayLike) -> tuple[NDArray, NDArray]:
        """Complex n and mu, each (...), at vacuum wavelengths (...), nanometres; ValueError as of at()."""
        if self.dispersion is None:
            places = wavelengths(wavelength_nm)
            return np.full(places.shape, self.index, complex), np.full(places.shape, self.permeability, complex)
        return self.dispersion(wavelength_nm)

    @property
    def index(self) -> complex:
        """The complex refractive index n + i k."""
        return complex(self.n, self.k)

    @property
    def permeability(self) -> complex:
        """The complex relative permeability."""
        return complex(self.mu, self.mu_imag)

    @property
    def file(self) -> Path | None:
        """The file that it was read from, as it was named; None where it was not."""
        name = self.dispersion.name if self.dispersion else None
        return Path(name) if name and name.lower().endswith(SUFFIXES) else None

    def with_mu(self, mu: complex | str) -> Medium:
        """The medium of the same n and k with another permeability.

        Raises ValueError where no medium has both, and for one that is given by its epsilon, since n goes with mu there.
        """
        if self.dispersion is None:
            return Medium(self.index if self.is_complex else self.n, mu)
        if self.dispersion.epsilon is not None:
            raise ValueError(f"mu = {mu} does not go with {self}, which has a mu of its own; leave mu out.")
        return self.dispersive(replace(self.dispersion, mu=_finite("mu", mu), name=None))

    @property
    def is_complex(self) -> bool:
        """Whether n or mu has an imaginary part: the medium absorbs, or carries no wave at all."""
        return self.k != 0 or self.mu_imag != 0

    @property
    def is_real(self) -> bool:
        """Whether the medium is a real n and mu and no more: without loss and without dispersion."""
        return self.dispersion is None and not self.is_complex

    @property
    def is_single_negative(self) -> bool:
        """Whether epsilon and mu are real and differ in sign: without loss, and without a wave within."""
        return self.is_complex and self.n == 0 and self.mu_imag == 0

    @property
    def impedance(self) -> float | complex:
        """Wave impedance relative to vacuum: |mu| / |n|, positive for every real medium (thesis 4.12, 4.13).

        mu / n of a complex one, with a real part of 0 or more.
        """
        return self.permeability / self.index if self.is_complex else abs(self.mu / self.n)

    @property
    def epsilon(self) -> float | complex:
        """Relative permittivity n^2 / mu: it has the sign of n in a real medium (thesis 2.5)."""
        if self.is_complex:
            return complex(permittivity(self.index, self.permeability)[0])
        return self.n * self.n / self.mu

    @property
    def is_nim(self) -> bool:
        """Whether this is a negative-index material: n < 0."""
        return self.n < 0

    def absorption(self, wavelength_nm: float = REPRESENTATIVE_NM) -> float:
        """Absorption coefficient alpha = 4 pi k / lambda, per metre (Beer and Lambert), at a vacuum wavelength in nm."""
        return float(self.absorptions(wavelength_nm))

    def absorptions(self, wavelength_nm: ArrayLike) -> NDArray:
        """The same (...) at vacuum wavelengths (...), nanometres; ValueError as of at()."""
        return 4 * math.pi * self.spectrum(wavelength_nm)[0].imag / (np.asarray(wavelength_nm, float) * 1e-9)

    @property
    def content(self) -> str:
        """A text that parse() reads and that holds all of it, also where str() is but a name or the path of a file."""
        if self.dispersion is None:
            return str(self)
        return str(dataclasses.replace(self.dispersion, name=None))

    def absorption_length(self, wavelength_nm: float = REPRESENTATIVE_NM) -> float:
        """1 / alpha, the metres within which light falls to 1/e; inf without loss."""
        alpha = self.absorption(wavelength_nm)
        return 1 / alpha if alpha else math.inf

    @classmethod
    def parse(cls, text: str | Medium) -> Medium:
        """The medium a person wrote, or str() of one.

        A name of MEDIA or DISPERSIVE; an index, "-1.33" or "-1.33+0.01j"; "n=-1.33,mu=-10"; n with k, or with the
        absorption length in metres, "n=-1.33,length=0.05"; "epsilon=-2,mu=-1"; any of these but a length as a function
        of the wavelength, "epsilon=drude(360),mu=drude(360)" (spectra.read); or the path of a file of
        refractiveindex.info, which ends in .yml.
        Raises ValueError with the names that exist, the nearest first, when `text` is none of these.
        """
        if isinstance(text, Medium):
            return text
        path, word = str(text).strip(), plain_minus(str(text).strip())
        if path.lower().endswith(SUFFIXES):
            return cls.dispersive(load(path))
        if word.lower() in MEDIA:
            return MEDIA[word.lower()]
        if word.lower() in DISPERSIVE:
            return cls.dispersive(named(word.lower()))
        if re.match(rf"({'|'.join(_KEYS)})\s*=", word):
            return cls._of_words(word)
        if re.match(r"[-+.\d]|nan$|inf", word, re.IGNORECASE):
            return cls(word)
        names = (*MEDIA, *DISPERSIVE)
        near = difflib.get_close_matches(word.lower(), names, 1, 0.5)
        hint = f"did you mean {near[0]}? Media" if near else "media"
        last = "n=-1.33,mu=-10, or a .yml file of refractiveindex.info"
        raise ValueError(f"there is no medium {word!r}; {hint} are {', '.join(names)}, an index such as -1.33, {last}.")

    @classmethod
    def _of_words(cls, text: str) -> Medium:
        """parse() of what has keys."""
        pairs = [part.partition("=") for part in re.split(r",(?![^()]*\))", text)]
        values = {key.strip(): value.strip() for key, _, value in pairs}
        keys = set(values)
        if len(values) != len(pairs) or not (
            ("n" in keys and keys <= {"n", "k", "mu"})
            or ("n" in keys and keys <= {"n", "length", "mu"})
            or ("epsilon" in keys and keys <= {"epsilon", "mu"})
        ):
            raise ValueError(
                f"medium {text!r} is not understood; write n=-1.33 or n=-1.33,mu=-10, with k or length (in metres) if "
                "it absorbs, or epsilon=-2,mu=-1."
            )
        if keys <= {"n", "mu"} and not any("(" in value for value in values.values()):
            return cls(values["n"], values.get("mu"))
        parts = {key: read(value) if "(" in value else _finite(key, value) for key, value in values.items()}
        if "length" in parts:
            length = parts.pop("length")
            if not isinstance(length, float):
                raise ValueError(f"medium {text!r} is not understood; a length is metres, such as length=0.05.")
            parts["k"] = AbsorptionLength(length)
        return cls.of(**parts) if "epsilon" in parts else cls.of_index(**parts)

    def __str__(self) -> str:
        if self.dispersion is not None:
            return str(self.dispersion)
        text = f"n={shortest(self.index)}"  # shortest that reads back the same
        return text if self.permeability == _sign(self.index) else f"{text},mu={shortest(self.permeability)}"


# The indices of the thesis (chapter 5, appendices A and B); `nim` is its liquid, of figures 5.1 to 5.9.
MEDIA = MappingProxyType(
    {
        "vacuum": Medium(1.0),
        "air": Medium(1.0),
        "water": Medium(1.33),
        "glass": Medium(1.5),
        "diamond": Medium(2.418),
        "nim": Medium(-1.33),
        "nim-1.025": Medium(-1.025),
        "nim-1.33": Medium(-1.33),
        "nim-1.5": Medium(-1.5),
        "nim-2.418": Medium(-2.418),
        "nim-4.1": Medium(-4.1),
        "nim-mu10": Medium(-1.33, -10.0),
        "nim-mu25": Medium(-1.33, -25.0),
    }
)

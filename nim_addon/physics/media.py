# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: isotropic, homogeneous, without loss, described by a signed refractive index and a permeability."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

# Of |n| and |mu|: beyond, their squares and ratios leave the numbers that are computed with.
LEAST_MAGNITUDE, MOST_MAGNITUDE = 1e-6, 1e6

Number = TypeVar("Number", int, float)


def plain_minus(text: str) -> str:
    """The text with the minus sign that keyboards have, which Python reads, in the place of the true one."""
    return text.replace("\N{MINUS SIGN}", "-")


def to_number(text: str, type_: type[Number] = float) -> Number:
    """The float, or the int, that a person wrote; ValueError where it is none, or what only Python reads, as 1_5."""
    if "_" in text:
        raise ValueError(text)
    return type_(plain_minus(text))


def _finite(name: str, value: float | str) -> float:
    try:
        number = to_number(value) if isinstance(value, str) else float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} is not a number; write it like -1.5.") from None
    if not math.isfinite(number):
        raise ValueError(f"{name} = {value} is not finite; give a number such as -1.5.")
    return number


def _check_range(name: str, value: float):
    if not LEAST_MAGNITUDE <= abs(value) <= MOST_MAGNITUDE:
        raise ValueError(
            f"{name} = {value:g} is out of range; |{name}| lies between {LEAST_MAGNITUDE:g} and {MOST_MAGNITUDE:g}."
        )


@dataclass(frozen=True, init=False)
class Medium:
    """A medium of refractive index `n` and relative permeability `mu`, both without unit.

    `mu` defaults to the sign of `n`: 1 for a dielectric, -1 for a negative-index material (thesis 4, after Veselago).
    Raises ValueError for n = 0, for NaN and infinities, for what is not between LEAST_MAGNITUDE and MOST_MAGNITUDE,
    and for a `mu` whose sign is not that of `n`. Both may be the words of a person, such as "-1.33".
    """

    n: float
    mu: float

    def __init__(self, n: float | str, mu: float | str | None = None):
        n = _finite("n", n)
        if n == 0:
            raise ValueError("n = 0 refracts nothing; give a positive index, or a negative one for a NIM.")
        _check_range("n", n)
        mu = math.copysign(1.0, n) if mu is None else _finite("mu", mu)
        if mu * n <= 0:
            word, sign = ("negative", "below") if n < 0 else ("positive", "above")
            raise ValueError(
                f"mu = {mu:g} does not go with n = {n:g}: a {word} index needs mu {sign} 0 "
                f"(leave mu out to get {math.copysign(1, n):+.0f})."
            )
        _check_range("mu", mu)
        object.__setattr__(self, "n", n)
        object.__setattr__(self, "mu", mu)

    @property
    def impedance(self) -> float:
        """Wave impedance relative to vacuum, |mu| / |n|: positive for every medium (thesis 4.12, 4.13)."""
        return abs(self.mu / self.n)

    @property
    def epsilon(self) -> float:
        """Relative permittivity n^2 / mu: it has the sign of n (thesis 2.5)."""
        return self.n * self.n / self.mu

    @property
    def is_nim(self) -> bool:
        """Whether this is a negative-index material (n < 0 and mu < 0)."""
        return self.n < 0

    @classmethod
    def parse(cls, text: str | Medium) -> Medium:
        """The medium a person wrote: a name of MEDIA, an index ("-1.33"), or "n=-1.33,mu=-10".

        Raises ValueError with the names that exist, the nearest first, when `text` is none of these.
        """
        if isinstance(text, Medium):
            return text
        word = plain_minus(str(text).strip())
        if word.lower() in MEDIA:
            return MEDIA[word.lower()]
        if re.match(r"(n|mu)\s*=", word):
            parts = [part.partition("=") for part in word.split(",")]
            values = {key.strip(): value.strip() for key, _, value in parts}
            if "n" not in values or not set(values) <= {"n", "mu"} or len(values) != len(parts):
                raise ValueError(f"medium {word!r} is not understood; write n=-1.33 or n=-1.33,mu=-10.")
            return cls(values["n"], values.get("mu"))
        if re.match(r"[-+.\d]|nan$|inf", word, re.IGNORECASE):
            return cls(word)
        near = difflib.get_close_matches(word.lower(), MEDIA, 1, 0.5)
        hint = f"did you mean {near[0]}? Media" if near else "media"
        raise ValueError(
            f"there is no medium {word!r}; {hint} are {', '.join(MEDIA)}, an index such as -1.33, or n=-1.33,mu=-10."
        )

    def __str__(self) -> str:
        n, mu = (repr(number).removesuffix(".0") for number in (self.n, self.mu))  # shortest that reads back the same
        return f"n={n}" if abs(self.mu) == 1 else f"n={n},mu={mu}"


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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers as a person writes them, real and complex."""

from __future__ import annotations

import re
from typing import TypeVar

Number = TypeVar("Number", int, float)


def plain_minus(text: str) -> str:
    """The text with the minus sign that keyboards have, which Python reads, in the place of the true one."""
    return text.replace("\N{MINUS SIGN}", "-")


def to_number(text: str, type_: type[Number] = float) -> Number:
    """The float, or the int, that a person wrote; ValueError where it is none, or what only Python reads, as 1_5."""
    if "_" in text:
        raise ValueError(text)
    return type_(plain_minus(text))


def to_complex(text: str) -> float | complex:
    """The number that a person wrote, "1.5", "-1.33+0.01j" or with i, a float where it is real; ValueError for none."""
    word = plain_minus(text).strip()
    if "_" in word or word[-1:] not in ("i", "j"):
        return to_number(word)
    number = complex(re.sub(r"\s*([-+])\s*", r"\1", word[:-1]) + "j")
    return number if number.imag else number.real


def shortest(number: complex) -> str:
    """The shortest text that to_complex() reads back as the same number."""
    number = complex(number)
    real, imaginary = (repr(part).removesuffix(".0") for part in (number.real, number.imag))
    return real if number.imag == 0 else f"{real}{'' if imaginary.startswith('-') else '+'}{imaginary}j"

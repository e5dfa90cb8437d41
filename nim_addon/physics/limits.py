# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays end being the physics of a surface, in plain sentences: templates, for a panel to say in another language."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from .media import OPAQUE, TRANSPARENT, Medium


class Limit(NamedTuple):
    """A sentence as a template, and what fills it in."""

    text: str
    values: dict[str, Any]

    @property
    def sentence(self) -> str:
        """The sentence, in English."""
        return self.text.format(**self.values)


def limits(inside: Medium, outside: Medium, critical_angle: float | None, wavelength_nm: float) -> Iterator[Limit]:
    """The limits of a surface that light meets from `outside`; none where all is well.

    critical_angle: radians, from which no ray goes on at that wavelength, or None
    wavelength_nm:  in vacuum, nanometres; ValueError where a medium is not known
    """
    there = inside.at(wavelength_nm)
    values = {"medium": str(inside), "wavelength": f"{wavelength_nm:g}"}
    if there.is_single_negative and inside.dispersion:
        yield Limit(
            "{medium} has an epsilon and a mu of different sign at {wavelength} nm: it reflects everything, at every angle.",
            values,
        )
    elif there.is_single_negative:
        yield Limit(
            "{medium} has an epsilon and a mu of different sign: it reflects everything, at every angle.", values
        )
    elif there.k > OPAQUE:
        micrometres = there.absorption_length(wavelength_nm) * 1e6
        yield Limit(
            "{medium} absorbs what enters within {micrometres} micrometres at {wavelength} nm (k > {most}): it is a mirror "
            "for all that one can see, and nothing is seen through it.",
            values | {"micrometres": f"{micrometres:.2g}", "most": f"{OPAQUE:g}"},
        )
    elif there.k > TRANSPARENT and critical_angle is not None:
        yield Limit(
            "From {angle} degrees on no ray goes on in {medium} at {wavelength} nm (|sin| > |Re n|): what is not reflected "
            "is absorbed.",
            values | {"angle": f"{math.degrees(critical_angle):.1f}"},
        )
    lit_in = outside.at(wavelength_nm)
    if max(lit_in.k, lit_in.mu_imag) > TRANSPARENT:
        yield Limit(
            "Light that starts in {medium}, which absorbs, has no unique split between reflected and transmitted: "
            "T = 1 - R is taken.",
            {"medium": str(outside)},
        )

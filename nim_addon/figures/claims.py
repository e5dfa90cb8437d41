# SPDX-License-Identifier: GPL-3.0-or-later
"""A claim: what a figure must show, as a number predicted and a number measured."""

from typing import NamedTuple


class Claim(NamedTuple):
    """One number of a figure.

    text:      what is claimed, one line
    predicted: what the theory says
    measured:  what the picture, or the traced rays, say
    allowed:   the largest difference between the two that still counts as agreement
    unit:      of all three, "" for a pure number
    """

    text: str
    predicted: float
    measured: float
    allowed: float
    unit: str = ""

    @property
    def holds(self) -> bool:
        """Whether the measured number is the predicted one, within what is allowed; False for NaN."""
        return bool(abs(self.predicted - self.measured) <= self.allowed)

    def row(self) -> str:
        """The claim as one line of text."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{'holds' if self.holds else 'FAILS'}  {self.text}: "
            f"predicted {self.predicted:.6g}{unit}, measured {self.measured:.6g}{unit} (allowed {self.allowed:.2g})"
        )

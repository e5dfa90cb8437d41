# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of an interface, by the angle of incidence or by the wavelength: what the command prints and the panel copies."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from .interface import Interface

HEAD = ("theta_i", "theta_t", "R_s", "R_p", "R", "T")
SPECTRAL_HEAD = ("wavelength", "n", "k", "R_s", "R_p", "R")

# The angle of incidence and that of refraction, degrees, None where no ray goes on, and the four of Interface.fresnel().
Row = tuple[int | float | None, ...]


def table(interface: Interface, step: int) -> list[Row]:
    """A row each `step` degrees from 0, and one at 90, of media at one wavelength."""
    angles = np.unique([*range(0, 90, step), 90])
    cosines = np.where(angles == 90, 0.0, np.cos(np.radians(angles)))
    theta_t = np.degrees(interface.theta_t(np.radians(angles)))
    return [
        (int(theta), None if math.isnan(refracted) else float(refracted) + 0.0, *map(float, powers))
        for theta, refracted, *powers in zip(angles, theta_t, *interface.fresnel(cosines), strict=True)
    ]


def spectrum(interface: Interface, wavelengths_nm: NDArray, angle: float) -> list[Row]:
    """A row for each wavelength: it, n and k of the inside, and R_s, R_p and R at an angle of incidence, degrees."""
    cosine = 0.0 if angle == 90 else math.cos(math.radians(angle))
    rows = []
    for wavelength in wavelengths_nm.tolist():
        there = interface.at(wavelength)
        rows.append((wavelength, there.inside.n, there.inside.k, *map(float, there.fresnel(cosine)[:3])))
    return rows


def as_csv(head: Sequence[str], rows: Iterable[Row]) -> str:
    """The table as comma-separated values, its head first; a cell is empty where there is no number."""
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(head)
    out.writerows([["" if value is None else value for value in row] for row in rows])
    return text.getvalue()

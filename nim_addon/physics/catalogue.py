# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that disperse, by name: measured ones, and negative-index ones to teach with. Read when they are asked for.

The measured ones are files of the refractiveindex.info database (CC0) in data/, each with its references.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from ..base.shipped import SPECTRA
from .dispersion import REPRESENTATIVE_NM, VISIBLE_NM, Dispersion
from .refractiveindex import curves, load
from .spectra import Drude, Table, cauchy

_MEASURED = ("water-daimon", "n-bk7", "n-sf11", "fused-silica", "diamond-peter", "silver", "gold")
_NEGATIVE = ("nim-mirror", "nim-normal", "nim-causal", "fishnet")
# The names, as a person writes them. `water` and `diamond` without more are the constants of the thesis.
DISPERSIVE = (*_MEASURED, *_NEGATIVE)

_N = -1.33  # of those to teach with, at 550 nm
# (|n| - 1) / (|n_F| - |n_C|) of nim-mirror and, but for its sign, of nim-normal: as strong as the heaviest flints
_ABBE = 20.0
_F_MICROMETRES, _C_MICROMETRES = 0.48613, 0.65627  # Fraunhofer's lines


@functools.cache
def named(name: str) -> Dispersion:
    """The medium of that name, one of DISPERSIVE; KeyError for another."""
    if name in _MEASURED:
        return load(SPECTRA / f"{name}.yml", name)
    return {"nim-mirror": _mirror, "nim-normal": _normal, "nim-causal": _causal, "fishnet": _fishnet}[name]()


def _sloped(sign: int, name: str, source: str) -> Dispersion:
    """n = -(1.33 + B (1 / lambda^2 - 1 / 550^2)), |n| rising to the blue by Abbe's number 20 for sign = 1."""
    slope = sign * (-1 - _N) / _ABBE / (_F_MICROMETRES**-2 - _C_MICROMETRES**-2)
    return Dispersion(n=cauchy(_N + slope / (REPRESENTATIVE_NM / 1000) ** 2, -slope), name=name, source=source)


def _mirror() -> Dispersion:
    return _sloped(
        1,
        "nim-mirror",
        "Made up to teach with: the curve of a glass with its sign turned, n(550 nm) = -1.33, "
        "(|n| - 1) / (|n_F| - |n_C|) = 20; |n| grows to the blue, which no medium without loss can do (it is acausal).",
    )


def _normal() -> Dispersion:
    return _sloped(
        -1,
        "nim-normal",
        "Made up to teach with: n(550 nm) = -1.33, as small a slope as nim-mirror's, of the sign that causality "
        "demands (|n| grows to the red), but less of it than causality demands without loss.",
    )


def _causal() -> Dispersion:
    plasma = Drude(REPRESENTATIVE_NM / math.sqrt(1 - _N))
    return Dispersion(
        epsilon=plasma,
        mu=plasma,
        name="nim-causal",
        source="Made up to teach with: epsilon = mu, Drude without loss, n = 1 - 2.33 (lambda / 550 nm)^2, the least "
        "dispersion that causality allows where nothing is lost (Landau and Lifshitz, Electrodynamics of Continuous "
        "Media, section 84: w dn/dw >= 2 (1 - n)); red bends most, and nothing is reflected straight on.",
    )


def _fishnet() -> Dispersion:
    """Its wavelengths, 1200 to 1775 nm, on a straight line to those of VISIBLE_NM."""
    parts, references = curves(SPECTRA / "fishnet.yml", "fishnet")
    measured = parts["n"]
    assert isinstance(measured, Table)
    infrared = measured.wavelengths_nm
    visible = np.interp(infrared, (infrared[0], infrared[-1]), VISIBLE_NM)
    return Dispersion(
        n=Table(np.round(visible, 6), measured.values),
        name="fishnet",
        source=f"{references} An infrared medium in false colours: its wavelengths, {infrared[0]:g} to "
        f"{infrared[-1]:g} nm, stand at {VISIBLE_NM[0]:g} to {VISIBLE_NM[1]:g} nm; of its loss the database has nothing, "
        "so it has none here, and mu is the sign of n.",
    )

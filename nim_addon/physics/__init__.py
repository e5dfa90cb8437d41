# SPDX-License-Identifier: GPL-3.0-or-later
"""The physics, without bpy: media, of one number or of all wavelengths, and the interface between them. numpy only."""

from .catalogue import DISPERSIVE
from .dispersion import REPRESENTATIVE_NM, VISIBLE_NM, Dispersion
from .interface import Amplitudes, Fresnel, Interface, povray_reflectance
from .media import MEDIA, Medium
from .spectra import AbsorptionLength, Drude, Formula, SplitRing, Table, cauchy, sellmeier

__all__ = [
    "DISPERSIVE",
    "MEDIA",
    "REPRESENTATIVE_NM",
    "VISIBLE_NM",
    "AbsorptionLength",
    "Amplitudes",
    "Dispersion",
    "Drude",
    "Formula",
    "Fresnel",
    "Interface",
    "Medium",
    "SplitRing",
    "Table",
    "cauchy",
    "povray_reflectance",
    "sellmeier",
]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The physics, without bpy: media and the interface between them. numpy only."""

from .interface import Fresnel, Interface, povray_reflectance
from .media import MEDIA, Medium

__all__ = ["MEDIA", "Fresnel", "Interface", "Medium", "povray_reflectance"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics: light traced from the lamps, baked into what shines on the surfaces where it landed.

lights -> photons (a render from the light) -> atlas, density (textures) -> placing (copies that shine), held together by
baking.Bake; digest says whether a bake still is of its scene.
"""

from ..cycles.visibility import CAUSTICS_MARK
from .baking import MILLION, PHOTONS, REPORT, Bake, bake, best_way, out_of_date
from .frames import wanted
from .placing import COLLECTION, baked, clear, left

__all__ = [
    "CAUSTICS_MARK",
    "COLLECTION",
    "MILLION",
    "PHOTONS",
    "REPORT",
    "Bake",
    "bake",
    "baked",
    "best_way",
    "clear",
    "left",
    "out_of_date",
    "wanted",
]

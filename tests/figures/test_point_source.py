# SPDX-License-Identifier: GPL-3.0-or-later
"""The caustic of a point source, measured in small pictures: each claim holds, and fails of another index."""

import dataclasses

import numpy as np
import pytest

from nim_addon.figures import point_source
from nim_addon.physics import Medium

(FIGURE,) = point_source.FIGURES


def of_index(image, n):
    return image._replace(parameters=dataclasses.replace(image.parameters, liquid=Medium(n, n)))


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_landings_turn_where_the_caustic_is(backend, images, failing):
    made = images(FIGURE, (256, 8), 8, "landings", backend=backend)
    for m, ratio in point_source.POINTS:
        image = made[f"landings_{m:g}_{ratio:g}"]
        assert not failing(point_source.point_claims(image, m, ratio))
        radius, cusp = point_source.point_claims(image, m + 0.01, ratio)
        assert not radius.holds and not cusp.holds


def test_the_light_of_a_lamp_ends_at_the_caustic(images, failing):
    made = images(FIGURE, (128, 128), 8, "floor", photons=1 << 18)
    water, nim = made["floor_water"], made["floor_nim"]
    assert not failing(point_source.floor_claims(water, "water")) and not failing(point_source.floor_claims(nim, "NIM"))
    assert len(failing(point_source.floor_claims(of_index(nim, -1.4), "NIM"))) == 2
    assert failing(point_source.floor_claims(water._replace(each=nim.each), "water"))


def test_rings_hold_all_the_light_that_comes_in_under_the_lamp():
    """Of n = -1 all light of the lamp meets again as deep as it is high, and is in the innermost ring there."""
    former = point_source.DEPTH
    try:
        point_source.DEPTH = point_source.HEIGHT
        light = point_source.rings_of_theory(Medium(-1.0)) * np.pi * np.diff(np.square(point_source.RINGS))
    finally:
        point_source.DEPTH = former
    assert light[1:].sum() == 0 and point_source.POWER * 0.35 < light[0] < point_source.POWER / 2

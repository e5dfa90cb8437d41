# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of the real sun: what lands under a sphere is what numpy traces, and not what another index would bring."""

import dataclasses

import numpy as np
import pytest

from nim_addon.figures import caustics
from nim_addon.scenes import sphere

SIZE = (64, 64)


def test_a_sphere_of_nothing_leaves_the_ground_evenly_lit():
    nothing = sphere.SphereParameters(n=1.0, sun_angle=0.53)
    cells = caustics.ground_in_the_sun(nothing, 0)
    towards = np.divide(sphere.TOWARDS_SUN, np.linalg.norm(sphere.TOWARDS_SUN))
    assert cells.mean() == pytest.approx(sphere.SUN_IRRADIANCE[0] * towards[2], rel=0.002)
    assert cells.std() < 0.03 * cells.mean()


def test_the_shadow_lies_away_from_the_sun():
    rows, columns = np.nonzero(caustics.shadow())
    # rows run from +y; the sun stands at -x and -y, and the picture's middle is near the shadow's
    place = caustics.MIDDLE[0] + (columns.mean() + 0.5 - caustics.CELLS / 2) * 2 * caustics.REACH / caustics.CELLS
    assert place == pytest.approx(-sphere.TOWARDS_SUN[0] / sphere.TOWARDS_SUN[2] * sphere.CENTER[2], abs=0.15)
    assert len(rows) > 20


def test_the_light_under_a_nim_sphere_is_that_of_its_own_index(images, failing, monkeypatch):
    monkeypatch.setattr(caustics, "INDICES", (-1.5,))
    image = images(caustics.FIGURES[0], SIZE, 16, "ground_-1.5", photons=1 << 18, texels=512, backend="nodes")[
        "ground_-1.5"
    ]
    assert not failing(caustics.measure_sphere({"ground_-1.5": image}))
    other = image._replace(parameters=dataclasses.replace(image.parameters, n=-1.45, mu=None))
    rows = failing(caustics.measure_sphere({"ground_-1.5": other}))
    assert any("within the shadow" in row for row in rows)

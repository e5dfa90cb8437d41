# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 2.2: what the bottom of the cube lets through, up to the critical angle and no further."""

import numpy as np
import pytest

from nim_addon.figures import cube
from nim_addon.figures.measure import Camera
from nim_addon.figures.recipes import Image
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import cube as scene_of


def test_the_bottom_mirrors_beyond_the_critical_angle(empty_file, render, monkeypatch):
    parameters = scene_of.CubeParameters(elevation=26, turn=0)
    scene = scene_of.build(parameters)
    scene.render.resolution_x = scene.render.resolution_y = 96
    scene.cycles.samples = 32
    cube.bottom(scene)
    image = Image(render(scene)[None], Camera(*scene_of.pose(parameters), (96, 96)), parameters)
    claims = cube.measure({"bottom": image})
    for claim in claims:
        print(claim.row())
    onset, again, dark, *bands = claims
    assert onset.predicted == pytest.approx(62.457, abs=1e-3)
    assert abs(onset.measured - onset.predicted) < 0.3 and abs(again.measured - again.predicted) < 0.2
    assert abs(dark.measured) < 0.003
    np.testing.assert_allclose([c.measured for c in bands], [c.predicted for c in bands], atol=0.02)
    # the same picture does not do for another glass
    monkeypatch.setattr(cube, "INTERFACE", Interface(Medium(1.52), Medium(1.33)))
    assert not all(claim.holds for claim in cube.measure({"bottom": image}))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 2.2: what the bottom of the cube lets through, up to the critical angle and no further."""

import numpy as np
import pytest

from nim_addon.figures import cube
from nim_addon.physics import Interface, Medium


def test_the_bottom_mirrors_beyond_the_critical_angle(images, monkeypatch):
    image = images(cube.FIGURES[0], (96, 96), 32)["bottom"]
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

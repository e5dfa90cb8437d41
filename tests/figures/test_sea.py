# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 2.4, measured in small pictures."""

import math

import numpy as np
import pytest

from nim_addon.figures import sea
from nim_addon.scenes.sea import SeaParameters


def test_every_claim_holds_and_the_wrong_index_or_waves_fail(images, failing):
    images = images(sea.FIGURES[0], (160, 120), 16)
    assert not failing(sea.measure(images))
    heavier = SeaParameters(liquid="1.36", waves=0)
    wrong = {name: image._replace(parameters=heavier) for name, image in images.items() if "calm" in name} | {
        "up_waves": images["up_waves"]._replace(parameters=SeaParameters(seed=2))
    }
    rows = failing(sea.measure(wrong))
    assert sum("angular radius" in row for row in rows) == 2
    assert any("likeness" in row for row in rows)


def test_the_ellipse_of_a_cone():
    # by the two ends of the axis along the tilt
    across, along = sea.axes(48.75, 20, 100)
    ends = [100 * math.tan(math.radians(angle)) for angle in (20 + 48.75, 20 - 48.75)]
    assert along == pytest.approx((ends[0] - ends[1]) / 2)
    assert sea.axes(30, 0, 1) == pytest.approx((math.tan(math.radians(30)),) * 2) and across < along


def test_half_axes_of_an_ellipse():
    rows, columns = np.indices((200, 300)) + 0.5
    ellipse = np.square((columns - 140) / 90) + np.square((rows - 100) / 60) < 1
    assert sea.half_axes(ellipse) == pytest.approx((90, 60), abs=0.1)

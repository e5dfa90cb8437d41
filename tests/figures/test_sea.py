# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 2.4, measured in small pictures."""

import math

import numpy as np
import pytest

from nim_addon.figures import sea
from nim_addon.figures.measure import Camera
from nim_addon.figures.recipes import Image
from nim_addon.scenes import scene_type
from nim_addon.scenes.sea import SeaParameters


@pytest.fixture
def images(empty_file, render):
    """The measured Images of figure 2.4, smaller."""
    kind, size, found = scene_type("sea"), (160, 120), {}
    for recipe in sea.FIGURES[0].recipes:
        if not recipe.shown:
            parameters = kind.parameters.read(recipe.settings)
            scene = kind.build(parameters)
            scene.render.resolution_x, scene.render.resolution_y = size
            scene.cycles.samples = 16
            recipe.change(scene)
            found[recipe.name] = Image(render(scene)[None], Camera(*kind.pose(parameters), size), parameters)
    return found


def test_every_claim_holds_and_the_wrong_index_or_waves_fail(images):
    assert not [claim.row() for claim in sea.measure(images) if not claim.holds]
    heavier = SeaParameters(liquid="1.36", waves=0)
    wrong = {name: image._replace(parameters=heavier) for name, image in images.items() if "calm" in name} | {
        "up_waves": images["up_waves"]._replace(parameters=SeaParameters(seed=2))
    }
    rows = [claim.row() for claim in sea.measure(wrong) if not claim.holds]
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

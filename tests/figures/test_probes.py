# SPDX-License-Identifier: GPL-3.0-or-later
"""What the figures' changes share does what it says."""

import numpy as np
import pytest

from nim_addon.cycles.nodes import Nodes
from nim_addon.figures import probes
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage

SIDE = 64


def away(scene, render):
    """(2 SIDE^2,) how far the rays of the second sample are from the middles of their pixels, in pixels."""
    pixels = render(scene)[..., :2] - SIDE
    middle = np.arange(SIDE) + 0.5 - SIDE / 2
    return np.abs(np.concatenate([pixels[..., 0] - middle, (pixels[..., 1] + middle[:, None])]).ravel())


def test_rays_go_through_the_middles_of_pixels_by_no_box(empty_file, render):
    def place(nodes: Nodes):
        position = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
        return nodes.vector("ADD", position, (SIDE,) * 3)

    stage = Stage("rays", (SIDE, SIDE), "nodes")
    stage.mesh("Board", *shapes.rectangle((-SIDE, -SIDE), (SIDE, SIDE)), surfaces.shining("Board", place))
    camera = stage.camera((0, 0, 5), (0, 0, 0), 40)
    camera.data.type, camera.data.ortho_scale = "ORTHO", SIDE
    stage.scene.cycles.samples = 1
    probes.set_up(stage.scene)
    for width in (0.01, 1.0):
        stage.scene.cycles.filter_width = width
        assert np.sqrt(np.mean(away(stage.scene, render) ** 2)) == pytest.approx(1 / np.sqrt(12), rel=0.02)
    probes.through_the_middles(stage.scene)
    assert np.quantile(away(stage.scene, render), 0.99) < 0.01

# SPDX-License-Identifier: GPL-3.0-or-later
"""The two backends give the same pictures: every scene, liquid and view."""

import bpy
import numpy as np
import pytest

from nim_addon.scenes import scene_type

PICTURES = [
    *(("sphere", f"n={n}", "companions=yes") for n in (1.5, -1.5, -1.025, -4.1)),
    *(("glass", f"liquid={liquid}", f"view={view}") for liquid in ("none", "water", "nim") for view in ("side", "top")),
    *(
        ("pool", f"liquid={liquid}", f"view={view}")
        for liquid in ("water", "nim", "n=-1.33,mu=-10")  # an empty pool has no interface
        for view in ("side", "top", "window")
    ),
]
BLOCK = 8


@pytest.mark.parametrize("name, settings", [(name, settings) for name, *settings in PICTURES], ids=str)
def test_backends_agree(name, settings, empty_file, render):
    type_ = scene_type(name)
    parameters = type_.parameters.read(settings)
    pictures = []
    for seed, backend in enumerate(("osl", "nodes")):
        scene = type_.build(parameters, backend)
        assert scene.cycles.shading_system == (backend == "osl")
        scene.render.resolution_x, scene.render.resolution_y = 6 * BLOCK, 5 * BLOCK
        # sample 0 sits in the middle of the pixel for every seed: it would not be noise
        scene.cycles.seed, scene.cycles.samples = seed, 65
        scene.cycles.use_sample_subset, scene.cycles.sample_offset, scene.cycles.sample_subset_length = True, 1, 64
        pictures.append(render(scene).astype(float).mean(axis=2))
    assert len([group for group in bpy.data.node_groups if group.get("nim_interface") == "nodes"]) == 1
    # the scene cancels in the difference: what is left in a block is its noise
    noise = (pictures[0] - pictures[1]).reshape(5, BLOCK, 6, BLOCK).transpose(0, 2, 1, 3).reshape(30, BLOCK * BLOCK)
    error = noise.std(axis=1, ddof=1) / BLOCK
    z = noise.mean(axis=1) / np.maximum(error, 1e-6)
    assert np.abs(z).max() < 4.5, z.round(1)
    assert np.sqrt(np.mean(np.square(z))) < 1.6, z.round(1)
    total = noise.mean() / max(noise.std(ddof=1) / np.sqrt(noise.size), 1e-6)
    assert abs(total) < 4

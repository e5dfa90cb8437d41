# SPDX-License-Identifier: GPL-3.0-or-later
"""The window scene: what stands in the frame, that its pane turns with it, and what is refused."""

import numpy as np
import pytest

from nim_addon.cycles.lenslets import window_of
from nim_addon.cycles.material import asked_closures
from nim_addon.cycles.slabs import slab_of
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import window
from nim_addon.scenes.window import WindowParameters, build

pytestmark = pytest.mark.usefixtures("empty_file")


def pane_of(scene):
    ((node, path),) = asked_closures(scene.objects["Window"].active_material)
    return node, path


def test_the_pane_is_of_the_law_that_is_asked_for():
    scene = build(WindowParameters(eta=-1.25, aperture=0.5))
    assert window_of(*pane_of(scene)) == LensletWindow(-1.25, aperture=0.5)
    scene = build(WindowParameters(pane="slab", across=1.5, along=-2, thickness=0.25))
    assert slab_of(*pane_of(scene)) == UniaxialSlab(1.5, -2.0, 0.25)
    z = np.array([vertex.co.z for vertex in scene.objects["Window"].data.vertices])
    assert sorted(set(z.round(6))) == [-0.125, 0.125]
    assert "Window" not in build(WindowParameters(pane="none")).objects


@pytest.mark.parametrize("kind", ["lenslets", "slab"])
def test_the_pane_turns_with_its_frame(kind):
    parameters = WindowParameters(pane=kind, turn=30)
    scene = build(parameters)
    middle, axes = window.pane(parameters)
    pane = scene.objects["Window"]
    pane.update_tag()
    scene.view_layers[0].update()
    corners = np.array([pane.matrix_world @ vertex.co for vertex in pane.data.vertices[:4]])
    np.testing.assert_allclose(corners.mean(axis=0), middle, atol=1e-6)
    np.testing.assert_allclose((corners - middle) @ axes[2], 0, atol=1e-6)
    np.testing.assert_allclose(np.abs((corners - middle) @ axes[:2].T), [window.HALF] * 4, atol=1e-6)
    normal = pane.matrix_world.to_3x3() @ pane.data.polygons[0].normal
    np.testing.assert_allclose(normal, axes[2], atol=1e-6)
    assert scene.objects["Frame"].rotation_euler == pane.rotation_euler


def test_the_queen_stands_where_she_is_said_to(render):
    parameters = WindowParameters(distance=2.5)
    queen = build(parameters).objects["Queen"]
    z = [vertex.co.z + queen.location.z for vertex in queen.data.vertices]
    assert (min(z) + max(z)) / 2 == pytest.approx(parameters.piece[2]) == pytest.approx(window.MIDDLE)
    assert queen.location.y == 2.5


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["eta=0"], ("eta", "not 0")),
        (["aperture=0"], ("aperture",)),
        (["pane=slab", "along=0"], ("along", "not 0")),
        (["pane=glass"], ("pane", "lenslets")),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(one_sentence, settings, words):
    with pytest.raises(ValueError) as caught:
        WindowParameters.read(settings)
    one_sentence(caught.value, *words)

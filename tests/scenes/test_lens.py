# SPDX-License-Identifier: GPL-3.0-or-later
"""The lens scene: what stands where, and that the ball's image is in the hoop."""

import numpy as np
import pytest

from nim_addon.figures import probes
from nim_addon.figures.measure import Camera
from nim_addon.scenes import lens
from nim_addon.scenes.lens import LensParameters, build, pose

pytestmark = pytest.mark.usefixtures("empty_file")


def test_the_plate_sits_in_its_frame_and_the_ball_behind_it():
    scene = build(LensParameters(thickness=0.4, distance=0.2))
    assert set(scene.objects.keys()) == {"Table", "Floor", "Lens", "Frame", "Ball", "Pole", "Knob", "Hoop", "Camera"}
    y = np.array([vertex.co.y for vertex in scene.objects["Lens"].data.vertices])
    assert sorted(set(y.round(6))) == [0, pytest.approx(0.4)]
    assert tuple(scene.objects["Ball"].location) == pytest.approx((0, 0.6, lens.MIDDLE))
    node = scene.objects["Lens"].active_material.node_tree.nodes["NIM Interface"]
    assert node.inputs["Index Inside"].default_value == node.inputs["Permeability Inside"].default_value == -1


@pytest.mark.parametrize("n, distance, y", [(-1, 0.2, -0.2), (-2, 0.13, -0.07), (-1, 0.5, None), (1.33, 0.2, None)])
def test_the_hoop_stands_where_the_image_is_if_there_is_one_before_the_plate(n, distance, y):
    scene = build(LensParameters(n=n, thickness=0.4, distance=distance))
    if y is None:
        assert "Hoop" not in scene.objects
        return
    points = np.array([vertex.co for vertex in scene.objects["Hoop"].data.vertices])
    assert (points[:, 1].max() + points[:, 1].min()) / 2 == pytest.approx(y, abs=1e-6)
    ring = points[np.abs(points[:, 2] - lens.MIDDLE) < 0.05]
    assert np.abs(ring[:, 0]).max() == pytest.approx(lens.HOOP + lens.WIRE, rel=0.01)


def test_an_index_of_zero_is_refused():
    with pytest.raises(ValueError, match="n = 0 refracts nothing"):
        LensParameters(n=0)


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("view", ["front", "side"])
def test_the_ball_is_seen_in_the_hoop(view, backend, render):
    parameters = LensParameters(view=view)
    scene = build(parameters, backend)
    probes.set_up(scene)
    probes.show_only(scene, "Lens", "Ball")
    probes.paint(scene.objects["Ball"], probes.glow("White", (1, 1, 1)))
    probes.sky(scene)
    size = 128, 96
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.cycles.samples = 16
    pixels = render(scene)[..., 0]
    camera = Camera(*pose(parameters), size)
    place = np.stack(np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5), axis=-1)
    wanted = camera.pixels_of(parameters.image)
    if view == "side":  # what is beside the plate is the ball itself
        pixels = np.where(np.hypot(*(place - wanted).T).T < 25, pixels, 0)
    found = np.sum(place * pixels[..., None], axis=(0, 1)) / pixels.sum()
    assert found == pytest.approx(wanted, abs=0.5)
    # as large as a ball of its own size would be there
    away = np.linalg.norm(np.subtract(parameters.image, camera.eye))
    assert pixels.sum() == pytest.approx(np.pi * (camera.scale * lens.RADIUS / away) ** 2, rel=0.05)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The drop scene: a wall with a hole, the sun behind it, and from where the sun stands the ring that a NIM sends back."""

import numpy as np
import pytest

from nim_addon.caustics import lights
from nim_addon.physics import MEDIA, Medium, deviation
from nim_addon.scenes import drop
from nim_addon.scenes.drop import DropParameters, build

pytestmark = pytest.mark.usefixtures("empty_file")


def test_the_wall_faces_the_drop_and_has_a_round_hole():
    vertices, faces = drop.wall(1.02, 9.0)
    corners = vertices[np.array(faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normals[:, 1] < 0) and not normals[:, ::2].any()
    radius = np.hypot(*vertices[:, ::2].T)
    np.testing.assert_allclose(radius[: drop.SEGMENTS], 1.02)
    assert np.abs(vertices[:, ::2]).max() == 9.0
    # it covers the square but for the hole, whose edge is of chords
    hole = drop.SEGMENTS / 2 * 1.02**2 * np.sin(2 * np.pi / drop.SEGMENTS)
    assert shoelace(corners[..., ::2]) == pytest.approx(18**2 - hole)


def shoelace(corners):
    """The area of polygons (N, K, 2)."""
    x, y = corners[..., 0], corners[..., 1]
    return np.abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)).sum() / 2


@pytest.mark.parametrize("distance", [2.0, 4.0, 40.0])
def test_all_stands_in_line_with_the_sun(distance):
    scene = build(DropParameters(distance=distance))
    assert set(scene.objects.keys()) == {"Wall", "Drop", "Camera"}
    assert tuple(scene.objects["Wall"].location) == pytest.approx((0, distance * drop.RADIUS, 0))
    assert not any(scene.objects["Drop"].location)
    sun = lights.sun_of(scene)
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-6)
    assert sun.irradiance == pytest.approx(drop.SUN_IRRADIANCE)
    assert scene.camera.location.y < 0


def test_the_drop_is_of_what_is_asked_for_or_is_not_there():
    node = (
        build(DropParameters(liquid=Medium(-1.33, -2))).objects["Drop"].active_material.node_tree.nodes["NIM Interface"]
    )
    assert node.inputs["Index Inside"].default_value == pytest.approx(-1.33)
    assert node.inputs["Permeability Inside"].default_value == -2
    assert set(build(DropParameters(liquid=None)).objects.keys()) == {"Wall", "Camera"}


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("liquid", ["nim", "water"])
def test_from_the_sun_a_nim_shows_a_ring_where_its_light_comes_straight_back(liquid, backend, render):
    medium = MEDIA[liquid]
    scene = build(DropParameters(liquid=medium, view="sun", sun_angle=2.0), backend)
    size, samples = 128, 64
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.cycles.samples = samples
    pixels = render(scene)[..., 0]
    place = ((np.arange(size) + 0.5) / size * 2 - 1) * drop.SEEN
    b = np.hypot(*np.meshgrid(place, place))
    ring = (b > 0.3) & (b < 0.95)
    if not medium.is_nim:
        assert (pixels[ring] > 100).mean() < 0.01
        return
    bright = ring & (pixels > 100)
    # the sun's disk is as wide on the drop as light is turned by its width
    assert b[bright].mean() == pytest.approx(deviation.glory(medium.n), abs=0.004)
    assert np.abs(b[bright] - deviation.glory(medium.n)).mean() < 0.02
    # beyond the hole the wall is black, on whose back the sun shines
    assert pixels[b > 1.1].max() == 0

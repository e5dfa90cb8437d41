# SPDX-License-Identifier: GPL-3.0-or-later
"""The sea: its waves, and that nothing but the deep and the sky is seen."""

import numpy as np
import pytest

from nim_addon.scenes import scene_type, sea, waves

pytestmark = pytest.mark.usefixtures("empty_file")


def built(**values):
    return sea.build(sea.SeaParameters(**values))


def test_waves_have_the_height_asked_for():
    z, _ = sea.swell(*np.random.default_rng(0).uniform(-300, 300, (2, 100_000)), 0.2, 3)
    assert 4 * z.std() == pytest.approx(0.2, rel=0.01)
    assert z.mean() == pytest.approx(0, abs=2e-3)


@pytest.mark.parametrize("time", [0, 7.3])
def test_normals_are_the_slopes_of_the_heights(time):
    x, y = np.random.default_rng(0).uniform(-6, 6, (2, 100))
    step = 1e-5
    _, normal = sea.swell(x, y, 0.2, 3, time)
    for axis, (dx, dy) in enumerate(((step, 0), (0, step))):
        rise = sea.swell(x + dx, y + dy, 0.2, 3, time)[0] - sea.swell(x - dx, y - dy, 0.2, 3, time)[0]
        assert -normal[:, axis] / normal[:, 2] == pytest.approx(rise / (2 * step), abs=1e-6)


def test_the_mesh_carries_the_exact_normals():
    mesh = built(waves=0.2, time=2).objects["Liquid"].data
    vertices, faces, normals = sea.liquid_surface(0.2, 1, 2)
    places = np.empty(vertices.size, np.float32)
    mesh.vertices.foreach_get("co", places)
    assert np.abs(places.reshape(-1, 3) - vertices).max() < 1e-5
    kept = np.empty(len(mesh.loops) * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", kept)
    off = np.abs(kept.reshape(-1, 3) - normals[np.array(faces).ravel()]).max(axis=1)
    # Blender keeps them in 16 bits an angle, off the faces' own: coarser where the faces are
    near = np.all(np.abs(vertices[np.array(faces).ravel(), :2]) < sea.FINE, axis=1)
    assert off[near].max() < 1e-3 and off.max() < 5e-3


def test_a_wave_of_six_metres_travels_at_three_metres_a_second(monkeypatch):
    monkeypatch.setattr(waves, "COUNT", 1)
    monkeypatch.setattr(sea, "WAVELENGTHS", (6.0, 6.0))
    speed = 3.0607  # of deep water
    along = waves.random_waves(3, sea.WAVELENGTHS)[0][:, 0] * 6 / (2 * np.pi)
    x, y = np.random.default_rng(0).uniform(-6, 6, (2, 100))
    before, normal = sea.swell(x, y, 0.2, 3)
    after, normal_after = sea.swell(x + speed * along[0], y + speed * along[1], 0.2, 3, 1.0)
    assert after == pytest.approx(before, abs=1e-5) and normal_after == pytest.approx(normal, abs=1e-5)


def test_at_time_0_the_surface_is_the_one_that_earlier_versions_had():
    height, normal = sea.swell(1.0, -2.0, 0.1, 1)
    assert height == pytest.approx(0.04259855876365244, abs=1e-12)
    assert normal == pytest.approx([-0.0848218195652181, 0.0107174414386474, 0.9963384943756086], abs=1e-12)


def test_calm_liquid_is_one_level_square():
    vertices, faces, normals = sea.liquid_surface(0, 1)
    assert len(faces) == 1 and np.all(vertices[:, 2] == 0) and np.all(normals == (0, 0, 1))


def test_no_crest_looks_over_the_walls():
    edge = np.linspace(-sea.HALF, sea.HALF, 2001)
    side = np.full_like(edge, sea.HALF)
    for x, y in ((edge, side), (edge, -side), (side, edge), (-side, edge)):
        assert sea.swell(x, y, sea.SeaParameters().waves, 1)[0].max() < sea.RIM


@pytest.mark.parametrize("view", ["up", "oblique"])
def test_the_window_is_in_the_picture_and_the_rest_is_dark(render, view):
    scene = built(view=view)
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.cycles.samples = 4
    bright = render(scene).mean(axis=-1) > 0.2
    assert 0.05 < bright.mean() < 0.5
    assert not bright[[0, -1]].any() and not bright[:, [0, -1]].any()


def test_building_again_leaves_nothing_behind(held):
    built()
    once = held()
    built(liquid="none", view="oblique")
    built()
    assert held() == once


@pytest.mark.parametrize(
    "values, words",
    [
        ({"view": "down"}, "up, oblique"),
        ({"waves": 1}, "between 0 and 0.5 m"),
        ({"time": -1}, "3600 s"),
        ({"liquid": "0"}, "refracts nothing"),
    ],
)
def test_a_wrong_parameter_is_refused_in_a_sentence(values, words, one_sentence):
    with pytest.raises(ValueError) as refusal:
        sea.SeaParameters(**values)
    one_sentence(refusal.value, words)


def test_the_registry_knows_it():
    assert scene_type("sea").build is sea.build and scene_type("sea").parameters is sea.SeaParameters

# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool's figures, measured in small pictures: each claim holds, and fails where the sign is the wrong one."""

import dataclasses
import functools

import numpy as np
import pytest

from nim_addon.figures import pool, pool_optics, run
from nim_addon.figures.measure import Camera, off_vertical, pixel_width, steepest
from nim_addon.figures.recipes import Figure, Recipe
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import pool as scene_of
from nim_addon.scenes import scene_type
from nim_addon.scenes.pool import PoolParameters

FIGURES = {figure.number: figure for figure in pool.FIGURES}
NIM = PoolParameters(waves=0)
UP = Camera(*pool.STRAIGHT_UP, (128, 128))


def with_other_sign(image):
    """The same picture, said to be of the liquid with the other sign of the index."""
    liquid = image.parameters.liquid
    return image._replace(
        parameters=dataclasses.replace(image.parameters, liquid=Medium(-liquid.n, -liquid.mu), mu=None)
    )


def test_the_window_is_as_wide_for_both_signs_and_what_is_seen_in_it_is_turned(images, failing):
    made = images(FIGURES["5.7"], (128, 128), 16)
    assert not failing(pool.measure_window(made))
    # only the window's size and the likeness hold for the wrong sign
    wrong = failing(pool.measure_window({name: with_other_sign(image) for name, image in made.items()}))
    assert len(wrong) == 12 and not any("radius" in row or "blanket" in row for row in wrong)
    # and not even the likeness where nothing is turned
    alike = {**made, "nim_sky": made["water_sky"]}
    assert sum("likeness" in row for row in failing(pool.measure_window(alike))) == 2


def test_the_window_reflects_by_the_permeability(images, failing):
    made = images(FIGURES["5.10"], (128, 128), 16)
    assert not failing(pool.measure_permeability(made))
    swapped = {"basin_-10": made["basin_-25"], "basin_-25": made["basin_-10"]}
    assert not failing(pool.measure_permeability(swapped))  # each knows its own
    parameters = dataclasses.replace(made["basin_-10"].parameters, liquid=Medium(-1.33, -12), mu=None)
    rows = failing(pool.measure_permeability({**made, "basin_-10": made["basin_-10"]._replace(parameters=parameters)}))
    assert len(rows) == 3 and all("reflectance" in row for row in rows)


def test_another_scene_of_the_file_does_not_take_the_names(images, failing):
    scene_type("sea").build(scene_type("sea").parameters())
    scene_type("glass").build(scene_type("glass").parameters())
    made = images(FIGURES["5.10"], (128, 128), 16)
    assert not failing(pool.measure_permeability(made))


def test_a_change_leaves_nothing_to_the_next_picture(empty_file, tmp_path):
    def look(scene):
        # a name has a number where another scene of the file has it too
        return {object_.name.partition(".")[0] for object_ in scene.objects}, scene.cycles.pixel_filter_type

    found, wanted = [], look(scene_of.build(PoolParameters(view="window")))
    recipes = [
        Recipe(name, "pool", ("view=window",), draft=((8, 8), 1), change=change)
        for name, change in (("balls", pool.two_balls), ("plain", lambda scene: found.append(look(scene))))
    ]
    run.make(Figure("5.7", "", "", (), tuple(recipes)), tmp_path)
    assert found == [wanted]


def test_only_the_nim_shows_the_near_wall_and_magnifies_the_floor(images, failing):
    made = images(FIGURES["5.3"], (240, 160), 8)
    assert not failing(pool.measure_outside(made))
    wrong = {name: with_other_sign(image) if "nim" in name else image for name, image in made.items()}
    assert len(failing(pool.measure_outside(wrong))) == 3


def test_the_sun_makes_the_caustics_that_are_traced(images, failing, monkeypatch):
    monkeypatch.setattr(pool, "floor_in_the_sun", functools.partial(pool_optics.floor_in_the_sun, side=600))
    made = images(FIGURES["5.9"], (64, 64), 64, "nim")
    assert not failing(pool.sunny_claims("nim", "NIM", made))
    wrong = {name: with_other_sign(image) for name, image in made.items()}
    rows = failing(pool.sunny_claims("nim", "NIM", wrong))
    assert any("traced" in row and "contrast" in row for row in rows)
    blanket = made["nim_blanket"]
    other = blanket._replace(parameters=dataclasses.replace(blanket.parameters, seed=2))
    assert len(failing(pool.sunny_claims("nim", "NIM", made | {"nim_blanket": other}))) == 1


def test_calm_liquid_lets_the_sun_through_evenly():
    calm = pool_optics.floor_in_the_sun(dataclasses.replace(NIM, sun_angle=0.5), 1.0, 8, side=500)
    straight = scene_of.TOWARDS_SUN[2]
    T = Interface(NIM.liquid).fresnel(straight).T
    assert calm.mean() == pytest.approx(scene_of.SUN_IRRADIANCE[0] * straight * T / 1.33**2, rel=0.005)
    assert calm.std() / calm.mean() < 0.02


def test_the_steepest_place_of_a_disc_is_its_edge():
    angle = off_vertical(UP)
    pixel = pixel_width(UP, 45)
    assert steepest((angle < 45).astype(float), angle, pixel / 2) == pytest.approx(45, abs=pixel)


def test_waves_between_vertices():
    parameters = PoolParameters(waves=0.1)
    vertices, _, normals = scene_of.liquid_surface(0.1, 1)
    height, normal = pool_optics.Waves(parameters).at(vertices[:, 0], vertices[:, 1])
    # at the last row and column a thousandth short of the vertex
    assert height == pytest.approx(vertices[:, 2], abs=1e-5)
    assert normal == pytest.approx(normals, abs=1e-3)


def test_a_mirror_shows_the_corner_where_it_is():
    corner = np.array([scene_of.HALF[0], scene_of.HALF[1], scene_of.FLOOR])
    image = corner * (1, 1, -1) + (0, 0, 2 * scene_of.LEVEL)
    eye = np.array(UP.eye)
    rows = UP.pixels_of(image[None])[0]
    _, look = UP.rays(*rows)
    start = eye + (scene_of.LEVEL - eye[2]) / look[2] * look
    assert pool_optics.basin_met(start, look * (1, 1, -1)) == pytest.approx(corner, abs=1e-9)

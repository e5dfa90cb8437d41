# SPDX-License-Identifier: GPL-3.0-or-later
"""The prism scene: where its light goes against traced rays, the slit and the screen, and what is refused."""

import math

import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.figures.measure import Camera
from nim_addon.physics import Interface, Medium
from nim_addon.physics.deviation import prism as deviation
from nim_addon.physics.rays import Convex, Fate, Shapes, trace
from nim_addon.scenes import prism as scene_of
from nim_addon.scenes.prism import PrismParameters, build, outline, pose, screen, way

MEDIA = ("n-bk7", "n-sf11", "1.33", "nim-mirror", "nim-normal", "nim-causal", "-1.5")
WAVES = (400, 500, 600, 700)


def place(scene, name):
    """The vertices (N, 3) of an object in the world."""
    object_ = scene.objects[name]
    return np.array([object_.matrix_world @ vertex.co for vertex in object_.data.vertices])


def traced(parameters, n, offset=0.0, turn=0.0):
    """Where light leaves the prism and its direction, as rays.trace() has it, which slants down as the sun's does."""
    corners = np.column_stack([outline(parameters), np.full(3, scene_of.HEIGHT / 2)])
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([-edges[:, 1], edges[:, 0], np.zeros(3)])
    solid = Convex(corners.tolist(), normals.tolist(), Interface(Medium(n)))
    d = np.array((math.cos(turn), math.sin(turn), -math.tan(parameters.slope)))
    start = np.array((scene_of.WALL, offset, scene_of.HEIGHT / 2))
    paths = trace(Shapes(solid), start, d, branches=False)
    (last,) = np.flatnonzero((paths.depth == 2) & (paths.fate == Fate.ESCAPED))
    return paths.start[last], paths.direction[last]


@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("offset, turn", [(0.0, 0.0), (0.002, 0.0), (-0.001, 0.01)])
def test_light_goes_where_traced_rays_go(medium, offset, turn):
    parameters = PrismParameters(medium=medium)
    for wavelength in WAVES:
        n = parameters.medium.at(wavelength).n
        found = way(parameters, n, offset, turn)
        start, d = traced(parameters, n, offset, turn)
        np.testing.assert_allclose(found.start, start[:2], atol=1e-9)
        assert found.angle == pytest.approx(math.atan2(d[1], d[0]), abs=1e-7)


def test_light_along_the_table_is_turned_by_the_closed_form():
    parameters = PrismParameters(medium="n-bk7", apex=60, incidence=45, elevation=0)
    for wavelength in WAVES:
        n = parameters.medium.at(wavelength).n
        assert -way(parameters, n).angle == pytest.approx(float(deviation(n, math.pi / 3, math.pi / 4)), abs=1e-12)


def test_a_nim_sends_its_spectrum_to_the_other_side_in_the_order_of_its_index():
    for medium, side, bluest in (("n-bk7", -1, -1), ("nim-mirror", 1, 1), ("nim-normal", 1, -1), ("nim-causal", 1, -1)):
        parameters = PrismParameters(medium=medium)
        board = screen(parameters)
        assert np.sign(board.middle[1]) == side
        angles = [way(parameters, parameters.medium.at(nm).n).angle for nm in WAVES]
        assert np.all(np.sign(np.diff(angles)) == -bluest), medium  # which way angles go as waves get longer
        places = [board.place(way(parameters, parameters.medium.at(nm).n)) for nm in WAVES]
        assert np.all(np.sign(np.diff(places)) == -bluest) and np.abs(places).max() < board.width / 2


def test_what_is_left_out_is_chosen_by_the_medium():
    glass, nim = PrismParameters(), PrismParameters(medium="nim-mirror")
    assert (glass.apex, nim.apex) == (60, 20)
    assert glass.medium == Medium.parse("n-bk7")
    green = way(glass, glass.medium.n)
    assert math.degrees(green.angle) == pytest.approx(glass.apex - 2 * glass.incidence, abs=1e-3)  # symmetrically
    assert nim.incidence == 0
    assert PrismParameters(medium="none").apex is None
    assert screen(PrismParameters(medium="none")).middle == pytest.approx((0.4, 0))


@pytest.mark.parametrize(
    "settings, words",
    [
        (
            {"medium": "n-bk7", "incidence": 5},
            ("apex = 60 and incidence = 5 let no light of 550 nm through", "smaller apex"),
        ),
        (
            {"medium": "nim-mirror", "apex": 60, "incidence": -40},
            ("send light of 550 nm back", "nim-mirror", "smaller apex"),
        ),
        ({"medium": "diamond", "apex": 100}, ("let no light of 550 nm through",)),
        ({"apex": 200}, ("apex", "out of range")),
    ],
)
def test_what_lets_no_light_through_is_one_sentence(settings, words, one_sentence):
    with pytest.raises(ValueError) as caught:
        PrismParameters(**settings)
    one_sentence(caught.value, *words)


@pytest.mark.parametrize("medium", ["n-bk7", "nim-causal"])
def test_the_prism_is_closed_and_stands_on_the_table(medium, empty_file):
    scene = build(PrismParameters(medium=medium))
    mesh = scene.objects["Prism"].data
    edges = [tuple(sorted(edge)) for face in mesh.polygons for edge in face.edge_keys]
    assert all(edges.count(edge) == 2 for edge in edges) and len(mesh.polygons) == 5
    middle = place(scene, "Prism").mean(axis=0)
    for face in mesh.polygons:
        assert (np.array(face.center) - middle) @ np.array(face.normal) > 0
    assert 0 < place(scene, "Prism")[:, 2].min() < 2e-4
    assert place(scene, "Screen")[:, 2].min() > 0
    # nothing stands within anything, and the whole light of the slit meets the prism
    assert place(scene, "Wall")[:, 0].max() < place(scene, "Prism")[:, 0].min()
    assert place(scene, "Prism")[:, 2].max() > scene_of.OPEN
    table = place(scene, "Table")
    for name in ("Prism", "Screen"):
        assert np.all(place(scene, name)[:, :2] > table[:, :2].min(axis=0) - 1e-6)
        assert np.all(place(scene, name)[:, :2] < table[:, :2].max(axis=0) + 1e-6)


def test_the_slit_is_as_wide_as_asked_for(empty_file):
    y = place(build(PrismParameters(slit=2.0)), "Wall")[:, 1]
    assert np.abs(y).min() == pytest.approx(0.001, abs=1e-8)


def test_the_suns_light_is_traced_and_the_lamps_is_not(empty_file):
    assert caustics.best_way(build(PrismParameters())) == "traced"
    assert caustics.best_way(build(PrismParameters(light="lamp"))) == "path"


@pytest.mark.parametrize("medium", MEDIA)
def test_views_show_what_they_are_of(medium):
    for view in ("side", "above", "screen", "through"):
        parameters = PrismParameters(medium=medium, view=view, light="lamp" if view == "through" else "sun")
        camera = Camera(*pose(parameters), scene_of.SIZE)
        middle = screen(parameters).middle
        shown = [(0.0, 0.0, 0.02)] if view == "through" else [(*middle.tolist(), 0.02)]
        shown += [(0.0, 0.0, 0.02)] if view in ("side", "above") else []
        if view == "above":
            board = screen(parameters)
            shown += [(*(middle + side * board.width * board.along).tolist(), 0.0) for side in (-0.5, 0.5)]
        for column, row in camera.pixels_of(shown):
            assert 0 < column < scene_of.SIZE[0] and 0 < row < scene_of.SIZE[1], view

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 5.1, 5.2 and 5.5: what is read off, the prediction by hand, small renders against it, and wrong ones refused."""

from dataclasses import replace

import numpy as np
import pytest

from nim_addon.figures import glass, glass_optics
from nim_addon.figures.measure import Camera
from nim_addon.figures.recipes import Image
from nim_addon.physics import MEDIA, Medium
from nim_addon.scenes import glass as scene_of
from nim_addon.scenes.glass import GlassParameters
from nim_addon.scenes.stage import Pose

FIGURES = {figure.number: figure for figure in glass.FIGURES}
SIZE, SAMPLES, SEEDS = (48, 48), 8, 4


# -- the prediction, by hand -------------------------------------------------------------------------------------------


def test_a_disc_is_met_between_its_hole_and_its_rim():
    disc = glass_optics.Disc((0, 0, 1), (0, 0, 1), 2.0, hole=1.0)
    origins = np.array([(0.5, 0, 3.0), (1.5, 0, 3.0), (2.5, 0, 3.0), (1.5, 0, 0.0)])
    distance, normals = disc.meet(origins, np.tile((0, 0, -1.0), (4, 1)))
    np.testing.assert_array_equal(distance, [np.inf, 2, np.inf, np.inf])
    np.testing.assert_array_equal(normals, np.tile((0, 0, 1.0), (4, 1)))


@pytest.mark.parametrize("liquid", ["water", "nim"])
def test_the_table_is_magnified_by_the_apparent_depth_of_slabs(liquid):
    """From straight above, near the axis, each slab looks as deep as its thickness by its index."""
    high = 0.6
    camera = Camera(*Pose((0, 0, high), (0, 0, 0), 1.5, "VERTICAL"), (12, 12))
    image = Image(np.zeros((1, 12, 12, 3)), camera, GlassParameters(liquid=liquid))
    magnification = glass_optics.table_magnification(
        glass_optics.traced_table(image).mean(axis=0), camera, MEDIA[liquid]
    )
    slabs = (
        (high - glass_optics.LEVEL, 1),
        (glass_optics.LEVEL - glass_optics.BASE, MEDIA[liquid].n),
        (scene_of.BASE, 1.5),
        (glass_optics.FOOT, 1),
    )
    np.testing.assert_allclose(magnification, high / sum(depth / n for depth, n in slabs), rtol=2e-3)


def test_branches_too_faint_to_be_traced_hold_too_little_light_to_count(empty_file, monkeypatch):
    parameters = GlassParameters.read(("liquid=nim", "figures=monkey", "straw=off"))
    image = Image(np.zeros((1, 24, 24, 3)), Camera(*glass.SIDE, (24, 24)), parameters)

    def green_far_out():
        return glass_optics.light_shares(glass_optics.traced_statues(image).mean(axis=0), image.camera, 1)[1]

    found = green_far_out()
    monkeypatch.setattr(glass_optics, "FAINTEST", glass_optics.FAINTEST / 10)
    assert found == pytest.approx(green_far_out(), rel=0.02)


# -- renders -----------------------------------------------------------------------------------------------------------


def test_straw_from_the_side(images, failing, monkeypatch):
    made = images(FIGURES["5.1"], SIZE, SAMPLES, seeds=SEEDS)
    traced = {name: glass_optics.traced_side(image) for name, image in made.items()}
    names = {id(image.parameters): name for name, image in made.items()}
    monkeypatch.setattr(glass, "traced_side", lambda image: traced[names[id(image.parameters)]])
    claims = glass.measure_side(made)
    assert not failing(claims)
    breaks = {claim.text.partition(":")[0]: claim.measured for claim in claims if "breaks" in claim.text}
    assert breaks["water"] < -0.3 and breaks["NIM"] > 3

    # a render that bends the other way is refused, in the straw, the bottom and the lip
    wrong = made | {"side_nim": made["side_nim"]._replace(each=made["side_water"].each)}
    refused = failing(glass.measure_side(wrong))
    for word in ("breaks", "bottom", "lip"):
        assert any(word in row and "NIM" in row for row in refused), word


def test_straw_and_table_from_above_tell_the_third_digit_of_the_index(images, failing):
    made = images(FIGURES["5.2"], SIZE, SAMPLES, seeds=SEEDS)
    assert not failing(glass.measure_top(made))
    image = made["table_nim"]
    other = image._replace(parameters=replace(image.parameters, liquid=Medium(-1.36)))
    refused = failing(glass.measure_table({**made, "table_nim": other}))
    # in pictures as small as these, the depth may hold
    assert "NIM: the table under the glass appears wider" in refused[0] and "water" not in "".join(refused)


def test_statues(images, failing):
    claims = glass.measure_statues(images(FIGURES["5.5"], SIZE, SAMPLES, seeds=SEEDS))
    assert not failing(claims)
    found = {claim.text: claim.measured for claim in claims}
    flipped = next(value for text, value in found.items() if text.startswith("NIM: width of the green"))
    upright = next(value for text, value in found.items() if text.startswith("NIM: height of the green"))
    assert flipped < 0 < upright

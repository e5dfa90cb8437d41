# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics in colours: theory is that of one index where nothing disperses, and what lands is of the medium that is there."""

import dataclasses

import numpy as np

from nim_addon.figures import caustics, coloured_caustics
from nim_addon.physics import Medium
from nim_addon.scenes import sphere


def test_what_does_not_disperse_is_as_in_figure_c_1():
    one = sphere.SphereParameters(n=-1.33, sun_angle=0.53)
    # a curve that is level is a medium that disperses, but by nothing
    level = dataclasses.replace(one, n=Medium.parse("n=cauchy(-1.33)"))
    assert level.medium.dispersion
    coloured = coloured_caustics.ground_in_colours(level, 0)
    plain = caustics.ground_in_the_sun(one, 0, rays=coloured_caustics.RAYS)
    scale = np.divide(sphere.SUN_IRRADIANCE, sphere.SUN_IRRADIANCE[0])
    np.testing.assert_allclose(coloured, plain[..., None] * scale, rtol=1e-9)


def test_the_light_is_that_of_the_medium_that_is_there(images, failing, monkeypatch):
    monkeypatch.setattr(coloured_caustics, "MEASURED", ("nim-causal",))
    figure = coloured_caustics.FIGURES[0]
    image = images(figure, (64, 64), 32, "ground_nim-causal", photons=1 << 18, texels=512)["ground_nim-causal"]
    assert not failing(coloured_caustics.measure({"ground_nim-causal": image}))
    other = image._replace(parameters=dataclasses.replace(image.parameters, n=Medium.parse("nim-mirror"), mu=None))
    rows = failing(coloured_caustics.measure({"ground_nim-causal": other}))
    assert any("red light within the shadow" in row for row in rows)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure D.1: its claims hold where they are cheap to measure, and fail where the wavelength is not the path's own."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from nim_addon.caustics.density import RADII
from nim_addon.cycles import dispersive
from nim_addon.figures import prism, prism_optics
from nim_addon.figures.measure import Camera
from nim_addon.physics.colour import weights
from nim_addon.scenes.prism import PrismParameters, pose

(FIGURE,) = prism.FIGURES


@pytest.mark.parametrize("medium", prism.SETTINGS)
def test_each_wavelength_is_turned_by_the_closed_form(medium, images):
    found = images(FIGURE, (16, 16), 1, f"turned_{medium}_")
    claims = prism.deviation_claims(found, medium)
    assert len(claims) == 4 and all(claim.holds for claim in claims), [claim.row() for claim in claims]


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("medium", prism.SETTINGS)
def test_each_photon_is_turned_by_its_own_wavelengths_angle(medium, backend, images):
    found = images(FIGURE, (64, 64), 1, f"photons_{medium}", backend=backend)
    claims = prism.photon_claims(found, medium)
    assert len(claims) == 4 and all(claim.holds for claim in claims), [claim.row() for claim in claims]


def test_a_prism_at_one_wavelength_fails(images, monkeypatch):
    monkeypatch.setattr(
        dispersive, "_function", lambda nodes, nm, values, name: _constant(nodes, values[len(values) // 2])
    )
    found = images(FIGURE, (64, 64), 1, "photons_n-bk7")
    failing = [claim for claim in prism.photon_claims(found, "n-bk7") if not claim.holds]
    assert len(failing) == 3


def _constant(nodes, value):
    node = nodes.add("ShaderNodeValue")
    node.outputs[0].default_value = float(value)
    return node.outputs[0]


@pytest.mark.parametrize("medium", ["n-bk7", "nim-mirror"])
def test_the_slit_is_seen_in_its_colours_where_they_must_be(medium, images):
    found = images(FIGURE, (400, 24), 256, f"eye_{medium}")
    claims = prism.colour_claims(found, medium)
    assert len(claims) == 7 and all(claim.holds for claim in claims), [claim.row() for claim in claims]


def test_a_line_on_the_screen_is_where_and_as_wide_as_the_slit_makes_it(images, monkeypatch):
    medium = "nim-causal"  # whose photons, without absorption, are the cheapest
    monkeypatch.setattr(prism, "PHOTONS", 1 << 20)
    found = images(FIGURE, (prism.PIXELS,) * 2, 16, f"screen_{medium}", photons=1 << 20)
    claims = prism.screen_claims(found, medium)
    assert len(claims) == 5 and all(claim.holds for claim in claims), [claim.row() for claim in claims]
    # the same light is not that of a slit a little wider, nor of a prism a little blunter
    for change, failing in (({"slit": 2.0}, "its width"), ({"apex": 15.02}, "its place")):
        other = {name: image._replace(parameters=replace(image.parameters, **change)) for name, image in found.items()}
        rows = [claim for claim in prism.screen_claims(other, medium) if not claim.holds]
        assert sum(failing in claim.text for claim in rows) == 2, [claim.row() for claim in rows]


def test_photons_are_spread_over_boxes_that_hold_enough():
    # evenly over 2 mm
    places = np.linspace(-1e-3, 1e-3, 20_001)
    number = 2 * 32 / 1e-3**2 * 2e-3  # in the middle, boxes of 1 mm
    least, most = prism_optics.spread(places, number)
    side = np.where(np.abs(places) < 0.5e-3, 1e-3, 0)
    # nearer the edge d a box of side s holds s (s / 2 + d) of them
    d = 1e-3 - np.abs(places)
    side = np.where(side > 0, side, -d + np.sqrt(d**2 + 2e-6))
    assert least == pytest.approx(math.sqrt(np.mean(side**2) / 12), rel=1e-3)
    assert most / least == pytest.approx(max(b / a for a, b in pairwise(2 * np.array(RADII[1:]) + 1)))


def test_colours_lie_in_the_order_of_the_index():
    for medium, order in (("n-bk7", 1), ("nim-mirror", -1), ("nim-normal", 1)):
        words = (f"medium={medium}", *prism.SETTINGS[medium], "view=through", "light=lamp", "slit=0.5")
        parameters = PrismParameters.read(words)
        nm = np.arange(380.5, 730.0, 2)
        row = prism_optics.in_colour(
            prism_optics.through_the_prism(parameters, Camera(*pose(parameters), (400, 24)), nm), nm
        )
        red, green, blue = prism_optics.centroids(row)
        assert np.all(np.diff([red, green, blue]) * order > 0), medium


def test_light_of_all_wavelengths_alike_is_white():
    nm = np.linspace(380, 730, 701)
    np.testing.assert_allclose(prism_optics.in_colour(np.ones((701, 3)), nm), 1, rtol=1e-12)
    assert weights()[1].min() < 0


def test_on_the_screen_a_line_is_as_wide_as_the_slit_in_a_narrow_sun():
    parameters = PrismParameters(medium="none")
    place, places = prism_optics.on_the_screen(parameters, 550)
    sun = 0.5 * math.radians(parameters.sun_angle) * math.sqrt(0.5)
    assert place == pytest.approx(0, abs=1e-12)
    assert places.std() == pytest.approx(math.hypot(parameters.opening / math.sqrt(12), 0.5 * sun), rel=0.02)

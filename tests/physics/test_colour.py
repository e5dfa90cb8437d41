# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour: white stays white, wavelengths are drawn as they should be, and what is shown lies in the gamut."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nim_addon.physics import VISIBLE_NM, colour
from nim_addon.physics.colour import Wavelengths

SAMPLINGS = {"uniform": Wavelengths.uniform(), "importance": Wavelengths.by_importance()}


def test_the_matrix_is_that_of_srgb():
    # IEC 61966-2-1 gives four decimals
    expected = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    np.testing.assert_allclose(colour.xyz_to_srgb(np.eye(3)).T, expected, rtol=0, atol=5e-4)
    white = np.array((0.3127, 0.3290, 0.3583)) / 0.3290
    np.testing.assert_allclose(colour.xyz_to_srgb(white), 1, rtol=0, atol=1e-14)


def test_the_observer_at_known_wavelengths():
    np.testing.assert_allclose(colour.colour_matching(555), (0.51205, 1.0, 0.00575), rtol=0, atol=1e-6)
    np.testing.assert_array_equal(colour.colour_matching([300, 900]), 0)


def test_weights_have_the_mean_of_white_exactly():
    places, w = colour.weights()
    assert (places[0], places[-1]) == VISIBLE_NM and w.shape == (71, 3)
    np.testing.assert_allclose(((w[1:] + w[:-1]) / 2).mean(axis=0), 1, rtol=0, atol=1e-14)
    assert w.min() < -3 and 7 < w.max() < 8 and not w.flags.writeable
    # red, green and blue where one expects them
    assert 590 <= places[w[:, 0].argmax()] <= 610 and 530 <= places[w[:, 1].argmax()] <= 550
    assert 440 <= places[w[:, 2].argmax()] <= 455


@pytest.mark.parametrize("name", SAMPLINGS)
def test_the_mean_over_drawn_wavelengths_is_white(name):
    sampling = SAMPLINGS[name]
    # Gauss of two points is exact for straight lines, as for the squares that noise() takes
    step = 1 / (colour.TABLE_SIZE - 1)
    starts = np.arange(colour.TABLE_SIZE - 1) * step
    w = np.stack([sampling.weight(starts + x * step) for x in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12))])
    np.testing.assert_allclose(w.mean(axis=(0, 1)), 1, rtol=0, atol=1e-12)
    np.testing.assert_allclose((w**2).mean(axis=(0, 1)), sampling.noise(), rtol=1e-12)


def test_importance_lowers_the_noise_of_every_channel():
    uniform, importance = (sampling.noise() for sampling in SAMPLINGS.values())
    np.testing.assert_allclose(uniform, (8.8, 4.5, 5.9), rtol=0, atol=0.06)
    assert (importance < 0.72 * uniform).all()


@pytest.mark.parametrize("name", SAMPLINGS)
def test_what_a_picture_is_made_of_is_that_of_the_observer(name):
    """The sum over drawn wavelengths of any spectrum is that over all wavelengths, each by its weight."""
    sampling = SAMPLINGS[name]
    u = (np.arange(200_000) + 0.5) / 200_000
    nm, w = sampling.wavelength(u), sampling.weight(u)
    assert (np.diff(nm) > 0).all() and (sampling.wavelength([0, 1]) == VISIBLE_NM).all()
    places, table = colour.weights()
    everywhere = np.linspace(*VISIBLE_NM, 35_001)
    exact = np.stack([np.interp(everywhere, places, column) for column in table.T], axis=-1)
    for centre, width in ((420, 10), (480, 20), (555, 5), (600, 40), (680, 15)):

        def spectrum(nm, centre=centre, width=width):
            return np.exp(-(((nm - centre) / width) ** 2))[:, None]

        drawn, expected = (spectrum(nm) * w).mean(axis=0), (spectrum(everywhere) * exact).mean(axis=0)
        np.testing.assert_allclose(drawn, expected, rtol=0, atol=4e-3 * np.abs(expected).max())


@pytest.mark.parametrize("wavelengths", [np.arange(400, 701, 10), np.linspace(380, 730, 8), [450, 550, 610]])
def test_weights_of_few_renders_are_white_together(wavelengths):
    np.testing.assert_allclose(colour.weights_of(wavelengths).mean(axis=0), 1, rtol=0, atol=1e-14)


def test_wavelengths_that_make_no_white_are_refused(one_sentence):
    for few in ([500], [650, 700], [900]):
        with pytest.raises(ValueError) as caught:
            colour.weights_of(few)
        one_sentence(caught.value, "no white", "take more")


@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3))
def test_what_is_shown_has_no_negative_value_and_keeps_its_luminance(rgb):
    rgb = np.array(rgb)
    shown = colour.into_gamut(rgb)
    Y = np.linalg.inv(colour.xyz_to_srgb(np.eye(3)).T)[1]
    assert (shown >= 0).all()
    np.testing.assert_allclose(shown @ Y, max(rgb @ Y, 0) if rgb.min() < 0 else rgb @ Y, rtol=1e-9, atol=1e-12)
    if rgb.min() >= 0:
        np.testing.assert_array_equal(shown, rgb)


def test_into_gamut_is_continuous_where_a_channel_turns_negative():
    np.testing.assert_allclose(colour.into_gamut([1, 0.5, -1e-9]), (1, 0.5, 0), rtol=0, atol=1e-8)


def test_the_colours_of_the_spectrum():
    nm = np.arange(380, 731.0)
    rgb = colour.of_wavelength(nm)
    np.testing.assert_allclose(rgb.max(axis=-1), 1)
    assert (rgb >= 0).all() and np.abs(np.diff(rgb, axis=0)).max() < 0.1  # no bands
    leads = {610: 0, 650: 0, 530: 1, 550: 1, 430: 2, 460: 2}
    assert {place: int(rgb[nm == place][0].argmax()) for place in leads} == leads
    np.testing.assert_array_equal(colour.of_wavelength([200, 1000]), 0)


def test_encoded_is_the_curve_of_srgb():
    np.testing.assert_allclose(
        colour.encoded([-1, 0, 0.0031308, 0.2140411, 1, 2]), [0, 0, 0.04045, 0.5, 1, 1], atol=1e-5
    )


def test_a_wavelength_stands_for_what_is_nearest_to_it():
    np.testing.assert_allclose(colour.spans_of([400, 410, 440, 450]), (10, 20, 20, 10))
    np.testing.assert_allclose(colour.spans_of([550]), 1)
    # a third render halfway between two others takes of their weight, and the sum stays
    twice = np.sort(np.concatenate([np.arange(400, 701, 20.0), [551.0]]))
    w = colour.weights_of(twice)
    np.testing.assert_allclose(w.mean(axis=0), 1, atol=1e-14)
    coarse = colour.weights_of(np.arange(400, 701, 20.0)) / 16
    near = (twice > 530) & (twice < 570)
    np.testing.assert_allclose(w[near].sum(axis=0) / len(twice), coarse[7:9].sum(axis=0), atol=0.03)


def test_white_of_luminance_1_is_daylight():
    nm = np.arange(380, 731.0)
    xyz = colour.daylight(nm) @ colour.colour_matching(nm)
    np.testing.assert_allclose(xyz[1], 1, rtol=1e-4)
    np.testing.assert_allclose(colour.xyz_to_srgb(xyz), 1, atol=2e-3)
    np.testing.assert_array_equal(colour.daylight([300, 800]), 0)


def test_a_colour_is_a_spectrum_of_which_it_is_the_colour():
    """Of Mallett and Yuksel's primaries each comes back, and grey is the same everywhere."""
    nm = np.arange(380, 730.5, 0.5)
    np.testing.assert_allclose(colour.shares_of(nm).sum(axis=-1), 1, atol=2e-5)
    spectra = colour.shares_of(nm) * colour.daylight(nm)[:, None]
    back = colour.xyz_to_srgb((spectra.T @ colour.colour_matching(nm)) / 2)
    np.testing.assert_allclose(back, np.eye(3), atol=3e-3)


def test_channels_absorb_as_the_light_that_is_left():
    nm, w = colour.weights()
    np.testing.assert_allclose(colour.absorption_of_channels(np.full(len(nm), 20.0)), 20, rtol=1e-12)
    # a little of a colour: what is left of each channel by its own mean, for ways that are short
    for alpha in (20 + 0.002 * (nm - 550), 20 - 0.002 * (nm - 550)):
        seen = w * alpha[:, None]
        np.testing.assert_allclose(
            colour.absorption_of_channels(alpha), ((seen[1:] + seen[:-1]) / 2).mean(axis=0), rtol=2e-3
        )
    # a medium that absorbs blue: what is left goes by its channels to 0.06, on ways up to that of 1/e
    alpha = np.where(nm < 500, 30.0, 3.0)
    found = colour.absorption_of_channels(alpha)
    assert 3 * 0.8 < found[0] < found[1] < 12 < 30 < found[2] < 60
    for way in (0.02, 0.05, 0.1, 0.2):
        left = (w * np.exp(-alpha * way)[:, None]).mean(axis=0)
        np.testing.assert_allclose(np.exp(-found * way), left, atol=0.06)
    # lengths go with the unit
    np.testing.assert_allclose(colour.absorption_of_channels(alpha / 1000), found / 1000, rtol=1e-6)

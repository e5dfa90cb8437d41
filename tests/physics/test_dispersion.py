# SPDX-License-Identifier: GPL-3.0-or-later
"""Media as functions of the wavelength: models, names, text that reads back, and what causality demands."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from nim_addon.physics import (
    DISPERSIVE,
    MEDIA,
    VISIBLE_NM,
    AbsorptionLength,
    Dispersion,
    Drude,
    Formula,
    Medium,
    SplitRing,
    Table,
    cauchy,
    sellmeier,
)
from nim_addon.physics.spectra import read

VISIBLE = np.linspace(*VISIBLE_NM, 71)
positive = st.floats(0.1, 5)
damping = st.one_of(st.just(0.0), st.floats(1e-6, 1))
drudes = st.builds(Drude, st.floats(100, 1000), damping)
rings = st.builds(SplitRing, st.floats(0.01, 0.99), st.floats(200, 2000), damping)
tables = st.lists(st.floats(1, 3), min_size=2, max_size=6).map(lambda n: Table(np.linspace(300, 900, len(n)), n))
formulas = st.one_of(
    st.builds(cauchy, st.floats(1.2, 2), st.floats(0, 0.02)),
    st.builds(sellmeier, positive, st.floats(0.001, 0.03)),
    st.builds(lambda a: Formula(5, (a,), (200.0, 1000.0)), st.floats(1, 3)),
)


@given(st.one_of(drudes, rings, tables, formulas, st.builds(AbsorptionLength, positive)))
def test_functions_read_back_from_their_text_to_the_last_bit(spectrum):
    assert read(str(spectrum)) == spectrum and hash(read(str(spectrum))) == hash(spectrum)


@given(drudes, st.one_of(drudes, rings))
def test_media_of_epsilon_and_mu_are_values_and_passive(epsilon, mu):
    assume(not (isinstance(mu, SplitRing) and mu.damping == 0 and 379 < mu.resonance_nm < 731))  # infinite
    medium = Medium.of(epsilon, mu)
    assert Medium.parse(str(medium)) == medium and hash(medium) == hash(Medium.of(epsilon, mu))
    assert dataclasses.replace(medium.dispersion, mu=Drude(99)) != medium.dispersion
    n, permeability = medium.spectrum(VISIBLE)
    assert (n.imag >= 0).all() and ((permeability / n).real >= -1e-12 * abs(permeability / n)).all()
    wanted = epsilon(VISIBLE), mu(VISIBLE)
    held = np.minimum(*np.abs(wanted)) > 1e-5  # where one of them is 0 it is taken for a little more
    np.testing.assert_allclose((n**2)[held], (wanted[0] * wanted[1])[held], rtol=1e-12)


@given(st.one_of(formulas, tables), st.one_of(st.just(0.0), st.floats(1e-9, 1), st.builds(AbsorptionLength, positive)))
def test_media_of_n_and_k_are_values(n, k):
    medium = Medium.of_index(n, k)
    assert Medium.parse(str(medium)) == medium and medium.dispersion is not None
    at = medium.at(600)
    assert at.n == n(np.array(600.0)) and at.k == (k(np.array(600.0)) if callable(k) else k)
    assert at.dispersion is None and at == medium.at(600.0) and (at.mu, at.mu_imag) == (1, 0)


def test_drude_and_split_ring_by_hand():
    # w = w_p: 1 - 1 / (1 + i g); w = 2 w_0: 1 - F 4 / (3 + 2 i G)
    assert Drude(500, 0.5)(np.array(500.0)) == pytest.approx(1 - 1 / (1 + 0.5j))
    assert SplitRing(0.5, 1000, 0.1)(np.array(500.0)) == pytest.approx(1 - 2 / (3 + 0.2j))


def test_cauchy_and_sellmeier_by_hand():
    assert cauchy(1.5, 0.004, 0.0001)(np.array(500.0)) == pytest.approx(1.5 + 0.004 / 0.25 + 0.0001 / 0.0625)
    assert sellmeier(1.0, 0.01)(np.array(500.0)) == pytest.approx(math.sqrt(1 + 0.25 / 0.24))


def test_tables_are_straight_between_their_rows():
    table = Table([400, 600], [1 + 1j, 3 + 0j])
    assert table(np.array(450.0)) == pytest.approx(1.5 + 0.75j) and table.range_nm == (400, 600)
    assert Table.sampled(lambda nm: nm / 1000, [400, 500]) == Table([400, 500], [0.4, 0.5])


@pytest.mark.parametrize("name", DISPERSIVE)
def test_names(name):
    medium = Medium.parse(name.upper())
    assert str(medium) == name and Medium.parse(str(medium)) == medium == Medium.parse(medium)
    assert name not in MEDIA and medium.dispersion.source
    n, mu = medium.spectrum(VISIBLE)
    assert (n.imag >= 0).all() and np.isfinite(n).all() and np.isfinite(mu).all()
    assert (medium.n, medium.k, medium.mu) == (medium.at(550).n, medium.at(550).k, medium.at(550).mu)
    # the same numbers without the name
    nameless = Medium.dispersive(dataclasses.replace(medium.dispersion, name=None))
    assert nameless == medium and "(" in str(nameless) and Medium.parse(str(nameless)) == medium


@pytest.mark.parametrize(
    "name, wavelength, n, tolerance, k",
    [
        ("n-bk7", 587.5618, 1.5168, 5e-6, 9.7525e-9),  # Schott: n_d = 1.51680
        ("n-sf11", 587.5618, 1.78472, 5e-6, None),
        ("fused-silica", 587.5618, 1.45846, 5e-6, 0),  # Malitson 1965
        ("water-daimon", 589.3, 1.33334, 5e-5, None),  # Daimon and Masumura 2007, 20 degrees
        ("diamond-peter", 589.3, 2.4173, 2e-4, 0),
        ("silver", 548.6, 0.06, 1e-12, 3.586),  # rows of Johnson and Christy
        ("gold", 548.6, 0.43, 1e-12, 2.455),
        ("fishnet", 380, 0.63, 1e-12, 0),
        ("fishnet", 730, -1.24, 1e-12, 0),
    ],
)
def test_named_media_have_the_published_numbers(name, wavelength, n, tolerance, k):
    medium = Medium.parse(name).at(wavelength)
    assert medium.n == pytest.approx(n, abs=tolerance)
    assert k is None or medium.k == pytest.approx(k, rel=1e-2, abs=1e-12)


@pytest.mark.parametrize("name", ["nim-mirror", "nim-normal", "nim-causal"])
def test_media_to_teach_with_are_the_liquid_of_the_thesis_at_550_nm(name):
    assert Medium.parse(name).at(550).n == pytest.approx(-1.33, abs=1e-15)


def abbe(medium):
    """(|n_d| - 1) / (|n_F| - |n_C|)."""
    n_F, n, n_C = (abs(medium.at(wavelength).n) for wavelength in (486.13, 550, 656.27))
    return (n - 1) / (n_F - n_C)


def test_slopes_of_the_media_to_teach_with():
    assert abbe(Medium.parse("nim-mirror")) == pytest.approx(20, rel=1e-9)
    assert abbe(Medium.parse("nim-normal")) == pytest.approx(-20, rel=1e-9)
    causal = Medium.parse("nim-causal")
    np.testing.assert_allclose(causal.spectrum(VISIBLE)[0], 1 - 2.33 * (VISIBLE / 550) ** 2, rtol=1e-14, atol=1e-14)
    assert complex(causal.impedance) == pytest.approx(1)


def excess(medium, wavelength_nm):
    """w dn/dw - 2 (1 - n) (...), which causality wants to be 0 or more in a NIM without loss (Landau, Lifshitz, 84)."""
    step = 1e-4
    above, below = (medium.spectrum(wavelength_nm * factor)[0].real for factor in (1 + step, 1 - step))
    slope = -(above - below) / math.log((1 + step) / (1 - step))
    return slope - 2 * (1 - medium.spectrum(wavelength_nm)[0].real)


@given(st.floats(300, 540), st.floats(300, 540))
def test_drude_media_meet_the_bound_of_causality(plasma, other):
    wavelengths = np.linspace(max(plasma, other) * 1.01, 2000, 50)
    medium = Medium.of(Drude(plasma), Drude(other))
    found = excess(medium, wavelengths)
    scale = 1 + np.abs(medium.spectrum(wavelengths)[0].real)
    assert (found >= -1e-6 * scale).all()
    if plasma == other:
        np.testing.assert_allclose(found / scale, 0, atol=1e-6)


@given(st.floats(0.1, 0.5), st.floats(430, 540))
def test_split_rings_meet_the_bound_of_causality(strength, plasma):
    # mu < 0 between w_0 and w_0 / sqrt(1 - F), which is below sqrt(2) w_0 here: beyond, the model is not causal
    ring = SplitRing(strength, 600)
    wavelengths = np.linspace(max(600 * math.sqrt(1 - strength), plasma) + 1, 599, 50)
    assert (excess(Medium.of(Drude(plasma), ring), wavelengths) > 0).all()


def test_only_the_causal_one_claims_causality():
    for name, meets in (("nim-causal", True), ("nim-normal", False), ("nim-mirror", False)):
        assert (excess(Medium.parse(name), VISIBLE) >= -1e-6).all() == meets
        assert "causal" in Medium.parse(name).dispersion.source
    # red bends most in the causal and the normal one, blue in the mirror
    for name, blue_most in (("nim-causal", False), ("nim-normal", False), ("nim-mirror", True)):
        medium = Medium.parse(name)
        assert (medium.at(400).n < medium.at(700).n) == blue_most


def test_absorption():
    medium = Medium(1.33 + 1e-6j)
    assert medium.absorption(550) == pytest.approx(4 * math.pi * 1e-6 / 550e-9)
    assert medium.absorption_length(550) == pytest.approx(0.0437676, rel=1e-5)  # 4.4 cm
    grey = Medium.parse("n=-1.33,length=0.05")
    assert grey.is_nim and grey.absorption_length(400) == pytest.approx(0.05) == grey.absorption_length(700)
    assert Medium(1.5).absorption_length() == math.inf
    assert Medium.parse("water-daimon").absorption_length(550) == pytest.approx(22.33, rel=1e-3)


def test_what_has_no_colour_is_the_same_at_all_wavelengths():
    medium = Medium(-1.33 + 0.1j, -2 + 0.1j)
    assert medium.at(400) is medium
    n, mu = medium.spectrum([400, 500])
    np.testing.assert_array_equal(n, -1.33 + 0.1j), np.testing.assert_array_equal(mu, -2 + 0.1j)


def test_an_index_that_passes_through_nothing_stays_off_it():
    medium = Medium.of_index(Table([400, 500, 600], [0.2, 0.0, -0.2]))
    assert medium.at(500).n == 2e-6 and medium.at(450).n == 0.1 and medium.at(550).is_nim


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Medium.parse("gold").at(0.55), ("0.55 nm", "nanometres", "550")),
        (lambda: Medium(1.5).at(0.55), ("0.55 nm", "nanometres", "550")),
        (lambda: Medium(1.5).at(0), ("0 nm",)),
        (lambda: Medium(1.5).at(math.nan), ("nan nm",)),
        (lambda: Medium.parse("gold").at(3000), ("gold", "187.9 to 1937 nm", "not cover 3000 nm")),
        (lambda: Medium.of_index(Table([600, 700], [1.5, 1.4])), ("600 to 700 nm", "not cover 550 nm")),
        (lambda: Table([500, 400], [1, 2]), ("rise", "400 nm")),
        (lambda: Table([400, 500], [1, math.nan]), ("not finite", "500 nm")),
        (lambda: Table([400], [1]), ("two rows",)),
        (lambda: Table([0.4, 0.5], [1, 2]), ("micrometres", "400")),
        (lambda: Medium.of_index(1.5, Table([400, 700], [0, -1e-3])), ("gain", "imaginary part below 0")),
        (lambda: Medium.of(Table([400, 700], [2, 2 - 0.1j]), 1), ("epsilon", "gain")),
        (lambda: Medium.of(2 - 0.1j), ("epsilon = 2-0.1j", "gain")),
        (lambda: Medium.of(2, 1 - 0.1j), ("mu = 1-0.1j", "gain")),
        (lambda: Medium.of(math.nan), ("epsilon", "not finite")),
        (lambda: Drude(500, -0.1), ("damping", "-0.1")),
        (lambda: Drude(0), ("plasma", "above 0")),
        (lambda: SplitRing(1.5, 500), ("F = 1.5", "between 0 and 1")),
        (lambda: AbsorptionLength(0), ("length", "above 0")),
        (lambda: Formula(10, (1.0,)), ("formula 10", "1 to 9")),
        (lambda: Formula(1, (1.0, 2.0)), ("formula 1", "2 coefficients")),
        (lambda: Formula(2, (0.0, 1.0, 1.0)) and Medium.of_index(sellmeier(-2.0, 0.0)), ("no index", "550 nm")),
        (lambda: Dispersion(n=1.5, epsilon=2.0), ("by n, k and mu or by epsilon and mu",)),
        (lambda: Medium.of_index(cauchy(-1.5), mu=1.0), ("does not go with", "leave mu out")),
        (lambda: Medium.parse("n=drude"), ("n = 'drude'", "number")),
        (lambda: Medium.parse("n=bessel(1)"), ("'bessel(1)'", "drude", "table")),
        (lambda: Medium.parse("n=cauchy(x)"), ("'cauchy(x)'", "number")),
        (lambda: Medium.parse("epsilon=drude(1 2 3)"), ("'drude(1 2 3)'", "too many")),
        (lambda: Medium.parse("epsilon=-2,k=1"), ("epsilon=-2,k=1", "not understood")),
        (lambda: Medium.parse("n=1.5,k=1,length=2"), ("not understood",)),
        (lambda: Medium.parse("n=1.5,length=drude(300)"), ("metres",)),
    ],
)
def test_what_cannot_be_is_refused(make, words, one_sentence):
    with pytest.raises(ValueError) as caught:
        make()
    one_sentence(caught.value, *words)

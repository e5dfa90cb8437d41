# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of media with loss: against 40-digit values, and against what must hold for any passive media."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from nim_addon.physics import MEDIA, Interface, Medium
from nim_addon.physics.dispersion import refractive_index
from nim_addon.physics.media import OPAQUE, TRANSPARENT
from nim_addon.physics.rays import Fate, Plane, Shapes, trace

EPS = np.finfo(float).eps

magnitudes, losses = st.floats(0.05, 20), st.one_of(st.just(0.0), st.floats(1e-9, 10))
cosines = st.floats(1e-3, 1)


@st.composite
def parts(draw):
    """epsilon or mu of a passive medium: of either sign, with loss or without."""
    return complex(draw(st.sampled_from([-1, 1])) * draw(magnitudes), draw(losses))


passive = st.builds(Medium.of, parts(), parts())
lossless = st.builds(
    lambda sign, epsilon, mu: Medium.of(sign * epsilon, sign * mu), st.sampled_from([-1, 1]), magnitudes, magnitudes
)


@pytest.fixture(scope="module")
def reference(data):
    rows = np.loadtxt(data / "fresnel_complex.csv.gz", delimiter=",")
    assert rows.shape == (285, 25)
    return rows


def test_complex_fresnel_against_40_digits(reference):
    splits = 0
    for is_lossless, angle, *numbers in reference:
        epsilon_i, mu_i, epsilon_t, mu_t, n_t, Z_t, cos_t, r_s, r_p = np.array(numbers[:18]).reshape(9, 2) @ (1, 1j)
        interface = Interface(Medium.of(epsilon_t, mu_t), Medium.of(epsilon_i, mu_i))
        cos_i = math.cos(math.radians(angle))
        got, powers = interface.amplitudes(cos_i), interface.fresnel(cos_i)
        found = [interface.inside.index, interface.inside.impedance, got.cos_t, got.r_s, got.r_p, *powers[:3]]
        wanted = [n_t, Z_t, cos_t, r_s, r_p, *np.minimum(numbers[18:21], 1)]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12)
        assert interface.outside.is_complex == (not is_lossless)
        if is_lossless:
            np.testing.assert_allclose(interface.transmittances(cos_i), numbers[21:], rtol=0, atol=1e-12)
            splits += 1
        else:
            with pytest.raises(ValueError, match="without loss"):
                interface.transmittances(cos_i)
    assert splits == 195


@given(parts(), parts())
@example(complex(-1, 0), complex(-1, 0))
@example(complex(-1, -0.0), complex(-2, 0.0))
def test_the_branch_is_passive(epsilon, mu):
    medium = Medium.of(epsilon, mu)
    assert complex(refractive_index(epsilon, mu)) == medium.index
    assert medium.k >= 0 and complex(medium.impedance).real >= -4 * EPS * abs(medium.impedance)
    assert medium.index**2 == pytest.approx(epsilon * mu, rel=1e-14)
    assert complex(medium.impedance) ** 2 == pytest.approx(mu / epsilon, rel=1e-14)
    # Depine and Lakhtakia 2004: negative where epsilon' / |epsilon| + mu' / |mu| < 0
    balance = epsilon.real / abs(epsilon) + mu.real / abs(mu)
    assume(abs(balance) > 1e-12)
    assert medium.is_nim == (balance < 0)


@given(passive, passive, st.floats(0, 1))
@example(Medium.of(-1, 1), Medium(1), 0.0)
@example(MEDIA["nim"], Medium.of(-2, 1), 0.3)
def test_powers_are_shares(inside, outside, cos_i):
    R_s, R_p, R, T = Interface(inside, outside).fresnel(cos_i)
    for share in (R_s, R_p, R, T):
        assert 0 <= share <= 1
    assert R + T == 1


@given(passive, lossless, cosines)
def test_power_is_conserved_where_the_incident_side_has_no_loss(inside, outside, cos_i):
    interface = Interface(inside, outside)
    r_s, r_p, cos_t = interface.amplitudes(cos_i)
    T = np.array(interface.transmittances(cos_i))
    # cos_t is rounded as cos^2 is, by eps (1 + |q|^2) / |cos_t|
    q2 = abs(outside.index / inside.index) ** 2
    bound = 64 * EPS * (1 + (1 + q2) / max(abs(cos_t), 1e-9) ** 2)
    np.testing.assert_allclose(np.abs([r_s, r_p]) ** 2 + T, 1, rtol=0, atol=bound)
    assert (-bound <= T).all()


@given(lossless, lossless, cosines)
def test_without_loss_the_complex_form_is_the_real_one_and_the_way_back_the_way_there(inside, outside, cos_i):
    interface = Interface(inside, outside)
    r_s, r_p, cos_t = interface.amplitudes(cos_i)
    assume(cos_t.imag == 0 and cos_t.real > 1e-3)
    real = interface.fresnel(cos_i)
    bound = 64 * EPS * (1 + (outside.n / inside.n) ** 2) / cos_t.real**2
    np.testing.assert_allclose(np.abs([r_s, r_p]) ** 2, [real.R_s, real.R_p], rtol=0, atol=bound)
    back = interface.reversed().amplitudes(min(cos_t.real, 1.0))
    bound *= (1 + (inside.n / outside.n) ** 2) / cos_i**2
    np.testing.assert_allclose([-back.r_s, -back.r_p], [r_s, r_p], rtol=0, atol=bound)


@given(lossless, st.floats(1e-9, 10), st.floats(1e-9, 10), cosines)
def test_a_wave_decays_into_what_absorbs(outside, epsilon_loss, mu_loss, cos_i):
    for sign in (1, -1):
        inside = Medium.of(complex(sign * 2, epsilon_loss), complex(sign * 1.5, mu_loss))
        assert (inside.index * Interface(inside, outside).amplitudes(cos_i).cos_t).imag > 0


@pytest.mark.parametrize("epsilon, mu", [(-2, 1), (2, -1), (-0.3, 4)])
def test_single_negative_media_reflect_everything(epsilon, mu):
    medium = Medium.of(epsilon, mu)
    assert medium.is_single_negative and medium.n == 0 and medium.k > 0
    interface = Interface(medium)
    np.testing.assert_allclose(interface.fresnel(np.linspace(0, 1, 91)).R, 1, rtol=0, atol=8 * EPS)
    assert np.isnan(interface.refract((1, 0, -1), (0, 0, 1))).all() and np.isnan(interface.theta_t(0.3))
    assert interface.critical_angle() == 0 and interface.reversed().critical_angle() is None
    assert interface.brewster_angle() is None and Interface(Medium(1e-5j)).brewster_angle() is None


def test_rays_are_refracted_by_the_real_index():
    plain, lossy = Interface(Medium(-1.33)), Interface(Medium(-1.33 + 0.1j))
    d = np.array([(1, 0, -1), (0.2, 0.5, -1), (0, 0, 1)])
    np.testing.assert_array_equal(lossy.refract(d, (0, 0, 1)), plain.refract(d, (0, 0, 1)))
    assert lossy.theta_t(0.5) == plain.theta_t(0.5) and lossy.bends_backwards
    assert lossy.reversed().critical_angle() == plain.reversed().critical_angle()


def test_brewsters_angle_is_there_as_long_as_loss_is_not_seen():
    clear = Interface(Medium(1.5 + 1e-8j))
    assert clear.brewster_angle() == pytest.approx(math.atan(1.5), rel=1e-9)
    assert Interface(Medium(complex(1.5, 2 * TRANSPARENT))).brewster_angle() is None


def test_water_with_loss_does_not_reflect_more_than_everything():
    # choosing the root by Im (n cos) > 0 gives R = 175 here
    interface = Interface(Medium(1.0), Medium(1.33 + 2e-9j))
    r_s, r_p, _ = interface.amplitudes(np.cos(np.radians(np.linspace(0, 90, 181))))
    assert max(np.abs(r_s).max(), np.abs(r_p).max()) <= 1 + 1e-6


def test_an_interface_has_a_wavelength():
    interface = Interface(Medium.parse("nim-causal"), Medium.parse("water-daimon"))
    assert interface.at(600) == Interface(interface.inside.at(600), interface.outside.at(600))
    assert interface.fresnel(0.5) == interface.at(550).fresnel(0.5)


@pytest.mark.parametrize(
    "inside, outside, words",
    [
        ("gold", "air", ("gold", "0.018 micrometres", "mirror")),
        (f"n=-1.5+{2 * OPAQUE}j", "air", ("mirror",)),
        ("epsilon=-2,mu=1", "air", ("different sign", "reflects everything")),
        ("n=0.5+1e-4j", "air", ("30.0 degrees", "|sin| > |Re n|", "absorbed")),
        ("air", "n=1.5+1e-4j", ("starts in n=1.5+0.0001j", "T = 1 - R")),
    ],
)
def test_where_physics_ends_is_said(inside, outside, words, one_sentence):
    (sentence,) = Interface(Medium.parse(inside), Medium.parse(outside)).limits()
    one_sentence(sentence.replace("e.g.", ""), *words)


def test_where_physics_ends_is_said_of_a_wavelength():
    interface = Interface(Medium.parse("gold"), Medium.parse("epsilon=drude(600),mu=1"))
    for wavelength in (450, 700):
        within = interface.inside.absorption_length(wavelength) * 1e6
        sentence = interface.limits(wavelength)[0]
        assert sentence.startswith(f"gold absorbs what enters within {within:.2g} micrometres at {wavelength} nm")
    assert [len(interface.limits(wavelength)) for wavelength in (450, 700)] == [1, 2]
    assert "different sign at 700 nm" in interface.reversed().limits(700)[0]


@pytest.mark.parametrize("inside", ["nim", "glass", "n-bk7", "water-daimon", "nim-causal"])
def test_where_all_is_well_nothing_is_said(inside):
    interface = Interface(Medium.parse(inside))
    assert interface.limits() == () and interface.reversed().limits() == ()


def test_traced_rays_end_at_metal():
    gold, floor = Interface(Medium.parse("gold")), Plane((0, 0, -1), (0, 0, 1))
    for branches in (True, False):
        down = math.sin(1.0), 0, -math.cos(1.0)  # beyond Re n = 0.42: no ray goes on
        paths = trace(Shapes(Plane((0, 0, 0), (0, 0, 1), gold), floor), (0, 0, 1), down, branches=branches)
        R = float(gold.fresnel(math.cos(1.0)).R)
        assert 0.5 < R < 1 and list(paths.fate) == [Fate.SPLIT, Fate.ESCAPED]
        assert paths.energy[1] == pytest.approx(R, abs=1e-12) and paths.lost[0] == pytest.approx(1 - R, abs=1e-12)

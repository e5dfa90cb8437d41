# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between two media: against 50-digit values, and against what must hold for any two media.

Bounds come from the conditioning: with q = n_i / n_t, cos(theta_t) = sqrt((1 - q^2) + q^2 cos_i^2) is rounded by some
EPS (1 + q^2) / cos_t, however it is written, and everything else by a few EPS. No bound is wider than a small multiple
of that.
"""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from nim_addon.physics import Interface, Medium, povray_reflectance

EPS = np.finfo(float).eps
REFERENCE = Path(__file__).parents[1] / "data" / "fresnel.csv.gz"

magnitudes = st.floats(0.1, 10)
permeabilities = st.one_of(st.just(1.0), st.floats(0.05, 100))
angles = st.floats(0, math.radians(89.99))


@st.composite
def media(draw, mu=permeabilities):
    """A dielectric or a NIM."""
    sign = draw(st.sampled_from([-1.0, 1.0]))
    return Medium(sign * draw(magnitudes), sign * draw(mu))


interfaces = st.builds(Interface, media(), media())
without_mu = st.builds(Interface, media(st.just(1.0)), media(st.just(1.0)))
same_index = st.builds(lambda m, mu: Interface(Medium(-m.n, -math.copysign(mu, m.n)), m), media(), permeabilities)


def q_of(interface):
    return interface.outside.n / interface.inside.n


def cos_t_of(interface, theta_i):
    """cos(theta_t) from the sine alone, so not by the formula under test; NaN in total reflection."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(1 - np.square(q_of(interface) * np.sin(theta_i)))


def transmits(interface, theta_i):
    """Whether light at theta_i is transmitted, clearly enough that rounding has no say."""
    sine = abs(q_of(interface)) * math.sin(theta_i)
    assume(abs(sine - 1) > 1e-9)
    return sine < 1


@pytest.fixture(scope="module")
def reference():
    columns = np.loadtxt(REFERENCE, delimiter=",")
    assert columns.shape == (1200, 9)
    return columns


def test_fresnel_and_snell_against_50_digits(reference):
    total = 0
    for n_i, mu_i, n_t, mu_t, theta_i, theta_t, R_s, R_p, R in reference:
        interface = Interface(Medium(n_t, mu_t), outside=Medium(n_i, mu_i))
        got = interface.fresnel(math.cos(math.radians(theta_i)))
        np.testing.assert_allclose((got.R_s, got.R_p, got.R), (R_s, R_p, R), rtol=0, atol=1e-12)
        np.testing.assert_allclose(interface.theta_t(math.radians(theta_i)), math.radians(theta_t), rtol=0, atol=1e-12)
        assert interface.bends_backwards == (n_i * n_t < 0)
        total += math.isnan(theta_t)
    assert total == 381  # the table has many of both kinds


@given(interfaces, st.floats(0, 1))
@example(Interface(Medium(-1.0)), 0.0)
@example(Interface(Medium(-1.0)), 1.0)
@example(Interface(Medium(1.5)), 0.0)
def test_energy_is_conserved(interface, cos_i):
    R_s, R_p, R, T = interface.fresnel(cos_i)
    for share in (R_s, R_p, R, T):
        assert 0 <= share <= 1
    assert abs(R + T - 1) <= EPS
    assert abs(R - (R_s + R_p) / 2) <= EPS


@given(same_index, st.floats(1e-12, 1))
def test_where_only_the_sign_of_n_differs_reflectance_does_not_depend_on_the_angle(interface, cos_i):
    # cos_t = cos_i to the last bit there, also at grazing: r = (Z_t - Z_i) / (Z_t + Z_i)
    z_i, z_t = interface.outside.impedance, interface.inside.impedance
    assert abs(interface.fresnel(cos_i).R - ((z_t - z_i) / (z_t + z_i)) ** 2) <= 8 * EPS


@given(without_mu, angles)
def test_sign_alone_does_not_change_reflectance(interface, theta_i):
    outside, inside = interface.outside, interface.inside
    mirrored = Interface(Medium(-inside.n, -inside.mu), outside)
    assert interface.fresnel(math.cos(theta_i)) == mirrored.fresnel(math.cos(theta_i))


@given(interfaces, angles)
def test_the_way_back_is_the_way_there(interface, theta_i):
    assume(transmits(interface, theta_i))
    theta_t = float(interface.theta_t(theta_i))
    assert theta_t == 0 or (theta_t < 0) == interface.bends_backwards or theta_i == 0
    back = float(interface.reversed().theta_t(abs(theta_t)))
    # asin divides what rounding does to a sine by the cosine
    bound = 8 * EPS * (1 + math.tan(theta_i))
    assert abs(abs(back) - theta_i) <= bound

    cos_i, cos_t = math.cos(theta_i), math.cos(theta_t)
    assume(cos_t > 1e-3)
    q = q_of(interface)
    bound = 8 * EPS * ((1 + q * q) / cos_t**2 + (1 + 1 / (q * q)) / cos_i**2)
    there, back = interface.fresnel(cos_i), interface.reversed().fresnel(cos_t)
    np.testing.assert_allclose(there, back, rtol=0, atol=bound)


def test_reversed_twice_is_the_same():
    interface = Interface(Medium(-1.33, -10), Medium(1.5))
    assert interface.reversed() == Interface(Medium(1.5), Medium(-1.33, -10))
    assert interface.reversed().reversed() == interface


@given(
    interfaces,
    angles,
    st.floats(0, 2 * math.pi),
    st.floats(0, math.pi),
    st.floats(0, 2 * math.pi),
    st.floats(1e-3, 1e3),
    st.booleans(),
)
def test_refracted_vectors(interface, theta_i, azimuth, tilt, turn, length, from_inside):
    # a frame turned anyhow, whose third axis is the normal
    normal = np.array([math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt)])
    x = np.array([math.cos(tilt) * math.cos(turn), math.cos(tilt) * math.sin(turn), -math.sin(tilt)])
    y = np.cross(normal, x)
    along = math.sin(theta_i) * (math.cos(azimuth) * x + math.sin(azimuth) * y)
    d = along + (1 if from_inside else -1) * math.cos(theta_i) * normal
    n_i, n_t = interface.outside.n, interface.inside.n
    if from_inside:
        n_i, n_t = n_t, n_i
    crossing = transmits(interface.reversed() if from_inside else interface, theta_i)
    t = interface.refract(length * d, length * normal)
    if not crossing:
        assert np.isnan(t).all()
        return
    q = n_i / n_t
    bound = 16 * EPS * (1 + q * q) * (1 + 1 / math.sqrt(1 - (q * math.sin(theta_i)) ** 2))
    assert abs(np.linalg.norm(t) - 1) <= bound, "not of unit length"
    assert abs(t @ np.cross(d, normal)) <= bound, "out of the plane of incidence"
    assert (t @ normal) * (d @ normal) > 0, "not on the other side of the surface"
    tangent_d, tangent_t = d - (d @ normal) * normal, t - (t @ normal) * normal
    # Snell with its sign, as vectors: opposite signs of n put the ray on the side of the normal it came from
    np.testing.assert_allclose(n_t * tangent_t, n_i * tangent_d, rtol=0, atol=abs(n_t) * bound)
    if math.sin(theta_i) > 1e-6:
        assert (tangent_d @ tangent_t < 0) == (n_i * n_t < 0) == interface.bends_backwards
    # the same interface described from its other side
    np.testing.assert_array_equal(t, interface.reversed().refract(length * d, -length * normal))


def test_refract_worked_by_hand():
    # thesis figure 2.1 and 3.1: 45 degrees from above, into water and into its mirror
    d, up = (1, 0, -1), (0, 0, 1)
    sine = math.sqrt(0.5) / 1.33
    cosine = math.sqrt(1 - sine**2)
    np.testing.assert_allclose(Interface(Medium(1.33)).refract(d, up), (sine, 0, -cosine), atol=2 * EPS)
    np.testing.assert_allclose(Interface(Medium(-1.33)).refract(d, up), (-sine, 0, -cosine), atol=2 * EPS)


def test_perfect_lens_sends_every_ray_back_to_its_own_depth():
    # Veselago's flat lens, n = -1: x changes sign, z does not
    rays = np.random.default_rng(1).normal(size=(100, 3))
    np.testing.assert_allclose(
        Interface(Medium(-1)).refract(rays, (0, 0, 1)),
        rays * (-1, -1, 1) / np.linalg.norm(rays, axis=1, keepdims=True),
        rtol=0,
        atol=8 * EPS,
    )


def test_refract_broadcasts_and_tells_the_sides_apart():
    interface = Interface(Medium(-1.5))
    random = np.random.default_rng(2)
    d, normals = random.normal(size=(5, 1, 3)), random.normal(size=(4, 3))
    got = interface.refract(d, normals)
    assert got.shape == (5, 4, 3)
    for i in range(5):
        for j in range(4):
            np.testing.assert_array_equal(got[i, j], interface.refract(d[i, 0], normals[j]))


@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e-5, 1e200])
def test_refract_takes_vectors_of_any_length(length):
    expected = Interface(Medium(-1.5)).refract((3, 0, -3), (0, 0, 1))
    got = Interface(Medium(-1.5)).refract((3 * length, 0, -3 * length), (0, 0, length))
    np.testing.assert_allclose(got, expected, rtol=0, atol=4 * EPS)


@pytest.mark.parametrize("d, normal", [((0, 0, 0), (0, 0, 1)), ((0, 0, 1), (0, 0, 0)), ((math.nan, 0, 1), (0, 0, 1))])
def test_refract_refuses_vectors_that_point_nowhere(d, normal, one_sentence):
    with pytest.raises(ValueError) as caught:
        Interface(Medium(-1.5)).refract(d, normal)
    one_sentence(caught.value, "direction", "normal", "zero")


@pytest.mark.parametrize("cos_i", [-0.1, 1.1, math.nan, [0.5, 2]])
def test_cosines_out_of_range_are_refused(cos_i, one_sentence):
    for call in (Interface(Medium(-1.5)).fresnel, lambda c: povray_reflectance(1, -1.5, c)):
        with pytest.raises(ValueError) as caught:
            call(cos_i)
        one_sentence(caught.value, "cos_i", "[0, 1]")


def test_fresnel_and_theta_t_broadcast():
    interface = Interface(Medium(-1.5))
    cos_i = np.linspace(0, 1, 12).reshape(3, 4)
    got = interface.fresnel(cos_i)
    assert all(share.shape == (3, 4) for share in got)
    assert got.R[1, 2] == interface.fresnel(cos_i[1, 2]).R
    assert interface.theta_t(np.zeros((2, 3))).shape == (2, 3)


@given(interfaces)
def test_critical_angle(interface):
    critical = interface.critical_angle()
    ratio = abs(interface.inside.n / interface.outside.n)
    if ratio >= 1:
        assert critical is None
        assert not np.isnan(interface.theta_t(math.radians(89.99)))
        return
    assume(ratio < 0.999)
    below, above = critical * (1 - 1e-6), critical * (1 + 1e-6)
    assert interface.fresnel(math.cos(below)).R < 1 and not np.isnan(interface.theta_t(below))
    assert interface.fresnel(math.cos(above)) == (1, 1, 1, 0)
    assert np.isnan(interface.theta_t(above))
    assert interface.fresnel(0.0).R == 1


def test_critical_angle_of_water_and_of_its_mirror():
    # thesis 2.10
    for n in (1.33, -1.33):
        assert math.degrees(Interface(Medium(1), Medium(n)).critical_angle()) == pytest.approx(48.75, abs=0.005)


@given(interfaces, st.sampled_from("sp"))
def test_brewster_angle(interface, polarization):
    z_i, z_t = interface.outside.impedance, interface.inside.impedance
    q = q_of(interface)
    if polarization == "s":
        z_i, z_t = z_t, z_i
    assume(abs(z_i - z_t) > 1e-6 * z_i and abs(abs(q) - 1) > 1e-6 and abs(z_i - abs(q) * z_t) > 1e-6 * z_i)
    angle = interface.brewster_angle(polarization)
    # r runs from (Z_i - Z_t) / (Z_i + Z_t) at normal incidence to -1 at grazing, or to +1 at the critical angle; it
    # has one zero if it changes sign on the way and none otherwise
    ends = z_i - z_t, 1 if abs(q) > 1 else -1
    assert (angle is not None) == (ends[0] * ends[1] < 0)
    if angle is None:
        return
    above, below = z_i**2 - z_t**2, z_i**2 - (q * z_t) ** 2
    sine_error = EPS * ((z_i**2 + z_t**2) / abs(above) + (z_i**2 + (q * z_t) ** 2) / abs(below)) + 2 * EPS
    cos_i, cos_t = math.cos(angle), cos_t_of(interface, angle)
    # r = (a - b) / (a + b) at a = b moves by half of what a / b does
    bound = sine_error * (1 / cos_i**2 + q * q / cos_t**2) + 8 * EPS * (1 + q * q) / cos_t**2
    got = interface.fresnel(math.cos(angle))
    assert (got.R_s if polarization == "s" else got.R_p) <= bound**2


@given(without_mu)
def test_brewster_without_permeability_is_the_textbook_one(interface):
    ratio = abs(interface.inside.n / interface.outside.n)
    assume(abs(ratio - 1) > 1e-6)
    assert interface.brewster_angle("s") is None
    # asin(sqrt(x)) of a quotient of differences: each loses what 1 - ratio^2 cancels
    bound = 16 * EPS * (1 + ratio) ** 3 / (ratio * abs(1 - ratio))
    assert abs(interface.brewster_angle() - math.atan(ratio)) <= bound


def test_brewster_where_permeability_decides():
    vacuum = Medium(1)
    # the same permittivity on both sides, so only s has one: tan = n_t / n_i with mu in the place of epsilon
    for sign in (1, -1):
        magnetic = Interface(Medium(sign * 2, sign * 4), vacuum)
        assert magnetic.brewster_angle("p") is None
        assert magnetic.brewster_angle("s") == pytest.approx(math.atan(2), rel=1e-15)
    # the same impedance: nothing is reflected at normal incidence, which is no Brewster angle
    matched = Interface(Medium(-2, -2), vacuum)
    assert matched.brewster_angle("p") is None and matched.brewster_angle("s") is None
    assert matched.fresnel(1.0).R == 0
    # an interface that reflects nothing anywhere names no single angle
    assert Interface(Medium(-1), vacuum).brewster_angle() is None


def test_brewster_refuses_another_polarization(one_sentence):
    with pytest.raises(ValueError) as caught:
        Interface(Medium(-1.5)).brewster_angle("x")
    one_sentence(caught.value, "'x'", "'s'", "'p'")


@given(without_mu, angles)
def test_povray_agrees_without_permeability(interface, theta_i):
    n_i, n_t, c = interface.outside.n, interface.inside.n, math.cos(theta_i)
    R = povray_reflectance(n_i, n_t, c)
    if not transmits(interface, theta_i):
        assert R == 1 == interface.fresnel(c).R
        return
    q, cos_t = abs(n_i / n_t), cos_t_of(interface, theta_i)
    assume(cos_t > 1e-3)
    # g = cos_t / q; c (g + c) - 1 cancels down to c g - sin^2
    bound = 16 * EPS * ((1 + q * q) / cos_t**2 + 1 / (c * cos_t / q + math.sin(theta_i) ** 2))
    assert abs(R - interface.fresnel(c).R) <= bound


def test_povray_knows_no_permeability():
    c = np.cos(np.radians([0, 30, 60]))
    with_mu = Interface(Medium(-1.33, -10)).fresnel(c).R
    assert np.all(with_mu - povray_reflectance(1, -1.33, c) > 0.3)
    # the thesis's own example has no total reflection, which (n_i / n_t)^2 in A.3 taken to the letter would give
    assert np.all(povray_reflectance(1, -1.5, np.linspace(0.01, 1, 50)) < 1)


def test_povray_broadcasts():
    assert povray_reflectance(1, [[1.5], [-1.5]], [0.2, 0.5, 1]).shape == (2, 3)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: what they hold, what they refuse and how, and the words people may write."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nim_addon.physics import MEDIA, Interface, Medium
from nim_addon.physics.media import LEAST_MAGNITUDE, MOST_MAGNITUDE

indices = st.floats(0.1, 10).flatmap(lambda n: st.sampled_from([n, -n]))
permeabilities = st.floats(0.05, 100)


@pytest.mark.parametrize("n, mu", [(1.5, 1.0), (-1.5, -1.0), (1, 1.0), ("-1.33", -1.0)])
def test_permeability_defaults_to_the_sign_of_the_index(n, mu):
    medium = Medium(n)
    assert (medium.n, medium.mu) == (float(n), mu)
    assert isinstance(medium.n, float) and isinstance(medium.mu, float)


def test_impedance_permittivity_and_sign():
    water, nim = Medium(1.33), Medium(-1.33, -10)
    assert water.impedance == pytest.approx(1 / 1.33, rel=1e-15) and not water.is_nim
    assert nim.impedance == pytest.approx(10 / 1.33, rel=1e-15) and nim.is_nim
    assert nim.epsilon == pytest.approx(-0.17689, rel=1e-15)


@given(indices, permeabilities)
def test_index_and_impedance_follow_from_permittivity_and_permeability(n, mu):
    medium = Medium(n, math.copysign(mu, n))
    assert medium.impedance > 0
    assert math.copysign(1, medium.epsilon) == math.copysign(1, n)
    # thesis 2.8, 2.15 and 4.8: |n| = sqrt(epsilon mu), Z = sqrt(mu / epsilon)
    assert math.sqrt(medium.epsilon * medium.mu) == pytest.approx(abs(n), rel=1e-15)
    assert math.sqrt(medium.mu / medium.epsilon) == pytest.approx(medium.impedance, rel=1e-15)


@pytest.mark.parametrize("text", ["air", "nim-mu25", "n=1e-6", "1.5+0j", "epsilon=-2,mu=-1"])
def test_what_is_a_real_medium(text):
    assert Medium.parse(text).is_real


@pytest.mark.parametrize(
    "text",
    ["n-bk7", "nim-causal", "-1.33+1e-6j", "n=1.5,length=0.1", "epsilon=2,mu=2+1e-9j", "epsilon=-2,mu=1", "gold"],
)
def test_what_is_none(text):
    assert not Medium.parse(text).is_real


@pytest.mark.parametrize("number", [1.5 + 0.1j, np.complex64(1.5 + 0.1j), np.array(1.5 + 0.1j)])
def test_no_kind_of_complex_number_loses_its_loss(number):
    assert Medium(number).k == pytest.approx(0.1)


def test_a_medium_is_a_value():
    medium = Medium(-1.5)
    with pytest.raises(dataclasses.FrozenInstanceError):
        medium.n = 1.5
    assert medium == Medium(-1.5, -1) and hash(medium) == hash(Medium(-1.5, -1))
    assert medium != Medium(-1.5, -2)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((0,), ("n = 0", "negative one for a NIM")),
        ((-0.0,), ("n = 0",)),
        ((math.nan,), ("n = nan", "finite", "-1.5")),
        ((math.inf,), ("n = inf", "finite")),
        (("-inf",), ("n = -inf", "finite")),
        (("thick",), ("n = 'thick'", "number", "-1.5")),
        ((None,), ("n = None", "number")),
        (([1.5],), ("n = [1.5]", "number")),
        ((-1.5, 1), ("mu = 1", "n = -1.5", "negative", "below 0", "get -1")),
        ((1.5, -1), ("mu = -1", "n = 1.5", "positive", "above 0", "get +1")),
        ((1.5, 0), ("mu = 0", "above 0")),
        ((1.5, math.nan), ("mu = nan", "finite")),
        ((1e-300,), ("n = 1e-300", "between 1e-06 and 1e+06")),
        ((-1e300,), ("n = -1e+300", "between 1e-06 and 1e+06")),
        ((1.5, 1e7), ("mu = 1e+07", "between 1e-06 and 1e+06")),
        ((1.5, 1e-7), ("mu = 1e-07", "between 1e-06 and 1e+06")),
        ((1.5, "much"), ("mu = 'much'", "number")),
    ],
)
def test_rejections_name_what_is_wrong_and_what_is_allowed(arguments, words, one_sentence):
    with pytest.raises(ValueError) as caught:
        Medium(*arguments)
    one_sentence(caught.value, *words)


@pytest.mark.parametrize(
    "text, medium",
    [
        ("water", Medium(1.33)),
        (" Diamond ", Medium(2.418)),
        ("NIM", Medium(-1.33)),
        ("nim-mu25", Medium(-1.33, -25)),
        ("nim-1.5", Medium(-1.5)),
        ("-1.33", Medium(-1.33)),
        ("+1.5", Medium(1.5)),
        (".9", Medium(0.9)),
        (-1.5, Medium(-1.5)),
        ("n=-1.33", Medium(-1.33)),
        ("n=-1.33,mu=-10", Medium(-1.33, -10)),
        ("\N{MINUS SIGN}1.33", Medium(-1.33)),
        ("n=\N{MINUS SIGN}1.33,mu=\N{MINUS SIGN}10", Medium(-1.33, -10)),
        ("nim\N{MINUS SIGN}1.5", Medium(-1.5)),
        (" mu = 2 , n = 1.5 ", Medium(1.5, 2)),
        (Medium(-1.5, -3), Medium(-1.5, -3)),
    ],
)
def test_parse(text, medium):
    assert Medium.parse(text) == medium


@pytest.mark.parametrize(
    "text, words",
    [
        ("watr", ("'watr'", "did you mean water", "glass", "-1.33", "n=-1.33,mu=-10")),
        ("plastic", ("'plastic'", "water", "nim-mu25")),
        ("", ("''", "water")),
        ("n=1.5,x=2", ("n=1.5,x=2", "n=-1.33,mu=-10")),
        ("mu=2", ("mu=2", "n=-1.33")),
        ("n=1.5,n=2", ("n=1.5,n=2", "n=-1.33")),
        ("n=", ("n = ''", "number")),
        ("0", ("n = 0",)),
        ("nan", ("nan", "finite")),
        ("1.5 or so", ("'1.5 or so'", "number")),
        ("n=-1.5,mu=2", ("mu = 2", "below 0")),
    ],
)
def test_parse_refuses(text, words, one_sentence):
    with pytest.raises(ValueError) as caught:
        Medium.parse(text)
    one_sentence(caught.value, *words)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n", (LEAST_MAGNITUDE, MOST_MAGNITUDE))
@pytest.mark.parametrize("mu", (LEAST_MAGNITUDE, MOST_MAGNITUDE))
def test_the_extremes_are_still_computed_with(n, mu):
    for other in (Medium(-LEAST_MAGNITUDE, -MOST_MAGNITUDE), Medium(-MOST_MAGNITUDE, -LEAST_MAGNITUDE), Medium(1)):
        surface = Interface(Medium(n, mu), other)
        assert np.isfinite(surface.fresnel(np.linspace(0, 1, 91))).all()
        surface.critical_angle(), surface.brewster_angle(), surface.brewster_angle("s")


@given(indices, permeabilities)
def test_what_is_printed_is_read_back_to_the_last_bit(n, mu):
    medium = Medium(n, math.copysign(mu, n))
    assert Medium.parse(str(medium)) == medium


def test_what_is_printed_is_short():
    assert str(Medium(-1.33)) == "n=-1.33"
    assert str(Medium(2, 10)) == "n=2,mu=10"


@pytest.mark.parametrize("name", MEDIA)
def test_names_read_themselves(name):
    assert Medium.parse(name) is MEDIA[name]


def test_the_catalogue_holds_the_media_of_the_thesis():
    # chapter 5 and appendices A, B: water, glass, diamond and their mirrors, the extremes, the permeabilities of 5.10
    held = set(MEDIA.values())
    assert {Medium(n) for n in (1, 1.33, 1.5, 2.418, -1.025, -1.33, -1.5, -2.418, -4.1)} <= held
    assert {Medium(-1.33, -10), Medium(-1.33, -25)} <= held
    wanted = {"vacuum": 1, "air": 1, "water": 1.33, "glass": 1.5, "diamond": 2.418, "nim": -1.33}
    assert {name: MEDIA[name] for name in wanted} == {name: Medium(n) for name, n in wanted.items()}
    with pytest.raises(TypeError):
        MEDIA["water"] = Medium(2)

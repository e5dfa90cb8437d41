# SPDX-License-Identifier: GPL-3.0-or-later
"""Prisms and drops: against closed forms in 24 digits, against traced rays, and that NIM drops have no bow."""

import csv
import gzip
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nim_addon.physics import Interface, Medium
from nim_addon.physics.deviation import apex_for, bow, drop, glory, prism, symmetric
from nim_addon.physics.rays import Convex, Fate, Shapes, Sphere, trace

DEGREE = math.pi / 180


def rows(path):
    with gzip.open(path, "rt", encoding="utf-8") as file:
        return list(csv.DictReader(line.removeprefix("# ") for line in file))


def index(row):
    """n of a row by our own medium, held to the table's."""
    sign, _, name = row["medium"].rpartition("minus ")
    n = Medium.parse(name).at(float(row["wavelength_nm"])).n * (-1 if "minus" in row["medium"] else 1)
    assert n == pytest.approx(float(row["n"]), abs=1e-14)
    return n


def test_prisms_to_a_billionth_of_a_degree(data):
    table = rows(data / "prism.csv.gz")
    total = 0
    for row in table:
        found = prism(index(row), float(row["apex_deg"]) * DEGREE, float(row["incidence_deg"]) * DEGREE)
        np.testing.assert_allclose(found / DEGREE, float(row["deviation_deg"]), rtol=0, atol=1e-9)
        total += np.isnan(found)
    assert len(table) == 480 and 0 < total < 200


@given(st.floats(1.05, 1.85) | st.floats(-2.8, -0.1))
def test_the_symmetric_ray_is_turned_by_what_is_stationary(n):
    apex = apex_for(n)
    i = symmetric(n, apex)
    assert prism(n, apex, i) == pytest.approx(2 * i - apex, abs=1e-12)
    before, after = prism(n, apex, i + np.array([-1e-5, 1e-5]))
    assert abs(after - before) / 2e-5 < 1e-4
    if n > 1:
        assert (prism(n, apex, np.linspace(i - 0.05, i + 0.05, 21)) >= 2 * i - apex - 1e-12).all()


def test_bows_and_that_negative_drops_have_none(data):
    table, bows = rows(data / "rainbow.csv.gz"), 0
    for row in table:
        n, order = index(row), int(row["order"])
        found = bow(n, order)
        assert (found is None) == math.isnan(float(row["deviation_deg"]))
        if found is None:
            continue
        bows += 1
        got, wanted = np.array(found) / DEGREE, [float(row[key]) for key in ("incidence_deg", "deviation_deg")]
        np.testing.assert_allclose(got[:2], wanted, rtol=0, atol=1e-9)
        if not math.isnan(float(row["bow_radius_deg"])):
            assert got[2] == pytest.approx(float(row["bow_radius_deg"]), abs=1e-9)
    assert len(table) == 122 and bows == 44


@pytest.mark.parametrize("wavelength, radius", [(400, 40.57), (550, 41.83), (700, 42.44)])
def test_the_bow_of_water(wavelength, radius):
    assert bow(Medium.parse("water-daimon").at(wavelength).n).radius / DEGREE == pytest.approx(radius, abs=5e-3)


@given(st.floats(-10, -0.05), st.integers(0, 5))
def test_the_deviation_by_a_negative_drop_only_grows(n, order):
    most = math.asin(min(1, abs(n))) if abs(n) < 1 else math.pi / 2
    deviation = drop(n, np.linspace(0, most, 200)[:-1], order)
    assert (np.diff(deviation) > 0).all() and bow(n, max(order, 1)) is None


@given(st.floats(1.1, 2.5), st.integers(1, 3))
def test_a_bow_is_where_the_deviation_is_least(n, order):
    found = bow(n, order)
    if found is None:
        assert n * n - 1 > order * (order + 2)
        return
    around = drop(n, np.clip(found.incidence + np.linspace(-0.1, 0.1, 21), 0, math.pi / 2), order)
    assert found.deviation <= around.min() + 1e-12 and 0 <= found.radius <= math.pi


@given(st.floats(-10, -0.05))
def test_the_ring_that_a_negative_drop_sends_straight_back(n):
    b = glory(n)
    assert drop(n, math.asin(b), 0) == pytest.approx(math.pi, abs=1e-12)
    assert glory(-n) is None


@pytest.mark.parametrize("n", [-1.33, -1.5, -0.7])
def test_traced_rays_come_straight_back_there(n):
    paths = trace(Shapes(Sphere((0, 0, 0), 1, Interface(Medium(n)))), (glory(n), 0, 5), (0, 0, -1), branches=False)
    (out,) = np.flatnonzero(paths.fate == Fate.ESCAPED)
    np.testing.assert_allclose(paths.direction[out], (0, 0, 1), atol=1e-7)


@pytest.mark.parametrize("n, apex, incidence", [(1.5, 60, 45), (1.5, 60, 50), (-1.33, 24, 20), (-1.33, 24, -10)])
def test_traced_rays_leave_a_prism_as_predicted(n, apex, incidence):
    half = apex * DEGREE / 2
    normals = (-math.cos(half), 0, math.sin(half)), (math.cos(half), 0, math.sin(half)), (0, 0, -1)
    solid = Convex(((0, 0, 1), (0, 0, 1), (0, 0, -9)), normals, Interface(Medium(n)))
    # into the left face, from the base's side of its normal
    inward = -np.array(normals[0])
    up = np.array((math.sin(half), 0, math.cos(half)))
    d = math.cos(incidence * DEGREE) * inward + math.sin(incidence * DEGREE) * up
    point = np.array((0, 0, 1)) - 2 * up
    paths = trace(Shapes(solid), point - d, d, branches=False)
    last = paths.direction[paths.depth == 2][0]
    turned = math.atan2(d[2], d[0]) - math.atan2(last[2], last[0])  # towards the base, which is below
    assert math.remainder(turned, 2 * math.pi) == pytest.approx(float(prism(n, 2 * half, incidence * DEGREE)), abs=1e-7)


def test_arrays_broadcast_and_what_cannot_pass_is_nan(one_sentence):
    assert prism([[1.4], [-1.4]], 0.2, [0, 0.1, 0.2]).shape == (2, 3)
    assert np.isnan(prism(0.5, 0.1, 1.0)) and np.isnan(prism(1.5, 2.0, 0.1)) and np.isnan(drop(0.5, 1.0))
    with pytest.raises(ValueError) as caught:
        bow(1.33, 0)
    one_sentence(caught.value, "order = 0", "1 or more")

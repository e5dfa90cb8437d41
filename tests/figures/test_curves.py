# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel curves: every claim holds, a claim can fail, and the files are whole and the same each time."""

import csv
import math
import sys

import numpy as np
import pytest

from nim_addon.base.files import whole
from nim_addon.figures import curves
from nim_addon.figures.claims import Claim

FIGURES = {figure.number: figure for figure in curves.FIGURES}


@pytest.mark.parametrize("number", FIGURES)
def test_every_claim_holds(number):
    claims = FIGURES[number].measure({})
    assert claims
    for claim in claims:
        assert all(isinstance(value, int | float) for value in claim[1:4])
        assert claim.holds, claim.row()


def test_a_claim_fails_where_the_index_has_lost_its_sign(monkeypatch):
    standard = curves.standard_reflectances
    monkeypatch.setattr(curves, "standard_reflectances", lambda n_i, n_t, cos_i: standard(n_i, abs(n_t), cos_i))
    assert not all(claim.holds for claim in curves.standard_claims())


def test_the_standard_form_is_the_textbooks_for_glass():
    # at 60 degrees sin(theta_t) = 1 / sqrt(3)
    cos_t = math.sqrt(2 / 3)
    R_s, R_p, R = curves.standard_reflectances(1.0, 1.5, np.array([1.0, 0.5]))
    np.testing.assert_allclose(R[0], 0.04)
    np.testing.assert_allclose(R_s[1], ((0.5 - 1.5 * cos_t) / (0.5 + 1.5 * cos_t)) ** 2)
    np.testing.assert_allclose(R_p[1], ((0.75 - cos_t) / (0.75 + cos_t)) ** 2)


def test_a_claim_compares_and_prints():
    claim = Claim("angle", 48.75, 48.8, 0.06, "deg")
    assert claim.holds and claim.row().startswith("holds") and "48.75 deg" in claim.row()
    assert not claim._replace(allowed=0.04).holds
    assert not claim._replace(measured=math.nan).holds
    assert claim._replace(allowed=0.04).row().startswith("FAILS")


@pytest.mark.parametrize(
    ("number", "numbers"),
    [
        ("A.1", curves.standard_curves),
        ("A.2", curves.impedance_curves),
        ("A.3", curves.povray_curves),
        ("A.4", curves.permeability_curves),
    ],
)
def test_a_figure_is_three_files_the_last_with_the_numbers(number, numbers, tmp_path):
    pytest.importorskip("matplotlib")
    files = FIGURES[number].draw(tmp_path)
    assert [file.name for file in files] == [f"figure-{number}{suffix}" for suffix in (".svg", ".png", ".csv")]
    assert sorted(tmp_path.iterdir()) == sorted(files)
    with files[2].open(newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    columns = numbers()
    assert rows[0] == list(columns) and len(rows) == 1802
    np.testing.assert_allclose(np.array(rows[1:], float), np.stack(list(columns.values()), -1), rtol=1e-11)


def test_files_are_the_same_each_time(tmp_path):
    pytest.importorskip("matplotlib")
    for file, again in zip(*(FIGURES["A.1"].draw(tmp_path / name) for name in "ab"), strict=True):
        assert file.read_bytes() == again.read_bytes()


def test_without_matplotlib_it_says_so(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(RuntimeError, match=r"matplotlib is missing.*pip install matplotlib"):
        FIGURES["A.2"].draw(tmp_path)
    assert all(claim.holds for claim in curves.impedance_claims())  # the numbers need none
    assert not list(tmp_path.iterdir())


def test_a_file_that_fails_halfway_leaves_the_old_one(tmp_path):
    file = tmp_path / "figure.svg"
    file.write_text("old")

    def write(part):
        part.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whole(file, write)
    assert file.read_text() == "old" and list(tmp_path.iterdir()) == [file]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the refractiveindex.info database: all their formulas and tables, and what is none of them."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from nim_addon import physics
from nim_addon.physics import Formula, Medium, Table

HEAD = """# this file is part of refractiveindex.info database

REFERENCES: |
    A. Nobody. <i>A glass</i>: of nothing.
COMMENTS: |
    Made up
DATA:
"""
NK = """  - type: tabulated nk
    data: |
        0.300 1.6 1.0E-2
        0.500 1.5 5E-3
        0.800 1.4 0
"""


@pytest.fixture
def written(tmp_path):
    """written(text of DATA) -> the path, as text, of a file with it."""

    def write(data, head=HEAD):
        path = tmp_path / "own glass.yml"
        path.write_text(head + data, encoding="utf-8")
        return str(path)

    return write


def formula(number, *coefficients, limits="0.3 2.5"):
    numbers = " ".join(map(str, coefficients))
    return f"  - type: formula {number}\n    wavelength_range: {limits}\n    coefficients: {numbers}\n"


X = 0.6  # micrometres


@pytest.mark.parametrize(
    "number, coefficients, n",
    [
        (1, (0.1, 1.0, 0.1), math.sqrt(1.1 + X**2 / (X**2 - 0.01))),
        (2, (0.1, 1.0, 0.01, 0.5, 100), math.sqrt(1.1 + X**2 / (X**2 - 0.01) + 0.5 * X**2 / (X**2 - 100))),
        (3, (2.2, 0.01, -2, -0.01, 2), math.sqrt(2.2 + 0.01 / X**2 - 0.01 * X**2)),
        (4, (2.2, 0.02, 0, 0.2, 2), math.sqrt(2.2 + 0.02 / (X**2 - 0.2**2))),
        (
            4,
            (2.2, 0.02, 1, 0.2, 2, 0.03, 2, 0.3, 1, -0.01, 2, 0.02, -2),
            math.sqrt(2.2 + 0.02 * X / (X**2 - 0.04) + 0.03 * X**2 / (X**2 - 0.3) - 0.01 * X**2 + 0.02 / X**2),
        ),
        (5, (1.5, 0.004, -2), 1.5 + 0.004 / X**2),
        (6, (1e-5, 0.06, 240), 1 + 1e-5 + 0.06 / (240 - X**-2)),
        (
            7,
            (1.5, 0.01, 0.001, -0.002, 0.0001, 0.00001),
            1.5 + 0.01 / (X**2 - 0.028) + 0.001 / (X**2 - 0.028) ** 2 - 0.002 * X**2 + 0.0001 * X**4 + 0.00001 * X**6,
        ),
        (8, (0.2, 0.1, 0.01, 0.001), None),
        (9, (2.3, 0.01, 0.02, 0.03, 0.4, 0.5), math.sqrt(2.3 + 0.01 / (X**2 - 0.02) + 0.03 * 0.2 / (0.04 + 0.5))),
    ],
)
def test_the_formulas_of_the_database(number, coefficients, n, written):
    medium = Medium.parse(written(formula(number, *coefficients)))
    found = medium.at(1000 * X).n
    if number == 8:
        ratio = 0.2 + 0.1 * X**2 / (X**2 - 0.01) + 0.001 * X**2
        assert (found**2 - 1) / (found**2 + 2) == pytest.approx(ratio, rel=1e-14)
    else:
        assert found == pytest.approx(n, rel=1e-14)
    assert medium.dispersion.n == Formula(number, coefficients, (300, 2500)) and medium.k == 0


def test_a_file_is_a_medium_by_its_path(written, tmp_path):
    path = written(NK)
    medium = Medium.parse(path)
    assert str(medium) == path and Medium.parse(str(medium)) == medium
    assert medium.at(400).index == pytest.approx(1.55 + 0.0075j) and medium.at(300).index == 1.6 + 0.01j
    assert medium.dispersion.source == "A. Nobody. A glass: of nothing."
    shutil.copy(path, tmp_path / "elsewhere.YML")
    elsewhere = Medium.parse(tmp_path / "elsewhere.YML")
    assert elsewhere == medium and hash(elsewhere) == hash(medium) and str(elsewhere) != path


def test_n_and_k_may_be_apart_and_are_known_where_both_are(written):
    k = "  - type: tabulated k\n    data: |\n        0.400 0.1\n        0.700 0.2\n"
    dispersion = Medium.parse(written(formula(5, 1.5) + k)).dispersion
    assert dispersion.range_nm == (400, 700) and dispersion.k == Table([400, 700], [0.1, 0.2])
    n = "  - type: tabulated n\n    data: |\n        0.400 -1.5\n        0.700 -1.2\n"
    older = k.replace("0.400", "0.2") + n + "CONDITIONS:\n    temperature: 293\n"
    medium = Medium.parse(written(older))
    assert medium.is_nim and medium.mu == -1 and medium.dispersion.range_nm == (400, 700)
    with_old_key = Medium.parse(written(formula(5, 1.5).replace("wavelength_range", "range")))
    assert with_old_key.dispersion.range_nm == (300, 2500)


def test_the_packages_own_files_name_their_licence_and_references():
    files = sorted((Path(physics.__file__).parent / "data").glob("*.yml"))
    assert len(files) == 8
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert "CC0" in text and "REFERENCES" in text, file


BAD = HEAD + "  - type: tabulated nk\n    data: |\n"


@pytest.mark.parametrize(
    "text, words",
    [
        ("", ("no DATA",)),
        ("just words\n", ("no DATA",)),
        (HEAD, ("no DATA",)),
        (HEAD + "    temperature: 293\n", ("no list of blocks",)),
        (
            HEAD + "  - type: tabulated nm\n    data: |\n        0.5 1\n",
            ("'tabulated nm'", "tabulated nk", "formula 1 to 9"),
        ),
        (HEAD + formula(10, 1, 2, 3), ("formula 10", "1 to 9")),
        (HEAD + formula(1, 1, 2), ("'formula 1'", "2 coefficients")),
        (HEAD + formula(2, 0, 1, "x"), ("coefficients", "finite numbers")),
        (HEAD + formula(2, 0, 1, 0.01, limits="0.3"), ("range", "2 finite numbers")),
        (HEAD + formula(2, 0, 1, 0.01, limits="0.6 0.4"), ("range of 600 to 400 nm",)),
        (HEAD + formula(2, 0, 1, 0.01, limits="0.6 0.9"), ("600 to 900 nm", "not cover 550 nm")),
        (BAD + "        0.4 1.5 nan\n        0.7 1.5 0\n", ("'tabulated nk'", "3 finite numbers", "nan")),
        (BAD + "        0.4 1.5\n        0.7 1.5\n", ("3 finite numbers",)),
        (BAD + "        0.4 1.5 0\n        0.7 1.5 -1e-3\n", ("gain", "700 nm")),
        (BAD + "        0.7 1.5 0\n        0.4 1.5 0\n", ("rise", "400 nm")),
        (BAD + "        0.4 1.5 0\n", ("two rows",)),
        (BAD, ("empty",)),
        (BAD + "        0.8 1.5 0\n        0.9 1.5 0\n", ("800 to 900 nm", "not cover 550 nm")),
        (BAD + "        400 1.5 0\n        700 1.5 0\n", ("not cover 550 nm", "micrometres")),
        (HEAD + "  - type: tabulated k\n    data: |\n        0.4 0\n        0.7 0\n", ("no n", "only k")),
        (HEAD + NK + formula(5, 1.5), ("n twice",)),
    ],
)
def test_what_is_no_such_file_is_refused_in_a_sentence(text, words, written, one_sentence):
    path = written(text, head="")
    with pytest.raises(ValueError) as caught:
        Medium.parse(path)
    one_sentence(str(caught.value).replace(path, "FILE"), "FILE", *words)


def test_what_is_no_file_is_refused(tmp_path, one_sentence):
    (tmp_path / "binary.yml").write_bytes(b"\xff\xfe\x00\x80")
    (tmp_path / "folder.yml").mkdir()
    for name, word in (("missing", "there is no file"), ("binary", "no text"), ("folder", "cannot be read")):
        path = str(tmp_path / f"{name}.yml")
        with pytest.raises(ValueError) as caught:
            Medium.parse(path)
        one_sentence(str(caught.value).replace(path, "FILE"), "FILE", word)


def test_values_between_rows_and_at_the_ends(written):
    n, mu = Medium.parse(written(NK)).spectrum([300, 400, 500, 800])
    np.testing.assert_allclose(n, [1.6 + 0.01j, 1.55 + 0.0075j, 1.5 + 0.005j, 1.4], rtol=1e-15)
    np.testing.assert_array_equal(mu, 1)
    with pytest.raises(ValueError, match="300 to 800 nm"):
        Medium.parse(written(NK)).at(299)

# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray fresnel` of media that absorb and disperse: numbers by hand and from files, and what it refuses."""

import csv
import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

from nim_addon import command
from nim_addon.command.fresnel import MOST_ROWS
from nim_addon.physics import DISPERSIVE, MEDIA, Interface, Medium

DATA = Path(__file__).parents[1] / "data"
# The three rows of Johnson and Christy's gold around 550 nm: micrometres, n, k.
GOLD = """DATA:
  - type: tabulated nk
    data: |
        0.5209 0.62 2.081
        0.5486 0.43 2.455
        0.5821 0.29 2.863
"""


@pytest.fixture
def fresnel(capsys):
    """fresnel(line) -> what `nimray fresnel` of that line prints."""

    def run(line):
        assert command.main(["fresnel", *line.split()]) == 0
        printed = capsys.readouterr()
        assert printed.err == ""
        return printed.out

    return run


def rows_of(text):
    return [{key: float(value or "nan") for key, value in row.items()} for row in csv.DictReader(text.splitlines())]


def normal(n, k):
    """R straight on, from air, where mu is 1."""
    return ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)


def test_real_media_have_the_keys_and_the_lines_that_they_always_had(fresnel):
    for line in ("--inside nim-mu10", "--inside nim-mu10 --wavelength 400"):
        answer = json.loads(fresnel(f"{line} --json"))
        assert list(answer) == ["outside", "inside", "critical_angle", "brewster_angle", "rows"]
        assert answer["inside"] == {"n": -1.33, "mu": -10.0} and answer["outside"] == {"n": 1.0, "mu": 1.0}
        assert fresnel(f"{line} --step 90") == (
            "from n=1 into n=-1.33,mu=-10, angles in degrees\nbends backwards: yes\ncritical angle:  none\n"
            "Brewster angle:  none\n theta_i   theta_t       R_s       R_p         R         T\n"
            "       0     0.000  0.585569  0.585569  0.585569  0.414431\n"
            "      90   -48.753  1.000000  1.000000  1.000000  0.000000\n"
        )


def test_the_index_at_a_line_of_the_spectrum_is_the_reference(fresnel):
    with gzip.open(DATA / "prism.csv.gz", "rt") as file:
        rows = list(csv.DictReader(line.removeprefix("# ") for line in file))
    places = {(row["medium"], row["wavelength_nm"]): float(row["n"]) for row in rows}
    assert any(medium == "n-bk7" for medium, _ in places)
    for (medium, wavelength), n in places.items():
        if medium in DISPERSIVE:
            answer = json.loads(fresnel(f"--inside {medium} --wavelength {wavelength} --step 90 --json"))
            assert answer["wavelength"] == float(wavelength)
            assert answer["inside"]["medium"] == medium and answer["inside"]["n"] == pytest.approx(n, abs=1e-9)


def test_a_table_of_a_metal_says_what_it_is(fresnel):
    text = fresnel("--inside gold --wavelength 700 --step 30")
    assert "from n=1 into gold at 700 nm, angles in degrees\ngold: n = 0.131000, k = 4.0624, mu = 1\n" in text
    assert "mirror for all that one can see" in text and "at 700 nm" in text and "Brewster angle:  none" in text
    first, second = text.splitlines()[-4:-2]
    assert first.split()[1] == "0.000" and float(first.split()[4]) == pytest.approx(normal(0.131, 4.0624), abs=1e-6)
    assert second.split()[1] == "none", "absorbed, not totally reflected"


def test_light_from_a_medium_with_loss(fresnel):
    answer = json.loads(fresnel("--inside air --outside 1.5+0.001j --step 45 --json"))
    assert answer["outside"] == {"medium": "n=1.5+0.001j", "n": 1.5, "mu": 1.0, "k": 0.001, "mu_imag": 0.0}
    assert answer["inside"] == {"n": 1.0, "mu": 1.0}
    assert len(answer["limits"]) == 1 and "T = 1 - R" in answer["limits"][0]
    assert all(row["T"] == 1 - row["R"] and 0 <= row["R"] <= 1 for row in answer["rows"])


def test_a_single_negative_medium_reflects_everything(fresnel):
    text = fresnel("--inside epsilon=-2,mu=1 --step 45")
    assert "it reflects everything, at every angle." in text
    assert [line.split()[4] for line in text.splitlines()[-3:]] == 3 * ["1.000000"]


def test_the_spectrum_of_a_file_is_that_of_its_numbers(fresnel, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Au.yml").write_text(GOLD)
    (row,) = rows_of(fresnel("--inside Au.yml --spectrum 548.6:548.6:1 --csv"))
    assert (row["wavelength"], row["n"], row["k"]) == (548.6, 0.43, 2.455)
    assert (row["R"], row["R_s"]) == pytest.approx(2 * (normal(0.43, 2.455),), rel=1e-12)
    # the file has a part of what is seen
    rows = rows_of(fresnel("--inside Au.yml --spectrum --csv"))
    assert [row["wavelength"] for row in rows] == [530, 540, 550, 560, 570, 580]
    whole = rows_of(fresnel("--inside gold --spectrum --csv"))
    assert [row["wavelength"] for row in whole] == list(range(380, 731, 10))
    assert rows == [pytest.approx(row, rel=1e-12) for row in whole if 530 <= row["wavelength"] <= 580]


def test_the_spectrum_of_a_causal_nim_by_hand(fresnel):
    rows = rows_of(fresnel("--inside nim-causal --spectrum 400:700:0.5 --csv"))
    assert [row["wavelength"] for row in rows] == [400 + i / 2 for i in range(601)]
    for row in rows:
        assert row["n"] == pytest.approx(1 - 2.33 * (row["wavelength"] / 550) ** 2, abs=1e-12)
        assert row["k"] == 0 and row["R"] < 1e-25


def test_a_spectrum_at_an_angle_and_from_another_medium(fresnel):
    interface = Interface(Medium.parse("nim-mirror"), Medium.parse("n-sf11"))
    line = "--inside nim-mirror --outside n-sf11 --spectrum 450:650:100 --angle 40"
    answer = json.loads(fresnel(f"{line} --json"))
    assert answer["angle"] == 40 and answer["inside"]["medium"] == "nim-mirror" and answer["limits"] == []
    assert [row["wavelength"] for row in answer["rows"]] == [450, 550, 650]
    for row in answer["rows"]:
        expected = interface.at(row["wavelength"]).fresnel(math.cos(math.radians(40)))
        assert [row[key] for key in ("R_s", "R_p", "R")] == pytest.approx(expected[:3], rel=1e-12)
    lines = fresnel(line).splitlines()
    assert lines[0] == "from n-sf11 into nim-mirror at 40 degrees, wavelengths in nanometres"
    assert np.allclose([float(text.split()[5]) for text in lines[2:]], [row["R"] for row in answer["rows"]], atol=1e-6)
    assert rows_of(fresnel("--inside gold --spectrum 500:500:1 --angle 90 --csv"))[0]["R"] == pytest.approx(
        1, abs=1e-15
    )


def test_a_real_medium_has_a_spectrum_too(fresnel):
    rows = rows_of(fresnel("--inside nim --spectrum --csv"))
    assert len(rows) == 36 and {row["R"] for row in rows} == {float(Interface(MEDIA["nim"]).fresnel(1.0).R)}


@pytest.mark.parametrize("name", DISPERSIVE)
def test_every_named_medium_is_taken_and_listed(name, fresnel, capsys):
    assert f"into {name} at 550 nm" in fresnel(f"--inside {name}")
    assert fresnel(f"--inside air --outside {name} --spectrum").startswith(f"from {name} into n=1 at 0 degrees")
    with pytest.raises(SystemExit):
        command.main(["fresnel", "--help"])
    assert name in capsys.readouterr().out


REFUSED = [
    ("--inside n-bk7 --wavelength 0", "a wavelength of 0 nm is none"),
    ("--inside n-bk7 --wavelength 0.55", "for 0.55 micrometres write 550"),
    ("--inside nim --wavelength 0.55", "for 0.55 micrometres write 550"),
    ("--inside nim --wavelength -550", "a wavelength of -550 nm is none"),
    ("--inside nim --wavelength nan", "a wavelength of nan nm is none"),
    ("--inside nim --wavelength green", "--wavelength 'green' is not a number"),
    ("--inside n-bk7 --wavelength 9000", "n-bk7 is known from 300 to 2500 nm, which does not cover 9000 nm"),
    ("--inside air --outside fishnet --wavelength 800", "fishnet is known from 380 to 730 nm"),
    ("--inside gold --spectrum 100:400:10", "gold is known from 187.9 to 1937 nm"),
    ("--inside gold --spectrum 0.4:0.7:0.01", "for 0.4 micrometres write 400"),
    ("--inside gold --spectrum 700:400:10", "runs backwards; write it like 400:700:10"),
    ("--inside gold --spectrum 400:700:-10", "a step that is no number above 0"),
    ("--inside gold --spectrum 400:700:0", "a step that is no number above 0"),
    ("--inside gold --spectrum 400:700:inf", "a step that is no number above 0"),
    ("--inside gold --spectrum 400:inf:10", "a wavelength of inf nm is none"),
    ("--inside gold --spectrum 400:700", "is not understood; write it like 400:700:10"),
    ("--inside gold --spectrum a:b:c", "is not understood; write it like 400:700:10"),
    ("--inside gold --spectrum 400:700:0.001", f"more than {MOST_ROWS} wavelengths"),
    ("--inside gold --spectrum --wavelength 550", "not allowed with"),
    ("--inside gold --spectrum --step 10", "--step is of the table by angle"),
    ("--inside gold --angle 10", "give it with --spectrum"),
    ("--inside gold --spectrum --angle 91", "between 0 and 90"),
    ("--inside gold --spectrum --angle nan", "between 0 and 90"),
    ("--inside golf", "did you mean gold?"),
    ("--inside 1.5-0.01j", "gain"),
    ("--inside n=1.5,k=-0.01", "gain"),
    ("--inside epsilon=drude(0),mu=1", "must be above 0"),
    ("--inside epsilon=foo(1),mu=1", "is no function of the wavelength"),
    ("--inside nowhere.yml", "there is no file 'nowhere.yml'"),
    ("--inside empty.yml", "empty.yml is no file of refractiveindex.info: it has no DATA"),
    ("--inside nan.yml", "a row that is not 3 finite numbers"),
    ("--inside gain.yml", "gain.yml has k below 0 at 548.6 nm"),
    ("--inside far.yml", "does not cover 550 nm"),
]


@pytest.mark.parametrize(("line", "says"), REFUSED, ids=[line for line, _ in REFUSED])
def test_bad_input_gets_one_sentence_and_exit_code_2(line, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = {"empty": "hello: 1\n", "nan": GOLD.replace("0.43", ".nan"), "gain": GOLD.replace("2.455", "-2.455")}
    files["far"] = GOLD.replace(" 0.5", " 1.5")
    for name, text in files.items():
        (tmp_path / f"{name}.yml").write_text(text)
    assert command.main(["fresnel", *line.split()]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and says in printed.err
    assert printed.err.startswith("nimray: ") and printed.err.count("\n") == 1

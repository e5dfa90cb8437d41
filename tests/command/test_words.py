# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person writes: refused in one sentence where it makes no sense, and read as it is meant."""

import pytest

from nim_addon import command
from nim_addon.base.options import SCENE_NAMES
from nim_addon.command import words
from nim_addon.scenes import SCENES

SMALL = ("--size", "32x24", "--samples", "4")


REFUSED = [
    ("render sphere --photons 100", "--caustics traced"),
    ("render pool --caustics traced", "no light to trace"),
    ("render pool --photons 100", "--caustics traced"),
    ("render pool --set sky=sunny --caustics traced --photons 0", "out of range"),
    ("render", "name a scene"),
    ("render spere", "did you mean sphere?"),
    ("render sphere --set n=0", "n = 0 refracts nothing"),
    ("render sphere --set n=nan", "out of range"),
    ("render sphere --set n=round", "there is no medium 'round'"),
    ("render sphere --set n=12+0.1j", "n = 12.0 is out of range"),
    ("render sphere --set n=nim-causal mu=-2", "mu = -2.0 does not go with nim-causal, which has a mu of its own"),
    ("render sphere --set n=-1.5 mu=1", "a negative index needs mu below 0"),
    ("render sphere --set index=2", "there is no parameter 'index'"),
    ("render sphere --set n", "write key=value"),
    ("render glass --set liquid=watr", "did you mean water?"),
    ("render glass --set view=sid", "did you mean side?"),
    ("render glass --set figures=/nowhere/bunny.ply", "there is no file"),
    ("render pool --set sky=dark", "there is no sky 'dark'"),
    ("render sphere --set n=2 n=3 --size 9x9 --samples 1", "n is set twice; set it once"),
    ("render sphere n=2 --set n=3 --size 9x9 --samples 1", "n is set twice"),
    ("render sphere --set spectral=yes spectral=no --size 9x9 --samples 1", "spectral is set twice"),
    ("compare sphere --vary n=2,3 --set n=4 --size 9x9 --samples 1", "n is set twice"),
    ("render sphere --samples 4 --size 9x9 --samples 8", "--samples is given twice; give it once"),
    ("render sphere --denoise --no-denoise --size 9x9 --samples 1", "--denoise and --no-denoise is given twice"),
    ("sweep sphere --vary n=2,3 --workers 1 --workers 2 --size 9x9 --samples 1", "--workers is given twice"),
    ("render sphere --samples 0", "--samples 0 is out of range"),
    ("render sphere --samples -3", "--samples -3 is out of range"),
    ("render sphere --samples many", "not a whole number"),
    ("render sphere --size 0x10", "out of range"),
    ("render sphere --size 99999x10", "out of range"),
    ("render sphere --size big", "write it like 800x600"),
    ("render sphere --seed x", "not a whole number"),
    ("render sphere --name a/b", "cannot name a file"),
    ("render sphere --size 0%", "--size 0% is out of range; it lies between 1% and 100%"),
    ("render sphere --size 150%", "--size 150% is out of range"),
    ("render sphere --name " + 300 * "a", "300 letters is too long"),
    ("render sphere --wavelengths 550", "a stack of 1 wavelength is none that can be made; give 2 to 512"),
    ("render sphere --wavelengths 400:700:0.0003", "has more than 512 wavelengths; take a larger step"),
    ("render sphere --wavelengths 400:700", "is not understood; write it like 400:700:10"),
    ("render sphere --wavelengths 400:x:10", "is not understood"),
    ("render sphere --wavelengths 700:400:10", "runs backwards; write it like 400:700:10"),
    ("render sphere --wavelengths 400:700:0", "a step that is not above 0"),
    ("render sphere --wavelengths 400:700:nan", "a step that is not above 0"),
    ("render sphere --wavelengths 0,550", "a wavelength of 0 nm is none"),
    ("render sphere --wavelengths 0.4:0.7:0.01", "for 0.4 micrometres write 400"),
    ("render sphere --wavelengths 300:700:50", "wavelength 300 is not visible; it lies between 380 and 730 nanometres"),
    ("render sphere --wavelengths 550,550", "550 is there twice"),
    ("render sphere spectral=yes --wavelengths 400:700:50", "one wavelength at a time"),
    ("render sphere --spectral --wavelengths 400:700:50", "leave --spectral"),
    ("render pool --wavelengths 400:700:50 --frames 1-2", "leave --frames out"),
    ("render sphere --wavelengths 400:700:50 --blend", "leave --blend out"),
    ("render sphere --wavelengths 400:700:50 --pixel 800,0", "not within the picture of 800 x 600"),
    ("render sphere --wavelengths 400:700:50 --pixel 8", "is no part of a picture"),
    ("render sphere --wavelengths 400:700:50 --region 0,0,0,1", "not within the picture"),
    ("render sphere --wavelengths 400:700:50 --pixel 8,8 --denoise", "leave one out"),
    ("render sphere --wavelengths 400:700:50 --pixel 8,8 --samples 1", "take an even number"),
    ("render sphere --wavelengths 380:730:1 --samples 1000000", "are too many"),
    ("render sphere --pixel 8,8", "give them with --wavelengths"),
    ("render sphere --wavelength 0.55", "for 0.55 micrometres write 550"),
    ("render sphere --wavelength 800", "not visible"),
    ("render sphere --wavelength 550 --spectral", "a spectral render has all wavelengths"),
    ("render sphere spectral=perhaps", "neither on nor off"),
    ("render sphere --spectral-passes 4", "spectral passes are of a spectral render"),
    ("render sphere --spectral --spectral-passes 3", "no power of two"),
    ("render sphere --spectral --spectral-passes 8 --samples 100", "or a number of samples such as 104"),
    ("render sphere -x n=1.5", "unrecognized arguments: -x. Try `nimray render --help`"),
    ("compare pool --vary liquid=water,nim --samples 4 view", "arguments: view. Try `nimray compare --help`"),
    ("figures 5.8 --qualty final", "--qualty final. Try `nimray figures --help`"),
    ("rays sphere --angles", "--angles. Try `nimray rays --help`"),
    ("rays sphere n=1.5", "arguments: n=1.5. Try `nimray rays --help`"),
    ("--quiet scenes", "arguments: --quiet. Try `nimray --help`"),
    ("figures a.9", "did you mean A."),
    ("render SPERE", "did you mean sphere?"),
    ("render sphere --size half%", "not a whole number"),
    ("render sphere --quiet --progress", "not allowed with"),
    ("render pool --frames 48-1", "write it like 1-48"),
    ("render pool --frames x", "'x' is not a range"),
    ("render pool --frames 1-2-3", "is not a range"),
    ("render pool --frames 1-", "is not a range"),
    ("render pool --frames 1-1048575", "between 0 and 1048574"),
    ("render pool --frames=-1-3", "frames from 0 on"),
    ("render sphere --frames 1-2", "nothing moves in the sphere"),
    ("render glass --frames 1", "nothing moves in the glass"),
    ("render pool --frames 1-2 --fps 0", "between 0.01 and 1000"),
    ("render pool --frames 1-2 --fps nan", "between 0.01 and 1000"),
    ("render pool --fps 24", "--frames"),
    ("render pool --set time=3600 --frames 1-2", "time = 3600.04"),
    ("render pool --set waves=0.25 --frames 12", "wash over the deck"),
    ("render --again x.exr --frames 1-2", "without --frames"),
    ("compare", "required"),
    ("compare spere", "did you mean sphere?"),
    ("compare glass --vary liquid", "write KEY=A,B,C"),
    ("compare glass --vary liquid=nim", "at least two values"),
    ("compare glass --vary liquid=water,watr", "liquid=watr: there is no medium 'watr'"),
    ("render pool --set liquid=n=-1.33,k=-1e-6", "gives light (gain)"),
    ("render pool --set liquid=n-bk8", "did you mean n-bk7?"),
    ("render glass --set liquid=n=-1.33,length=0", "must be above 0"),
    ("render sea --set liquid=x.yml", "there is no file 'x.yml'"),
    ("rays sphere --n 1.5+0.1j", "'1.5+0.1j' is not a number"),
    ("compare glass --vary liquid=water,n=-1.33,k=-1e-6", "liquid=n=-1.33,k=-1e-6: n = -1.33-1e-06j"),
    ("compare sphere --vary n=1.5,n=1.5,length=-1", "n=n=1.5,length=-1: an absorption length, in metres, = -1"),
    ("compare glass --vary liquid=water,water", "the same value twice"),
    ("compare pool --set mu=-10", "liquid=none: mu = -10 needs a liquid"),
    ("compare sphere --vary n=1.5,1.50", "the same value twice"),
    ("compare glass --vary liquid=nim,n=-1.33", "the same value twice"),
    ("compare sphere --vary n=1,-1.33,mu=3", "n=-1.33 mu=3: mu = 3 does not go with"),
    ("render --again nothing.exr", "there is no file"),
    ("render sphere --again x.exr", "without SCENE"),
    ("fresnel --inside glas", "did you mean glass?"),
    ("fresnel --inside n=-1.33,mu=10", "a negative index needs mu below 0"),
    ("fresnel --inside 0", "n = 0"),
    ("fresnel --inside inf", "not finite"),
    ("fresnel --inside 1e-300", "n = 1e-300 is out of range"),
    ("fresnel --inside n=1e200,mu=1e-200", "n = 1e+200 is out of range"),
    ("rays sphere --n 1e300", "n = 1e+300 is out of range"),
    ("fresnel --inside -inf", "not finite"),
    ("fresnel --inside -1.5x", "'-1.5x' is not a number"),
    ("render sphere --size -3x4", "write it like 800x600"),
    ("rays sphere --n -x", "expected one argument"),
    ("fresnel", "required"),
    ("fresnel --inside 1_5", "'1_5' is not a number"),
    ("render sphere --samples 1_0", "'1_0' is not a whole number"),
    ("render pool --set seed=1_0", "'1_0' is not a whole number"),
    ("render glass --set figures=~nosuchuser/x.ply", "there is no file"),
    (f"render glass --set figures={'a' * 300}.ply", "there is no file"),
    (f"render sphere --set n=1.{'0' * 300}", "give --name"),
    (f"compare sphere --vary n=1.5,1.{'0' * 300}", "give --name"),
    ("render sphere --name a\x1b[31mb", "'a\\x1b[31mb' cannot name a file"),
    ("render sphere --name a\u202eb", "'a\\u202eb' cannot name a file"),
    ("render sphere --name a\x7f", "cannot name a file"),
    ("render sphere --name a.", "cannot name a file"),
    ("render \x1b[31msphere", "no scene '\\x1b[31msphere'"),
    ("verify \x1b[31m", "unrecognized arguments: \\x1b[31m"),
    ("info nothing.exr", "there is no file"),
    ("refract", "invalid choice"),
    ("", "required"),
]


@pytest.mark.parametrize(("line", "says"), REFUSED, ids=[line or "nothing" for line, _ in REFUSED])
def test_bad_input_gets_one_sentence_and_exit_code_2(line, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(line.split()) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert says in printed.err
    assert printed.err.startswith("nimray: ")
    assert printed.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ("a\nb", "a\tb", "a\rb", " ", "a ", " a", ""))
def test_a_name_that_breaks_lines_or_ends_unseen_is_refused(name, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(["render", "sphere", f"--name={name}"]) == 2
    assert (
        capsys.readouterr().err
        == f"nimray: --name {name!r} cannot name a file; use letters, digits, dots and dashes.\n"
    )


@pytest.mark.parametrize("start", ("render sphere", "compare sphere", "figures 5.8", "rays sphere"))
def test_an_empty_place_to_write_to_is_a_usage_error(start, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main([*start.split(), "--out", ""]) == 2
    assert "--out is empty" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_sentence_about_thousands_of_letters_is_short(capsys):
    assert command.main(["fresnel", "--inside", "n=" + "1" * 5000]) == 2
    assert len(capsys.readouterr().err) < 700


@pytest.mark.parametrize("number", ("-1.5", "-1.5e0", "-15e-1", "\N{MINUS SIGN}1.5", "-1.50"))
def test_a_number_below_0_is_no_option(number, capsys, tmp_path):
    assert command.main(["fresnel", "--inside", number, "--outside", "-1."]) == 0
    assert "from n=-1 into n=-1.5" in capsys.readouterr().out
    file = tmp_path / "a.svg"
    assert command.main(["rays", "sphere", "--n", number, "--mu", "-.1e1", "--out", str(file)]) == 0
    assert "n=-1.5" in file.read_text()


def test_commas_part_the_values_that_are_compared_but_for_the_one_before_mu():
    assert words.variants(["liquid=none,n=-1.33,mu=-10,nim", "view=top"], ["liquid"]) == [
        ["liquid=none"],
        ["liquid=n=-1.33,mu=-10"],
        ["liquid=nim"],
        ["view=top"],
    ]
    assert words.variants(["n=1,-1.33,mu=-10"], []) == [["n=1"], ["n=-1.33", "mu=-10"]]


def test_a_medium_that_is_compared_stays_whole():
    lossy, causal = "n=-1.33,length=0.05", "epsilon=drude(360, 0.01),mu=drude(360,0)"
    for liquids in ([], ["n"]):
        assert words.variants([f"n=1.5,{lossy},{causal},n-bk7"], liquids) == [
            ["n=1.5"],
            [f"n={lossy}"],
            [f"n={causal}"],
            ["n=n-bk7"],
        ]


def test_names_are_known_in_any_case_and_a_figure_is_made_once(capsys, monkeypatch, tmp_path):
    from nim_addon.figures import run

    made = []

    def make(figure, *_, **__):
        made.append(figure.number)
        return {"figure": figure.number, "holds": True}

    monkeypatch.setattr(run, "make", make)
    assert command.main(["figures", "5.8", "a.1", "5.8", "A.1", "--json", "--out", str(tmp_path)]) == 0
    assert made == ["5.8", "A.1"]
    assert command.main(["render", "Sphere", *SMALL, "--out", str(tmp_path), "--quiet"]) == 0
    assert (tmp_path / "sphere.exr").is_file()
    assert command.main(["rays", "Slab", "--out", str(tmp_path / "slab.svg")]) == 0


def test_size_may_be_a_part_of_the_scenes_own():
    assert words.size("25%")((720, 480)) == (180, 120)
    assert words.size("64x48")((720, 480)) == (64, 48)


def test_the_scenes_that_are_offered_are_those_that_there_are():
    assert tuple(SCENES) == SCENE_NAMES
    assert f"{', '.join(SCENE_NAMES[:-1])} or {SCENE_NAMES[-1]}" == words.A_SCENE


def test_frames_are_from_0_on_as_in_blender():
    assert (words.frames("0-3"), words.frames("0")) == ((0, 3), (0, 0))

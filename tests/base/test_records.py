# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file says that a stranger made: read as strictly as what is written on the command line."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import __version__ as VERSION
from nim_addon import command
from nim_addon.base import records, text
from nim_addon.cycles.images import RECORD_ATTRIBUTE, read_metadata

RECORD = {
    "nimray": VERSION,
    "scene": "sphere",
    "parameters": {"n": -1.5, "mu": -1.0, "roughness": 0.0, "companions": False, "sun_angle": 16.0},
    "size": [16, 12],
    "samples": 1,
    "seed": 0,
    "denoise": False,
    "backend": "auto",
    "caustics": "path",
    "blender": "4.5.0",
}
ESCAPE = "\x1b]0;owned\x07\x9b31m\u202e\x7f\n"


def image(file, text):
    """A small PNG that carries a text as its record."""
    picture = oiio.ImageBuf(oiio.ImageSpec(4, 3, 3, oiio.UINT8))
    oiio.ImageBufAlgo.fill(picture, (0.5, 0.5, 0.5))
    picture.specmod().attribute(RECORD_ATTRIBUTE, text)
    assert picture.write(str(file))
    return str(file)


def again(file, capsys, *more):
    """What the command says that repeats an image, and its exit code."""
    code = command.main(["render", "--again", file, "--out", str(file) + " new", *more])
    printed = capsys.readouterr()
    assert text.printable(printed.err.replace("\n", "")) == printed.err.replace("\n", "")
    return code, printed


def test_the_record_that_the_crafted_ones_are_made_of_is_one(tmp_path, capsys):
    file = image(tmp_path / "a.png", json.dumps(RECORD))
    code, printed = again(file, capsys, "--quiet")
    assert (code, printed.out, printed.err) == (0, "", "")
    assert read_metadata(tmp_path / "a.png new" / "a_again.exr")["parameters"] == RECORD["parameters"]


HUGE = 10**400
WRONG = {
    "nimray": [None, 5, "", "new", [], "0.1\n", "1.0 " + ESCAPE],
    "scene": [None, 5, "", "spere", [], {}, ESCAPE, "x" * 5000],
    "parameters": [
        *(None, 5, "n=1.5", [], [["n", 1.5]], {"nn": 1}, {"__class__": 1}, {ESCAPE: 1}),
        *(
            {"n": value}
            for value in (float("nan"), float("inf"), None, "x", [], {}, HUGE, -HUGE, 0, True, "1_5", ESCAPE, 11, "nan")
        ),
        *({"companions": value} for value in (None, 2, "maybe", [], HUGE)),
        *({"sun_angle": value} for value in (0, -1, HUGE, [1])),
    ],
    "size": [
        None,
        5,
        "64x48",
        [],
        [64],
        [64, 48, 1],
        [0, 48],
        [64, -1],
        [64, 1.5],
        [True, 1],
        [10**6, 10**6],
        [HUGE, 1],
        {},
    ],
    "samples": [None, 0, -1, 1.5, "4", True, HUGE, [], 2**21],
    "seed": [None, -1, 1.5, "4", False, HUGE, 2**31],
    "denoise": [None, 0, 1, "yes", []],
    "backend": [None, 5, "", "gpu", ["osl"], {}],
    "caustics": [None, 5, "", "maybe", ["path"]],
    "photons": [None, 0, -1, 1.5, HUGE, 2**41],
    "blender": [None, 5, [], {}],
    "shader": ["x", None, {ESCAPE: ESCAPE}],
}
CASES = [(key, value) for key, values in WRONG.items() for value in values]


@pytest.mark.parametrize(("key", "value"), CASES, ids=[f"{key}-{str(value)[:20]!r}" for key, value in CASES])
def test_a_record_that_no_render_has_is_refused_in_a_sentence(key, value, tmp_path, capsys):
    file = image(tmp_path / "a.png", json.dumps({**RECORD, key: value}))
    code, printed = again(file, capsys)
    assert (code, printed.out, printed.err.count("\n")) == (2, "", 1)
    assert printed.err.startswith("nimray: ") and len(printed.err) < 800
    assert not any(word in printed.err for word in ("Error", "argument", "__init__", "expected"))
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize("key", sorted(set(RECORD) - {"backend", "caustics"}))
def test_a_record_that_lacks_something_is_refused(key, tmp_path, capsys):
    file = image(tmp_path / "a.png", json.dumps({name: value for name, value in RECORD.items() if name != key}))
    code, printed = again(file, capsys)
    assert code == 2 and printed.err.count("\n") == 1 and key in printed.err


@pytest.mark.parametrize("version", ("99", "0.1.1", "1.0.0", f"{VERSION}.1"))
def test_a_record_of_a_later_version_is_not_repeated(version, tmp_path, capsys):
    file = image(tmp_path / "a.png", json.dumps({**RECORD, "nimray": version}))
    code, printed = again(file, capsys)
    assert code == 2 and f"was made by nimray {version}, and this is {VERSION}" in printed.err


TEXTS = {
    "no JSON": "{",
    "a list": "[1]",
    "deep": "[" * 100000,
    "deep and whole": '{"a": ' + "[" * 900 + "]" * 900 + "}",
    "deep in a dict": '{"a": ' * 20 + "1" + "}" * 20,
    "long": '{"a": ' + "9" * 5000 + "}",
}


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("words", (["info"], ["info", "--json"], ["render", "--again"]))
def test_what_is_no_record_is_none_of_ours(name, words, tmp_path, capsys):
    file = image(tmp_path / "a.png", TEXTS[name])
    assert command.main([*words, file]) == 2
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n")) == ("", 1)
    assert "was not made by nimray" in printed.err


STRANGE = {
    **RECORD,
    "scene": ESCAPE,
    ESCAPE: ESCAPE,
    "parameters": {ESCAPE: {"a": [ESCAPE]}, "n": None},
    "size": [ESCAPE, None, 10**300],
    "more": [[[1]], {}, True, -0.0, 1e300],
}


def test_info_shows_any_record_without_harm_to_the_terminal(tmp_path, capsys):
    file = image(tmp_path / "a.png", json.dumps(STRANGE))
    assert command.main(["info", file]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(STRANGE) and all(line.isprintable() for line in lines)
    assert any(line.startswith("scene        \\x1b]0;owned\\x07\\x9b31m\\u202e\\x7f\\n") for line in lines)
    assert command.main(["info", file, "--json"]) == 0
    printed = capsys.readouterr().out
    assert all(line.isprintable() and line.isascii() for line in printed.splitlines())
    assert json.loads(printed) == STRANGE


@pytest.mark.parametrize("images", (None, 5, [], [5, ESCAPE], {"a": 1}))
def test_a_comparison_is_not_repeated_whatever_it_holds(images, tmp_path, capsys):
    file = image(tmp_path / "a.png", json.dumps({"nimray": VERSION, "compares": [], "images": images}))
    code, printed = again(file, capsys)
    assert code == 2 and "is a comparison" in printed.err and printed.err.count("\n") == 1


def test_numbers_that_only_python_writes_are_null_where_programs_read(tmp_path, capsys):
    file = image(tmp_path / "a.png", '{"a": NaN, "b": [-Infinity, 1e400, 1.5], "c": {"d": NaN}}')
    assert command.main(["info", file, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"a": None, "b": [None, None, 1.5], "c": {"d": None}}
    assert np.isnan(records.parse('{"a": NaN}')["a"])

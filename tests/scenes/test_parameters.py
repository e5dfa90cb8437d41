# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters: what is read from words, what is refused and how, and the way back to plain values."""

import json
import math
import subprocess
import sys
from dataclasses import FrozenInstanceError, dataclass
from pathlib import Path

import numpy as np
import pytest

from nim_addon.physics import Medium
from nim_addon.scenes import SCENES, scene_type
from nim_addon.scenes.parameters import Parameters, choice, file_name, integer, liquid, mesh_file, number, switch
from nim_addon.scenes.sphere import SphereParameters


@dataclass(frozen=True)
class Every(Parameters):
    """One parameter of each kind."""

    depth: float = number(1.5, "depth", 0.5, 3.0, "m")
    tilt: float = number(None, "tilt, chosen from the depth if left out", -90, 90)
    stones: int = integer(3, "stones", 0, 10)
    sunny: bool = switch(True, "sunny")
    view: str = choice("side", "view", ("side", "top", "below"))
    filling: Medium = liquid(None, "filling")
    figure: str = mesh_file("bunny", "figure", ("bunny", "none"))


def test_defaults():
    assert Every().plain() == {
        "depth": 1.5,
        "tilt": None,
        "stones": 3,
        "sunny": True,
        "view": "side",
        "filling": None,
        "figure": "bunny",
    }


@pytest.mark.parametrize(
    "text, key, value",
    [
        ("depth=2", "depth", 2.0),
        (" depth = 0.5 ", "depth", 0.5),
        ("depth=3.0", "depth", 3.0),
        ("tilt=-90", "tilt", -90.0),
        ("tilt=\N{MINUS SIGN}45", "tilt", -45.0),
        ("tilt=auto", "tilt", None),
        ("tilt=none", "tilt", None),
        ("stones=0", "stones", 0),
        ("sunny=off", "sunny", False),
        ("sunny=No", "sunny", False),
        ("sunny=1", "sunny", True),
        ("view=below", "view", "below"),
        ("view=Top", "view", "top"),
        ("filling=water", "filling", Medium(1.33)),
        ("filling=n=-1.33,mu=-10", "filling", Medium(-1.33, -10)),
        ("filling=empty", "filling", None),
        ("filling=None", "filling", None),
        ("figure=none", "figure", "none"),
    ],
)
def test_read(text, key, value):
    got = getattr(Every.read([text]), key)
    assert got == value and type(got) is type(value)


def test_a_true_minus_sign_makes_the_same_files():
    assert file_name("sphere", ["n=\N{MINUS SIGN}1.5"]) == file_name("sphere", ["n=-1.5"]) == "sphere_n--1.5"


def test_the_last_of_two_settings_counts():
    assert Every.read(["depth=1", "stones=7", "depth=2"]) == Every(depth=2, stones=7)


@pytest.mark.parametrize(
    "text, words",
    [
        ("depth", ("'depth'", "key=value")),
        ("deep=1", ("'deep'", "did you mean depth", "stones", "figure")),
        ("zzz=1", ("'zzz'", "depth", "view")),
        ("depth=much", ("depth = 'much'", "number")),
        ("depth=", ("depth = ''", "number")),
        ("depth=3.1", ("depth = 3.1", "between 0.5 and 3 m")),
        ("depth=nan", ("depth = nan", "between 0.5 and 3 m")),
        ("tilt=inf", ("tilt = inf", "between -90 and 90")),
        ("depth=auto", ("depth = 'auto'", "number")),
        ("stones=2.5", ("stones = '2.5'", "whole number")),
        ("stones=11", ("stones = 11", "between 0 and 10")),
        ("sunny=perhaps", ("sunny = 'perhaps'", "on", "off")),
        ("VIEW=top", ("'VIEW'", "did you mean view")),
        ("view=TPO", ("'TPO'", "did you mean top")),
        ("view=tpo", ("'tpo'", "did you mean top", "side, top, below")),
        ("filling=watr", ("'watr'", "did you mean water")),
        ("filling=0", ("n = 0",)),
        ("filling=n-bk7", ("n-bk7 disperses and absorbs", "give n=1.51852, which it has at 550 nm")),
        ("filling=n=-1.33,k=1e-6", ("n=-1.33+1e-06j absorbs", "give n=-1.33")),
        ("filling=epsilon=-2,mu=1", ("carries no wave", "mirror")),
        ("depth=1.5+0.1j", ("depth = '1.5+0.1j'", "number")),
        ("figure=rabbit", ("'rabbit'", "bunny, none", "PLY, OBJ or STL")),
        ("figure=/nowhere/rabbit.ply", ("no file", "/nowhere/rabbit.ply", "bunny, none")),
    ],
)
def test_read_refuses(text, words, one_sentence):
    with pytest.raises(ValueError) as caught:
        Every.read([text])
    one_sentence(caught.value, *words)


@pytest.mark.parametrize("medium", [Medium.parse("nim-causal"), Medium(-1.33 + 1e-6j)])
def test_a_scene_holds_no_medium_that_disperses_or_absorbs(medium, one_sentence):
    for make in (lambda: Every(filling=medium), lambda: Every.of({"filling": str(medium)})):
        with pytest.raises(ValueError) as caught:
            make()
        one_sentence(caught.value, "renders take a real index so far", "give n=-1.33")


@pytest.mark.parametrize("values", [{"n": 1.5 + 0.1j}, {"n": np.complex64(1.5 + 0.1j)}, {"mu": np.array(-1 + 0.1j)}])
def test_a_sphere_has_no_complex_numbers(values, one_sentence):
    with pytest.raises(ValueError) as caught:
        SphereParameters(**values)
    one_sentence(caught.value, "is not a number")


def test_a_value_that_is_missing_is_refused(one_sentence):
    with pytest.raises(ValueError) as caught:
        Every(depth=None)
    one_sentence(caught.value, "depth", "value")


def test_a_mesh_file_becomes_a_full_path(tmp_path, monkeypatch):
    file = tmp_path / "rabbit.PLY"
    file.write_text("ply\n")
    monkeypatch.chdir(tmp_path)
    assert Every(figure="rabbit.PLY").figure == str(file.resolve())


@pytest.mark.parametrize(
    "parameters",
    [
        Every(),
        Every(2, 45, 10, False, "below", Medium(-4 / 3, -10), "none"),
        Every(filling="diamond"),
        Every(depth=1 / 3 + 1, filling=Medium(math.pi)),
        SphereParameters(),
        SphereParameters(n=1.33, companions=True),
        SphereParameters(n=-1.33, mu=-25),
    ],
)
def test_plain_values_go_through_json_and_back(parameters):
    plain = json.loads(json.dumps(parameters.plain()))
    assert type(parameters)(**plain) == parameters
    # and through the command line's words
    words = [f"{key}={value}" for key, value in plain.items()]
    assert type(parameters).read(words) == parameters


def test_parameters_are_a_value():
    with pytest.raises(FrozenInstanceError):
        Every().depth = 2


def test_sphere_chooses_mu_and_refuses_a_wrong_one(one_sentence):
    assert SphereParameters(n=1.5).mu == 1
    assert SphereParameters(n="-2.418").mu == -1
    assert SphereParameters.read(["n=-1.33", "mu=-25"]).medium == Medium(-1.33, -25)
    with pytest.raises(ValueError) as caught:
        SphereParameters(n=-1.5, mu=1)
    one_sentence(caught.value, "mu = 1", "below 0")
    with pytest.raises(ValueError) as caught:
        SphereParameters(n=0)
    one_sentence(caught.value, "n = 0")
    with pytest.raises(ValueError) as caught:
        SphereParameters(n=11)
    one_sentence(caught.value, "n = 11", "between -10 and 10")


def test_every_scene_describes_its_parameters():
    for name, scene in SCENES.items():
        assert scene.name == name and scene.shows and callable(scene.build)
        defaults = scene.parameters()  # within their own ranges, or this raises
        for field in scene.parameters.__dataclass_fields__.values():
            assert field.metadata["description"], f"{name}: {field.name} has no description"
        words = [f"{key}={value}" for key, value in defaults.plain().items()]
        assert scene.parameters.read(words) == defaults, f"{name}: its defaults do not read back from words"


def test_unknown_scene(one_sentence):
    assert scene_type("sphere") is SCENES["sphere"]
    with pytest.raises(ValueError) as caught:
        scene_type("shpere")
    one_sentence(caught.value, "'shpere'", "did you mean sphere")


def test_scenes_can_be_the_first_thing_imported():
    # the wheel's other modules, bmesh among them, exist only once bpy has been imported
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", "import nim_addon.scenes"], cwd=root)
    assert done.returncode == 0


def test_a_sentence_names_only_media_that_a_render_takes(one_sentence):
    with pytest.raises(ValueError) as error:
        Every.read(["filling=golf"])
    assert "gold" not in one_sentence(error.value, "there is no medium 'golf'", "nim-mu25") and ".yml" not in str(
        error.value
    )

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
from nim_addon.scenes.parameters import (
    Parameters,
    choice,
    file_name,
    index,
    integer,
    liquid,
    mesh_file,
    number,
    switch,
    written,
)
from nim_addon.scenes.pool import PoolParameters
from nim_addon.scenes.sphere import SphereParameters


@dataclass(frozen=True)
class Every(Parameters):
    """One parameter of each kind."""

    depth: float = number(1.5, "depth", 0.5, 3.0, "m")
    tilt: float = number(None, "tilt, chosen from the depth if left out", -90, 90)
    stones: int = integer(3, "stones", 0, 10)
    sunny: bool = switch(True, "sunny")
    view: str = choice("side", "view", dict.fromkeys(("side", "top", "below"), ""))
    filling: Medium = liquid(None, "filling")
    figure: str = mesh_file("bunny", "figure", {"bunny": "", "none": ""})
    n: float | Medium = index(1.5, "index", -10, 10)


def test_defaults():
    assert Every().plain() == {
        "depth": 1.5,
        "tilt": None,
        "stones": 3,
        "sunny": True,
        "view": "side",
        "filling": None,
        "figure": "bunny",
        "n": 1.5,
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
        ("filling=n-bk7", "filling", Medium.parse("n-bk7")),
        ("filling=n=-1.33,length=0.05,mu=-2", "filling", Medium.parse("n=-1.33,length=0.05,mu=-2")),
        ("figure=none", "figure", "none"),
        ("n=-1.33", "n", -1.33),
        ("n=gold", "n", Medium.parse("gold")),
        ("n=n=-1.33,k=1e-6", "n", Medium(-1.33 + 1e-6j)),
    ],
)
def test_read(text, key, value):
    got = getattr(Every.read([text]), key)
    assert got == value and type(got) is type(value)


def test_a_true_minus_sign_makes_the_same_files():
    assert file_name("sphere", ["n=\N{MINUS SIGN}1.5"]) == file_name("sphere", ["n=-1.5"]) == "sphere_n--1.5"


def test_a_setting_is_given_once():
    with pytest.raises(ValueError, match="depth is set twice; set it once"):
        Every.read(["depth=1", "stones=7", "depth = 2"])


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
        ("filling=n=-1.33,k=-1e-6", ("gain", "loss is above 0")),
        ("filling=golf", ("there is no medium 'golf'", "did you mean gold", ".yml")),
        ("filling=/nowhere/glass.yml", ("there is no file '/nowhere/glass.yml'",)),
        (f"filling={'a' * 300}.yml", ("File name too long",)),
        ("n=10.5+0.1j", ("n = 10.5", "between -10 and 10")),
        ("n=diamnd", ("did you mean diamond",)),
        ("depth=1.5+0.1j", ("depth = '1.5+0.1j'", "number")),
        ("figure=rabbit", ("'rabbit'", "bunny, none", "PLY, OBJ or STL")),
        ("figure=/nowhere/rabbit.ply", ("no file", "/nowhere/rabbit.ply", "bunny, none")),
    ],
)
def test_read_refuses(text, words, one_sentence):
    with pytest.raises(ValueError) as caught:
        Every.read([text])
    one_sentence(caught.value, *words)


@pytest.mark.parametrize("value", [1.5 + 0.1j, np.complex64(1.5 + 0.1j), "1.5+0.1j", Medium(1.5 + 0.1j)])
def test_a_sphere_keeps_its_loss(value):
    parameters = SphereParameters(n=value)
    assert (parameters.medium.n, parameters.medium.k) == pytest.approx((1.5, 0.1)) and parameters.mu is None
    assert SphereParameters(**json.loads(json.dumps(parameters.plain()))) == parameters


def test_a_sphere_of_a_named_real_medium_is_that_of_its_numbers():
    assert SphereParameters(n="nim-mu10").plain() == SphereParameters(n=-1.33, mu=-10).plain()
    assert SphereParameters(n="diamond") == SphereParameters(n=2.418)
    assert isinstance(SphereParameters(n="diamond").n, float)


@pytest.mark.parametrize("kind, key", [(SphereParameters, "n"), (PoolParameters, "liquid")])
def test_a_mu_of_ones_own_leaves_loss_and_dispersion_as_they_are(kind, key, one_sentence):
    for text in ("-1.33+0.01j", "n=-1.33,length=0.05", "nim-mirror"):
        parameters = kind(**{key: text, "mu": -10})
        medium, before = getattr(parameters, "medium", None) or parameters.liquid, Medium.parse(text)
        for wavelength in (450, 650):
            there, then = medium.at(wavelength), before.at(wavelength)
            assert (there.n, there.k, there.mu) == pytest.approx((then.n, then.k, -10), rel=1e-12)
        assert kind(**json.loads(json.dumps(parameters.plain()))) == parameters
        assert kind.read(parameters.assignments()) == parameters
    with pytest.raises(ValueError) as caught:
        kind(**{key: "epsilon=drude(360),mu=drude(360)", "mu": -2})
    one_sentence(caught.value, "mu = -2.0 does not go with", "mu of its own")


@pytest.mark.parametrize("value", ["1.5+0.1j", np.array(-1 + 0.1j)])
def test_a_permeability_of_a_scene_is_a_real_number(value, one_sentence):
    with pytest.raises(ValueError) as caught:
        SphereParameters(mu=value)
    one_sentence(caught.value, "is not a number")


DATA = """DATA:
  - type: tabulated nk
    data: |
        0.4 1.6 0.1
        0.8 1.5 0.2
"""


def test_a_medium_of_a_file_is_called_by_its_full_path(tmp_path, monkeypatch):
    file = tmp_path / "mine.yml"
    file.write_text(DATA)
    monkeypatch.chdir(tmp_path)
    for value in ("mine.yml", Medium.parse("mine.yml")):
        parameters = Every(filling=value, n=value)
        assert parameters.plain()["filling"] == parameters.plain()["n"] == str(file.resolve())
        assert parameters.files() == {"filling": file.resolve(), "n": file.resolve()}
        assert Every.read(parameters.assignments()) == parameters
    assert Every(filling="n-bk7").files() == {}
    assert file_name("glass", [f"liquid={file}"]) == "glass_liquid-mine"


def test_media_that_disperse_are_written_by_their_names():
    for name in ("n-bk7", "nim-causal", "fishnet"):
        assert written(Medium.parse(name)) == name
        assert Every(filling=name, n=name).assignments() == [f"filling={name}", f"n={name}"]


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
        Every(filling="silver", n="nim-normal"),
        Every(filling=Medium(-1.33 + 1e-7j), n=Medium.parse("epsilon=drude(360 0.01),mu=split-ring(0.5 600 0.1)")),
        Every(depth=1 / 3 + 1, filling=Medium(math.pi)),
        SphereParameters(),
        SphereParameters(n=1.33, companions=True),
        SphereParameters(n=-1.33, mu=-25),
        SphereParameters(n="n=-1.33,length=0.05"),
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""The diagram of a graded ball: its claims can fail, paths are drawn where rays are, and what cannot be drawn is refused."""

import math

import numpy as np
import pytest

from nim_addon import command
from nim_addon.figures import ball_diagram
from nim_addon.physics import graded
from nim_addon.physics.graded import DEVICES, Profile


def test_every_claim_holds():
    claims = ball_diagram.claims()
    assert len(claims) == 7 and all(claim.holds for claim in claims), [claim.row() for claim in claims]


def test_claims_fail_where_rays_are_not_bent_enough(monkeypatch):
    right = graded.trace
    monkeypatch.setattr(graded, "trace", lambda profile, p: right(profile, p) * (1, 1.001))
    # what is nearest to the centre is so still
    assert [claim.text.partition(":")[0] for claim in ball_diagram.claims() if claim.holds] == ["cloak"]


@pytest.mark.parametrize("device", DEVICES)
def test_ways_are_without_a_gap(device):
    for way in ball_diagram.ways(Profile(device), 4):
        np.testing.assert_allclose(way.before[1], way.within[0], atol=1e-12)
        np.testing.assert_allclose(way.after[0], way.within[-1], atol=1e-4)
        assert (np.hypot(*way.within.T) <= 1 + 1e-12).all()
        assert np.hypot(*np.diff(way.within, axis=0).T).max() < 0.2


def test_a_black_core_ends_rays():
    ways = ball_diagram.ways(Profile("cloak", core=0.7, surface="black"), 9)
    ends = [way.after is None for way in ways]
    assert ends == [abs(way.before[0, 1]) < 0.25 for way in ways] and any(ends) and not all(ends)


@pytest.mark.parametrize(
    "profile, title",
    [
        (Profile("turn", angle=math.pi / 3), "A ball that turns all light by 60°"),
        (Profile("invisible", cap=3.0), "An invisible ball, its index no more than 3"),
        (Profile("cloak", core=0.7), "A cloak, with a core of 0.7"),
        (Profile(lambda r: 1.5 - r / 2), "A graded ball"),
    ],
)
def test_titles_say_what_is_drawn(profile, title):
    assert ball_diagram.title_of(profile) == title


def test_the_command_draws_a_ball(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    file = tmp_path / "eaton.svg"
    assert command.main(["rays", "ball", "--device", "Eaton", "--cap", "3", "--out", str(file)]) == 0
    assert "Eaton" in file.read_text() and str(file) in capsys.readouterr().out


@pytest.mark.parametrize(
    "line, words",
    [
        ("rays ball --device eton", ("did you mean eaton",)),
        ("rays ball --device eaton --core 1.5", ("core = 1.5", "below 1")),
        ("rays ball --n 1.5", ("no medium of one index", "--device")),
        ("rays sphere --device eaton", ("rays ball",)),
        ("rays bal", ("there is no ray diagram 'bal'", "ball")),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(line, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(line.split()) == 2
    message = capsys.readouterr().err
    assert all(word in message for word in words) and not list(tmp_path.iterdir()), message

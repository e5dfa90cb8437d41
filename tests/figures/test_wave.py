# SPDX-License-Identifier: GPL-3.0-or-later
"""The beam as a wave: every claim holds, and fails of another index; the arrows are those of the field."""

import numpy as np
import pytest

from nim_addon.figures import wave
from nim_addon.physics import Interface, Medium
from nim_addon.physics.wave_field import Beam


def test_every_claim_holds_and_none_of_another_medium(failing, monkeypatch):
    assert len(wave.claims()) == 8 and not failing(wave.claims())
    right = wave.passed("nim")
    monkeypatch.setattr(wave, "passed", lambda name: right)
    assert len(failing(wave.claims())) == 2  # the sign of the angle, and of the fronts
    other = Beam(Interface(Medium(-1.5)), wave.ANGLE, wave.WAIST).at(wave.ALONG, -wave.DEPTH)
    monkeypatch.setattr(wave, "passed", lambda name: other)
    assert sum("NIM" in row for row in failing(wave.claims())) == 3  # all but that fronts run backwards


def test_arrows_of_energy_leave_the_surface_and_those_of_phase_come_to_it():
    for name, sign in (("water", 1), ("nim", -1)):
        before, after = wave.ways(name)
        np.testing.assert_allclose(before[1], before[2], atol=0.05)
        np.testing.assert_allclose(after[1], sign * after[2], atol=1e-3)
        assert after[1][1] < 0


def test_it_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    files = wave.draw(tmp_path)
    assert [file.name for file in files] == ["figure-E.8.svg", "figure-E.8.png"]
    assert all(file.stat().st_size > 20_000 for file in files)

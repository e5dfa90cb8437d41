# SPDX-License-Identifier: GPL-3.0-or-later
"""The goniometer: this Blender obeys the equations, and a closure that does not is caught."""

import json

import bpy
import numpy as np
import pytest

from nim_addon.cycles import verify
from nim_addon.cycles.closures import INTERFACE, script


@pytest.fixture(scope="module", params=["osl", "nodes"])
def checks(request):
    return verify.verify(backend=request.param)


def test_this_blender_passes(checks):
    failed = [check.row() for check in checks if not check.passed]
    assert not failed, "\n".join(failed)


def test_covers_what_it_promises(checks):
    measured = [check for check in checks if check.what == "R"]
    pairs = {frozenset([check.incident, check.transmitted]) | {check.angle} for check in measured}
    assert len(pairs) >= 60
    assert {check.signs for check in measured} == {"++", "+-", "-+", "--"}
    assert {check.side for check in measured} == {"inside", "outside"}
    assert {"mu=-10", "mu=-25"} <= {word for check in measured for word in check.incident.split(",")}
    assert any(check.equation == 1 for check in measured), "no total reflection"
    assert max(check.angle for check in measured) >= 89
    assert verify.ACROSS * verify.ALONG * verify.SAMPLES >= 20_000
    assert sum(check.what == "landing" for check in checks) >= 60


def test_standard_errors_are_not_too_wide_to_tell(checks):
    # a sampler that spreads its paths evenly does better than tossing coins; wider would hide an error
    for check in checks:
        if check.what == "R":
            coins = np.sqrt(check.equation * (1 - check.equation) / (512 * verify.SAMPLES))
            assert check.error <= 1.2 * coins + 1e-4, check.row()


def test_leaves_nothing_behind(checks):
    kinds = ("scenes", "objects", "meshes", "materials", "worlds", "cameras", "images")
    made = ("NIM goniometer", "NIM strip", "NIM beam", "NIM floor", "NIM chain", "NIM furnace", "beam")
    assert not [data.name for kind in kinds for data in getattr(bpy.data, kind) if data.name.startswith(made)]


def test_summary_is_json(checks):
    summary = json.loads(json.dumps(verify.summary(checks, "osl")))
    assert summary["passed"] is True
    assert len(summary["checks"]) == len(checks)


@pytest.mark.parametrize(
    ("right", "wrong", "caught"),
    [
        # the tangential part of the bend with the sign of a positive index
        ("(q * cos_i - cos_t) * n - q * I", "(abs(q) * cos_i - cos_t) * n - abs(q) * I", "landing"),
        # impedance without permeability
        ("float Z_t = fabs((from_inside ? mu_outside : mu_inside) / n_t)", "float Z_t = fabs(1.0 / n_t)", "R"),
        # the two sides of the face exchanged
        ("int from_inside = backfacing()", "int from_inside = !backfacing()", "R"),
        # one per cent of the reflected light too much
        ("float R = 0.5 *", "float R = 0.505 *", "R"),
    ],
)
def test_a_wrong_closure_fails(monkeypatch, right, wrong, caught):
    source = INTERFACE.source()
    assert right in source
    monkeypatch.setattr(script, "source", lambda shader: source.replace(right, wrong))
    checks = verify.measure_angle(60.0, "osl")
    assert caught in {check.what for check in checks if not check.passed}

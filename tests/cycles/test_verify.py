# SPDX-License-Identifier: GPL-3.0-or-later
"""The goniometer: this Blender obeys the equations, and a closure that does not is caught."""

import json

import bpy
import numpy as np
import pytest

from nim_addon.cycles import verify, verify_closures, wavelength
from nim_addon.cycles.closures import GRADED_BALL, GRADED_CORE, INTERFACE, script
from nim_addon.physics.graded import DEVICES


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
    # six media with loss, each from either side at three angles, in which nothing goes on
    assert sum(check.what == "T" for check in checks) == 36
    assert len({check.transmitted for check in checks if check.what == "T"}) == 6
    assert {check.angle for check in checks if check.what == "slab"} == set(verify.SLAB_ANGLES)
    # every device of a graded ball, windows of both signs, slabs
    assert {check.transmitted for check in checks if check.what == "line"} == set(DEVICES)
    others = {check.transmitted for check in checks if check.what == "landing"}
    assert {"lenslets -1", "lenslets 0.8", "uniaxial 1.5, -3", "shell of magnifier"} <= others
    # two wavelengths land apart
    apart = {check.transmitted: check.equation for check in checks if check.transmitted.endswith(" nm")}
    assert abs(apart["n-bk7 450 nm"] - apart["n-bk7 650 nm"]) > 3 * verify.LANDING_TOLERANCE
    assert abs(apart["nim-normal 450 nm"] - apart["nim-normal 650 nm"]) > 10 * verify.LANDING_TOLERANCE


def test_standard_errors_are_not_too_wide_to_tell(checks):
    # a sampler that spreads its paths evenly does better than tossing coins; wider would hide an error
    for check in checks:
        if check.what == "R":
            coins = np.sqrt(check.equation * (1 - check.equation) / (512 * verify.SAMPLES))
            assert check.error <= 1.2 * coins + 1e-4, check.row()


def test_leaves_nothing_behind(checks):
    kinds = ("scenes", "objects", "meshes", "materials", "worlds", "cameras", "images")
    made = (
        "NIM goniometer",
        "NIM strip",
        "NIM beam",
        "NIM floor",
        "NIM chain",
        "NIM furnace",
        "NIM ball",
        "NIM wall",
        "Sweep of",
        "beam",
    )
    assert not [data.name for kind in kinds for data in getattr(bpy.data, kind) if data.name.startswith(made)]


def test_summary_is_json(checks):
    summary = json.loads(json.dumps(verify.summary(checks, "osl")))
    assert summary["passed"] is True
    assert len(summary["checks"]) == len(checks)


@pytest.mark.parametrize(
    ("right", "wrong", "caught"),
    [
        # the tangential part of the bend with the sign of a positive index
        ("(q * cos_i - cos_t) * m - q * I", "(abs(q) * cos_i - cos_t) * m - abs(q) * I", "landing"),
        # impedance without permeability
        ("float Z_t = fabs((from_inside ? mu_outside : mu_inside) / n_t)", "float Z_t = fabs(1.0 / n_t)", "R"),
        # the two sides of the face exchanged
        ("int from_inside = backfacing()", "int from_inside = !backfacing()", "R"),
        # one per cent of the reflected light too much
        ("R = 0.5 * (r_s", "R = 0.505 * (r_s", "R"),
    ],
)
def test_a_wrong_closure_fails(monkeypatch, right, wrong, caught):
    source = INTERFACE.source()
    assert right in source
    monkeypatch.setattr(script, "source", lambda shader: source.replace(right, wrong))
    checks = verify.measure_angle(60.0, "osl")
    assert caught in {check.what for check in checks if not check.passed}


@pytest.mark.parametrize(
    ("right", "wrong", "measure", "caught"),
    [
        ("exp(-per_metre * way)", "exp(-0.99 * per_metre * way)", verify.measure_slabs, "slab"),
        ("min(0.5 * (R_s + R_p), 1.0)", "min(0.501 * (R_s + R_p), 1.0)", verify.measure_losses, "R"),
        # k of the two sides exchanged
        ("cx c_inside = cx(n_inside, k_inside)", "cx c_inside = cx(n_inside, k_outside)", verify.measure_losses, "R"),
        # what a metal does not reflect goes on
        ("(from_inside ? k_outside : k_inside) <= OPAQUE", "1", verify.measure_losses, "T"),
    ],
)
def test_a_closure_with_wrong_losses_fails(right, wrong, measure, caught, monkeypatch):
    source = INTERFACE.source()
    assert right in source
    monkeypatch.setattr(script, "source", lambda shader: source.replace(right, wrong))
    assert caught in {check.what for check in measure(40.0, "osl") if not check.passed}


@pytest.mark.parametrize(
    ("closure", "right", "wrong", "measure", "argument", "caught"),
    [
        # a sweep in the wrong sense
        (GRADED_BALL, "turned[0] * e1 + turned[1] * e2", "turned[0] * e1 - turned[1] * e2", "ball", "turn", "line"),
        # one path in a hundred lost
        (GRADED_BALL, "BSDF = ray_portal", "BSDF = 0.99 * ray_portal", "ball", "luneburg", "furnace"),
        # beside the core by what it would be for a positive index
        (GRADED_CORE, "x = turned[0] * e1 + turned[1]", "x = turned[0] * e1 - turned[1]", "core", None, "landing"),
    ],
)
def test_another_wrong_closure_fails(closure, right, wrong, measure, argument, caught, monkeypatch):
    source = closure.source()
    assert right in source
    changed = {closure.shader: source.replace(right, wrong)}
    texts = script.source
    monkeypatch.setattr(script, "source", lambda shader: changed.get(shader) or texts(shader))
    checks = getattr(verify_closures, f"measure_{measure}")(argument, "osl")
    assert caught in {check.what for check in checks if not check.passed}


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_a_file_that_shows_another_wavelength_does_so_afterwards(backend, empty_file):
    held = wavelength.group(backend)
    wavelength.set_neutral(500.0)
    assert all(check.passed for check in verify.measure_wavelength(650.0, backend))
    assert wavelength.neutral() == 500.0 and held in bpy.data.node_groups.values()


def test_a_medium_that_stays_at_its_representative_index_fails(monkeypatch):
    monkeypatch.setattr(wavelength, "set_neutral", lambda wavelength_nm: None)
    assert not all(check.passed for check in verify.measure_wavelength(650.0, "nodes"))

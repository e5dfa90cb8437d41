# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of this Blender: what it shows, and that nothing is left of it where it is stopped."""

import tempfile
import time

import bpy
import pytest

from nim_addon.ui import blender_check, preferences


class Layout:
    """Stands for a bpy.types.UILayout: remembers the texts and operators that were drawn."""

    def __init__(self):
        self.drawn = []

    def label(self, text="", **_):
        self.drawn.append(text)

    def operator(self, name, **_):
        self.drawn.append(name)

    def prop(self, data, name, **_):
        self.drawn.append(name)

    def prop_enum(self, data, name, value):
        self.drawn.append(value)

    def column(self, **_):
        return self

    row = split = box = column


def drawn(addon):
    layout = Layout()
    kind = preferences.NIM_AP_preferences
    kind.draw(type("", (), {"layout": layout, "bl_rna": kind.bl_rna})(), bpy.context)
    return layout.drawn


def test_the_check_measures_in_a_second_blender_and_shows_it(addon, press):
    before = {scene.name for scene in bpy.data.scenes}
    assert press("nim.check_blender") == {"FINISHED"}
    assert {scene.name for scene in bpy.data.scenes} == before
    answer = blender_check.check.answer
    assert answer["doctor"]["blender"] == bpy.app.version_string
    assert answer["verify"]["passed"]
    assert {check["what"] for check in answer["verify"]["checks"]} == {"R", "landing"}
    text = "\n".join(drawn(addon))
    assert "PASS: 44" in text
    assert bpy.app.version_string in text


def test_a_failure_is_said(addon):
    row = {"incident": "n=1", "transmitted": "n=-1.5", "angle": 30.0, "equation": 0.04, "passed": True}
    good = {**row, "what": "R", "measured": 0.0401, "error": 0.0001, "z": 1.0}
    bad = {**row, "what": "landing", "measured": 0.5, "error": 0.001, "z": None, "passed": False}
    assert blender_check.verdict({"checks": [good]}).startswith("PASS: 1")
    assert blender_check.verdict({"checks": [good, bad]}).startswith("FAIL: 1 of 2")
    assert blender_check.worst({"checks": [good, bad]}).startswith("landing point from n=1 to n=-1.5 at 30")


def test_a_check_that_does_not_run_gives_its_reason(addon, press, monkeypatch):
    monkeypatch.setattr(blender_check, "MODULE", "broken")
    with pytest.raises(RuntimeError, match=r"No module named nim_addon\.broken"):
        press("nim.check_blender")
    assert any("nim_addon.broken" in text for text in drawn(addon))
    assert not blender_check.check.running


def test_a_check_without_a_temporary_folder_gives_its_reason(addon, press, monkeypatch, tmp_path):
    monkeypatch.setattr(blender_check, "check", blender_check.Check())
    monkeypatch.setattr(blender_check.tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(RuntimeError, match=r"A second Blender could not be started: .*missing"):
        press("nim.check_blender")
    assert any("missing" in text for text in drawn(addon))
    assert not blender_check.check.running


def test_a_check_that_is_stopped_leaves_nothing_in_the_temporary_folder(addon, monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    blender_check.check.start()
    deadline = time.monotonic() + 60
    while not list(tmp_path.rglob("blender_*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert list(tmp_path.rglob("blender_*"))
    blender_check.check.stop()
    assert not list(tmp_path.iterdir())


def test_disabling_ends_a_check_that_runs(addon):
    import addon_utils

    blender_check.check.start()
    process = blender_check.check.process
    addon_utils.disable(addon, default_set=True)
    assert process.poll() is not None
    assert not blender_check.check.running
    addon_utils.enable(addon, default_set=True)

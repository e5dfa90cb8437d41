# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences, what others read of them, and the check of this Blender."""

import tempfile
import time

import bpy
import pytest

import nim_addon
from nim_addon.cycles.closures import backends
from nim_addon.ui import preferences


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

    def column(self, **_):
        return self

    row = split = box = column


def drawn(addon):
    layout = Layout()
    one = bpy.context.preferences.addons[addon].preferences
    preferences.NIM_AP_preferences.draw(type("", (), {"layout": layout, "rna": one})(), bpy.context)
    return layout.drawn


def test_settings_are_the_preferences(addon):
    assert preferences.settings() == bpy.context.preferences.addons[addon].preferences
    assert {key: getattr(preferences.settings(), key) for key in preferences.DEFAULTS} == preferences.DEFAULTS
    preferences.settings().backend = "nodes"
    assert preferences.settings().backend == "nodes"


def test_settings_without_being_enabled_are_the_defaults(default_file):
    nim_addon.register()
    try:
        assert vars(preferences.settings()) == preferences.DEFAULTS
    finally:
        nim_addon.unregister()


def test_the_backends_are_those_of_the_material():
    assert tuple(item[0] for item in preferences.BACKENDS) == backends.BACKENDS
    assert [item[4] for item in preferences.BACKENDS] == [0, 1, 2]


def test_every_property_says_what_it_is(addon):
    for prop in preferences.settings().bl_rna.properties:
        if prop.identifier in preferences.DEFAULTS:
            assert prop.name and prop.description


def test_the_check_measures_in_a_second_blender_and_shows_it(addon, press):
    before = {scene.name for scene in bpy.data.scenes}
    assert press("nim.check_blender") == {"FINISHED"}
    assert {scene.name for scene in bpy.data.scenes} == before
    answer = preferences.check.answer
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
    assert preferences.verdict({"checks": [good]}).startswith("PASS: 1")
    assert preferences.verdict({"checks": [good, bad]}).startswith("FAIL: 1 of 2")
    assert preferences.worst({"checks": [good, bad]}).startswith("landing point from n=1 to n=-1.5 at 30")


def test_a_check_that_does_not_run_gives_its_reason(addon, press, monkeypatch):
    monkeypatch.setattr(preferences, "CHECK", "raise RuntimeError({words!r}[1] + ' is broken')")
    with pytest.raises(RuntimeError, match="nim_addon is broken"):
        press("nim.check_blender")
    assert any("nim_addon is broken" in text for text in drawn(addon))
    assert not preferences.check.running


def test_a_check_without_a_temporary_folder_gives_its_reason(addon, press, monkeypatch, tmp_path):
    monkeypatch.setattr(preferences, "check", preferences._Check())
    monkeypatch.setattr(preferences.tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(RuntimeError, match=r"A second Blender could not be started: .*missing"):
        press("nim.check_blender")
    assert any("missing" in text for text in drawn(addon))
    assert not preferences.check.running


def test_a_check_that_is_stopped_leaves_nothing_in_the_temporary_folder(addon, monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    preferences.check.start()
    deadline = time.monotonic() + 60
    while not list(tmp_path.rglob("blender_*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert list(tmp_path.rglob("blender_*"))
    preferences.check.stop()
    assert not list(tmp_path.iterdir())


def test_disabling_ends_a_check_that_runs(addon, monkeypatch):
    import addon_utils

    monkeypatch.setattr(preferences, "CHECK", "import time; time.sleep(60)")
    preferences.check.start()
    process = preferences.check.process
    addon_utils.disable(addon, default_set=True)
    assert process.poll() is not None
    assert not preferences.check.running
    addon_utils.enable(addon, default_set=True)

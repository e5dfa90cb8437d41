# SPDX-License-Identifier: GPL-3.0-or-later
"""The shipped presets are what the figures' recipes say."""

import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def texts(folder):
    return {file.relative_to(folder).as_posix(): file.read_text(encoding="utf-8") for file in folder.glob("*/*.py")}


def test_the_shipped_presets_are_those_of_the_recipes(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_presets.py", str(tmp_path)])
    runpy.run_path(str(ROOT / "blend_scenes" / "make_presets.py"))
    assert texts(ROOT / "nim_addon" / "presets" / "nim_addon") == texts(tmp_path), "run python3 build.py blends presets"
    assert len(texts(tmp_path)) > 20

# SPDX-License-Identifier: GPL-3.0-or-later
"""Help: each panel and each context menu leads to a section of a page that is there."""

import fnmatch
import inspect
import re
import webbrowser
from pathlib import Path

import bpy
import pytest
from bl_operators.wm import WM_OT_doc_view_manual

from nim_addon import ui
from nim_addon.base import shipped
from nim_addon.ui import help as pages

DOCS = Path(__file__).parents[2] / "docs"
PANELS = [cls for module in ui.MODULES for cls in getattr(module, "CLASSES", ()) if issubclass(cls, bpy.types.Panel)]
OURS = [cls for module in ui.MODULES for cls in getattr(module, "CLASSES", ())]


def sections(page):
    """The sections of a page, as its address names them."""
    text = re.sub(r"^```.*?^```", "", (DOCS / f"{page}.md").read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^##+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def is_there(name):
    page, _, section = name.partition("#")
    return (DOCS / f"{page}.md").is_file() and (not section or section in sections(page))


def test_every_panel_has_a_section_of_a_page():
    assert len(PANELS) > 10
    assert not [cls.__name__ for cls in PANELS if not hasattr(cls, "draw_header_preset") or not is_there(cls.page)]


def test_every_button_and_setting_has_one_in_its_context_menu(addon):
    assert not [name for _, name in pages.MANUAL if not is_there(name)]
    names = [f"bpy.ops.{cls.bl_idname}" for cls in OURS if issubclass(cls, bpy.types.Operator)]
    for cls in OURS:
        if issubclass(cls, bpy.types.PropertyGroup | bpy.types.AddonPreferences):
            names += [f"bpy.types.{cls.__name__}.{name}" for name in inspect.get_annotations(cls)]
    assert len(names) > 60
    for name in names:
        found = WM_OT_doc_view_manual._lookup_rna_url(name, verbose=False)
        assert found and found.startswith("file://") and "/docs/" in found, name
    # and none stands behind one that takes all of its own
    patterns = [pattern for pattern, _ in pages.MANUAL]
    first = {next(pattern for pattern in patterns if fnmatch.fnmatchcase(name.lower(), pattern)) for name in names}
    assert not set(patterns) - first


def test_the_button_opens_the_page(addon, press, monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert press("nim.help", page="material#checks") == {"FINISHED"}
    assert opened == [(DOCS / "material.md").as_uri() + "#checks"]
    monkeypatch.setattr(shipped, "FOLDER", tmp_path / "nim_addon")
    with pytest.raises(RuntimeError, match="The pages are missing from this installation"):
        press("nim.help", page="material#checks")
    (tmp_path / "nim_addon" / "docs").mkdir(parents=True)
    (tmp_path / "nim_addon" / "docs" / "material.html").touch()
    assert press("nim.help", page="material#checks") == {"FINISHED"}
    assert opened[-1] == (tmp_path / "nim_addon" / "docs" / "material.html").as_uri() + "#checks"


def test_an_operator_that_fails_names_the_section_that_explains_it(addon, press):
    with pytest.raises(RuntimeError) as caught:
        press("nim.load_figure", scene="glass", figure="9.9", recipe="none")
    said = "9.9 none is no preset of this scene."
    assert str(caught.value).strip() == f'Error: {said} See "Presets" in the help (?).'
    assert pages.explained("nim.render_scene", "Why").startswith('Why. See "Render in the background"')
    for cls in OURS:
        if issubclass(cls, bpy.types.Operator):
            assert is_there(pages.section_of(cls.bl_idname))

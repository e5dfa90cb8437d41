# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages: their Python runs and prints what they say, their commands exist, their pictures are there and not heavy.

That Sphinx makes them without a warning is for `build.py docs` to say, which has an environment of its own.
"""

import importlib.util
import json
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import command
from nim_addon.figures.registry import FIGURES
from nim_addon.physics import Interface, Medium

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
PAPERS = [ROOT / name for name in ("ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md")]
WITHOUT_COMMANDS = {"README.md", "first-minutes.md", "material.md", "index.md", "reviewers.md"}
IMAGES = sorted(path for path in (DOCS / "images").rglob("*") if path.suffix in (".png", ".jpg", ".svg"))
HEAVIEST = 300_000


def blocks(page):
    """The Python blocks of a page."""
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def promised(block):
    """What a block says that it prints: the comment behind a print(), or the comment lines below it."""
    return re.findall(r"(?:print\(.*\)  |^)# (.*)$", block, re.MULTILINE)


def links(page):
    """The targets of a page's links and pictures in this repository."""
    found = re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    return [target.partition("#")[0] for target in found if "://" not in target and not target.startswith("#")]


@pytest.mark.parametrize(
    "page, count, files", [("scripting", 11, ["mine", "pool"]), ("own-scene", 4, ["prism"]), ("physics", 7, [])]
)
def test_the_python_of_a_page_does_what_it_says(page, count, files, default_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    code = blocks(DOCS / f"{page}.md")
    assert len(code) >= count
    try:
        for block in code:
            exec(compile(block, f"{page}.md", "exec"), names)
            said = [
                line for line in capsys.readouterr().out.splitlines() if not re.match(r"Info:|module changed", line)
            ]
            assert said == promised(block), block
    finally:
        if "addon_utils" in names:
            names["addon_utils"].disable("nim_addon", default_set=True)
    made = sorted(path.name for path in tmp_path.rglob("*.*"))
    assert made == [f"{file}.{kind}" for file in files for kind in ("exr", "png")]


def test_the_table_of_the_physics_page_holds_what_the_equations_give():
    """All four pairs of signs, at 45 degrees."""
    text = (DOCS / "physics.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (-?1) \| (-?1\.5) \| (\S+) \| (yes|no) \| (\S+) \| (\S+) \| (\S+) \|$", text, re.MULTILINE)
    assert len({row[:2] for row in rows}) == 4
    angle = math.radians(45)
    for n_i, n_t, theta_t, backwards, *reflectances in rows:
        surface = Interface(inside=Medium(float(n_t)), outside=Medium(float(n_i)))
        assert f"{math.degrees(surface.theta_t(angle)):.2f}" == theta_t
        assert surface.bends_backwards == (backwards == "yes")
        assert [f"{R:.4f}" for R in surface.fresnel(math.cos(angle))[:3]] == reflectances


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_is_one_that_nimray_takes(page):
    text = page.read_text(encoding="utf-8")
    parser = command.parser()
    lines = re.findall(r"^    (?:blender --command |python3 build\.py )?nimray (.*)$", text, re.MULTILINE)
    for line in lines:
        parser.parse_args(shlex.split(line))
    assert lines or page.name in WITHOUT_COMMANDS or page.parent.name == "api"


def test_the_command_line_page_has_every_command_with_an_example_and_every_option():
    text = (DOCS / "command-line.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE))
    for name, parser in command.parser().commands.items():
        assert f"\n    nimray {name}" in sections[name], name
        shared = name in ("compare", "sweep")  # which say so
        told = sections[name] + (sections["render"] if shared else "")
        options = set(re.findall(r"--[a-z][a-z-]*", parser.format_usage()))
        assert not [option for option in options if option not in told], name


@pytest.mark.parametrize("page", PAGES + PAPERS, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_somewhere(page):
    missing = [target for target in links(page) if not (page.parent / target).exists()]
    assert not missing


def test_every_picture_is_on_a_page_and_light():
    shown = {(page.parent / target).resolve() for page in PAGES for target in links(page)}
    assert IMAGES
    assert not [path.name for path in IMAGES if path.resolve() not in shown], "on no page"
    assert not [path.name for path in IMAGES if path.stat().st_size > HEAVIEST], f"more than {HEAVIEST} bytes"


def test_every_page_is_in_the_navigation_once():
    listed = []
    for page in (DOCS / "index.md", DOCS / "api" / "index.md"):
        for tree in re.findall(r"^```{toctree}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
            entries = [line for line in tree.splitlines() if line and not line.startswith(":")]
            listed += [page.parent / f"{entry}.md" for entry in entries]
    assert sorted(listed) == sorted(page for page in DOCS.rglob("*.md") if page != DOCS / "index.md")


def test_the_tests_that_reviewers_are_told_of_are_there_and_so_are_the_files():
    text = (DOCS / "reviewers.md").read_text(encoding="utf-8")
    tests = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    told = [name.replace(",", "").replace(" ", "_") for name in re.findall(r"(?<!\*)\*([a-z][a-z ,]+)\*(?!\*)", text)]
    assert len(told) > 4 and not [name for name in told if f"def test_{name}" not in tests]
    files = [name for name in re.findall(r"`([\w/.-]+\.(?:py|toml|txt|blend))`", text) if "*" not in name]
    assert not [name for name in files if not (ROOT / name).exists() and not (ROOT / "nim_addon" / name).exists()]


def test_the_gallery_has_every_figure_and_no_claim_fails():
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## (\S+\.\d+) (.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE))
    assert list(sections) == list(FIGURES)
    for number, section in sections.items():
        rows = re.findall(r"^\| .* \| \S+ \| \S+ \| \S+ \| .*\|$", section, re.MULTILINE)[2:]
        assert f"<summary>{len(rows)} claims, all hold</summary>" in section and rows, number
        assert f"(images/figure-{number}." in section


@pytest.fixture
def gallery(tmp_path, monkeypatch):
    """docs/make_gallery.py, which writes into a folder of the test."""
    spec = importlib.util.spec_from_file_location("make_gallery", DOCS / "make_gallery.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "PAGE", tmp_path / "gallery.md")
    monkeypatch.setattr(module, "IMAGES", tmp_path)
    module.PAGE.write_text(f"By hand.\n{module.PAGE_MARK}\nOld.\n", encoding="utf-8")
    return module


def run_of(folder, number, measured):
    """A folder like one that `nimray figures` wrote, with one figure in it, noisy and 1800 pixels wide."""
    folder.mkdir(exist_ok=True)
    noise = np.random.default_rng(0).integers(0, 255, (300, 1800, 3), np.uint8)
    image = oiio.ImageBuf(oiio.ImageSpec(1800, 300, 3, oiio.UINT8))
    image.set_pixels(image.roi, noise)
    image.write(str(folder / f"figure-{number}.png"))
    claim = {
        "text": "|n|",
        "predicted": 1.0,
        "measured": measured,
        "allowed": 0.1,
        "unit": "m",
        "holds": measured == 1.0,
    }
    record = {"figure": number, "title": "A title", "shows": "What it shows.", "must_hold": ["It holds."]}
    record |= {
        "quality": "final",
        "picture": f"figure-{number}.png",
        "blender": "4.5",
        "nimray": "0",
        "claims": [claim],
    }
    (folder / f"figure-{number}.json").write_text(json.dumps(record))
    return folder


def test_the_gallery_is_written_from_the_records_of_runs(gallery, tmp_path):
    first, second = run_of(tmp_path / "a", "5.10", 1.0), run_of(tmp_path / "b", "5.9", 3.0)
    run_of(tmp_path / "b", "5.10", 2.0)
    assert gallery.main([first, second]) == 0
    text = gallery.PAGE.read_text(encoding="utf-8")
    assert text.startswith(f"By hand.\n{gallery.PAGE_MARK}\n") and "Old." not in text
    assert text.index("## 5.9 A title") < text.index("## 5.10 A title")
    assert "2 figures; 1 of 2 claims fail" in text and "1 claim, 1 FAIL" in text
    assert r"| \|n\| | 1 | 1 | 0.1 | m |" in text, "5.10 is not the first folder's"
    picture = oiio.ImageBuf(str(tmp_path / "figure-5.10.jpg"))
    assert (picture.spec().width, picture.spec().height) == (1600, 267)
    assert (tmp_path / "figure-5.10.jpg").stat().st_size < HEAVIEST


def test_a_figure_that_is_made_anew_leaves_the_others_on_the_page(gallery, tmp_path):
    assert gallery.main([run_of(tmp_path / "a", "5.10", 1.0), run_of(tmp_path / "b", "5.9", 3.0)]) == 0
    before = gallery.PAGE.read_text(encoding="utf-8")
    assert gallery.main([run_of(tmp_path / "b", "5.9", 3.0)]) == 0
    assert gallery.PAGE.read_text(encoding="utf-8") == before
    assert gallery.main([run_of(tmp_path / "b", "5.9", 1.0)]) == 0
    text = gallery.PAGE.read_text(encoding="utf-8")
    assert (
        "2 figures; all 2 claims hold." in text and text.count("## 5.") == 2 and text.index("5.9") < text.index("5.10")
    )


def test_a_folder_without_figures_leaves_the_gallery_as_it_is(gallery, tmp_path, capsys):
    assert gallery.main([tmp_path]) == 2
    assert "nimray figures" in capsys.readouterr().err and "Old." in gallery.PAGE.read_text(encoding="utf-8")


# Blender as the pages are made: with no more than names, which are no types
MOCK = """
import importlib, sys, types

class Mock(types.ModuleType):
    __path__ = ()
    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Mock(name)
    def __call__(self, *_, **__):
        return Mock("called")

for name in ("bpy", "bpy.app", "bpy.app.handlers", "bmesh", "mathutils", "mathutils.bvhtree", "OpenImageIO", "matplotlib"):
    sys.modules[name] = Mock(name)
for name in sys.argv[1:]:
    importlib.import_module(name)
"""


def test_what_the_api_pages_tell_of_is_there_without_blender():
    text = "".join(page.read_text(encoding="utf-8") for page in (DOCS / "api").glob("*.md"))
    modules = re.findall(r"automodule:: (\S+)", text)
    done = subprocess.run([sys.executable, "-c", MOCK, *modules], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0 and len(modules) > 20, done.stderr

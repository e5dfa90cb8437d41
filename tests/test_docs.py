# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages: their Python runs and prints what they say, their commands exist, their pictures are there and not heavy."""

import re
import shlex
from pathlib import Path

import pytest

from nim_addon import cli

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
IMAGES = sorted(path for path in (ROOT / "docs" / "images").rglob("*") if path.suffix in (".png", ".jpg"))
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


def test_the_python_of_the_scripting_page_does_what_it_says(default_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    code = blocks(ROOT / "docs" / "scripting.md")
    assert len(code) > 5
    try:
        for block in code:
            exec(compile(block, "scripting.md", "exec"), names)
            said = [
                line for line in capsys.readouterr().out.splitlines() if not re.match(r"Info:|module changed", line)
            ]
            assert said == promised(block), block
    finally:
        names["addon_utils"].disable("nim_addon", default_set=True)
    assert sorted(path.name for path in (tmp_path / "renders").iterdir()) == ["mine.exr", "mine.png"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_is_one_that_nimray_takes(page):
    text = page.read_text(encoding="utf-8")
    parser = cli._parser()
    lines = re.findall(r"^    (?:blender --command |python3 build\.py )?nimray (.*)$", text, re.MULTILINE)
    for line in lines:
        parser.parse_args(shlex.split(line))
    assert lines or page.name in ("README.md", "first-minutes.md", "material.md")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_somewhere(page):
    missing = [target for target in links(page) if not (page.parent / target).exists()]
    assert not missing


def test_every_picture_is_on_a_page_and_light():
    shown = {(page.parent / target).resolve() for page in PAGES for target in links(page)}
    assert IMAGES
    assert not [path.name for path in IMAGES if path.resolve() not in shown], "on no page"
    assert not [path.name for path in IMAGES if path.stat().st_size > HEAVIEST], f"more than {HEAVIEST} bytes"

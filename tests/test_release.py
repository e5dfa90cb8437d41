# SPDX-License-Identifier: GPL-3.0-or-later
"""A release, tried on a copy: its version, its changelog, its zip; and the wheel."""

import datetime
import importlib.util
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from nim_addon.base.version import VERSION

ROOT = Path(__file__).parents[1]
DAY = datetime.date(2027, 2, 3)
CHANGES = f"# Changelog\n\nIntroduction.\n\n## [Unreleased]\n\n### Added\n\n- A thing.\n\n## [{VERSION}] - 2026-11-23\n\n- All.\n"


def module(path):
    """A module of its own from a file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@pytest.fixture
def copy(tmp_path):
    """A copy of what a release is made of, with something unreleased in its changelog."""
    leave = shutil.ignore_patterns("__pycache__", "*.pyc")
    for name in ("nim_addon", "osl", "tools", "docs"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=leave)
    for name in ("build.py", "setup.py", "pyproject.toml", "LICENSE", "README.md", "CITATION.cff"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / "CHANGELOG.md").write_text(CHANGES)
    for words in (["init", "--quiet"], ["add", "."]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    return tmp_path


def texts(folder):
    """What a release may change, as it is."""
    names = ("nim_addon/base/version.py", "nim_addon/blender_manifest.toml", "CITATION.cff", "CHANGELOG.md")
    return [(folder / name).read_text() for name in names]


def test_the_files_agree_on_the_version():
    assert set(module(ROOT / "tools" / "release.py").versions(ROOT).values()) == {VERSION}


def test_the_changelog_can_be_released():
    """It has the section that a release takes, and one for the version of today."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert text.count("\n## [Unreleased]\n") == 1
    assert f"\n## [{VERSION}] - 20" in text


def test_a_release_writes_the_version_everywhere_and_dates_the_changes(copy):
    tool = module(copy / "tools" / "release.py")
    former = texts(copy)
    restored = tool.write(copy, "0.2.0", DAY)
    assert set(tool.versions(copy).values()) == {"0.2.0"}
    assert tomllib.loads((copy / "nim_addon" / "blender_manifest.toml").read_text())["schema_version"] == "1.0.0"
    assert (copy / "CITATION.cff").read_text().startswith("cff-version: 1.2.0\n")
    changed = (copy / "CHANGELOG.md").read_text()
    assert "## [Unreleased]\n\n## [0.2.0] - 2027-02-03\n\n### Added\n\n- A thing.\n\n## [0.1.0]" in changed
    tool.restore(restored)
    assert texts(copy) == former


@pytest.mark.parametrize("version", ("0.2", "next", "0.1.0", "0.0.9", "v0.2.0"))
def test_no_release_is_made_of_a_version_that_does_not_follow(copy, version, one_sentence):
    tool, former = module(copy / "tools" / "release.py"), texts(copy)
    with pytest.raises(tool.Refusal) as error:
        tool.write(copy, version, DAY)
    one_sentence(error.value, version)
    assert texts(copy) == former


def test_no_release_is_made_of_nothing_or_of_files_that_do_not_agree(copy, one_sentence):
    tool = module(copy / "tools" / "release.py")
    (copy / "CHANGELOG.md").write_text(CHANGES.replace("### Added\n\n- A thing.\n\n", ""))
    with pytest.raises(tool.Refusal) as error:
        tool.write(copy, "0.2.0", DAY)
    one_sentence(error.value, "CHANGELOG.md")
    (copy / "CITATION.cff").write_text("version: 0.1.1\n")
    with pytest.raises(tool.Refusal) as error:
        tool.write(copy, "0.2.0", DAY)
    one_sentence(error.value, "0.1.0, 0.1.1")


def test_release_checks_packs_and_takes_back_what_failed(copy, monkeypatch, capfd):
    build = module(copy / "build.py")
    passes = {"lint": 0, "test": 1}
    for name in passes:
        monkeypatch.setattr(build, name, lambda python, rest, name=name: passes[name])
    former = texts(copy)
    assert build.release(Path(sys.executable), ["0.2.0"]) == 1
    assert texts(copy) == former and not (copy / "dist").exists()
    passes["test"] = 0
    assert build.release(Path(sys.executable), ["0.2.0"]) == 0
    assert "git tag v0.2.0" in capfd.readouterr().out
    manifest = zipfile.ZipFile(copy / "dist" / "nim_addon-0.2.0.zip").read("blender_manifest.toml").decode()
    assert tomllib.loads(manifest)["version"] == "0.2.0"
    assert build.release(Path(sys.executable), []) == build.release(Path(sys.executable), ["0.2.0"]) == 2


def test_the_wheel_has_every_file_of_the_addon(copy):
    words = ("wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", "wheels", ".")
    subprocess.run([sys.executable, "-m", "pip", *words], cwd=copy, check=True)
    (wheel,) = (copy / "wheels").iterdir()
    assert wheel.name == f"nim_addon-{VERSION}-py3-none-any.whl"
    files = {f"nim_addon/{file.relative_to(copy / 'nim_addon').as_posix()}" for file in (copy / "nim_addon").rglob("*")}
    files = {name for name in files if (copy / name).is_file()}
    files |= {f"nim_addon/osl/{file.name}" for file in (copy / "osl").iterdir()}
    assert {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name} == files

# SPDX-License-Identifier: GPL-3.0-or-later
"""The version of a release: in the files that say it, and over what the changelog holds. Standard library only."""

import re

# Where the version stands: the first is where the code takes it from, the others follow.
FILES = {
    "nim_addon/base/version.py": r'^VERSION = "(.*)"$',
    "nim_addon/blender_manifest.toml": r'^version = "(.*)"$',
    "CITATION.cff": r"^version: (.*)$",
}
CHANGELOG = "CHANGELOG.md"
UNRELEASED = re.compile(r"^## \[Unreleased\]\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)


class Refusal(Exception):
    """There can be no such release; the text says why."""


def versions(root):
    """{file: the version that it says} of the repository in the folder `root`."""
    return {file: re.search(line, _text(root / file), re.MULTILINE)[1] for file, line in FILES.items()}


def write(root, version, day):
    """Write a version into the files, and it and the day over what is unreleased in the changelog.

    day: a datetime.date
    Returns what restore() takes, {path: the text that it had}; raises Refusal, with nothing written.
    """
    former = set(versions(root).values())
    if len(former) > 1:
        raise Refusal(f"the files do not agree on the version of today: {', '.join(sorted(former))}.")
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        raise Refusal(f"{version!r} is no version: it is three numbers, such as 0.2.0.")
    if _numbers(version) <= _numbers(*former):
        raise Refusal(f"{version} is not after {''.join(former)}.")
    changes = UNRELEASED.search(_text(root / CHANGELOG))
    if changes is None or not changes[1].strip():
        raise Refusal(f"{CHANGELOG} says of nothing that it is unreleased.")
    texts = {root / file: _text(root / file) for file in (*FILES, CHANGELOG)}
    for file, line in FILES.items():
        (start, end), text = re.search(line, texts[root / file], re.MULTILINE).span(1), texts[root / file]
        _write(root / file, text[:start] + version + text[end:])
    text, at = texts[root / CHANGELOG], changes.start(1)
    _write(root / CHANGELOG, f"{text[:at]}\n## [{version}] - {day.isoformat()}\n{text[at:]}")
    return texts


def restore(texts):
    """Give files the texts back that write() returned."""
    for path, text in texts.items():
        _write(path, text)


def _numbers(version):
    return tuple(map(int, version.split(".")))


def _text(path):
    return path.read_text(encoding="utf-8")


def _write(path, text):
    path.write_text(text, encoding="utf-8", newline="\n")

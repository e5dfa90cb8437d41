# SPDX-License-Identifier: GPL-3.0-or-later
"""The package's own name, and the files that it brings along, which are only read: the one place that asks where they lie."""

from pathlib import Path

PACKAGE = (__package__ or "").rpartition(".")[0]  # "nim_addon", or as an extension "bl_ext.user_default.nim_addon"
FOLDER = Path(__file__).resolve().parents[1]
ASSETS = FOLDER / "assets"
LOCALE = FOLDER / "locale"
SPECTRA = FOLDER / "physics" / "data"


def shader(name: str) -> Path:
    """The text of a shader of osl/: within the package once installed, beside it in a checkout."""
    for root in (FOLDER, FOLDER.parent):
        if (path := root / "osl" / f"{name}.osl").is_file():
            return path
    raise FileNotFoundError(f"osl/{name}.osl is missing from this installation of nim_addon; install it again.")


def page(name: str) -> str:
    """Where a page of docs/ is, with its "#section" if it names one, as an address that a browser opens; empty if nowhere.

    It is HTML in the extension, and the text itself in a checkout.
    """
    title, mark, section = name.partition("#")
    for file in (FOLDER / "docs" / f"{title}.html", FOLDER.parent / "docs" / f"{title}.md"):
        if file.is_file():
            return file.as_uri() + mark + section
    return ""

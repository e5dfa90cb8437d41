# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a sweep: one file that shows its pictures by sliders, and a curve of what was measured; it needs no network."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from pathlib import Path

from ..base import shipped
from ..base.files import whole

FILE = "index.html"

TEMPLATE = shipped.FOLDER / "sweeps" / "page.html"


def write(
    folder: str | Path, title: str, lines: Sequence[dict], keys: Sequence[str], measured: Sequence[str] = ()
) -> Path:
    """Write index.html; returns the file.

    lines:    of the table, as table.rows() gives them
    keys:     what was varied, each of which gets a slider
    measured: the quantities among the columns, which get curves
    """
    axes = [(key, list(dict.fromkeys(line.get(key, "") for line in lines))) for key in keys]
    places = [{value: place for place, value in enumerate(values)} for _, values in axes]
    at = [[of[line.get(key, "")] for line in lines] for of, key in zip(places, keys, strict=True)]
    shown = ("file", "seconds", "host", "nimray", "blender", "backend", *measured)
    facts = {name: _column([line.get(name) for line in lines]) for name in shown}
    # no text of the data may end its element
    data = json.dumps({"axes": axes, "at": at, "facts": facts, "measured": list(measured)}).replace("<", "\\u003c")
    text = TEMPLATE.read_text(encoding="utf-8").replace("@TITLE@", html.escape(title)).replace("@DATA@", data)
    return whole(Path(folder).expanduser() / FILE, lambda part: part.write_text(text, encoding="utf-8"))


def _column(values):
    """Values as the page holds them, numbers as exactly as it shows them; one alone where all are the same."""
    held = [float(f"{value:.6g}") if isinstance(value, float) else value for value in values]
    return held[0] if len(set(held)) == 1 else held

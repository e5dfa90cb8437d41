# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a sweep is, said from its folder alone, without Blender."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from ..base import records
from . import IMAGES, PLAN, state


class Status(NamedTuple):
    """How many of the tasks of a plan are done; whether a process is at work here, and what it says of itself."""

    done: int
    total: int
    at_work: bool
    said: dict

    def record(self) -> dict:
        """All that as JSON-ready values."""
        here = self.said if self.at_work else {}
        return {
            "done": self.done,
            "total": self.total,
            "at_work": self.at_work,
            "left": here.get("left"),
            "failed": self.said.get("failed", 0),
            "workers": here.get("workers", {}),
        }


def of(folder: str | Path) -> Status:
    """That of the sweep in a folder; ValueError, one sentence, where there is none."""
    folder = Path(folder).expanduser()
    try:
        keys = _keys(folder / PLAN)
    except OSError:
        raise ValueError(f"there is no sweep in {folder}; name the folder that --out named.") from None
    except (KeyError, ValueError):
        raise ValueError(f"{folder / PLAN} is not understood.") from None
    there: dict[str, set[str]] = {}
    done = 0
    for key in keys:
        place = key[:2]
        if place not in there:
            inner = folder / IMAGES / place
            there[place] = {file.stem for file in inner.glob("*.json")} if inner.is_dir() else set()
        done += key in there[place] or key.partition("-")[0] in there[place]
    return Status(done, len(keys), state.is_at_work(folder), state.read(folder) or {})


def _keys(file):
    if not file.is_file():  # a pipe would be waited for
        raise FileNotFoundError
    keys = [records.parse(line)["key"] for line in file.read_text(encoding="utf-8-sig").splitlines() if line]
    if not all(isinstance(key, str) for key in keys):
        raise ValueError("no keys")
    return keys

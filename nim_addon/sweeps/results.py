# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tasks of a sweep leave in its folder, and which of them are done.

Of each render there are an EXR, a PNG and a table of how it was made; of a part of its samples an EXR of its passes and such
a table. The table comes last and whole: what has one is done, whoever may have been killed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ..base import records
from ..base.files import whole
from . import IMAGES
from .plan import Task


class Made(NamedTuple):
    """How a task was carried out.

    seconds: of the render, with its set-up; host: of the machine; blender, backend: what it was rendered with
    """

    seconds: float
    host: str
    blender: str
    backend: str


def folder_of(folder: str | Path, task: Task) -> Path:
    """Where the files of a task lie: no folder holds all of them."""
    return Path(folder).expanduser() / IMAGES / task.image[:2]


def image_of(folder: str | Path, task: Task) -> Path:
    """The EXR of the picture that a task is, or is a part of."""
    return folder_of(folder, task) / f"{task.image}.exr"


def finish(folder: str | Path, task: Task, made: Made) -> None:
    """Say that a task is done, once its images are there."""
    text = json.dumps(made._asdict())
    whole(folder_of(folder, task) / f"{task.key}.json", lambda part: part.write_text(text, encoding="utf-8"))


def made(folder: str | Path, task: Task) -> Made | None:
    """How a task was carried out; None where it is not done."""
    stem = folder_of(folder, task) / task.key
    try:
        found = Made(**records.parse(stem.with_suffix(".json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    files = [stem.with_suffix(suffix) for suffix in ((".exr",) if task.part else (".exr", ".png"))]
    return found if all(file.is_file() for file in files) else None


def to_do(folder: str | Path, tasks: Sequence[Task]) -> list[Task]:
    """Those of the tasks that are not done. A part of an image that is there, whole, is done."""
    whole_ones: dict[str, bool] = {}

    def is_there(task: Task) -> bool:
        if task.part and task.image not in whole_ones:
            whole_ones[task.image] = made(folder, Task(task.request, task.values)) is not None
        return whole_ones.get(task.image, False) or made(folder, task) is not None

    return [task for task in tasks if not is_there(task)]

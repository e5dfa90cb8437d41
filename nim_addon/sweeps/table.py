# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of a sweep: a line for each picture, with what was varied, how it was made, and what was measured in it."""

from __future__ import annotations

import contextlib
import csv
import io
from collections.abc import Sequence
from pathlib import Path

from ..base.files import whole
from ..figures.quantities import quantity
from . import results
from .plan import Task

FILE = "table.csv"


def rows(folder: str | Path, pictures: Sequence[Task], measured: Sequence[str] = ()) -> list[dict]:
    """The lines of the pictures of a plan that are done, dicts by column; `measured`: names of quantities."""
    found = []
    for task in pictures:
        made = results.made(folder, task)
        if made is None:
            continue
        exr = results.image_of(folder, task)
        numbers = {}
        for name in measured:
            probe = results.image_of(folder, Task(quantity(name).probe(task.request)))
            numbers[name] = quantity(name).of(task.request, probe) if probe.is_file() else None
        found.append(
            {
                **task.values,
                "key": task.image,
                "file": exr.relative_to(Path(folder).expanduser()).as_posix(),
                "seconds": made.seconds,
                "host": made.host,
                "nimray": task.request.record()["nimray"],
                "blender": made.blender,
                "backend": made.backend,
                **numbers,
            }
        )
    return found


def write(folder: str | Path, lines: Sequence[dict]) -> list[Path]:
    """Write table.csv, and table.parquet where pyarrow is there and works; returns the files."""
    columns = list(dict.fromkeys(column for line in lines for column in line))
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    file = Path(folder).expanduser() / FILE
    files = [whole(file, lambda part: part.write_text(text.getvalue(), encoding="utf-8", newline=""))]
    with contextlib.suppress(ImportError):  # also of one for another numpy
        from pyarrow import Table, parquet  # pyright: ignore[reportMissingImports]

        held = Table.from_pylist([{column: line.get(column) for column in columns} for line in lines])
        files.append(whole(file.with_suffix(".parquet"), lambda part: parquet.write_table(held, part)))
    return files

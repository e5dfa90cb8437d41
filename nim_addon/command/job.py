# SPDX-License-Identifier: GPL-3.0-or-later
"""A job of the panel: requests as JSON, rendered with the progress of `nimray --progress`; run as a module of its own."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping

from ..base import records, signals, streams
from . import answer, blender, script
from .compare import render_side_by_side
from .render import carry_out, refused
from .report import Output
from .words import UsageError


def words(
    requests: Mapping[str, dict], folder: str, joined: str = "", compared: Mapping[str, object] | None = None
) -> list[str]:
    """What run() takes, to be the words behind this module.

    requests: records of renders.request.Request, by the names of their images
    folder:   where to
    joined:   name of an image of all of them side by side, where there is to be one
    compared: what its record says, as for compare.render_side_by_side()
    """
    return [
        json.dumps({"requests": dict(requests), "folder": folder, "joined": joined, "compared": dict(compared or {})})
    ]


def run(text: str) -> None:
    """Render what words() made a text of; UsageError for any other."""
    blender.load()
    from ..renders.request import Request

    try:
        job = records.parse(text)
        asked, folder, joined, compared = (job[key] for key in ("requests", "folder", "joined", "compared"))
    except (KeyError, ValueError):
        raise UsageError("the job is not understood.") from None
    with refused():
        requests = {name: Request.from_record(record, name) for name, record in asked.items()}
    with Output(argparse.Namespace(quiet=False, progress=True), len(requests)) as output:
        if joined:
            return render_side_by_side(requests, folder, joined, compared, output)
        for name, request in requests.items():
            made = carry_out(request, folder, name, output)
            output.written([made.exr, made.png])
        output.end([], made.record["size"], made.record["samples"])


if __name__ == "__main__":
    streams.prepare()
    signals.watch()
    script(lambda: answer(lambda: run(sys.argv[1])))

# SPDX-License-Identifier: GPL-3.0-or-later
"""A job of the panel: requests as JSON, rendered with the progress of `nimray --progress`; run as a module of its own."""

from __future__ import annotations

import sys

from ..base import records, signals, streams
from . import answer, blender, script
from .act import carry_out, refused
from .compare import render_side_by_side
from .report import Output
from .words import UsageError


def run(text: str) -> None:
    """Render what a JSON text asks for; UsageError where it is not understood.

    requests: records of renders.request.Request, by the names of their images
    folder:   where to
    joined:   name of an image of all of them side by side, empty where there is to be none
    compared: what its record says, as for compare.render_side_by_side()
    captions: a line for each of them, below it in that image
    """
    blender.load()
    from ..renders.request import Request

    try:
        job = records.parse(text)
        asked, folder, joined, compared = (job[key] for key in ("requests", "folder", "joined", "compared"))
        captions = job["captions"]
    except (KeyError, ValueError):
        raise UsageError("the job is not understood.") from None
    with refused():
        requests = {name: Request.from_record(record, name) for name, record in asked.items()}
    with Output(len(requests), progress=True) as output:
        if joined:
            return render_side_by_side(requests, folder, joined, compared, output, captions)
        for name, request in requests.items():
            rendered = carry_out(request, folder, name, output)
            output.written([rendered.exr, rendered.png])
        output.end([], rendered.record["size"], rendered.record["samples"])


if __name__ == "__main__":
    streams.prepare()
    signals.watch()
    script(lambda: answer(lambda: run(sys.argv[1])))

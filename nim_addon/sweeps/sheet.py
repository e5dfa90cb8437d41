# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet of a sweep: its pictures, small, in rows, each with what was varied under it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..base.files import whole
from ..cycles.images import image_of, write_whole
from ..renders.montage import captioned, grid, letters
from . import results
from .plan import Task

FILE = "sheet.png"
WIDEST, WIDTH = 8192, 320  # pixels, of the sheet and of a picture in it
LEAST = 48  # of a picture
MOST = 2500  # pictures in it: of more, so many from all along the plan


def columns_of(pictures: Sequence[Task]) -> int:
    """How many columns suit the pictures: one for each value of what runs fastest, where these repeat, else a square."""
    count = len(pictures)
    if count and len(pictures[0].values) > 1:
        last = list(pictures[0].values)[-1]
        texts = [task.values.get(last) for task in pictures]
        period = next((place for place in range(1, count) if texts[place] == texts[0]), count)
        if (
            period * LEAST <= WIDEST
            and count % period == 0
            and all(texts[place] == texts[place % period] for place in range(count))
        ):
            return period
    return max(1, math.ceil(math.sqrt(count)))


def write(folder: str | Path, pictures: Sequence[Task]) -> Path:
    """Write sheet.png of the pictures of a plan that are done, or of MOST of them; returns the file."""
    import OpenImageIO as oiio

    if len(pictures) > MOST:
        pictures = [pictures[len(pictures) * place // MOST] for place in range(MOST)]
    columns = columns_of(pictures)
    width = min(WIDTH, WIDEST // columns)
    cells = [_cell(results.image_of(folder, task).with_suffix(".png"), task, width) for task in pictures]
    size = min(letters(*cell) for cell in cells)
    pixels = np.ascontiguousarray(grid([captioned(*cell, size=size) for cell in cells], columns))
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8)
    spec.attribute("png:compressionLevel", 2)  # a third of the time, a twentieth larger
    sheet = oiio.ImageBuf(spec)
    sheet.set_pixels(sheet.roi, pixels)
    return whole(Path(folder).expanduser() / FILE, lambda part: write_whole(sheet, part))


def _cell(png, task, width):
    """(H, W, 3) bytes of a picture in that width, a black field where it is not done, and the lines of its caption."""
    import OpenImageIO as oiio

    image = image_of(png) if png.is_file() else oiio.ImageBuf(oiio.ImageSpec(4, 3, 3, oiio.UINT8))
    spec = image.spec()
    height = max(1, round(width * spec.height / spec.width))
    # by a third of the usual filter's time, while everybody waits
    small = oiio.ImageBufAlgo.resize(image, filtername="triangle", roi=oiio.ROI(0, width, 0, height, 0, 1, 0, 3))
    lines = [f"{key} = {value}" for key, value in task.values.items()] or [task.title]
    return np.asarray(small.get_pixels(oiio.UINT8)), *lines

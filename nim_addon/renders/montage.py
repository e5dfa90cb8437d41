# SPDX-License-Identifier: GPL-3.0-or-later
"""Several renders side by side in one image."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..base.files import files_to
from ..cycles.images import image_of, write_with_metadata


def montage(folder: str | Path, name: str, images: Sequence[tuple[Path, Path]], metadata: dict) -> tuple[Path, Path]:
    """Write NAME.exr (linear) and NAME.png (as displayed): the images of equal size from left to right, a white gap between.

    images:   the pairs (exr, png) that render() returned
    metadata: JSON-ready dict that both carry, for read_metadata()
    Returns the paths (exr, png). They appear whole or not at all.
    """
    import OpenImageIO as oiio

    with files_to(folder, name, [".exr", ".png"]) as (part, finish):
        ready = []
        for files in zip(*images, strict=True):
            pictures = [image_of(file) for file in files]
            # bytes stay bytes, so that the PNG is exactly its parts
            form = pictures[0].spec().format
            rows = grid([np.asarray(picture.get_pixels(form)) for picture in pictures])
            height, width, channels = rows.shape
            joined = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, form))
            joined.set_pixels(joined.roi, rows)
            ready.append(part / f"ready{files[0].suffix}")
            write_with_metadata(joined, ready[-1], metadata)
        exr, png = finish(*ready)
        return exr, png


def grid(pictures: Sequence[np.ndarray], columns: int = 0) -> np.ndarray:
    """Pictures (H, W, C) of equal type in rows of `columns` (0: one row), a white gap between; the smaller are centred."""
    columns = columns or len(pictures)
    height, width = (max(picture.shape[axis] for picture in pictures) for axis in (0, 1))
    gap = max(2, width // 100)
    rows = -(-len(pictures) // columns)
    white = 255 if pictures[0].dtype == np.uint8 else 1
    size = rows * (height + gap) - gap, columns * (width + gap) - gap, pictures[0].shape[2]
    sheet = np.full(size, white, pictures[0].dtype)
    for place, picture in enumerate(pictures):
        row, column = divmod(place, columns)
        top = row * (height + gap) + (height - picture.shape[0]) // 2
        left = column * (width + gap) + (width - picture.shape[1]) // 2
        sheet[top : top + picture.shape[0], left : left + picture.shape[1]] = picture
    return sheet

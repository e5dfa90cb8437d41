# SPDX-License-Identifier: GPL-3.0-or-later
"""Several renders side by side in one image."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..base.files import files_to
from ..cycles.images import image_of, write_with_metadata

# Height of a caption's letters in parts of a picture's width, at most so many pixels; pixels around it; its colour.
LETTERS, LARGEST, MARGIN, INK = 0.052, 48, 6, (0.1, 0.1, 0.1)


def montage(
    folder: str | Path,
    name: str,
    images: Sequence[tuple[Path, Path]],
    metadata: dict,
    captions: Sequence[str] = (),
) -> tuple[Path, Path]:
    """Write NAME.exr (linear) and NAME.png (as displayed): the images of equal size from left to right, a white gap between.

    images:   the pairs (exr, png) that render() returned
    metadata: JSON-ready dict that both carry, for read_metadata()
    captions: a line for each image, on white below it; none if empty
    Returns the paths (exr, png). They appear whole or not at all.
    """
    import OpenImageIO as oiio

    with files_to(folder, name, [".exr", ".png"]) as (part, finish):
        ready = []
        for files in zip(*images, strict=True):
            pictures = [image_of(file) for file in files]
            # bytes stay bytes, so that the PNG is exactly its parts
            form = pictures[0].spec().format
            pixels = [np.asarray(picture.get_pixels(form)) for picture in pictures]
            if captions:
                size = min(map(letters, pixels, captions))
                pixels = [captioned(*one, size=size) for one in zip(pixels, captions, strict=True)]
            rows = grid(pixels)
            height, width, channels = rows.shape
            joined = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, form))
            joined.set_pixels(joined.roi, rows)
            ready.append(part / f"ready{files[0].suffix}")
            write_with_metadata(joined, ready[-1], metadata)
        exr, png = finish(*ready)
        return exr, png


def caption(variant: Sequence[str]) -> str:
    """The settings of a picture, texts "key=value", as its caption has them."""
    said = []
    for text in variant:
        value = text.partition("=")[2]
        # which parameter a medium is of shows the picture
        said.append(re.sub(r",\s*", ", ", (value if "=" in value else text).replace("=", " = ")))
    return ", ".join(said)


def letters(picture: np.ndarray, *lines: str) -> int:
    """The height, pixels, of the largest letters with which lines of text fit below a picture (H, W, C)."""
    width = picture.shape[1]
    size = max(9, min(round(LETTERS * width), LARGEST))
    # a letter of Open Image IO's own font is half as wide as it is high
    return max(7, min(size, *(int(2 * (width - 2 * MARGIN) / max(len(line), 1)) for line in lines)))


def captioned(picture: np.ndarray, *lines: str, size: int = 0) -> np.ndarray:
    """A picture (H, W, C), its pixels as they are, with lines of text on white below it, as large as they fit.

    size: of the letters, pixels, where others stand beside it, which have the same; 0: as they fit
    """
    import OpenImageIO as oiio

    _, width, channels = picture.shape
    size = size or letters(picture, *lines)
    form = oiio.UINT8 if picture.dtype == np.uint8 else oiio.FLOAT
    band = oiio.ImageBuf(oiio.ImageSpec(width, (size + MARGIN) * len(lines) + MARGIN, channels, form))
    oiio.ImageBufAlgo.fill(band, (1.0,) * channels)
    for place, line in enumerate(lines):
        ink = (*INK, 1.0)[:channels] if channels in (3, 4) else (INK[0],) * channels
        oiio.ImageBufAlgo.render_text(band, MARGIN, (size + MARGIN) * (place + 1), line, size, "", ink)
    return np.concatenate([picture, np.asarray(band.get_pixels(form)).astype(picture.dtype)])


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

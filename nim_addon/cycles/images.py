# SPDX-License-Identifier: GPL-3.0-or-later
"""Image files that carry what made them, read and written whole or not at all."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ..base import records
from ..base.files import is_full
from ..base.streams import quiet

if TYPE_CHECKING:
    import OpenImageIO as oiio

# The attribute of our images that holds, as JSON, everything that made them.
RECORD_ATTRIBUTE = "nimray"
WIDEST = 1 << 20  # pixels, of an image that can be ours


def named(path: Path) -> str:
    """The name of a file as OpenImageIO takes it; OSError, one sentence, for one that it cannot take."""
    try:
        return os.fsencode(path).decode()  # where the system's letters are not UTF-8, Python's path has none of them
    except UnicodeDecodeError:
        raise OSError(f"{path} has a name that is not in UTF-8, as those of images must be; name another.") from None


def image_of(path: Path) -> oiio.ImageBuf:
    """The OpenImageIO.ImageBuf of a file."""
    import OpenImageIO as oiio

    return oiio.ImageBuf(named(path))


def read(path: Path) -> oiio.ImageBuf:
    """The OpenImageIO.ImageBuf of a file that was just written, seen to be whole; OSError, one sentence, where it is not."""
    with quiet(2):  # OpenEXR complains there by itself
        image = image_of(path)
        whole = image.initialized and image.read(force=True)
    if image.geterror() or not whole:
        raise cut_off(path)
    return image


def cut_off(path: Path) -> OSError:
    """What to raise where a file could not be written whole."""
    return OSError(f"cannot write the {path.suffix} file whole; see whether the disk is full, or name another folder.")


def write_whole(image: oiio.ImageBuf, target: Path) -> str | None:
    """Write an OpenImageIO.ImageBuf to the Path `target`; returns the text of the record in it, None where it is too large.

    Raises OSError, one sentence, where it could not be written whole.
    """
    import OpenImageIO as oiio

    with quiet(2):  # OpenEXR complains there by itself
        written = image.write(named(target))
        error = image.geterror() or oiio.geterror()  # else it is printed
    if error or not written:
        raise cut_off(target)
    # which says True on a full disk, too, and drops what a PNG is too small for
    carried, whole = _record_in(target)
    if not whole:
        raise cut_off(target)
    return carried


def write_with_metadata(image: oiio.ImageBuf, target: Path, metadata: dict) -> None:
    """Write an OpenImageIO.ImageBuf to the Path `target`, with the dict that read_metadata() gives back.

    Raises OSError, one sentence, where it could not be written whole, ValueError where it cannot carry that dict.
    """
    record = json.dumps(metadata)
    image.specmod().attribute(RECORD_ATTRIBUTE, record)
    maker = ascii(metadata.get("nimray", ""))[:99].strip("'")
    image.specmod().attribute("Software", f"nimray {maker}, Blender {bpy.app.version_string}")
    if write_whole(image, target) != record and not is_full(target.parent):
        size = f"{len(record) / 1e6:.3g} million letters"
        raise ValueError(f"metadata of {size} is more than a {target.suffix} can carry; leave some of it out.")


def _record_in(path):
    """The text of the record in an image file, and whether the file is whole: "" where it has none, None for no image.

    It is read by and by: it may be large, or claim to be.
    """
    import OpenImageIO as oiio

    with quiet(2):  # OpenEXR complains there by itself
        image = oiio.ImageInput.open(named(path))
        try:
            if not image:
                oiio.geterror()  # else it is printed, on standard output, into --json and --progress
                return None, False
            spec = image.spec()
            text = spec.get_string_attribute(RECORD_ATTRIBUTE)
            if spec.width > WIDEST:
                return text, False
            step, end = max(1, (1 << 26) // spec.scanline_bytes()), spec.y + spec.height
            whole = all(
                image.read_scanlines(0, 0, top, min(top + step, end), 0, 0, spec.nchannels) is not None
                for top in range(spec.y, end, step)
            )
            return text, not image.geterror() and whole
        except UnicodeDecodeError:  # in what it carries, or in what is said of it
            return None, False


def record_of(exr: str | Path) -> dict | None:
    """The metadata dict that an EXR and the PNG beside it share, both whole; None where there is no such pair."""
    exr = Path(exr)
    try:
        record = read_metadata(exr)
        return record if read_metadata(exr.with_suffix(".png")) == record else None
    except (ValueError, FileNotFoundError):
        return None


def read_metadata(path: str | Path) -> dict:
    """The metadata dict of an image that write_with_metadata() wrote.

    Raises FileNotFoundError, or ValueError in one sentence for a file that is not an image, is truncated, or is not ours.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}.")
    text, whole = _record_in(path)
    # a header can be whole where the pixels are not
    if not whole and text != "":
        raise ValueError(f"{path} is not a whole image: it may be cut off, or not an image at all; render it again.")
    try:
        return records.parse(text)
    except ValueError:
        raise ValueError(f"{path} was not made by nimray: it carries no record of scene and parameters.") from None


def check_metadata(metadata: dict, part: Path) -> None:
    """Raise ValueError, one sentence, where an image, of which two are tried in the folder `part`, cannot carry them."""
    import OpenImageIO as oiio

    try:
        if not isinstance(metadata, dict):
            raise TypeError("it is no dict")
        json.dumps(metadata)
    except (TypeError, ValueError, RecursionError) as error:
        reason = "it is nested too deep" if isinstance(error, RecursionError) else error
        raise ValueError(f"metadata cannot be written as JSON ({reason}); give a dict of plain values.") from None
    for suffix, form in ((".exr", oiio.FLOAT), (".png", oiio.UINT8)):
        tried = part / f"tried{suffix}"
        write_with_metadata(oiio.ImageBuf(oiio.ImageSpec(1, 1, 3, form)), tried, metadata)
        tried.unlink()

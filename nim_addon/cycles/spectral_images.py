# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral images: OpenEXR files with a channel for each wavelength, as other renderers read and write them.

The layout is that of Fichet, Pacanowski and Wilkie 2021, "An OpenEXR Layout for Spectral Images", JCGT 10(3): the radiance
at 450 nm is the channel "S0.450,000000nm" (S0: what the light carries, whatever its polarisation; a comma, since a full stop
parts layers), two attributes say which layout it is and in what unit; R, G and B are for programs that know no spectra.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import images

LAYOUT, UNITS = {"spectralLayoutVersion": "1.0"}, {"emissiveUnits": "W.m^-2.sr^-1.nm^-1"}
# What others may write, too: a number with or without its comma or exponent, and a length with a prefix.
_CHANNEL = re.compile(r"S0\.(\d*,?\d*(?:[Ee][+-]?\d+)?)(da|[YZEPTGMkhdcmunp])?m")
_PREFIXES = {"p": 1e-3, "n": 1.0, "u": 1e3, "m": 1e6, "c": 1e7, "d": 1e8, None: 1e9}  # nanometres


class SpectralImage(NamedTuple):
    """What a spectral image holds, the first row at the top.

    wavelengths_nm: (N,), rising
    radiance:       (height, width, N) for each of them, per nanometre
    rgb:            (height, width, 3) linear sRGB, or None where the file has none
    """

    wavelengths_nm: NDArray
    radiance: NDArray
    rgb: NDArray | None


def channel_of(wavelength_nm: float) -> str:
    """The name of the channel of a wavelength."""
    return "S0." + f"{wavelength_nm:.6f}nm".replace(".", ",")


def write(file: Path, wavelengths_nm: ArrayLike, radiance: ArrayLike, rgb: ArrayLike) -> None:
    """Write a SpectralImage of these parts to a file; OSError, one sentence, where it could not be written whole."""
    import OpenImageIO as oiio

    pixels = np.concatenate([np.asarray(rgb), np.asarray(radiance)], axis=-1).astype(np.float32)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT)
    spec.channelnames = (*"RGB", *map(channel_of, np.asarray(wavelengths_nm, float)))
    for name, value in {**LAYOUT, **UNITS}.items():
        spec.attribute(name, value)
    image = oiio.ImageBuf(spec)
    image.set_pixels(image.roi, pixels)
    if not image.write(images.named(file)):
        raise images.cut_off(file)


def read(file: str | Path) -> SpectralImage:
    """The SpectralImage of a file, also of one that another program wrote.

    Raises FileNotFoundError, or ValueError in one sentence for a file that is no image, or has no wavelengths.
    """
    import OpenImageIO as oiio

    file = Path(file)
    if not file.is_file():
        raise FileNotFoundError(f"there is no file {file}.")
    try:
        image = images.read(file)
    except OSError:
        raise ValueError(f"{file} is not a whole image.") from None
    names = list(image.spec().channelnames)
    places = sorted((nm, place) for place, name in enumerate(names) if (nm := _wavelength(name)) is not None)
    if not places:
        raise ValueError(f"{file} is no spectral image: no channel of it is a wavelength's, such as {channel_of(550)}.")
    pixels = image.get_pixels(oiio.FLOAT)
    has_colour = all(channel in names for channel in "RGB")
    return SpectralImage(
        np.array([nm for nm, _ in places]),
        pixels[..., [place for _, place in places]],
        pixels[..., [names.index(channel) for channel in "RGB"]] if has_colour else None,
    )


def _wavelength(channel):
    """The wavelength, nm, of a channel's name; None for another channel."""
    found = _CHANNEL.fullmatch(channel)
    if not found or found[2] not in _PREFIXES:
        return None
    try:
        return float(found[1].replace(",", ".")) * _PREFIXES[found[2]]
    except ValueError:  # no digits
        return None

# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture in parts: ranges of its samples, rendered anywhere, and their mean, which is the picture.

A part is an EXR of the passes of a range, with their noise; the mean is of double precision, weighted by the ranges'
lengths, and is cleaned of noise where that is asked for, as the whole would be.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base.files import whole
from ..cycles import denoising, images, render, settings, spectral_picture
from ..cycles.render import Progress, layers_of, write_linear, write_shown
from ..cycles.spectral_picture import guided
from ..physics import colour
from .asked import known
from .session import Rendered, Session


class Part(NamedTuple):
    """Samples of a picture: the first, from 0, and how many."""

    first: int
    count: int


def render_part(session: Session, part: Part, file: Path, photons: Path, progress: Progress | None = None) -> None:
    """Render a range of the samples of what a session is of to an EXR of its passes.

    photons: where a bake that is killed keeps what it has traced
    Raises as Session.render() does.
    """
    request, scene = session.request, session.scene
    samples = known(request.samples)
    with bpy.context.temp_override(scene=scene):
        session.check()
        if request.caustics == "traced":
            session.bake(photons)
        scene.cycles.seed = known(request.seed)
        with guided(scene, scene.cycles.use_denoising), settings.samples_kept(scene):
            settings.sample_range(scene, part.first, part.count, samples)
            layers = layers_of(scene, progress)
    whole(file, lambda path: _write(path, layers))


def merge(session: Session, parts: Mapping[Part, Path], folder: Path, name: str) -> Rendered:
    """The picture that a session is of, from parts that cover its samples, as Session.render() leaves it.

    Raises ValueError, one sentence, where they leave a gap or overlap, and for a file that is no such part.
    """
    request, scene = session.request, session.scene
    _check_covered(sorted(parts), known(request.samples))

    def draw(scene, linear, shown, _progress):
        layers = _mean(parts)
        noisy = layers["Combined"]
        denoised = spectral_picture.denoised if request.spectral else denoising.denoised
        clean = denoised(layers) if request.denoise else noisy
        write_linear(linear, noisy if request.keep_noise else clean)
        write_shown(scene, shown, colour.into_gamut(clean) if request.spectral else clean)

    record = request.record()
    exr, png = render.render(scene, folder, name, metadata=record, drawing=draw)
    return Rendered(exr, png, record, False)


def _check_covered(parts, samples):
    end = 0
    for first, count in parts:
        if first != end:
            what = f"samples {end} to {first - 1} are missing" if first > end else f"sample {first} is there twice"
            raise ValueError(f"the parts do not make the picture: {what}.")
        end = first + count
    if end != samples:
        raise ValueError(f"the parts do not make the picture: samples {end} to {samples - 1} are missing.")


def _write(path, layers):
    import OpenImageIO as oiio

    pixels = np.concatenate(list(layers.values()), axis=2)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT)
    spec.channelnames = tuple(f"{name}.{place}" for name, layer in layers.items() for place in range(layer.shape[2]))
    image = oiio.ImageBuf(spec)
    image.set_pixels(image.roi, np.ascontiguousarray(pixels, np.float32))
    images.write_whole(image, path)


def _mean(parts: Mapping[Part, Path]) -> dict[str, NDArray]:
    """The mean of the passes of parts, by their names, each weighted by its samples."""
    import OpenImageIO as oiio

    samples = sum(part.count for part in parts)
    total: dict[str, NDArray] = {}
    for part, file in sorted(parts.items()):
        image = images.image_of(file)
        if not image.read(force=True):
            raise ValueError(f"{file} is no part of a picture, or not whole; render it again.")
        pixels = image.get_pixels(oiio.FLOAT).astype(float) * (part.count / samples)
        places: dict[str, list[int]] = {}
        for place, channel in enumerate(image.spec().channelnames):
            places.setdefault(channel.rpartition(".")[0], []).append(place)
        for name, where in places.items():
            total[name] = total.get(name, 0) + pixels[..., where]
    return total

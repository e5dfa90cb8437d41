# SPDX-License-Identifier: GPL-3.0-or-later
"""A stack: one render for each of some wavelengths, together a spectral image, and the spectrum of a part of it."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base.files import check_name, check_targets, whole, writable_folder
from ..base.options import MOST_SAMPLES, MOST_WAVELENGTHS
from ..base.text import counted
from ..cycles import render, settings, spectral, spectral_images, wavelength
from ..cycles.spectral_picture import part_of
from ..physics import colour
from .asked import Asked, known
from .session import Session, Showing, Tracing
from .values import CHECKS

BATCHES = 4  # parts of the samples of a wavelength, whose differences tell the error of their mean
SEQUENCE = 1 << 24  # samples, the longest that Cycles has


class Region(NamedTuple):
    """A part of a picture in pixels, `x` and `y` counted from 0 at its top left."""

    x: int
    y: int
    width: int = 1
    height: int = 1


class Stacked(NamedTuple):
    """The files of a stack, spectral and as displayed, the table where one was asked for, and what made them."""

    exr: Path
    png: Path
    csv: Path | None
    record: dict


class Line(NamedTuple):
    """What a region sends at one wavelength: the mean of its pixels, with its standard error, and as a part of white's."""

    wavelength_nm: float
    radiance: float
    standard_error: float
    of_white: float


@dataclass(frozen=True)
class Stack:
    """One render of what a request asks for at each of N wavelengths, nanometres, in any order; of a region also a table.

    Raises ValueError, one sentence, for what no stack has.
    """

    request: Asked
    wavelengths: tuple[float, ...]
    region: Region | None = None

    def __post_init__(self) -> None:
        found = _checked(self.wavelengths)
        object.__setattr__(self, "wavelengths", found)
        if self.request.spectral or self.request.wavelength is not None:
            raise ValueError("a stack renders one wavelength at a time; leave spectral, and a single wavelength, out.")
        if self.region is not None:
            object.__setattr__(self, "region", self._inside(self.region))
        if known(self.request.samples) * len(found) > SEQUENCE:
            most = min(MOST_SAMPLES, SEQUENCE // len(found))
            raise ValueError(
                f"{self.request.samples} samples at each of {len(found)} wavelengths are too many; {most} are the most."
            )

    def _inside(self, region):
        width, height = known(self.request.size)
        try:
            part = Region(*(CHECKS["frame"]("region", number) for number in region))
        except (TypeError, ValueError):
            raise ValueError(f"region = {region!r} is none; give x, y, width and height in pixels.") from None
        if not (part.width and part.height and part.x + part.width <= width and part.y + part.height <= height):
            raise ValueError(
                f"the region of {part.width} x {part.height} pixels at {part.x}, {part.y} is not within the picture of "
                f"{width} x {height}; x and y count from 0 at the top left."
            )
        if self.request.denoise:
            raise ValueError("a table tells how noisy a mean is, which is lost where noise is cleaned; leave one out.")
        if known(self.request.samples) % 2:
            raise ValueError("a table compares parts of the samples; take an even number of them.")
        return part

    def record(self) -> dict:
        """The record of its image: the request's, with the wavelengths, and the region where there is one."""
        more = {} if self.region is None else {"region": list(self.region)}
        return {**self.request.record(), "wavelengths": list(self.wavelengths), **more}

    @classmethod
    def again(cls, request: Asked, record: dict) -> Stack:
        """The stack of which an image has the record(), of the request as it is to be."""
        return cls(request, record["wavelengths"], record.get("region"))

    def render(
        self,
        folder: str | Path,
        name: str,
        *,
        showing: Showing | None = None,
        tracing: Tracing | None = None,
        before: Callable[[Session], object] | None = None,
    ) -> Stacked:
        """Render it to NAME.exr, a spectral image, NAME.png, as displayed, and NAME.csv where there is a region.

        folder, name, showing, tracing: as for session.Session.render(); caustics are traced at each wavelength anew
        before: called with the session before anything is rendered
        Raises as that does.
        """
        check_name(name)
        with Session(self.request) as session:
            if before:
                before(session)
            request, scene = session.request, session.scene
            stack = dataclasses.replace(self, request=request)
            with bpy.context.temp_override(scene=scene):
                session.check()
                scene.cycles.seed = request.seed
                folder = writable_folder(folder)
                table = folder / f"{name}.csv" if self.region else None
                check_targets([table] if table else [])
                sheets = _Sheets(stack, session, folder / f".{name}.photons", tracing)
                samples = known(request.samples) * len(self.wavelengths)
                with showing(name, samples) if showing else nullcontext() as progress:
                    record = stack.record()
                    exr, png = render.render(
                        scene, folder, name, metadata=record, progress=progress, drawing=sheets.draw
                    )
                if table:
                    whole(table, lambda part: part.write_text(csv(sheets.lines), encoding="ascii"))
        return Stacked(exr, png, table, record)


def _checked(wavelengths):
    try:
        found = tuple(sorted(CHECKS["wavelength"]("wavelength", value) for value in wavelengths))
    except TypeError:
        raise ValueError(f"wavelengths = {wavelengths!r} are none; give some, in nanometres.") from None
    if not 2 <= len(found) <= MOST_WAVELENGTHS:
        count = counted(len(found), "wavelength")
        raise ValueError(
            f"a stack of {count} is none that can be made; give 2 to {MOST_WAVELENGTHS}, such as 400:700:10."
        )
    for one, other in itertools.pairwise(found):
        if other - one < 1e-4:
            raise ValueError(f"the wavelength {one:g} is there twice; give each once.")
    return found


def csv(lines: Sequence[Line]) -> str:
    """The text of a table of Lines, comma-separated."""
    rows = [
        f"{line.wavelength_nm:.10g},{line.radiance:.9g},{line.standard_error:.4g},{line.of_white:.9g}" for line in lines
    ]
    return "\n".join([",".join(Line._fields), *rows]) + "\n"


class _Sheets:
    """What renders the wavelengths one after the other, each a range of one sequence of samples, and joins them."""

    def __init__(self, stack: Stack, session: Session, photons: Path, tracing: Tracing | None):
        self.stack, self.session, self.photons, self.tracing = stack, session, photons, tracing
        self.lines: list[Line] = []

    def draw(self, scene, linear, shown, progress) -> None:
        """Render the scene at each wavelength, as a render.Drawing does."""
        wavelengths = np.array(self.stack.wavelengths)
        weights, daylight = preview_weights(wavelengths), colour.daylight(wavelengths)
        shares, radiance, rgb = colour.shares_of(wavelengths), [], 0.0
        former = wavelength.neutral()
        try:
            for index, nm in enumerate(wavelengths.tolist()):
                spectral.set_neutral(nm)
                if self.session.request.caustics == "traced":
                    self.session.bake(self.photons, self.tracing)
                pixels, error = self._sheet(scene, index, shares[index], progress)
                rgb = rgb + pixels * weights[index] / len(wavelengths)
                sent = pixels @ shares[index] * daylight[index]
                radiance.append(sent.astype(np.float32))
                if self.stack.region:
                    mean = float(_part(sent, self.stack.region).mean())
                    self.lines.append(Line(nm, mean, error * daylight[index], mean / daylight[index]))
        finally:
            spectral.set_neutral(former)
        spectral_images.write(linear, wavelengths, np.stack(radiance, axis=-1), rgb)
        render.write_shown(scene, shown, colour.into_gamut(rgb))

    def _sheet(self, scene, index, shares, progress):
        """The picture (height, width, 3) at one wavelength, and the standard error of the region's mean of white's light."""
        samples, count = scene.cycles.samples, len(self.stack.wavelengths)
        batches = 1 if self.stack.region is None else BATCHES if samples % BATCHES == 0 else 2
        length, parts = samples // batches, []
        with settings.samples_kept(scene):
            for batch in range(batches):
                settings.sample_range(scene, index * samples + batch * length, length, count * samples)
                report = part_of(progress, index * batches + batch, count * batches)
                parts.append(render.layers_of(scene, report)["Combined"])
        if batches == 1:
            return parts[0], 0.0
        sent = np.stack([_part(part @ shares, known(self.stack.region)) for part in parts])
        errors = sent.var(axis=0, ddof=1) / batches  # of each pixel's mean; their noise is independent
        return np.mean(parts, axis=0), float(np.sqrt(errors.sum()) / errors.size)


def _part(picture: NDArray, region: Region) -> NDArray:
    return picture[region.y : region.y + region.height, region.x : region.x + region.width]


def preview_weights(wavelengths: NDArray) -> NDArray:
    """What each of N wavelengths (N,) adds to linear sRGB, (N, 3), whose mean is the picture: white of all is white.

    Where they make no white together, as two lines of red do not, it is their own colour, of luminance 1.
    """
    try:
        return colour.weights_of(wavelengths)
    except ValueError:
        lit = (colour.daylight(wavelengths) * colour.spans_of(wavelengths))[:, None]
        seen = colour.colour_matching(wavelengths) * lit
        return colour.xyz_to_srgb(seen / seen[:, 1].mean())

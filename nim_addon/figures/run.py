# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a figure: its images, as far as they are not there yet, its sheet, its claims, and the index beside them."""

from __future__ import annotations

import json
import time
from pathlib import Path

import bpy
import numpy as np

from ..base.files import check_targets, files_to, sweep, writable_folder
from ..base.version import VERSION
from ..cycles.images import image_of, record_of, write_with_metadata
from ..cycles.material import resolve
from ..renders import changes, montage
from ..renders.request import Request, Session, Showing, can_denoise
from ..scenes import scene_type
from . import index
from .measure import Camera
from .recipes import Figure, Image, Recipe

TEXELS = 1024, 2048  # of baked caustics, at draft and at final quality
FAR = 1000  # between the seeds of renders with caustics, as each of several lamps takes one of those that follow


def make(
    figure: Figure, folder: str | Path, quality: str = "draft", *, backend: str = "auto", showing: Showing | None = None
) -> dict:
    """Render and measure a recipes.Figure; returns the record that FOLDER/figure-NUMBER.json holds.

    folder:  where to: images go to FOLDER/NUMBER/, the sheet to FOLDER/figure-NUMBER.png, and index.html is written anew
    quality: "draft" or "final"
    backend: of the materials, as material.resolve takes it
    showing: None, or a function (name, samples) that returns a context manager, which gives render()'s progress
    An image that is there, whole, and was made of the same is not rendered again. Raises OSError where the folder cannot
    be written, or holds what another version made, an index.html or a record that is not ours, or, for a draft, the
    figure at final quality; nothing of that is touched.
    """
    folder = writable_folder(folder)
    index.check(folder)
    check_targets([folder / f"figure-{figure.number}{suffix}" for suffix in (".json", ".png")])
    check_records(folder, figure)
    if quality == "draft":
        check_draft(folder, figure)
    started = time.monotonic()
    backend = resolve(backend)
    images, shown, names = {}, [], []
    for recipe in figure.recipes:
        files = _files(recipe, folder / figure.number)
        images[recipe.name] = _image(recipe, files, quality, backend, showing)
        names += [file.stem for file in files]
        if recipe.shown:
            shown.append((recipe, files[0].with_suffix(".png")))
    if figure.draw:
        drawn = _drawn(figure, folder / figure.number)
        picture = drawn[0]
        names += [file.name for file in drawn]
    else:
        picture = _sheet(figure, folder, [file for _, file in shown])
    claims = figure.measure(images)
    record = {
        "nimray": VERSION,
        "blender": bpy.app.version_string,
        "backend": backend,
        "figure": figure.number,
        "title": figure.title,
        "shows": figure.shows,
        "must_hold": list(figure.must_hold),
        "quality": quality,
        "picture": picture.relative_to(folder).as_posix(),
        "parts": [[recipe.caption, file.relative_to(folder).as_posix()] for recipe, file in shown],
        "images": names,
        "holds": all(claim.holds for claim in claims),
        "claims": [
            {key: _plain(value) for key, value in claim._asdict().items()} | {"holds": claim.holds} for claim in claims
        ],
        "seconds": round(time.monotonic() - started, 1),
    }
    with files_to(folder, f"figure-{figure.number}") as (part, finish):
        (part / "record.json").write_text(json.dumps(record, indent=2), encoding="utf-8")
        finish(part / "record.json")
    index.write(folder)
    return record


def check_records(folder: Path, figure: Figure) -> None:
    """Raise OSError, one sentence, where a folder holds a figure of another version or what is no record of a figure.

    A damaged record of `figure` itself passes, as it is written anew.
    """
    for file in sorted(folder.glob("figure-*.json")):
        try:
            version = index.read(file)["nimray"]
        except ValueError as error:
            if file.name == f"figure-{figure.number}.json":
                continue
            raise OSError(str(error)) from None
        if version != VERSION:
            raise OSError(
                f"{file} was made by nimray {version}, and this is {VERSION}; its files are kept: name another folder."
            )


def check_draft(folder: Path, figure: Figure) -> None:
    """Raise OSError, one sentence, where a draft of a figure would replace what a folder holds of it at final quality."""
    finer = [recipe for recipe in figure.recipes if _effort(recipe, "final") != _effort(recipe, "draft")]
    final = finer and _quality(folder / f"figure-{figure.number}.json") == "final"
    # of a run that was killed only the images tell
    if final or any(_is_final(recipe, file) for recipe in finer for file in _files(recipe, folder / figure.number)):
        raise OSError(
            f"{folder} holds figure {figure.number} at final quality; it is kept: name another folder, or add "
            "--quality final."
        )


def _quality(file):
    """Of the figure that a record is of; None where there is none."""
    try:
        return index.read(file)["quality"]
    except (ValueError, FileNotFoundError):
        return None


def _is_final(recipe, file):
    record, effort = _own_record(file), _effort(recipe, "final")
    return record is not None and {key: record.get(key) for key in effort} == effort


def _plain(value):
    return value if isinstance(value, str) else float(value)


def _files(recipe, folder):
    """The EXR files of a recipe in the folder of its figure, one for each seed."""
    names = [recipe.name] if recipe.seeds == 1 else [f"{recipe.name}.{seed}" for seed in range(recipe.seeds)]
    # what is only measured is kept out of the way
    return [(folder if recipe.shown else folder / "measured") / f"{name}.exr" for name in names]


def _effort(recipe, quality):
    """What the quality decides in the record of an image."""
    size, samples = recipe.frame(quality)
    photons = recipe.photons and recipe.photons[quality == "final"]
    return {"size": list(size), "samples": samples, "photons": photons}


def _image(recipe, files, quality, backend, showing):
    """The Image of a recipe, whose EXR files are rendered where they are missing."""
    request = request_of(recipe, quality, backend=backend)
    seeds = [seed * (FAR if recipe.photons else 1) for seed in range(recipe.seeds)]
    with Session(request, persistent=recipe.seeds > 1) as session:
        for seed, file in zip(seeds, files, strict=True):
            sweep(file.parent)
            _own_record(file)
            session.render(file.parent, file.stem, seed=seed, showing=showing)
    pose = recipe.pose or scene_type(request.scene, of_figures=True).pose(request.parameters)
    return Image(np.stack([_pixels(file) for file in files]), Camera(*pose, request.size), request.parameters)


def request_of(recipe: Recipe, quality: str = "draft", *, backend: str = "auto") -> Request:
    """The request of a recipe at a quality, "draft" or "final", for its first seed."""
    size, samples = recipe.frame(quality)
    final, denoise = quality == "final", recipe.shown and can_denoise()
    traced = {"photons": recipe.photons[final], "texels": TEXELS[final]} if recipe.photons else {}
    return Request(
        recipe.scene,
        scene_type(recipe.scene, of_figures=True).parameters.read(recipe.settings),
        size=size,
        samples=samples,
        backend=backend,
        denoise=denoise,
        keep_noise=denoise,  # in the EXR, which is measured; only the PNG goes without
        caustics="traced" if recipe.photons else "path",
        spectral=recipe.spectral,
        wavelength=recipe.wavelength,
        pose=recipe.pose,
        change=recipe.change and changes.name_of(recipe.change),
        code=changes.code_mark(changed=bool(recipe.change)),
        **traced,
    )


def _own_record(file):
    """The record of an image that is there, both files whole, else None; OSError where another version made it."""
    record = record_of(file)
    if record is not None and record.get("nimray") != VERSION:
        raise OSError(
            f"{file} was made by nimray {record.get('nimray')}, and this is {VERSION}; it is kept: name another folder."
        )
    return record


def _pixels(file):
    import OpenImageIO as oiio

    return image_of(file).get_pixels(oiio.FLOAT)[..., :3]


def _sheet(figure, folder, files):
    import OpenImageIO as oiio

    pictures = [image_of(file).get_pixels(oiio.UINT8)[..., :3] for file in files]
    pixels = np.ascontiguousarray(montage.grid(pictures, figure.columns))
    sheet = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8))
    sheet.set_pixels(sheet.roi, pixels)
    with files_to(folder, f"figure-{figure.number}") as (part, finish):
        record = {"nimray": VERSION, "figure": figure.number, "images": [file.stem for file in files]}
        write_with_metadata(sheet, part / "sheet.png", record)
        return finish(part / "sheet.png")[0]


def _drawn(figure, folder):
    """The files that a figure draws, moved into `folder` once all are there."""
    with files_to(folder, "drawing") as (part, finish):
        try:
            return finish(*map(Path, figure.draw(part)), own=True)
        except OSError as error:  # of the folder that a person knows
            if error.errno is None:  # a sentence
                raise OSError(str(error).replace(str(part), str(folder))) from None
            raise

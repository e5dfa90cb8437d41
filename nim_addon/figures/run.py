# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a figure: its images, as far as they are not there yet, its sheet, its claims, and the index beside them."""

import contextlib
import functools
import hashlib
import json
import time
from pathlib import Path

import bpy
import numpy as np

from .. import caustics
from ..base.files import check_targets, files_to, sweep, writable_folder
from ..base.version import VERSION
from ..cycles import render
from ..cycles.closures import INTERFACE
from ..cycles.material import resolve
from ..renders import montage
from ..scenes import scene_type
from ..scenes.stage import aim
from . import index
from .measure import Camera
from .recipes import Image

PACKAGE = Path(__file__).resolve().parents[1]

TEXELS = 1024, 2048  # of baked caustics, at draft and at final quality


def make(figure, folder, quality="draft", *, backend="auto", showing=None):
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
    images, shown, made = {}, [], []
    for recipe in figure.recipes:
        files = _files(recipe, folder / figure.number)
        images[recipe.name] = _image(recipe, files, quality, backend, showing)
        made += [file.stem for file in files]
        if recipe.shown:
            shown.append((recipe, files[0].with_suffix(".png")))
    if figure.draw:
        drawn = _drawn(figure, folder / figure.number)
        picture = drawn[0]
        made += [file.name for file in drawn]
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
        "images": made,
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


def check_records(folder, figure):
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


def check_draft(folder, figure):
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
    record, effort = _made(file), _effort(recipe, "final")
    return record is not None and {key: record.get(key) for key in effort} == effort


def _plain(value):
    return value if isinstance(value, str) else float(value)


@functools.cache  # the code that runs is the one that was there first
def _code(*parts):
    """A mark of the code in some folders of PACKAGE: an image that other code made is rendered again."""
    text = [file.read_bytes() for part in parts for file in sorted((PACKAGE / part).glob("*.py"))]
    return hashlib.sha256(b"".join([*text, INTERFACE.source().encode()])).hexdigest()[:16]


def _change(function):
    """A mark of a recipe's change: its name and all code of the figures, as it may call any of it."""
    return None if function is None else f"{function.__qualname__} {_code('figures')}"


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
    kind = scene_type(recipe.scene, of_figures=True)
    parameters = kind.parameters.read(recipe.settings)
    pose = recipe.pose or kind.pose(parameters)
    size, samples = recipe.frame(quality)
    denoise = recipe.shown and _can_denoise()
    effort = _effort(recipe, quality)
    scene = None
    for folder in {file.parent for file in files}:
        sweep(folder)
    for seed, file in enumerate(files):
        folder, name = file.parent, file.stem
        wanted = {
            "nimray": VERSION,
            "scene": kind.name,
            "parameters": parameters.plain(),
            **effort,
            "seed": seed,
            "denoise": denoise,
            "backend": backend,
            "blender": bpy.app.version_string,
            "pose": [pose.eye, pose.target, pose.field_of_view, pose.fit],
            "change": _change(recipe.change),
            "code": _code("physics", "cycles", "caustics", "scenes"),
        }
        wanted = json.loads(json.dumps(wanted))  # as it comes back from a file
        if _made(file) != wanted:
            if scene is None:
                scene = _built(kind, parameters, recipe, pose, size, samples, denoise, backend)
            scene.cycles.seed = seed
            if effort["photons"]:
                writable_folder(folder)
                texels = TEXELS[quality == "final"]
                store = folder / f".{name}.photons"
                caustics.bake(scene, photons=effort["photons"], texels=texels, seed=1000 * seed, file=store)
            with showing(name, samples) if showing else contextlib.nullcontext() as progress:
                render.render(scene, folder, name, metadata=wanted, progress=progress)
    if scene is not None:
        _discard(scene)
    each = np.stack([_pixels(file) for file in files])
    return Image(each, Camera(*pose, tuple(size)), parameters)


def _built(kind, parameters, recipe, pose, size, samples, denoise, backend):
    scene = kind.build(parameters, backend)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.cycles.samples = samples
    scene.cycles.use_denoising = denoise
    # the noise stays in the EXR, which is measured; only the PNG goes without
    scene.view_layers[0].cycles.denoising_store_passes = denoise
    scene.render.use_persistent_data = recipe.seeds > 1
    aim(scene.camera, *pose)
    if recipe.change:
        recipe.change(scene)
    return scene


def _discard(scene):
    """Remove a scene and its objects: what a recipe changed in it must not reach the next one, nor must its names."""
    caustics.clear(scene)
    bpy.data.batch_remove([*scene.collection.all_objects, *scene.collection.children_recursive])
    bpy.data.scenes.remove(scene)


def _can_denoise():
    import _cycles

    return _cycles.with_openimagedenoise


def _made(file):
    """The record of an image that is there, both files whole, else None; OSError where another version made it."""
    record = render.record_of(file)
    if record is not None and record.get("nimray") != VERSION:
        raise OSError(
            f"{file} was made by nimray {record.get('nimray')}, and this is {VERSION}; it is kept: name another folder."
        )
    return record


def _pixels(file):
    import OpenImageIO as oiio

    return render.image_of(file).get_pixels(oiio.FLOAT)[..., :3]


def _sheet(figure, folder, files):
    import OpenImageIO as oiio

    pictures = [render.image_of(file).get_pixels(oiio.UINT8)[..., :3] for file in files]
    pixels = np.ascontiguousarray(montage.grid(pictures, figure.columns))
    sheet = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8))
    sheet.set_pixels(sheet.roi, pixels)
    with files_to(folder, f"figure-{figure.number}") as (part, finish):
        record = {"nimray": VERSION, "figure": figure.number, "images": [file.stem for file in files]}
        render.write_with_metadata(sheet, part / "sheet.png", record)
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

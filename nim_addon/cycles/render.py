# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless render: linear EXR and display PNG that carry what made them, never half written."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base.files import files_to, temporary
from ..base.signals import atomic
from ..base.streams import quiet
from . import images

# What is called as Cycles goes on: with the samples done, those in all, and the seconds left or None.
Progress = Callable[[int, int, float | None], object]
# What renders a scene and writes two files, the linear EXR and the PNG as displayed, calling a Progress.
Drawing = Callable[[bpy.types.Scene, Path, Path, Progress | None], object]


@contextlib.contextmanager
def _reporting(progress):
    """Call a Progress, or None, as Cycles reports."""

    def report(stats, _=None):
        done = re.search(r"Sample (\d+)/(\d+)", stats)
        if done:
            left = re.search(r"Remaining:(?:(\d+):)?(\d+):([\d.]+)", stats)
            hours, minutes, seconds = left.groups() if left else (None, 0, 0)
            remaining = int(hours or 0) * 3600 + int(minutes) * 60 + float(seconds) if left else None
            progress(int(done[1]), int(done[2]), remaining)

    handlers = bpy.app.handlers.render_stats
    if progress:
        handlers.append(report)
    try:
        yield
    finally:
        if progress:
            handlers.remove(report)


def render(
    scene: bpy.types.Scene,
    folder: str | Path,
    name: str,
    *,
    metadata: dict | None = None,
    progress: Progress | None = None,
    blend: bool = False,
    drawing: Drawing | None = None,
) -> tuple[Path, Path]:
    """Render a scene as it is set up and write NAME.exr (linear, 32-bit) and NAME.png (as displayed).

    Where the scene is denoised and its first view layer stores the denoising passes, the EXR keeps the noise.

    folder:   where to; made if missing
    metadata: JSON-ready dict that both images carry, for images.read_metadata()
    progress: called as Cycles goes on
    blend:    also save NAME.blend there
    drawing:  what renders it, where one render as it is set up is not all
    Returns the paths (exr, png). They, and the .blend, appear whole or not at all. Raises, before it renders, ValueError
    for a name that no file can have and metadata that the images cannot carry; OSError if the folder cannot be written,
    RuntimeError if Blender did not render; each in one sentence.
    """
    check_scene(scene)
    with files_to(folder, name, [".exr", ".png", *([".blend"] if blend else [])]) as (part, finish):
        images.check_metadata(metadata or {}, part)
        shown, linear = part / "shown.png", part / "linear.exr"
        (drawing or _render)(scene, linear, shown, progress)
        ready = [_save_blend(scene, part / "ready.blend")] if blend else []
        for source in (shown, linear):
            ready.insert(0, part / f"ready{source.suffix}")
            images.write_with_metadata(images.read(source), ready[0], metadata or {})
        exr, png = finish(*ready)[:2]
    return exr, png


def check_scene(scene: bpy.types.Scene) -> None:
    """Raise RuntimeError, one sentence, for a scene that gives no picture, or two."""
    if scene.camera is None:
        raise RuntimeError(f"the scene {scene.name!r} has no camera; add one, and make it the scene's.")
    if (
        scene.camera.type != "CAMERA"
    ):  # Blender 5.2 falls over what is linked from a file that is missing, an empty then
        raise RuntimeError(
            f"the scene {scene.name!r} looks through {scene.camera.name!r}, which is no camera, or is linked from a file "
            "that is missing; make a camera the scene's."
        )
    if not any(layer.use for layer in scene.view_layers):
        raise RuntimeError(
            f"the scene {scene.name!r} has no view layer that is used for rendering; switch one on in its properties."
        )
    if scene.render.use_multiview:
        raise RuntimeError(
            f"the scene {scene.name!r} renders two pictures, one for each eye; switch off Stereoscopy in its Output."
        )


def _save_blend(scene, file):
    try:
        with quiet(), quiet(2), atomic():
            bpy.ops.wm.save_as_mainfile(filepath=str(file), compress=True, copy=True)
            # which reads it to its end: that it is saved Blender says on a full disk, too
            with bpy.data.libraries.load(str(file)) as (saved, _):
                whole = scene.name in saved.scenes
    except (OSError, RuntimeError):
        whole = False
    if not whole:
        raise images.cut_off(file)
    return file


def _render(scene, linear, shown, progress):
    with _rendered(scene, progress) as (result, form):
        form("PNG", "8")
        _save(result, shown, scene)
        form("OPEN_EXR", "32")
        _save(result, linear, scene)
        if scene.cycles.use_denoising and scene.view_layers[0].cycles.denoising_store_passes:
            layers = linear.with_name("layers.exr")
            form("OPEN_EXR_MULTILAYER", "32")
            _save(result, layers, scene)
            _keep_noise(scene, layers, linear)


@contextlib.contextmanager
def _rendered(scene, progress):
    """What Blender has rendered, and what sets the format that it is saved in; RuntimeError where it did not render."""
    with quiet() as chatter, _reporting(progress), _saving(scene) as form:
        # the operator's result stays in memory; all files are made from it, and a film refuses small ones
        form("PNG", "8")
        try:
            state = bpy.ops.render.render(scene=scene.name)
        except RuntimeError as error:
            reason = " ".join(str(error).removeprefix("Error: ").split()).rstrip(".")
            raise RuntimeError(f"Blender did not render: {reason}.") from None
        if "FINISHED" not in state:
            lines = [line for line in chatter().splitlines() if line.strip() and not line.startswith("Fra:")]
            raise RuntimeError(f"Blender did not render: {' '.join(lines[-2:]).rstrip('.') or 'it gave no reason'}.")
        yield bpy.data.images["Render Result"], form


def _save(result, path, scene):
    try:
        # Blender makes folders that are missing: it would make the one anew that is just taken away
        with quiet(2), atomic():
            result.save_render(str(path), scene=scene)
    except RuntimeError:
        raise images.cut_off(path) from None
    if not path.is_file():
        raise RuntimeError("Blender did not render: it kept no picture.")


@contextlib.contextmanager
def _saving(scene: bpy.types.Scene) -> Iterator[Callable[[str, str], None]]:
    """What sets a format and its depth of bits, for images of this scene to be saved in; then all is as it was."""
    settings, path = scene.render.image_settings, scene.render.filepath
    # each decides what the next may be; the first and the last are from 5.0
    names = [
        name
        for name in ("media_type", "file_format", "color_mode", "color_depth", "use_exr_interleave")
        if hasattr(settings, name)
    ]
    former = [getattr(settings, name) for name in names]

    def form(file_format, depth):
        if "media_type" in names:
            settings.media_type = "MULTI_LAYER_IMAGE" if file_format == "OPEN_EXR_MULTILAYER" else "IMAGE"
        if "use_exr_interleave" in names:  # else passes are parts of the file of their own
            settings.use_exr_interleave = True
        settings.file_format, settings.color_depth = file_format, depth
        if file_format != "OPEN_EXR_MULTILAYER":
            settings.color_mode = "RGB"

    try:
        yield form
    finally:
        scene.render.filepath = path
        for name, value in zip(names, former, strict=True):
            setattr(settings, name, value)


def _keep_noise(scene, layers, linear):
    """Write the pass that Cycles had before it denoised, one of the file `layers`, over the file `linear`."""
    import OpenImageIO as oiio

    noisy = tuple(f"{scene.view_layers[0].name}.Noisy Image.{channel}" for channel in "RGB")
    picture = oiio.ImageBufAlgo.channels(images.read(layers), noisy, newchannelnames=tuple("RGB"))
    if picture.has_error or not picture.write(images.named(linear)):
        raise RuntimeError(f"Blender kept no image without denoising: {picture.geterror()}.")


def layers_of(scene: bpy.types.Scene, progress: Progress | None = None) -> dict[str, NDArray]:
    """Render a scene as it is set up; returns the passes of its first view layer by their names, the first row at the top.

    Of each (height, width, channels) float64; "Combined" is the picture, linear. What a denoiser takes is among them where
    the layer stores it. Raises as render() does.
    """
    import OpenImageIO as oiio

    check_scene(scene)
    layer = scene.view_layers[0]
    many = layer.cycles.denoising_store_passes
    with temporary() as folder:
        file = folder / "layers.exr"
        with _rendered(scene, progress) as (result, form):
            form("OPEN_EXR_MULTILAYER" if many else "OPEN_EXR", "32")
            _save(result, file, scene)
        image = images.read(file)
        pixels = image.get_pixels(oiio.FLOAT).astype(float)
        if not many:
            return {"Combined": pixels[..., :3]}
        places: dict[str, list[int]] = {}
        for place, channel in enumerate(image.spec().channelnames):
            name, _, letter = channel.removeprefix(f"{layer.name}.").rpartition(".")
            if channel.startswith(f"{layer.name}.") and letter != "A":
                places.setdefault(name, []).append(place)
        return {name: pixels[..., place] for name, place in places.items()}


def write_linear(file: Path, pixels: NDArray) -> None:
    """Write linear pixels (height, width, 3), the first row at the top, to an EXR; OSError where it cannot be written whole."""
    import OpenImageIO as oiio

    height, width, channels = pixels.shape
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, oiio.FLOAT))
    image.set_pixels(image.roi, np.ascontiguousarray(pixels, np.float32))  # else OpenImageIO leaves it black
    if not image.write(images.named(file)):
        raise images.cut_off(file)


def write_shown(scene: bpy.types.Scene, file: Path, pixels: NDArray) -> None:
    """Write linear pixels as write_linear() takes them to a PNG, as the scene's colour management displays them."""
    with temporary() as folder, quiet(), _saving(scene) as form:
        write_linear(folder / "linear.exr", pixels)
        loaded = bpy.data.images.load(str(folder / "linear.exr"))
        try:
            form("PNG", "8")
            _save(loaded, file, scene)
        finally:
            bpy.data.images.remove(loaded)


def pixels_of(scene: bpy.types.Scene) -> NDArray:
    """Render a scene as it is set up; returns linear float64 (height, width, 3), the first row at the bottom."""
    with temporary() as folder, quiet(), _saving(scene) as form:
        form("OPEN_EXR", "32")
        scene.render.filepath = str(folder / "picture.exr")
        bpy.ops.render.render(write_still=True, scene=scene.name)
        images.read(folder / "picture.exr")
        loaded = bpy.data.images.load(scene.render.filepath)
        loaded.colorspace_settings.name = "Non-Color"
        pixels = np.empty(loaded.size[0] * loaded.size[1] * loaded.channels, np.float32)
        loaded.pixels.foreach_get(pixels)
        pixels = pixels.reshape(loaded.size[1], loaded.size[0], loaded.channels)
        bpy.data.images.remove(loaded)
    return pixels[..., :3].astype(float)

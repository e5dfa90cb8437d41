# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless render: linear EXR and display PNG that carry what made them, never half written."""

import contextlib
import json
import os
import re
from pathlib import Path

import bpy
import numpy as np

from ..base import records
from ..base.files import files_to, is_full, temporary
from ..base.signals import atomic
from ..base.streams import quiet

# The attribute of our images that holds, as JSON, everything that made them.
ATTRIBUTE = "nimray"
WIDEST = 1 << 20  # pixels, of an image that can be ours


@contextlib.contextmanager
def _reporting(progress):
    """Call progress(samples done, samples in all, seconds left or None) as Cycles reports them."""

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


def render(scene, folder, name, *, metadata=None, progress=None, blend=False):
    """Render a bpy.types.Scene as it is set up and write NAME.exr (linear, 32-bit) and NAME.png (as displayed).

    Where the scene is denoised and its first view layer stores the denoising passes, the EXR keeps the noise.

    folder:   where to; made if missing
    metadata: JSON-ready dict that both images carry, for read_metadata()
    progress: called with (samples done, samples in all, seconds left or None)
    blend:    also save NAME.blend there
    Returns the paths (exr, png). They, and the .blend, appear whole or not at all. Raises, before it renders, ValueError
    for a name that no file can have and metadata that the images cannot carry; OSError if the folder cannot be written,
    RuntimeError if Blender did not render; each in one sentence.
    """
    _check_scene(scene)
    with files_to(folder, name, [".exr", ".png", *([".blend"] if blend else [])]) as (part, finish):
        _check_metadata(metadata or {}, part)
        shown, linear = part / "shown.png", part / "linear.exr"
        _render(scene, linear, shown, progress)
        ready = [_save_blend(scene, part / "ready.blend")] if blend else []
        for source in (shown, linear):
            ready.insert(0, part / f"ready{source.suffix}")
            write_with_metadata(_read(source), ready[0], metadata or {})
        return finish(*ready)[:2]


def _check_scene(scene):
    """Raise RuntimeError, one sentence, for a scene that gives no picture, or two."""
    if scene.camera is None:
        raise RuntimeError(f"the scene {scene.name!r} has no camera; add one, and make it the scene's.")
    if scene.render.use_multiview:
        raise RuntimeError(
            f"the scene {scene.name!r} renders two pictures, one for each eye; switch off Stereoscopy in its Output."
        )


def _check_metadata(metadata, part):
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
        raise _cut_off(file)
    return file


def _render(scene, linear, shown, progress):
    image = scene.render.image_settings
    with quiet() as chatter, _reporting(progress):
        _media(image, "IMAGE")
        image.file_format, image.color_mode, image.color_depth = "PNG", "RGB", "8"
        # the operator's result stays in memory; both files are made from it
        try:
            state = bpy.ops.render.render(scene=scene.name)
        except RuntimeError as error:
            reason = " ".join(str(error).removeprefix("Error: ").split()).rstrip(".")
            raise RuntimeError(f"Blender did not render: {reason}.") from None
        result = bpy.data.images["Render Result"]
        if "FINISHED" in state:
            _save(result, shown, scene)
            image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
            _save(result, linear, scene)
            if scene.cycles.use_denoising and scene.view_layers[0].cycles.denoising_store_passes:
                _keep_noise(scene, result, linear)
            image.file_format = "PNG"
        if not (linear.is_file() and shown.is_file()):
            lines = [line for line in chatter().splitlines() if line.strip() and not line.startswith("Fra:")]
            raise RuntimeError(f"Blender did not render: {' '.join(lines[-2:]).rstrip('.') or 'it gave no reason'}.")


def _save(result, path, scene):
    try:
        # Blender makes folders that are missing: it would make the one anew that is just taken away
        with quiet(2), atomic():
            result.save_render(str(path), scene=scene)
    except RuntimeError:
        raise _cut_off(path) from None


def _media(image, kind):
    if hasattr(image, "media_type"):  # from 5.0
        image.media_type = kind


def _keep_noise(scene, result, linear):
    """Write the pass that Cycles had before it denoised over the file `linear`."""
    import OpenImageIO as oiio

    image = scene.render.image_settings
    layers = linear.with_name("layers.exr")
    _media(image, "MULTI_LAYER_IMAGE")
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    if hasattr(image, "use_exr_interleave"):  # from 5.0, else the passes are parts of the file of their own
        image.use_exr_interleave = True
    _save(result, layers, scene)
    _media(image, "IMAGE")
    noisy = tuple(f"{scene.view_layers[0].name}.Noisy Image.{channel}" for channel in "RGB")
    picture = oiio.ImageBufAlgo.channels(_read(layers), noisy, newchannelnames=tuple("RGB"))
    if picture.has_error or not picture.write(_named(linear)):
        raise RuntimeError(f"Blender kept no image without denoising: {picture.geterror()}.")


def pixels_of(scene):
    """Render a bpy.types.Scene as it is set up; returns linear float64 (height, width, 3), the first row at the bottom."""
    image = scene.render.image_settings
    with temporary() as folder, quiet():
        _media(image, "IMAGE")
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        scene.render.filepath = str(folder / "picture.exr")
        bpy.ops.render.render(write_still=True, scene=scene.name)
        _read(folder / "picture.exr")
        loaded = bpy.data.images.load(scene.render.filepath)
        loaded.colorspace_settings.name = "Non-Color"
        pixels = np.empty(loaded.size[0] * loaded.size[1] * loaded.channels, np.float32)
        loaded.pixels.foreach_get(pixels)
        pixels = pixels.reshape(loaded.size[1], loaded.size[0], loaded.channels)
        bpy.data.images.remove(loaded)
    return pixels[..., :3].astype(float)


def _named(path):
    """The name of a file as OpenImageIO takes it; OSError, one sentence, for one that it cannot take."""
    try:
        return os.fsencode(path).decode()  # where the system's letters are not UTF-8, Python's path has none of them
    except UnicodeDecodeError:
        raise OSError(f"{path} has a name that is not in UTF-8, as those of images must be; name another.") from None


def image_of(path):
    """The OpenImageIO.ImageBuf of a file."""
    import OpenImageIO as oiio

    return oiio.ImageBuf(_named(path))


def _read(path):
    """The OpenImageIO.ImageBuf of a file that was just written, seen to be whole; OSError, one sentence, where it is not."""
    with quiet(2):  # OpenEXR complains there by itself
        image = image_of(path)
        whole = image.initialized and image.read(force=True)
    if image.geterror() or not whole:
        raise _cut_off(path)
    return image


def _cut_off(path):
    return OSError(f"cannot write the {path.suffix} file whole; see whether the disk is full, or name another folder.")


def write_with_metadata(image, target, metadata):
    """Write an OpenImageIO.ImageBuf to the Path `target`, with the dict that read_metadata() gives back.

    Raises OSError, one sentence, where it could not be written whole, ValueError where it cannot carry that dict.
    """
    import OpenImageIO as oiio

    record = json.dumps(metadata)
    image.specmod().attribute(ATTRIBUTE, record)
    maker = ascii(metadata.get("nimray", ""))[:99].strip("'")
    image.specmod().attribute("Software", f"nimray {maker}, Blender {bpy.app.version_string}")
    with quiet(2):  # OpenEXR complains there by itself
        written = image.write(_named(target))
        error = image.geterror() or oiio.geterror()  # else it is printed
    if error or not written:
        raise _cut_off(target)
    # which says True on a full disk, too, and drops what a PNG is too small for
    carried, whole = _record_in(target)
    if not whole:
        raise _cut_off(target)
    if carried != record and not is_full(target.parent):
        size = f"{len(record) / 1e6:.3g} million letters"
        raise ValueError(f"metadata of {size} is more than a {target.suffix} can carry; leave some of it out.")


def _record_in(path):
    """The text of the record in an image file, and whether the file is whole: "" where it has none, None for no image.

    It is read by and by: it may be large, or claim to be.
    """
    import OpenImageIO as oiio

    with quiet(2):  # OpenEXR complains there by itself
        image = oiio.ImageInput.open(_named(path))
        try:
            if not image:
                oiio.geterror()  # else it is printed, on standard output, into --json and --progress
                return None, False
            spec = image.spec()
            text = spec.get_string_attribute(ATTRIBUTE)
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


def record_of(exr):
    """The metadata dict that an EXR and the PNG beside it share, both whole; None where there is no such pair."""
    exr = Path(exr)
    try:
        record = read_metadata(exr)
        return record if read_metadata(exr.with_suffix(".png")) == record else None
    except (ValueError, FileNotFoundError):
        return None


def read_metadata(path):
    """The metadata dict of an image that render() wrote.

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

# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless render: linear EXR and display PNG that carry what made them, never half written."""

import contextlib
import errno
import json
import os
import re
import shutil
import signal
import socket
import sys
import tempfile
import threading
from pathlib import Path

import bpy
import numpy as np

# The attribute of our images that holds, as JSON, everything that made them.
ATTRIBUTE = "nimray"


@contextlib.contextmanager
def quiet(descriptor=1):
    """Keep what a library prints on standard output (1) or error (2) away from ours; yields a function to read it."""
    sys.stdout.flush()
    with tempfile.TemporaryFile() as log:
        kept = os.dup(descriptor)
        os.dup2(log.fileno(), descriptor)
        try:
            yield lambda: (log.seek(0), log.read().decode(errors="replace"))[1]
        finally:
            os.dup2(kept, descriptor)
            os.close(kept)


@contextlib.contextmanager
def interruptible(clean_up):
    """Let Ctrl-C or a kill end the process at once: while Cycles renders, Python's own handler would wait for its end."""
    if threading.current_thread() is not threading.main_thread() or not bpy.app.background:
        yield
        return
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    handlers = {number: signal.signal(number, lambda *_: None) for number in (signal.SIGINT, signal.SIGTERM)}
    wakeup = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)

    def watch():
        for number in iter(lambda: ours.recv(1), b""):
            if number[0] in handlers:
                clean_up()
                with contextlib.suppress(OSError):  # nobody listens any more
                    os.write(2, b"\nStopped; no half file is left.\n")
                os._exit(128 + number[0])

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, handler in handlers.items():
            # None: a handler of Blender's own, in C, which Python cannot put back
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        theirs.close()  # the watcher reads the end of the stream and ends
        watcher.join()
        ours.close()


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


def writable_folder(folder):
    """Make `folder` (a path) if it is missing and return it as a Path; OSError, one sentence, if it cannot be written."""
    if not str(folder):  # which Path takes for the working directory
        raise OSError("the name of the folder to write into is empty; name a folder, or . for this one.")
    folder = Path(folder).expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"cannot write into {folder}: {error.strerror or error}; name another folder.") from None
    return folder


def render(scene, folder, name, *, metadata=None, progress=None, blend=False):
    """Render a bpy.types.Scene as it is set up and write NAME.exr (linear, 32-bit) and NAME.png (as displayed).

    Where the scene is denoised and its first view layer stores the denoising passes, the EXR keeps the noise.


    folder:   where to; made if missing
    metadata: JSON-ready dict that both images carry, for read_metadata()
    progress: called with (samples done, samples in all, seconds left or None)
    blend:    also save NAME.blend there
    Returns the paths (exr, png). They appear whole or not at all. Raises OSError if the folder cannot be written,
    RuntimeError if Blender did not render.
    """
    with files_to(folder, name) as (part, finish):
        shown, linear = part / "shown.png", part / "linear.exr"
        _render(scene, linear, shown, progress)
        if blend:
            with quiet():
                bpy.ops.wm.save_as_mainfile(filepath=str(part / "scene.blend"), compress=True, copy=True)
        ready = []
        for source in (linear, shown):
            ready.append(part / f"ready{source.suffix}")
            write_with_metadata(image_of(source), ready[-1], metadata or {})
        return finish(*ready, *([part / "scene.blend"] if blend else []))[:2]


@contextlib.contextmanager
def files_to(folder, name):
    """Files that appear in `folder` whole or not at all.

    Yields a folder to write parts into, which goes at the end, and finish(*files): gives the name NAME.suffix in
    `folder` to each of those files, and returns their paths.
    """
    folder = writable_folder(folder)
    # beside the result, so that the last step is a rename
    part = Path(tempfile.mkdtemp(prefix=f".{name}.", suffix=".part", dir=folder))

    def finish(*files):
        targets = [folder / f"{name}{file.suffix}" for file in files]
        for file, target in zip(files, targets, strict=True):
            os.replace(file, target)
        return targets

    with interruptible(lambda: shutil.rmtree(part, ignore_errors=True)):
        try:
            yield part, finish
        except (OSError, RuntimeError):
            # of a full disk neither Blender nor OpenImageIO says so
            if shutil.disk_usage(folder).free < 1 << 16:
                raise OSError(
                    f"cannot write into {folder}: {os.strerror(errno.ENOSPC)}; name another folder."
                ) from None
            raise
        finally:
            shutil.rmtree(part, ignore_errors=True)


def _render(scene, linear, shown, progress):
    image = scene.render.image_settings
    with quiet() as chatter, _reporting(progress):
        _media(image, "IMAGE")
        image.file_format, image.color_mode, image.color_depth = "PNG", "RGB", "8"
        # the operator's result stays in memory; both files are made from it
        state = bpy.ops.render.render(scene=scene.name)
        result = bpy.data.images["Render Result"]
        if "FINISHED" in state:
            result.save_render(str(shown), scene=scene)
            image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
            result.save_render(str(linear), scene=scene)
            if scene.cycles.use_denoising and scene.view_layers[0].cycles.denoising_store_passes:
                _keep_noise(scene, result, linear)
            image.file_format = "PNG"
        if not (linear.is_file() and shown.is_file()):
            lines = [line for line in chatter().splitlines() if line.strip() and not line.startswith("Fra:")]
            raise RuntimeError(f"Blender did not render: {' '.join(lines[-2:]) or 'it gave no reason'}")


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
    result.save_render(str(layers), scene=scene)
    _media(image, "IMAGE")
    noisy = tuple(f"{scene.view_layers[0].name}.Noisy Image.{channel}" for channel in "RGB")
    picture = oiio.ImageBufAlgo.channels(image_of(layers), noisy, newchannelnames=tuple("RGB"))
    if picture.has_error or not picture.write(str(linear)):
        raise RuntimeError(f"Blender kept no image without denoising: {picture.geterror()}")


def pixels_of(scene):
    """Render a bpy.types.Scene as it is set up; returns linear float64 (height, width, 3), the first row at the bottom."""
    image = scene.render.image_settings
    with tempfile.TemporaryDirectory() as folder, quiet():
        _media(image, "IMAGE")
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        scene.render.filepath = str(Path(folder, "picture.exr"))
        bpy.ops.render.render(write_still=True, scene=scene.name)
        loaded = bpy.data.images.load(scene.render.filepath)
        loaded.colorspace_settings.name = "Non-Color"
        pixels = np.empty(loaded.size[0] * loaded.size[1] * loaded.channels, np.float32)
        loaded.pixels.foreach_get(pixels)
        pixels = pixels.reshape(loaded.size[1], loaded.size[0], loaded.channels)
        bpy.data.images.remove(loaded)
    return pixels[..., :3].astype(float)


def image_of(path):
    """The OpenImageIO.ImageBuf of a file."""
    import OpenImageIO as oiio

    return oiio.ImageBuf(str(path))


def write_with_metadata(image, target, metadata):
    """Write an OpenImageIO.ImageBuf to the Path `target`, with the dict that read_metadata() gives back."""
    image.specmod().attribute(ATTRIBUTE, json.dumps(metadata))
    image.specmod().attribute("Software", f"nimray {metadata.get('nimray', '')}, Blender {bpy.app.version_string}")
    if not image.write(str(target)):
        raise OSError(f"cannot write {target.name}: {image.geterror()}")


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
    import OpenImageIO as oiio

    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}.")
    with quiet(2):  # OpenEXR complains there by itself
        image = oiio.ImageBuf(str(path))
        whole = image.initialized and image.read(force=True)  # a header can be whole where the pixels are not
    # asked for first: OpenImageIO prints an error that nobody asked for on standard output, into --json and --progress
    if image.geterror() or not whole:
        raise ValueError(f"{path} is not a whole image: it may be cut off, or not an image at all; render it again.")
    try:
        record = json.loads(image.spec().get_string_attribute(ATTRIBUTE))
    except ValueError:
        record = None
    if not isinstance(record, dict):
        raise ValueError(f"{path} was not made by nimray: it carries no record of scene and parameters.")
    return record

# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless render: linear EXR and display PNG that carry what made them, never half written."""

import contextlib
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
def _interruptible(clean_up):
    """Let Ctrl-C end the process at once: while Cycles renders, Python's own handler would wait for the last sample."""
    if threading.current_thread() is not threading.main_thread() or not bpy.app.background:
        yield
        return
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    handler = signal.signal(signal.SIGINT, lambda *_: None)
    wakeup = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)

    def watch():
        if ours.recv(1):
            clean_up()
            os.write(2, b"\nStopped; nothing was written.\n")
            os._exit(130)

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        # None: a handler of Blender's own, in C, which Python cannot put back
        signal.signal(signal.SIGINT, signal.SIG_DFL if handler is None else handler)
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

    folder:   where to; made if missing
    metadata: JSON-ready dict that both images carry, for read_metadata()
    progress: called with (samples done, samples in all, seconds left or None)
    blend:    also save NAME.blend there
    Returns the paths (exr, png). They appear whole or not at all. Raises OSError if the folder cannot be written,
    RuntimeError if Blender did not render.
    """
    folder = writable_folder(folder)
    # beside the result, so that the last step is a rename
    part = Path(tempfile.mkdtemp(prefix=f".{name}.", suffix=".part", dir=folder))
    with _interruptible(lambda: shutil.rmtree(part, ignore_errors=True)):
        try:
            return _render(scene, folder, name, part, metadata or {}, progress, blend)
        finally:
            shutil.rmtree(part, ignore_errors=True)


def _render(scene, folder, name, part, metadata, progress, blend):
    image = scene.render.image_settings
    linear, shown = part / "linear.exr", part / "shown.png"
    with quiet() as chatter, _reporting(progress):
        if hasattr(image, "media_type"):  # from 5.0
            image.media_type = "IMAGE"
        image.file_format, image.color_mode, image.color_depth = "PNG", "RGB", "8"
        # the operator's result stays in memory; both files are made from it
        state = bpy.ops.render.render(scene=scene.name)
        result = bpy.data.images["Render Result"]
        if "FINISHED" in state:
            result.save_render(str(shown), scene=scene)
            image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
            result.save_render(str(linear), scene=scene)
            image.file_format = "PNG"
        if not (linear.is_file() and shown.is_file()):
            lines = [line for line in chatter().splitlines() if line.strip() and not line.startswith("Fra:")]
            raise RuntimeError(f"Blender did not render: {' '.join(lines[-2:]) or 'it gave no reason'}")
        if blend:
            bpy.ops.wm.save_as_mainfile(filepath=str(part / "scene.blend"), compress=True, copy=True)
    targets = []
    for source, suffix in ((linear, "exr"), (shown, "png")):
        ready = part / f"ready.{suffix}"
        _with_metadata(source, ready, metadata)
        targets.append((ready, folder / f"{name}.{suffix}"))
    if blend:
        targets.append((part / "scene.blend", folder / f"{name}.blend"))
    for ready, target in targets:
        os.replace(ready, target)
    return targets[0][1], targets[1][1]


def _with_metadata(source, target, metadata):
    import OpenImageIO as oiio

    image = oiio.ImageBuf(str(source))
    image.specmod().attribute(ATTRIBUTE, json.dumps(metadata))
    image.specmod().attribute("Software", f"nimray {metadata.get('nimray', '')}, Blender {bpy.app.version_string}")
    if not image.write(str(target)):
        raise OSError(f"cannot write {target.name}: {image.geterror()}")


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
    if not whole or image.geterror():
        raise ValueError(f"{path} is not a whole image: it may be cut off, or not an image at all; render it again.")
    text = image.spec().get_string_attribute(ATTRIBUTE)
    try:
        return json.loads(text)
    except ValueError:
        raise ValueError(f"{path} was not made by nimray: it carries no record of scene and parameters.") from None

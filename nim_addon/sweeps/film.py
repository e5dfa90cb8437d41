# SPDX-License-Identifier: GPL-3.0-or-later
"""The film of a sweep: its pictures one after the other, through Blender's own FFmpeg."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..base.files import check_name, whole
from ..base.streams import quiet

FORMS = {".mp4": ("MPEG4", "H264"), ".mkv": ("MKV", "FFV1"), ".webm": ("WEBM", "WEBM")}  # container and codec
LEAST = 16  # pixels of a side that Blender makes a film of


def check(file: str, size: tuple[int, int]) -> None:
    """Raise ValueError, one sentence, for the name of what is no film that can be made, and for pictures that are too small.

    size: width and height of the first picture, pixels
    """
    if Path(file).suffix.lower() not in FORMS:
        raise ValueError(f"--film {file!r} is no film that can be made; name it .mp4, .webm or .mkv.")
    check_name(Path(file).stem)
    if min(size) < LEAST:
        raise ValueError(f"no film can be made of {size[0]} x {size[1]} pixels; {LEAST} x {LEAST} are the least.")


def write(file: Path, pictures: Sequence[Path], fps: float) -> Path:
    """Write pictures (PNG) as the frames of a film, so many a second; it takes the size of the first, made even.

    Raises RuntimeError, one sentence, where Blender did not write it.
    """
    return whole(file, lambda part: _film(part, pictures, fps))


def _film(part, pictures, fps):
    scene = bpy.data.scenes.new("NIM film")
    try:
        width, height = _size(pictures[0])
        render = scene.render
        render.resolution_x, render.resolution_y = width - width % 2, height - height % 2  # as H.264 wants it
        render.resolution_percentage = 100
        render.fps, render.fps_base = _rate(fps)
        scene.frame_start, scene.frame_end = 1, len(pictures)
        scene.view_settings.view_transform = "Standard"  # PNGs are as displayed
        render.use_sequencer, render.use_compositing = True, False
        settings = render.image_settings
        if hasattr(settings, "media_type"):  # from 5.0
            settings.media_type = "VIDEO"
        settings.file_format = "FFMPEG"
        render.ffmpeg.format, render.ffmpeg.codec = FORMS[part.suffix.lower()]
        with contextlib.suppress(TypeError):  # not of every codec
            render.ffmpeg.constant_rate_factor = "HIGH"
        render.use_file_extension = False
        render.filepath = str(part)
        with _shown_in_turn(scene, pictures), quiet() as chatter, quiet(2):
            try:
                bpy.ops.render.render(animation=True, scene=scene.name)
                told = chatter()
            except RuntimeError as error:  # such as a picture that is too small
                told = str(error).removeprefix("Error: ")
        if not part.is_file():
            lines = [line for line in told.splitlines() if line.strip()]
            raise RuntimeError(f"Blender did not write the film: {' '.join(lines[-2:]) or 'it gave no reason'}.")
    finally:
        bpy.data.scenes.remove(scene)


@contextlib.contextmanager
def _shown_in_turn(scene, pictures):
    """Within, each frame of a scene that is rendered shows the next of the pictures.

    One strip shows them all. Of a strip for each, every frame goes through all; in a strip with all as its elements, what is
    missing has a size that nobody has set, and Blender may crash.
    """
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strip = strips.new_image("pictures", str(pictures[0].resolve()), channel=1, frame_start=1)
    # of 5.2: the former name goes in 6.0
    setattr(strip, "duration" if hasattr(strip, "duration") else "frame_final_duration", len(pictures))

    def show(rendered, *_):
        if rendered == scene:
            picture = pictures[rendered.frame_current - 1].resolve()
            strip.directory, strip.elements[0].filename = f"{picture.parent}{os.sep}", picture.name

    bpy.app.handlers.render_pre.append(show)
    try:
        yield
    finally:
        bpy.app.handlers.render_pre.remove(show)


def _size(picture):
    image = bpy.data.images.load(str(picture))
    try:
        return tuple(image.size)
    finally:
        bpy.data.images.remove(image)


def _rate(fps):
    """Frames a second as Blender holds them: a whole number over a divisor."""
    whole_number = max(1, round(fps))
    return whole_number, whole_number / fps

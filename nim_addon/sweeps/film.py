# SPDX-License-Identifier: GPL-3.0-or-later
"""The film of a sweep: its pictures one after the other, through Blender's own FFmpeg."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..base.files import check_name, whole
from ..base.streams import quiet

FORMS = {".mp4": ("MPEG4", "H264"), ".mkv": ("MKV", "FFV1"), ".webm": ("WEBM", "WEBM")}  # container and codec


def check(file: str) -> None:
    """Raise ValueError, one sentence, for the name of what is no film that can be made."""
    if Path(file).suffix.lower() not in FORMS:
        raise ValueError(f"--film {file!r} is no film that can be made; name it .mp4, .webm or .mkv.")
    check_name(Path(file).stem)


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
        editor = scene.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        for frame, picture in enumerate(pictures, 1):
            strip = strips.new_image(picture.stem, str(picture.resolve()), channel=1, frame_start=frame)
            strip.frame_final_duration = 1
        settings = render.image_settings
        if hasattr(settings, "media_type"):  # from 5.0
            settings.media_type = "VIDEO"
        settings.file_format = "FFMPEG"
        render.ffmpeg.format, render.ffmpeg.codec = FORMS[part.suffix.lower()]
        with contextlib.suppress(TypeError):  # not of every codec
            render.ffmpeg.constant_rate_factor = "HIGH"
        render.use_file_extension = False
        render.filepath = str(part)
        with quiet() as chatter, quiet(2):
            bpy.ops.render.render(animation=True, scene=scene.name)
        if not part.is_file():
            lines = [line for line in chatter().splitlines() if line.strip()]
            raise RuntimeError(f"Blender did not write the film: {' '.join(lines[-2:]) or 'it gave no reason'}.")
    finally:
        bpy.data.scenes.remove(scene)


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

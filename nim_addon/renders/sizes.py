# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of the picture that a scene makes: of the whole of it, or of the part that its render region is cropped to."""

from __future__ import annotations

import bpy
import numpy as np

Size = tuple[int, int]  # width and height, pixels


def own_size(scene: bpy.types.Scene) -> Size:
    """That of the picture that Blender renders; ValueError, one sentence, where that has no pixels."""
    width, height = (stop - start for start, stop, _ in _sides(scene))
    if not (width and height):
        raise ValueError(
            f"the render region of the scene {scene.name!r} has no pixels; draw a larger one, or switch it off in its Output."
        )
    return width, height


def set_size(scene: bpy.types.Scene, size: Size) -> None:
    """Let a scene make a picture of so many pixels, by a render region the same part of the whole.

    Raises ValueError, one sentence, where Blender has no whole as small or as large as that.
    """
    own, render = own_size(scene), scene.render
    cropped, sides = _is_cropped(render), _sides(scene)
    limits = render.bl_rna.properties["resolution_x"]
    least, most = limits.hard_min, limits.hard_max
    wholes = [max(round(whole * new / old), new) for (*_, whole), new, old in zip(sides, size, own, strict=True)]
    if cropped:
        wholes = [max(whole, least) for whole in wholes]
    if min(wholes) < least:
        raise ValueError(
            f"a picture of {size[0]} x {size[1]} pixels is too small for Blender; {least} x {least} are the least."
        )
    if max(wholes) > most:
        raise ValueError(
            f"{size[0]} x {size[1]} pixels of the render region are part of {wholes[0]} x {wholes[1]}, and a side has at most "
            f"{most}; ask for fewer."
        )
    render.resolution_percentage = 100
    render.resolution_x, render.resolution_y = wholes
    for axis, (start, _, _), whole, new, old in zip("xy", sides, wholes, size, own, strict=True) if cropped else ():
        first = min(round(start * new / old), whole - new)
        # a quarter of a pixel further, which is left out again, keeps clear of what single precision rounds
        setattr(render, f"border_min_{axis}", (first + 0.25) / whole)
        setattr(render, f"border_max_{axis}", (first + new + 0.25) / whole)


def _is_cropped(render):
    return render.use_border and render.use_crop_to_border


def _sides(scene):
    """(first pixel, the one after the last, pixels of the whole) of the width and of the height, as Blender counts them."""
    render = scene.render
    found = []
    for axis in "xy":
        whole = max(1, getattr(render, f"resolution_{axis}") * render.resolution_percentage // 100)
        ends = [0.0, 1.0]
        if _is_cropped(render):
            ends = [getattr(render, f"border_{end}_{axis}") for end in ("min", "max")]
        found.append((*(int(np.float32(end) * np.float32(whole)) for end in ends), whole))
    return found

# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of numbers that are packed into the file, each where no image was before.

Cycles knows an image without a file by its address in memory, and nothing else. As long as it keeps a scene, in a viewport
or with persistent data, it keeps the pixels of images that were removed as well: a new one that came to such an address,
as the next one of a kind likes to, was rendered with them.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

_taken: set[int] = set()  # addresses of the images that there are, and of those that were


def remember() -> None:
    """Let no packed_image() stand where an image of this file stands, even if that is removed."""
    _taken.update(image.as_pointer() for image in bpy.data.images)


def packed_image(name: str, pixels: NDArray, *, half: bool = False) -> bpy.types.Image:
    """A new image, packed, whose pixels are data, not colours.

    name:   of the new image; Blender appends .001 where it is taken
    pixels: (H, W, 3), rows from below; alpha is 1
    half:   whether the file has them in 16 bits each, not in 32
    """
    remember()
    held = []
    # as small as can be, until one stands in a new place
    while (image := bpy.data.images.new(name, 1, 1, float_buffer=True, is_data=True)).as_pointer() in _taken:
        held.append(image)
    bpy.data.batch_remove(held)
    image.name = name  # which those before it had
    remember()
    image.generated_height, image.generated_width = pixels.shape[:2]
    image.alpha_mode, image.use_half_precision = "CHANNEL_PACKED", half
    opaque = np.ones((*pixels.shape[:2], 4), np.float32)
    opaque[..., :3] = pixels
    image.pixels.foreach_set(opaque.ravel())
    image.pack()
    return image

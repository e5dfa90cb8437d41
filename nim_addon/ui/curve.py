# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of R(theta) that the panels show: drawn with numpy, kept as an icon, made once for each interface."""

from collections import OrderedDict

import bpy.utils.previews
import numpy as np

from ..physics import Interface
from . import deferred

# Colours, 0 to 1: the ground, axes and grid, text, and the curves.
GROUND, GRID, TEXT = (0.11, 0.11, 0.12), (0.25, 0.25, 0.27), (0.72, 0.72, 0.72)
R_COLOR, S_COLOR, P_COLOR, BACK_COLOR = (1.0, 1.0, 1.0), (0.35, 0.65, 1.0), (1.0, 0.62, 0.25), (0.52, 0.52, 0.55)
ANGLES = np.radians(np.linspace(0, 90, 721))

# Letters of 5 x 7 dots, a number of five bits for each line, from the top.
LETTERS = {
    "0": (14, 17, 17, 17, 17, 17, 14),
    "1": (4, 12, 4, 4, 4, 4, 14),
    "3": (14, 17, 1, 6, 1, 17, 14),
    "5": (31, 16, 30, 1, 1, 17, 14),
    "6": (14, 16, 16, 30, 17, 17, 14),
    "9": (14, 17, 17, 15, 1, 1, 14),
    ".": (0, 0, 0, 0, 0, 0, 4),
    "R": (30, 17, 17, 30, 20, 18, 17),
    "s": (0, 0, 15, 16, 14, 1, 30),
    "p": (0, 0, 30, 17, 30, 16, 16),
}

# Icons are never freed while the add-on runs, since a region may still show one: a few are used over and over.
SLOTS = 8
_icons = None
_shown = OrderedDict()


def picture(interface: Interface, size: int, scale: float = 1.0) -> np.ndarray:
    """R(theta_i), R_s and R_p from outside, and R from inside (grey, dashed), over 0 to 90 degrees.

    size: pixels of a side; scale: of the lines and letters
    Returns (size, size, 4) float32, row 0 at the bottom, as Blender's images are.
    """
    image = np.ones((size, size, 4), np.float32)
    image[..., :3] = GROUND
    dot = max(1, round(scale))
    left, bottom = 24 * dot, 16 * dot
    right, top = size - 8 * dot, size - 18 * dot

    def place(theta, value):
        return left + theta / (np.pi / 2) * (right - left), bottom + value * (top - bottom)

    for degrees in (0, 30, 60, 90):
        x = round(place(np.radians(degrees), 0)[0])
        image[bottom : top + 1, x : x + dot, :3] = GRID
        _write(image, str(degrees), x - 3 * dot * len(str(degrees)) + dot, bottom - 12 * dot, dot, TEXT)
    for value, text in ((0, "0"), (0.5, "0.5"), (1, "1")):
        y = round(place(0, value)[1])
        image[y : y + dot, left : right + 1, :3] = GRID
        _write(image, text, left - (6 * len(text) + 3) * dot, y - 3 * dot, dot, TEXT)
    x = left
    for text, color in (("R", R_COLOR), ("Rs", S_COLOR), ("Rp", P_COLOR)):
        _write(image, text, x, top + 7 * dot, dot, color)
        x += (6 * len(text) + 8) * dot
    cos = np.cos(ANGLES)
    ahead, back = interface.fresnel(cos), interface.reversed().fresnel(cos)
    _curve(image, *place(ANGLES, back.R), 1.3 * scale, BACK_COLOR, dash=8 * scale)
    _curve(image, *place(ANGLES, ahead.R_s), 1.3 * scale, S_COLOR)
    _curve(image, *place(ANGLES, ahead.R_p), 1.3 * scale, P_COLOR)
    _curve(image, *place(ANGLES, ahead.R), 2.0 * scale, R_COLOR)
    return image


def _write(image, text, x, y, dot, color):
    for letter in text:
        bits = np.array([[line >> (4 - i) & 1 for i in range(5)] for line in LETTERS[letter][::-1]], bool)
        mask = bits.repeat(dot, axis=0).repeat(dot, axis=1)
        image[y : y + 7 * dot, x : x + 5 * dot][mask, :3] = color
        x += 6 * dot


def _curve(image, x, y, width, color, dash=None):
    """Draw the line through the points with a round pen, its edge one pixel soft; with gaps as long as each `dash`."""
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    steps = np.arange(0, along[-1], 0.6)
    if dash:
        steps = steps[steps % (2 * dash) < dash]
    x, y = np.interp(steps, along, x), np.interp(steps, along, y)
    reach = int(np.ceil(width / 2 + 0.5))
    offset = np.arange(-reach, reach + 1)
    columns = np.round(x).astype(int)[:, None, None] + offset[None, :, None]
    rows = np.round(y).astype(int)[:, None, None] + offset[None, None, :]
    distance = np.hypot(columns - x[:, None, None], rows - y[:, None, None])
    columns, rows = np.broadcast_arrays(columns, rows)
    ink = np.clip(width / 2 + 0.5 - distance, 0, 1)
    wet = (ink > 0) & (columns >= 0) & (rows >= 0) & (columns < image.shape[1]) & (rows < image.shape[0])
    # where the pen comes by twice its darkest stroke counts: written last
    order = np.argsort(ink[wet])
    cover = np.zeros(image.shape[:2], np.float32)
    cover[rows[wet][order], columns[wet][order]] = ink[wet][order]
    cover = cover[..., None]
    image[..., :3] += cover * (np.array(color, np.float32) - image[..., :3])


def icon(interface: Interface, size: int, scale: float = 1.0) -> int:
    """The icon number of picture(interface, size, scale); the last one's until it is made, by the time of a redraw."""
    key = (interface, size, scale)
    if key in _shown:
        _shown.move_to_end(key)
        return _shown[key].icon_id
    deferred.do(_make, key)
    newest = next(reversed(_shown), None)
    return _shown[newest].icon_id if newest else 0


def _make(key):
    free = len(_shown) < SLOTS
    preview = _icons.new(str(len(_shown))) if free else _shown.popitem(last=False)[1]
    preview.image_size = key[1:2] * 2
    preview.image_pixels_float.foreach_set(picture(*key).ravel())
    _shown[key] = preview


def register():
    """Make room for the icons."""
    global _icons
    _icons = bpy.utils.previews.new()


def unregister():
    """Free them."""
    global _icons
    bpy.utils.previews.remove(_icons)
    _icons = None
    _shown.clear()

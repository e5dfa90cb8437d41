# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures that the panels show of an interface, R(theta) and n, k and R by wavelength: drawn with numpy, kept as icons.

Each is made once for each interface.
"""

import copy
import functools
import math
from collections import OrderedDict
from typing import NamedTuple

import bpy.utils.previews
import numpy as np
from numpy.typing import NDArray

from ..physics import REPRESENTATIVE_NM, VISIBLE_NM, Interface
from ..physics.colour import encoded, of_wavelength
from . import deferred

# Colours, 0 to 1: the ground, axes and grid, text, and the curves.
GROUND, GRID, TEXT = (0.11, 0.11, 0.12), (0.25, 0.25, 0.27), (0.72, 0.72, 0.72)
R_COLOR, S_COLOR, P_COLOR, BACK_COLOR = (1.0, 1.0, 1.0), (0.35, 0.65, 1.0), (1.0, 0.62, 0.25), (0.52, 0.52, 0.55)
N_COLOR, K_COLOR, PROBE_COLOR = P_COLOR, S_COLOR, (0.45, 0.9, 0.45)
ANGLES = np.radians(np.linspace(0, 90, 721))
WAVELENGTHS = np.linspace(*VISIBLE_NM, 141)
# A k below it shows nothing that its curve could: the reading says it.
LEAST_K = 1e-3

# Letters of 5 x 7 dots, a number of five bits for each line, from the top.
LETTERS = {
    "0": (14, 17, 17, 17, 17, 17, 14),
    "1": (4, 12, 4, 4, 4, 4, 14),
    "2": (14, 17, 1, 2, 4, 8, 31),
    "3": (14, 17, 1, 6, 1, 17, 14),
    "4": (2, 6, 10, 18, 31, 2, 2),
    "5": (31, 16, 30, 1, 1, 17, 14),
    "6": (14, 16, 16, 30, 17, 17, 14),
    "7": (31, 1, 2, 4, 8, 8, 8),
    "8": (14, 17, 17, 14, 17, 17, 14),
    "9": (14, 17, 17, 15, 1, 1, 14),
    ".": (0, 0, 0, 0, 0, 0, 4),
    "-": (0, 0, 0, 14, 0, 0, 0),
    "R": (30, 17, 17, 30, 20, 18, 17),
    "k": (16, 16, 18, 20, 24, 20, 18),
    "n": (0, 0, 22, 25, 17, 17, 17),
    "s": (0, 0, 15, 16, 14, 1, 30),
    "p": (0, 0, 30, 17, 30, 16, 16),
    "m": (0, 0, 26, 21, 21, 21, 21),
    "θ": (14, 17, 17, 31, 17, 17, 14),
    "λ": (8, 4, 4, 10, 10, 17, 17),
    "°": (12, 18, 18, 12, 0, 0, 0),
    "(": (2, 4, 8, 8, 8, 4, 2),
    ")": (8, 4, 2, 2, 2, 4, 8),
    " ": (0, 0, 0, 0, 0, 0, 0),
}

# Icons are never freed while the add-on runs, since a region may still show one: a few are used over and over.
SLOTS = 8
_icons = None
_made = OrderedDict()


class Shown(NamedTuple):
    """What a picture is of.

    interface:    the media
    wavelength:   in vacuum, nanometres, of R over the angle of incidence; of no weight for real media
    by_wavelength: n, k and R over the wavelength instead, which is marked there
    angle:        of incidence, radians, that is marked on the curve over the angle; None for no mark
    from_inside:  whether the light that it is of comes from inside
    """

    interface: Interface
    wavelength: float = REPRESENTATIVE_NM
    by_wavelength: bool = False
    angle: float | None = None
    from_inside: bool = False

    @property
    def probed(self) -> Interface:
        """The interface as the light of the mark meets it: from its outside, at the wavelength."""
        there = self.interface.at(self.wavelength)
        return there.reversed() if self.from_inside else there


def picture(shown: Shown, size: int, scale: float = 1.0) -> NDArray:
    """The picture, of `size` pixels a side; `scale` is of the lines and letters.

    Returns (size, size, 4) float32, row 0 at the bottom, as Blender's images are. Raises ValueError where a medium is not
    known at the wavelength.
    """
    draw = _by_wavelength if shown.by_wavelength else _by_angle
    # while the mark is dragged the lines stay
    plot = draw(shown.interface, REPRESENTATIVE_NM if shown.by_wavelength else shown.wavelength, size, scale)
    plot = plot.copy()
    if shown.angle is None:
        return plot.image
    if shown.by_wavelength:
        first, last = VISIBLE_NM
        plot.probe(
            (shown.wavelength - first) / (last - first), float(shown.interface.at(shown.wavelength).fresnel(1.0).R)
        )
    else:
        plot.probe(shown.angle / (np.pi / 2), float(shown.probed.fresnel(max(0.0, math.cos(shown.angle))).R))
    return plot.image


class _Plot:
    """An image with the place of the axes in it."""

    def __init__(self, size, scale):
        self.image = np.ones((size, size, 4), np.float32)
        self.image[..., :3] = GROUND
        self.scale, self.dot = scale, max(1, round(scale))
        self.left, self.bottom = 24 * self.dot, 27 * self.dot
        self.right, self.top = size - 8 * self.dot, size - 18 * self.dot

    def copy(self):
        """One to draw on that leaves this one as it is."""
        other = copy.copy(self)
        other.image = self.image.copy()
        return other

    def place(self, x, y):
        """Pixels of parts of the axes, 0 to 1."""
        return self.left + x * (self.right - self.left), self.bottom + y * (self.top - self.bottom)

    def mark_x(self, x, text):
        """A line of the grid upwards, with its number below."""
        column = round(self.place(x, 0)[0])
        self.image[self.bottom : self.top + 1, column : column + self.dot, :3] = GRID
        self.write(text, column - 3 * self.dot * len(text) + self.dot, self.bottom - 12 * self.dot, TEXT)

    def mark_y(self, y, text):
        """A line of the grid across, with its number on the left."""
        row = round(self.place(0, y)[1])
        self.image[row : row + self.dot, self.left : self.right + 1, :3] = GRID
        self.write(text, self.left - (6 * len(text) + 3) * self.dot, row - 3 * self.dot, TEXT)

    def name(self, *curves):
        """The names of the curves, in their colours, above the axes."""
        x = self.left
        for text, color in curves:
            self.write(text[:1], x, self.top + 7 * self.dot, color)
            self.write(text[1:], x + 6 * self.dot, self.top + 5 * self.dot, color)  # lower, as an index
            x += (6 * len(text) + 8) * self.dot

    def title(self, text):
        """What the axis across is, below its numbers."""
        middle = (self.left + self.right) // 2
        self.write(text, middle - 3 * self.dot * len(text), self.bottom - 24 * self.dot, TEXT)

    def probe(self, x, y):
        """A mark on a curve, and the line upwards through it."""
        column, row = self.place(x, y)
        self.image[self.bottom : self.top + 1, round(column) : round(column) + self.dot, :3] = PROBE_COLOR
        self._disc(column, row, 4.5 * self.scale, GROUND)
        self._disc(column, row, 3.2 * self.scale, PROBE_COLOR)

    def _disc(self, x, y, radius, color):
        reach = math.ceil(radius + 1)
        top, left = max(0, round(y) - reach), max(0, round(x) - reach)
        part = self.image[top : round(y) + reach + 1, left : round(x) + reach + 1, :3]
        rows, columns = np.indices(part.shape[:2])
        cover = np.clip(radius + 0.5 - np.hypot(columns + left - x, rows + top - y), 0, 1)[..., None].astype(np.float32)
        part += cover * (np.array(color, np.float32) - part)

    def write(self, text, x, y, color):
        """Letters from a pixel on."""
        _write(self.image, text, x, y, self.dot, color)

    def curve(self, x, y, width, color, dash=None):
        """A line through points in parts of the axes; its width, and its gaps, in units of the scale."""
        _curve(self.image, *self.place(x, y), width * self.scale, color, dash and dash * self.scale)


@functools.lru_cache(maxsize=8)
def _by_angle(interface: Interface, wavelength: float, size: int, scale: float) -> _Plot:
    """R(theta_i), R_s and R_p from outside, and R from inside (grey, dashed), over 0 to 90 degrees."""
    plot = _Plot(size, scale)
    for degrees in (0, 30, 60, 90):
        plot.mark_x(degrees / 90, str(degrees))
    for value in (0, 0.5, 1):
        plot.mark_y(value, f"{value:g}")
    plot.title("θ (°)")
    plot.name(("R", R_COLOR), ("Rs", S_COLOR), ("Rp", P_COLOR))
    there = interface.at(wavelength)
    cos, x = np.cos(ANGLES), ANGLES / (np.pi / 2)
    ahead, back = there.fresnel(cos), there.reversed().fresnel(cos)
    plot.curve(x, back.R, 1.3, BACK_COLOR, dash=8)
    plot.curve(x, ahead.R_s, 1.3, S_COLOR)
    plot.curve(x, ahead.R_p, 1.3, P_COLOR)
    plot.curve(x, ahead.R, 2.0, R_COLOR)
    return plot


@functools.lru_cache(maxsize=8)
def _by_wavelength(interface: Interface, _wavelength: float, size: int, scale: float) -> _Plot:
    """R at normal incidence (white, 0 to 1 on the left), and n and k (on the right), over the visible wavelengths.

    Where both media are known; with the colours of the wavelengths below.
    """
    plot = _Plot(size, scale)
    nm, n, k, R = spectrum(interface)
    with_k = k.max() >= LEAST_K
    marks = _marks(*((min(n.min(), k.min()), max(n.max(), k.max())) if with_k else (n.min(), n.max())))
    texts = [f"{mark:.4g}" for mark in marks]
    plot.right -= (6 * max(map(len, texts)) - 3) * plot.dot
    first, last = VISIBLE_NM
    for wavelength in (400, 500, 600, 700):
        plot.mark_x((wavelength - first) / (last - first), str(wavelength))
    plot.title("λ (nm)")
    columns = np.arange(plot.left, plot.right + 1)
    colours = encoded(of_wavelength(np.linspace(first, last, len(columns))))
    plot.image[plot.bottom - 3 * plot.dot : plot.bottom, columns, :3] = colours
    for value in (0, 0.5, 1):
        plot.mark_y(value, f"{value:g}")
    low, high = marks[0], marks[-1]
    for mark, text in zip(marks, texts, strict=True):
        row = round(plot.place(0, (mark - low) / (high - low))[1])
        plot.write(text, plot.right + 4 * plot.dot, row - 3 * plot.dot, N_COLOR)
    plot.name(("R", R_COLOR), ("n", N_COLOR), *([("k", K_COLOR)] if with_k else []))
    x = (nm - first) / (last - first)
    if with_k:
        plot.curve(x, (k - low) / (high - low), 1.6, K_COLOR)
    plot.curve(x, (n - low) / (high - low), 1.6, N_COLOR)
    plot.curve(x, R, 2.0, R_COLOR)
    return plot


def spectrum(interface: Interface) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Wavelengths (N,), nanometres, and n and k of the medium that disperses, and R at normal incidence, (N,) each.

    Of the visible, where both media are known; n and k of the inside where both disperse, or none does.
    """
    of = 1 if interface.outside.dispersion and not interface.inside.dispersion else 0
    ranges = [medium.dispersion.range_nm for medium in (interface.inside, interface.outside) if medium.dispersion]
    least, most = max([least for least, _ in ranges], default=0), min([most for _, most in ranges], default=math.inf)
    nm = np.array([wavelength for wavelength in WAVELENGTHS if least <= wavelength <= most])
    there = [interface.at(wavelength) for wavelength in nm.tolist()]
    media = [(one.inside, one.outside)[of] for one in there]
    n, k = np.transpose([(medium.n, medium.k) for medium in media])
    R = np.array([float(one.fresnel(1.0).R) for one in there])
    return nm, n, k, R


def _marks(low, high):
    """Three round numbers, the first and the last of which hold all between low and high."""
    spread = max(high - low, 0.02 * max(abs(low), abs(high)), 1e-3)
    ten = 10.0 ** math.floor(math.log10(spread / 2))
    steps = (step * power for power in (ten, 10 * ten) for step in (1, 2, 2.5, 5))
    step = next(step for step in steps if math.floor(low / step + 1e-9) * step + 2 * step >= high - 1e-9 * step)
    first = math.floor(low / step + 1e-9) * step
    return first + 0.0, first + step + 0.0, first + 2 * step + 0.0


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


def icon(shown: Shown, size: int, scale: float = 1.0) -> int:
    """The icon number of picture(shown, size, scale); the last one's until it is made, by the time of a redraw."""
    key = (shown, size, scale)
    if key in _made:
        _made.move_to_end(key)
        return _made[key].icon_id
    deferred.do(_make, key)
    newest = next(reversed(_made), None)
    return _made[newest].icon_id if newest else 0


def _make(key):
    free = len(_made) < SLOTS
    preview = _icons.new(str(len(_made))) if free else _made.popitem(last=False)[1]
    preview.image_size = key[1:2] * 2
    preview.image_pixels_float.foreach_set(picture(*key).ravel())
    _made[key] = preview


def register():
    """Make room for the icons."""
    global _icons
    _icons = bpy.utils.previews.new()


def unregister():
    """Free them."""
    global _icons
    bpy.utils.previews.remove(_icons)
    _icons = None
    _made.clear()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The ray diagram of a drop: where light goes that is reflected in it never, once or twice. No bpy."""

import math
from collections.abc import Callable

import numpy as np

from ..physics import Interface, Medium, deviation
from ..physics.rays import Kind, Paths, Shapes, Sphere, trace
from . import diagram_parts as parts
from .diagram_paths import AIR
from .drawing import GREY, INK, number

ORDERS = 0, 1, 2  # how often light is reflected within
SOURCE, REACH = 2.9, 6.0  # where light starts, left of the drop's middle, and how far it goes on: in radii
HEIGHTS = 0.05, 0.97  # of parallel light, from the axis upwards: at 1 a ray touches and no more
STRAIGHT_ON = 0.35  # the height of the ray that is drawn for the order that has no bow
ENDS = 400.0, 700.0  # nanometres


def order_paths(medium: Medium, height: float, order: int) -> Paths:
    """Of a ray to the right at a height, nothing but its way through the drop with `order` reflections within."""
    surfaces = Shapes(Sphere((0, 0, 0), 1.0, Interface(medium, AIR)))
    paths = trace(surfaces, (-SOURCE, height, 0), (1, 0, 0), bounces=order + 2, least=0.0, reach=REACH)
    way = [0]
    for kind in (Kind.TRANSMITTED, *[Kind.REFLECTED] * order, Kind.TRANSMITTED):
        way += np.flatnonzero((paths.parent == way[-1]) & (paths.kind == kind)).tolist()
    chosen = Paths(*(column[way] for column in paths[:-1]), paths.lost)
    return chosen._replace(parent=np.arange(-1, len(way) - 1))


def joined(*several: Paths) -> Paths:
    """Paths of several rays as one."""
    starts = np.cumsum([0] + [len(paths.ray) for paths in several])[:-1]
    columns = {name: np.concatenate([getattr(paths, name) for paths in several]) for name in Paths._fields}
    columns["ray"] = np.concatenate([np.full(len(paths.ray), number) for number, paths in enumerate(several)])
    columns["parent"] = np.concatenate(
        [np.where(paths.parent < 0, -1, paths.parent + start) for paths, start in zip(several, starts, strict=True)]
    )
    return Paths(**columns)


def drop_paths(medium: Medium, heights) -> Paths:
    """Of rays to the right at heights (N,), their ways through the drop of all ORDERS."""
    return joined(*(order_paths(medium, height, order) for height in heights for order in ORDERS))


def entries(n: float) -> tuple[float, ...]:
    """The height of the ray that stands for each of ORDERS: that of its bow, or, for a NIM, of what comes straight back.

    Of both bows one enters below the axis, so that they are seen from the same side.
    """
    back = deviation.glory(n)
    if back is not None:
        return (back, -STRAIGHT_ON, STRAIGHT_ON)
    bows = [deviation.bow(n, order) for order in ORDERS[1:]]
    heights = [math.sin(bow.incidence) if bow else STRAIGHT_ON for bow in bows]
    return (STRAIGHT_ON, heights[0], -heights[1])


def draw_drop(ax, title: str, medium: Medium, rays: int, widest: float, *, spectrum: bool = False) -> Paths:
    """Draw the diagram on axes, as diagrams.SCENES has it; returns the Paths of all that is drawn."""
    from matplotlib.patches import Circle

    parts.view(ax, -3.0, 2.2, -2.45, 1.25)
    ax.add_patch(Circle((0, 0), 1, facecolor=parts.tint(medium), edgecolor=INK, linewidth=0.9, zorder=1))
    ax.plot([-3.0, 2.2], [0, 0], color=GREY, linewidth=0.6, linestyle=(0, (8, 2.5, 1.5, 2.5)), zorder=2)
    if spectrum:
        heights = entries(medium.n)
        paths = parts.draw_spectrum(ax, _orders_at(heights), medium, widest=widest)
        _name_orders(ax, medium, paths, heights)
    else:
        heights = np.linspace(*HEIGHTS, rays) if rays > 1 else np.array([abs(entries(medium.n)[1])])
        paths = drop_paths(medium, heights)
        parts.draw_paths(ax, paths, widest=widest)
        if rays == 1:
            _name_orders(ax, medium, paths, np.repeat(heights, len(ORDERS)))
    parts.head(ax, title, medium)
    return paths


def _orders_at(heights) -> Callable[[Medium], Paths]:
    def paths(medium):
        each = zip(heights, ORDERS, strict=True)
        ways = joined(*(order_paths(medium, height, order) for height, order in each))
        # a fiftieth of the light that was reflected twice is not seen as a line: all are drawn alike
        return ways._replace(energy=np.ones_like(ways.energy))

    return paths


def _name_orders(ax, medium, paths, heights):
    """Beside the light of each order as it leaves, how often it was reflected, and the radius of its bow, if it is that."""
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    for ray, (order, height) in enumerate(zip(ORDERS, heights, strict=True)):
        last = np.flatnonzero(paths.ray == ray)[-1]
        start, d = paths.start[last][:2], paths.direction[last][:2]
        with np.errstate(divide="ignore"):
            ways = np.concatenate([(low - start) / d, (high - start) / d])
        aside = np.array([-d[1], d[0]]) * (-1 if d[0] > 0 else 1)  # downwards
        place = start + 0.62 * min(ways[ways > 0]) * d + 0.2 * aside
        own = deviation.bow(medium.n, order) if order else None
        angles = []
        if own and abs(height) == math.sin(own.incidence):
            bows = [deviation.bow(parts.transparent_at(medium, end).n, order) for end in ENDS]
            angles = [number(round(math.degrees(bow.radius), 1)) for bow in bows if bow]
        text = f"$k$ = {order}" + (f": {' to '.join(dict.fromkeys(angles))}°" if angles else "")
        middle = abs(d[0]) > 2 * abs(d[1])
        side = "center" if middle else "left" if aside[0] > 0 else "right"
        ax.text(*place, text, ha=side, va="top" if middle else "center", **parts.LABEL)

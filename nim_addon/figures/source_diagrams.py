# SPDX-License-Identifier: GPL-3.0-or-later
"""The ray diagrams of a point source: before a flat lens, and over a pool, with the caustics that its rays touch. No bpy."""

import math

import numpy as np

from ..physics import REPRESENTATIVE_NM, Interface, Medium, flat_lens, half_space
from ..physics.rays import Convex, Paths, Plane, Shapes, trace
from . import diagram_parts as parts
from .diagram_paths import AIR, FAINTEST_DRAWN
from .drawing import GREEN, GREY, INK

DISTANCE, THICKNESS = 0.5, 1.0  # of the source from the lens
HEIGHT, FLOOR = 0.5, 1.45  # of the lamp over the surface, and how deep the pool is
WIDEST_LENS, WIDEST_LAMP = 50.0, 66.0  # degrees of the fans
AXIS = {"color": GREY, "linewidth": 0.8, "linestyle": (0, (3, 2)), "zorder": 3}


def lens_paths(medium: Medium, degrees: np.ndarray) -> Paths:
    """Of rays from the source to the right, `degrees` (N,) from the axis, through the plate from x = 0 to THICKNESS."""
    theta = np.radians(degrees)
    plate = Convex(((0, 0, 0), (THICKNESS, 0, 0)), ((-1, 0, 0), (1, 0, 0)), Interface(medium, AIR))
    return _traced((plate,), (-DISTANCE, 0, 0), np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=-1))


def lamp_paths(medium: Medium, degrees: np.ndarray) -> Paths:
    """Of rays from a lamp down to the surface y = 0, `degrees` (N,) from the vertical, and on to the floor."""
    theta = np.radians(degrees)
    pool = Plane((0, 0, 0), (0, 1, 0), Interface(medium, AIR)), Plane((0, -FLOOR, 0), (0, 1, 0))
    return _traced(pool, (0, HEIGHT, 0), np.stack([np.sin(theta), -np.cos(theta), 0 * theta], axis=-1))


def _traced(shapes, source, directions):
    return trace(Shapes(*shapes), source, directions, reach=20.0, least=FAINTEST_DRAWN)


def angles(n: float) -> np.ndarray:
    """Angles (N,), radians, of the rays whose points of a caustic are drawn."""
    widest = math.asin(min(1.0, abs(n))) - 1e-3
    return np.linspace(-widest, widest, 801)


def draw_lens(ax, title: str, medium: Medium, rays: int, widest: float, *, spectrum: bool = False) -> Paths:
    """Draw the diagram on axes, as diagrams.SCENES has it; returns the Paths of all that is drawn."""
    from matplotlib.patches import Rectangle

    left, right, bottom, top = -0.95, 2.75, -1.25, 1.25
    parts.view(ax, left, right, bottom, top)
    degrees = np.linspace(-WIDEST_LENS, WIDEST_LENS, rays) if rays > 1 else np.array([35.0])
    paths = parts.draw_light(ax, lambda at: lens_paths(at, degrees), medium, widest, spectrum)
    ax.add_patch(Rectangle((0, bottom), THICKNESS, top - bottom, facecolor=parts.tint(medium), linewidth=0, zorder=1))
    for x in (0, THICKNESS):
        ax.plot([x, x], [bottom, top], color=INK, linewidth=0.9, zorder=2)
    ax.plot([left, right], [0, 0], **AXIS)
    ax.plot(-DISTANCE, 0, "o", color=INK, markersize=5.5, zorder=6)
    touched = []
    if not spectrum:
        n = medium.at(REPRESENTATIVE_NM).n
        within, behind = -n * DISTANCE, float(flat_lens.image(n, THICKNESS, DISTANCE))
        if 0 < within < THICKNESS:
            _mark(ax, within, 0)
        if behind > 0:
            _mark(ax, THICKNESS + behind, 0)
        aside, behind = flat_lens.caustic(n, angles(n), THICKNESS, DISTANCE)
        touched = _caustic(ax, n, THICKNESS + behind, aside, behind > 0)
    parts.head(ax, title, medium, *touched)
    return paths


def draw_lamp(ax, title: str, medium: Medium, rays: int, widest: float, *, spectrum: bool = False) -> Paths:
    """Draw the diagram on axes, as diagrams.SCENES has it; returns the Paths of all that is drawn."""
    from matplotlib.patches import Rectangle

    left, right, bottom, top = -1.95, 1.95, -1.6, 0.95
    parts.view(ax, left, right, bottom, top)
    degrees = np.linspace(-WIDEST_LAMP, WIDEST_LAMP, rays) if rays > 1 else np.array([40.0])
    paths = parts.draw_light(ax, lambda at: lamp_paths(at, degrees), medium, widest, spectrum)
    ax.add_patch(Rectangle((left, -FLOOR), right - left, FLOOR, facecolor=parts.tint(medium), linewidth=0, zorder=1))
    for y in (0, -FLOOR):
        ax.plot([left, right], [y, y], color=INK, linewidth=0.9, zorder=2)
    ax.plot([0, 0], [bottom, top], **AXIS)
    ax.plot(0, HEIGHT, "o", color=INK, markersize=5.5, zorder=6)
    touched = []
    if rays == 1 and not spectrum:
        parts.draw_angles(ax, paths, 0, (0, 1, 0), 0.2, 0.45)
    if not spectrum:
        n = medium.at(REPRESENTATIVE_NM).n
        aside, depth = half_space.caustic(n, angles(n), HEIGHT)
        touched = _caustic(ax, n, aside, -depth, (depth > 0) & (depth < FLOOR))
    parts.head(ax, title, medium, *touched)
    return paths


def _mark(ax, x, y):
    ax.plot(x, y, "o", color=INK, markerfacecolor="white", markersize=4.5, zorder=6)


def _caustic(ax, n, x, y, real):
    """Draw a caustic (N,) where light does meet, or dashed where it only seems to; returns what names it, if it is a curve."""
    if n == -1:
        return []
    style = {"color": GREEN, "linewidth": 1.8, "zorder": 5, "solid_capstyle": "butt"}
    apparent = {"linewidth": 1.2, "linestyle": (0, (2, 1.5))}
    if real.any():
        return ax.plot(np.where(real, x, np.nan), np.where(real, y, np.nan), label="caustic", **style)
    return ax.plot(x, y, label="caustic, apparent", **style | apparent)

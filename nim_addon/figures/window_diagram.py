# SPDX-License-Identifier: GPL-3.0-or-later
"""The diagrams of a window: light of a point behind lenslets and where it seems to come from, or twice through a slab."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ..physics.lenslet import LensletWindow, Pane
from ..physics.rays import Kind, Paths, Plane, Shapes, trace
from ..physics.uniaxial import Plate, UniaxialSlab
from . import diagram_parts as parts
from .drawing import BLUE, GREY, INK, ORANGE, known_suffix, look, number, save, sheet

DEPTH, REACH = 1.5, 9.0  # of the point that shines, behind the window; how far light is followed
LOW = -1.25  # where it is before a slab, whose rays all go up
RAYS, MOST_RAYS = 9, 101
WIDEST = 1.6
STEEPEST = {"lenslets": 32.0, "slab": 62.0}  # degrees
VIEW = -3.1, 3.1, -1.75, 1.75
TINT = "#f4e3bf"


def rays_of(law: LensletWindow | UniaxialSlab, rays: int) -> tuple[Paths, np.ndarray]:
    """The Paths of light of a point at x = -DEPTH through a window along x = 0, or a slab from there on; its angles (N,).

    The window is looked at from x > 0, its front; the slab is met from before.
    """
    if isinstance(law, LensletWindow):
        surfaces = Shapes(Plane((0, 0, 0), (1, 0, 0), Pane(law, ((0, 1, 0), (0, 0, 1)))))
        steepest = math.radians(STEEPEST["lenslets"])
        angles = np.linspace(-steepest, steepest, rays) if rays > 1 else np.array([steepest / 2])
    else:
        plate, d = Plate(law), law.thickness
        surfaces = Shapes(Plane((0, 0, 0), (-1, 0, 0), plate), Plane((d, 0, 0), (1, 0, 0), plate))
        steepest = math.radians(STEEPEST["slab"])
        angles = np.linspace(steepest / rays, steepest, rays)
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    return trace(surfaces, (-DEPTH, _height(law), 0), directions, reach=REACH, bounces=3), angles


def _height(law):
    return 0.0 if isinstance(law, LensletWindow) else LOW


def draw_window(ax, law: LensletWindow | UniaxialSlab, rays: int) -> Paths:
    """Draw the diagram on axes; returns the Paths."""
    parts.view(ax, *VIEW)
    paths, angles = rays_of(law, rays)
    if isinstance(law, LensletWindow):
        _lenslets(ax, law, paths)
    else:
        _slab(ax, law, paths, angles)
    ax.plot(-DEPTH, _height(law), "o", color=INK, markersize=4.5, zorder=6)
    ax.set_title(title_of(law), pad=5)
    return paths


def title_of(law: LensletWindow | UniaxialSlab) -> str:
    """What a diagram of it is called."""
    if isinstance(law, LensletWindow):
        return f"Lenslets of $\\eta$ = {number(law.eta[0])}: a point behind them, and its image"
    kind = "A hyperbolic slab" if law.is_hyperbolic else "A uniaxial slab"
    return f"{kind}, $\\epsilon$ = {number(law.across)} across and {number(law.along)} along: all is seen twice"


def _lenslets(ax, law, paths):
    for side in (-0.04, 0.04):
        ax.plot([side, side], VIEW[2:], color=INK, linewidth=0.8, zorder=3)
    for kind, colour in ((Kind.INCIDENT, INK), (Kind.TRANSMITTED, BLUE)):
        for row in np.flatnonzero(paths.kind == kind):
            _line(ax, paths, row, colour)
    place = -float(law.image_depth(DEPTH))
    for row in np.flatnonzero(paths.kind == Kind.TRANSMITTED):
        start, step = paths.start[row, :2], paths.direction[row, :2]
        there = start + (place - start[0]) / step[0] * step
        if place < 0:  # behind the window it only seems to come from there
            ax.plot(*np.stack([start, there]).T, color=GREY, linewidth=0.7, linestyle=(0, (4, 3)), zorder=2)
    ax.plot(place, 0, "o", color=INK, markerfacecolor="white", markersize=4.5, zorder=6)


def _slab(ax, law, paths, angles):
    ax.axvspan(0, law.thickness, color=TINT, zorder=1, linewidth=0)
    slopes = law.slopes(np.abs(angles))
    # a way within is s or p as its slope says, and what follows it is the same
    names = {}
    for row in np.flatnonzero(paths.kind == Kind.TRANSMITTED):
        parent = paths.parent[row]
        if parent in names:
            names[row] = names[parent]
            continue
        step = paths.end[row] - paths.start[row]
        off = [abs(step[1] / step[0] - slope[paths.ray[row]]) for slope in slopes]
        names[row] = "s" if np.nan_to_num(off[0], nan=np.inf) < np.nan_to_num(off[1], nan=np.inf) else "p"
    for row in range(len(paths.start)):
        colour = {"s": ORANGE, "p": BLUE}.get(names.get(row, ""), INK)
        if paths.kind[row] == Kind.REFLECTED:
            ax.plot(*paths_line(paths, row), color=GREY, linewidth=WIDEST * math.sqrt(paths.energy[row]), zorder=2)
        else:
            _line(ax, paths, row, colour)
    handles = [
        ax.plot([], [], color=colour, label=label)[0]
        for label, colour in (("s", ORANGE), ("p", BLUE), ("reflected", GREY))
    ]
    ax.legend(handles=handles, loc="lower right", fontsize=8, borderpad=0.2)


def paths_line(paths: Paths, row: int) -> np.ndarray:
    """(2, 2) x and y of where a segment of Paths starts and ends."""
    return np.stack([paths.start[row, :2], paths.end[row, :2]]).T


def _line(ax, paths, row, colour):
    ax.plot(
        *paths_line(paths, row), color=colour, linewidth=WIDEST * math.sqrt(paths.energy[row]), zorder=4, clip_on=True
    )


def diagram(law: LensletWindow | UniaxialSlab, rays: int = RAYS, file: str | Path = "rays.svg") -> Path:
    """Draw the rays through a window or a slab into a file, .svg, .png or .pdf; returns its Path.

    Raises ValueError for what it cannot draw, RuntimeError where matplotlib is missing, OSError where it cannot write.
    """
    if not isinstance(rays, int) or not 1 <= rays <= MOST_RAYS:
        raise ValueError(f"rays = {rays} is not a whole number from 1 to {MOST_RAYS}.")
    known_suffix(file)
    with look():
        figure, axes = sheet(6.3, 4.0)
        figure.subplots_adjust(0.01, 0.01, 0.99, 0.91)
        draw_window(axes[0, 0], law, rays)
        return save(figure, title_of(law), file)[0]

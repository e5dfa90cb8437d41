# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray diagrams in a plane, for teaching: where the light goes, and how much of it (thesis 5.8, B.1)."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..physics import REPRESENTATIVE_NM, Interface, Medium
from ..physics.deviation import apex_for, incidence_for
from ..physics.rays import Fate, Kind, Paths
from . import diagram_parts as parts
from .diagram_claims import pool_claims, sphere_claims
from .diagram_paths import (
    AIR,
    APEX,
    BEAMS,
    DEPTH,
    FLOOR,
    PRISM,
    PRISM_SLOPE,
    STEEPEST,
    focal_length,
    pool_paths,
    prism_paths,
    slab_paths,
    sphere_paths,
    transmitted_way,
    upright_prism,
    upright_prism_paths,
)
from .drawing import BLUE, GREY, INK, known_suffix, look, save, sheet
from .drop_diagram import draw_drop
from .recipes import drawn_figure
from .source_diagrams import draw_lamp, draw_lens

MOST_RAYS = 101

# --- the scenes: each draws on axes and returns the Paths -------------------------------------------------------------


def _draw_sphere(ax, title, medium, rays, widest, *, spectrum=False, beam=BEAMS[0]):
    from matplotlib.patches import Circle

    parts.view(ax, -2.15, 2.35, -1.55, 1.55)
    heights = np.linspace(beam.low, beam.high, rays) if rays > 1 else np.array([0.5])
    paths = parts.draw_light(ax, lambda at: sphere_paths(at, heights), medium, widest, spectrum)
    ax.add_patch(Circle((0, 0), 1, facecolor=parts.tint(medium), edgecolor=INK, linewidth=0.9, zorder=1))
    ax.plot([-2.0, 2.35], [0, 0], color=GREY, linewidth=0.6, linestyle=(0, (8, 2.5, 1.5, 2.5)), zorder=2)
    ax.plot(0, 0, "o", color=INK, markersize=3, zorder=5)
    if rays > 1:
        ax.plot([-2.0, -2.0], [beam.low - 0.04, beam.high + 0.04], color=INK, linewidth=2.2, zorder=5)
    if rays == 1:
        main = transmitted_way(paths, 0)
        points = [paths.end[i] for i in main if paths.fate[i] == Fate.SPLIT][:2]
        parts.draw_normals(ax, points[1:], points[1:], 0.42)
        if spectrum:
            parts.draw_normals(ax, points[:1], points[:1], 0.42)
        else:
            parts.draw_angles(ax, paths, main[0], points[0], 0.26, 0.42)
    else:
        hits = paths.end[(paths.kind == Kind.INCIDENT) & (paths.fate == Fate.SPLIT)]
        parts.draw_normals(ax, hits[-1:], hits[-1:], 0.35)
        if not spectrum:  # of which each colour has its own
            _mark_focus(ax, paths, medium, beam)
    parts.head(ax, title, medium)
    return paths


def _mark_focus(ax, paths, medium, beam):
    """The paraxial focus F of a narrow beam, and dotted back to it the rays that only seem to come from there."""
    focus = focal_length(medium.n)
    left, right = ax.get_xlim()
    if focus is None or not left < focus < right or max(abs(beam.low), abs(beam.high)) > 0.5:
        return
    if focus < 1:
        for ray in range(beam.rays):
            point, ahead = (column[transmitted_way(paths, ray)[-1]][:2] for column in (paths.start, paths.direction))
            if ahead[0] > 0:
                ends = np.stack([point, point + (focus - point[0]) / ahead[0] * ahead])
                ax.plot(*ends.T, color=BLUE, linewidth=0.9, linestyle=(0, (1, 1.6)), zorder=3)
    ax.plot(focus, 0, "o", color=INK, markerfacecolor="white", markersize=4, zorder=6)
    ax.text(
        focus,
        -0.13,
        "F",
        ha="center",
        va="top",
        bbox={"pad": 0.6, "color": parts.tint(medium) if focus < 1 else "white"},
        **parts.LABEL,
    )


def _draw_pool(ax, title, medium, rays, widest, *, spectrum=False):
    from matplotlib.patches import Rectangle

    left, right, bottom, top = -2.35, 2.35, -1.56, 1.75
    parts.view(ax, left, right, bottom, top)
    # a few rays meet the surface within the view, two and three of them within the window of water
    widest_fan = STEEPEST if rays > 7 else min(15.0 * rays, 60.0)
    degrees = np.linspace(-widest_fan, widest_fan, rays) if rays > 1 else np.array([30.0])
    paths = parts.draw_light(ax, lambda at: pool_paths(at, degrees), medium, widest, spectrum)
    ax.add_patch(Rectangle((left, -FLOOR), right - left, FLOOR, facecolor=parts.tint(medium), linewidth=0, zorder=1))
    # strokes rather than a hatch, which simple viewers fill with black
    for x in np.arange(left, right - 0.05, 0.09):
        ax.plot([x, x + 0.07], [-FLOOR - 0.12, -FLOOR], color=GREY, linewidth=0.6, solid_capstyle="butt", zorder=1)
    for y in (0, -FLOOR):
        ax.plot([left, right], [y, y], color=INK, linewidth=0.9, zorder=2)
    ax.plot(0, -DEPTH, "o", color=INK, markersize=5.5, zorder=6)
    window = []
    if rays == 1 and not spectrum:
        parts.draw_angles(ax, paths, 0, (0, 1, 0), 0.34, 0.75)
    elif not spectrum:
        ax.plot([0, 0], [-DEPTH, top], color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=3)
        critical = Interface(AIR, medium).critical_angle()
        if critical is not None and math.tan(critical) * DEPTH < right:
            edge = math.tan(critical) * DEPTH
            window = ax.plot([-edge, edge], [0, 0], color=INK, linewidth=3.0, solid_capstyle="butt", zorder=5)
            window[0].set_label(f"window to {math.degrees(critical):.2f}°")
    parts.head(ax, title, medium, *window)
    return paths


def _draw_slab(ax, title, medium, rays, widest, *, spectrum=False):
    from matplotlib.patches import Rectangle

    left, right, bottom, top = -1.15, 2.65, -1.3, 1.3
    parts.view(ax, left, right, bottom, top)
    degrees = np.linspace(-40, 40, rays) if rays > 1 else np.array([40.0])
    source = (-0.5, 0, 0) if rays > 1 else (-0.9, -0.9 * math.tan(math.radians(degrees[0])), 0)
    paths = parts.draw_light(ax, lambda at: slab_paths(at, source, degrees), medium, widest, spectrum)
    ax.add_patch(Rectangle((0, bottom), 1, top - bottom, facecolor=parts.tint(medium), linewidth=0, zorder=1))
    for x in (0, 1):
        ax.plot([x, x], [bottom, top], color=INK, linewidth=0.9, zorder=2)
    main = transmitted_way(paths, 0)
    if rays == 1 and not spectrum:
        points = [paths.end[i] for i in main if paths.fate[i] == Fate.SPLIT]
        parts.draw_normals(ax, points[1:], [np.array([1.0, 0, 0])] * len(points[1:]), 0.5)
        parts.draw_angles(ax, paths, main[0], (1, 0, 0), 0.3, 0.5)
    else:
        ax.plot([left, right], [0, 0], color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=3)
        ax.plot(*source[:2], "o", color=INK, markersize=5.5, zorder=6)
    parts.head(ax, title, medium)
    return paths


def _draw_prism(ax, title, medium, rays, widest, *, spectrum=False):
    from matplotlib.patches import Polygon

    if spectrum:
        return _draw_dispersion(ax, title, medium, rays, widest)

    left, right, bottom, top = -1.45, 2.75, -1.35, 1.7
    parts.view(ax, left, right, bottom, top)
    heights = np.linspace(-0.35, 0.55, rays) if rays > 1 else np.array([-0.1])
    paths = parts.draw_light(ax, lambda at: prism_paths(at, heights), medium, widest, False)
    corners = [(0, -PRISM), (0, PRISM), (2 * PRISM * math.tan(APEX), -PRISM)]
    ax.add_patch(
        Polygon(corners, facecolor=parts.tint(medium), edgecolor=INK, linewidth=0.9, joinstyle="round", zorder=1)
    )
    main = transmitted_way(paths, rays // 2)
    if len(main) == 1:  # as good as all light turns back at the first face
        parts.draw_normals(ax, [paths.end[main[0]]], [np.array([1.0, 0, 0])], 0.5)
    elif rays == 1:
        parts.draw_angles(ax, paths, main[1], PRISM_SLOPE, 0.3, 0.7)
    else:
        parts.draw_normals(ax, [paths.end[main[1]]], [np.array(PRISM_SLOPE)], 0.5)
    if rays > 1:
        ax.plot([-1.2, -1.2], [heights[0] - 0.04, heights[-1] + 0.04], color=INK, linewidth=2.2, zorder=5)
    parts.head(ax, title, medium)
    return paths


def _draw_dispersion(ax, title, medium, rays, widest):
    """White light through an upright prism of an apex, and at an incidence, that suit the medium."""
    from matplotlib.patches import Polygon

    parts.view(ax, -2.1, 2.1, -1.6, 1.45)
    apex = apex_for(medium.n)
    incidence = incidence_for(medium.n, apex)
    heights = np.linspace(-0.3, 0.3, rays) if rays > 1 else np.zeros(1)
    paths = parts.draw_light(ax, lambda at: upright_prism_paths(at, apex, incidence, heights), medium, widest, True)
    outline = {"edgecolor": INK, "linewidth": 0.9, "joinstyle": "round", "zorder": 1}
    ax.add_patch(Polygon(upright_prism(apex), facecolor=parts.tint(medium), **outline))
    parts.head(ax, f"{title} of {math.degrees(apex):.0f}°", medium)
    return paths


# --- one diagram a file -----------------------------------------------------------------------------------------------


class Scene(NamedTuple):
    """What diagram() draws: its title with many rays and with one, the index and the number of rays it takes by itself.

    white, white_rays: the title, and that number, where it is the spectrum of white light; disperses: its medium then
    matched: whether mu is the index where nothing else is said, so that little is reflected
    """

    title: str
    title_of_one: str
    n: float
    rays: int
    draw: Callable[..., Paths]
    white: str
    white_rays: int
    disperses: str
    matched: bool = False


SCENES = {
    "sphere": Scene(
        "Parallel light on a sphere",
        "A ray through a sphere",
        -1.5,
        21,
        _draw_sphere,
        "White light on a sphere",
        4,
        "n-bk7",
    ),
    "pool": Scene(
        "Light from under a surface",
        "A ray from under a surface",
        -1.33,
        21,
        _draw_pool,
        "White light from under a surface",
        5,
        "water-daimon",
    ),
    "slab": Scene(
        "Light through a slab",
        "A ray through a slab",
        -1.0,
        11,
        _draw_slab,
        "White light through a slab",
        1,
        "nim-causal",
    ),
    "prism": Scene(
        "Parallel light on a prism of 20°",
        "A ray through a prism of 20°",
        -1.5,
        5,
        _draw_prism,
        "White light through a prism",
        1,
        "n-bk7",
    ),
    "drop": Scene(
        "Parallel light on a drop",
        "A ray through a drop",
        1.33,
        15,
        draw_drop,
        "White light on a drop",
        1,
        "water-daimon",
    ),
    "lens": Scene(
        "A point before a flat lens",
        "A ray through a flat lens",
        -1.0,
        15,
        draw_lens,
        "White light through a flat lens",
        2,
        "nim-causal",
        matched=True,
    ),
    "lamp": Scene(
        "A lamp over a pool",
        "A ray of a lamp over a pool",
        -1.33,
        23,
        draw_lamp,
        "White light of a lamp over a pool",
        2,
        "water-daimon",
    ),
}


def diagram(
    scene: str,
    n: float | None = None,
    mu: float | None = None,
    rays: int | None = None,
    file: str | Path = "rays.svg",
    *,
    inside: Medium | None = None,
    spectrum: bool = False,
) -> Path:
    """Draw the rays through one of SCENES into a file, .svg, .png or .pdf; returns its Path.

    n, mu:    of the medium, by default the scene's index and a mu of 1 or -1, as the index has it, of the lens the index itself
    rays:     how many leave the source, 1 to MOST_RAYS; a single one is drawn with its normals and angles
    inside:   the medium, in the place of n and mu; where it absorbs, the sphere's radius and the slab are 1 m
    spectrum: whether white light is drawn, by its colours, through a medium that disperses, as if nothing were absorbed
    Raises ValueError for what it cannot draw, RuntimeError where matplotlib is missing, OSError where it cannot write.
    """
    if scene not in SCENES:
        raise ValueError(f"there is no ray diagram {str(scene)!r}; there are {', '.join((*SCENES, 'ball', 'window'))}.")
    chosen = SCENES[scene]
    medium = _medium(chosen, n, mu, inside, spectrum)
    rays = (chosen.white_rays if spectrum else chosen.rays) if rays is None else rays
    if not isinstance(rays, int) or not 1 <= rays <= MOST_RAYS:
        raise ValueError(f"rays = {rays} is not a whole number from 1 to {MOST_RAYS}.")
    known_suffix(file)
    with look():
        figure, axes = sheet(6.3, 4.7)
        figure.subplots_adjust(0.01, 0.075, 0.99, 0.93)
        # colours lie close together, and are told apart where each is thin
        widest = (0.9 if spectrum else 1.8) * min(1.0, math.sqrt(21 / rays))
        title = chosen.white if spectrum else chosen.title if rays > 1 else chosen.title_of_one
        chosen.draw(axes[0, 0], title, medium, rays, widest, spectrum=spectrum)
        parts.key(figure, widest, spectrum=spectrum)
        return save(figure, f"{title}, {medium}", file)[0]


def _medium(chosen, n, mu, inside, spectrum):
    """The Medium of a diagram; ValueError where it is none that can be drawn so."""
    if inside is not None and (n is not None or mu is not None):
        raise ValueError("a medium is given once; leave out its index and its permeability, or the medium.")
    if spectrum:
        if inside is None and (n is not None or mu is not None):
            raise ValueError(
                "an index that is one number has no spectrum; give a medium that disperses, such as "
                f"{chosen.disperses} or nim-causal."
            )
        medium = inside or Medium.parse(chosen.disperses)
        if not medium.dispersion:
            raise ValueError(
                f"{medium} is the same at all wavelengths and has no spectrum; give a medium that disperses, such as "
                f"{chosen.disperses} or nim-causal."
            )
        return medium
    n = chosen.n if n is None else n
    medium = inside or Medium(n, n if chosen.matched and mu is None else mu)
    return parts.transparent_at(medium, REPRESENTATIVE_NM, loss=True)


# --- the thesis's figures ---------------------------------------------------------------------------------------------


FIGURE_WIDEST = 1.3  # points, of a line with all of its ray's energy


def draw_pools(folder: Path) -> list[Path]:
    """Draw figure 5.8 into `folder`; returns the Paths of its .svg and .png. RuntimeError where matplotlib is missing."""
    with look():
        drawing, axes = sheet(7.2, 3.05, 1, 2)
        drawing.subplots_adjust(0.01, 0.09, 0.99, 0.92, wspace=0.04)
        for ax, n in zip(axes[0], (1.33, -1.33), strict=True):
            _draw_pool(ax, "", Medium(n), 21, FIGURE_WIDEST)
        return _saved(drawing, POOLS, folder)


def draw_spheres(folder: Path) -> list[Path]:
    """Draw figure B.1, as draw_pools() does 5.8."""
    with look():
        drawing, axes = sheet(6.9, 7.6, 3, 2)
        drawing.subplots_adjust(0.01, 0.045, 0.99, 0.97, wspace=0.04, hspace=0.1)
        for row, beam in zip(axes, BEAMS, strict=True):
            for ax, n in zip(row, (1.5, -1.5), strict=True):
                _draw_sphere(ax, beam.name, Medium(n), beam.rays, FIGURE_WIDEST, beam=beam)
        return _saved(drawing, SPHERES, folder)


def _saved(drawing, heading, folder):
    parts.key(drawing, FIGURE_WIDEST)
    base = Path(folder) / f"figure-{heading[0]}"
    return save(drawing, f"Figure {': '.join(heading)}", f"{base}.svg", f"{base}.png")


# number and title
POOLS = "5.8", "Rays from a point under a surface: they diverge above water and converge above a NIM"
SPHERES = "B.1", "Parallel rays on spheres of index 1.5 and -1.5: a hemisphere, the centre, the edge"

FIGURES = (drawn_figure(*POOLS, pool_claims, draw_pools), drawn_figure(*SPHERES, sphere_claims, draw_spheres))

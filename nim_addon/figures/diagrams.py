# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray diagrams in a plane, for teaching: where the light goes, and how much of it (thesis 5.8, B.1).

All happens in z = 0: x is to the right, y up. The rays are those of physics.rays.trace().
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..physics import MEDIA, Interface, Medium
from ..physics.rays import Convex, Fate, Kind, Plane, Shapes, Sphere, trace
from .claims import Claim
from .drawing import BLUE, GREY, INK, ORANGE, known_suffix, look, matplotlib, number, save, sheet

# figure: what it shows
FIGURES = {
    "5.8": "Rays from a point under a surface: they diverge above water and converge above a NIM",
    "B.1": "Parallel rays on spheres of index 1.5 and -1.5: a hemisphere, the centre, the edge",
}

AIR = Medium(1.0)
MOST_RAYS = 101

DEPTH, FLOOR, STEEPEST = 1.0, 1.4, 75.0  # of the source and of the floor below the surface; degrees of the fan
WIDEST_BEAM = 0.95  # of the sphere's radius: at 1 a ray touches and no more
APEX = math.radians(20)  # of the prism: small enough that indices up to 2.9 let the light out


class Beam(NamedTuple):
    """Parallel rays on a sphere: their heights above its axis, from `low` to `high`, in radii; how many B.1 draws."""

    name: str
    low: float
    high: float
    rays: int


BEAMS = (
    Beam("hemisphere", -WIDEST_BEAM, WIDEST_BEAM, 15),
    Beam("centre", -0.3, 0.3, 7),
    Beam("edge", 0.75, WIDEST_BEAM, 5),
)


# --- what all diagrams share ---------------------------------------------------------------------------------------

_LOOKS = {
    Kind.INCIDENT: (INK, "solid"),
    Kind.TRANSMITTED: (BLUE, "solid"),
    Kind.REFLECTED: (ORANGE, (0, (4.5, 2.0))),
}
_LABEL = {"fontsize": 8.5, "zorder": 6}
_LINE, _GAP = 15, 12  # points of one line of the head; pixels between its title and the media
_NO_LESS = 0.01  # a branch of less energy than this is not drawn


def _width(energy, widest):
    """Points of line weight: the area of a round ray would be its energy, so 4 % is still a line."""
    return widest * np.sqrt(energy)


def _tint(medium):
    """The colour a medium is filled with: blue for n > 0, ochre for n < 0, deeper for what refracts more."""
    depth = 0.16 + 0.16 * min(abs(abs(medium.n) - 1), 1.5) / 1.5
    colour = np.array([0.85, 0.62, 0.20]) if medium.is_nim else np.array([0.25, 0.55, 0.80])
    return tuple(1 - depth * (1 - colour) * 1.2)


def _named(medium):
    """A medium as a diagram names it: "glass, n = 1.5", "NIM, n = -1.33, mu = -10"."""
    names = [name for name in ("air", "water", "glass", "diamond") if MEDIA[name] == medium]
    name = "NIM" if medium.is_nim else names[0] if names else "medium"
    mu = "" if abs(medium.mu) == 1 else f", $\\mu$ = {number(medium.mu)}"
    return f"{name}, $n$ = {number(medium.n)}{mu}"


def _within(start, end, ax):
    """The parts (S,) from and to which the segments start + part (end - start) lie in the view; from > to where none."""
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    step = end - start
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (low - start) / step, (high - start) / step
    parallel = step == 0
    outside = np.any(parallel & ((start < low) | (start > high)), axis=1)
    first = np.max(np.where(parallel, 0, np.minimum(one, other)), axis=1).clip(0)
    last = np.min(np.where(parallel, 1, np.maximum(one, other)), axis=1).clip(max=1)
    return first, np.where(outside, -1, last)


def draw_paths(ax, paths, *, widest=1.8, arrows=0.1):
    """Draw physics.rays.Paths on axes whose limits are set, the weight of each line by its energy.

    widest: points, of a line with all of its ray's energy
    arrows: the shortest line that carries an arrow, as a share of the view's width
    """
    library = matplotlib()
    from matplotlib.collections import LineCollection
    from matplotlib.markers import MarkerStyle
    from matplotlib.path import Path as Outline

    start, end = paths.start[:, :2], paths.end[:, :2]
    first, last = _within(start, end, ax)
    step = end - start
    a, b = start + first[:, None] * step, start + last[:, None] * step
    seen = last > first
    widths = _width(paths.energy, widest)
    with library.rc_context({"lines.scale_dashes": False}):
        for order, (kind, (colour, dashes)) in enumerate(_LOOKS.items()):
            chosen = seen & (paths.kind == kind)
            lines = np.stack([a[chosen], b[chosen]], axis=1)
            ax.add_collection(
                LineCollection(
                    lines, colors=colour, linewidths=widths[chosen], linestyles=[dashes], zorder=4 - 0.1 * order
                )
            )
    left, right = ax.get_xlim()
    length = np.hypot(*(b - a).T)
    head = Outline([(-1, -0.72), (1, 0), (-1, 0.72), (-1, -0.72)], closed=True)
    every = math.ceil(len(paths.lost) / 25)  # many rays close together need no arrow each
    carries = seen & (length > arrows * (right - left)) & (paths.ray % every == every // 2)
    for i in np.flatnonzero(carries):
        marker = MarkerStyle(head).rotated(deg=math.degrees(math.atan2(*step[i, ::-1])))
        ax.plot(
            *(a[i] + 0.62 * (b[i] - a[i])),
            marker=marker,
            markersize=2.2 + 2.6 * math.sqrt(widths[i]),
            color=_LOOKS[Kind(paths.kind[i])][0],
            markeredgewidth=0,
            zorder=4.5,
        )


def _draw_normals(ax, points, normals, length):
    for point, normal in zip(points, normals, strict=True):
        ends = np.stack([point - length * normal, point + length * normal])[:, :2]
        ax.plot(*ends.T, color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=3)


def _draw_angles(ax, paths, segment, normal, radius, length):
    """The normal where `segment` ends, and the arcs from it to the ray before and after, named with their degrees."""
    from matplotlib.patches import Arc

    point, normal = paths.end[segment][:2], np.asarray(normal, float)[:2]
    incoming = paths.direction[segment][:2]
    if incoming @ normal > 0:
        normal = -normal  # against the ray, as in thesis figure 2.1
    arms = [("theta_i", -incoming, normal)]
    onward = np.flatnonzero((paths.parent == segment) & (paths.kind == Kind.TRANSMITTED))
    arms += [("theta_t", paths.direction[i][:2], -normal) for i in onward]
    turns = [_turn(axis, ray) for _, ray, axis in arms]
    for (name, _, axis), turn in zip(arms, turns, strict=True):
        angle = math.degrees(math.atan2(axis[1], axis[0]))
        begin, finish = sorted((angle, angle + math.degrees(turn)))
        ax.add_patch(
            Arc(point, 2 * radius, 2 * radius, theta1=begin, theta2=finish, color=INK, linewidth=0.9, zorder=5)
        )
        # of one sign with theta_i where the ray crosses the normal, as it does at ordinary interfaces
        degrees = math.copysign(round(abs(math.degrees(turn)), 1), turn * turns[0])
        ax.text(
            *(point + (length + 0.04) * axis),
            f"$\\{name}$ = {number(degrees)}°",
            ha="left" if axis[0] > 0.3 else "right" if axis[0] < -0.3 else "center",
            va="bottom" if axis[1] > 0.3 else "top" if axis[1] < -0.3 else "center",
            **_LABEL,
        )
    _draw_normals(ax, [paths.end[segment]], [np.append(normal, 0)], length)


def _turn(a, b):
    """The signed angle, radians, from one direction in the plane to another."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)


def _head(ax, title, medium, *more):
    """The line above a diagram: its title, and the media by their tints, where no ray crosses their names."""
    from matplotlib.patches import Patch

    media = [
        Patch(facecolor="white", edgecolor=INK, linewidth=0.7, label=_named(AIR)),
        Patch(facecolor=_tint(medium), edgecolor=INK, linewidth=0.7, label=_named(medium)),
    ]
    head = ax.set_title(title, pad=5)
    key = ax.legend(
        handles=[*media, *more],
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=4,
        borderaxespad=0.35,
        borderpad=0,
        handlelength=1.1,
        handletextpad=0.5,
        columnspacing=1.2,
        fontsize=8,
    )
    ax.apply_aspect()  # the figure's margins are set, so this is how wide the diagram will be
    if title and sum(part.get_window_extent().width for part in (head, key)) + _GAP > ax.get_window_extent().width:
        # long names: the title goes to a line of its own, for which the diagram makes room
        ax.set_title(title, pad=5 + _LINE)
        figure = ax.get_figure()
        figure.subplots_adjust(top=figure.subplotpars.top - _LINE / 72 / figure.get_figheight())


def _view(ax, left, right, bottom, top):
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect("equal")
    ax.set_axis_off()


def _key(figure, widest):
    """One row under the diagrams that says what lines mean."""
    from matplotlib.lines import Line2D

    names = ("incident", "transmitted", "reflected")
    kinds = [
        Line2D([], [], color=colour, linestyle=dashes, linewidth=1.4, label=name)
        for name, (colour, dashes) in zip(names, _LOOKS.values(), strict=True)
    ]
    weights = [
        Line2D([], [], color=GREY, linewidth=_width(energy, widest), label=f"{energy:.0%}".replace("%", " %"))
        for energy in (1.0, 0.1, 0.01)
    ]
    normal = Line2D([], [], color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), label="normal")
    figure.legend(
        handles=[*kinds, normal, Line2D([], [], linewidth=0, label="energy:"), *weights],
        loc="lower center",
        ncols=8,
        columnspacing=1.1,
        handlelength=1.7,
        handletextpad=0.5,
        fontsize=8,
    )


# --- the scenes: each draws on axes and returns the Paths -------------------------------------------------------------


def _sphere_paths(medium, heights, **options):
    surfaces = Shapes(Sphere((0, 0, 0), 1.0, Interface(medium, AIR)))
    heights = np.asarray(heights, float)
    origins = np.stack([np.full_like(heights, -2.0), heights, np.zeros_like(heights)], axis=-1)
    return trace(surfaces, origins, (1, 0, 0), **{"reach": 20.0, "least": _NO_LESS} | options)


def focal_length(n):
    """From the centre of a ball of radius 1 to where paraxial light meets behind it, n / (2 (n - 1)); None for n = 1.

    The textbook's ball lens, which a negative n keeps: below 1 the point lies in the ball, and rays only seem to
    come from it.
    """
    return None if n == 1 else n / (2 * (n - 1))


def _draw_sphere(ax, title, medium, rays, widest, beam=BEAMS[0]):
    from matplotlib.patches import Circle

    _view(ax, -2.15, 2.35, -1.55, 1.55)
    heights = np.linspace(beam.low, beam.high, rays) if rays > 1 else np.array([0.5])
    paths = _sphere_paths(medium, heights)
    ax.add_patch(Circle((0, 0), 1, facecolor=_tint(medium), edgecolor=INK, linewidth=0.9, zorder=1))
    ax.plot([-2.0, 2.35], [0, 0], color=GREY, linewidth=0.6, linestyle=(0, (8, 2.5, 1.5, 2.5)), zorder=2)
    ax.plot(0, 0, "o", color=INK, markersize=3, zorder=5)
    if rays > 1:
        ax.plot([-2.0, -2.0], [beam.low - 0.04, beam.high + 0.04], color=INK, linewidth=2.2, zorder=5)
    draw_paths(ax, paths, widest=widest)
    if rays == 1:
        main = _main_way(paths, 0)
        points = [paths.end[i] for i in main if paths.fate[i] == Fate.SPLIT][:2]
        _draw_normals(ax, points[1:], points[1:], 0.42)
        _draw_angles(ax, paths, main[0], points[0], 0.26, 0.42)
    else:
        hits = paths.end[(paths.kind == Kind.INCIDENT) & (paths.fate == Fate.SPLIT)]
        _draw_normals(ax, hits[-1:], hits[-1:], 0.35)
        _mark_focus(ax, paths, medium, beam)
    _head(ax, title, medium)
    return paths


def _mark_focus(ax, paths, medium, beam):
    """The paraxial focus F of a narrow beam, and dotted back to it the rays that only seem to come from there."""
    focus = focal_length(medium.n)
    left, right = ax.get_xlim()
    if focus is None or not left < focus < right or max(abs(beam.low), abs(beam.high)) > 0.5:
        return
    if focus < 1:
        for ray in range(beam.rays):
            point, ahead = (column[_main_way(paths, ray)[-1]][:2] for column in (paths.start, paths.direction))
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
        bbox={"pad": 0.6, "color": _tint(medium) if focus < 1 else "white"},
        **_LABEL,
    )


def _main_way(paths, ray):
    """The segments of a ray that never was reflected, from its source on; in total reflection it ends there."""
    way = [int(np.flatnonzero((paths.ray == ray) & (paths.parent < 0))[0])]
    while len(onward := np.flatnonzero((paths.parent == way[-1]) & (paths.kind == Kind.TRANSMITTED))):
        way.append(int(onward[0]))
    return way


def _pool_paths(medium, degrees, **options):
    """From the point source up to the surface y = 0, `degrees` (N,) from the vertical, to the right."""
    theta = np.radians(degrees)
    surfaces = Shapes(Plane((0, 0, 0), (0, 1, 0), Interface(medium, AIR)), Plane((0, -FLOOR, 0), (0, 1, 0)))
    up = np.stack([np.sin(theta), np.cos(theta), 0 * theta], axis=-1)
    return trace(surfaces, (0, -DEPTH, 0), up, **{"reach": 20.0, "least": _NO_LESS} | options)


def _draw_pool(ax, title, medium, rays, widest):
    from matplotlib.patches import Rectangle

    left, right, bottom, top = -2.35, 2.35, -1.56, 1.75
    _view(ax, left, right, bottom, top)
    # a few rays meet the surface within the view, two and three of them within the window of water
    widest_fan = STEEPEST if rays > 7 else min(15.0 * rays, 60.0)
    paths = _pool_paths(medium, np.linspace(-widest_fan, widest_fan, rays) if rays > 1 else np.array([30.0]))
    ax.add_patch(Rectangle((left, -FLOOR), right - left, FLOOR, facecolor=_tint(medium), linewidth=0, zorder=1))
    # strokes rather than a hatch, which simple viewers fill with black
    for x in np.arange(left, right - 0.05, 0.09):
        ax.plot([x, x + 0.07], [-FLOOR - 0.12, -FLOOR], color=GREY, linewidth=0.6, solid_capstyle="butt", zorder=1)
    for y in (0, -FLOOR):
        ax.plot([left, right], [y, y], color=INK, linewidth=0.9, zorder=2)
    draw_paths(ax, paths, widest=widest)
    ax.plot(0, -DEPTH, "o", color=INK, markersize=5.5, zorder=6)
    window = []
    if rays == 1:
        _draw_angles(ax, paths, 0, (0, 1, 0), 0.34, 0.75)
    else:
        ax.plot([0, 0], [-DEPTH, top], color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=3)
        critical = Interface(AIR, medium).critical_angle()
        if critical is not None and math.tan(critical) * DEPTH < right:
            edge = math.tan(critical) * DEPTH
            window = ax.plot([-edge, edge], [0, 0], color=INK, linewidth=3.0, solid_capstyle="butt", zorder=5)
            window[0].set_label(f"window to {math.degrees(critical):.2f}°")
    _head(ax, title, medium, *window)
    return paths


def _draw_slab(ax, title, medium, rays, widest):
    from matplotlib.patches import Rectangle

    left, right, bottom, top = -1.15, 2.65, -1.3, 1.3
    _view(ax, left, right, bottom, top)
    surfaces = Shapes(Convex(((0, 0, 0), (1, 0, 0)), ((-1, 0, 0), (1, 0, 0)), Interface(medium, AIR)))
    theta = np.radians(np.linspace(-40, 40, rays) if rays > 1 else [40.0])
    source = (-0.5, 0, 0) if rays > 1 else (-0.9, -0.9 * math.tan(theta[0]), 0)
    along = np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=-1)
    paths = trace(surfaces, source, along, reach=20.0, least=_NO_LESS)
    ax.add_patch(Rectangle((0, bottom), 1, top - bottom, facecolor=_tint(medium), linewidth=0, zorder=1))
    for x in (0, 1):
        ax.plot([x, x], [bottom, top], color=INK, linewidth=0.9, zorder=2)
    draw_paths(ax, paths, widest=widest)
    main = _main_way(paths, 0)
    if rays == 1:
        points = [paths.end[i] for i in main if paths.fate[i] == Fate.SPLIT]
        _draw_normals(ax, points[1:], [np.array([1.0, 0, 0])] * len(points[1:]), 0.5)
        _draw_angles(ax, paths, main[0], (1, 0, 0), 0.3, 0.5)
    else:
        ax.plot([left, right], [0, 0], color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=3)
        ax.plot(*source[:2], "o", color=INK, markersize=5.5, zorder=6)
    _head(ax, title, medium)
    return paths


def _draw_prism(ax, title, medium, rays, widest):
    from matplotlib.patches import Polygon

    left, right, bottom, top = -1.45, 2.75, -1.35, 1.7
    _view(ax, left, right, bottom, top)
    half = 1.05
    foot = 2 * half * math.tan(APEX)
    slope = (math.cos(APEX), math.sin(APEX), 0)
    surfaces = Shapes(
        Convex(((0, 0, 0), (0, half, 0), (0, -half, 0)), ((-1, 0, 0), slope, (0, -1, 0)), Interface(medium, AIR))
    )
    heights = np.linspace(-0.35, 0.55, rays) if rays > 1 else np.array([-0.1])
    origins = np.stack([np.full_like(heights, -1.2), heights, 0 * heights], axis=-1)
    paths = trace(surfaces, origins, (1, 0, 0), reach=20.0, least=_NO_LESS)
    corners = [(0, -half), (0, half), (foot, -half)]
    ax.add_patch(Polygon(corners, facecolor=_tint(medium), edgecolor=INK, linewidth=0.9, joinstyle="round", zorder=1))
    draw_paths(ax, paths, widest=widest)
    main = _main_way(paths, rays // 2)
    if len(main) == 1:  # as good as all light turns back at the first face
        _draw_normals(ax, [paths.end[main[0]]], [np.array([1.0, 0, 0])], 0.5)
    elif rays == 1:
        _draw_angles(ax, paths, main[1], slope, 0.3, 0.7)
    else:
        _draw_normals(ax, [paths.end[main[1]]], [np.array(slope)], 0.5)
    if rays > 1:
        ax.plot([-1.2, -1.2], [heights[0] - 0.04, heights[-1] + 0.04], color=INK, linewidth=2.2, zorder=5)
    _head(ax, title, medium)
    return paths


# --- one diagram a file -----------------------------------------------------------------------------------------------


class Scene(NamedTuple):
    """What diagram() draws: its title with many rays and with one, the index and the number of rays it takes by itself."""

    title: str
    title_of_one: str
    n: float
    rays: int
    draw: object


SCENES = {
    "sphere": Scene("Parallel light on a sphere", "A ray through a sphere", -1.5, 21, _draw_sphere),
    "pool": Scene("Light from under a surface", "A ray from under a surface", -1.33, 21, _draw_pool),
    "slab": Scene("Light through a slab", "A ray through a slab", -1.0, 11, _draw_slab),
    "prism": Scene("Parallel light on a prism of 20°", "A ray through a prism of 20°", -1.5, 5, _draw_prism),
}


def diagram(scene, n=None, mu=None, rays=None, file="rays.svg"):
    """Draw the rays through one of SCENES into a file, .svg, .png or .pdf; returns its Path.

    n, mu: of the medium, by default the scene's index and a mu of 1 or -1, as the index has it
    rays:  how many leave the source, 1 to MOST_RAYS; a single one is drawn with its normals and angles
    Raises ValueError for what it cannot draw, RuntimeError where matplotlib is missing, OSError where it cannot write.
    """
    if scene not in SCENES:
        raise ValueError(f"there is no ray diagram {str(scene)!r}; there are {', '.join(SCENES)}.")
    chosen = SCENES[scene]
    medium = Medium(chosen.n if n is None else n, mu)
    rays = chosen.rays if rays is None else rays
    if not isinstance(rays, int) or not 1 <= rays <= MOST_RAYS:
        raise ValueError(f"rays = {rays} is not a whole number from 1 to {MOST_RAYS}.")
    known_suffix(file)
    with look():
        figure, axes = sheet(6.3, 4.7)
        figure.subplots_adjust(0.01, 0.075, 0.99, 0.93)
        widest = 1.8 * min(1.0, math.sqrt(21 / rays))
        title = chosen.title if rays > 1 else chosen.title_of_one
        chosen.draw(axes[0, 0], title, medium, rays, widest)
        _key(figure, widest)
        return save(figure, f"{title}, {medium}", file)[0]


def sphere_diagram(n=-1.5, mu=None, beam=21, file="sphere.svg"):
    """diagram() of parallel rays on a sphere."""
    return diagram("sphere", n, mu, beam, file)


def pool_diagram(n=-1.33, mu=None, rays=21, file="pool.svg"):
    """diagram() of rays from a point under the surface of a liquid, or the lines of sight of an eye there."""
    return diagram("pool", n, mu, rays, file)


# --- the thesis's figures ---------------------------------------------------------------------------------------------


def _known(figure):
    if figure not in FIGURES:
        raise ValueError(f"there is no figure {figure!r} among the ray diagrams, which are {', '.join(FIGURES)}.")


def draw(figure, folder):
    """Draw a figure of FIGURES into `folder`; returns the Paths of its .svg and .png.

    Raises ValueError for a figure that is not one of FIGURES, RuntimeError where matplotlib is missing.
    """
    _known(figure)
    widest = 1.3
    with look():
        if figure == "5.8":
            drawing, axes = sheet(7.2, 3.05, 1, 2)
            drawing.subplots_adjust(0.01, 0.09, 0.99, 0.92, wspace=0.04)
            for ax, n in zip(axes[0], (1.33, -1.33), strict=True):
                _draw_pool(ax, "", Medium(n), 21, widest)
        else:
            drawing, axes = sheet(6.9, 7.6, 3, 2)
            drawing.subplots_adjust(0.01, 0.045, 0.99, 0.97, wspace=0.04, hspace=0.1)
            for row, beam in zip(axes, BEAMS, strict=True):
                for ax, n in zip(row, (1.5, -1.5), strict=True):
                    _draw_sphere(ax, beam.name, Medium(n), beam.rays, widest, beam)
        _key(drawing, widest)
    base = Path(folder) / f"figure-{figure}"
    return save(drawing, f"Figure {figure}: {FIGURES[figure]}", f"{base}.svg", f"{base}.png")


def claims(figure):
    """What must hold in a figure of FIGURES: a list of Claim, measured on traced rays against closed forms."""
    _known(figure)
    return _pool_claims() if figure == "5.8" else _sphere_claims()


def _pool_claims():
    made = []
    size = 1.33
    critical = math.degrees(math.asin(1 / size))
    for name, n in (("water", size), ("NIM", -size)):
        sign = math.copysign(1, n)
        degrees = np.linspace(-STEEPEST, STEEPEST, 3001)
        paths = _pool_paths(Medium(n), degrees, least=0.0, bounces=1)
        above = (paths.kind == Kind.TRANSMITTED) & (paths.energy > 0)
        theta = degrees[paths.ray[above]]
        d = paths.direction[above]
        leaving = np.degrees(np.arctan2(d[:, 0], d[:, 1]))
        surface = paths.start[above][:, 0]
        one = np.argmin(np.abs(theta - 30))
        made += [
            Claim(
                f"{name}: the ray 30 degrees from the vertical leaves at arcsin(n sin 30), on the "
                f"{'same' if n > 0 else 'other'} side",
                math.degrees(math.asin(n * 0.5)),
                leaving[one],
                1e-6,
                "deg",
            ),
            Claim(
                f"{name}: rays {'diverge' if n > 0 else 'converge'} above the surface, share of them",
                1,
                np.mean(sign * (leaving * surface)[theta != 0] > 0),
                0,
            ),
            Claim(f"{name}: the window ends at the critical angle", critical, np.max(np.abs(theta)), 0.05, "deg"),
            Claim(
                f"{name}: beyond it all is reflected, least energy that returns",
                1,
                np.min(paths.energy[(paths.kind == Kind.REFLECTED) & (np.abs(degrees[paths.ray]) > critical)]),
                1e-12,
            ),
        ]
        near = _pool_paths(Medium(n), np.array([0.01]), least=0.0, bounces=1)
        last = _main_way(near, 0)[-1]
        point, d = near.start[last], near.direction[last]
        made.append(
            Claim(
                f"{name}: the image of the source, heights above the surface",
                -DEPTH / n,
                point[1] - point[0] * d[1] / d[0],
                1e-6,
                "depths",
            )
        )
    return made


def _sphere_claims():
    made = []
    size = 1.5
    for name, n in (("glass", size), ("NIM", -size)):
        medium = Medium(n)
        heights = np.linspace(0.0005, 0.9995, 1000)
        paths = _sphere_paths(medium, heights, bounces=2, branches=False)
        exits = paths.depth == 2
        order = np.argsort(paths.ray[exits])
        point, d = paths.start[exits][order], paths.direction[exits][order]
        made.append(
            Claim(
                f"{name}: paraxial light {'meets' if n > 0 else 'seems to come from'} n / (2 (n - 1)) behind the centre",
                n / (2 * (n - 1)),
                point[0, 0] - point[0, 1] * d[0, 0] / d[0, 1],
                1e-5,
                "radii",
            )
        )
        # by Snell's law in triangles: out on the far side while theta_i + 2 |theta_t| < 90 degrees
        square = 4 / size**2
        far = math.sqrt(size**4 / 8 * (1 + square - math.sqrt((1 + square) ** 2 - square**2)))
        # and forwards while theta_i - theta_t < 45 degrees: the outermost rays of glass of 1.5 just do not
        forward = 1 / math.hypot(1, 1 - math.sqrt(2) / n)
        made += [
            Claim(
                f"{name}: heights up to here leave by the far hemisphere",
                1.0 if n > 0 else far,
                _reaches(heights, point[:, 0] > 0),
                0.001,
                "radii",
            ),
            Claim(
                f"{name}: heights up to here go on forwards",
                forward,
                _reaches(heights, d[:, 0] > 0),
                0.001,
                "radii",
            ),
            Claim(
                f"{name}: light of the upper half in the centre leaves downwards, share of it",
                1,
                np.mean(d[heights < BEAMS[1].high, 1] < 0),
                0,
            ),
        ]
        edge = np.linspace(BEAMS[2].low, BEAMS[2].high, 41)
        made.append(
            Claim(
                f"{name}: energy of the edge beam that goes back, by the series of inner reflections",
                np.mean([_returned(n, height) for height in edge]),
                _measured_return(medium, edge),
                1e-6,
            )
        )
    return made


def _reaches(heights, holds):
    """The height up to which something holds of all rays, half a step beyond the last."""
    step = heights[1] - heights[0]
    return float(heights[np.argmin(holds)] - step / 2 if not holds.all() else heights[-1] + step / 2)


def _returned(n, height):
    """Energy that a ball of radius 1 sends backwards of a ray at a height, in closed form.

    The order p is turned by pi - 2 theta_i for p = 0, else by 2 (theta_i - theta_t) + (p - 1) (pi - 2 theta_t), and
    carries R for p = 0, else (1 - R)^2 R^(p - 1): inside, every interface is met at the same angle.
    """
    inner = math.asin(height / n)
    outer = math.asin(height)
    s = math.sin(outer - abs(inner)) / math.sin(outer + abs(inner))
    p = math.tan(outer - abs(inner)) / math.tan(outer + abs(inner))
    R = (s * s + p * p) / 2
    back = R if math.cos(math.pi - 2 * outer) < 0 else 0.0
    for order in range(1, 60):
        turned = 2 * (outer - inner) + (order - 1) * (math.pi - 2 * inner)
        back += (1 - R) ** 2 * R ** (order - 1) if math.cos(turned) < 0 else 0.0
    return back


def _measured_return(medium, heights):
    paths = _sphere_paths(medium, heights, least=1e-10, bounces=60)
    leaves = paths.fate == Fate.ESCAPED
    back = leaves & (paths.direction[:, 0] < 0)
    return float(np.sum(paths.energy[back]) / np.sum(paths.energy[leaves]))

# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a ray diagram: lines by their energy, normals, angles, the head and the key. matplotlib draws them."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..physics import MEDIA, REPRESENTATIVE_NM, Medium
from ..physics.colour import encoded, of_wavelength
from ..physics.media import OPAQUE
from ..physics.rays import Kind, Paths
from .diagram_paths import AIR
from .drawing import BLUE, GREY, INK, ORANGE, matplotlib, number

_LOOKS = {
    Kind.INCIDENT: (INK, "solid"),
    Kind.TRANSMITTED: (BLUE, "solid"),
    Kind.REFLECTED: (ORANGE, (0, (4.5, 2.0))),
}
_PIECES = 24  # of a line that thins as a medium absorbs
LABEL = {"fontsize": 8.5, "zorder": 6}
# Nanometres: those that white light is drawn by, and those of them that the key names.
SPECTRUM, NAMED = tuple(range(400, 701, 25)), tuple(range(400, 701, 50))
_BRIGHTEST = 0.42  # linear luminance of a line: a brighter one is lost on white paper
_LINE, _GAP = 15, 12  # points of one line of the head; pixels between its title and the media


def _width(energy, widest):
    """Points of line weight: the area of a round ray would be its energy, so 4 % is still a line."""
    return widest * np.sqrt(energy)


def line_colour(wavelength_nm: float) -> tuple:
    """The colour (3,), as matplotlib takes it, of a line that stands for light of that wavelength, on white paper."""
    linear = of_wavelength(wavelength_nm)
    luminance = float(linear @ (0.2126, 0.7152, 0.0722))  # of linear sRGB (ITU-R BT.709)
    return tuple(encoded(linear * min(1.0, _BRIGHTEST / luminance if luminance else 1.0)).tolist())


def tint(medium: Medium) -> tuple:
    """The colour a medium is filled with: blue for n > 0, ochre for n < 0, deeper for what refracts more."""
    depth = 0.16 + 0.16 * min(abs(abs(medium.n) - 1), 1.5) / 1.5
    colour = np.array([0.85, 0.62, 0.20]) if medium.is_nim else np.array([0.25, 0.55, 0.80])
    return tuple(1 - depth * (1 - colour) * 1.2)


def _name_of(medium):
    """A medium as a diagram names it: "glass, n = 1.5", "NIM, n = -1.33, mu = -10", "n-bk7, n = 1.531 to 1.513"."""
    if medium.dispersion:
        name = medium.dispersion.name or ("NIM" if medium.is_nim else "medium")
        first, last = (number(round(medium.at(end).n, 4)) for end in (SPECTRUM[0], SPECTRUM[-1]))
        return f"{Path(name).stem}, $n$ = {first} to {last}"
    names = [name for name in ("air", "water", "glass", "diamond") if MEDIA[name] == medium]
    name = "NIM" if medium.is_nim else names[0] if names else "medium"
    mu = "" if abs(medium.mu) == 1 else f", $\\mu$ = {number(medium.mu)}"
    mu += f", 1/e in {medium.absorption_length():.3g} m" if medium.k else ""
    return f"{name}, $n$ = {number(medium.n)}{mu}"


def _within(start, end, ax):
    """The parts (S,) from and to which the segments start + part (end - start) lie in the view; from > to where none."""
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    step = end - start
    with np.errstate(divide="ignore", invalid="ignore"):
        to_low, to_high = (low - start) / step, (high - start) / step
    parallel = step == 0
    outside = np.any(parallel & ((start < low) | (start > high)), axis=1)
    first = np.max(np.where(parallel, 0, np.minimum(to_low, to_high)), axis=1).clip(0)
    last = np.min(np.where(parallel, 1, np.maximum(to_low, to_high)), axis=1).clip(max=1)
    return first, np.where(outside, -1, last)


def draw_spectrum(ax, trace: Callable[[Medium], Paths], medium: Medium, *, widest: float = 1.8) -> Paths:
    """Draw what becomes of white light: its rays as they arrive, and from the first surface on each of SPECTRUM in its colour.

    trace: function of the medium at one wavelength that returns the Paths of its light; their rays are the same for all
    Where no more than one wavelength's light can be, as before all surfaces and outside of the first, it is white light
    still, and drawn in black. Returns the Paths at the wavelength that stands for the medium.
    """
    for wavelength in SPECTRUM:
        paths = trace(transparent_at(medium, wavelength))
        white = _is_white(paths)
        draw_paths(ax, paths, widest=widest, arrows=1.0, colour=line_colour(wavelength), chosen=~white)
    paths = trace(transparent_at(medium, REPRESENTATIVE_NM))
    draw_paths(ax, paths, widest=widest, colour=INK, chosen=_is_white(paths))
    return paths


def draw_light(ax, trace: Callable[[Medium], Paths], medium: Medium, widest: float, spectrum: bool) -> Paths:
    """Draw the Paths that `trace` gives of a medium, or of white light by those of each wavelength; returns the Paths."""
    if spectrum:
        return draw_spectrum(ax, trace, medium, widest=widest)
    paths = trace(medium)
    draw_paths(ax, paths, widest=widest)
    return paths


def transparent_at(medium: Medium, wavelength_nm: float, *, loss: bool = False) -> Medium:
    """The Medium of plain numbers that a medium is at a wavelength; ValueError where it lets through no light to see.

    loss: whether it absorbs as that does; else it is the real one whose rays are the same
    """
    at = medium.at(wavelength_nm)
    if at.k > OPAQUE or at.n == 0:
        raise ValueError(
            f"{medium} is a mirror at {wavelength_nm:g} nm, for all that one can see, and has no rays within; give a medium "
            f"of k below {OPAQUE:g}."
        )
    return at if at.is_real or loss else Medium(at.n, at.mu if at.mu * at.n > 0 else None)


def _is_white(paths):
    """Which segments (S,) no surface has sorted by wavelength: those that arrive, and what is mirrored of them at once."""
    first = paths.parent < 0
    return first | ((paths.kind == Kind.REFLECTED) & first[paths.parent])


def _lines(paths, these, first, last, widest):
    """Lines (L, 2, 2) and their weights (L,): one for each of some segments, _PIECES where it loses energy on its way.

    these: (C,) indices; first, last: (S,) the parts of each segment that are seen
    """
    count = np.where(paths.arriving[these] < paths.energy[these], _PIECES, 1)
    which, size = np.repeat(these, count), np.repeat(1 / count, count)
    piece = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    begin, end = (first[which] + part * size * (last - first)[which] for part in (piece, piece + 1))
    start, way = paths.start[which, :2], (paths.end - paths.start)[which, :2]
    lines = np.stack([start + begin[:, None] * way, start + end[:, None] * way], axis=1)
    # along a segment energy falls exponentially: this is what is left in the middle of each piece
    left = (paths.arriving[which] / paths.energy[which]) ** ((begin + end) / 2)
    return lines, _width(paths.energy[which] * left, widest)


def draw_paths(
    ax, paths: Paths, *, widest: float = 1.8, arrows: float = 0.1, colour: tuple | None = None, chosen=True
) -> None:
    """Draw physics.rays.Paths on axes whose limits are set, the weight of each line by its energy.

    widest: points, of a line with all of its ray's energy
    arrows: the shortest line that carries an arrow, as a share of the view's width
    colour: of all lines; None: as the key has them
    chosen: the segments that are drawn, (S,) or all
    """
    library = matplotlib()
    from matplotlib.collections import LineCollection
    from matplotlib.markers import MarkerStyle
    from matplotlib.path import Path as Outline

    start, end = paths.start[:, :2], paths.end[:, :2]
    first, last = _within(start, end, ax)
    step = end - start
    a, b = start + first[:, None] * step, start + last[:, None] * step
    seen = (last > first) & chosen
    widths = _width(paths.energy, widest)
    with library.rc_context({"lines.scale_dashes": False}):
        for order, (kind, (usual, dashes)) in enumerate(_LOOKS.items()):
            lines, weights = _lines(paths, np.flatnonzero(seen & (paths.kind == kind)), first, last, widest)
            ax.add_collection(
                LineCollection(
                    lines,
                    colors=[colour or usual],
                    linewidths=weights,
                    linestyles=[dashes],
                    zorder=4 - 0.1 * order,
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
            color=colour or _LOOKS[Kind(paths.kind[i])][0],
            markeredgewidth=0,
            zorder=4.5,
        )


def draw_normals(ax, points, normals, length: float) -> None:
    """Dash the normals (N, 3) at points (N, 3), `length` to either side."""
    for point, normal in zip(points, normals, strict=True):
        ends = np.stack([point - length * normal, point + length * normal])[:, :2]
        ax.plot(*ends.T, color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=3)


def draw_angles(ax, paths: Paths, segment: int, normal, radius: float, length: float) -> None:
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
            **LABEL,
        )
    draw_normals(ax, [paths.end[segment]], [np.append(normal, 0)], length)


def _turn(a, b):
    """The signed angle, radians, from one direction in the plane to another."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)


def head(ax, title: str, medium: Medium, *more) -> None:
    """The line above a diagram: its title, and the media by their tints, where no ray crosses their names."""
    from matplotlib.patches import Patch

    media = [
        Patch(facecolor="white", edgecolor=INK, linewidth=0.7, label=_name_of(AIR)),
        Patch(facecolor=tint(medium), edgecolor=INK, linewidth=0.7, label=_name_of(medium)),
    ]
    heading = ax.set_title(title, pad=5)
    legend = ax.legend(
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
    if (
        title
        and sum(part.get_window_extent().width for part in (heading, legend)) + _GAP > ax.get_window_extent().width
    ):
        # long names: the title goes to a line of its own, for which the diagram makes room
        ax.set_title(title, pad=5 + _LINE)
        figure = ax.get_figure()
        figure.subplots_adjust(top=figure.subplotpars.top - _LINE / 72 / figure.get_figheight())


_KEY = {
    "loc": "lower center",
    "ncols": 8,
    "columnspacing": 1.1,
    "handlelength": 1.7,
    "handletextpad": 0.5,
    "fontsize": 8,
}


def view(ax, left: float, right: float, bottom: float, top: float) -> None:
    """Let axes show that rectangle, as large in both directions, without ticks."""
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect("equal")
    ax.set_axis_off()


def key(figure, widest: float, *, spectrum: bool = False) -> None:
    """One row under the diagrams that says what lines mean; spectrum: whether their colours are those of light."""
    from matplotlib.lines import Line2D

    names = ("incident", "transmitted", "reflected")
    branches = [
        Line2D([], [], color=colour, linestyle=dashes, linewidth=1.4, label=name)
        for name, (colour, dashes) in zip(names, _LOOKS.values(), strict=True)
    ]
    if spectrum:
        branches = [
            Line2D([], [], color=INK, linewidth=1.4, label="white"),
            *(Line2D([], [], color=line_colour(named), linewidth=2.2, label=f"{named}") for named in NAMED[:-1]),
            Line2D([], [], color=line_colour(NAMED[-1]), linewidth=2.2, label=f"{NAMED[-1]} nm"),
            Line2D([], [], color=GREY, linestyle=_LOOKS[Kind.REFLECTED][1], linewidth=1.4, label="reflected"),
        ]
        figure.legend(handles=branches, **_KEY | {"ncols": len(branches), "handlelength": 1.2})
        return
    weights = [
        Line2D([], [], color=GREY, linewidth=_width(energy, widest), label=f"{energy:.0%}".replace("%", " %"))
        for energy in (1.0, 0.1, 0.01)
    ]
    normal = Line2D([], [], color=GREY, linewidth=0.8, linestyle=(0, (3, 2)), label="normal")
    figure.legend(
        handles=[*branches, normal, Line2D([], [], linewidth=0, label="energy:"), *weights],
        **_KEY,
    )

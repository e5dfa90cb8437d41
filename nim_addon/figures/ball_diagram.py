# SPDX-License-Identifier: GPL-3.0-or-later
"""The diagram of a graded ball: rays that are curved in it, and what each device does with them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..physics import graded
from ..physics.graded import Profile
from . import diagram_parts as parts
from .claims import Claim
from .drawing import BLUE, GREY, INK, known_suffix, look, number, save, sheet
from .recipes import drawn_figure

SOURCE = 2.0  # from where parallel light comes, left of the ball's middle, in radii
WIDEST = 0.96  # of the beam: at 1 a ray touches and no more
NEXT_TO_THE_AXIS = 0.04
SPREAD = 80.0  # degrees, to either side, of the light that starts on the rim of a fish-eye
MOST_RAYS = 101
VIEW = -2.2, 2.2, -1.6, 1.6
_HEAD = ((-1, -0.72), (1, 0), (-1, 0.72), (-1, -0.72))  # of an arrow
_SHELLS = 16  # that the ball is tinted in
_LARGE = 1e3  # an index that is as good as none
_BEYOND = 20.0  # how far light is followed that has left

TITLES = {
    "luneburg": "Luneburg's lens: a beam meets on the rim",
    "fisheye": "Maxwell's fish-eye: from the rim to its antipode",
    "eaton": "Eaton's ball: back where it came from",
    "invisible": "An invisible ball: once round the centre, and on",
    "magnifier": "Qiu's magnifier: like the dashed mirror",
    "cloak": "A cloak: around the hollow, and on",
    "turn": "A ball that turns all light by the same angle",
}


class Way(NamedTuple):
    """One ray in the plane of the diagram: how it comes (2, 2), how it goes within (N, 2), and on (2, 2), or None."""

    before: np.ndarray
    within: np.ndarray
    after: np.ndarray | None


def way(profile: Profile, point, direction) -> Way:
    """The way of a ray through the ball of radius 1 about the origin, from a point (2,) along a direction (2,)."""
    start, ahead = np.append(point, 0.0), np.append(direction, 0.0)
    within = graded.path(profile, start, ahead)
    out = graded.carry(profile, start, ahead)
    after = None
    if np.isfinite(out.points).all():
        after = np.stack([out.points, out.points + _BEYOND * out.directions])[:, :2]
    return Way(np.stack([start[:2], within[0, :2]]), within[:, :2], after)


def ways(profile: Profile, rays: int) -> list[Way]:
    """Those of parallel light to the right, or for a fish-eye of light that starts at the left of its rim."""
    if profile.n == "fisheye":
        angles = np.radians(np.linspace(-SPREAD, SPREAD, rays) if rays > 1 else np.array([35.0]))
        return [way(profile, (-1.0, 0.0), (math.cos(angle), math.sin(angle))) for angle in angles]
    lowest = NEXT_TO_THE_AXIS if profile.n == "eaton" else -WIDEST  # what comes back would cover what comes
    heights = np.linspace(lowest, WIDEST, rays) if rays > 1 else np.array([0.5])
    return [way(profile, (-SOURCE, height), (1.0, 0.0)) for height in heights]


def title_of(profile: Profile) -> str:
    """What a diagram of the ball is called."""
    if profile.n == "turn":
        return f"A ball that turns all light by {number(round(math.degrees(profile.angle), 1))}°"
    title = TITLES[profile.n] if isinstance(profile.n, str) else "A graded ball"
    if profile.cap is not None:
        title = f"{title.partition(':')[0]}, its index no more than {number(profile.cap)}"
    if profile.core is not None and profile.n != "magnifier":
        title = f"{title.partition(':')[0]}, with a core of {number(profile.core)}"
    return title


def draw_ball(ax, profile: Profile, rays: int, widest: float) -> list[Way]:
    """Draw the diagram on axes; returns the ways of its rays."""
    parts.view(ax, *VIEW)
    _tinted(ax, profile)
    drawn = ways(profile, rays)
    for each in drawn:
        ax.plot(*each.before.T, color=INK, linewidth=widest, zorder=3, solid_capstyle="butt")
        ax.plot(*each.within.T, color=BLUE, linewidth=widest, zorder=4)
        if each.after is not None:
            ax.plot(*each.after.T, color=BLUE, linewidth=widest, zorder=4, clip_on=True)
    _arrows(ax, drawn, widest)
    if profile.n == "fisheye":
        ax.plot([-1, 1], [0, 0], "o", color=INK, markersize=4, zorder=6, linewidth=0)
    elif profile.n == "luneburg":
        ax.plot(1, 0, "o", color=INK, markerfacecolor="white", markersize=4, zorder=6)
    ax.set_title(title_of(profile), pad=5)
    if not profile.is_cloak:
        _name_indices(ax, profile)
    return drawn


def _name_indices(ax, profile):
    """Beside the title, what the tints at the rim and in the middle stand for."""
    from matplotlib.patches import Patch

    handles = []
    for radius in (1.0, profile.inner):
        n = float(profile.index(np.array([radius]))[0])
        text = number(round(n, 3)) if abs(n) < _LARGE else "\N{INFINITY}"
        handles.append(Patch(facecolor=_tint(profile, radius), edgecolor=INK, linewidth=0.7, label=f"$n$ = {text}"))
    side = "right" if profile.n == "magnifier" else "left"  # where no light goes
    ax.legend(handles=handles, loc=f"lower {side}", handlelength=1.1, handletextpad=0.5, borderpad=0, fontsize=8)


def _tinted(ax, profile):
    """The ball, deeper in tint where it refracts more; its core, and the mirror that a magnifier is like."""
    from matplotlib.patches import Circle

    for radius in np.linspace(1, profile.inner, _SHELLS, endpoint=False):
        ax.add_patch(Circle((0, 0), radius, facecolor=_tint(profile, radius), linewidth=0, zorder=1))
    ax.add_patch(Circle((0, 0), 1, fill=False, edgecolor=INK, linewidth=0.9, zorder=5))
    if profile.is_cloak:
        ax.add_patch(Circle((0, 0), profile.hollow, facecolor="white", edgecolor=INK, linewidth=0.9, zorder=2))
    if profile.core is not None:
        face = {"mirror": "#dddddd", "black": INK, "textured": "white"}[profile.surface]
        hatch = "////" if profile.surface == "textured" else None
        core = Circle((0, 0), profile.core, facecolor=face, edgecolor=INK, linewidth=0.9, hatch=hatch, zorder=2)
        ax.add_patch(core)
        if profile.n == "magnifier" and profile.surface == "mirror" and profile.cap is None:
            like = {"linewidth": 0.9, "linestyle": (0, (4, 3)), "zorder": 2}
            ax.add_patch(Circle((0, 0), 1 / profile.core, fill=False, edgecolor=GREY, **like))


def _tint(profile, radius):
    """By the index, 1 to 3 and more; of a cloak, which is slower around than along the radius, by its density."""
    n = float(profile.index(np.array([radius]))[0])
    depth = 0.06 + 0.3 * min(abs(math.log(abs(n))) / math.log(3), 1)
    colour = np.array([0.85, 0.62, 0.20]) if n < 0 else np.array([0.25, 0.55, 0.80])
    return tuple(1 - depth * (1 - colour) * 1.2)


def _arrows(ax, drawn, widest):
    """An arrow on the way there and one on the way out, of at most some twenty rays."""
    from matplotlib.markers import MarkerStyle
    from matplotlib.path import Path as Outline

    low, high = np.array([VIEW[::2], VIEW[1::2]])
    every = math.ceil(len(drawn) / 21)
    for each in drawn[every // 2 :: every]:
        for line, color in ((each.before, INK), (each.after, BLUE)):
            if line is None:
                continue
            step = line[1] - line[0]
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = np.where(step > 0, (high - line[0]) / step, (low - line[0]) / step)
            last = min(1.0, np.nanmin(np.where(step == 0, np.inf, ends)))
            if last * np.hypot(*step) < 0.25:
                continue
            marker = MarkerStyle(Outline(_HEAD, closed=True)).rotated(deg=math.degrees(math.atan2(*step[::-1])))
            ax.plot(
                *(line[0] + 0.6 * last * step),
                marker=marker,
                markersize=2.2 + 2.6 * math.sqrt(widest),
                color=color,
                markeredgewidth=0,
                zorder=5,
            )


def diagram(profile: Profile, rays: int = 15, file: str | Path = "rays.svg") -> Path:
    """Draw the rays through a ball into a file, .svg, .png or .pdf; returns its Path.

    Raises ValueError for what it cannot draw, RuntimeError where matplotlib is missing, OSError where it cannot write.
    """
    if not isinstance(rays, int) or not 1 <= rays <= MOST_RAYS:
        raise ValueError(f"rays = {rays} is not a whole number from 1 to {MOST_RAYS}.")
    known_suffix(file)
    with look():
        figure, axes = sheet(6.3, 4.9)
        figure.subplots_adjust(0.01, 0.01, 0.99, 0.93)
        draw_ball(axes[0, 0], profile, rays, 1.3 * min(1.0, math.sqrt(21 / rays)))
        return save(figure, title_of(profile), file)[0]


# --- the figure -------------------------------------------------------------------------------------------------------

SHOWN = ("luneburg", "fisheye", "eaton", "invisible", "magnifier", "cloak")
RAYS = 12  # an even number: the one in the middle would not know which way to go round


def draw(folder: Path) -> list[Path]:
    """Draw figure B.2 into a folder; returns the Paths of its .svg and .png. RuntimeError where matplotlib is missing."""
    with look():
        drawing, axes = sheet(7.2, 8.0, 3, 2)
        drawing.subplots_adjust(0.01, 0.01, 0.99, 0.97, wspace=0.04, hspace=0.1)
        for ax, device in zip(axes.flat, SHOWN, strict=True):
            draw_ball(ax, Profile(device), RAYS, 1.1)
        base = Path(folder) / f"figure-{NUMBER}"
        return save(drawing, f"Figure {NUMBER}: {TITLE}", f"{base}.svg", f"{base}.png")


def claims() -> list[Claim]:
    """Of figure B.2: where the drawn paths, which are integrated, lead."""
    found = []

    def held(device, text, predicted, measured):
        off = float(np.max(np.abs(np.asarray(measured) - predicted)))
        found.append(Claim(f"{device}: {text}, largest error", 0, off, 1e-6, "radii"))

    drawn = {device: ways(Profile(device), RAYS) for device in SHOWN}
    ends = {device: np.array([way.within[-1] for way in each]) for device, each in drawn.items()}
    starts = {device: np.array([way.within[0] for way in each]) for device, each in drawn.items()}
    held("luneburg", "all paths end where the axis leaves", (1, 0), ends["luneburg"])
    held("fisheye", "all paths end opposite to where they start", (1, 0), ends["fisheye"])
    held(
        "eaton",
        "every path leaves as far from the axis as it came, on the other side",
        -starts["eaton"][:, 1],
        ends["eaton"][:, 1],
    )
    for device in ("invisible", "cloak"):
        held(device, "every path leaves on the line that it came on", starts[device] * (-1, 1), ends[device])
    nearest = [np.hypot(*way.within.T).min() for way in drawn["cloak"]]
    hollow = Profile("cloak").hollow
    held("cloak", "light comes this near to the centre", hollow + (1 - hollow) * np.abs(starts["cloak"][:, 1]), nearest)
    # where the light that a bare mirror of radius 1 / a sends back crosses the rim
    a = Profile("magnifier").core
    p = starts["magnifier"][:, 1]
    seen_at = 2 * np.arcsin(a * p)
    normal = seen_at / 2
    point = np.stack([-np.cos(normal), np.sin(normal)], axis=-1) / a
    ahead = np.stack([-np.cos(seen_at), np.sin(seen_at)], axis=-1)
    off = ends["magnifier"] - point
    held(
        "magnifier",
        "distance of paths from what a mirror of radius 1 / a sends back",
        0,
        off[:, 0] * ahead[:, 1] - off[:, 1] * ahead[:, 0],
    )
    return found


NUMBER, TITLE = (
    "B.2",
    "Rays in graded balls: a lens, a fish-eye, a ball that sends light back, two that are not seen, a magnifier",
)
FIGURES = (drawn_figure(NUMBER, TITLE, claims, draw),)

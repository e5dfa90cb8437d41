# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure E.8: a beam of light as a wave, into water and into a NIM: its fronts run backwards there. Drawn; no bpy."""

import math
from functools import cache
from pathlib import Path

import numpy as np

from ..physics import MEDIA, Interface
from ..physics.wave_field import Beam, Field
from . import diagram_parts as parts
from .claims import Claim
from .drawing import INK, look, number, save, sheet
from .recipes import drawn_figure

ANGLE, WAIST = math.radians(35), 2.2  # of incidence; half the beam's width, in wavelengths
VIEW = (-8.0, 8.0, -6.5, 6.5)  # left, right, bottom, top
PIXELS = (480, 390)
DEPTH, ALONG = 6.0, np.linspace(-30, 30, 3001)  # where what has passed is measured
NAMES = {"water": "water", "nim": "NIM"}
ARROW = 3.1  # how far along the beams arrows stand


@cache
def beam(name: str) -> Beam:
    """The beam into one of NAMES."""
    return Beam(Interface(MEDIA[name]), ANGLE, WAIST)


@cache
def passed(name: str) -> Field:
    """Its field at DEPTH, at places ALONG."""
    return beam(name).at(ALONG, -DEPTH)


def ways(name: str) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Places in the beam before and after the interface, and unit vectors of its energy and of its phase there, (2,) each."""
    theta = float(beam(name).interface.theta_t(ANGLE))
    places = np.array([(-math.sin(ANGLE), math.cos(ANGLE)), (math.sin(theta), -math.cos(theta))]) * ARROW
    found = []
    for place in places:
        field = beam(name).at(*place)
        found.append((place, *(vector / np.linalg.norm(vector) for vector in (field.energy, field.phase))))
    return found


def draw(folder: Path) -> list[Path]:
    """Draw the figure into a folder; returns the Paths of its .svg and .png. RuntimeError where matplotlib is missing."""
    left, right, bottom, top = VIEW
    with look():
        drawing, axes = sheet(7.2, 3.3, 1, 2)
        drawing.subplots_adjust(0.01, 0.09, 0.99, 0.92, wspace=0.04)
        x = np.linspace(left, right, PIXELS[0])
        z = np.linspace(top, bottom, PIXELS[1])[:, None]
        for ax, (name, called) in zip(axes[0], NAMES.items(), strict=True):
            parts.view(ax, *VIEW)
            fronts = np.real(beam(name).at(x, z).E)
            ax.imshow(fronts, extent=VIEW, cmap="RdBu_r", vmin=-1.1, vmax=1.1, interpolation="bilinear", zorder=1)
            ax.plot([left, right], [0, 0], color=INK, linewidth=0.9, zorder=3)
            ax.axvline(0, color=INK, linewidth=0.6, linestyle=(0, (3, 2)), zorder=2)
            for place, energy, phase in ways(name):
                _arrow(ax, place, energy, INK, "-|>")
                # beside the beam, where it can be told from the other
                aside = np.array([-energy[1], energy[0]]) * 1.35
                _arrow(ax, place + aside, phase, parts.ORANGE, "->")
            ax.set_title(f"{called}, $n$ = {number(MEDIA[name].n)}", pad=4)
        _key(drawing)
        base = Path(folder) / f"figure-{NUMBER}"
        return save(drawing, f"Figure {NUMBER}: {TITLE}", f"{base}.svg", f"{base}.png")


def _arrow(ax, place, along, colour, head):
    tail, tip = place - 1.1 * along, place + 1.1 * along
    style = {"arrowstyle": head, "color": colour, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 13}
    ax.annotate("", tip, tail, arrowprops=style, zorder=5)


def _key(drawing):
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour, label=text) for colour, text in ((INK, "energy"), (parts.ORANGE, "phase"))]
    drawing.legend(handles=handles, loc="lower center", ncols=2, fontsize=8.5, borderpad=0)


def claims() -> list[Claim]:
    """Of the drawn fields, summed from plane waves: where energy and phase go, and how much gets through."""
    found = []
    for name, called in NAMES.items():
        interface, field = beam(name).interface, passed(name)
        down = -field.energy[:, 1]
        theta = float(interface.theta_t(ANGLE))
        aside = float((field.energy[:, 0]).sum() / down.sum())
        text = f"{called}: angle at which the energy goes on, from the normal"
        found.append(Claim(text, math.degrees(theta), math.degrees(math.atan(aside)), 0.2, "degrees"))
        middle = np.argmax(down)
        energy, phase = field.energy[middle], field.phase[middle]
        size = float(np.linalg.norm(phase))
        turned = math.degrees(math.acos(float(energy @ phase / np.linalg.norm(energy) / size)))
        text = f"{called}: angle between the way of the fronts and that of the energy"
        found.append(Claim(text, 180.0 if interface.inside.is_nim else 0.0, turned, 0.5, "degrees"))
        text = f"{called}: distance of the fronts, in wavelengths of vacuum"
        found.append(Claim(text, 1 / abs(interface.inside.n), 2 * math.pi / size, 0.005))
        # all that arrives, as it would go on without an interface
        whole = -Beam(Interface(interface.outside), ANGLE, WAIST).at(ALONG, -DEPTH).energy[:, 1].sum()
        T = 1 - float(interface.fresnel(math.cos(ANGLE)).R_s)
        found.append(Claim(f"{called}: share of the energy that gets through", T, float(down.sum() / whole), 0.002))
    return found


NUMBER, TITLE = (
    "E.8",
    "A beam as a wave, into water and into a NIM: there its fronts run towards the surface, its energy away",
)
FIGURES = (drawn_figure(NUMBER, TITLE, claims, draw),)

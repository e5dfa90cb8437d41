# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel curves: what an interface reflects at each angle (thesis A.1 to A.4). Data and claims need numpy only."""

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..base.files import whole
from ..physics import Interface, Medium, povray_reflectance
from .claims import Claim
from .drawing import BLUE, GREEN, GREY, INK, ORANGE, look, number, save, sheet
from .recipes import Figure, drawn_figure

Curves = dict[str, np.ndarray]  # by column, (1801,) each, the first the angle of incidence in degrees

AIR, NIM = Medium(1.0), Medium(-1.5)  # of A.1 to A.3
MAGNETIC = -10.0  # the permeability with which A.3 shows what POV-Ray has no word for
LIQUID = -1.33  # the index of A.4, as in thesis figure 5.10
PERMEABILITIES = (-1.0, -3.0, -10.0, -25.0)
STEP = 0.05  # degrees between two points of a curve


def standard_reflectances(n_i: float, n_t: float, cos_i) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R_s, R_p and R in the standard form for non-magnetic media (thesis 2.11 to 2.13), which fails where n < 0.

    With one negative index r_s and r_p are the reciprocals of what they should be. For comparison only.
    """
    cos_i = np.asarray(cos_i, float)
    cos_t = np.sqrt(1 - np.square(n_i / n_t) * (1 - np.square(cos_i)))
    R_s = np.square((n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t))
    R_p = np.square((n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t))
    return R_s, R_p, (R_s + R_p) / 2


# --- the numbers of each figure ---------------------------------------------------------------------------------------


def _angles():
    """The angle of incidence in degrees, and its cosine, which is 0 at the end."""
    degrees = np.linspace(0, 90, round(90 / STEP) + 1)
    cos_i = np.clip(np.cos(np.radians(degrees)), 0, 1)
    cos_i[-1] = 0
    return degrees, cos_i


def standard_curves() -> Curves:
    """Of A.1."""
    degrees, cos_i = _angles()
    R_s, R_p, R = standard_reflectances(AIR.n, NIM.n, cos_i)
    return {"theta_i": degrees, "R_s": R_s, "R_p": R_p, "R": R}


def impedance_curves() -> Curves:
    """Of A.2."""
    degrees, cos_i = _angles()
    ours = Interface(NIM, AIR).fresnel(cos_i)
    return {"theta_i": degrees, "R_s": ours.R_s, "R_p": ours.R_p, "R": ours.R, "T": ours.T}


def povray_curves() -> Curves:
    """Of A.3."""
    degrees, cos_i = _angles()
    return {
        "theta_i": degrees,
        "R": Interface(NIM, AIR).fresnel(cos_i).R,
        "R_povray": povray_reflectance(AIR.n, NIM.n, cos_i),
        f"R mu={MAGNETIC:g}": Interface(Medium(NIM.n, MAGNETIC), AIR).fresnel(cos_i).R,
    }


def permeability_curves() -> Curves:
    """Of A.4."""
    degrees, cos_i = _angles()
    columns = {"theta_i": degrees}
    for mu in PERMEABILITIES:
        interface = Interface(Medium(LIQUID, mu), AIR)
        columns[f"R in mu={mu:g}"] = interface.fresnel(cos_i).R
        columns[f"R out mu={mu:g}"] = interface.reversed().fresnel(cos_i).R
    return columns


# --- what must hold in them, against closed forms ---------------------------------------------------------------------

NORMAL = ((NIM.n + 1) / (NIM.n - 1)) ** 2  # R at 0 degrees: |r| = (|n| - 1) / (|n| + 1), written for n < 0
BREWSTER = math.degrees(math.atan(abs(NIM.n)))


def standard_claims() -> list[Claim]:
    """Of A.1."""
    columns, ours, n = standard_curves(), impedance_curves(), NIM.n
    degrees = columns["theta_i"]
    middle = slice(1, -1)
    return [
        Claim("R at 0 degrees is ((n-1)/(n+1))^2, above 1", ((n - 1) / (n + 1)) ** 2, columns["R"][0], 1e-9),
        Claim("R is above 1 at every angle but 90 degrees, share of them", 1, np.mean(columns["R"][:-1] > 1), 0),
        Claim("R_p grows without bound at arctan |n|", BREWSTER, degrees[np.argmax(columns["R_p"])], STEP, "deg"),
        Claim(
            "R_s is one over the R_s that conserves energy, largest product less 1",
            0,
            np.max(np.abs(columns["R_s"] * ours["R_s"] - 1)),
            1e-9,
        ),
        Claim(
            "R_p is one over the R_p that conserves energy, largest product less 1",
            0,
            np.max(np.abs(columns["R_p"] * ours["R_p"] - 1)[middle]),
            1e-9,
        ),
    ]


def impedance_claims() -> list[Claim]:
    """Of A.2."""
    columns = impedance_curves()
    degrees = columns["theta_i"]
    glass = np.array([_textbook_glass(abs(NIM.n), theta) for theta in np.radians(degrees[:-1])])
    return [
        Claim("R at 0 degrees is ((|n|-1)/(|n|+1))^2", NORMAL, columns["R"][0], 1e-12),
        Claim("R at 90 degrees", 1, columns["R"][-1], 1e-12),
        Claim("R never exceeds 1, largest R", 1, np.max(columns["R"]), 1e-12),
        Claim("R_p vanishes at Brewster's angle arctan |n|", BREWSTER, _minimum(degrees, columns["R_p"]), 1e-3, "deg"),
        Claim(
            "R is that of glass of index |n| by Fresnel's sine and tangent laws, largest difference",
            0,
            np.max(np.abs(columns["R"][:-1] - glass)),
            1e-12,
        ),
    ]


def povray_claims() -> list[Claim]:
    """Of A.3."""
    columns = povray_curves()
    z = abs(MAGNETIC / NIM.n)
    jump = ((z - 1) / (z + 1)) ** 2 - NORMAL
    magnetic = columns[f"R mu={MAGNETIC:g}"]
    return [
        Claim(
            "POV-Ray's R is ours where |mu| = 1, largest difference",
            0,
            np.max(np.abs(columns["R"] - columns["R_povray"])),
            1e-12,
        ),
        Claim(
            f"POV-Ray's R falls short at 0 degrees where mu = {MAGNETIC:g}, by",
            jump,
            magnetic[0] - columns["R_povray"][0],
            1e-12,
        ),
    ]


def permeability_claims() -> list[Claim]:
    """Of A.4."""
    columns = permeability_curves()
    degrees = columns["theta_i"]
    critical = math.degrees(math.asin(1 / abs(LIQUID)))
    claims = []
    for mu in PERMEABILITIES:
        z = abs(mu / LIQUID)
        inwards, outwards = columns[f"R in mu={mu:g}"], columns[f"R out mu={mu:g}"]
        at_normal = ((z - 1) / (z + 1)) ** 2
        claims += [
            Claim(f"mu = {mu:g}: R at 0 degrees is ((Z-1)/(Z+1))^2, Z = |mu/n|", at_normal, inwards[0], 1e-12),
            Claim(f"mu = {mu:g}: R at 0 degrees is the same from inside", inwards[0], outwards[0], 1e-12),
            Claim(
                f"mu = {mu:g}: total reflection from inside begins at arcsin(1/|n|)",
                critical,
                degrees[np.argmax(outwards == 1)],
                STEP,
                "deg",
            ),
        ]
    return claims


def _textbook_glass(n, theta):
    """Unpolarised R of ordinary glass in air, by Fresnel's sine and tangent laws: not the form used elsewhere."""
    if theta == 0:
        return ((n - 1) / (n + 1)) ** 2
    inner = math.asin(math.sin(theta) / n)
    s = math.sin(theta - inner) / math.sin(theta + inner)
    p = math.tan(theta - inner) / math.tan(theta + inner)
    return (s * s + p * p) / 2


def _minimum(x, y):
    """Where the parabola through the lowest point of a curve and its neighbours is lowest."""
    low = int(np.argmin(y))
    a, b, _ = np.polyfit(x[low - 1 : low + 2] - x[low], y[low - 1 : low + 2], 2)
    return float(x[low] - b / (2 * a))


# --- how they are drawn -----------------------------------------------------------------------------------------------

# s, p and unpolarised: colour, dashes, name
_POLARISATIONS = {
    "R_s": (BLUE, (0, (5, 1.5)), r"$R_s$"),
    "R_p": (ORANGE, (0, (1.2, 1.2)), r"$R_p$"),
    "R": (INK, "-", r"$R$, unpolarised"),
}


def _polarisations(ax, columns):
    for name, (colour, dashes, label) in _POLARISATIONS.items():
        ax.plot(columns["theta_i"], columns[name], color=colour, linestyle=dashes, label=label)


def _unit_axis(ax):
    ax.set_ylim(0, 1.02)
    ax.set_yticks(np.linspace(0, 1, 6))


def _into(medium):
    return f"from air into a NIM of $n$ = {number(medium.n)}"


def _draw_standard(axes, columns):
    (ax,) = axes
    _polarisations(ax, columns)
    ax.set_yscale("log")
    ax.set_ylim(0.5, 2000)
    ax.set_yticks([1, 10, 100, 1000], ["1", "10", "100", "1000"])
    ax.minorticks_off()
    ax.axhspan(0.5, 1, color="#e9e9e9", linewidth=0)
    ax.annotate("what nature allows: no more than 1", (2, 0.58), fontsize=8, color="#444444")
    ax.annotate(
        f"unbounded\nat {BREWSTER:.1f}°", (BREWSTER, 1500), (BREWSTER + 5, 560), fontsize=8, color=ORANGE, va="center"
    )
    ax.set_ylabel("reflectance")
    ax.set_title(f"Standard form, {_into(NIM)}")
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, 0.98))


def _draw_impedances(axes, columns):
    (ax,) = axes
    _polarisations(ax, columns)
    _unit_axis(ax)
    ax.annotate(
        f"Brewster's angle\n{BREWSTER:.1f}°",
        (BREWSTER, 0.0),
        (BREWSTER, 0.34),
        fontsize=8,
        ha="center",
        arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.7},
    )
    ax.annotate("0.04", (0, 0.04), (2, 0.07), fontsize=8)
    ax.set_ylabel("reflectance")
    ax.set_title(f"In impedances, {_into(NIM)}")
    ax.legend(loc="upper left")


def _draw_povray(axes, columns):
    (ax,) = axes
    degrees = columns["theta_i"]
    ax.plot(degrees, columns["R"], color=INK, label=f"ours, $\\mu$ = {number(NIM.mu)}")
    every = round(5 / STEP)
    ax.plot(
        degrees[::every],
        columns["R_povray"][::every],
        "o",
        color=ORANGE,
        markerfacecolor="white",
        markersize=4.5,
        clip_on=False,
        zorder=3,
        label="POV-Ray's, which has no $\\mu$",
    )
    ax.plot(
        degrees,
        columns[f"R mu={MAGNETIC:g}"],
        color=BLUE,
        linestyle=(0, (5, 1.5)),
        label=f"ours, $\\mu$ = {number(MAGNETIC)}",
    )
    _unit_axis(ax)
    ax.set_ylabel("unpolarised reflectance $R$")
    ax.set_title(_into(NIM)[:1].upper() + _into(NIM)[1:])
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, 0.9))


def _draw_permeabilities(axes, columns):
    degrees = columns["theta_i"]
    looks = [(INK, "-"), (BLUE, (0, (5, 1.5))), (GREEN, (0, (5, 1.5, 1, 1.5))), (ORANGE, (0, (2.5, 1.2)))]
    for way, ax in zip(("in", "out"), axes, strict=True):
        for mu, (colour, dashes) in zip(PERMEABILITIES, looks, strict=True):
            curve = columns[f"R {way} mu={mu:g}"]
            ax.plot(degrees, curve, color=colour, linestyle=dashes)
            if way == "in":
                # at the start of each curve, where they are furthest apart
                ax.annotate(f"$\\mu$ = {number(mu)}", (0, curve[0]), (2, curve[0] + 0.012), fontsize=8, color=colour)
    _unit_axis(axes[0])
    axes[0].set_ylabel("unpolarised reflectance $R$")
    axes[0].set_title(_into(Medium(LIQUID)).capitalize().replace("nim", "NIM"))
    axes[1].set_title("From that NIM into air")
    critical = math.degrees(math.asin(1 / abs(LIQUID)))
    axes[1].annotate(f"total reflection\nfrom {critical:.2f}°", (critical + 2, 0.5), fontsize=8)


# --- the figures ------------------------------------------------------------------------------------------------------


def _figure(
    number: str,
    title: str,
    curves: Callable[[], Curves],
    claims: Callable[[], list[Claim]],
    draw: Callable,
    panels: int = 1,
) -> Figure:
    """A Figure of curves in files .svg, .png and .csv, on axes (panels,) as draw(axes, curves) draws them."""

    def drawn(folder):
        columns = curves()
        with look():
            drawing, axes = sheet(2.6 + 2 * panels, 3.4, 1, panels, sharey=True)
            draw(axes[0], columns)
            for ax in axes.flat:
                ax.set_xlim(0, 90)
                ax.set_xticks(range(0, 91, 15))
                ax.set_xlabel(r"angle of incidence $\theta_i$ in degrees")
                ax.grid(color="#e4e4e4", linewidth=0.6)
                ax.set_axisbelow(True)
            drawing.tight_layout()
        base = Path(folder) / f"figure-{number}"
        files = save(drawing, f"Figure {number}: {title}", f"{base}.svg", f"{base}.png")
        return [*files, whole(f"{base}.csv", lambda part: _write_table(part, columns))]

    return drawn_figure(number, title, claims, drawn)


def _write_table(file, columns):
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows([f"{value:.12g}" for value in row] for row in zip(*columns.values(), strict=True))


FIGURES = (
    _figure(
        "A.1",
        "Fresnel's equations in their standard form, which a negative index drives above 1",
        standard_curves,
        standard_claims,
        _draw_standard,
    ),
    _figure(
        "A.2",
        "Fresnel's equations in impedances, which stay below 1 for either sign of the index",
        impedance_curves,
        impedance_claims,
        _draw_impedances,
    ),
    _figure(
        "A.3",
        "POV-Ray's reflectance beside ours: the same where the permeabilities are, and not for mu = -10",
        povray_curves,
        povray_claims,
        _draw_povray,
    ),
    _figure(
        "A.4",
        "Reflectance of a NIM for several permeabilities, from both sides",
        permeability_curves,
        permeability_claims,
        _draw_permeabilities,
        panels=2,
    ),
)

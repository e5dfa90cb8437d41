# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray fresnel`: reflectance and transmittance of an interface, as a table by angle or by wavelength."""

from __future__ import annotations

import argparse
import math
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base import records
from ..physics import DISPERSIVE, REPRESENTATIVE_NM, VISIBLE_NM, Interface, Medium
from ..physics.media import to_number
from ..physics.spectra import wavelengths
from ..physics.tables import HEAD, SPECTRAL_HEAD, Row, as_csv, spectrum, table
from . import words
from .words import UsageError

STEP = 5  # degrees
STEP_NM = 10
MOST_ROWS = 10_000

# The first wavelength, the last and the step, nanometres; () where none were given.
Steps = tuple[float, ...]


class Answer(NamedTuple):
    """A table, what JSON says beside its rows, and its text."""

    head: tuple[str, ...]
    rows: list[Row]
    told: dict
    lines: list[str]


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "fresnel",
        run,
        "Print reflectance and transmittance of an interface against the angle of incidence, or the wavelength.",
        "examples:\n"
        "  nimray fresnel --inside nim\n"
        "  nimray fresnel --inside n=-1.33,mu=-10 --outside water --csv\n"
        "  nimray fresnel --inside n-bk7 --wavelength 486.13\n"
        "  nimray fresnel --inside gold --spectrum 400:700:20\n\n"
        "Media that disperse, here alone:\n"
        + textwrap.fill(f"{', '.join(DISPERSIVE)},", 90, break_on_hyphens=False)
        + "\nthe path of a .yml file of refractiveindex.info, or functions such as\n"
        '"epsilon=drude(360),mu=drude(360)". Loss: -1.33+0.01j, n=-1.33,k=0.01, or\n'
        "n=-1.33,length=0.05, the metres within which light falls to 1/e.",
    )
    parser.add_argument("--inside", type=words.medium, required=True, metavar="M", help="medium the light enters")
    parser.add_argument(
        "--outside", type=words.medium, default=Medium(1.0), metavar="M", help="medium it comes from (air)"
    )
    parser.add_argument(
        "--step", type=words.whole("--step", 1, 90), metavar="DEG", help=f"of the table by angle ({STEP})"
    )
    at = parser.add_mutually_exclusive_group()
    at.add_argument(
        "--wavelength", type=words.wavelength, metavar="NM", help=f"in vacuum, nanometres ({REPRESENTATIVE_NM:g})"
    )
    at.add_argument(
        "--spectrum",
        type=_steps,
        nargs="?",
        const=(),
        metavar="A:B:STEP",
        help=f"n, k and R by wavelength, nanometres ({VISIBLE_NM[0]:g}:{VISIBLE_NM[1]:g}:{STEP_NM})",
    )
    parser.add_argument("--angle", type=_angle, metavar="DEG", help="of incidence, of the spectrum (0)")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="comma-separated values")
    words.add_json(form)


def _steps(text: str) -> Steps:
    try:
        first, last, step = (to_number(part) for part in text.split(":"))
        wavelengths([first, last])
    except ValueError as error:
        if "wavelength" in str(error):
            raise UsageError(str(error)) from None
        raise UsageError(f"--spectrum {text!r} is not understood; write it like 400:700:10.") from None
    if not (math.isfinite(step) and step > 0):
        raise UsageError(f"--spectrum {text!r} has a step that is no number above 0; write it like 400:700:10.")
    if first > last:
        raise UsageError(f"--spectrum {text!r} runs backwards; write it like {last:g}:{first:g}:{step:g}.")
    if (last - first) / step > MOST_ROWS:
        raise UsageError(f"--spectrum {text!r} has more than {MOST_ROWS} wavelengths; take a larger step.")
    return first, last, step


def _angle(text: str) -> float:
    value = words.number("--angle")(text)
    if not 0 <= value <= 90:
        raise UsageError(f"--angle {text} is out of range; it lies between 0 and 90.")
    return value


def run(arguments: argparse.Namespace) -> None:
    """Print the table."""
    interface, step, steps = Interface(arguments.inside, arguments.outside), arguments.step, arguments.spectrum
    if steps is not None and step is not None:
        raise UsageError("--step is of the table by angle; the step of a spectrum is written as --spectrum 400:700:10.")
    if steps is None and arguments.angle is not None:
        raise UsageError("--angle is of a spectrum; give it with --spectrum.")
    try:
        if steps is None:
            answer = _by_angle(interface, arguments.wavelength or REPRESENTATIVE_NM, step or STEP)
        else:
            answer = _by_wavelength(interface, _places(interface, steps), arguments.angle or 0.0)
    except ValueError as error:  # a medium that is not known at such a wavelength
        raise UsageError(str(error)) from None
    if arguments.csv:
        print(as_csv(answer.head, answer.rows), end="")
    elif arguments.json:
        rows = [dict(zip(answer.head, row, strict=True)) for row in answer.rows]
        print(records.text({**answer.told, "rows": rows}))
    else:
        print("\n".join(answer.lines))


def _places(interface: Interface, steps: Steps) -> NDArray:
    """Wavelengths (N,), nanometres; where none were given, those that are seen and that both media are known at."""
    if steps:
        first, last, step = steps
    else:
        known = [medium.dispersion.range_nm for medium in (interface.inside, interface.outside) if medium.dispersion]
        step = STEP_NM
        first = step * math.ceil(max(VISIBLE_NM[0], *(least for least, _ in known), 0) / step)
        last = min(VISIBLE_NM[1], *(most for _, most in known), math.inf)
    return np.round(first + step * np.arange(math.floor((last - first) / step + 1e-9) + 1), 9)


def _by_angle(interface: Interface, wavelength: float, step: int) -> Answer:
    there = interface.at(wavelength)
    rows = table(there, step)
    critical, brewster = (
        None if angle is None else math.degrees(angle) for angle in (there.critical_angle(), there.brewster_angle())
    )
    told = {
        "outside": _numbers(interface.outside, there.outside),
        "inside": _numbers(interface.inside, there.inside),
        "critical_angle": critical,
        "brewster_angle": brewster,
    }
    limits, at = interface.limits(wavelength), ""
    if not (interface.inside.is_real and interface.outside.is_real):
        told |= {"wavelength": wavelength, "limits": limits}
        at = f" at {wavelength:g} nm"
    lines = [
        f"from {interface.outside} into {interface.inside}{at}, angles in degrees",
        *_curves_at(interface.outside, there.outside),
        *_curves_at(interface.inside, there.inside),
        f"bends backwards: {'yes' if there.bends_backwards else 'no'}",
        f"critical angle:  {'none' if critical is None else f'{critical:.3f}'}",
        f"Brewster angle:  {'none' if brewster is None else f'{brewster:.3f}'}",
        *limits,
        f"{'theta_i':>8}{'theta_t':>10}{'R_s':>10}{'R_p':>10}{'R':>10}{'T':>10}",
    ]
    without = "none" if there.is_complex else "total"  # with loss, what is not reflected there is absorbed
    for theta, refracted, *powers in rows:
        angle = without if refracted is None else f"{refracted:.3f}"
        lines.append(f"{theta:8d}{angle:>10}" + _columns(powers))
    return Answer(HEAD, rows, told, lines)


def _by_wavelength(interface: Interface, wavelengths_nm: NDArray, angle: float) -> Answer:
    rows = spectrum(interface, wavelengths_nm, angle)
    told = {
        "outside": _named(interface.outside),
        "inside": _named(interface.inside),
        "angle": angle,
        "limits": interface.limits(),
    }
    lines = [
        f"from {interface.outside} into {interface.inside} at {angle:g} degrees, wavelengths in nanometres",
        *interface.limits(),
        f"{'wavelength':>10}{'n':>11}{'k':>12}{'R_s':>10}{'R_p':>10}{'R':>10}",
    ]
    for wavelength, n, k, *powers in rows:
        lines.append(f"{wavelength:10.7g}{n:11.6f}{k:12.6g}" + _columns(powers))
    return Answer(SPECTRAL_HEAD, rows, told, lines)


def _named(medium: Medium) -> dict:
    source = medium.dispersion.source if medium.dispersion else ""
    return {"medium": str(medium)} | ({"source": source} if source else {})


def _numbers(medium: Medium, there: Medium) -> dict:
    """A medium and its numbers at one wavelength; a real one has these two alone."""
    numbers = {"n": there.n, "mu": there.mu}
    return numbers if medium.is_real else {**_named(medium), **numbers, "k": there.k, "mu_imag": there.mu_imag}


def _curves_at(medium: Medium, there: Medium) -> list[str]:
    """The line with the numbers of a medium that disperses, at one wavelength."""
    if not medium.dispersion:
        return []
    mu = f"{there.permeability:.6g}" if there.mu_imag else f"{there.mu:.6g}"
    return [f"{medium}: n = {there.n:.6f}, k = {there.k:.6g}, mu = {mu}"]


def _columns(powers: Sequence[float | None]) -> str:
    return "".join(f"{power:10.6f}" for power in powers)

# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray fresnel`: reflectance and transmittance of an interface, as a table."""

from __future__ import annotations

import argparse
import csv
import dataclasses
import math
import sys

import numpy as np

from ..base import records
from ..physics import Interface, Medium
from . import words

HEAD = ("theta_i", "theta_t", "R_s", "R_p", "R", "T")

# The angle of incidence and that of refraction, degrees, None where all is reflected, and the four of Interface.fresnel().
Row = tuple[int | float | None, ...]


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "fresnel",
        run,
        "Print reflectance and transmittance of an interface against the angle of incidence.",
        "examples:\n  nimray fresnel --inside nim\n  nimray fresnel --inside n=-1.33,mu=-10 --outside water --csv",
    )
    parser.add_argument("--inside", type=words.medium, required=True, metavar="M", help="medium the light enters")
    parser.add_argument(
        "--outside", type=words.medium, default=Medium(1.0), metavar="M", help="medium it comes from (air)"
    )
    parser.add_argument("--step", type=words.whole("--step", 1, 90), default=5, metavar="DEG", help="of the table (5)")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="comma-separated values")
    words.add_json(form)


def run(arguments: argparse.Namespace) -> None:
    """Print the table."""
    interface = Interface(arguments.inside, arguments.outside)
    rows = table(interface, arguments.step)
    if arguments.csv:
        out = csv.writer(sys.stdout, lineterminator="\n")
        out.writerow(HEAD)
        out.writerows([["" if value is None else value for value in row] for row in rows])
    elif arguments.json:
        print(records.text(_answer(interface, rows)))
    else:
        _print(interface, rows)


def table(interface: Interface, step: int) -> list[Row]:
    """A row each `step` degrees from 0, and one at 90."""
    angles = np.unique([*range(0, 90, step), 90])
    cosines = np.where(angles == 90, 0.0, np.cos(np.radians(angles)))
    theta_t = np.degrees(interface.theta_t(np.radians(angles)))
    return [
        (int(theta), None if math.isnan(refracted) else float(refracted) + 0.0, *map(float, powers))
        for theta, refracted, *powers in zip(angles, theta_t, *interface.fresnel(cosines), strict=True)
    ]


def _answer(interface: Interface, rows: list[Row]) -> dict:
    critical, brewster = interface.critical_angle(), interface.brewster_angle()
    return {
        "outside": dataclasses.asdict(interface.outside),
        "inside": dataclasses.asdict(interface.inside),
        "critical_angle": None if critical is None else math.degrees(critical),
        "brewster_angle": None if brewster is None else math.degrees(brewster),
        "rows": [dict(zip(HEAD, row, strict=True)) for row in rows],
    }


def _print(interface: Interface, rows: list[Row]) -> None:
    critical, brewster = interface.critical_angle(), interface.brewster_angle()
    print(f"from {interface.outside} into {interface.inside}, angles in degrees")
    print(f"bends backwards: {'yes' if interface.bends_backwards else 'no'}")
    print(f"critical angle:  {'none' if critical is None else f'{math.degrees(critical):.3f}'}")
    print(f"Brewster angle:  {'none' if brewster is None else f'{math.degrees(brewster):.3f}'}")
    print(f"{'theta_i':>8}{'theta_t':>10}{'R_s':>10}{'R_p':>10}{'R':>10}{'T':>10}")
    for theta, refracted, *powers in rows:
        angle = "total" if refracted is None else f"{refracted:.3f}"
        print(f"{theta:8d}{angle:>10}" + "".join(f"{power:10.6f}" for power in powers))

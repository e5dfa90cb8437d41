# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray rays`: where rays go, drawn."""

from __future__ import annotations

import argparse

from . import words
from .words import UsageError


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "rays",
        run,
        "Draw where rays go: a sphere, a pool, a slab, a prism, a drop, a flat lens, a lamp over a pool, a graded ball or a "
        "window, cut through the middle.",
        "examples:\n"
        "  nimray rays sphere --n -1.5 --beam 21 --out sphere.svg\n"
        "  nimray rays pool --n -1.33 --out pool.svg\n"
        "  nimray rays prism --spectrum\n"
        "  nimray rays prism --spectrum --inside nim-causal --out causal.svg\n"
        "  nimray rays lens --n -1.05\n"
        "  nimray rays ball --device eaton --out eaton.svg\n"
        "  nimray rays window --eta -1.2\n"
        "  nimray rays window --across 2 --along -3 --out slab.svg",
    )
    number, beam = words.number, words.whole("--beam", 1, 101)
    parser.add_argument(
        "scene", type=str.lower, metavar="SCENE", help="sphere, pool, slab, prism, drop, lens, lamp, ball or window"
    )
    parser.add_argument("--n", type=number("--n"), metavar="N", help="refractive index (what the scene is about)")
    parser.add_argument(
        "--mu", type=number("--mu"), metavar="MU", help="relative permeability (1, or -1 for n < 0; of the lens N)"
    )
    parser.add_argument("--inside", type=words.medium, metavar="M", help="the medium, in the place of --n and --mu")
    parser.add_argument("--spectrum", action="store_true", help="white light, drawn by its colours from 400 to 700 nm")
    parser.add_argument("--device", type=str.lower, metavar="D", help="of the ball: luneburg, fisheye, eaton, ...")
    parser.add_argument("--core", type=number("--core"), metavar="R", help="radius of a mirror in the ball (0 to 1)")
    parser.add_argument("--cap", type=number("--cap"), metavar="N", help="the largest index in the ball")
    parser.add_argument("--eta", type=number("--eta"), metavar="E", help="of the window's lenslets, -f2 / f1")
    parser.add_argument("--across", type=number("--across"), metavar="X", help="permittivity across a uniaxial slab")
    parser.add_argument("--along", type=number("--along"), metavar="Z", help="its permittivity along the normal")
    parser.add_argument("--beam", type=beam, metavar="N", help="how many rays; 1 shows its angles")
    parser.add_argument(
        "--out", type=words.folder, metavar="FILE", help="what to write, .svg, .png or .pdf (SCENE.svg)"
    )


def run(arguments: argparse.Namespace) -> None:
    """Draw, and print what was written."""
    from ..figures import ball_diagram, window_diagram
    from ..figures.diagrams import diagram

    file = arguments.out or f"{arguments.scene}.svg"
    try:
        if arguments.scene == "ball":
            profile = _profile(arguments)
            print(ball_diagram.diagram(profile, arguments.beam or ball_diagram.RAYS, file))
            return
        if arguments.scene == "window":
            print(window_diagram.diagram(_law(arguments), arguments.beam or window_diagram.RAYS, file))
            return
        if (arguments.eta, arguments.across, arguments.along) != (None, None, None):
            raise ValueError("--eta, --across and --along are of a window; write nimray rays window --eta ...")
        if (arguments.device, arguments.core, arguments.cap) != (None, None, None):
            raise ValueError("--device, --core and --cap are of a graded ball; write nimray rays ball --device ...")
        print(
            diagram(
                arguments.scene,
                arguments.n,
                arguments.mu,
                arguments.beam,
                file,
                inside=arguments.inside,
                spectrum=arguments.spectrum,
            )
        )
    except ValueError as error:
        raise UsageError(str(error)) from None


def _profile(arguments):
    """The Profile of the ball that is asked for; ValueError where there is none."""
    from ..physics.graded import Profile

    if (arguments.n, arguments.mu, arguments.inside) != (None, None, None) or arguments.spectrum:
        raise ValueError("a graded ball is no medium of one index, and its rays are of no colour; give --device alone.")
    return Profile(arguments.device or "luneburg", core=arguments.core, cap=arguments.cap)


def _law(arguments):
    """The LensletWindow, or the UniaxialSlab, that is asked for; ValueError where there is none."""
    from ..physics.lenslet import LensletWindow
    from ..physics.uniaxial import UniaxialSlab

    if (arguments.n, arguments.mu, arguments.inside, arguments.device, arguments.core, arguments.cap) != (None,) * 6:
        raise ValueError("a window is no medium and no ball; give --eta, or --across and --along of a slab.")
    if arguments.spectrum:
        raise ValueError("a window is the same for all colours; leave --spectrum out.")
    if arguments.across is None and arguments.along is None:
        return LensletWindow(-1.0 if arguments.eta is None else arguments.eta)
    if arguments.eta is not None:
        raise ValueError("--eta is of lenslets, --across and --along are of a slab; give one or the others.")
    across, along = (usual if one is None else one for one, usual in ((arguments.across, 2.0), (arguments.along, -3.0)))
    return UniaxialSlab(across, along)

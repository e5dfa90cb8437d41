# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray render`: an image of a scene or of a .blend, an earlier one again, or a sequence of them."""

from __future__ import annotations

import argparse
import dataclasses
import re
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.options import BACKENDS, CAUSTICS, FPS, LAST_FRAME, MOST_PASSES, MOST_PHOTONS, MOST_SAMPLES, MOST_SEED
from ..base.text import fit
from . import blender, words
from .act import carry_out, refused, with_options
from .render_blend import Said, render_blend, request_of
from .report import Output
from .words import UsageError

if TYPE_CHECKING:
    pass


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "render",
        run,
        "Render a scene, or one of a .blend, to NAME.exr (linear, 32-bit) and NAME.png (as displayed).",
        "examples:\n"
        "  nimray render sphere\n"
        "  nimray render sphere --set n=1.5 companions=yes --samples 256 --size 1280x960\n"
        "  nimray render glass --set liquid=water view=top --denoise\n"
        "  nimray render pool --set liquid=nim mu=-10 view=window\n"
        "  nimray render --again renders/sphere.exr --samples 1024\n"
        "  nimray render pool --set view=window --frames 1-48 --denoise\n"
        "  nimray render sphere spectral=yes --samples 256\n"
        "  nimray render sphere --wavelengths 400:700:10 --pixel 400,300\n"
        "  nimray render mine.blend --frames 1-48 --size 50%\n\n"
        "With --frames, the waves of pool and sea move: NAME_0001, NAME_0002, ... show them (frame - 1) / FPS seconds\n"
        "after their parameter time, each frame with a noise of its own (of seed S + frame). What is there already, and\n"
        "was made of the same, is not rendered again.\n\n"
        "A .blend is rendered as it is, by Cycles, after the checks of the add-on have said what would spoil the picture;\n"
        "--frames are those of its animation. Caustics that it has are traced anew where something has moved since.\n\n"
        "A spectral render has all wavelengths: media that disperse show their colours. With --wavelengths each is rendered\n"
        "by itself, into a spectral EXR; the mean of a pixel, or of a region, by wavelength goes to NAME.csv.\n\n"
        "`nimray scenes` lists the scenes and the keys that --set takes.",
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE|FILE", help=f"{words.A_SCENE}, or a .blend")
    parser.add_argument("--scene", metavar="NAME", dest="which", help="of a .blend with several scenes")
    parser.add_argument("--strict", action="store_true", help="refuse a .blend of which the checks find something")
    add_options(parser)
    parser.add_argument("--blend", action="store_true", help="save the Blender file too")
    parser.add_argument("--again", metavar="FILE", help="repeat the render that made this EXR or PNG")
    parser.add_argument("--frames", type=words.frames, metavar="A-B", help="a sequence of images, what moves moving")
    step = words.whole("--step", 1, LAST_FRAME)
    parser.add_argument("--step", type=step, metavar="N", help="every N-th frame of a .blend (1)")
    parser.add_argument("--fps", type=words.rate, metavar="FPS", help=f"frames a second ({FPS})")
    parser.add_argument(
        "--wavelengths",
        type=words.stack,
        metavar="A:B:STEP",
        help="a spectral EXR: one render a wavelength, in nm",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--pixel", type=words.region, metavar="X,Y", help="its spectrum to NAME.csv, with --wavelengths")
    where.add_argument("--region", type=words.region, metavar="X,Y,W,H", help="the same of the mean of a part")


def add_options(parser: argparse.ArgumentParser, *, out: str = "renders", named: bool = True) -> None:
    """Add the options that every subcommand has which renders a scene; `out`: the folder, `named`: what has a name."""
    samples, seed = words.whole("--samples", 1, MOST_SAMPLES), words.whole("--seed", 0, MOST_SEED)
    photons = words.whole("--photons", 1, MOST_PHOTONS)
    passes = words.whole("--spectral-passes", 1, MOST_PASSES)
    add = parser.add_argument
    add("--set", nargs="+", action="extend", default=[], metavar="KEY=VALUE", dest="assignments", help="parameters")
    add("--samples", type=samples, metavar="N", help="paths a pixel (128)")
    add("--size", type=words.size, metavar="WxH|P%", help="pixels, or a part of the scene's own size (100%%)")
    add("--seed", type=seed, metavar="S", help="of the noise (0)")
    add("--out", type=words.folder, default=out, metavar="DIR", help=f"folder to write to ({out})")
    if named:
        add("--name", type=words.name, metavar="NAME", help="of the files, without suffix (scene and settings)")
    add("--backend", choices=BACKENDS, help="OSL, or Blender's own nodes (auto: OSL where there is some)")
    add("--spectral", action=words.Switched, help="all wavelengths in one picture (spectral=yes)")
    add(
        "--spectral-passes",
        type=passes,
        metavar="K",
        help="renders of a part of the wavelengths each (as suits samples)",
    )
    add("--wavelength", type=words.wavelength, metavar="NM", help="the only one that media are at (550)")
    add("--denoise", action=words.Switched, help="clean the noise (OpenImageDenoise)")
    add(
        "--caustics",
        choices=CAUSTICS,
        help="of the sun: found by chance (path), or traced from it (traced, where the sun is narrow)",
    )
    add("--photons", type=photons, metavar="N", help="for traced caustics (16 million)")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--quiet", action="store_true", help="print nothing but errors")
    done = (
        '{"done": samples, "total": samples, "left": seconds or null} as it goes and {"files": [...]} at the end; '
        'with --frames also "frame", its number, and "frames", how many there are'
        if named
        else '{"done": tasks, "total": tasks, "left": seconds or null, ...} as it goes and {"files": [...]} at the end'
    )
    form.add_argument("--progress", action="store_true", help=f"for programs: print JSON lines, {done}")


def run(arguments: argparse.Namespace) -> None:
    """Render what was asked for."""
    if arguments.again and (arguments.scene or arguments.assignments):
        raise UsageError("--again repeats a scene with its parameters; give it without SCENE and --set.")
    if arguments.again and arguments.frames:
        raise UsageError("--again repeats one image; give it without --frames.")
    if arguments.fps and not arguments.frames:
        raise UsageError("--fps goes with --frames.")
    _check_stack(arguments)
    if not arguments.again and not arguments.scene:
        raise UsageError(f"name a scene to render: {words.A_SCENE}, or a .blend.")
    of_blend = bool(re.search(r"\.blend\d*$", arguments.scene or "", re.IGNORECASE))  # Blender numbers its backups
    _check_blend(arguments, of_blend)
    blender.load()
    if of_blend:
        if not arguments.wavelengths:
            return render_blend(arguments)
        with refused():
            asked = request_of(arguments)
            said = Said(asked, strict=arguments.strict, quiet=arguments.quiet, noisy=arguments.denoise is False)
            request = asked.decided()
        return _render_stack(request, arguments, arguments.name or words.own_name(request.name), {}, said)
    from ..renders.request import Request
    from ..scenes.parameters import file_name

    made_with = record = None
    with refused():
        if arguments.again:
            try:
                request, record = Request.again(arguments.again)
            except FileNotFoundError as error:
                raise UsageError(str(error)) from None
            made_with, usual = record["blender"], f"{fit(Path(arguments.again).stem)}_again"
        else:
            request = Request.of(arguments.scene, arguments.assignments)
            usual = file_name(str(request.scene), arguments.assignments + ["spectral=yes"] * bool(arguments.spectral))
        request = with_options(request, arguments)
    name = arguments.name or words.own_name(usual)
    repeated = "wavelengths" in (record or {}) and not (arguments.spectral or arguments.wavelength)
    if arguments.wavelengths or repeated:
        return _render_stack(request, arguments, name, record or {})
    if arguments.frames:
        return _render_frames(request, arguments, name)
    with Output(1, quiet=arguments.quiet, progress=arguments.progress) as output:
        rendered = carry_out(request, arguments.out, name, output, blend=arguments.blend, made_with=made_with)
        output.end([rendered.exr, rendered.png], rendered.record["size"], rendered.record["samples"])


def _check_blend(arguments, of_blend):
    if of_blend:
        if arguments.fps:
            raise UsageError("--fps is of the waves of pool and sea; a .blend has its own frames.")
        if arguments.step and not arguments.frames:
            raise UsageError("--step goes with --frames.")
        return
    for name, option in (("which", "--scene"), ("strict", "--strict"), ("step", "--step")):
        if getattr(arguments, name):
            raise UsageError(f"{option} is of a .blend; give one in the place of SCENE, or leave {option} out.")


def _check_stack(arguments):
    if not arguments.wavelengths:
        if not arguments.again and (arguments.pixel or arguments.region):
            raise UsageError(
                "--pixel and --region are of a spectrum; give them with --wavelengths, such as 400:700:10."
            )
        return
    if arguments.spectral or arguments.wavelength is not None or arguments.spectral_passes:
        raise UsageError(
            "--wavelengths renders one wavelength at a time; leave --spectral, --spectral-passes and --wavelength out."
        )
    if arguments.frames:
        raise UsageError("--wavelengths makes one spectral image; leave --frames out.")


def _render_stack(request, arguments, name, record, before=None):
    from ..renders.stack import Stack

    if arguments.blend:
        raise UsageError("a stack is of no Blender file; leave --blend out, or render with --wavelength or --spectral.")
    with refused():
        wavelengths = arguments.wavelengths or record["wavelengths"]
        region = arguments.pixel or arguments.region or record.get("region")
        if arguments.again:  # of an image that was perhaps spectral
            request = dataclasses.replace(request, spectral=False, spectral_passes=None, wavelength=None)
        stack = Stack(request, wavelengths, region)
    if not (arguments.name or arguments.again):
        name = words.own_name(f"{name}_wavelengths-{len(stack.wavelengths)}")
    with Output(1, quiet=arguments.quiet, progress=arguments.progress) as output:
        with refused():
            made = stack.render(arguments.out, name, showing=output.showing, tracing=output.tracing, before=before)
        files = [made.exr, made.png, *([made.csv] if made.csv else [])]
        output.end(files, made.record["size"], made.record["samples"])


def _render_frames(request, arguments, name):
    if not request.moves:
        raise UsageError(f"nothing moves in the {request.scene}; --frames is for the pool and the sea.")
    with refused():
        moments = request.sequence(*arguments.frames, arguments.fps or FPS)
    with Output(len(moments), quiet=arguments.quiet, progress=arguments.progress) as output:
        for frame, moment in moments.items():
            output.frame = frame
            rendered = carry_out(moment, arguments.out, f"{name}_{frame:04}", output, keep=True, blend=arguments.blend)
            output.written([rendered.exr, rendered.png])
        output.end([], rendered.record["size"], rendered.record["samples"])

# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray compare`: a scene once for each value of a parameter, and all of them side by side."""

from __future__ import annotations

import argparse
import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.text import in_any_case
from . import blender, words
from .act import carry_out, refused, with_options
from .render import add_options
from .report import Output
from .words import UsageError

if TYPE_CHECKING:
    from ..renders.request import Request


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "compare",
        run,
        "Render a scene once for each value of a parameter, and all of them side by side into one image, with captions.",
        "examples:\n"
        "  nimray compare glass\n"
        "  nimray compare sphere --vary n=1.5,-1.5,-4.1 --set companions=yes\n"
        "  nimray compare pool --vary liquid=nim,n=-1.33,mu=-10 --set view=window --samples 256\n\n"
        "Commas part the values, but for the one before mu=, which belongs to its medium. Without --vary: empty, water\n"
        "and NIM. Each image is kept too; in the comparison they stand from left to right in the order of the values.",
    )
    parser.add_argument("scene", metavar="SCENE", help=words.A_SCENE)
    parser.add_argument(
        "--vary", nargs="+", action="extend", default=[], metavar="KEY=A,B,...", help="one image for each of the values"
    )
    add_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Render the images and join them."""
    blender.load()
    from ..base.files import check_targets
    from ..renders.montage import caption
    from ..renders.request import Request
    from ..scenes import SCENES, scene_type
    from ..scenes.parameters import file_name

    with refused():
        scene = scene_type(in_any_case(arguments.scene, SCENES))
    variants = []
    liquids = [field.name for field in dataclasses.fields(scene.parameters) if field.metadata["kind"] == "liquid"]
    for assignments in words.variants(arguments.vary, liquids) if arguments.vary else scene.variants():
        try:
            request = Request.of(scene.name, [*arguments.assignments, *assignments])
        except ValueError as error:
            raise UsageError(f"{' '.join(assignments)}: {error}") from None
        with refused():
            variants.append((assignments, with_options(request, arguments)))
    stem = arguments.name or file_name(scene.name, arguments.assignments)
    names = [words.own_name(file_name(stem, assignments)) for assignments, _ in variants]
    if len({request for _, request in variants}) < len(variants) or len(set(names)) < len(names):
        raise UsageError("--vary names the same value twice; each image needs one of its own.")
    joined = arguments.name or f"{stem}_compare"
    check_targets(Path(os.path.expanduser(arguments.out), f"{joined}{suffix}") for suffix in (".exr", ".png"))
    settings = {"set": arguments.assignments} if arguments.assignments else {}
    compared = {**settings, "compares": [" ".join(assignments) for assignments, _ in variants]}
    captions = [caption(assignments) for assignments, _ in variants]
    requests = dict(zip(names, (request for _, request in variants), strict=True))
    with Output(len(variants), quiet=arguments.quiet, progress=arguments.progress) as output:
        render_side_by_side(requests, arguments.out, joined, compared, output, captions)


def render_side_by_side(
    requests: dict[str, Request], folder: str, joined: str, compared: dict, output: Output, captions: Sequence[str] = ()
) -> None:
    """Render requests, by the names of their images, and all of them side by side.

    joined:   name of the comparison
    compared: what its record says that is not in those of the images: "compares", what each of them shows, and "set"
    captions: a line for each image, below it in the comparison; none if empty
    """
    from ..renders.montage import montage

    images = []
    for name, request in requests.items():
        rendered = carry_out(request, folder, name, output)
        images.append((rendered.exr, rendered.png))
        output.written(images[-1])
    common = {key: value for key, value in rendered.record.items() if key != "parameters"}
    joint = montage(folder, joined, images, {**common, **compared, "images": list(requests)}, captions)
    output.end(joint, rendered.record["size"], rendered.record["samples"])

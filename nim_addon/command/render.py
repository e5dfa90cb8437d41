# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray render`: an image of a scene, an earlier one again, or a sequence of them."""

from __future__ import annotations

import argparse
import dataclasses
import re
from pathlib import Path

from ..base.options import BACKENDS, CAUSTICS, FPS, LARGEST_SIDE, MOST_PHOTONS, MOST_SAMPLES, MOST_SEED
from ..base.text import fit, printable
from ..base.version import VERSION
from . import blender, words
from .report import Failure, Output, note
from .words import UsageError


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "render",
        run,
        "Render a scene to NAME.exr (linear, 32-bit) and NAME.png (as displayed).",
        "examples:\n"
        "  nimray render sphere\n"
        "  nimray render sphere --set n=1.5 companions=yes --samples 256 --size 1280x960\n"
        "  nimray render glass --set liquid=water view=top --denoise\n"
        "  nimray render pool --set liquid=nim mu=-10 view=window\n"
        "  nimray render --again renders/sphere.exr --samples 1024\n"
        "  nimray render pool --set view=window --frames 1-48 --denoise\n\n"
        "With --frames, the waves of pool and sea move: NAME_0001, NAME_0002, ... show them (frame - 1) / FPS seconds\n"
        "after their parameter time, each frame with a noise of its own (of seed S + frame). What is there already, and\n"
        "was made of the same, is not rendered again.\n\n"
        "`nimray scenes` lists the scenes and the keys that --set takes.",
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="glass, pool, sphere or sea")
    add_options(parser)
    parser.add_argument("--blend", action="store_true", help="save the Blender file too")
    parser.add_argument("--again", metavar="FILE", help="repeat the render that made this EXR or PNG")
    parser.add_argument("--frames", type=words.frames, metavar="A-B", help="a sequence of images, the waves moving")
    parser.add_argument("--fps", type=words.rate, metavar="FPS", help=f"frames a second ({FPS})")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that every subcommand has which renders a scene."""
    samples, seed = words.whole("--samples", 1, MOST_SAMPLES), words.whole("--seed", 0, MOST_SEED)
    photons = words.whole("--photons", 1, MOST_PHOTONS)
    add = parser.add_argument
    add("--set", nargs="+", action="extend", default=[], metavar="KEY=VALUE", dest="assignments", help="parameters")
    add("--samples", type=samples, metavar="N", help="paths a pixel (128)")
    add("--size", type=words.size, metavar="WxH|P%", help="pixels, or a part of the scene's own size (100%%)")
    add("--seed", type=seed, metavar="S", help="of the noise (0)")
    add("--out", type=words.folder, default="renders", metavar="DIR", help="folder to write to (renders)")
    add("--name", type=words.name, metavar="NAME", help="of the files, without suffix (scene and settings)")
    add("--backend", choices=BACKENDS, help="OSL, or Blender's own nodes (auto: OSL where there is some)")
    add("--denoise", action=argparse.BooleanOptionalAction, help="clean the noise (OpenImageDenoise)")
    add(
        "--caustics",
        choices=CAUSTICS,
        help="of the sun: found by chance (path), or traced from it (traced, where the sun is narrow)",
    )
    add("--photons", type=photons, metavar="N", help="for traced caustics (16 million)")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--quiet", action="store_true", help="print nothing but errors")
    form.add_argument(
        "--progress",
        action="store_true",
        help="for programs: print JSON lines, "
        '{"done": samples, "total": samples, "left": seconds or null} as it goes and {"files": [...]} at the end; '
        'with --frames also "frame", its number, and "frames", how many there are',
    )


def run(arguments: argparse.Namespace) -> None:
    """Render what was asked for."""
    if arguments.again and (arguments.scene or arguments.assignments):
        raise UsageError("--again repeats a scene with its parameters; give it without SCENE and --set.")
    if arguments.again and arguments.frames:
        raise UsageError("--again repeats one image; give it without --frames.")
    if arguments.fps and not arguments.frames:
        raise UsageError("--fps goes with --frames.")
    if not arguments.again and not arguments.scene:
        raise UsageError("name a scene to render: glass, pool, sphere or sea.")
    blender.load()
    record = recorded(arguments.again) if arguments.again else {}
    kind = scene_type(arguments.scene or record["scene"])
    try:
        read = kind.parameters.read
        parameters = kind.parameters.of(record["parameters"]) if record else read(arguments.assignments)
    except ValueError as error:
        raise UsageError(f"{arguments.again}: {error}" if record else str(error)) from None
    from ..scenes.parameters import file_name

    if arguments.frames:
        name = arguments.name or words.own_name(file_name(kind.name, arguments.assignments))
        return _render_frames(arguments, kind, _moments(arguments, kind, parameters), name)
    default = f"{fit(Path(arguments.again).stem)}_again" if record else file_name(kind.name, arguments.assignments)
    with Output(arguments, 1) as output:
        files, made = make(arguments, kind, parameters, record, arguments.name or words.own_name(default), output)
        output.end(files, made["size"], made["samples"])


def scene_type(name: str):
    """The scene of a name, in any case."""
    from ..scenes import SCENES, scene_type
    from ..scenes.parameters import in_any_case

    try:
        return scene_type(in_any_case(name, SCENES))
    except ValueError as error:
        raise UsageError(str(error)) from None


def _moments(arguments, kind, parameters):
    """{frame: the parameters that its image shows} of --frames."""
    if not any(field.name == "time" for field in dataclasses.fields(parameters)):
        raise UsageError(f"nothing moves in the {kind.name}; --frames is for the pool and the sea.")
    first, last = arguments.frames
    fps = arguments.fps or FPS
    try:
        return {
            frame: dataclasses.replace(parameters, time=parameters.time + (frame - 1) / fps)
            for frame in range(first, last + 1)
        }
    except ValueError as error:
        raise UsageError(str(error)) from None


def _render_frames(arguments, kind, moments, name):
    with Output(arguments, len(moments)) as output:
        for frame, parameters in moments.items():
            output.frame = frame
            files, made = make(arguments, kind, parameters, {}, f"{name}_{frame:04}", output)
            output.written(files)
        output.end([], made["size"], made["samples"])


def make(arguments, kind, parameters, record, name, output):
    """Build and render a scene as `arguments`, else `record` (of an earlier render) say; returns (exr, png) and its record.

    A frame of a sequence that is there already, made of the same, is left as it is.
    """
    from .. import caustics
    from ..base.files import writable_folder
    from ..cycles import material, render

    backend = material.resolve(arguments.backend or record.get("backend", "auto"))
    denoise = arguments.denoise if arguments.denoise is not None else record.get("denoise", False)
    if denoise and not blender.can_denoise():
        raise Failure("this Blender was built without OpenImageDenoise; leave --denoise out and take more samples.")

    def given(value, key, default):
        return value if value is not None else record.get(key, default)

    try:
        scene = kind.build(parameters, backend)
    except ValueError as error:
        raise UsageError(str(error)) from None
    traced = given(arguments.caustics, "caustics", caustics.best_way(scene)) == "traced"
    if arguments.photons and not traced:
        raise UsageError("--photons goes with --caustics traced.")
    if traced:
        try:
            caustics.Bake(scene)
        except ValueError as error:
            raise UsageError(f"--caustics traced: {error}") from None
    folder = writable_folder(arguments.out)

    own = record.get("size", (scene.render.resolution_x, scene.render.resolution_y))
    width, height = arguments.size(own) if arguments.size else own
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.cycles.samples = given(arguments.samples, "samples", scene.cycles.samples)
    # the noise must not stand still while the waves move
    scene.cycles.seed = (given(arguments.seed, "seed", 0) + (output.frame or 0)) % 2**31
    scene.cycles.use_denoising = denoise
    photons = {"photons": given(arguments.photons, "photons", caustics.PHOTONS)} if traced else {}
    made = {
        "nimray": VERSION,
        "scene": kind.name,
        "parameters": parameters.plain(),
        "size": [width, height],
        "samples": scene.cycles.samples,
        "seed": scene.cycles.seed,
        "denoise": scene.cycles.use_denoising,
        "backend": backend,
        "caustics": "traced" if traced else "path",
        **photons,
        "blender": blender.load().app.version_string,
    }
    files = [folder / f"{name}{suffix}" for suffix in (".exr", ".png")]
    blend = getattr(arguments, "blend", False)
    if output.frame and render.record_of(files[0]) == made and (not blend or (folder / f"{name}.blend").is_file()):
        if not arguments.quiet:
            note(f"{files[0]} is there already.")
        return files, made
    if traced:
        _trace_caustics(scene, made, output, folder / f".{name}.photons")
    if record and not arguments.quiet and record["blender"] != made["blender"]:
        note(f"made with Blender {printable(record['blender'])}, repeated with {made['blender']}.")
    with output.showing(name, made["samples"]) as show:
        files = render.render(scene, folder, name, metadata=made, progress=show, blend=blend)
    return files, made


def _trace_caustics(scene, made, output, file):
    from .. import caustics

    photons = made["photons"]
    texels = 512 if photons < 1 << 20 else 2048
    with output.tracing(made["samples"], photons) as show:
        try:
            caustics.bake(scene, photons=photons, texels=texels, seed=made["seed"], file=file, progress=show)
        except ValueError as error:
            raise UsageError(f"--caustics traced: {error}") from None


# ------------------------------------------------------------------------------------------------ an earlier render


def recorded(path: str) -> dict:
    """What made an image, to be made again: each value one that could have been written on the command line."""
    from ..cycles.render import read_metadata

    try:
        record = read_metadata(path)
    except (ValueError, FileNotFoundError) as error:
        raise UsageError(str(error)) from None
    if "compares" in record:
        images = record["images"] if isinstance(record.get("images"), list) else []
        raise UsageError(
            f"{path} is a comparison, not one render; repeat one of its images: "
            f"{', '.join(f'{name}.exr' for name in images)}."
        )
    if "code" in record:
        raise UsageError(f"{path} is a part of a figure; repeat it with `nimray figures`.")
    missing = {"nimray", "scene", "parameters", "size", "samples", "seed", "denoise", "blender"} - set(record)
    if missing:
        raise UsageError(f"{path} does not record its {', '.join(sorted(missing))}, so it cannot be repeated.")
    if _version(record.get("nimray")) > _version(VERSION):
        raise UsageError(
            f"{path} was made by nimray {record['nimray']}, and this is {VERSION}; repeat it with that one."
        )
    for key, value in record.items():
        if key not in RECORDED or not RECORDED[key](value):
            raise UsageError(f"{path} records {key} = {value!r}, which no render has, so it cannot be repeated.")
    return record


def _version(text):
    """A version as numbers to compare; what is none is none that we made."""
    return (
        tuple(map(int, text.split("."))) if isinstance(text, str) and re.fullmatch(r"\d{1,4}(\.\d{1,4})*", text) else ()
    )


def _between(low, high):
    return lambda value: type(value) is int and low <= value <= high


def _of_type(kind):
    return lambda value: isinstance(value, kind)


# What a render records, and whether a value of it is one.
RECORDED = {
    "nimray": lambda value: _version(value) > (),
    "scene": _of_type(str),  # which of them, and with what parameters, they say themselves
    "parameters": _of_type(dict),
    "size": lambda value: isinstance(value, list) and len(value) == 2 and all(map(_between(1, LARGEST_SIDE), value)),
    "samples": _between(1, MOST_SAMPLES),
    "seed": _between(0, MOST_SEED),
    "denoise": _of_type(bool),
    "backend": lambda value: value in BACKENDS,
    "caustics": lambda value: value in CAUSTICS,
    "photons": _between(1, MOST_PHOTONS),
    "blender": _of_type(str),
}

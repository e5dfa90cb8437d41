# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: `nimray ...`, `python -m nim_addon ...`. bpy is imported only by the subcommands that render."""

import argparse
import contextlib
import csv
import dataclasses
import math
import os
import re
import signal
import sys
from pathlib import Path

from .base import libraries, records, signals, streams
from .base.progress import Bar, Output
from .base.text import fit, printable
from .base.version import VERSION
from .physics import MEDIA, Interface, Medium
from .physics.media import to_number

OLDEST_BLENDER = (4, 2, 0)  # the Ray Portal closure, which bends a ray backwards, came with it
# As cycles.material has them, which cannot be imported without Blender.
BACKENDS = ("auto", "osl", "nodes")
NAMES = {"osl": "OSL", "nodes": "Blender's own nodes"}
CAUSTICS = ("path", "traced")
LARGEST = 16384  # pixels a side
MOST_SAMPLES = 1 << 20
MOST_SEED = 2**31 - 1
MOST_PHOTONS = 1 << 40
LAST_FRAME = 9999  # four digits in a file's name
LONGEST_SAID = 600  # letters of a sentence
LONGEST_NAME = 200  # bytes, of the 255 that file systems take: what is half written has a longer one
FPS = 24

USAGE, FAILURE = 2, 1


class UsageError(Exception):
    """What was asked for makes no sense: exit code 2."""


class Failure(Exception):
    """What was asked for could not be done: exit code 1."""


class _Parser(argparse.ArgumentParser):
    """Of the command, or of one of its subcommands, which each refuse themselves what they do not know."""

    def __init__(self, *words, **more):
        super().__init__(*words, **more)
        # what is a value though it begins as an option does; argparse's own knows neither -1. nor -1e-3
        self._negative_number_matcher = re.compile(r"-(\.?\d|inf|nan)", re.IGNORECASE)

    def parse_known_args(self, *words):
        found, unknown = super().parse_known_args(*words)
        if unknown:
            forgotten = "--set" in self.format_usage() and any(re.match(r"\w+=", word) for word in unknown)
            hint = "; parameters come after --set" if forgotten else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        return found, unknown

    def error(self, message):
        raise UsageError(f"{message}. Try `{self.prog} --help`.")


def main(argv=None):
    """Run the command with `argv` (a list of words, default those of the process); returns the exit code."""
    try:
        arguments = _parser().parse_args(argv)
        return arguments.run(arguments) or 0
    except UsageError as error:
        return _complain(error, USAGE)
    except (Failure, OSError, RuntimeError) as error:
        return _complain(_sentence(error), FAILURE)
    except MemoryError:
        return _complain("there is not enough memory for this; ask for less, such as a smaller --size.", FAILURE)
    except KeyboardInterrupt:  # where watch() has not been called
        return _complain("stopped.", 128 + signal.SIGINT)


def _sentence(error):
    """The text of an error, also of one that the system or Blender raised: without numbers and brackets."""
    if isinstance(error, OSError) and error.errno:
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror}."
    return " ".join(str(error).removeprefix("Error: ").split())


def _complain(error, code):
    said = printable(error)
    if len(said) > LONGEST_SAID:  # of a word of thousands of letters, its ends will do
        said = f"{said[: LONGEST_SAID // 2]} ... {said[-LONGEST_SAID // 4 :]}"
    print(f"nimray: {said}", file=sys.stderr)
    return code


def script():
    """What __main__ runs: main(), then an exit without Blender's noise about memory it still holds."""
    try:
        code = main()
    except SystemExit as stop:  # of --help and --version
        code = stop.code
    if lost := streams.close():
        code = _complain(lost, code or FAILURE)
    signals.leave(code)


# ------------------------------------------------------------------------------------------------ what a person writes


def _medium(text):
    try:
        return Medium.parse(text)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _size(text):
    """A function that turns a scene's own size (width, height) into the one that was asked for."""
    if text.endswith("%"):
        part = _whole("--size", 1, 100, "%")(text)
        return lambda own: tuple(max(1, round(side * part / 100)) for side in own)
    words = text.lower().split("x")
    if len(words) != 2 or not all(word.isdecimal() for word in words):
        raise UsageError(f"--size {text!r} is not a size; write it like 800x600 or 50%.")
    size = tuple(int(word) for word in words)
    if not all(1 <= side <= LARGEST for side in size):
        raise UsageError(f"--size {text} is out of range; each side lies between 1 and {LARGEST} pixels.")
    return lambda own: size


def _whole(option, low, high, unit=""):
    def read(text):
        try:
            value = to_number(text.removesuffix(unit), int)
        except ValueError:
            raise UsageError(f"{option} {text!r} is not a whole number.") from None
        if not low <= value <= high:
            raise UsageError(f"{option} {text} is out of range; it lies between {low}{unit} and {high}{unit}.")
        return value

    return read


def _number(option):
    def read(text):
        try:
            return to_number(text)
        except ValueError:
            raise UsageError(f"{option} {text!r} is not a number.") from None

    return read


def _frames(text):
    """First and last frame of a text such as 1-48, or 12."""
    words = text.split("-")
    if len(words) > 2 or not all(word.isdecimal() for word in words):
        raise UsageError(f"--frames {text!r} is not a range; write it like 1-48, or 12 for one frame.")
    first, last = int(words[0]), int(words[-1])
    if not (1 <= first <= LAST_FRAME and 1 <= last <= LAST_FRAME):
        raise UsageError(f"--frames {text} is out of range; frames lie between 1 and {LAST_FRAME}.")
    if first > last:
        raise UsageError(f"--frames {text} runs backwards; write it like {last}-{first}.")
    return first, last


def _rate(text):
    rate = _number("--fps")(text)
    if not 0.01 <= rate <= 1000:
        raise UsageError(f"--fps {text} is out of range; it lies between 0.01 and 1000.")
    return rate


def _name(text):
    if len(os.fsencode(text)) > LONGEST_NAME:
        raise UsageError(f"--name of {len(text)} letters is too long for a file; use at most {LONGEST_NAME}.")
    if not text or text in (".", "..") or fit(text) != text or text[0] in "- " or text[-1] in ". ":
        raise UsageError(f"--name {text!r} cannot name a file; use letters, digits, dots and dashes.")
    return text


def _own_name(text):
    """The name that files get of what was asked for."""
    try:
        return _name(text)
    except UsageError:
        raise UsageError(f"no file can be named {text!r}, after all that is set; give --name.") from None


def _folder(text):
    if not text:
        raise UsageError("--out is empty; name what to write to, or leave it out.")
    return text


def _parser():
    parser = _Parser(
        prog="nimray",
        description="Negative-index materials, rendered with Cycles by the physics.",
        epilog="Media are written by name or number: glass, -1.33, n=-1.33,mu=-10. Names: " + ", ".join(MEDIA) + ".",
    )
    parser.add_argument("--version", action="version", version=f"nimray {VERSION}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=_Parser)

    def command(name, run, summary, **more):
        one = commands.add_parser(
            name, help=summary, description=summary, formatter_class=argparse.RawDescriptionHelpFormatter, **more
        )
        one.set_defaults(run=run)
        return one

    one = command(
        "render",
        _render,
        "Render a scene to NAME.exr (linear, 32-bit) and NAME.png (as displayed).",
        epilog="examples:\n"
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
    one.add_argument("scene", nargs="?", metavar="SCENE", help="glass, pool, sphere or sea")
    _render_options(one)
    one.add_argument("--blend", action="store_true", help="save the Blender file too")
    one.add_argument("--again", metavar="FILE", help="repeat the render that made this EXR or PNG")
    one.add_argument("--frames", type=_frames, metavar="A-B", help="a sequence of images, the waves moving")
    one.add_argument("--fps", type=_rate, metavar="FPS", help=f"frames a second ({FPS})")

    one = command(
        "compare",
        _compare,
        "Render a scene once for each value of a parameter, and all of them side by side into one image.",
        epilog="examples:\n"
        "  nimray compare glass\n"
        "  nimray compare sphere --vary n=1.5,-1.5,-4.1 --set companions=yes\n"
        "  nimray compare pool --vary liquid=nim,n=-1.33,mu=-10 --set view=window --samples 256\n\n"
        "Commas part the values, but for the one before mu=, which belongs to its medium. Without --vary: empty, water\n"
        "and NIM. Each image is kept too; in the comparison they stand from left to right in the order of the values.",
    )
    one.add_argument("scene", metavar="SCENE", help="glass, pool, sphere or sea")
    one.add_argument(
        "--vary", nargs="+", action="extend", default=[], metavar="KEY=A,B,...", help="one image for each of the values"
    )
    _render_options(one)

    one = command(
        "figures",
        _figures,
        "Render figures of the thesis and measure in them what it claims; without a number, list them.",
        epilog="examples:\n"
        "  nimray figures\n"
        "  nimray figures 5.4 5.6 --out figures\n"
        "  nimray figures --all --quality final --out figures\n\n"
        "DIR/index.html shows each figure beside its claims. What is there already, and was made of the same, is not\n"
        "rendered again. Exit code 1 if a claim fails.",
    )
    one.add_argument("numbers", nargs="*", metavar="NUMBER", help="of the figure, such as 5.4")
    one.add_argument("--all", action="store_true", help="every figure")
    one.add_argument("--out", type=_folder, default="figures", metavar="DIR", help="folder to write to (figures)")
    one.add_argument(
        "--quality", choices=("draft", "final"), default="draft", help="draft (minutes) or final (large, clean)"
    )
    one.add_argument("--backend", choices=BACKENDS, default="auto", help="OSL, or Blender's own nodes")
    form = one.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="for programs")
    form.add_argument("--quiet", action="store_true", help="print the verdicts only")

    one = command(
        "rays",
        _rays,
        "Draw where rays go: a sphere, a pool, a slab or a prism, cut through the middle.",
        epilog="examples:\n"
        "  nimray rays sphere --n -1.5 --beam 21 --out sphere.svg\n"
        "  nimray rays pool --n -1.33 --out pool.svg",
    )
    one.add_argument("scene", type=str.lower, metavar="SCENE", help="sphere, pool, slab or prism")
    one.add_argument("--n", type=_number("--n"), metavar="N", help="refractive index (what the scene is about)")
    one.add_argument("--mu", type=_number("--mu"), metavar="MU", help="relative permeability (1, or -1 for n < 0)")
    one.add_argument("--beam", type=_whole("--beam", 1, 101), metavar="N", help="how many rays; 1 shows its angles")
    one.add_argument("--out", type=_folder, metavar="FILE", help="what to write, .svg, .png or .pdf (SCENE.svg)")

    one = command("scenes", _scenes, "List the scenes and their parameters.")
    one.add_argument("--json", action="store_true", help="for programs")

    one = command(
        "fresnel",
        _fresnel,
        "Print reflectance and transmittance of an interface against the angle of incidence.",
        epilog="examples:\n  nimray fresnel --inside nim\n  nimray fresnel --inside n=-1.33,mu=-10 --outside water --csv",
    )
    one.add_argument("--inside", type=_medium, required=True, metavar="M", help="medium the light enters")
    one.add_argument("--outside", type=_medium, default=Medium(1.0), metavar="M", help="medium it comes from (air)")
    one.add_argument("--step", type=_whole("--step", 1, 90), default=5, metavar="DEG", help="of the table (5)")
    form = one.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="comma-separated values")
    form.add_argument("--json", action="store_true", help="for programs")

    one = command("verify", _verify, "Measure with Cycles whether this Blender obeys the equations (about 20 s).")
    one.add_argument("--backend", choices=BACKENDS, default="auto", help="OSL, or Blender's own nodes")
    one.add_argument("--json", action="store_true", help="for programs")
    one.add_argument("--quiet", action="store_true", help="print the verdict only")

    one = command("doctor", _doctor, "Say what this installation has, what is missing, and how to mend it.")
    one.add_argument("--json", action="store_true", help="for programs")

    one = command("info", _info, "Show what made an image.")
    one.add_argument("file", metavar="FILE", help="an EXR or PNG written by nimray")
    one.add_argument("--json", action="store_true", help="for programs")
    return parser


def _render_options(one):
    one.add_argument(
        "--set", nargs="+", action="extend", default=[], metavar="KEY=VALUE", dest="assignments", help="parameters"
    )
    one.add_argument("--samples", type=_whole("--samples", 1, MOST_SAMPLES), metavar="N", help="paths a pixel (128)")
    one.add_argument("--size", type=_size, metavar="WxH|P%", help="pixels, or a part of the scene's own size (100%%)")
    one.add_argument("--seed", type=_whole("--seed", 0, MOST_SEED), metavar="S", help="of the noise (0)")
    one.add_argument("--out", type=_folder, default="renders", metavar="DIR", help="folder to write to (renders)")
    one.add_argument("--name", type=_name, metavar="NAME", help="of the files, without suffix (scene and settings)")
    one.add_argument("--backend", choices=BACKENDS, help="OSL, or Blender's own nodes (auto: OSL where there is some)")
    one.add_argument("--denoise", action=argparse.BooleanOptionalAction, help="clean the noise (OpenImageDenoise)")
    one.add_argument(
        "--caustics",
        choices=CAUSTICS,
        help="of the sun: found by chance (path), or traced from it (traced, where the sun is narrow)",
    )
    one.add_argument(
        "--photons", type=_whole("--photons", 1, MOST_PHOTONS), metavar="N", help="for traced caustics (16 million)"
    )
    form = one.add_mutually_exclusive_group()
    form.add_argument("--quiet", action="store_true", help="print nothing but errors")
    form.add_argument(
        "--progress",
        action="store_true",
        help="for programs: print JSON lines, "
        '{"done": samples, "total": samples, "left": seconds or null} as it goes and {"files": [...]} at the end; '
        'with --frames also "frame", its number, and "frames", how many there are',
    )


# ------------------------------------------------------------------------------------------------ what it does


def _bpy():
    """Blender as a module, of a version that can render a NIM; Failure says what to do about it otherwise."""
    try:
        with signals.importing():
            import bpy
    except ImportError as error:
        raise Failure(libraries.why_not(error)) from None
    if bpy.app.version < OLDEST_BLENDER:
        oldest = ".".join(map(str, OLDEST_BLENDER[:2]))
        raise Failure(
            f"Blender {bpy.app.version_string} is too old: no ray can bend backwards before {oldest}; "
            f"use {oldest} or newer."
        )
    return bpy


def _scene_type(name):
    from .scenes import SCENES, scene_type
    from .scenes.parameters import in_any_case

    try:
        return scene_type(in_any_case(name, SCENES))
    except ValueError as error:
        raise UsageError(str(error)) from None


def _render(arguments):
    if arguments.again and (arguments.scene or arguments.assignments):
        raise UsageError("--again repeats a scene with its parameters; give it without SCENE and --set.")
    if arguments.again and arguments.frames:
        raise UsageError("--again repeats one image; give it without --frames.")
    if arguments.fps and not arguments.frames:
        raise UsageError("--fps goes with --frames.")
    if not arguments.again and not arguments.scene:
        raise UsageError("name a scene to render: glass, pool, sphere or sea.")
    _bpy()
    record = _recorded(arguments.again) if arguments.again else {}
    kind = _scene_type(arguments.scene or record["scene"])
    try:
        read = kind.parameters.read
        parameters = kind.parameters.of(record["parameters"]) if record else read(arguments.assignments)
    except ValueError as error:
        raise UsageError(f"{arguments.again}: {error}" if record else str(error)) from None
    from .scenes.parameters import file_name

    if arguments.frames:
        name = arguments.name or _own_name(file_name(kind.name, arguments.assignments))
        return _render_frames(arguments, kind, _moments(arguments, kind, parameters), name)
    default = f"{fit(Path(arguments.again).stem)}_again" if record else file_name(kind.name, arguments.assignments)
    with Output(arguments, 1) as output:
        files, made = _make(arguments, kind, parameters, record, arguments.name or _own_name(default), output)
        output.end(files, made)


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
            files, made = _make(arguments, kind, parameters, {}, f"{name}_{frame:04}", output)
            output.written(files)
        output.end([], made)


def _compare(arguments):
    _bpy()
    kind = _scene_type(arguments.scene)
    from .base.files import check_targets
    from .renders.montage import montage
    from .scenes.parameters import file_name

    variants = []
    for assignments in _varied(kind, arguments.vary or [kind.compared]):
        try:
            variants.append((assignments, kind.parameters.read([*arguments.assignments, *assignments])))
        except ValueError as error:
            raise UsageError(f"{' '.join(assignments)}: {error}") from None
    stem = arguments.name or file_name(kind.name, arguments.assignments)
    names = [_own_name(file_name(stem, assignments)) for assignments, _ in variants]
    if len({parameters for _, parameters in variants}) < len(variants) or len(set(names)) < len(names):
        raise UsageError("--vary names the same value twice; each image needs one of its own.")
    joined = arguments.name or f"{stem}_compare"
    check_targets(Path(os.path.expanduser(arguments.out), f"{joined}{suffix}") for suffix in (".exr", ".png"))
    with Output(arguments, len(variants)) as output:
        images = []
        for (_, parameters), name in zip(variants, names, strict=True):
            files, made = _make(arguments, kind, parameters, {}, name, output)
            images.append(files)
            output.written(files)
        common = {key: value for key, value in made.items() if key != "parameters"}
        compared = {"compares": [" ".join(assignments) for assignments, _ in variants], "images": names}
        settings = {"set": arguments.assignments} if arguments.assignments else {}
        output.end(montage(arguments.out, joined, images, {**common, **settings, **compared}), made)


def _varied(kind, words):
    """The settings of each variant, a list of texts "key=value", from words such as "liquid=none,n=-1.33,mu=-10"."""
    variants = []
    for word in words:
        key, equals, values = word.partition("=")
        if not equals:
            raise UsageError(f"--vary {word!r} is not understood; write KEY=A,B,C.")
        liquid = any(
            field.name == key and field.metadata["kind"] == "liquid" for field in dataclasses.fields(kind.parameters)
        )
        for value in re.split(r",(?!\s*mu\s*=)", values):
            # where the parameter is no medium, mu is one of its own
            variants.append([f"{key}={value}"] if liquid else f"{key}={value}".split(","))
    if len(variants) < 2:
        raise UsageError(f"--vary {' '.join(words)} is one image; give at least two values, KEY=A,B.")
    return variants


def _make(arguments, kind, parameters, record, name, output):
    """Build and render a scene as `arguments`, else `record` (of an earlier render) say; returns (exr, png) and its record.

    A frame of a sequence that is there already, made of the same, is left as it is.
    """
    from . import caustics
    from .base.files import writable_folder
    from .cycles import material, render

    backend = material.resolve(arguments.backend or record.get("backend", "auto"))
    denoise = arguments.denoise if arguments.denoise is not None else record.get("denoise", False)
    if denoise and not _can_denoise():
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
        "blender": _bpy().app.version_string,
    }
    files = [folder / f"{name}{suffix}" for suffix in (".exr", ".png")]
    blend = getattr(arguments, "blend", False)
    if output.frame and render.record_of(files[0]) == made and (not blend or (folder / f"{name}.blend").is_file()):
        if not arguments.quiet:
            print(f"nimray: {files[0]} is there already.", file=sys.stderr)
        return files, made
    if traced:
        _trace_caustics(scene, made, output, folder / f".{name}.photons")
    if record and not arguments.quiet and record["blender"] != made["blender"]:
        made_with = printable(record["blender"])
        print(f"nimray: made with Blender {made_with}, repeated with {made['blender']}.", file=sys.stderr)
    with output.showing(name, made["samples"]) as show:
        files = render.render(scene, folder, name, metadata=made, progress=show, blend=blend)
    return files, made


def _trace_caustics(scene, made, output, file):
    from . import caustics

    texels = 512 if made["photons"] < 1 << 20 else 2048
    with output.tracing(made) as show:
        try:
            caustics.bake(scene, photons=made["photons"], texels=texels, seed=made["seed"], file=file, progress=show)
        except ValueError as error:
            raise UsageError(f"--caustics traced: {error}") from None


def _recorded(path):
    """What made an image, to be made again: each value one that could have been written on the command line."""
    from .cycles.render import read_metadata

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
    "size": lambda value: isinstance(value, list) and len(value) == 2 and all(map(_between(1, LARGEST), value)),
    "samples": _between(1, MOST_SAMPLES),
    "seed": _between(0, MOST_SEED),
    "denoise": _of_type(bool),
    "backend": lambda value: value in BACKENDS,
    "caustics": lambda value: value in CAUSTICS,
    "photons": _between(1, MOST_PHOTONS),
    "blender": _of_type(str),
}


def _describe(field):
    data = field.metadata
    if data["kind"] in ("number", "integer"):
        allowed = f"{data['low']:g} to {data['high']:g}{' ' + data['unit'] if data.get('unit') else ''}"
    elif data["kind"] == "switch":
        allowed = "yes or no"
    elif data["kind"] == "liquid":
        allowed = "none, a medium's name, or an index"
    elif data["kind"] == "mesh":
        allowed = ", ".join(data["choices"]) + ", or a PLY, OBJ or STL file"
    else:
        allowed = ", ".join(data["choices"])
    return allowed


def _default_of(field):
    value = field.default
    if isinstance(value, bool):
        return "yes" if value else "no"
    return {None: "none" if field.metadata["kind"] == "liquid" else "auto"}.get(value, str(value))


def _scenes(arguments):
    _bpy()
    from .scenes import SCENES

    listed = [
        {
            "name": kind.name,
            "shows": kind.shows,
            "parameters": [
                {
                    "key": field.name,
                    "description": field.metadata["description"],
                    "allowed": _describe(field),
                    "default": _default_of(field),
                }
                for field in dataclasses.fields(kind.parameters)
            ],
        }
        for kind in SCENES.values()
    ]
    if arguments.json:
        print(records.text(listed))
        return
    for kind in listed:
        print(f"{kind['name']}: {kind['shows']}")
        for one in kind["parameters"]:
            print(f"  {one['key']:<12} {one['description']} ({one['allowed']}; default {one['default']})")
        print()
    print("Render one with: nimray render SCENE --set KEY=VALUE ...")


def _figures(arguments):
    _bpy()
    from .figures.registry import FIGURES, figure
    from .scenes.parameters import in_any_case

    if arguments.all and arguments.numbers:
        raise UsageError("give either numbers of figures, or --all.")
    # each once, however often it is named
    numbers = dict.fromkeys(in_any_case(number, FIGURES) for number in arguments.numbers)
    try:
        chosen = list(FIGURES.values()) if arguments.all else [figure(number) for number in numbers]
    except ValueError as error:
        raise UsageError(str(error)) from None
    if not chosen:
        return _list_figures(FIGURES.values(), arguments.json)
    from .figures import run

    made = []
    for one in chosen:
        record = run.make(one, arguments.out, arguments.quality, backend=arguments.backend, showing=_showing(arguments))
        made.append(record)
        if not arguments.json:
            _print_figure(record, arguments)
    if arguments.json:
        print(records.text(made))
    failed = [record["figure"] for record in made if not record["holds"]]
    if len(made) > 1 and not arguments.json:
        verdict = f"FAIL: figures {', '.join(failed)}" if failed else f"PASS: {len(made)} figures"
        print(f"{verdict}; see {Path(arguments.out) / 'index.html'}")
    return FAILURE if failed else 0


def _list_figures(figures, as_json):
    if as_json:
        listed = [
            {"figure": one.number, "title": one.title, "shows": one.shows, "must_hold": one.must_hold}
            for one in figures
        ]
        print(records.text(listed))
        return
    for one in figures:
        print(f"{one.number}: {one.title}")
        for sentence in one.must_hold:
            print(f"  - {sentence}")
    print("\nRender and measure with: nimray figures NUMBER ... --out DIR, or --all.")


def _showing(arguments):
    """A function (name, samples) that returns what tells a person how far that image is."""

    @contextlib.contextmanager
    def showing(name, samples):
        if arguments.quiet or arguments.json or not sys.stderr.isatty():
            yield None
        else:
            bar = Bar(name)
            try:
                yield bar
            finally:
                bar.end()

    return showing


def _print_figure(record, arguments):
    from .figures.claims import Claim

    if not arguments.quiet:
        print(f"{record['figure']} {record['title']}")
    for one in record["claims"]:
        if not (arguments.quiet and one["holds"]):
            print("  " + Claim(*(one[field] for field in Claim._fields)).row())
    failed = sum(not one["holds"] for one in record["claims"])
    verdict = f"FAIL: {failed} of" if failed else "PASS"
    where = Path(arguments.out) / record["picture"]
    print(
        f"{verdict} figure {record['figure']}, {len(record['claims'])} claims, {record['seconds']:.0f} s: {where}",
        flush=True,
    )


def _rays(arguments):
    from .figures.diagrams import diagram

    file = arguments.out or f"{arguments.scene}.svg"
    try:
        print(diagram(arguments.scene, arguments.n, arguments.mu, arguments.beam, file))
    except ValueError as error:
        raise UsageError(str(error)) from None


def _fresnel(arguments):
    import numpy as np

    interface = Interface(arguments.inside, arguments.outside)
    angles = np.unique([*range(0, 90, arguments.step), 90])
    cosines = np.where(angles == 90, 0.0, np.cos(np.radians(angles)))
    values = interface.fresnel(cosines)
    theta_t = np.degrees(interface.theta_t(np.radians(angles)))
    head = ("theta_i", "theta_t", "R_s", "R_p", "R", "T")
    rows = [
        (int(a), None if math.isnan(t) else float(t) + 0.0, *map(float, v))
        for a, t, *v in zip(angles, theta_t, *values, strict=True)
    ]
    critical, brewster = interface.critical_angle(), interface.brewster_angle()
    if arguments.csv:
        out = csv.writer(sys.stdout, lineterminator="\n")
        out.writerow(head)
        out.writerows([["" if value is None else value for value in row] for row in rows])
    elif arguments.json:
        print(
            records.text(
                {
                    "outside": dataclasses.asdict(interface.outside),
                    "inside": dataclasses.asdict(interface.inside),
                    "critical_angle": None if critical is None else math.degrees(critical),
                    "brewster_angle": None if brewster is None else math.degrees(brewster),
                    "rows": [dict(zip(head, row, strict=True)) for row in rows],
                }
            )
        )
    else:
        print(f"from {interface.outside} into {interface.inside}, angles in degrees")
        print(f"bends backwards: {'yes' if interface.bends_backwards else 'no'}")
        print(f"critical angle:  {'none' if critical is None else f'{math.degrees(critical):.3f}'}")
        print(f"Brewster angle:  {'none' if brewster is None else f'{math.degrees(brewster):.3f}'}")
        print(f"{'theta_i':>8}{'theta_t':>10}{'R_s':>10}{'R_p':>10}{'R':>10}{'T':>10}")
        for a, t, *v in rows:
            print(f"{a:8d}{'total' if t is None else f'{t:.3f}':>10}" + "".join(f"{x:10.6f}" for x in v))


def _verify(arguments):
    _bpy()
    from .cycles import verify

    show = None
    if sys.stderr.isatty() and not (arguments.quiet or arguments.json):

        def show(done, total):
            print(f"\rmeasuring {done}/{total}", end="\n" if done == total else "", file=sys.stderr, flush=True)

    checks = verify.verify(show, arguments.backend)
    answer = verify.summary(checks, arguments.backend)
    if arguments.json:
        print(records.text(answer))
    else:
        if not arguments.quiet:
            print(verify.HEADER)
            for check in checks:
                print(check.row())
        failed = sum(not check.passed for check in checks)
        verdict = "PASS" if answer["passed"] else f"FAIL: {failed} of"
        print(f"{verdict} {len(checks)} checks, Blender {answer['blender']}, {NAMES[answer['backend']]}")
    return 0 if answer["passed"] else FAILURE


def _doctor(arguments):
    import platform

    import numpy

    facts = {"nimray": VERSION, "python": platform.python_version(), "numpy": numpy.__version__}
    problems = []
    try:
        bpy = _bpy()
        from .cycles.material import osl_available, resolve

        facts["blender"] = bpy.app.version_string
        facts["osl"] = osl_available()
        facts["materials"] = NAMES[resolve("auto")]
        facts["denoiser"] = _can_denoise()
        facts["devices"] = _devices()
    except Failure as error:
        problems.append(str(error))
    try:
        import OpenImageIO

        facts["openimageio"] = OpenImageIO.VERSION_STRING
    except ImportError as error:
        problems.append(f"OpenImageIO is missing ({error}), so no image can be written; run: pip install OpenImageIO")
    if arguments.json:
        print(records.text({**facts, "problems": problems}))
    else:
        for key, value in facts.items():
            print(f"{key:<12} {value if not isinstance(value, list) else ', '.join(value)}")
        print("\n".join(f"problem: {problem}" for problem in problems) or "Everything that is needed is here.")
    return FAILURE if problems else 0


def _devices():
    import _cycles

    return [device[0] for device in _cycles.available_devices("CPU")]


def _can_denoise():
    import _cycles

    return _cycles.with_openimagedenoise


def _info(arguments):
    _bpy()
    from .cycles.render import read_metadata

    try:
        record = read_metadata(arguments.file)
    except (ValueError, FileNotFoundError) as error:
        raise UsageError(str(error)) from None
    if arguments.json:
        print(records.text(record))
        return
    for key, value in record.items():
        if isinstance(value, dict):
            value = ", ".join(f"{k}={'none' if v is None else v}" for k, v in value.items())
        elif isinstance(value, list):
            value = (" x " if key == "size" else ", ").join(map(str, value))
        print(printable(f"{key:<12} {value}"))

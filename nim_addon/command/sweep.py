# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray sweep`: many renders of one plan, here or on many machines, and what they show together."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import functools
import json
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.options import FPS
from ..base.text import duration
from . import blender, words
from .act import refused, with_options
from .render import add_options
from .report import FAILURE, Failure, note
from .sweep_board import Board
from .words import UsageError

if TYPE_CHECKING:
    from ..renders.request import Request
    from ..sweeps.children import Child
    from ..sweeps.orders import Engine
    from ..sweeps.plan import Task

WITHOUT_ASKING = 100_000  # tasks of a plan
NAMED = 5  # points, or problems, that are named one by one
OUT = "sweep"  # folder, where nobody names one
PLACES = ("local", "dask", "slurm")
HERE = PLACES[:2]  # where this machine's own Blenders render
MAKING = (
    *("vary", "csv", "frames", "wavelengths", "split", "scene", "assignments", "samples", "size", "seed", "backend"),
    *("spectral", "spectral_passes", "wavelength", "denoise", "caustics", "photons"),
)  # options of which a plan is made
ADDRESS = re.compile(r"(?:(?:tcp|tls)://)?(?:[\w.-]+|\[[\da-fA-F:.]+\]):(\d{1,5})")  # of a scheduler, as Dask takes it


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "sweep",
        run,
        "Render a family of pictures: a scene, a .blend or a plan, with values that vary.",
        "examples:\n"
        "  nimray sweep sphere --vary n=-4:1.5:0.25 --size 400x300\n"
        "  nimray sweep pool --vary n=-1.5:1.5:0.25 --vary mu=-1,-10 --set view=window --measure window,R\n"
        "  nimray sweep sea --frames 1-48 --film sea.mp4\n"
        "  nimray sweep sphere --samples 4096 --split 64 --workers 2\n"
        "  nimray sweep mine.blend --vary 'NIM:Index Inside=-2:-1:0.1'\n"
        "  nimray sweep sweep/plan.jsonl\n"
        "  nimray sweep --status sweep\n\n"
        "A value of each --vary with each of the others is a picture. DIR/plan.jsonl holds them, one a line; it may be\n"
        "edited and given in the place of a scene. What is done already is not rendered again, so the same command goes on\n"
        "where it was stopped. At the end DIR has table.csv, sheet.png, a contact sheet, and index.html with sliders.",
    )
    _add_plan(parser.add_argument)
    _add_act(parser.add_argument)
    add_options(parser, out=OUT, named=False)


def _add_plan(add: Callable) -> None:
    add("what", nargs="?", metavar="SCENE|FILE", help=f"{words.A_SCENE}, a .blend, or a plan.jsonl")
    add(
        "--vary",
        nargs="+",
        action="extend",
        default=[],
        metavar="KEY=A:B:STEP|A,B",
        help="a range, or a list of values",
    )
    add("--zip", action="store_true", help="the first values of all --vary together, then the second, and so on")
    add("--csv", metavar="FILE", help="points of your own: keys in its first line, a point in each other")
    add(
        "--frames",
        type=words.frames,
        metavar="A-B",
        help="each of these frames: the waves moving, or a .blend's animation",
    )
    add("--fps", type=words.rate, metavar="FPS", help=f"frames a second ({FPS})")
    add(
        "--wavelengths",
        type=words.stack,
        metavar="A:B:STEP",
        help="each of these wavelengths, nm, as a picture of its own",
    )
    add("--split", type=words.whole("--split", 1, 4096), metavar="N", help="each picture in N parts of its samples")
    add("--scene", metavar="NAME", help="of a .blend with several scenes")
    add("--measure", metavar="NAME,...", help="columns of the table: mean, R, window, inner-radius and more")
    add("--film", metavar="FILE", help="the pictures as a film too (.mp4, .webm or .mkv), in DIR")
    add("--plan", action="store_true", help="write the plan, and render nothing")
    add(
        "--lines", type=words.frames, metavar="A-B", help="of a plan: render these tasks only, and put nothing together"
    )


def _add_act(add: Callable) -> None:
    add("--strict", action="store_true", help="refuse points that are none, instead of leaving them out")
    add("--yes", action="store_true", help=f"take more than {WITHOUT_ASKING} tasks")
    add("--mixed", action="store_true", help="allow Blenders of other versions than the plan is for")
    add("--on", default="local", metavar="WHERE", help="local, dask, dask=ADDRESS or slurm (local)")
    add(
        "--workers",
        type=words.whole("--workers", 1, 1024),
        metavar="N",
        help="Blenders side by side, here or by Dask (1)",
    )
    add("--jobs", type=words.whole("--jobs", 1, 100_000), metavar="N", help="jobs of the queue, with --on slurm (2)")
    add("--job-options", default=[], action="append", metavar="TEXT", help="passed on to the queue, such as --time=60")
    add("--interface", metavar="NAME", help="of the network that workers come from; by TLS (only this machine)")
    add("--export", choices=("slurm", "openjd"), help="write what a queue takes, and render nothing")
    add(
        "--chunk",
        type=words.whole("--chunk", 1, 10_000),
        metavar="N",
        help="tasks of an exported job (as the time suits)",
    )
    add("--status", metavar="DIR", help="say how far the sweep in a folder is")


def run(arguments: argparse.Namespace) -> int | None:
    """Carry out what was asked for; returns the exit code."""
    if arguments.status:
        if arguments.what or arguments.vary:
            raise UsageError("--status DIR says how far a sweep is; give it alone.")
        return _say_status(arguments)
    _check(arguments)
    with contextlib.ExitStack() as stack:
        return _run(arguments, _started_ahead(arguments, stack))


def _started_ahead(arguments, stack) -> Child | None:
    """A Blender that starts while the plan is made, where it is a module and is going to be needed; it ends with the stack."""
    if "bpy" in sys.modules or arguments.on not in HERE or arguments.plan or arguments.export:
        return None
    from ..sweeps.children import Child

    child = Child("")
    child.start()
    stack.callback(child.end, for_good=True)
    return child


def _run(arguments, first) -> int | None:
    blender.load()
    from ..figures.quantities import quantity
    from ..renders.asked import known
    from ..sweeps import film, plan
    from ..sweeps.state import alone

    with refused():
        measured = [quantity(name.strip()).name for name in (arguments.measure or "").split(",") if name.strip()]
    folder = _path(arguments.out)
    if arguments.what.endswith(".jsonl"):
        file = _path(arguments.what)
        if not file.is_file():
            raise UsageError(f"there is no plan {file}.")
        folder = file.parent
        with refused():
            tasks = plan.read(file)
    else:
        tasks = _tasks(arguments)
    if arguments.lines:
        return _carry_out_lines(tasks, arguments, folder, first)
    with refused():
        plan.check(tasks)
        if arguments.film is not None:
            film.check(arguments.film, known(tasks[0].request.size))
        tasks = list({task.key: task for task in (*tasks, *plan.probes(tasks, measured))}.values())
    with alone(folder) as folder:
        file = plan.write(folder, tasks)
        if arguments.export:
            from ..sweeps import export

            words = [f"--measure={','.join(measured)}"] * bool(measured) + [f"--film={arguments.film}"] * bool(
                arguments.film
            )
            with refused():
                files = export.write(
                    arguments.export,
                    folder,
                    tasks,
                    chunk=arguments.chunk,
                    options=arguments.job_options,
                    words=words,
                )
            return _said([file, *files], arguments)
        if arguments.plan:
            return _said([file], arguments)
        return _carry_out(tasks, arguments, folder, measured, first)


def _path(text):
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise UsageError(f"there is no such home as that of {text}; name another place.") from None


def _say_status(arguments) -> None:
    from ..sweeps import status

    try:
        said = status.of(_path(arguments.status)).record()
    except ValueError as error:
        raise UsageError(str(error)) from None
    if arguments.progress:
        print(json.dumps(said))
        return
    failed = f", {said['failed']} failed" if said["failed"] else ""
    left = f", {duration(said['left'])} left" if said["left"] is not None else ""
    print(f"{said['done']} of {said['total']} done{failed}{left}{'' if said['at_work'] else '; nobody is at work'}")
    for name, work in said["workers"].items():
        print(f"  {name}: {work['task']}")


def _check(arguments):
    what = arguments.what
    if not what:
        raise UsageError(f"name what to sweep: {words.A_SCENE}, a .blend, or a plan.jsonl.")
    place, _, address = arguments.on.partition("=")
    if place not in PLACES or (address and place != "dask"):
        raise UsageError(
            f"--on {arguments.on!r} is no place; the ones that exist are local, dask, dask=ADDRESS and slurm."
        )
    named = ADDRESS.fullmatch(address)
    if "=" in arguments.on and not (named and 0 < int(named[1]) < 1 << 16):
        raise UsageError(f"--on {arguments.on!r} names no scheduler; write it like dask=tls://host:8786.")
    _check_engine(arguments, place, address)
    if arguments.lines and not what.endswith(".jsonl"):
        raise UsageError("--lines is of a plan; give a plan.jsonl.")
    if what.endswith(".jsonl"):
        _check_plan(arguments)
    if not what.endswith((".jsonl", ".blend")) and arguments.scene:
        raise UsageError("--scene names one of a .blend.")


def _check_plan(arguments):
    """Refuse what is of a plan's making, where there is one."""
    given = [name for name in MAKING if getattr(arguments, name) is not None and getattr(arguments, name) != []]
    given += [name for name in ("zip", "strict") if getattr(arguments, name)]
    if given:
        option = given[0].replace("assignments", "set").replace("_", "-")
        raise UsageError(f"a plan has its own values; leave --{option} out, or edit it.")
    if arguments.out != OUT:
        raise UsageError("a plan lies in the folder of its sweep, which is written to; leave --out out, or move it.")


def _check_engine(arguments, place, address):
    """Refuse options of other engines than the one that was asked for."""
    if arguments.jobs and place != "slurm":
        raise UsageError("--jobs goes with --on slurm.")
    if arguments.workers and (place == "slurm" or address):
        raise UsageError("--workers is of this machine; a queue has --jobs, and a scheduler that stands has its own.")
    if arguments.interface is not None and (place == "local" or address):
        raise UsageError("--interface is of a scheduler that is started here; give it with --on dask or --on slurm.")
    if arguments.job_options and "slurm" not in (place, arguments.export):
        raise UsageError("--job-options goes with --on slurm or --export slurm.")
    if arguments.chunk and not arguments.export:
        raise UsageError("--chunk goes with --export.")


# ------------------------------------------------------------------------------------------------ the plan


def _tasks(arguments) -> list[Task]:
    """The tasks that the words ask for; what is no render is said, and left out."""
    from ..sweeps import axes, plan

    with refused():
        varied = [axes.axis(text) for text in arguments.vary]
        if arguments.wavelengths:
            varied.append(axes.Axis("wavelength", tuple(f"{nm:g}" for nm in arguments.wavelengths)))
        rows = [{}] if arguments.csv is None else axes.table(Path(arguments.csv))
        first, last = arguments.frames or (1, 1)
        count = len(rows) * axes.count(varied, together=arguments.zip) * (last - first + 1) * (arguments.split or 1)
    if count > axes.MOST or (count > WITHOUT_ASKING and not arguments.yes):
        more = f"more than {axes.MOST} are too many" if count > axes.MOST else "add --yes if that is meant"
        raise UsageError(f"the plan has {count} tasks; {more}.")
    base = _base(arguments)
    tasks, left_out = [], []
    with refused():
        points = [{**row, **point} for row in rows for point in axes.points(varied, together=arguments.zip)]
    for point in points:
        try:
            for task in _moments(plan.task_at(point, base), arguments):
                tasks += plan.split(task, arguments.split) if arguments.split else [task]
        except ValueError as error:
            left_out.append(f"{', '.join(f'{key} = {value}' for key, value in point.items()) or 'it'}: {error}")
    if left_out and (arguments.strict or not tasks):
        raise UsageError(left_out[0])
    for said in left_out[:NAMED] if not arguments.quiet else ():
        note(f"left out {said}")
    if len(left_out) > NAMED and not arguments.quiet:
        note(f"left out {len(left_out) - NAMED} more.")
    return tasks


def _base(arguments) -> Callable[[Mapping[str, str]], Request]:
    """The request for the values of a point of the scene's own parameters, or of a .blend's inputs."""
    from ..cycles.material import resolve
    from ..renders.request import Request
    from ..sweeps import plan

    if arguments.what.endswith(".blend"):
        if arguments.assignments:
            raise UsageError("a .blend has no parameters; vary its inputs, --vary 'MATERIAL:INPUT=A,B'.")
        with refused():
            whole = with_options(Request.of_blend(_path(arguments.what), arguments.scene), arguments)
            whole = dataclasses.replace(whole, blend=whole.decided().blend)  # with what it is linked from

        def of_blend(values: Mapping[str, str]) -> Request:
            try:
                inputs = {key: float(value) for key, value in values.items()}
            except ValueError:
                raise ValueError(f"{values} has what is no number.") from None
            return dataclasses.replace(whole, inputs=inputs or None)

        return of_blend

    def of_scene(values: Mapping[str, str]) -> Request:
        varied = plan.settings_of(arguments.what, values)
        settings = [*arguments.assignments, *(f"{key}={value}" for key, value in varied.items())]
        request = with_options(Request.of(arguments.what, settings), arguments)
        return dataclasses.replace(request, backend=resolve(request.backend))

    return of_scene


def _moments(task, arguments) -> Iterator[Task]:
    """The task at each of the frames that were asked for."""
    from ..sweeps.plan import Task

    if not arguments.frames:
        yield task
    elif task.request.blend:
        for frame in range(arguments.frames[0], arguments.frames[1] + 1):
            yield Task(dataclasses.replace(task.request, frame=frame), {**task.values, "frame": str(frame)})
    else:
        for frame, moment in task.request.sequence(*arguments.frames, arguments.fps or FPS).items():
            yield Task(moment, {**task.values, "frame": str(frame)})


# ------------------------------------------------------------------------------------------------ the act


def _engine(arguments, first) -> Engine:
    import bpy

    from ..sweeps import local

    place, _, address = arguments.on.partition("=")
    if place == "local":
        return functools.partial(
            local.carry_out,
            binary=bpy.app.binary_path,
            workers=arguments.workers or 1,
            mixed=arguments.mixed,
            first=first,
        )
    from ..sweeps import cluster

    return cluster.engine(
        place,
        address,
        workers=arguments.workers or 2,
        jobs=arguments.jobs or 2,
        options=arguments.job_options,
        interface=arguments.interface,
        mixed=arguments.mixed,
        binary=bpy.app.binary_path,
        first=first,
    )


def _local(arguments):
    import bpy

    from ..sweeps import local

    return functools.partial(local.carry_out, binary=bpy.app.binary_path, mixed=arguments.mixed)


def _carry_out(tasks, arguments, folder, measured, first) -> int | None:
    from ..sweeps import run as act
    from ..sweeps.state import State

    state = State(folder, 0)
    with Board(state, quiet=arguments.quiet, progress=arguments.progress) as board:
        problems = act.carry_out(tasks, folder, _engine(arguments, first), state, _local(arguments), board.ended)
        files, other = act.collect(tasks, folder, measured, film=arguments.film, fps=arguments.fps or FPS)
        board.end(files)
    return _verdict(problems, other if not arguments.mixed else [])


def _carry_out_lines(tasks, arguments, folder, spare) -> int | None:
    """Render some of the tasks of a plan for whoever has parted it."""
    from ..sweeps import run as act
    from ..sweeps.state import State

    first, last = arguments.lines
    if last > len(tasks):
        raise UsageError(f"--lines {first}-{last}: the plan has {len(tasks)}.")
    state = State(folder, 0, kept=False)
    with Board(state, quiet=arguments.quiet, progress=arguments.progress) as board:
        problems = act.render(tasks[first - 1 : last], folder, _engine(arguments, spare), state, board.ended)
    return _verdict(problems, [])


def _verdict(problems, versions) -> int | None:
    for problem in problems[:NAMED]:
        note(f"{problem.task.title}: {problem.problem}")
    if len(problems) > NAMED:
        note(f"{len(problems) - NAMED} more could not be rendered.")
    if len(versions) > 1:
        raise Failure(
            f"the pictures are of {' and of '.join(versions)}; render all with one, or allow others with --mixed."
        )
    return FAILURE if problems else None


def _said(files: Sequence[Path], arguments) -> None:
    if not arguments.quiet:
        for file in files:
            print(os.fspath(file))

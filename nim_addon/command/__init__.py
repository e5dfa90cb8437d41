# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: `nimray ...`, `python -m nim_addon ...` and `blender --command nimray ...`, a module a subcommand.

Each module of COMMANDS has add_to(commands), which adds its parser to those of argparse, and names there the function
that runs it: it takes the parsed arguments and returns an exit code, None for 0. A new subcommand is one such module and
one entry of the list. The parsers are made without Blender, so that help and refusals come at once; a module imports bpy,
and what needs it, only as it runs.
"""

from __future__ import annotations

import signal
import traceback
from collections.abc import Callable, Sequence

from ..base import signals, streams
from ..base.version import VERSION
from ..physics import MEDIA
from . import compare, doctor, figures, fresnel, info, rays, render, scenes, sweep, verify
from .report import FAILURE, USAGE, Failure, complain, sentence
from .words import Parser, UsageError

COMMANDS = (render, compare, sweep, figures, rays, scenes, fresnel, verify, doctor, info)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with `argv` (words, default those of the process); returns the exit code."""

    def run():
        arguments = parser().parse_args(argv)
        return arguments.run(arguments)

    return answer(run)


def answer(run: Callable[[], int | None]) -> int:
    """Call what a process is for, and say on standard error why it could not be done; returns the exit code."""
    try:
        return run() or 0
    except UsageError as error:
        return complain(error, USAGE)
    except (Failure, OSError, RuntimeError) as error:
        return complain(sentence(error), FAILURE)
    except MemoryError:
        return complain("there is not enough memory for this; ask for less, such as a smaller --size.", FAILURE)
    except KeyboardInterrupt:  # where signals.watch() has not been called
        return complain("stopped.", 128 + signal.SIGINT)


def script(run: Callable[[], int] = main) -> None:
    """What __main__ runs: main(), then an exit without Blender's noise about memory that it still holds."""
    try:
        code = run()
    except SystemExit as stop:  # of --help and --version
        code = int(stop.code or 0)
    except Exception:  # a mistake of ours: Blender as a module may hang where Python ends by itself
        traceback.print_exc()
        code = FAILURE
    if lost := streams.close():
        code = complain(lost, code or FAILURE)
    signals.leave(code)


def parser() -> Parser:
    """The parser of the whole command; its `commands` are those of the subcommands."""
    whole = Parser(
        prog="nimray",
        description="Negative-index materials, rendered with Cycles by the physics.",
        epilog="Media are written by name or number: glass, -1.33, n=-1.33,mu=-10. Names: " + ", ".join(MEDIA) + ".",
    )
    whole.add_argument("--version", action="version", version=f"nimray {VERSION}")
    commands = whole.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=Parser)
    for module in COMMANDS:
        module.add_to(commands)
    whole.commands = commands.choices
    return whole

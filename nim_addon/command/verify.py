# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray verify`: whether this Blender obeys the equations, measured."""

from __future__ import annotations

import argparse
import sys

from ..base import records
from ..base.options import BACKEND_NAMES
from . import blender
from .report import FAILURE, at_terminal
from .words import add_backend, add_json, add_parser


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    summary = "Measure with Cycles whether this Blender obeys the equations (about 30 s)."
    parser = add_parser(commands, "verify", run, summary)
    add_backend(parser)
    add_json(parser)
    parser.add_argument("--quiet", action="store_true", help="print the verdict only")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print what came out; returns the exit code, FAILURE where an equation does not hold."""
    blender.load()
    from ..cycles import verify

    checks = verify.verify(_show if at_terminal(arguments) else None, arguments.backend)
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
        print(f"{verdict} {len(checks)} checks, Blender {answer['blender']}, {BACKEND_NAMES[answer['backend']]}")
    return 0 if answer["passed"] else FAILURE


def _show(done: int, total: int) -> None:
    print(f"\rmeasuring {done}/{total}", end="\n" if done == total else "", file=sys.stderr, flush=True)

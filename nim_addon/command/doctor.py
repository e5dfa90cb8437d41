# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray doctor`: what this installation has, and what it lacks."""

from __future__ import annotations

import argparse

from ..base import records
from ..base.options import BACKEND_NAMES
from ..base.version import VERSION
from . import blender
from .report import FAILURE, Failure
from .words import add_json, add_parser


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    add_json(
        add_parser(commands, "doctor", run, "Say what this installation has, what is missing, and how to mend it.")
    )


def run(arguments: argparse.Namespace) -> int:
    """Print what there is; returns the exit code, FAILURE where something is missing."""
    facts, problems = examine()
    if arguments.json:
        print(records.text({**facts, "problems": problems}))
    else:
        for key, value in facts.items():
            print(f"{key:<12} {value if not isinstance(value, list) else ', '.join(value)}")
        print("\n".join(f"problem: {problem}" for problem in problems) or "Everything that is needed is here.")
    return FAILURE if problems else 0


def examine() -> tuple[dict[str, object], list[str]]:
    """What there is, JSON-ready by its name, and what is missing, in sentences that say how to mend it."""
    import platform

    import numpy

    facts: dict[str, object] = {"nimray": VERSION, "python": platform.python_version(), "numpy": numpy.__version__}
    problems = []
    try:
        bpy = blender.load()
        from ..cycles.material import osl_available, resolve
        from ..renders.request import can_denoise

        facts["blender"] = bpy.app.version_string
        facts["osl"] = osl_available()
        facts["materials"] = BACKEND_NAMES[resolve("auto")]
        facts["denoiser"] = can_denoise()
        facts["devices"] = blender.devices()
    except Failure as error:
        problems.append(str(error))
    try:
        import OpenImageIO

        facts["openimageio"] = OpenImageIO.VERSION_STRING
    except ImportError as error:
        problems.append(f"OpenImageIO is missing ({error}), so no image can be written; run: pip install OpenImageIO")
    return facts, problems

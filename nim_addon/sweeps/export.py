# SPDX-License-Identifier: GPL-3.0-or-later
"""A plan as what queues take: a job array of SLURM, or a template of Open Job Description, each over the plan's lines."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..base.files import whole
from ..base.shipped import PACKAGE
from . import PLAN
from .plan import Task

CHUNK = 8  # tasks of a job, where nobody says


def command() -> list[str]:
    """The words that run `nimray` as it runs here."""
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "--background", "--command", "nimray"]
    return [sys.executable, "-m", PACKAGE]


def found() -> dict[str, str]:
    """The variables by which a job finds this package where this process did: none where it is installed."""
    paths = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    found = os.pathsep.join(os.path.abspath(path) for path in paths if path)
    return {"PYTHONPATH": found} if found else {}


def prologue() -> list[str]:
    """The lines of a shell that set found()."""
    return [f"export {name}={shlex.quote(value)}${{{name}:+:${name}}}" for name, value in found().items()]


def write(
    kind: str,
    folder: Path,
    tasks: Sequence[Task],
    *,
    chunk: int | None = None,
    options: Sequence[str] = (),
    words: Sequence[str] = (),
) -> list[Path]:
    """Write what a queue takes to the folder of a plan; returns the files.

    kind:    "slurm" or "openjd"
    chunk:   tasks of a job
    options: of SLURM, such as --time=60
    words:   of the step that puts all together, such as --film and its file
    Raises ValueError, one sentence, for a folder that SLURM cannot be told of.
    """
    chunk = chunk or min(CHUNK, len(tasks))
    if kind == "slurm":
        return _slurm(folder.resolve(), len(tasks), chunk, options, words)
    return [_openjd(folder.resolve(), len(tasks), chunk, words)]


def _slurm(folder, count, chunk, options, words):
    nimray = "\n".join([*prologue(), shlex.join(command())])
    plan = shlex.quote(str(folder / PLAN))
    more = "".join(f"#SBATCH {option}\n" for option in options)
    last = -(-count // chunk) - 1
    array = (
        f"#!/bin/bash\n#SBATCH --job-name=nimray\n#SBATCH --array=0-{last}\n#SBATCH --requeue\n#SBATCH --open-mode=append\n"
        f"#SBATCH --output={_log(folder, 'slurm-%a.log')}\n{more}"
        f"first=$((SLURM_ARRAY_TASK_ID * {chunk} + 1))\n"
        f"last=$((first + {chunk - 1} < {count} ? first + {chunk - 1} : {count}))\n"
        f"{nimray} sweep {plan} --lines $first-$last --quiet\n"
    )
    collect = (
        f"#!/bin/bash\n#SBATCH --job-name=nimray-collect\n#SBATCH --output={_log(folder, 'slurm-collect.log')}\n{more}"
        f"{nimray} sweep {plan} {shlex.join(words)}\n"
    )
    submit = (
        "#!/bin/bash\nset -e\n"
        f"job=$(sbatch --parsable {shlex.quote(str(folder / 'slurm-array.sh'))})\n"
        f"sbatch --parsable --dependency=afterany:$job {shlex.quote(str(folder / 'slurm-collect.sh'))}\n"
    )
    files = {"slurm-array.sh": array, "slurm-collect.sh": collect, "slurm-submit.sh": submit}
    return [_text(folder / name, text) for name, text in files.items()]


def _log(folder, name):
    """A file in the folder as #SBATCH takes it."""
    if "\n" in str(folder):
        raise ValueError(f"SLURM takes no folder with a line break in its name, as {str(folder)!r}; name another.")
    return shlex.quote(f"{str(folder).replace('%', '%%')}/{name}")


def _openjd(folder, count, chunk, words):
    run, *first = command()
    sweep = [*first, "sweep", "{{Param.Folder}}/" + PLAN]
    environments = [{"name": "Package", "variables": found()}] if found() else []
    step = {
        "name": "Render",
        "stepEnvironments": environments,
        "parameterSpace": {
            "taskParameterDefinitions": [
                {
                    "name": "Lines",
                    "type": "CHUNK[INT]",
                    "range": f"1-{count}",
                    "chunks": {"defaultTaskCount": chunk, "rangeConstraint": "CONTIGUOUS"},
                }
            ]
        },
        "script": {
            "actions": {"onRun": {"command": run, "args": [*sweep, "--lines", "{{Task.Param.Lines}}", "--quiet"]}}
        },
    }
    collect = {
        "name": "Collect",
        "stepEnvironments": environments,
        "dependencies": [{"dependsOn": "Render"}],
        "script": {"actions": {"onRun": {"command": run, "args": [*sweep, *words]}}},
    }
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": "nimray sweep",
        "parameterDefinitions": [
            {"name": "Folder", "type": "PATH", "objectType": "DIRECTORY", "dataFlow": "INOUT", "default": "."}
        ],
        "steps": [step, collect],
    }
    return _text(folder / "openjd.json", json.dumps(template, indent=2) + "\n")


def _text(file, text):
    return whole(file, lambda part: part.write_text(text, encoding="utf-8"))

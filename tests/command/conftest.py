# SPDX-License-Identifier: GPL-3.0-or-later
"""The command, run as a person runs it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def nimray():
    """nimray(*words) -> the process that ran the command to its end, with all that it said."""

    def run(*words, where=None, instead=None, temporary=None):
        """`instead`: a folder of modules that stand in for installed ones; `temporary`: the system's for such files."""
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, filter(None, (instead, ROOT))))}
        if temporary:
            environment["TMPDIR"] = str(temporary)
        return subprocess.run(
            [sys.executable, "-m", "nim_addon", *map(str, words)],
            capture_output=True,
            text=True,
            cwd=where,
            env=environment,
            timeout=120,
        )

    return run

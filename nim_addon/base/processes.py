# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender without a window, beside the one that a person works in."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import IO

from .shipped import PACKAGE

# where Blender looks for extensions with its factory settings, too
REPOSITORIES = ("blender_org", "user_default", "system")


def second_blender(
    module: str,
    words: Sequence[str] = (),
    *,
    binary: str,
    stdout: int | IO,
    environment: Mapping[str, str] | None = None,
) -> subprocess.Popen[str]:
    """Start a Blender that runs a module of this package, such as "command.job", and ends with this process.

    It has this add-on enabled, by the name that it has here, and no other settings of a person's.

    words:       what the module finds in sys.argv[1:]
    binary:      bpy.app.binary_path; empty where Blender is a module of this Python
    stdout:      as subprocess.Popen takes it; of what it says on standard error, too
    environment: variables beside those of this process
    Its standard input is a pipe, which the module may read; the end of it ends the process. Raises OSError where it cannot
    be started.
    """
    code = f"from {PACKAGE}.base import second; second.main()"
    extension, _, rest = PACKAGE.partition(".")
    if binary:
        ours = rest.partition(".")[0] not in REPOSITORIES and extension == "bl_ext"
        start = [binary, "--background", *([] if ours else ["--factory-startup"]), "--python-exit-code", "1"]
        start += ["--addons", PACKAGE, "--python-expr", code]
    else:
        # the name of an extension is one that Blender gives
        start = [sys.executable, "-c", f"import bpy; {code}" if extension == "bl_ext" else code]
    return subprocess.Popen(
        [*start, "--", module, *words],
        stdin=subprocess.PIPE,
        stdout=stdout,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        # os.environ is without what Blender itself has set, of which 5.2 would have its child speak
        env={**os.environ, **(environment or {})},
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )


def end(process: subprocess.Popen[str], patience: float) -> None:
    """Let a second Blender end by itself, and kill it after so many seconds; returns when it has ended."""
    assert process.stdin
    with contextlib.suppress(OSError):  # it was killed before it had read all
        process.stdin.close()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender without a window, beside the one that a person works in."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

PACKAGE = Path(__file__).resolve().parents[1]
# What the second process runs: a module of this package, until its standard input ends, as it does when the first
# process ends or is killed. An interrupt then lets the module clear away what it has begun. What comes in before, the module
# reads as its own standard input.
CODE = """
import os, runpy, signal, sys, threading, time
inner, outer = os.pipe()
sys.stdin = open(inner, encoding="utf-8")
def end_with_parent():
    while said := os.read(0, 65536):
        os.write(outer, said)
    signal.raise_signal(signal.SIGINT)
    time.sleep(3)
    os._exit(130)
threading.Thread(target=end_with_parent, daemon=True).start()
sys.path.insert(0, {folder!r})
sys.argv = ["nimray", *sys.argv[sys.argv.index("--") + 1:]]
runpy.run_module({module!r}, run_name="__main__")
"""


def second_blender(
    module: str,
    words: Sequence[str] = (),
    *,
    binary: str,
    stdout: int | IO,
    environment: Mapping[str, str] | None = None,
) -> subprocess.Popen[str]:
    """Start a Blender that runs a module of this package, such as "command.job", and ends with this process.

    words:       what the module finds in sys.argv[1:]
    binary:      bpy.app.binary_path; empty where Blender is a module of this Python
    stdout:      as subprocess.Popen takes it; of what it says on standard error, too
    environment: variables beside those of this process
    Its standard input is a pipe, which the module may read; the end of it ends the process. Raises OSError where it cannot
    be started.
    """
    code = CODE.format(folder=str(PACKAGE.parent), module=f"{PACKAGE.name}.{module}")
    if binary:
        start = [binary, "--background", "--factory-startup", "--python-exit-code", "1", "--python-expr", code]
    else:
        start = [sys.executable, "-c", code]
    return subprocess.Popen(
        [*start, "--", *words],
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
    process.stdin.close()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

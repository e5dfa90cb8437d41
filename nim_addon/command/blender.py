# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a module: loaded once it is needed, refused where it cannot render a NIM, and what its Cycles has."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from types import ModuleType

from ..base import libraries, signals
from ..base.files import temporary
from .report import Failure

OLDEST_BLENDER = (4, 2, 0)  # the Ray Portal closure, which bends a ray backwards, came with it

_kept = contextlib.ExitStack()  # what lasts as long as the process


def load() -> ModuleType:
    """bpy, of a version that can render a NIM; Failure says what to do about it otherwise."""
    try:
        with _own_temporary_folder(), signals.importing_blender():
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


@contextlib.contextmanager
def _own_temporary_folder() -> Iterator[None]:
    """Let Blender make its folder for temporary files in one of ours, which goes however early the process ends.

    After kill -9 the next run takes it away.
    """
    if "bpy" in sys.modules or not signals.watched():
        yield
        return
    former = os.environ.get("TMPDIR")
    with contextlib.suppress(OSError):
        os.environ["TMPDIR"] = str(_kept.enter_context(temporary()))
    try:
        yield
    finally:
        os.environ.pop("TMPDIR", None)
        if former is not None:
            os.environ["TMPDIR"] = former


def devices() -> list[str]:
    """The names of the processors that Cycles finds."""
    import _cycles  # pyright: ignore[reportMissingImports]

    return [device[0] for device in _cycles.available_devices("CPU")]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a module: loaded once it is needed, refused where it cannot render a NIM, and what its Cycles has."""

from __future__ import annotations

from types import ModuleType

from ..base import libraries, signals
from .report import Failure

OLDEST_BLENDER = (4, 2, 0)  # the Ray Portal closure, which bends a ray backwards, came with it


def load() -> ModuleType:
    """bpy, of a version that can render a NIM; Failure says what to do about it otherwise."""
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


def can_denoise() -> bool:
    """Whether this Blender has OpenImageDenoise."""
    import _cycles

    return _cycles.with_openimagedenoise


def devices() -> list[str]:
    """The names of the processors that Cycles finds."""
    import _cycles

    return [device[0] for device in _cycles.available_devices("CPU")]

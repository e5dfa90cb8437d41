# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a built scene by name, so that a request for one can be written down, and a mark of the code that decides."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable

import bpy

from ..base.shipped import FOLDER
from ..cycles.closures import CLOSURES

DECIDING = ("physics", "cycles", "caustics", "scenes", "renders")  # the rooms whose code decides what is in a picture
CHANGING = "figures"  # and the one whose changes do

Change = Callable[[bpy.types.Scene], None]

_changes: dict[str, Change] = {}


def register(change: Change) -> str:
    """Let a function of a module, which changes a built bpy.types.Scene, be known by its name; returns name_of() it."""
    _changes[name_of(change)] = change
    return name_of(change)


def name_of(change: Change) -> str:
    """The name of a change: its module's, and its own."""
    return f"{change.__module__.rpartition('.')[2]}.{change.__qualname__}"


def change_of(name: str) -> Change:
    """The change of that name; ValueError, one sentence, where none is known."""
    if name not in _changes:
        raise ValueError(f"there is no change of a scene {name!r} here.")
    return _changes[name]


@functools.cache  # the code that runs is the one that was there first
def code_mark(*, changed: bool) -> str:
    """A mark of the code that decides a picture, also of a scene that is `changed`: what other code made is another."""
    rooms = [*DECIDING, *([CHANGING] if changed else [])]
    text = [file.read_bytes() for room in rooms for file in sorted((FOLDER / room).rglob("*.py"))]
    return hashlib.sha256(b"".join([*text, *(closure.source().encode() for closure in CLOSURES)])).hexdigest()[:16]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of nodes that were filled before, as .blend files: one that is shipped, and the bytes of those made in this Blender.

Blender goes through a whole tree for each node and each link that comes into it, so that the interface's 340 nodes take a
third of a second or more; to read them takes some milliseconds. A group is stored under a name that says what it was made
of, and so never read where that has changed.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping

import bpy

from ...base.files import temporary
from ...base.shipped import ASSETS
from ...base.streams import quiet

SHIPPED = ASSETS / "closures.blend"
_kept: dict[str, bytes] = {}
_NAME = "group.blend"


def write(file: os.PathLike[str], groups: Mapping[str, bpy.types.NodeTree]) -> None:
    """Write groups to a .blend under these names, at most 63 characters; here they keep theirs. OSError, RuntimeError."""
    names = {group: group.name for group in groups.values()}
    try:
        for name, group in groups.items():
            group.name = name
        bpy.data.libraries.write(os.fspath(file), set(names), fake_user=True, compress=True)
    finally:
        for group, name in names.items():
            group.name = name


def keep(made_of: str, group: bpy.types.NodeTree) -> None:
    """Keep a group for load(); where it cannot be written, nothing is kept."""
    with contextlib.suppress(OSError, RuntimeError), quiet(), temporary() as folder:
        write(folder / _NAME, {made_of: group})
        _kept[made_of] = (folder / _NAME).read_bytes()


def load(made_of: str, name: str) -> bpy.types.NodeTree | None:
    """A new group of that name, which is what was stored as made of this; None where there is none, or it cannot be read."""
    with contextlib.suppress(OSError, RuntimeError), quiet():
        if made_of not in _kept:
            return _read(SHIPPED, made_of, name) if SHIPPED.is_file() else None
        with temporary() as folder:
            (folder / _NAME).write_bytes(_kept[made_of])
            return _read(folder / _NAME, made_of, name)
    return None


def _read(file, made_of, name):
    libraries = set(bpy.data.libraries)
    with bpy.data.libraries.load(str(file)) as (there, wanted):
        wanted.node_groups = [made_of] if made_of in there.node_groups else []
    for library in set(bpy.data.libraries) - libraries:
        bpy.data.libraries.remove(library)
    if not wanted.node_groups or wanted.node_groups[0] is None:
        return None
    (read,) = wanted.node_groups
    group = read.copy()  # which does not remember the file that it was read from
    bpy.data.node_groups.remove(read)
    group.name, group.use_fake_user = name, False
    return group

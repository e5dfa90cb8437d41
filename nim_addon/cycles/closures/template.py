# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of nodes that were filled before in this Blender, kept as the bytes of a .blend.

Blender goes through a whole tree for each node and each link that comes into it, so that the interface's 340 nodes take a
second; to read them takes some milliseconds.
"""

from __future__ import annotations

import contextlib
from collections.abc import Hashable

import bpy

from ...base.files import temporary
from ...base.streams import quiet

_kept: dict[Hashable, bytes] = {}
_NAME = "group.blend"


def keep(key: Hashable, group: bpy.types.NodeTree) -> None:
    """Keep a group for load() of the same key; where it cannot be written, nothing is kept."""
    with contextlib.suppress(OSError, RuntimeError), quiet(), temporary() as folder:
        bpy.data.libraries.write(str(folder / _NAME), {group}, fake_user=True)
        _kept[key] = (folder / _NAME).read_bytes()


def load(key: Hashable) -> bpy.types.NodeTree | None:
    """A new group that is what keep() was given with that key; None where it is not to be had."""
    if key not in _kept:
        return None
    libraries = set(bpy.data.libraries)
    with contextlib.suppress(OSError, RuntimeError), quiet(), temporary() as folder:
        (folder / _NAME).write_bytes(_kept[key])
        with bpy.data.libraries.load(str(folder / _NAME)) as (there, wanted):
            wanted.node_groups = there.node_groups[:1]
        (read,) = wanted.node_groups
        for library in set(bpy.data.libraries) - libraries:
            bpy.data.libraries.remove(library)
        if read is not None:
            name, group = read.name, read.copy()  # which does not remember the folder that it was read from
            bpy.data.node_groups.remove(read)
            group.name, group.use_fake_user = name, False
            return group
    return None

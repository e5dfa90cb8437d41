# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene needs of the data in Blender's file."""

from __future__ import annotations

from typing import Any

import bpy


def used_by(scene: bpy.types.Scene) -> set[bpy.types.ID]:
    """All that a scene needs, by way of whatever: objects, what a collection puts in, materials, images."""
    users = bpy.data.user_map()
    uses: dict[Any, list] = {}
    for used, those in users.items():
        for user in those:
            uses.setdefault(user, []).append(used)
    seen: set[bpy.types.ID] = {scene}
    queue: list[bpy.types.ID] = [scene]
    while queue:
        data = queue.pop()
        for used in uses.get(data, ()):
            if used not in seen and not isinstance(used, bpy.types.Scene):
                seen.add(used)
                queue.append(used)
    return seen

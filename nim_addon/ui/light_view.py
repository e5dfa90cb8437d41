# SPDX-License-Identifier: GPL-3.0-or-later
"""From where light paths are seen: whether a view looks along them, and what turns it to their side."""

from __future__ import annotations

import math
from types import SimpleNamespace

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface
from mathutils import Quaternion, Vector

from . import live_look, viewport
from .help import fail
from .live_lines import Lie

TEXT = "This view looks along the rays: press View Rays from the Side to see them bend"
ALONG = math.sin(math.radians(10))  # of the angle to a plane, or to a line, below which a view looks along it
MARGIN = 1.15  # of what a view shows beside the rays
SENSOR = 72.0  # mm: what a lens of a 3D view has behind it, twice a camera's


def looks_along(lie: Lie, region_3d: bpy.types.RegionView3D) -> bool:
    """Whether a view looks along rays that lie so: where they should be seen to bend there is a line, or a point."""
    eye = region_3d.view_matrix.inverted()
    if region_3d.is_perspective:
        towards = Vector(lie.middle) - eye.translation
        if not towards.length:
            return False
        towards.normalize()
    else:
        towards = eye.to_3x3() @ Vector((0, 0, -1))
    if lie.normal is not None:
        return abs(towards.dot(Vector(lie.normal))) < ALONG
    return towards.cross(Vector(lie.axis)).length < ALONG


def turn(
    lie: Lie, region_3d: bpy.types.RegionView3D, size: tuple[int, int], free: tuple[float, float], lens: float
) -> None:
    """Turn a view to the side of rays that lie so, the nearer one, upright, and let it show all of them.

    size: of its region, pixels; free: between which x nothing lies over it; lens: of the view, mm
    """
    back = region_3d.view_matrix.inverted().to_3x3() @ Vector((0, 0, 1))
    if lie.normal is not None:
        side = Vector(lie.normal)
    else:  # anywhere about the axis: as near as can be
        axis = Vector(lie.axis)
        side = back - back.dot(axis) * axis
        if side.length < ALONG:
            side = axis.cross(Vector((0, 0, 1)))
        if side.length < ALONG:
            side = Vector((0, -1, 0))
    side = side.normalized() * (1 if side.dot(back) >= 0 else -1)
    if abs(side.z) > 0.999:  # from above, or below
        rotation = Quaternion() if side.z > 0 else Quaternion((1, 0, 0), math.pi)
    else:
        rotation = side.to_track_quat("Z", "Y")
    seen = (lie.points - lie.middle) @ np.array(rotation.to_matrix())
    pixel = SENSOR / lens / max(size)  # of what is as far away as 1
    distance = MARGIN * max(np.ptp(seen[:, :2], axis=0) / (max(free[1] - free[0], 1), max(size[1], 1))) / pixel
    # half of the depth, which perspective brings nearer
    distance = max(distance + np.ptp(seen[:, 2]) / 2, 1e-3)
    aside = ((free[0] + free[1]) / 2 - size[0] / 2) * pixel * distance
    if region_3d.view_perspective == "CAMERA":
        region_3d.view_perspective = "PERSP"
    region_3d.view_rotation, region_3d.view_distance = rotation, distance
    region_3d.view_location = Vector(lie.middle) - rotation @ Vector((aside, 0, 0))


def sentence(context: bpy.types.Context) -> str | None:
    """What is to be said in a view of how it looks at the live rays, translated; None where it sees them from aside."""
    last = live_look.LOOKS.last(context.scene)
    if last is None or last.lie is None or context.space_data.region_quadviews:  # of four one looks so always
        return None
    return pgettext_iface(TEXT) if looks_along(last.lie, context.region_data) else None


class NIM_OT_light_paths_view(bpy.types.Operator):
    """Turn this view to the side of the light paths, from where they are seen to bend"""

    bl_idname = "nim.light_paths_view"
    bl_label = "View Light Paths from the Side"
    bl_options = {"REGISTER"}  # a view alone has no undo

    @classmethod
    def poll(cls, context):
        """Only in a 3D view."""
        if context.space_data is None or context.space_data.type != "VIEW_3D":
            cls.poll_message_set("Only a 3D view can be turned")
            return False
        return True

    def execute(self, context):
        """Turn it: to the live rays, or to those that the settings make."""
        look = live_look.LOOKS.known(context.scene) if live_look.on else None
        look = look or live_look.Look(context.scene)
        if not live_look.on:
            live_look.forget()
        if look.lie is None:
            return fail(self, look.sentence)
        region = next(part for part in context.area.regions if part.type == "WINDOW")
        free = viewport.room(SimpleNamespace(region=region, area=context.area, preferences=context.preferences))
        size, space = (region.width, region.height), context.space_data
        turn(look.lie, space.region_3d, size, free, space.lens)
        return {"FINISHED"}


CLASSES = (NIM_OT_light_paths_view,)

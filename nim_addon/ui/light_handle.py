# SPDX-License-Identifier: GPL-3.0-or-later
"""The handle of light paths: an object that they start from, and what it is moved and turned by in a view."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt
from mathutils import Matrix, Vector

from ..cycles.visibility import as_rendered
from . import light_live, light_sources
from .light_tracing import surfaces_of

NAME = "Light Source"
# Of the turns about its own axes: their colours as Blender's own.
TURNS = ((0, (1.0, 0.2, 0.32)), (1, (0.55, 0.86, 0.0)))


class NIM_OT_light_handle(bpy.types.Operator):
    """Let the rays start from an object that you can move and turn: it is added where they start now, or selected"""

    bl_idname = "nim.light_handle"
    bl_label = "Add Handle for Light Paths"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only where objects can be added."""
        if context.mode != "OBJECT":
            cls.poll_message_set("A handle is added in Object Mode only")
            return False
        return True

    def execute(self, context):
        """Add it, or select the one that there is."""
        scene = context.scene
        handle = light_sources.handle_of(scene)
        if handle is None:
            handle = bpy.data.objects.new(NAME, None)
            handle.empty_display_type = "SINGLE_ARROW"
            handle.matrix_world, handle.empty_display_size = _where_rays_start(context)
            scene.collection.objects.link(handle)
            scene.nim_rays.handle = handle
            self.report({"INFO"}, pgettext_rpt("Rays start from the handle now; move it (G) or turn it (R)"))
        scene.nim_rays.source = "HANDLE"
        for other in context.selected_objects:
            other.select_set(False)
        if handle.visible_get():
            handle.select_set(True)
            context.view_layer.objects.active = handle
        return {"FINISHED"}


def _where_rays_start(context):
    """The matrix (4, 4) of the middle of the rays as they start now, and a size; of the 3D cursor where none do."""
    scene = context.scene
    settings = light_live.settings_of(scene)
    settings.rays = 3
    if settings.source == "HANDLE":
        settings.source = "SIDE"
    try:
        with as_rendered(scene) as depsgraph:
            surfaces = surfaces_of(scene, depsgraph)
            origins, directions = next(iter(light_sources.starts(context, settings, surfaces, depsgraph).values()))
            size = surfaces.size
    except ValueError:
        return scene.cursor.matrix, 1.0
    place, axis = origins.mean(axis=0), directions.mean(axis=0)
    if not np.linalg.norm(axis) > 1e-6:  # all around
        axis = directions[0]
    axis = axis / np.linalg.norm(axis)
    up = light_sources.across(axis, 0.0)
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = np.stack([up, np.cross(axis, up), axis], axis=1), place
    return Matrix(frame.tolist()), 0.15 * size


# ---------------------------------------------------------------- gizmos


class NIM_GGT_light_handle(bpy.types.GizmoGroup):
    """Move and turn the handle of live light paths, whatever is selected"""

    bl_idname = "NIM_GGT_light_handle"
    bl_label = "Light Paths Handle"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"3D", "SHOW_MODAL_ALL"}

    @classmethod
    def poll(cls, context):
        """Only while the rays start there."""
        return _handle(context) is not None

    def setup(self, context):
        """Make a gizmo to move it by, and one for each axis to turn it about."""
        self.start, self.turns = Matrix(), []
        move = self.gizmos.new("GIZMO_GT_move_3d")
        move.draw_options, move.scale_basis, move.use_draw_modal = {"ALIGN_VIEW"}, 0.12, True
        move.color, move.color_highlight = (1.0, 0.85, 0.3), (1.0, 1.0, 0.7)
        move.alpha, move.alpha_highlight = 0.7, 1.0
        move.target_set_handler("offset", get=lambda: (0.0, 0.0, 0.0), set=self._move)
        self.move = move
        for axis, color in TURNS:
            dial = self.gizmos.new("GIZMO_GT_dial_3d")
            dial.scale_basis, dial.use_draw_modal, dial.line_width = 0.6, True, 2.0
            dial.draw_options = {"CLIP"}
            dial.color, dial.color_highlight = color, tuple(0.5 + value / 2 for value in color)
            dial.alpha, dial.alpha_highlight = 0.6, 1.0
            dial.target_set_handler("offset", get=lambda: 0.0, set=lambda angle, axis=axis: self._turn(axis, angle))
            self.turns.append((axis, dial))

    def invoke_prepare(self, context, gizmo):
        """Remember where it was."""
        handle = _handle(context)
        self.start = handle.matrix_world.copy() if handle else Matrix()

    def draw_prepare(self, context):
        """Put the gizmos where the object is."""
        handle = _handle(context)
        if handle is None:
            return
        place, turn, _ = handle.matrix_world.decompose()
        self.move.matrix_basis = Matrix.Translation(place)
        for axis, dial in self.turns:
            along = turn @ Vector([float(axis == i) for i in range(3)])
            dial.matrix_basis = Matrix.Translation(place) @ along.to_track_quat("Z", "Y").to_matrix().to_4x4()

    def _move(self, offset):
        self._put(Matrix.Translation(offset) @ self.start)

    def _turn(self, axis, angle):
        # about its own axis, where it stands
        place, about = self.start.translation, self.start.col[axis].xyz.normalized()
        turn = Matrix.Translation(place) @ Matrix.Rotation(-angle, 4, about) @ Matrix.Translation(-place)
        self._put(turn @ self.start)

    def _put(self, matrix):
        handle = _handle(bpy.context)
        if handle is not None:
            handle.matrix_world = matrix


def _handle(context):
    """The handle, while rays start from it and are live, and it is seen."""
    settings = context.scene.nim_rays
    handle = light_sources.handle_of(context.scene) if settings.source == "HANDLE" and light_live.is_on() else None
    return handle if handle and handle.visible_get(view_layer=context.view_layer) else None


class NIM_GT_ray_reading(bpy.types.Gizmo):
    """Follows the mouse, and is never hit by it: what is to be read there is drawn by live_views"""

    bl_idname = "NIM_GT_ray_reading"

    def draw(self, context):
        """Nothing."""

    def test_select(self, context, location):
        """Note where the mouse is."""
        light_live.point(context, tuple(location))
        return -1


class NIM_GGT_ray_reading(bpy.types.GizmoGroup):
    """Reads what is at the live light path under the mouse"""

    bl_idname = "NIM_GGT_ray_reading"
    bl_label = "Light Paths Reading"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = set()

    @classmethod
    def poll(cls, context):
        """Only while they are live."""
        return light_live.is_on()

    def setup(self, context):
        """Make the one that follows the mouse."""
        self.gizmos.new(NIM_GT_ray_reading.bl_idname)


CLASSES = (NIM_OT_light_handle, NIM_GGT_light_handle, NIM_GT_ray_reading, NIM_GGT_ray_reading)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The handle of light paths: an object that they start from, and what it is moved and turned by in a view."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt
from mathutils import Matrix, Vector

from ..cycles.visibility import as_rendered
from . import light_live, light_sources, live_look
from .light_tracing import surfaces_of

NAME = "Light Source"
# Of the turns about its own axes: their colours as Blender's own.
TURNS = {"X": (1.0, 0.2, 0.32), "Y": (0.55, 0.86, 0.0)}


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
        if handle.visible_get():
            _select(context, handle)
        return {"FINISHED"}


def _select(context, handle):
    """Let it be the only one that is selected."""
    for other in context.selected_objects:
        other.select_set(False)
    handle.select_set(True)
    context.view_layer.objects.active = handle


def _where_rays_start(context):
    """The matrix (4, 4) of the middle of the rays as they start now, and a size; of the 3D cursor where none do."""
    scene = context.scene
    settings = live_look.settings_of(scene)
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


class NIM_OT_light_handle_drag(bpy.types.Operator):
    """Move the source of the live light paths, or turn it about one of its own axes"""

    bl_idname = "nim.light_handle_drag"
    bl_label = "Drag Handle of Light Paths"
    bl_options = {"INTERNAL"}

    how: bpy.props.EnumProperty(
        name="How",
        description="What the drag does",
        items=(
            ("MOVE", "Move", "Move it"),
            ("X", "Turn About X", "Turn it about its own X axis"),
            ("Y", "Turn About Y", "Turn it about its own Y axis"),
        ),
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        """Only where there is one, in Object Mode."""
        return context.mode == "OBJECT" and _handle(context) is not None

    def invoke(self, context, event):
        """Select it, and let Blender's own operator go on: with its keys, numbers, snapping and undo."""
        handle = _handle(context)
        _select(context, handle)
        if self.how == "MOVE":
            return bpy.ops.transform.translate("INVOKE_DEFAULT", True, release_confirm=True)
        return bpy.ops.transform.rotate(
            "INVOKE_DEFAULT",
            True,
            orient_type="LOCAL",
            orient_axis=self.how,
            constraint_axis=tuple(axis == self.how for axis in "XYZ"),
            center_override=handle.matrix_world.translation,
            release_confirm=True,
        )


class NIM_GGT_light_handle(bpy.types.GizmoGroup):
    """Move and turn the source of live light paths, whatever is selected"""

    bl_idname = "NIM_GGT_light_handle"
    bl_label = "Light Paths Handle"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"3D", "SHOW_MODAL_ALL"}

    @classmethod
    def poll(cls, context):
        """Only while the rays start there, in Object Mode."""
        return context.mode == "OBJECT" and _handle(context) is not None

    def setup(self, context):
        """Make a gizmo to move it by, and one for each axis to turn it about."""
        drag = NIM_OT_light_handle_drag.bl_idname
        self.move, self.turns = self.gizmos.new("GIZMO_GT_move_3d"), []
        self.move.draw_options, self.move.scale_basis = {"ALIGN_VIEW"}, 0.12
        self.move.color, self.move.color_highlight = (1.0, 0.85, 0.3), (1.0, 1.0, 0.7)
        self.move.alpha, self.move.alpha_highlight = 0.7, 1.0
        self.move.target_set_operator(drag).how = "MOVE"
        for axis, color in TURNS.items():
            dial = self.gizmos.new("GIZMO_GT_dial_3d")
            dial.scale_basis, dial.line_width, dial.draw_options = 0.6, 2.0, {"CLIP"}
            dial.color, dial.color_highlight = color, tuple(0.5 + value / 2 for value in color)
            dial.alpha, dial.alpha_highlight = 0.6, 1.0
            dial.target_set_operator(drag).how = axis
            self.turns.append(("XYZ".index(axis), dial))

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


CLASSES = (NIM_OT_light_handle, NIM_OT_light_handle_drag, NIM_GGT_light_handle, NIM_GT_ray_reading, NIM_GGT_ray_reading)

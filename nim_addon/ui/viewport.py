# SPDX-License-Identifier: GPL-3.0-or-later
"""What a 3D view says of the interfaces in it: the panel of checks, and a note where the view itself is wrong.

EEVEE, which draws Material Preview too, bends no ray backwards: it shows the rim and the tint of an interface, under a veil
(cycles.closures.preview). Solid and Wireframe show shapes.
"""

import bpy
from bpy.app.translations import pgettext_iface

from .. import checks
from . import boxes, warnings
from .panels import Sidebar, draw_sentence

TEXT = "{engine} draws this view and cannot bend a ray backwards: it shows no refraction. Use Rendered, with Cycles."
COLOR, MARGIN = (1.0, 0.62, 0.25, 1.0), 8
_handler = None


def wrong_engine(space: bpy.types.Space | None, scene: bpy.types.Scene) -> str | None:
    """The name of the engine, not Cycles, by which a 3D view shows the interfaces of `scene` shaded; None if none does."""
    if space is None or space.type != "VIEW_3D" or space.shading.type not in ("MATERIAL", "RENDERED"):
        return None
    engine = "EEVEE" if space.shading.type == "MATERIAL" else checks.engine_name(scene)
    if engine == "Cycles":
        return None
    known = warnings.known(scene)
    return engine if known and known.backends else None


def shows_shapes(space: bpy.types.Space | None, scene: bpy.types.Scene) -> bool:
    """Whether a 3D view shows the shapes alone of the interfaces of `scene`, as a person works on them."""
    if space is None or space.type != "VIEW_3D" or space.shading.type not in ("SOLID", "WIREFRAME"):
        return False
    known = warnings.known(scene)
    return bool(known and known.backends)


def is_rendered(screen: bpy.types.Screen, scene: bpy.types.Scene) -> bool:
    """Whether a 3D view of that screen shows `scene` as Cycles renders it."""
    views = (area.spaces.active for area in screen.areas if area.type == "VIEW_3D")
    return scene.render.engine == "CYCLES" and any(view.shading.type == "RENDERED" for view in views)


def draw_note(layout: bpy.types.UILayout, context: bpy.types.Context) -> bool:
    """Draw the sentence and the button into a panel of a 3D view that shows interfaces wrongly; True if it does."""
    engine = wrong_engine(context.space_data, context.scene)
    if engine:
        box = layout.box().column(align=True)
        draw_sentence(box, context, pgettext_iface(TEXT).format(engine=engine), icon="ERROR")
        box.operator("nim.view_rendered", icon="SHADING_RENDERED")
    elif shows_shapes(context.space_data, context.scene):
        column = layout.column(align=True)
        column.label(text="Solid views show no refraction", icon="INFO")
        column.operator("nim.view_rendered", icon="SHADING_RENDERED")
    return engine is not None


def note(context: bpy.types.Context) -> list[str]:
    """The lines of the note over a 3D view, as its region has room for them; none where the view is right."""
    space = context.space_data
    engine = wrong_engine(space, context.scene) if space and space.overlay.show_overlays else None
    return lines_over(context, pgettext_iface(TEXT).format(engine=engine)) if engine else []


def _draw_in_view():
    draw_over(bpy.context, note(bpy.context))


def room(context: bpy.types.Context) -> tuple[float, float]:
    """Between which x, in pixels of its region, something can be written at its foot: other regions may lie over it there."""
    here = context.region
    left, right = 0, here.width
    for other in context.area.regions:
        # one that is hidden keeps no width, or, of the last step's settings, no place
        hidden = other.width <= 1 or (other.type == "HUD" and (other.x, other.y) == (0, 0))
        if hidden or other.type not in ("TOOLS", "HUD", "UI"):
            continue
        if other.x - here.x < here.width / 2:
            left = max(left, other.x - here.x + other.width)
        else:
            right = min(right, other.x - here.x)
    margin = MARGIN * context.preferences.system.ui_scale
    return left + margin, right - margin


def lines_over(context: bpy.types.Context, text: str) -> list[str]:
    """The lines of a text that is to be written over a region, as that has room for them."""
    scale = context.preferences.system.ui_scale
    left, right = room(context)
    return boxes.broken(text, right - left - 2 * boxes.EDGE * scale, scale)


def draw_over(context: bpy.types.Context, lines: list[str]) -> None:
    """Write lines of lines_over() at the foot of the region that is being drawn."""
    scale = context.preferences.system.ui_scale
    if lines:
        boxes.draw(lines, room(context)[0], MARGIN * scale, COLOR, scale)


class NIM_OT_view_rendered(bpy.types.Operator):
    """Let Cycles draw this view: only it bends rays backwards"""

    bl_idname = "nim.view_rendered"
    bl_label = "Show It Rendered"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Only in a 3D view, and where there is Cycles."""
        return context.space_data and context.space_data.type == "VIEW_3D" and hasattr(context.scene, "cycles")

    def execute(self, context):
        """Change the engine, where it is another, and the view."""
        if context.scene.render.engine != "CYCLES":
            context.scene.render.engine = "CYCLES"
            # else the next step is undone along with it; a view alone has no undo
            bpy.ops.ed.undo_push(message=self.bl_label)
        context.space_data.shading.type = "RENDERED"
        return {"FINISHED"}


class NIM_PT_checks(Sidebar, bpy.types.Panel):
    """What would spoil the picture"""

    bl_idname = "NIM_PT_checks"
    bl_label = "Checks"
    page = "material#checks"
    bl_order = 10

    def draw(self, context):
        """Draw what is wrong, or that nothing is."""
        layout = self.layout
        known = warnings.known(context.scene)
        if known is None:
            layout.label(text="Looking...", icon="VIEWZOOM")
            return
        problems = warnings.found(context.scene)
        noted = draw_note(layout, context)
        if not known.backends and not problems:
            layout.label(text="Nothing negative-index here yet", icon="INFO")
        elif not problems and not known.unmeasured and not noted:
            layout.label(text="Nothing to mend", icon="CHECKMARK")
        warnings.draw_problems(layout, context, problems, known.hints)
        warnings.draw_notes(layout, context)
        if known.unmeasured:
            layout.operator("nim.check_meshes", icon="VIEWZOOM")


CLASSES = (NIM_OT_view_rendered, NIM_PT_checks)


def register():
    """Write into the views."""
    global _handler
    if not bpy.app.background:
        _handler = bpy.types.SpaceView3D.draw_handler_add(_draw_in_view, (), "WINDOW", "POST_PIXEL")


def unregister():
    """Write no more."""
    global _handler
    if _handler is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handler, "WINDOW")
        _handler = None

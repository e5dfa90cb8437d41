# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said where F12 is pressed under an engine that bends no ray backwards: as the render starts, and over its picture.

Render handlers are called in the thread of the render, in which nothing can be drawn or reported: a timer says it.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import checks
from ..cycles.material import asked_closures
from ..cycles.visibility import declared, rendered
from . import viewport

TEXT = "{engine} cannot bend a ray backwards: this render shows no refraction. Use Cycles."
_handler = None
_noted = {}  # {slot of the Render Result: the engine that rendered it wrongly}


def wrong_engine(scene: bpy.types.Scene) -> str | None:
    """The name of the engine, not Cycles, by which a render would show materials of ours in `scene`; None if none does.

    Nothing is evaluated: it may be asked while a render is under way.
    """
    for one in _pictured(scene):
        engine = checks.engine_name(one)
        if engine != "Cycles" and any(map(asked_closures, _worn(one))):
            return engine
    return None


def _pictured(scene):
    """The scenes whose objects are in the picture: itself, or those of its strips, where the sequencer makes it."""
    editor = scene.sequence_editor if scene.render.use_sequencer else None
    strips = getattr(editor, "strips_all", None) or getattr(editor, "sequences_all", ())  # until 4.3
    seen = [strip for strip in strips if strip.type != "SOUND" and not strip.mute]
    if seen:
        return {strip.scene for strip in seen if strip.type == "SCENE" and strip.scene}
    tree = _compositor(scene)
    if tree is None:
        return {scene}
    # those that it takes in: Blender renders no other, itself neither
    return {node.scene or scene for node in _nodes(tree) if node.type == "R_LAYERS"}


def _compositor(scene):
    """The tree of nodes that makes the picture of a scene, None where there is none."""
    if not scene.render.use_compositing:
        return None
    if hasattr(scene, "compositing_node_group"):  # from 5.0
        return scene.compositing_node_group
    return scene.node_tree if scene.use_nodes else None


def _nodes(tree):
    """All of a tree and of the groups in it."""
    for node in tree.nodes:
        yield node
        if group := getattr(node, "node_tree", None):
            yield from _nodes(group)


def _worn(scene):
    """The materials that its view layers show."""
    for view in scene.view_layers:
        if view.use and view.material_override:
            yield view.material_override
        elif view.use:
            yield from {material for materials in declared(rendered(scene, view)).values() for material in materials}


def _slot():
    image = next((image for image in bpy.data.images if image.type == "RENDER_RESULT"), None)
    return image.render_slots.active_index if image else 0


@persistent
def note_render(scene: bpy.types.Scene, _=None) -> None:
    """Called by Blender as a render starts, before its first picture."""
    engine = wrong_engine(scene)
    _noted.pop(_slot(), None)
    if engine is None:
        return
    _noted[_slot()] = engine
    if bpy.app.background:
        print(f"Negative-Index Materials: {pgettext_rpt(TEXT).format(engine=engine)}")
    else:
        bpy.app.timers.register(_report)


def _report():
    window = next(iter(bpy.context.window_manager.windows), None)
    if window:
        with bpy.context.temp_override(window=window):
            bpy.ops.nim.note_render("EXEC_DEFAULT", engine=_noted.get(_slot(), ""))


@persistent
def forget(*_) -> None:
    """Called by Blender: another file has another picture."""
    _noted.clear()


class NIM_OT_note_render(bpy.types.Operator):
    """Say which engine renders, where it bends no ray backwards"""

    bl_idname = "nim.note_render"
    bl_label = "Say What Renders"
    bl_options = {"INTERNAL"}

    engine: bpy.props.StringProperty(
        name="Engine", description="What renders the picture", options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context):
        """Report it, if there is still anything to say."""
        if not self.engine:
            return {"CANCELLED"}
        self.report({"WARNING"}, pgettext_rpt(TEXT).format(engine=self.engine))
        return {"FINISHED"}


def _draw_over_picture():
    space = bpy.context.space_data
    image = space.image if space else None
    if image is None or image.type != "RENDER_RESULT" or not space.overlay.show_overlays:
        return
    if engine := _noted.get(image.render_slots.active_index):
        context = bpy.context
        viewport.draw_over(context, viewport.lines_over(context, pgettext_iface(TEXT).format(engine=engine)))


CLASSES = (NIM_OT_note_render,)
HANDLERS = (("render_init", note_render), ("load_post", forget))


def register():
    """Write over pictures."""
    global _handler
    if not bpy.app.background:
        _handler = bpy.types.SpaceImageEditor.draw_handler_add(_draw_over_picture, (), "WINDOW", "POST_PIXEL")


def unregister():
    """Write no more."""
    global _handler
    if _handler is not None:
        bpy.types.SpaceImageEditor.draw_handler_remove(_handler, "WINDOW")
        _handler = None
    forget()

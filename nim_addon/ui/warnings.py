# SPDX-License-Identifier: GPL-3.0-or-later
"""The wrong settings that the checks find, each with the button that mends it."""

from collections.abc import Sequence

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import checks
from ..checks import backdrop, ball_checks, mesh_checks, ray_checks
from ..checks.hints import hints
from ..checks.sight import look
from ..cycles.material import asked_interfaces, medium_of
from .looks import Looks
from .panels import draw_help, draw_sentence

# A mesh of more faces is measured when asked for, not while a panel is drawn.
LARGEST = 50_000

# What sight.Sight keeps of an object, by its session_uid.
_kept = {}


class Found:
    """What drawing needs to know of a scene."""

    def __init__(self, scene: bpy.types.Scene, limit: int | None):
        windows = bpy.context.window_manager.windows
        layer = next((window.view_layer for window in windows if window.scene == scene), None)
        if layer is None:  # nobody has evaluated it
            layer = scene.view_layers[0]
            layer.update()
        sight = look(scene, layer.depsgraph, limit, _kept)
        self.backends = checks.backends(sight.ours)
        self.problems = checks.found_in(sight)
        self.hints = backdrop.hints(sight) + hints(sight) if hasattr(scene, "cycles") else []
        self.notes = ball_checks.notes(sight)
        self.unmeasured = len(sight.left_out)
        self.lamps = [lamp.name for lamp in sight.lamps]
        self.wearers = [wearer.original.name for wearer in sight.wearers()]
        interfaces = [found.node for material in sight.ours for found in asked_interfaces(material)]
        self.disperses = any(medium_of(node, side) for node in interfaces for side in ("Inside", "Outside"))
        self.unannounced = self._unannounced(scene)

    def _unannounced(self, scene):
        return ray_checks.unannounced(scene, self.lamps, self.wearers) if hasattr(scene, "cycles") else ()

    def is_true_of(self, scene: bpy.types.Scene) -> bool:
        """Whether what Blender tells nobody of is as it was."""
        return self._unannounced(scene) == self.unannounced


def _is_still():
    return not any(window.screen.is_animation_playing for window in bpy.context.window_manager.windows)


LOOKS = Looks(lambda scene, everything=False: Found(scene, None if everything else LARGEST), _is_still)


def known(scene: bpy.types.Scene) -> Found | None:
    """What was found in a scene; while it is looked at anew, the last time. Quick: it can be asked while drawing."""
    last = LOOKS.last(scene)
    if last and not last.is_true_of(scene):
        LOOKS.outdate(scene)
    return LOOKS.known(scene)


def found(scene: bpy.types.Scene, material: bpy.types.Material | None = None) -> list[checks.Problem]:
    """The Problems of a scene, or those that bear on one material; quick where nothing changed."""
    there = known(scene)
    if there is None:
        return []
    backends = there.backends if material is None else _backends_of(material, there)
    problems = checks.setting_problems(scene, backends) if backends else []
    problems += there.problems if material is None or backends else []
    return [
        problem
        for problem in problems
        if material is None or problem.materials is None or material.name in problem.materials
    ]


def _backends_of(material, there):
    """checks.backends() of one material; what the last look knows, since a panel asks while it is drawn."""
    known = {backend: (material.name,) for backend, names in there.backends.items() if material.name in names}
    return known or checks.backends([material])


def draw_notes(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what of a scene is as it should be, and may yet surprise."""
    there = known(context.scene)
    for note in there.notes if there else ():
        draw_sentence(layout, context, _said(note), icon="INFO")


def _said(problem):
    return " ".join(pgettext_iface(text) for text in problem.texts).format(**problem.values)


def draw_problems(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    problems: list[checks.Problem],
    hints: Sequence[checks.Problem] = (),
) -> None:
    """Draw a box for each Problem, with the button that mends it; above them one for all of them where there are several.

    hints: drawn between: what they offer is seen at once, and must not be looked for below what one button mends
    """
    if sum(problem.remedy is not None for problem in problems) > 1:
        layout.operator("nim.mend", text="Mend All", icon="TOOL_SETTINGS").code = ""
    _draw_hints(layout, context, hints)
    for problem in problems:
        box = layout.box().column(align=True)
        draw_sentence(box, context, _said(problem), icon="ERROR")
        if problem.remedy:
            box.operator("nim.mend", text=problem.remedy, icon="TOOL_SETTINGS").code = problem.code
    if problems:
        draw_help(layout, "material#checks", "What This Means")


def _draw_hints(layout, context, hints):
    """Draw a box for each hint, with the button of what would help."""
    for hint in hints:
        box = layout.box().column(align=True)
        draw_sentence(box, context, pgettext_iface(hint.texts[0]).format(**hint.values), icon="INFO")
        if hint.code == "sky":
            box.operator("nim.add_sky", icon="WORLD")
        else:
            box.operator("nim.bake_caustics", icon="LIGHT_SUN")


class NIM_OT_mend(bpy.types.Operator):
    """Mend what would spoil the picture of a negative-index material"""

    bl_idname = "nim.mend"
    bl_label = "Mend"
    bl_options = {"REGISTER", "UNDO"}

    code: bpy.props.StringProperty(
        name="Problem", description="Which problem to mend; all of them if empty", options={"HIDDEN", "SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        """Only where meshes can be changed."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Mending needs Object Mode")
            return False
        return True

    def execute(self, context):
        """Mend, and say what was mended."""
        mended = checks.mend(context.scene, self.code or None)
        forget()
        if not mended:
            self.report({"WARNING"}, pgettext_rpt("There was nothing to mend"))
            return {"CANCELLED"}
        left = len(checks.problems(context.scene))
        text = "Mended: {count}, left: {left}" if left else "Mended: {count}, nothing is left"
        self.report({"INFO"}, pgettext_rpt(text).format(count=len(mended), left=left))
        return {"FINISHED"}


class NIM_OT_check_meshes(bpy.types.Operator):
    """Look at the large meshes of negative-index materials too: are they closed, do their normals and media fit"""

    bl_idname = "nim.check_meshes"
    bl_label = "Check Large Meshes"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Only where some were left out."""
        there = known(context.scene)
        if there is None or not there.unmeasured:
            cls.poll_message_set("All meshes of negative-index materials have been checked")
            return False
        return True

    def execute(self, context):
        """Measure them, and say what came out."""
        there = known(context.scene)
        count = there.unmeasured
        LOOKS.renew(context.scene.session_uid, True)
        wrong = sum(problem.code in mesh_checks.CODES for problem in found(context.scene))
        self.report(
            {"INFO"}, pgettext_rpt("Meshes checked: {count}, problems: {wrong}").format(count=count, wrong=wrong)
        )
        return {"FINISHED"}


@persistent
def note_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Called by Blender after a change: what was found may no longer be so."""
    LOOKS.outdate()
    for update in depsgraph.updates if depsgraph else ():
        if update.is_updated_geometry:
            # a mesh may be worn by many objects: which of them, the objects' own updates say; evaluated, they have no number
            _kept.pop(update.id.original.session_uid, None)


@persistent
def forget(*_) -> None:
    """Forget everything: another file, or another state of this one."""
    LOOKS.forget()
    _kept.clear()


CLASSES = (NIM_OT_mend, NIM_OT_check_meshes)
HANDLERS = (
    ("depsgraph_update_post", note_change),
    ("undo_post", forget),
    ("redo_post", forget),
    ("load_post", forget),
)


def unregister():
    """Forget what was found."""
    forget()

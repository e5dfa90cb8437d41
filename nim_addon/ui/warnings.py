# SPDX-License-Identifier: GPL-3.0-or-later
"""The wrong settings that the checks find, each with the button that mends it."""

import textwrap

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import checks
from ..checks import mesh_checks, ray_checks
from ..checks.sight import look
from . import deferred

# A mesh of more faces is measured when asked for, not while a panel is drawn.
LARGEST = 50_000

# What was found, until the file changes: by session_uid of a scene; and what sight.Sight keeps, by that of an object.
_found = {}
_kept = {}
# The scenes in _found that nothing has changed since.
_fresh = set()


class _Found:
    """What drawing needs to know of a scene; no bpy data, which may be gone by the next drawing."""

    def __init__(self, scene, limit):
        windows = bpy.context.window_manager.windows
        layer = next((one.view_layer for one in windows if one.scene == scene), None)
        if layer is None:  # nobody has evaluated it
            layer = scene.view_layers[0]
            layer.update()
        sight = look(scene, layer.depsgraph, limit, _kept)
        self.backends = checks.backends(sight.worn)
        self.problems = checks.found_in(sight)
        self.unmeasured = len(sight.left_out)
        self.lamps = [thing.name for thing in sight.lamps]
        self.wearers = [one.original.name for one in sight.wearers()]
        self.unannounced = self._unannounced(scene)

    def _unannounced(self, scene):
        return ray_checks.unannounced(scene, self.lamps, self.wearers) if hasattr(scene, "cycles") else ()

    def is_true_of(self, scene):
        """Whether what Blender tells nobody of is as it was."""
        return self._unannounced(scene) == self.unannounced


def known(scene):
    """The _Found of a scene; while it is looked at anew, the last one, or None. Quick: it can be asked while drawing."""
    there = _found.get(scene.session_uid)
    fresh = there and scene.session_uid in _fresh and there.is_true_of(scene)
    if not fresh and not _is_playing():
        deferred.do(_renew, scene.session_uid)
    return _found.get(scene.session_uid)


def _is_playing():
    return any(window.screen.is_animation_playing for window in bpy.context.window_manager.windows)


def _renew(uid, everything=False):
    scene = next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)
    if scene:
        _found[uid] = _Found(scene, None if everything else LARGEST)
        _fresh.add(uid)


def found(scene, material=None):
    """The Problems of a bpy.types.Scene, or those that bear on one bpy.types.Material; quick where nothing changed."""
    there = known(scene)
    if there is None:
        return []
    backends = there.backends if material is None else checks.backends([material])
    those = checks.setting_problems(scene, backends) if backends else []
    those += there.problems if material is None or backends else []
    return [one for one in those if material is None or one.materials is None or material.name in one.materials]


def draw_problems(layout, context, those):
    """Draw a box for each Problem, with the button that mends it, and one for all of them where there are several."""
    for problem in those:
        box = layout.box().column(align=True)
        sentence = " ".join(pgettext_iface(text) for text in problem.texts).format(**problem.values)
        draw_sentence(box, context, sentence, icon="ERROR")
        if problem.remedy:
            box.operator("nim.mend", text=problem.remedy, icon="TOOL_SETTINGS").code = problem.code
    if sum(problem.remedy is not None for problem in those) > 1:
        layout.operator("nim.mend", text="Mend All", icon="TOOL_SETTINGS").code = ""


def draw_sentence(layout, context, text, icon="NONE"):
    """Draw a sentence over as many lines as the region is too narrow for."""
    scale = context.preferences.system.ui_scale
    width = context.region.width / scale if context.region else 300
    # a letter is about 6.2 units wide; margins, tabs and the icon take the rest
    letters = int((width - (75 if icon != "NONE" else 50)) / 6.2)
    lines = textwrap.wrap(text, max(24, letters))
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE", translate=False)


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
    """Look at the large meshes of interface materials too: are they closed, do their normals and media fit"""

    bl_idname = "nim.check_meshes"
    bl_label = "Check Large Meshes"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Only where some were left out."""
        there = known(context.scene)
        if there is None or not there.unmeasured:
            cls.poll_message_set("All meshes of interface materials have been checked")
            return False
        return True

    def execute(self, context):
        """Measure them, and say what came out."""
        there = known(context.scene)
        count = there.unmeasured
        _renew(context.scene.session_uid, everything=True)
        wrong = sum(problem.code in mesh_checks.CODES for problem in found(context.scene))
        self.report(
            {"INFO"}, pgettext_rpt("Meshes checked: {count}, problems: {wrong}").format(count=count, wrong=wrong)
        )
        return {"FINISHED"}


@persistent
def _changed(scene, depsgraph=None):
    """Note what the change of a file may have made untrue."""
    _fresh.clear()
    for update in depsgraph.updates if depsgraph else ():
        if update.is_updated_geometry:
            # a mesh may be worn by many objects: which of them, the objects' own updates say; evaluated, they have no number
            _kept.pop(update.id.original.session_uid, None)


@persistent
def forget(*_):
    """Forget everything: another file, or another state of this one."""
    _found.clear()
    _fresh.clear()
    _kept.clear()


CLASSES = (NIM_OT_mend, NIM_OT_check_meshes)
_HANDLERS = (
    ("depsgraph_update_post", _changed),
    ("undo_post", forget),
    ("redo_post", forget),
    ("load_post", forget),
)


def register():
    """Watch for changes."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    """Stop watching."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    deferred.stop()
    forget()

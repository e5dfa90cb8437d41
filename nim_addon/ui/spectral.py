# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of one's own rendered in all wavelengths at once: the button that sets it up, and takes all of it back."""

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..checks import spectral_checks
from ..cycles import spectral
from ..scenes.stage import STAGE_MARK
from . import built, warnings
from .help import fail
from .media import backend_for
from .panels import Sidebar, draw_sentence


def told(done: spectral.Done) -> str:
    """What was given weights to, in the user's language."""
    text = pgettext_iface("Weighted by wavelength: lamps {lamps}, materials {materials}, sky: {sky}.")
    sky = pgettext_iface("yes") if done.sky else pgettext_iface("no")
    return text.format(lamps=done.lamps, materials=done.materials, sky=sky)


class NIM_OT_spectral(bpy.types.Operator):
    """Render all wavelengths at once, so that what disperses shows its colors; pressed again, all is as it was before"""

    bl_idname = "nim.spectral"
    bl_label = "Spectral"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only in Object Mode, in a scene of this file that Cycles could render."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the mode you are in for Object Mode first")
            return False
        if not hasattr(context.scene, "cycles"):
            cls.poll_message_set("Cycles is switched off in the preferences: only Cycles bends light backwards.")
            return False
        if context.scene.library:
            cls.poll_message_set("The scene is linked from a library: make it local first")
            return False
        return True

    def execute(self, context):
        """Set the scene up, or take that back, and say what was done."""
        scene = context.scene
        with built.ours(scene):
            if spectral.is_spectral(scene):
                spectral.undo(scene)
                self.report({"INFO"}, pgettext_rpt("The scene is as it was: no light is weighted any more"))
            else:
                try:
                    done = spectral.set_up(scene, backend_for(scene))
                except (ValueError, RuntimeError) as error:
                    return fail(self, str(error))
                self.report({"INFO"}, told(done))
        if scene.get(STAGE_MARK):  # one of our own scenes, which is built anew as it is now
            scene.nim_scenes.spectral = spectral.is_spectral(scene)
        return {"FINISHED"}


class NIM_PT_spectral(Sidebar, bpy.types.Panel):
    """All wavelengths in one render"""

    bl_idname = "NIM_PT_spectral"
    bl_label = "Spectral"
    page = "material#all-wavelengths-in-one-render"
    bl_order = 40
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the button, what it did, and what then spoils the colours."""
        layout, scene = self.layout, context.scene
        on = spectral.is_spectral(scene)
        layout.operator("nim.spectral", icon="COLOR", depress=on)
        say = pgettext_iface
        if not on:
            text = say("Renders all wavelengths at once: media that disperse show their colors, and the rest stays.")
            draw_sentence(layout, context, text)
            return
        if done := spectral.done(scene):
            draw_sentence(layout, context, told(done), icon="CHECKMARK")
        known = warnings.known(scene)
        if known and not known.disperses:
            draw_sentence(
                layout, context, say("Nothing here disperses yet: choose a medium by wavelength."), icon="INFO"
            )
        draw_sentence(layout, context, say("Views show it without colors, at 550 nm: render it to see them."))
        text = say("Real motion blur is not to be had with it: the time of the shutter is the wavelength.")
        draw_sentence(layout, context, text)
        problems = [problem for problem in warnings.found(scene) if problem.code in spectral_checks.CODES]
        warnings.draw_problems(layout, context, problems)


CLASSES = (NIM_OT_spectral, NIM_PT_spectral)

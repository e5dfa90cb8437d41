# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons of the caustics panel: a bake, a round each time a timer fires, that Esc stops; and what clears it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import caustics
from ..base.text import duration
from ..caustics import MILLION, frames
from ..caustics.digest import digest
from . import caustics_looks, escape, viewport
from .help import explained

ROUND = 1 << 18  # photons of a round, at most: a window does not answer meanwhile
LEAST_ROUNDS = 2  # of which caustics can be made: either half of them smooths the other
# What still gets through while a window bakes: looking around. Anything else could change what is being traced.
LOOKING = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE"}
LOOKING |= {"TIMER", "MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "WINDOW_DEACTIVATE"}


def millions(photons: float) -> str:
    """A number of photons in the panel's unit, to three digits."""
    return f"{photons / MILLION:.3g}"


class Run:
    """A bake under way: step() by step, then keep() what is traced; close() takes away what was made for tracing.

    Raises ValueError, one sentence, as caustics.Bake does.
    """

    def __init__(self, scene: bpy.types.Scene):
        settings = scene.nim_caustics
        self.scene, self.started, self.more = scene, time.monotonic(), True
        self.settings = [settings.photons, settings.texels, settings.seed]
        self.mark = digest(scene, caustics_looks.MESHES)
        self.bake = bake = caustics.Bake(
            scene, photons=settings.photons * MILLION, texels=int(settings.texels), seed=settings.seed, most=ROUND
        )
        self.stack = contextlib.ExitStack()
        self.stack.enter_context(bake)
        self.rounds = iter(bake)

    @property
    def enough(self) -> bool:
        """Whether there is something to keep where it is stopped now."""
        return self.bake.done >= LEAST_ROUNDS

    @property
    def photons(self) -> float:
        """How many are traced so far, about."""
        return self.bake.done * self.bake.photons * len(self.bake.sources)

    @property
    def part(self) -> float:
        """How much is traced, 0 to 1."""
        return self.bake.done / self.bake.total

    def text(self) -> str:
        """How far it is, in words."""
        if not self.more:
            return pgettext_iface("Putting it onto the surfaces...")
        if self.bake.done < LEAST_ROUNDS:
            return pgettext_iface("Starting")
        left = (time.monotonic() - self.started) * (1 - self.part) / self.part
        return pgettext_iface("{}, {} left").format(f"{self.part:.0%}", duration(left))

    def step(self) -> bool:
        """Trace one round; returns whether there are more. ReferenceError where the scene is gone."""
        if self.scene.name:  # asked for the error where it is gone
            self.more = next(self.rounds, None) is not None and self.bake.done < self.bake.total
        return self.more

    def keep(self) -> None:
        """Put what is traced into the scene; ValueError, one sentence, where the scene is no longer the one traced."""
        scene = self.scene
        if digest(scene, caustics_looks.MESHES) != self.mark:
            raise ValueError(pgettext_rpt("The scene was changed while it was traced; bake it again."))
        self.bake.put()
        collection = caustics.baked(scene)
        textures = self.bake.density.textures.values()
        collection[caustics.REPORT] = {
            "photons": self.photons,
            "asked": float(self.settings[0] * MILLION),
            "seconds": time.monotonic() - self.started,
            "megabytes": sum(texture.size for texture in textures) * 16 / 1e6,
            # what was asked for; nothing where it was stopped before
            "settings": [str(value) for value in self.settings] if self.bake.done == self.bake.total else [],
        }

    def told(self) -> str:
        """What is said once it is kept."""
        text = pgettext_rpt(
            "Caustics baked onto {names}, hidden now behind copies that shine: {millions} million photons in {time}"
        ).format(
            names=caustics_looks.surfaces_of(self.scene),
            millions=millions(self.photons),
            time=duration(time.monotonic() - self.started),
        )
        screen = bpy.context.screen
        if bpy.app.background or screen is None or viewport.is_rendered(screen, self.scene):
            return text
        return f"{text}. {pgettext_rpt('Show It Rendered, in the Caustics panel, shows them')}"

    def close(self) -> None:
        """Take away what was made for tracing."""
        with contextlib.suppress(ReferenceError):  # another file, or another state of this one, took it away
            self.stack.close()


# The Run under way, and the timer of the window that it is shown in; there are never two.
_run = _timer = None


def under_way() -> Run | None:
    """The bake under way, or None."""
    return _run


@persistent
def drop(*_) -> None:
    """Drop the bake under way, if there is one; called by Blender too, before its scene goes."""
    global _run
    if _run is not None:
        run, _run = _run, None
        run.close()


def release() -> None:
    """Give back the timer, the cursor and the status bar."""
    global _timer
    if _timer is not None:
        bpy.context.window_manager.event_timer_remove(_timer)
        bpy.context.window_manager.progress_end()
        _timer = None
        for workspace in bpy.data.workspaces:
            workspace.status_text_set(None)


class Press:
    """What one press of the button does, bit by bit: each returns the state of the operator, empty while it goes on.

    report: function of a set of one word, as {"INFO"}, and a sentence
    make:   what makes the Run of a scene, or what is used as one
    """

    def __init__(self, report: Callable[[set[str], str], None], make: Callable[[bpy.types.Scene], Any] = Run):
        self.run, self.report, self.make = None, report, make
        self.asked_to_stop = False  # in another window than the one it was started in

    def tick(self, scene: bpy.types.Scene) -> set[str]:
        """Start, trace a round or put what is traced into the scene, whichever is next."""
        global _run
        try:
            if self.run is None and _run is None:
                self.run = _run = self.make(scene)
            elif _run is not self.run:
                return {"CANCELLED"}  # undone, another file was opened, or another bake was quicker to start
            elif self.run.more:
                self.run.step()
            else:
                return self._keep()
        except (ValueError, RuntimeError, OSError) as error:
            drop()
            self.report({"ERROR"}, explained("nim.bake_caustics", str(error)))
            return {"CANCELLED"}
        except ReferenceError:
            drop()
            return {"CANCELLED"}
        except BaseException:
            drop()  # or no other bake could be started
            raise
        return set()

    def ask_to_stop(self) -> None:
        """Have it stopped by the next event of the window that it was started in."""
        self.asked_to_stop = True

    def stop(self) -> set[str]:
        """Keep what is traced so far, if that is enough to be seen."""
        run = _run
        if run is None or not run.enough:
            drop()
            self.report({"INFO"}, pgettext_rpt("Stopped before anything could be seen; nothing is changed"))
            return {"CANCELLED"}
        run.more = False
        return self.tick(run.scene)

    def _keep(self):
        run = _run
        run.keep()
        drop()
        caustics_looks.forget()
        self.report({"INFO"}, run.told())
        return {"FINISHED"}


def busy(context: bpy.types.Context) -> str | None:
    """Why nothing can be baked or cleared just now, or None."""
    if _run is not None:
        return "Caustics are being baked; Esc stops it"
    if context.mode != "OBJECT":
        return "Leave the mode you are in for Object Mode first"
    return None


def rendering() -> str | None:
    """Why nothing can be traced just now, or None."""
    return "A render is under way; wait for it, or cancel it" if bpy.app.is_job_running("RENDER") else None


class Baking:
    """What the operators that bake share; while a window is open they are modal, a round each time their timer fires."""

    make = Run  # of a scene

    def status(self, text: str) -> str:
        """What the status bar says, with how far it is."""
        return pgettext_iface("Caustics: {}. Esc: stop, and keep what is traced").format(text)

    def invoke(self, context, event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        global _timer
        manager = context.window_manager
        press = self.press = Press(self.report, type(self).make)
        timer = _timer = manager.event_timer_add(0.02, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        listening = escape.Listening(lambda: _timer is timer, press.ask_to_stop, LOOKING)
        escape.listen(listening, beside=context.window)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if self.press.asked_to_stop or (event.type == "ESC" and event.value == "PRESS"):
            return self._closed(context, self.press.stop())
        if event.type == "TIMER":
            # Blender may hang where a script sets up a scene while a material's icon is rendered
            state = set() if bpy.app.is_job_running("RENDER_PREVIEW") else self.press.tick(context.scene)
            if state:
                return self._closed(context, state)
            self._tell(context)
            return {"PASS_THROUGH"}
        return {"PASS_THROUGH"} if event.type in LOOKING else {"RUNNING_MODAL"}

    def execute(self, context):
        manager, press = context.window_manager, Press(self.report, type(self).make)
        manager.progress_begin(0, 100)
        try:
            while True:
                state = press.tick(context.scene)
                if state:
                    return state
                manager.progress_update(100 * _run.part)
        finally:
            manager.progress_end()
            drop()

    def cancel(self, context):
        """Called by Blender where the window closes, or another file is opened."""
        self._closed(context, set())

    def _tell(self, context):
        if _run is None:
            return
        context.window_manager.progress_update(100 * _run.part)
        context.workspace.status_text_set(self.status(_run.text()))
        if context.area:
            context.area.tag_redraw()

    def _closed(self, context, state):
        """Leave the window as it was; returns `state`."""
        drop()
        release()
        if context.area:
            context.area.tag_redraw()
        return state


class NIM_OT_bake_caustics(Baking, bpy.types.Operator):
    """Bake the caustics of the frame that is shown."""

    bl_idname = "nim.bake_caustics"
    bl_label = "Bake Caustics"
    bl_description = (
        "Trace light from the lamps through what bends it and by mirrors, and let the surfaces shine where it lands. "
        "It takes the place of the last render in the Image editor"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        problem = busy(context) or rendering()
        if not problem and caustics_looks.up_to_date(context.scene):
            problem = "The caustics are up to date. For finer ones raise Million Photons"
        if problem:
            cls.poll_message_set(problem)
        return problem is None


class NIM_OT_clear_caustics(bpy.types.Operator):
    """Take the baked caustics out of this scene; its surfaces and lamps are as before"""

    bl_idname = "nim.clear_caustics"
    bl_label = "Clear Caustics"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        problem = busy(context)
        if not problem and not caustics_looks.left(context.scene):
            problem = "This scene has no baked caustics"
        if problem:
            cls.poll_message_set(problem)
        return problem is None

    def execute(self, context):
        kept = frames.frames_of(context.scene)
        frames.forget_frames(context.scene)
        caustics.clear(context.scene)
        caustics_looks.forget()
        said = pgettext_rpt("Caustics cleared")
        if kept:  # which a bake finds again
            said = pgettext_rpt("Caustics cleared; those of the frames stay in {}").format(
                bpy.path.abspath(kept.folder)
            )
        self.report({"INFO"}, said)
        return {"FINISHED"}


CLASSES = (NIM_OT_bake_caustics, NIM_OT_clear_caustics)
HANDLERS = (("undo_pre", drop), ("redo_pre", drop), ("load_pre", drop))


def unregister():
    """Drop a bake under way."""
    drop()
    release()

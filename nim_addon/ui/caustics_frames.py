# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of an animation: baked frame by frame into a folder beside the file, and put in as the frame changes."""

from __future__ import annotations

import contextlib
import functools
import threading
import time
from collections.abc import Callable
from pathlib import Path

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import caustics
from ..base.files import writable_folder
from ..base.text import duration, fit
from ..caustics import frames
from ..caustics.baking import SAVING
from . import caustics_bake, caustics_looks, deferred
from .caustics_bake import MILLION, Baking

PATIENCE = 60.0  # seconds that a render waits for the caustics of a frame


def range_of(scene: bpy.types.Scene) -> range:
    """The frames of a scene that are rendered."""
    return range(scene.frame_start, scene.frame_end + 1, scene.frame_step)


def wanted(scene: bpy.types.Scene) -> frames.Frames:
    """What the panel's settings ask for, in a folder beside the file."""
    settings = scene.nim_caustics
    folder = f"//{fit(Path(bpy.data.filepath).stem)}_caustics/{fit(scene.name)}"
    photons = settings.photons * MILLION
    return frames.Frames(folder, photons, int(settings.texels), settings.seed, caustics_bake.ROUND)


class FramesRun:
    """A bake of all frames under way, used as a caustics_bake.Run; raises OSError where the folder cannot be written."""

    def __init__(self, scene: bpy.types.Scene):
        self.scene, self.at, self.more = scene, scene.frame_current, True
        self.frames, self.numbers = wanted(scene), range_of(scene)
        writable_folder(bpy.path.abspath(self.frames.folder))
        self.index, self.traced, self.dark = 0, 0, []
        self.bake: caustics.Bake | None = None
        self.began: tuple[float, float] | None = None  # when tracing did, and which part was there already
        self.work = self._work()

    def _work(self):
        for index, frame in enumerate(self.numbers):
            self.index = index
            with frames.as_they_are():
                self.scene.frame_set(frame)
            try:
                with self.frames.bake(self.scene) as self.bake:
                    yield from self._trace(self.frames.file(frame))
            except ValueError as error:  # no light lands at this frame
                self.dark.append(frame)
                if len(self.dark) == len(self.numbers):
                    raise
                print(f"frame {frame}: {error}")
            self.bake = None

    def _trace(self, file):
        """What is kept already, and still of this scene, is not traced again."""
        bake = self.bake
        bake.load(file)
        yield
        if bake.done == bake.total:
            return
        self.began = self.began or (time.monotonic(), self.part)
        saved = time.monotonic()
        for done in bake:
            if done == bake.total or time.monotonic() - saved > SAVING:
                bake.save(file)
                saved = time.monotonic()
            yield
        self.traced += 1

    @property
    def enough(self) -> bool:
        """Whatever is kept is gone on from."""
        return True

    @property
    def part(self) -> float:
        """How much is done, 0 to 1."""
        of_frame = self.bake.done / self.bake.total if self.bake else 0.0
        return (self.index + of_frame) / len(self.numbers)

    def text(self) -> str:
        """How far it is, in words."""
        left = None
        if self.began and self.part > self.began[1]:
            left = (time.monotonic() - self.began[0]) * (1 - self.part) / (self.part - self.began[1])
        text = pgettext_iface("Frame {}, {}, {} left") if left is not None else pgettext_iface("Frame {}, {}")
        return text.format(self.numbers[self.index], f"{self.part:.0%}", duration(left or 0))

    def step(self) -> bool:
        """Trace one round; returns whether there are more. ReferenceError where the scene is gone."""
        try:
            if self.scene.name:
                self.more = next(self.work, self) is not self
        except ReferenceError:
            raise
        except Exception:
            self._go_back()
            raise
        return self.more

    def _go_back(self):
        with frames.as_they_are():
            self.scene.frame_set(self.at)

    def keep(self) -> None:
        """Keep what is traced of a frame that is not done, and let the scene have what is kept of the one it was at."""
        if self.bake and 0 < self.bake.done < self.bake.total:
            self.bake.save(self.frames.file(self.numbers[self.index]))
        self.stopped = self.bake is not None
        self.close()
        self._go_back()
        self.frames.keep(self.scene)
        # a render changes the frame, and so the scene, in a thread of its own: nothing may be drawn of it meanwhile
        self.scene.render.use_lock_interface = True
        frames.follow(self.scene)

    def told(self) -> str:
        """What is said once it is kept."""
        if self.stopped:
            text = pgettext_rpt("Stopped in frame {}; the same button goes on from there")
            return text.format(self.numbers[self.index])
        text = pgettext_rpt("Caustics are kept in {folder} (frames: {count}, of which traced now: {traced})")
        count = len(self.numbers) - len(self.dark)
        return text.format(count=count, folder=bpy.path.abspath(self.frames.folder), traced=self.traced)

    def close(self) -> None:
        """Take away what was made for tracing."""
        with contextlib.suppress(ReferenceError):
            self.work.close()


class NIM_OT_bake_frames(Baking, bpy.types.Operator):
    """Bake the caustics of all frames."""

    bl_idname = "nim.bake_caustics_frames"
    bl_label = "Bake All Frames"
    bl_description = (
        "Trace the caustics of every frame of the scene's range into a folder beside the file, and let each frame have its "
        "own, in renders too. What is kept there already and still holds is not traced again"
    )
    bl_options = {"REGISTER", "UNDO"}

    make = FramesRun

    def status(self, text):
        return pgettext_iface("Caustics: {}. Esc: stop; the same button goes on from there").format(text)

    @classmethod
    def poll(cls, context):
        problem = caustics_bake.busy(context) or caustics_bake.rendering()
        if not problem and not bpy.data.filepath:
            problem = "Save the file first: the caustics of its frames are kept beside it"
        if problem:
            cls.poll_message_set(problem)
        return problem is None


def _plays():
    return not bpy.app.is_job_running("RENDER") and any(
        window.screen.is_animation_playing for window in bpy.context.window_manager.windows
    )


def in_the_main_thread(act: Callable[[], object]) -> None:
    """Call `act`, in a render that a window goes on beside, whose thread has handlers called, by way of a timer.

    What makes, removes or evaluates data in another thread than the window's has Blender fall over.
    """
    if threading.current_thread() is threading.main_thread():
        act()
        return
    over = threading.Event()

    def acted():
        if not over.is_set():  # else nobody waits for it any more
            try:
                deferred.writing(act)
            finally:
                over.set()

    bpy.app.timers.register(acted)
    over.wait(PATIENCE)
    over.set()


@persistent
def changes(scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Called by Blender before a new frame is evaluated, in a render too, and where an animation no longer plays.

    Later would be too late: a render would not see what is put in, and what is evaluated would name data that is gone.
    """
    if frames.frames_of(scene) is None or caustics_bake.under_way():
        return
    # textures take longer than a frame that is played: they come when it stops
    in_the_main_thread(functools.partial(frames.let_go if _plays() else frames.follow, scene))
    caustics_looks.LOOKS.outdate(scene)


CLASSES = (NIM_OT_bake_frames,)
HANDLERS = (("frame_change_pre", changes), ("animation_playback_post", changes))

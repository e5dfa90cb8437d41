# SPDX-License-Identifier: GPL-3.0-or-later
"""A render in a second Blender without a window, while this one stays free."""

from __future__ import annotations

import atexit
import dataclasses
import json
import shutil
import subprocess
import threading
import time
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..base import processes
from ..base.processes import second_blender
from ..base.text import duration
from ..renders.request import Request
from ..scenes import SCENES
from . import preferences, scenes
from .help import fail
from .panels import Sidebar, draw_sentence
from .scene_settings import NIM_PG_scenes, backend_of, parameters_of, samples_of

PATIENCE = 5.0  # seconds that a job may take to end by itself
INTERVAL = 0.25  # seconds between two looks at it
REFUSED = 1, 2  # exit codes of what says why it ends
NOTED = 3  # sentences about what it renders that are drawn


@dataclasses.dataclass(frozen=True)
class Work:
    """What a job renders.

    title:    name of the image that a person waits for
    requests: by the names of their images
    words:    of `nimray`, which is run in the place of all these
    joined:   name of the image that they make side by side, empty where they make none
    compared: what the record of that one says: "compares", a text for each of them, and "set", what they share
    captions: a line for each of them, below it in that image
    own:      whether it is a person's own scene, of which the last picture is shown where an Image editor is open
    passing:  a folder that goes with the job
    """

    title: str
    requests: dict[str, Request] = dataclasses.field(default_factory=dict)
    words: tuple[str, ...] = ()
    joined: str = ""
    compared: dict[str, list[str]] = dataclasses.field(default_factory=dict)
    captions: tuple[str, ...] = ()
    own: bool = False
    passing: Path | None = None


class Job:
    """Work that a process of its own does, and what that has said so far."""

    def __init__(self, work: Work, folder: str | Path) -> None:
        """Start it; OSError where that cannot be done. `folder` is where it writes to."""
        self.folder, self.title, self.work = Path(folder), work.title, work
        self.done, self.total, self.when = 0, 0, time.monotonic()
        self.left: float | None = None
        self.files: list[Path] = []
        self.problem, self.cancelled = "", False
        self.notes: list[str] = []  # sentences about what it renders
        self.code: int | None = None
        record = {
            "requests": {name: request.record() for name, request in work.requests.items()},
            "folder": str(folder),
            "joined": work.joined,
            "compared": work.compared,
            "captions": work.captions,
        }
        module, words = ("__main__", work.words) if work.words else ("command.job", [json.dumps(record)])
        self.process = second_blender(module, words, binary=bpy.app.binary_path, stdout=subprocess.PIPE)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            if line.startswith("nimray: "):
                self.notes += [self.problem] if self.problem else []
                self.problem = line.removeprefix("nimray: ").strip()
            elif line.startswith("{"):
                try:
                    said = json.loads(line)
                except ValueError:
                    continue
                if "files" in said:
                    self.files = [Path(file) for file in said["files"]]
                elif "done" in said:
                    self.done, self.total, self.left = said["done"], said["total"], said["left"]
                    self.when = time.monotonic()

    @property
    def running(self) -> bool:
        """Whether it is under way, as of the last look()."""
        return self.code is None

    def look(self) -> bool:
        """See whether it has ended; returns `running`."""
        if self.running and self.process.poll() is not None:
            self.reader.join(PATIENCE)
            self.code = self.process.returncode
            self.process.stdin.close()
            if self.code not in REFUSED and self.problem:  # its last sentence is no reason why it ended
                self.notes.append(self.problem)
                self.problem = ""
            if self.code and not self.problem:
                self.problem = pgettext_rpt("The render ended without a word (exit code {}).").format(self.code)
            if self.cancelled:
                self.problem = ""
            if self.work.passing:
                shutil.rmtree(self.work.passing, ignore_errors=True)
        return self.running

    def cancel(self) -> None:
        """End it, and wait until it has."""
        if not self.running:
            return
        self.cancelled = True
        processes.end(self.process, PATIENCE)
        self.look()

    def progress(self) -> tuple[float, float | None]:
        """How much is done, 0 to 1, and the seconds left or None: between two reports, rare ones, it goes by the clock."""
        part = self.done / self.total if self.total else 0.0
        if self.left is None:
            return part, None
        passed = min((time.monotonic() - self.when) / max(self.left, 0.1), 1.0)
        return part + (1 - part) * passed, self.left * (1 - passed)

    def text(self) -> str:
        """How far it is, in words."""
        part, left = self.progress()
        if not self.total:
            return pgettext_iface("Starting")
        if left is None:
            return f"{part:.0%}"
        return pgettext_iface("{}, {} left").format(f"{part:.0%}", duration(left))


# The job under way, or the last one of this session.
_job: Job | None = None


def job() -> Job | None:
    """The Job under way, or the last one, or None."""
    return _job


def start(work: Work, folder: str | Path) -> Job:
    """Start a Job and the timer that looks after it; OSError where it cannot be started."""
    global _job
    _job = Job(work, folder)
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=INTERVAL, persistent=True)
    return _job


def end() -> None:
    """End the job, if there is one."""
    if _job:
        _job.cancel()


def tick() -> float | None:
    """Look after the job, as a timer: show how far it is, and ask to be called again while it runs."""
    running = _job is not None and _job.look()
    status = f"{_job.title}: {_job.text()}" if running else None
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(status)
    if not running:
        _clear_status()
        if _job is not None and _job.work.own:
            _show_where_open(_job)
    _redraw()
    return INTERVAL if running else None


def _clear_status():
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(None)


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


# ------------------------------------------------------------------------------------------------ operators


def output_folder() -> Path:
    """Where renders go: the folder of the preferences, else "renders" beside the .blend file or in the home folder."""
    chosen = preferences.settings().folder
    if chosen:
        return Path(bpy.path.abspath(chosen))
    return (Path(bpy.data.filepath).parent if bpy.data.filepath else Path.home()) / "renders"


def free_name(folder: Path, name: str) -> str:
    """`name`, or name_2, name_3... where `folder` holds images of that name."""
    number, free = 1, name
    while any((folder / f"{free}.{suffix}").exists() for suffix in ("exr", "png")):
        number += 1
        free = f"{name}_{number}"
    return free


def request_of(settings: NIM_PG_scenes) -> Request:
    """The render that the settings ask for; ValueError, one sentence, where they clash."""
    samples, backend = samples_of(settings)[0], backend_of(settings)
    parameters = parameters_of(settings)
    size, spectral = size_of(settings), settings.spectral
    return Request(settings.scene, parameters, size=size, samples=samples, backend=backend, spectral=spectral)


def size_of(settings: NIM_PG_scenes) -> tuple[int, int]:
    """Pixels of the picture that the settings ask for, (width, height)."""
    percent = samples_of(settings)[1]
    width, height = SCENES[settings.scene].size
    return max(1, round(width * percent / 100)), max(1, round(height * percent / 100))


def one_render(settings: NIM_PG_scenes, folder: Path) -> Work:
    """What renders the scene as the settings have it, under a name that is free in the folder."""
    request = request_of(settings)
    name = free_name(folder, request.name)
    return Work(name, {name: request})


def free(operator: type[bpy.types.Operator]) -> bool:
    """For a poll: whether no job is under way; if one is, the operator's class is told so."""
    if _job and _job.running:
        operator.poll_message_set("A render is under way; wait for it, or cancel it")
        return False
    return True


class Start:
    """What the operators that start a job share."""

    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return free(cls) and scenes.ready(cls, context)

    def start(self, work_of):
        folder = output_folder()
        try:
            work = work_of(bpy.context.scene.nim_scenes, folder)
            start(work, folder)
        except ValueError as error:
            return fail(self, str(error))
        except OSError as error:
            return fail(self, pgettext_rpt("A second Blender could not be started: {}").format(error))
        self.report({"INFO"}, pgettext_rpt("Rendering {} in the background").format(work.title))
        return {"FINISHED"}


class NIM_OT_render_headless(Start, bpy.types.Operator):
    """Render the example scene with these settings in a second Blender without a window, while this one stays free"""

    bl_idname = "nim.render_headless"
    bl_label = "Render Example in the Background"

    @classmethod
    def description(cls, context, properties):
        settings = context.scene.nim_scenes
        (width, height), samples = size_of(settings), samples_of(settings)[0]
        text = pgettext_iface(
            "Render the example scene {name} with these settings, whatever stands in the view: {width} x {height} pixels, "
            "{samples} samples. A second Blender without a window does it, while this one stays free"
        )
        name = pgettext_iface(scenes.title_of(settings.scene))
        return text.format(name=name, width=width, height=height, samples=samples)

    def execute(self, context):
        return self.start(one_render)


class NIM_OT_cancel_render(bpy.types.Operator):
    """End the render in the background; no half image is left"""

    bl_idname = "nim.cancel_render"
    bl_label = "Cancel"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if not (_job and _job.running):
            cls.poll_message_set("No render in the background is under way")
            return False
        return True

    def execute(self, context):
        end()
        self.report({"INFO"}, pgettext_rpt("Cancelled {}").format(_job.title))
        return {"FINISHED"}


class _OfResult:
    """What the operators that show what a job has made share."""

    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if not (_job and _job.files):
            cls.poll_message_set("No render in the background has been finished yet")
            return False
        return True


class NIM_OT_open_result(_OfResult, bpy.types.Operator):
    """Show the finished image in an Image editor"""

    bl_idname = "nim.open_result"
    bl_label = "Open Result"

    def execute(self, context):
        file = next(file for file in reversed(_job.files) if file.suffix in (".png", ".exr"))  # a sweep has others
        if not file.is_file():
            return fail(self, pgettext_rpt("There is no {} any more; was it moved?").format(file))
        image = bpy.data.images.load(str(file), check_existing=True)
        image.reload()
        if not bpy.app.background:
            _image_editor(context).image = image
        self.report({"INFO"}, pgettext_rpt("Opened {}").format(file))
        return {"FINISHED"}


def _show_where_open(job):
    """Show the last picture of a job that has ended in an Image editor that is open; a window of its own would be in the way."""
    picture = next((file for file in reversed(job.files) if file.suffix == ".png"), None)
    space = _open_image_editor(bpy.context)
    if job.code == 0 and picture and picture.is_file() and space:
        space.image = bpy.data.images.load(str(picture), check_existing=True)
        space.image.reload()


def _open_image_editor(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == "IMAGE_EDITOR":
                return area.spaces.active
    return None


def _image_editor(context):
    """The Image editor on the screen, or one in a new window."""
    if space := _open_image_editor(context):
        return space
    bpy.ops.wm.window_new()
    area = context.window_manager.windows[-1].screen.areas[0]
    area.ui_type = "IMAGE_EDITOR"
    return area.spaces.active


class NIM_OT_open_folder(_OfResult, bpy.types.Operator):
    """Open the folder of the pictures in the file browser of this system"""

    bl_idname = "nim.open_folder"
    bl_label = "Open Folder"

    def execute(self, context):
        try:
            bpy.ops.wm.path_open(filepath=str(_job.folder))
        except (RuntimeError, OSError):
            return fail(self, pgettext_rpt("The folder {} cannot be opened.").format(_job.folder))
        self.report({"INFO"}, pgettext_rpt("Opened {}").format(_job.folder))
        return {"FINISHED"}


# ------------------------------------------------------------------------------------------------ the panel


class NIM_PT_jobs(Sidebar, bpy.types.Panel):
    """Renders in the background: start, progress, result."""

    bl_idname = "NIM_PT_jobs"
    bl_label = "Render the Example"
    page = "scenes#render-the-example"
    bl_parent_id = "NIM_PT_scenes"

    def draw(self, context):
        layout = self.layout
        name = pgettext_iface(scenes.title_of(context.scene.nim_scenes.scene))
        text = pgettext_iface("Render {}").format(name)
        layout.operator("nim.render_headless", text=text, icon="RENDER_STILL", translate=False)
        if _job is not None and not _job.work.own:
            draw(layout, context, _job)


def draw(layout: bpy.types.UILayout, context: bpy.types.Context, job: Job) -> None:
    """Draw how far a job is, or what it has made."""
    box = layout.box()
    if job.running:
        box.label(text=job.title, translate=False)
        row = box.row(align=True)
        row.progress(factor=job.progress()[0], text=job.text())
        row.operator("nim.cancel_render", text="", icon="X")
    elif job.cancelled:
        box.label(text="Cancelled", icon="X")
    elif job.problem:
        draw_sentence(box, context, job.problem, "ERROR")
    if job.files:
        box.label(text=job.files[-1].name, icon="CHECKMARK", translate=False)
        row = box.row(align=True)
        row.operator("nim.open_result", icon="IMAGE_DATA")
        row.operator("nim.open_folder", icon="FILE_FOLDER")
    for note in job.notes[:NOTED]:
        draw_sentence(box, context, note, "INFO")
    if len(job.notes) > NOTED:
        box.label(text=pgettext_iface("{} more").format(len(job.notes) - NOTED), translate=False)


CLASSES = (
    NIM_OT_render_headless,
    NIM_OT_cancel_render,
    NIM_OT_open_result,
    NIM_OT_open_folder,
    *scenes.open_and_folded(NIM_PT_jobs),
)


def register():
    """See to it that no job outlives this Blender."""
    atexit.register(end)


def unregister():
    """End the job and its timer."""
    global _job
    end()
    _job = None
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
        _clear_status()
    atexit.unregister(end)

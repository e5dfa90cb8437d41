# SPDX-License-Identifier: GPL-3.0-or-later
"""A person's own scene, as it is, rendered in a second Blender: `nimray render` of a copy of the file."""

from __future__ import annotations

import os
import re
import tempfile
import textwrap
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import checks
from ..base.streams import quiet
from ..base.text import fit
from ..caustics import frames
from ..renders import simulated
from ..renders.request import can_denoise
from . import escape, jobs
from .help import fail
from .panels import Sidebar, draw_sentence

UNSET = ("", "/tmp", "/tmp\\")  # the output path of a scene that nobody has given one
NAMED = 4  # problems that are named before a render
LETTERS = 70  # of a line that names one
BY_CYCLES = "Cycles renders it, since {engine} cannot bend a ray backwards. The scene keeps {engine}."


class NIM_PG_render(bpy.types.PropertyGroup):
    """How a scene is rendered in the background: Scene.nim_render."""

    keep: bpy.props.BoolProperty(
        name="Keep the .blend",
        description="Leave the copy that is rendered beside its pictures, which can then be repeated from it",
        default=False,
    )


def place_of(scene: bpy.types.Scene) -> tuple[Path, str]:
    """Where the pictures of a scene go, and what they are called: by its output path, else by the preferences and the file."""
    path = scene.render.filepath
    usual = fit(Path(bpy.data.filepath).stem).lstrip("- ").rstrip(". ") or "untitled"
    if path.rstrip("/") in UNSET:
        return jobs.output_folder(), usual
    if "{" in path:  # of 5.0: variables that Blender itself fills in
        path = re.sub(r"0001(?=\.\w+$)", "", scene.render.frame_path(frame=1))
    # beside a file that is not saved is nowhere
    whole = Path(bpy.path.abspath(path, start=bpy.path.abspath("//") or str(jobs.output_folder())))
    if path.endswith(("/", "\\")):
        return whole, usual
    name = whole.stem if whole.suffix.lower() in bpy.path.extensions_image else whole.name
    return whole.parent, fit(name.replace("#", "")).strip("_-. ") or usual


def short(path: Path) -> str:
    """A path as a person finds it: from the folder of the .blend on, as Blender writes it, //, or from the home folder, ~."""
    starts = {"~/": Path(os.path.expanduser("~"))}
    if bpy.data.filepath:
        starts = {"//": Path(bpy.data.filepath).parent, **starts}
    for sign, start in starts.items():
        if path.is_relative_to(start):
            return sign + path.relative_to(start).as_posix()
    return str(path)


def free_name(folder: Path, name: str) -> str:
    """`name`, or name_2, name_3... where the folder has a picture, frames or a .blend of that name."""
    number, free = 1, name
    while _is_taken(folder, free):
        number += 1
        free = f"{name}_{number}"
    return free


def _is_taken(folder, name):
    if any((folder / f"{name}.{suffix}").exists() for suffix in ("exr", "png", "blend")):
        return True
    frame = re.compile(re.escape(name) + r"_\d{4,}\.(exr|png)")
    return folder.is_dir() and any(frame.fullmatch(file.name) for file in folder.iterdir())


def save_copy(file: Path) -> None:
    """Save the open file, with all that is not saved yet, as `file`; it stays what it is. OSError where that cannot be."""
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        with frames.found_from_anywhere(), quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True, compress=True, relative_remap=True)
        if bpy.data.filepath:
            simulated.bring(Path(bpy.data.filepath), file)
    except RuntimeError as error:
        raise OSError(" ".join(str(error).split())) from None


def work_of(scene: bpy.types.Scene, animation: bool) -> tuple[jobs.Work, Path]:
    """What renders the scene at its frame, or over its range, and the folder it goes to; ValueError, one sentence."""
    moments = []
    if animation:
        first, last = scene.frame_start, scene.frame_end
        moments = ["--frames", f"{first}-{last}", "--step", str(scene.frame_step)]
    folder, name = place_of(scene)
    name = free_name(folder, name)
    keep = scene.nim_render.keep
    copies = folder if keep else Path(tempfile.mkdtemp(prefix="nim_render_", dir=bpy.app.tempdir))
    copy = copies / f"{name}.blend"
    save_copy(copy)
    chosen = f"--scene={scene.name}"  # in one word, as a name may begin like an option
    words = ["render", str(copy), chosen, "--out", str(folder), "--name", name, *moments, "--progress"]
    return jobs.Work(name, words=tuple(words), own=True, passing=None if keep else copies), folder


def unsaved_images() -> list[str]:
    """The names of images that were painted and are neither saved nor packed: a copy of the file has them as they were."""
    return [image.name for image in bpy.data.images if image.is_dirty and image.users and not image.packed_files]


class NIM_OT_render_scene(bpy.types.Operator):
    """Render this scene as it is, with all that is not saved yet, in a second Blender, while this one stays free. Esc ends it"""

    bl_idname = "nim.render_scene"
    bl_label = "Render Scene in the Background"
    bl_options = {"REGISTER"}

    animation: bpy.props.BoolProperty(
        name="Animation", description="All frames of the scene's range", default=False, options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, context, properties):
        scene = context.scene
        folder, name = place_of(scene)
        text = (
            "Render frames {first} to {last} of this scene in a second Blender, while this one stays free, to {file}. It "
            "is rendered as it is, with all that is not saved yet. Esc ends it"
            if properties.animation
            else "Render frame {frame} of this scene in a second Blender, while this one stays free, to {file}. It is "
            "rendered as it is, with all that is not saved yet. Esc ends it"
        )
        frames = {"first": scene.frame_start, "last": scene.frame_end, "frame": scene.frame_current}
        return pgettext_iface(text).format(**frames, file=folder / name)

    @classmethod
    def poll(cls, context):
        scene = context.scene
        if scene.camera is None:
            cls.poll_message_set("This scene has no camera; add one, and make it the scene's")
        else:
            return jobs.free(cls)
        return False

    def invoke(self, context, event):
        # that another engine is chosen the panel says; Cycles renders it all the same
        wrong = [problem for problem in checks.problems(context.scene) if problem.code != "engine"]
        self.found = [checks_text(problem) for problem in wrong]
        text = pgettext_iface("{} was painted and is not saved: the copy has it as it was. Save or pack it.")
        self.found += [text.format(name) for name in unsaved_images()]
        if context.scene.cycles.use_denoising and not can_denoise():
            text = "The scene is denoised, and this Blender was built without OpenImageDenoise: the picture keeps its noise."
            self.found.append(pgettext_iface(text))
        if not self.found or bpy.app.background:
            return self.execute(context)
        title = pgettext_iface("The Checks Find Something")
        return context.window_manager.invoke_props_dialog(
            self, width=480, title=title, confirm_text=pgettext_iface("Render All the Same")
        )

    def draw(self, context):
        """Draw what the checks find, in the dialog before the render."""
        column = self.layout.column(align=True)
        for sentence in self.found[:NAMED]:
            for number, line in enumerate(textwrap.wrap(sentence, LETTERS)):
                column.label(text=line, icon="BLANK1" if number else "ERROR", translate=False)
        if len(self.found) > NAMED:
            column.label(text=pgettext_iface("{} more").format(len(self.found) - NAMED), translate=False)

    def execute(self, context):
        try:
            work, folder = work_of(context.scene, self.animation)
            job = jobs.start(work, folder)
        except ValueError as error:
            return fail(self, str(error))
        except OSError as error:
            return fail(self, pgettext_rpt("The render could not be started: {}").format(error))
        escape.listen(escape.Listening(lambda: jobs.job() is job and job.running, jobs.end))
        said = pgettext_rpt("Rendering {} in the background").format(work.title)
        if context.scene.render.engine != "CYCLES":
            said += ". " + pgettext_rpt(BY_CYCLES).format(engine=checks.engine_name(context.scene))
        self.report({"INFO"}, said)
        return {"FINISHED"}


def checks_text(problem: checks.Problem) -> str:
    """The sentence of a checks.Problem in the language of this Blender."""
    return " ".join(pgettext_iface(text) for text in problem.texts).format(**problem.values)


class NIM_PT_render(Sidebar, bpy.types.Panel):
    """This scene as it is, rendered in a second Blender"""

    bl_idname = "NIM_PT_render"
    bl_label = "Render in the Background"
    page = "own-scene#render-in-the-background"
    bl_order = 35
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        scene = context.scene
        draw_buttons(layout.column(align=True), scene)
        if scene.render.engine != "CYCLES":
            draw_sentence(layout, context, pgettext_iface(BY_CYCLES).format(engine=checks.engine_name(scene)), "INFO")
        folder, name = place_of(scene)
        # what is too long Blender shortens, in the middle
        layout.label(text=short(folder / name), icon="FILE_FOLDER", translate=False)
        layout.prop(scene.nim_render, "keep")
        job = jobs.job()
        if job and job.work.own:
            jobs.draw(layout, context, job)


def draw_buttons(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw what renders the frame that is shown, and what renders them all."""
    layout.operator("nim.render_scene", text="Render Image", icon="RENDER_STILL")
    layout.operator("nim.render_scene", text="Render Animation", icon="RENDER_ANIMATION").animation = True


def _menu(self, _context):
    self.layout.separator()
    # the search finds them by the word of those who know it, too
    for text, icon, animation in (
        ("Render Image in the Background (Headless)", "RENDER_STILL", False),
        ("Render Animation in the Background (Headless)", "RENDER_ANIMATION", True),
    ):
        self.layout.operator("nim.render_scene", text=text, icon=icon).animation = animation


CLASSES = (NIM_PG_render, NIM_OT_render_scene, NIM_PT_render)


def register():
    """Let scenes say how they are rendered in the background, and be so from the Render menu."""
    bpy.types.Scene.nim_render = bpy.props.PointerProperty(
        type=NIM_PG_render,
        name="Render in the Background",
        description="How this scene is rendered in a second Blender",
    )
    bpy.types.TOPBAR_MT_render.append(_menu)


def unregister():
    """Take both back."""
    bpy.types.TOPBAR_MT_render.remove(_menu)
    del bpy.types.Scene.nim_render

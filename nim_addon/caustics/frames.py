# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of an animation: what was traced at each frame, kept in a folder, a file a frame, and put in as the frame changes.

The scene remembers the folder and how it was traced. A file holds the sums of what landed (Bake.save()), with a mark of the
scene at its frame: copies and textures are made of it anew, of the scene as it is then, or it is told to be of another.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import bpy

from .baking import MILLION, PHOTONS, REPORT, ROUND_PHOTONS, Bake, out_of_date
from .placing import baked, clear

# custom properties, of files that people have: they keep their names
KEPT = "nim_caustics_frames"  # of a scene: the fields of Frames
FRAME = "nim_caustics_frame"  # of the collection of the caustics: the frame that they are of

_paused = 0


class Frames(NamedTuple):
    """Where the caustics of the frames of a scene are kept, and how they are traced, as Bake has it.

    folder: a path, // of the file's own folder
    """

    folder: str
    photons: int
    texels: int
    seed: int = 0
    most: int = ROUND_PHOTONS

    def file(self, frame: int) -> Path:
        """That of a frame."""
        return Path(bpy.path.abspath(self.folder)) / f"{frame:04}.npz"

    def bake(self, scene: bpy.types.Scene) -> Bake:
        """The Bake of a scene, at its frame; raises as Bake does."""
        return Bake(scene, photons=self.photons, texels=self.texels, seed=self.seed, most=self.most)

    def keep(self, scene: bpy.types.Scene) -> None:
        """Let a scene remember this."""
        scene[KEPT] = self._asdict()


def frames_of(scene: bpy.types.Scene) -> Frames | None:
    """The Frames that a scene remembers, None where it has none, or what it has is of another version or of a script."""
    kept = scene.get(KEPT)
    try:
        values = kept.to_dict()
        return Frames(str(values.pop("folder")), **{name: int(value) for name, value in values.items()})
    except (AttributeError, KeyError, TypeError, ValueError):
        return None


def kept(scene: bpy.types.Scene, numbers: Iterable[int]) -> tuple[int, int] | None:
    """How many of those frames a folder has caustics of, and how many they are; None where the scene remembers none."""
    frames = frames_of(scene)
    if frames is None:
        return None
    folder, numbers = frames.file(0).parent, list(numbers)
    names = {file.name for file in folder.iterdir()} if folder.is_dir() else set()
    return sum(frames.file(number).name in names for number in numbers), len(numbers)


def forget_frames(scene: bpy.types.Scene) -> None:
    """Let a scene have no caustics of frames any more; the files stay."""
    if KEPT in scene:
        del scene[KEPT]


def beside(scene: bpy.types.Scene, folder: Path) -> None:
    """Let what a scene of another file remembers, which lies in that folder, be found from this file."""
    if frames := frames_of(scene):
        frames._replace(folder=bpy.path.abspath(frames.folder, start=str(folder))).keep(scene)


@contextlib.contextmanager
def found_from_anywhere() -> Iterator[None]:
    """Within, the folders that the scenes of this file remember are whole paths, as a copy of it elsewhere must have them."""
    former = {scene: frames for scene in bpy.data.scenes if not scene.library and (frames := frames_of(scene))}
    for scene in former:
        beside(scene, Path(bpy.path.abspath("//")))
    try:
        yield
    finally:
        for scene, frames in former.items():
            frames.keep(scene)


def in_the_dark(scene: bpy.types.Scene) -> bool:
    """Whether nothing of a scene that remembers Frames can be traced at its frame, which is kept of none then."""
    frames = frames_of(scene)
    try:
        if frames:
            with frames.bake(scene):
                pass
    except ValueError:
        return True
    return False


def wanted(scene: bpy.types.Scene) -> tuple[int, int | None] | None:
    """The photons, and the edge of the largest texture, that a person had a scene traced with, where that is out of date.

    None where its caustics are of the scene as it is, or nobody asked for any.
    """
    frames, collection = frames_of(scene), baked(scene)
    if collection is not None and not out_of_date(scene):
        return None
    if frames:
        return frames.photons, frames.texels
    if collection is None:
        return None
    report = report_of(collection)
    if report.get("settings"):  # empty where the bake was stopped before its end
        return int(report["settings"][0]) * MILLION, int(report["settings"][1])
    # a script says nothing of itself, an early version little
    return max(1, round(report.get("photons", PHOTONS))), None


def report_of(collection: bpy.types.Collection | None) -> dict[str, Any]:
    """What is known of how caustics were baked, as REPORT has it, what a script or an early version left out left out."""
    report = collection.get(REPORT) if collection else None
    try:
        return report.to_dict()
    except AttributeError:  # None, or of a script
        return {}


@contextlib.contextmanager
def as_they_are() -> Iterator[None]:
    """Within, a change of the frame leaves the caustics of a scene as they are."""
    global _paused
    _paused += 1
    try:
        yield
    finally:
        _paused -= 1


def _follows(scene):
    """The Frames of a scene whose caustics are to be of its frame, and are not; else None."""
    frames, there = frames_of(scene), baked(scene)
    return None if _paused or (there and there.get(FRAME) == scene.frame_current) else frames


def let_go(scene: bpy.types.Scene) -> None:
    """Take the caustics of another frame out of a scene that remembers Frames, before its new frame is evaluated.

    Afterwards what was evaluated would name data that is gone, of which Blender falls over.
    """
    if _follows(scene) and baked(scene):
        clear(scene)
        for view in scene.view_layers:
            view.update()


def follow(scene: bpy.types.Scene) -> bool:
    """Let a scene that remembers Frames have the caustics of its frame, or none; returns whether it has those.

    What is kept of another shape, place, medium or light than the scene has at the frame is not put in.
    """
    frames, frame = _follows(scene), scene.frame_current
    if frames is None:
        return not _paused and frames_of(scene) is not None
    let_go(scene)
    with as_they_are():
        try:
            with frames.bake(scene) as bake:
                whole = frames.file(frame).is_file() and bake.load(frames.file(frame)) and bake.done == bake.total
                if whole:
                    bake.put()
        except ValueError:  # nothing is left to trace
            whole = False
    if not whole:
        clear(scene)
        return False
    collection = baked(scene)
    assert collection
    collection[FRAME] = frame
    return True

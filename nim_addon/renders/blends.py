# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of a .blend file, to be rendered while another file is open, which stays as it is."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy

from ..base.streams import quiet
from ..base.text import nearest
from . import simulated
from .external import files_of, sha256_of

NAMED = "scenes", "objects", "materials", "collections", "worlds"  # kinds of data whose names people are told
ZSTD = b"\x28\xb5\x2f\xfd"  # the first bytes of a compressed file


@dataclass(frozen=True)
class Blend:
    """A scene of a .blend file as it is now.

    file:      the file's path
    scene:     name of the scene
    sha256:    of the file's content, in hexadecimal
    files:     (path, mark) of what the scene needs beside it, as external.files_of() has them; empty until it is read
    """

    file: str
    scene: str
    sha256: str
    files: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, file: str | Path, scene: str | None = None) -> Blend:
        """That of a file, whose only scene it is where no name is given. Raises ValueError, one sentence, where it is not."""
        path = Path(file).expanduser()
        if not path.is_file():
            raise ValueError(f"there is no file {path}.")
        path = path.resolve()
        if bpy.data.filepath and Path(bpy.data.filepath).resolve() == path:
            raise ValueError(f"{path} is open in this Blender, which takes no scene out of it; render a copy of it.")
        names = _scenes_of(path)
        listed = ", ".join(map(repr, names))
        if scene is None and len(names) > 1:
            raise ValueError(f"{path} has the scenes {listed}; name one of them.")
        if scene is not None and scene not in names:
            near = nearest(scene, names)
            hint = f"did you mean {near!r}? It has" if near else "it has"
            raise ValueError(f"{path} has no scene {scene!r}; {hint} {listed}.")
        return cls(str(path), scene or names[0], sha256_of(path))

    @classmethod
    def from_record(cls, record: Mapping[str, object]) -> Blend:
        """That of record(), whose file must still be as it was; ValueError, one sentence, where it is not."""
        file, scene, sha256 = texts = [record.get(key) for key in ("file", "scene", "sha256")]
        files = record.get("files", record.get("libraries", {}))  # of an earlier image, which knew of no others
        unknown = set(record) - {"file", "scene", "sha256", "files", "libraries"}
        texts += [*files, *files.values()] if isinstance(files, Mapping) else [None]
        if unknown or not all(isinstance(text, str) for text in texts):
            raise ValueError(f"blend = {record!r} is not understood; it has file, scene and sha256.")
        blend = cls.of(str(file), str(scene))
        if blend.sha256 != sha256:
            raise _changed(blend.file)
        return replace(blend, files=tuple(sorted(files.items())))  # pyright: ignore[reportAttributeAccessIssue]

    def record(self) -> dict[str, object]:
        """A dict of JSON-ready values that from_record() takes back."""
        own: dict[str, object] = {"file": self.file, "scene": self.scene, "sha256": self.sha256}
        return {**own, "files": dict(self.files)} if self.files else own

    def append(self, give_way: Callable[[bpy.types.ID], None] = lambda data: None) -> bpy.types.Scene:
        """Bring a copy of the scene into Blender's file, which becomes no other.

        give_way: called with what of the open file has a name that sentences say of the other; it would be numbered there
        Raises ValueError, one sentence, where the file, or one of those that it is known to need, has changed.
        """
        self.from_record(self.record())
        with quiet(), _opened(Path(self.file)) as (held, wanted):
            for kind in NAMED:
                names = set(getattr(held, kind))
                for same in [data for data in getattr(bpy.data, kind) if data.name in names and not data.library]:
                    give_way(same)
            wanted.scenes.append(self.scene)
        scene = wanted.scenes[0]  # where names stood there is data now
        simulated.find_beside(scene, Path(self.file))
        now = dict(files_of(scene)) if self.files else {}
        for file, mark in self.files:
            if now.get(file) != mark:
                raise _changed(file, then=mark, now=now.get(file, ""))
        return scene


def _changed(file, then="there", now="there"):
    if not now:
        return ValueError(f"{file} is missing, which was there when the picture was asked for; put it back.")
    if not then:
        return ValueError(f"{file} was missing when the picture was asked for, and is there now; render it anew.")
    if "*" in Path(file).name:
        return ValueError(
            f"{file} are other files than those that were asked for: names, sizes or times of change differ; render it anew."
        )
    return ValueError(f"{file} is another file than the one that was asked for: its content has changed.")


def _opened(path) -> AbstractContextManager[tuple[Any, Any]]:
    """What the file holds, and what of it shall be appended, as bpy.data.libraries.load() has them."""
    return bpy.data.libraries.load(str(path), link=False)  # pyright: ignore[reportReturnType] of which the stubs say None


def _scenes_of(path):
    try:
        with quiet(), quiet(2), _opened(path) as (held, _):
            names = list(held.scenes)
    except (OSError, RuntimeError):
        names = []
    if not names:
        if later := newer(path):
            this = ".".join(map(str, bpy.app.version[:2]))
            raise ValueError(f"{path} was saved by Blender {later}, which this one, {this}, cannot read; use {later}.")
        raise ValueError(f"{path} is not a Blender file with a scene in it.")
    return names


def newer(path: Path) -> str | None:
    """The version of the Blender that saved a file, "5.2", where its head has one that is later than this; else None."""
    with path.open("rb") as stream:
        head = stream.read(4)
    if head == ZSTD:  # compressed, which Python cannot read by itself
        try:
            import zstandard  # pyright: ignore[reportMissingImports]  Blender brings it along

            with path.open("rb") as stream, zstandard.ZstdDecompressor().stream_reader(stream) as plain:
                head = plain.read(17)
        except (ImportError, OSError, zstandard.ZstdError):
            return None
    else:
        with path.open("rb") as stream:
            head = stream.read(17)
    # BLENDER-v405 until 4.5, BLENDER17-01v0500 from 5.0 on
    found = re.match(rb"BLENDER(?:\d\d-\d\dv0?(\d+)(\d\d)|[-_][vV](\d)(\d\d))", head)
    version = tuple(int(number) for number in found.groups() if number) if found else ()
    return ".".join(map(str, version)) if version > bpy.app.version[:2] else None

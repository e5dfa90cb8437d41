# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of a .blend file, to be rendered while another file is open, which stays as it is."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy

from ..base.streams import quiet
from ..base.text import nearest

ZSTD = b"\x28\xb5\x2f\xfd"  # the first bytes of a compressed file


@dataclass(frozen=True)
class Blend:
    """A scene of a .blend file as it is now.

    file:      the file's path
    scene:     name of the scene
    sha256:    of the file's content, in hexadecimal
    libraries: (path, sha256) of the files that the scene is linked from, as libraries_of() has them; empty until it is read
    """

    file: str
    scene: str
    sha256: str
    libraries: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, file: str | Path, scene: str | None = None) -> Blend:
        """That of a file, whose only scene it is where no name is given. Raises ValueError, one sentence, where it is not."""
        path = Path(file).expanduser()
        if not path.is_file():
            raise ValueError(f"there is no file {path}.")
        path = path.resolve()
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
        libraries = record.get("libraries", {})
        unknown = set(record) - {"file", "scene", "sha256", "libraries"}
        texts += [*libraries, *libraries.values()] if isinstance(libraries, Mapping) else [None]
        if unknown or not all(isinstance(text, str) for text in texts):
            raise ValueError(f"blend = {record!r} is not understood; it has file, scene and sha256.")
        blend = cls.of(str(file), str(scene))
        if blend.sha256 != sha256:
            raise _changed(blend.file)
        return replace(blend, libraries=tuple(sorted(libraries.items())))  # pyright: ignore[reportAttributeAccessIssue]

    def record(self) -> dict[str, object]:
        """A dict of JSON-ready values that from_record() takes back."""
        own: dict[str, object] = {"file": self.file, "scene": self.scene, "sha256": self.sha256}
        return {**own, "libraries": dict(self.libraries)} if self.libraries else own

    def append(self) -> bpy.types.Scene:
        """Bring a copy of the scene into Blender's file, which becomes no other.

        Raises ValueError, one sentence, where the file, or one of the libraries that are known, has changed.
        """
        self.from_record(self.record())
        with quiet(), _opened(Path(self.file)) as (_, wanted):
            wanted.scenes.append(self.scene)
        scene = wanted.scenes[0]  # where names stood there is data now
        now = dict(libraries_of(scene))
        for file, sha256 in self.libraries:
            if now.get(file) != sha256:
                raise _changed(file)
        return scene


def _changed(file):
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


def libraries_of(scene: bpy.types.Scene) -> tuple[tuple[str, str], ...]:
    """(path, SHA-256) of the files that a scene is linked from, and those are in turn, sorted; "" for one that is missing."""
    libraries = {data.library for data in used_by(scene) if data.library}
    # of 5.0: one whose content lies in the file itself
    outside = [one for one in libraries if not one.packed_file and not getattr(one, "is_archive", False)]
    paths = sorted(bpy.path.abspath(one.filepath) for one in outside)
    return tuple((path, sha256_of(Path(path)) if Path(path).is_file() else "") for path in paths)


def missing_files(scene: bpy.types.Scene) -> list[str]:
    """What a scene needs that is not there: the paths of linked libraries, images and fonts, sorted."""
    needed = used_by(scene)
    kinds = bpy.types.Image, bpy.types.VectorFont
    owners = {data.library for data in needed if data.library} | {data for data in needed if isinstance(data, kinds)}
    lacking = set()
    for owner in owners:
        paths = [owner.filepath] if owner.filepath else []
        if isinstance(owner, bpy.types.Image):
            if owner.source not in ("FILE", "SEQUENCE", "MOVIE", "TILED") or owner.packed_files:
                continue
            if owner.source == "TILED":  # a file for each tile
                paths = [owner.filepath.replace("<UDIM>", str(tile.number)) for tile in owner.tiles]
        elif owner.filepath == "<builtin>" or getattr(owner, "packed_file", None):
            continue
        full = [bpy.path.abspath(path, library=owner.library) for path in paths]
        lacking.update(path for path in full if not Path(path).is_file())
    return sorted(lacking)


def used_by(scene: bpy.types.Scene) -> set[bpy.types.ID]:
    """All that a scene needs, by way of whatever: objects, what a collection puts in, materials, images."""
    users = bpy.data.user_map()
    uses: dict[Any, list] = {}
    for used, those in users.items():
        for user in those:
            uses.setdefault(user, []).append(used)
    seen: set[bpy.types.ID] = {scene}
    queue: list[bpy.types.ID] = [scene]
    while queue:
        data = queue.pop()
        for used in uses.get(data, ()):
            if used not in seen and not isinstance(used, bpy.types.Scene):
                seen.add(used)
                queue.append(used)
    return seen


def sha256_of(path: Path) -> str:
    """Of a file's content, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

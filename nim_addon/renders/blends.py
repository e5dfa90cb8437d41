# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of a .blend file, to be rendered while another file is open, which stays as it is."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ..base.streams import quiet


@dataclass(frozen=True)
class Blend:
    """A scene of a .blend file as it is now.

    file:   the file's path
    scene:  name of the scene
    sha256: of the file's content, in hexadecimal
    """

    file: str
    scene: str
    sha256: str

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
            raise ValueError(f"{path} has no scene {scene!r}; it has {listed}.")
        return cls(str(path), scene or names[0], sha256_of(path))

    @classmethod
    def from_record(cls, record: Mapping[str, object]) -> Blend:
        """That of record(), whose file must still be as it was; ValueError, one sentence, where it is not."""
        file, scene, sha256 = (record.get(key) for key in ("file", "scene", "sha256"))
        if set(record) != {"file", "scene", "sha256"} or not all(isinstance(text, str) for text in record.values()):
            raise ValueError(f"blend = {record!r} is not understood; it has file, scene and sha256.")
        blend = cls.of(str(file), str(scene))
        if blend.sha256 != sha256:
            raise ValueError(f"{blend.file} is another file than the one that was asked for: its content has changed.")
        return blend

    def record(self) -> dict[str, str]:
        """A dict of JSON-ready values that from_record() takes back."""
        return {"file": self.file, "scene": self.scene, "sha256": self.sha256}

    def append(self) -> bpy.types.Scene:
        """Bring a copy of the scene into Blender's file, which becomes no other; ValueError where the file has changed."""
        self.from_record(self.record())
        with quiet(), _opened(Path(self.file)) as (_, wanted):
            wanted.scenes.append(self.scene)
        return wanted.scenes[0]  # where names stood there is data now


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
        raise ValueError(f"{path} is not a Blender file with a scene in it.")
    return names


def sha256_of(path: Path) -> str:
    """Of a file's content, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

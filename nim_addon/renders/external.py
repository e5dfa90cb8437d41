# SPDX-License-Identifier: GPL-3.0-or-later
"""The files beside a .blend that a scene of it needs: linked libraries, images, fonts, caches, and what marks their content."""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

import bpy

from . import simulated
from .used import used_by

WITH_A_FILE = (
    bpy.types.Image,
    bpy.types.MovieClip,
    bpy.types.VectorFont,
    bpy.types.Volume,
    bpy.types.CacheFile,
)
IN_A_FILE = "FILE", "SEQUENCE", "MOVIE", "TILED"  # sources of an image that is not made in Blender
FIRST_TILE = 1001


def files_of(scene: bpy.types.Scene) -> tuple[tuple[str, str], ...]:
    """(path, mark) of all that a scene needs beside its file, sorted; the mark is "" for what is missing.

    A file is marked by the SHA-256 of its content. What is many, a sequence ("/a/smoke_*.vdb") or the folder of a cache
    ("/a/cache/*"), is marked by the names, sizes and times of change of its files: their content may be too long to read.
    """
    return tuple((path, _mark(path)) for path in sorted(set(_paths(scene))))


def missing_files(scene: bpy.types.Scene) -> list[str]:
    """What a scene needs that is not there, as files_of() names it, sorted; a cache's folder is made as it is baked."""
    return [path for path in sorted(set(_paths(scene))) if Path(path).name != "*" and not _members(path)]


def sha256_of(path: Path) -> str:
    """Of a file's content, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _paths(scene) -> Iterator[str]:
    """Absolute paths of what a scene needs; many files as one with a "*"."""
    yield from simulated.files_of_caches(scene)
    needed = used_by(scene)
    for library in {data.library for data in needed if data.library}:
        # of 5.0: one whose content lies in the file itself
        if not library.packed_file and not getattr(library, "is_archive", False):
            yield bpy.path.abspath(library.filepath)
    for data in needed:
        for path in (*_own(data), *_of_modifiers(data), *_of_nodes(data)):
            if path and path != "<builtin>":
                yield str(Path(bpy.path.abspath(path, library=data.library)))


def _own(data):
    """The paths of data that is itself in a file."""
    if not isinstance(data, WITH_A_FILE) or getattr(data, "packed_file", None):
        return []
    source = getattr(data, "source", "FILE")
    if isinstance(data, bpy.types.Image):
        if source not in IN_A_FILE or data.packed_files:
            return []
        if source == "TILED":
            return [_of_tile(data.filepath, tile.number - FIRST_TILE) for tile in data.tiles]
    many = source == "SEQUENCE" or getattr(data, "is_sequence", False)
    return [_sequence(data.filepath) if many else data.filepath]


def _of_tile(path, number):
    return path.replace("<UDIM>", str(FIRST_TILE + number)).replace(
        "<UVTILE>", f"u{number % 10 + 1}_v{number // 10 + 1}"
    )


def _sequence(path):
    """All files of the one with a number in its name, which is the last there; the file where there is none."""
    return re.sub(r"\d+(?=[^\d/\\]*(\.[^./\\]*)?$)", "*", path, count=1)


def _of_modifiers(data):
    """Caches that an object's modifiers read: a file, or a folder."""
    for modifier in getattr(data, "modifiers", ()):
        held = [modifier, getattr(modifier, "domain_settings", None), *getattr(modifier, "bakes", ())]
        yield from (path for one in held if one for path in _texts(one))


def _of_nodes(data):
    """Files that the nodes of a material, a light, a world or a group read, rather than write."""
    tree = data if isinstance(data, bpy.types.NodeTree) else getattr(data, "node_tree", None)
    if isinstance(data, bpy.types.Scene) or not tree:
        return
    for node in tree.nodes:
        if node.bl_idname != "CompositorNodeOutputFile" and getattr(node, "mode", "EXTERNAL") == "EXTERNAL":
            yield from _texts(node)


def _texts(owner):
    """Paths that stand in the properties of something; that of a folder ends with "*"."""
    for known in owner.bl_rna.properties:
        if known.type == "STRING" and known.subtype in ("FILE_PATH", "DIR_PATH"):
            path = getattr(owner, known.identifier)
            if path:
                yield path if known.subtype == "FILE_PATH" else f"{path.rstrip('/')}/*"


def _members(path):
    """The files that a path means, sorted; of a folder, those in all that is in it too."""
    whole = Path(path)
    if "*" not in whole.name:
        return [whole] if whole.is_file() else []
    if not whole.parent.is_dir():
        return []
    if whole.name == "*":
        return sorted(found for found in whole.parent.rglob("*") if found.is_file())
    before, _, after = whole.name.partition("*")
    name = re.compile(rf"{re.escape(before)}\d+{re.escape(after)}")
    return sorted(found for found in whole.parent.iterdir() if name.fullmatch(found.name) and found.is_file())


def _mark(path):
    members = _members(path)
    if "*" not in Path(path).name:
        return _content_of(path, *_state(members[0])) if members else ""
    folder = Path(path).parent
    lines = [(found.relative_to(folder).as_posix(), *_state(found)) for found in members]
    return hashlib.sha256(repr(lines).encode()).hexdigest() if lines else ""


def _state(file):
    """The size, bytes, and the time of the last change, nanoseconds, of a file."""
    known = file.stat()
    return known.st_size, known.st_mtime_ns


@functools.lru_cache(maxsize=4096)  # for each frame of an animation it is asked for again
def _content_of(path, size, changed):
    return sha256_of(Path(path))

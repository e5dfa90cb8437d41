# SPDX-License-Identifier: GPL-3.0-or-later
"""The shared libraries that Blender's Python module asks a Linux system for: which are missing, and what brings them.

A desktop has them; a bare server, such as a slim container, lacks a dozen, of which the loader names only the first.
Standard library only: build.py reads it too.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import re
import shutil
import struct
import sys
from pathlib import Path

APT = "apt-get install -y --no-install-recommends"
# What a Blender loads only once it draws, with no word of it in its files.
DRAWS_WITH = ("libEGL.so.1",)
# Debian and Arch name the package of a library by the library; these are the exceptions.
DEBIAN = {"libz.so.1": "zlib1g"}
ARCH = {
    "libGL.so.1": "libglvnd",
    "libEGL.so.1": "libglvnd",
    "libgomp.so.1": "gcc-libs",
    "libstdc++.so.6": "gcc-libs",
    "libgcc_s.so.1": "gcc-libs",
    "libz.so.1": "zlib",
}


def missing() -> list[str]:
    """Names such as libSM.so.6, sorted, of all that this Python's bpy needs and the loader does not find; it is not loaded.

    Empty where it is not installed, and on systems other than Linux.
    """
    spec = importlib.util.find_spec("bpy") if sys.platform == "linux" else None
    return missing_for(spec.origin) if spec and spec.origin else []


def missing_for(file: str | Path) -> list[str]:
    """The same for the file of some bpy; OSError where it cannot be read."""
    waiting = [Path(file)]
    own: set[str] = set()
    wanted: set[str] = set(DRAWS_WITH)
    while waiting:
        needed, folders = _dynamic(waiting.pop())
        for name in set(needed) - own:
            found = next((folder / name for folder in folders if (folder / name).exists()), None)
            if found:  # what one of them brings along is there for all
                own.add(name)
                waiting.append(found)
            else:
                wanted.add(name)
    return sorted(name for name in wanted - own if not _loads(name))


def _loads(name):
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _dynamic(file):
    """What an ELF file of 64 bits needs by name, and the folders in which it looks first; ([], []) for another file."""
    with open(file, "rb") as stream:
        head = stream.read(64)
        if len(head) < 64 or head[:6] != b"\x7fELF\x02\x01":
            return [], []
        start, size, count = (*struct.unpack_from("<Q", head, 32), *struct.unpack_from("<HH", head, 54))
        stream.seek(start)
        table = stream.read(size * count)
        segments = [struct.unpack_from("<IIQQQQ", table, at) for at in range(0, len(table), size)]
        loaded = [(address, offset, length) for type_, _, offset, address, _, length in segments if type_ == 1]
        entries = []
        for type_, _, offset, _, _, length in segments:
            if type_ == 2:
                stream.seek(offset)
                entries = list(struct.iter_unpack("<qQ", stream.read(length - length % 16)))
        texts = next((value for tag, value in entries if tag == 5), None)
        base = next((o + texts - a for a, o, length in loaded if texts is not None and a <= texts < a + length), None)
        if base is None:
            return [], []

        def text(at):
            stream.seek(base + at)
            return stream.read(4096).split(b"\0")[0].decode(errors="replace")

        needed = [text(value) for tag, value in entries if tag == 1]
        places = ":".join(text(value) for tag, value in entries if tag in (15, 29)).split(":")
    origin = str(file.resolve().parent)
    folders = [place.replace("${ORIGIN}", origin).replace("$ORIGIN", origin) for place in places if place]
    return needed, [Path(folder) for folder in folders]


def remedy(names: list[str]) -> str | None:
    """The one command of this system, a text, that brings libraries of these names; None where it is not known.

    Of apt (Debian, Ubuntu), dnf (Fedora), zypper (openSUSE) and pacman (Arch) the first that there is.
    """
    root = "" if os.geteuid() == 0 else "sudo "
    if shutil.which("apt-get"):
        return f"{root}apt-get update && {root}{APT} {' '.join(of_debian(names))}"
    for tool, words in (("dnf", "install -y"), ("zypper", "--non-interactive install")):
        if shutil.which(tool):  # they find a package by what it provides
            return f"{root}{tool} {words} " + " ".join(f"'{name}()(64bit)'" for name in names)
    if shutil.which("pacman"):
        packages = sorted({ARCH.get(name) or name.split(".so")[0].lower() for name in names})
        return f"{root}pacman -Sy --noconfirm {' '.join(packages)}"
    return None


def of_debian(names: list[str]) -> list[str]:
    """Debian's packages, a sorted list, of libraries of these names."""
    return sorted({DEBIAN.get(name) or _debian_name(name) for name in names})


def _debian_name(name):
    # libSM.so.6 is in libsm6, libX11.so.6 in libx11-6
    stem, _, number = name.partition(".so")
    stem = stem.lower().replace("_", "-")
    number = number.lstrip(".")
    return f"{stem}-{number}" if number and re.search(r"\d$", stem) else stem + number


def why_not(error: ImportError) -> str:
    """What to tell a person whose `import bpy` raised this ImportError."""
    if isinstance(error, ModuleNotFoundError) and error.name == "bpy":
        return f"Blender is not installed as a Python module ({error}); run: python -m pip install bpy"
    names = missing()
    return sentence(names) if names else f"Blender's Python module is installed, but does not load: {error}"


def sentence(names: list[str]) -> str:
    """What to tell a person who lacks libraries of these names."""
    how = remedy(names)
    what = f"this system lacks shared libraries that Blender needs: {', '.join(names)}"
    return f"{what}; run: {how}" if how else f"{what}; install the packages that hold them."

# SPDX-License-Identifier: GPL-3.0-or-later
"""A bare server: every shared library that Blender lacks is found at once, with the one command that brings them."""

import importlib.util
import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from nim_addon.base import libraries

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems bring all that Blender needs")


def shared_library(path, needed):
    """Write the least file that the loader takes for a shared library, which needs others of these names."""
    texts = b"\0" + b"".join(name.encode() + b"\0" for name in needed)
    at = [1 + sum(len(name) + 1 for name in needed[:index]) for index in range(len(needed))]
    start = 64 + 2 * 56
    entries = [(1, place) for place in at]
    size = 16 * (len(entries) + 5)
    symbols = start + size + len(texts) + 16
    # text and symbol table with their sizes, the end
    entries += [(5, start + size), (10, len(texts)), (6, symbols), (11, 24), (0, 0)]
    body = b"".join(struct.pack("<qQ", *entry) for entry in entries) + texts
    total = symbols + 24
    head = b"\x7fELF\x02\x01\x01" + bytes(9)
    head += struct.pack("<HHIQQQIHHHHHH", 3, 62, 1, 0, 64, 0, 0, 64, 56, 2, 64, 0, 0)
    load = struct.pack("<IIQQQQQQ", 1, 6, 0, 0, 0, total, total, 0x1000)
    dynamic = struct.pack("<IIQQQQQQ", 2, 6, start, start, start, size, size, 8)
    path.write_bytes((head + load + dynamic + body).ljust(total, b"\0"))


def test_all_that_blender_lacks_is_found_at_once(monkeypatch):
    pytest.importorskip("bpy")
    assert libraries.missing() == [], "this Blender runs"
    monkeypatch.setattr(libraries, "_loads", lambda name: not name.startswith(("libX", "libSM", "libICE", "libGL")))
    missing = libraries.missing()
    # its own file names the first, one that it brings along the others
    assert {"libX11.so.6", "libXi.so.6", "libSM.so.6", "libICE.so.6", "libGL.so.1"} <= set(missing)
    assert all(name.startswith(("libX", "libSM", "libICE", "libGL")) for name in missing)
    monkeypatch.setattr(libraries, "_loads", lambda name: False)
    assert not any("OpenImageIO" in name or "tbb" in name for name in libraries.missing()), "those it brings along"


@pytest.mark.parametrize(
    ("tool", "command"),
    [
        ("apt-get", "apt-get update && apt-get install -y --no-install-recommends libgcc-s1 libsm6 libx11-6 zlib1g"),
        (
            "dnf",
            "dnf install -y 'libSM.so.6()(64bit)' 'libX11.so.6()(64bit)' 'libgcc_s.so.1()(64bit)' 'libz.so.1()(64bit)'",
        ),
        (
            "zypper",
            "zypper --non-interactive install 'libSM.so.6()(64bit)' 'libX11.so.6()(64bit)' 'libgcc_s.so.1()(64bit)' "
            "'libz.so.1()(64bit)'",
        ),
        ("pacman", "pacman -Sy --noconfirm gcc-libs libsm libx11 zlib"),
        (None, None),
    ],
)
def test_the_command_of_each_system(tool, command, monkeypatch, one_sentence):
    names = ["libSM.so.6", "libX11.so.6", "libgcc_s.so.1", "libz.so.1"]
    monkeypatch.setattr(libraries.shutil, "which", lambda name: tool if name == tool else None)
    monkeypatch.setattr(libraries.os, "geteuid", lambda: 0)
    assert libraries.remedy(names) == command
    said = libraries.sentence(names)
    assert "libSM.so.6, libX11.so.6" in said and (command or "install the packages") in said
    monkeypatch.setattr(libraries.os, "geteuid", lambda: 1000)
    assert command is None or libraries.remedy(names).startswith(f"sudo {tool} ")


@pytest.mark.parametrize("command", ("doctor", "scenes", "render sphere"))
def test_a_blender_that_lacks_libraries_is_not_said_to_be_missing(command, tmp_path):
    shared_library(tmp_path / "bpy.so", ["libno_such_one.so.1", "libc.so.6", "libNoOther.so.2"])
    done = subprocess.run(
        [sys.executable, "-m", "nim_addon", *command.split()],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    said = done.stdout + done.stderr
    assert done.returncode == 1 and "Traceback" not in said, said
    assert "lacks shared libraries that Blender needs: " in said
    assert "libNoOther.so.2, libno_such_one.so.1" in said
    assert "pip install" not in said and "libc.so.6" not in said


# ------------------------------------------------------------------------------------------------ build.py


@pytest.fixture
def build():
    """build.py as a module of its own."""
    spec = importlib.util.spec_from_file_location("build", ROOT / "build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def test_a_python_that_is_only_a_shim_is_seen_through(build, monkeypatch, tmp_path):
    # as pyenv's is where no version is chosen: it says so and fails
    shim = program(tmp_path / "shims" / "python3.99", "echo 'pyenv: python3.99: command not found' >&2; exit 127")
    monkeypatch.setenv("PATH", f"{shim.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path / "pyenv"))
    with pytest.raises(build.SetupError) as caught:
        build.interpreter((3, 99))
    assert str(shim) in str(caught.value) and "\n" not in str(caught.value) and caught.value.code == build.NO_PYTHON
    # one of another version, whatever it is called, is not it
    wrong = program(tmp_path / "pyenv" / "versions" / "3.99.2" / "bin" / "python3.99", "echo 3.9 /somewhere")
    with pytest.raises(build.SetupError):
        build.interpreter((3, 99))
    program(wrong, f"echo 3.99 {wrong}")
    assert build.interpreter((3, 99)) == str(wrong)
    # and a shim that works gives the Python behind it
    program(shim, "echo 3.99 /behind/it")
    assert build.interpreter((3, 99)) == "/behind/it"


def test_without_a_python_for_it_setup_says_so_by_its_exit_code(build, monkeypatch, capsys):
    monkeypatch.setitem(build.PYTHON, "5.2", (3, 99))
    monkeypatch.setattr(build, "environment_in", lambda folder, wanted, finder, *_: finder())
    assert build.main(["setup", "--blender", "5.2"]) == build.NO_PYTHON
    assert "python3.99" in capsys.readouterr().err


def test_a_bare_server_is_told_by_build_or_mended(build, monkeypatch, tmp_path, capsys):
    package = tmp_path / "lib" / "python3.11" / "site-packages" / "bpy"
    package.mkdir(parents=True)
    shared_library(package / "__init__.so", ["libSM.so.6", "libNoOther.so.2"])
    log = tmp_path / "log"
    program(tmp_path / "tools" / "apt-get", f'echo "$@" >> {log}')
    monkeypatch.setenv("PATH", str(tmp_path / "tools"))
    monkeypatch.setattr(build.os, "geteuid", lambda: 0)
    monkeypatch.setattr(build, "environment", lambda *_: tmp_path / "bin" / "python")
    assert build.main(["setup"]) == 1
    said = capsys.readouterr().err
    assert "libNoOther.so.2" in said and "apt-get install" in said and "--system-packages" in said
    assert said.count("\n") == 1 and not log.exists()
    assert build.main(["--system-packages", "setup"]) == 1, "this system's shelves do not have it"
    update, install = log.read_text().splitlines()
    assert update.split()[-1] == "update" and install.startswith("-qq install") and "libnoother2" in install
    monkeypatch.setattr(build.os, "geteuid", lambda: 1000)
    assert build.main(["setup", "--system-packages"]) == 2
    assert "root" in capsys.readouterr().err


def test_an_environment_is_made_by_a_python_outside_of_it(build):
    python = Path(build.interpreter(sys.version_info[:2])).absolute()
    assert sys.prefix == sys.base_prefix or not python.is_relative_to(sys.prefix)

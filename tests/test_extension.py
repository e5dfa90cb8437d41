# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension: built by build.py, installed by Blender's own installer; the scenes' .blend files need nothing of it."""

import importlib.util
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import nim_addon
from nim_addon.ui import assets

ROOT = Path(__file__).parents[1]
spec = importlib.util.spec_from_file_location("build", ROOT / "build.py")
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)

INSTALL = """
import contextlib, io, os, sys, time
import bpy

NAME = "bl_ext.user_default.nim_addon"


def traces():
    # everything in Blender that an add-on could leave behind
    found = {kind for kind in dir(bpy.types) if kind.startswith(("NIM_", "nim_"))}
    for handler in dir(bpy.app.handlers):
        functions = getattr(bpy.app.handlers, handler)
        if isinstance(functions, list):
            found |= {(handler, f.__name__) for f in functions if "nim_addon" in getattr(f, "__module__", "")}
    for kind in dir(bpy.types):
        draw = getattr(getattr(bpy.types, kind), "draw", None)
        found |= {(kind, f.__name__) for f in getattr(draw, "_draw_funcs", ()) if "nim_addon" in f.__module__}
    for kind in ("Scene", "Material", "Object", "World", "WindowManager", "Collection", "Mesh", "NodeTree"):
        found |= {(kind, p) for p in getattr(bpy.types, kind).bl_rna.properties.keys() if p.startswith("nim")}
    keys = bpy.context.window_manager.keyconfigs.addon
    items = [item for keymap in (keys.keymaps if keys else ()) for item in keymap.keymap_items]
    found |= {item.idname for item in items if "nim" in item.idname or "NIM" in getattr(item.properties, "name", "")}
    return found


# a traceback that Blender caught is a failure all the same
said = io.StringIO()
with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
    assert not traces(), traces()
    done = bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
    assert "FINISHED" in done, said.getvalue()
    assert NAME in bpy.context.preferences.addons, said.getvalue()
    enabled = traces()
    from bl_ext.user_default.nim_addon.cycles.material import interface_material
    from bl_ext.user_default.nim_addon.physics import Medium
    from bl_ext.user_default.nim_addon.ui import assets, preferences
    material = interface_material("Sphere", Medium(-1.5))
    assert material.node_tree.nodes["NIM Interface"].inputs["Index Inside"].default_value == -1.5
    assert preferences.settings().bl_rna.identifier == "NIM_AP_preferences"
    assert bpy.ops.nim.register_assets() == {"FINISHED"} and assets.library()

    bpy.ops.preferences.addon_disable(module=NAME)
    assert not traces(), ("left behind", traces())
    bpy.ops.preferences.addon_enable(module=NAME)
    assert traces() == enabled, traces() ^ enabled
    bpy.utils.load_scripts(reload_scripts=True)
    assert NAME in bpy.context.preferences.addons
    assert traces() == enabled, ("after a reload", traces() ^ enabled)
    bpy.ops.wm.read_homefile()
    assert traces() == enabled, ("after a new file", traces() ^ enabled)
    bpy.ops.preferences.addon_disable(module=NAME)
    assert not traces(), ("left behind at the end", traces())
assert "Traceback" not in said.getvalue() and "Warning" not in said.getvalue(), said.getvalue()
print("installed", bpy.app.version_string, flush=True)
os._exit(0)  # after reloading all scripts the module of Blender 4.5 hangs as it exits, with or without this add-on
"""

PLAIN = """
import sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not any("nim_addon" in name for name in sys.modules)
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
scene.cycles.samples = 8
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(sys.argv[2])
values = [v for i, v in enumerate(image.pixels[:]) if i % 4 < 3]
dark = sum(v < 1e-4 for v in values) / len(values)
mean = sum(values) / len(values)
assert 0.05 < mean < 5 and dark < float(sys.argv[3]), (mean, dark)
print("rendered", bpy.app.version_string)
"""


def plain_python(script, *words, folder, python=sys.executable):
    """Run a script in a Python that does not see this repository, with Blender's user folders in `folder`."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment["BLENDER_USER_RESOURCES"] = str(folder)
    return subprocess.run(
        [str(python), "-c", script, *map(str, words)],
        capture_output=True,
        text=True,
        cwd=folder,
        env=environment,
        timeout=120,
    )


def test_it_has_one_name_wherever_that_stands_and_not_that_of_the_program():
    manifest = tomllib.loads((ROOT / "nim_addon" / "blender_manifest.toml").read_text(encoding="utf-8"))
    name = manifest["name"]
    assert "blender" not in name.lower() and manifest["id"] == "nim_addon"
    assert name == assets.NAME
    assert (ROOT / "README.md").read_text(encoding="utf-8").startswith(f"# {name}\n")
    assert (ROOT / "docs" / "index.md").read_text(encoding="utf-8").startswith(f"# {name}\n")
    assert f'title: "{name}: ' in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f'project = "{name}"' in (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def zipped():
    """The extension's zip, just built and validated by Blender's own tool."""
    assert build.package(Path(sys.executable), []) == 0
    return ROOT / "dist" / f"nim_addon-{nim_addon.__version__}.zip"


def test_package_holds_what_it_needs(zipped):
    names = zipfile.ZipFile(zipped).namelist()
    for needed in (
        "LICENSE",
        "locale/es.po",
        "osl/nim_interface.osl",
        "assets/closures.blend",
        "assets/nim_assets.blend",
        "assets/blender_assets.cats.txt",
    ):
        assert needed in names
    assert not [name for name in names if "__pycache__" in name or name.endswith((".blend1", ".whl"))]
    assert zipped.stat().st_size < 3_000_000


@pytest.mark.parametrize("version", ["", "4.2", "5.0", "5.2"])
def test_package_installs_enables_and_leaves_nothing(zipped, version, tmp_path):
    python = ROOT / f".venv-{version}" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not version:
        python = sys.executable
    elif not python.exists():
        pytest.skip(f"no environment of Blender {version}: python3 build.py setup --blender {version}")
    done = plain_python(INSTALL, zipped, folder=tmp_path, python=python)
    assert "installed" in done.stdout, done.stdout + done.stderr


# around Snell's window the open sea is nearly black: eight samples bring no light to many of its pixels
@pytest.mark.parametrize(
    ("name", "dark"),
    [("glass", 0.02), ("pool", 0.02), ("sphere", 0.02), ("sea", 0.5), ("lens", 0.02), ("window", 0.02)],
)
def test_blend_scenes_are_small_and_render_without_the_addon(name, dark, tmp_path):
    path = ROOT / "blend_scenes" / f"{name}.blend"
    assert path.stat().st_size < 1_000_000
    done = plain_python(PLAIN, path, tmp_path / "out.exr", dark, folder=tmp_path)
    assert "rendered" in done.stdout, done.stdout + done.stderr

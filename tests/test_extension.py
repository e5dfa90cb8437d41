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

ROOT = Path(__file__).parents[1]
spec = importlib.util.spec_from_file_location("build", ROOT / "build.py")
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)

INSTALL = """
import sys, bpy
done = bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
assert "FINISHED" in done, done
name = "bl_ext.user_default.nim_addon"
assert name in bpy.context.preferences.addons
from bl_ext.user_default.nim_addon.cycles.material import interface_material
from bl_ext.user_default.nim_addon.physics import Medium
material = interface_material("Sphere", Medium(-1.5))
assert material.node_tree.nodes["NIM Interface"].inputs["Index Inside"].default_value == -1.5
bpy.ops.preferences.addon_disable(module=name)
bpy.ops.preferences.addon_enable(module=name)
assert name in bpy.context.preferences.addons
print("installed", bpy.app.version_string)
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
assert 0.05 < mean < 5 and dark < 0.02, (mean, dark)
print("rendered", bpy.app.version_string)
"""


def plain_python(script, *words, folder):
    """Run a script in a Python that does not see this repository, with Blender's user folders in `folder`."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment["BLENDER_USER_RESOURCES"] = str(folder)
    return subprocess.run(
        [sys.executable, "-c", script, *map(str, words)],
        capture_output=True,
        text=True,
        cwd=folder,
        env=environment,
        timeout=120,
    )


def test_versions_agree():
    manifest = tomllib.loads((ROOT / "nim_addon" / "blender_manifest.toml").read_text())
    assert manifest["version"] == nim_addon.__version__


def test_package_installs_in_blender(tmp_path, capfd):
    assert build.package(Path(sys.executable), []) == 0
    zipped = ROOT / "dist" / f"nim_addon-{nim_addon.__version__}.zip"
    names = zipfile.ZipFile(zipped).namelist()
    assert "osl/nim_interface.osl" in names
    assert "LICENSE" in names
    assert not [name for name in names if "__pycache__" in name]
    done = plain_python(INSTALL, zipped, folder=tmp_path)
    assert "installed" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("name", ("glass", "pool", "sphere"))
def test_blend_scenes_are_small_and_render_without_the_addon(name, tmp_path):
    path = ROOT / "blend_scenes" / f"{name}.blend"
    assert path.stat().st_size < 1_000_000
    done = plain_python(PLAIN, path, tmp_path / "out.exr", folder=tmp_path)
    assert "rendered" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("words", (["bake"], ["--blender", "2.8", "test"], ["--blender"]))
def test_build_refuses_what_it_does_not_know(words, capsys):
    assert build.main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1

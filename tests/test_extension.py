# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension: built by build.py, installed by Blender's own installer; the scenes' .blend files need nothing of it."""

import importlib.util
import os
import posixpath
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import nim_addon
from nim_addon import ui
from nim_addon.ui import assets

ROOT = Path(__file__).parents[1]
spec = importlib.util.spec_from_file_location("build", ROOT / "build.py")
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)
packing = build.part("tools/packing.py")

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
    found |= {("manual", f.__name__) for f in bpy.utils._manual_map if "nim_addon" in f.__module__}
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
    # a second Blender has it by the name that it has here
    from bl_ext.user_default.nim_addon.base import processes
    words = ["fresnel", "--inside", "water", "--step", "90", "--csv"]
    second = processes.second_blender("__main__", words, binary=bpy.app.binary_path, stdout=-1)
    answer = second.stdout.read()
    assert answer.startswith("theta_i,theta_t") and second.wait() == 0, answer

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
        "assets/CC0-1.0.txt",
        "locale/es.po",
        "osl/nim_interface.osl",
        "assets/closures.blend",
        "assets/nim_assets.blend",
        "assets/blender_assets.cats.txt",
    ):
        assert needed in names
    assert not [name for name in names if "__pycache__" in name or name.endswith((".blend1", ".whl"))]
    assert zipped.stat().st_size < 4_000_000


def test_the_pages_are_packed_need_no_network_and_have_what_the_panels_name(zipped):
    packed = zipfile.ZipFile(zipped)
    pages = {
        info.filename.removeprefix("docs/"): info for info in packed.infolist() if info.filename.startswith("docs/")
    }
    assert sum(info.compress_size for info in pages.values()) < 3_000_000
    texts = {name: packed.read(f"docs/{name}").decode() for name in pages if name.endswith(".html")}
    for name, text in texts.items():
        loaded = re.findall(r'<(?:script|img|link|iframe)\b[^>]*\b(?:src|href)="([^"]*)"', text)
        assert not [target for target in loaded if "//" in target], name
        shown = [target for target in loaded if "_images/" in target]
        assert not [
            target for target in shown if posixpath.normpath(posixpath.join("docs", target)) not in packed.namelist()
        ]
    assert not [name for name in pages if name.endswith(".css") and "//fonts" in packed.read(f"docs/{name}").decode()]
    panels = [
        cls for module in ui.MODULES for cls in getattr(module, "CLASSES", ()) if hasattr(cls, "draw_header_preset")
    ]
    for target in [*(cls.page for cls in panels), *(page for _, page in ui.help.MANUAL)]:
        page, _, section = target.partition("#")
        assert f'id="{section}"' in texts[f"{page}.html"] or not section, target


# ------------------------------------------------------------------------------------------------ what is packed


def git(folder, *words):
    subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=b", *words], cwd=folder, check=True)


@pytest.fixture
def repository(tmp_path):
    """A small repository that is packed in the place of this one."""
    for file in ("nim_addon/__init__.py", "nim_addon/ui/a.py", "osl/nim.osl", "tools/x.py", "LICENSE", ".gitignore"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("*.pyc\n" if file == ".gitignore" else "one\n")
    shutil.copy(ROOT / "nim_addon" / "blender_manifest.toml", tmp_path / "nim_addon")
    shutil.copy(ROOT / "tools" / "publisher.toml", tmp_path / "tools")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    return tmp_path


def staged(repository):
    """What would be packed of a repository: the files' names."""
    folder = repository / "staged"
    shutil.rmtree(folder, ignore_errors=True)
    packing.stage(repository, folder)
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file()}


def test_only_what_git_knows_is_packed_as_it_is_now(repository, capsys):
    packed = {"__init__.py", "ui/a.py", "osl/nim.osl", "LICENSE", "blender_manifest.toml"}
    assert staged(repository) == packed
    for stray in ("notes.txt", "ui/b.pyc", "wheels/thing.whl", "ui/a file.py"):
        (repository / "nim_addon" / stray).parent.mkdir(exist_ok=True)
        (repository / "nim_addon" / stray).write_text("stray\n")
    (repository / "nim_addon" / "ui" / "a.py").write_text("two\n")
    capsys.readouterr()
    assert staged(repository) == packed
    assert (repository / "staged" / "ui" / "a.py").read_text() == "two\n"
    said = capsys.readouterr().err
    assert "nim_addon/notes.txt is left out" in said and "ui/a file.py" in said and ".pyc" not in said
    (repository / "nim_addon" / "ui" / "a.py").unlink()
    with pytest.raises(packing.Refusal, match=r"ui/a\.py is known to git and is not there"):
        staged(repository)


def test_nothing_is_packed_without_git(repository):
    shutil.rmtree(repository / ".git")
    with pytest.raises(packing.Refusal, match="only what git knows is packed"):
        staged(repository)


def test_the_manifest_names_who_publishes(repository, capsys):
    def manifest():
        staged(repository)
        return tomllib.loads((repository / "staged" / "blender_manifest.toml").read_text(encoding="utf-8"))

    ours = tomllib.loads((ROOT / "nim_addon" / "blender_manifest.toml").read_text(encoding="utf-8"))
    publisher = repository / "tools" / "publisher.toml"
    publisher.write_text('maintainer = ""\nwebsite = ""\n')
    assert manifest() == ours
    assert capsys.readouterr().err.endswith("tools/publisher.toml names no maintainer and no website.\n")
    publisher.write_text('maintainer = "Zoë \\\\ \\"Z\\" <z@host>"\nwebsite = "https://host/"\n', encoding="utf-8")
    assert manifest() == ours | {"maintainer": 'Zoë \\ "Z" <z@host>', "website": "https://host/"}
    assert not capsys.readouterr().err


def test_the_manifest_says_what_is_done(zipped):
    packed = zipfile.ZipFile(zipped)
    manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later", "SPDX:CC0-1.0"] and "wheels" not in manifest
    source = "\n".join(packed.read(name).decode() for name in packed.namelist() if name.endswith(".py"))
    # what Blender's platform wants to be told, by what would do it
    network = r"^\s*(?:import|from) (?:urllib\.request|requests|http|ssl|ftplib|distributed|dask_jobqueue)\b"
    uses = {"clipboard": r"\.clipboard\b", "network": network}
    used = {name for name, words in uses.items() if re.search(words, source, re.MULTILINE)}
    assert set(manifest["permissions"]) == {"files"} | used


def test_what_is_packed_changes_no_path_asks_for_itself_in_one_place_and_runs_no_other_program(zipped):
    packed = zipfile.ZipFile(zipped)
    source = {name: packed.read(name).decode() for name in packed.namelist() if name.endswith(".py")}

    def where(words):
        return {name for name, text in source.items() if re.search(words, text)}

    assert not where(r"sys\.path|__path__|site-packages")
    assert where("__file__") == {"base/shipped.py"}
    # a second Blender, and what a queue has of its own nodes
    assert where(r"subprocess\.(run|Popen|call|check_\w+)\(") == {"base/processes.py", "sweeps/queues.py"}
    assert not where(r"os\.(system|popen|exec\w+|spawn\w+)\(|\b(?<!\.)(exec|eval)\(|ensurepip|import pip\b")


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

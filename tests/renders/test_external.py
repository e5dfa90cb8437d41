# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene needs beside its .blend: a picture that depends on a file is not repeated in silence where that has changed."""

import os
import shutil
from pathlib import Path

import bpy
import pytest

from nim_addon.base.streams import quiet
from nim_addon.renders.external import files_of, missing_files
from nim_addon.renders.request import Request


def painted(file, shade):
    """An image file of one shade."""
    image = bpy.data.images.new("Painted", 4, 4)
    image.pixels = [shade, shade, shade, 1] * 16
    image.filepath_raw, image.file_format = str(file), "PNG"
    image.save()
    bpy.data.images.remove(image)


def texture(nodes, file, source="FILE"):
    """An image node with that file."""
    image = bpy.data.images.load(str(file))
    image.source = source
    node = nodes.new("ShaderNodeTexImage")
    node.image = image
    return image


@pytest.fixture
def blend(tmp_path, empty_file):
    """A .blend, 8 x 8 pixels, of a world that is a texture, or reads one of a sequence or of tiles, and has a cache."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    if not scene.world.node_tree:  # which a world has from 5.0 on
        scene.world.use_nodes = True
    for name in ("sky.png", "packed.png", "film_01.png", "film_02.png", "tile.1001.png", "tile.1012.png"):
        painted(tmp_path / name, 0.5)
    nodes = scene.world.node_tree.nodes
    sky = texture(nodes, tmp_path / "sky.png")
    node = next(node for node in nodes if getattr(node, "image", None) == sky)
    scene.world.node_tree.links.new(node.outputs["Color"], nodes["Background"].inputs["Color"])
    texture(nodes, tmp_path / "packed.png").pack()
    texture(nodes, tmp_path / "film_01.png", "SEQUENCE")
    tiles = texture(nodes, tmp_path / "tile.1001.png", "TILED")
    tiles.filepath = str(tmp_path / "tile.<UDIM>.png")
    tiles.tiles.new(1012)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata([(0, 0, 5), (1, 0, 5), (0, 1, 5)], [], [(0, 1, 2)])
    moved = bpy.data.objects.new("Moved", mesh)
    scene.collection.objects.link(moved)
    moved.modifiers.new("Cache", "MESH_CACHE").filepath = str(tmp_path / "moves.mdd")
    moved.modifiers["Cache"].show_render = False
    (tmp_path / "moves.mdd").write_bytes(b"moves")
    waves = moved.modifiers.new("Waves", "OCEAN")
    waves.filepath, waves.show_render = str(tmp_path / "waves"), False
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mine.blend"))
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    return tmp_path / "mine.blend"


def opened(blend):
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(blend))
    return bpy.context.scene


def test_what_a_scene_needs_beside_its_file_is_known(blend, tmp_path):
    scene = opened(blend)
    marks = dict(files_of(scene))
    names = {str(Path(path).relative_to(tmp_path)).replace("\\", "/"): mark for path, mark in marks.items()}
    assert set(names) == {"sky.png", "film_*.png", "tile.1001.png", "tile.1012.png", "moves.mdd", "waves/*"}
    assert {name for name, mark in names.items() if not mark} == {"waves/*"}  # of an ocean that is not baked
    assert missing_files(scene) == []
    (tmp_path / "waves").mkdir()
    (tmp_path / "waves" / "disp_0001.exr").write_bytes(b"1")
    (tmp_path / "tile.1012.png").unlink()
    (tmp_path / "film_01.png").unlink()
    (tmp_path / "film_02.png").unlink()
    now = dict(files_of(scene))
    assert {Path(path).name for path in now if now[path] != marks[path]} == {"*", "film_*.png", "tile.1012.png"}
    assert [Path(path).name for path in missing_files(scene)] == ["film_*.png", "tile.1012.png"]


def changed(file):
    painted(file, 0.9)


def longer_ago(file):
    known = file.stat()
    os.utime(file, ns=(known.st_atime_ns, known.st_mtime_ns - 10**9))


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("sky.png", changed, "its content has changed"),
        ("moves.mdd", Path.unlink, "is missing"),
        ("film_02.png", longer_ago, "times of change differ"),
        ("tile.1012.png", changed, "its content has changed"),
    ],
)
def test_a_picture_is_not_repeated_with_another_file(blend, tmp_path, one_sentence, name, change, says):
    asked = Request.of_blend(blend)
    made = asked.render(tmp_path / "out")
    again, _ = Request.again(made.exr)
    assert asked.render(tmp_path / "out", keep=True).was_there and again.key() == asked.key()
    longer_ago(tmp_path / "sky.png")  # a copy of the same content is the same file
    assert again.key() == asked.key()
    change(tmp_path / name)
    with pytest.raises(ValueError) as caught:
        again.render(tmp_path / "out", "again")
    one_sentence(caught.value, name.replace("02", "*"), says)
    assert not asked.render(tmp_path / "out", keep=True).was_there


def test_an_image_of_an_earlier_version_knows_its_libraries_alone(blend, tmp_path, one_sentence):
    asked = Request.of_blend(blend)
    record = asked.record()
    record["blend"]["libraries"] = {
        str(tmp_path / "sky.png"): dict(asked.decided().blend.files)[str(tmp_path / "sky.png")]
    }
    again = Request.from_record(record)
    shutil.copy(tmp_path / "film_01.png", tmp_path / "film_03.png")
    assert again.decided().blend == asked.decided().blend
    changed(tmp_path / "sky.png")
    with pytest.raises(ValueError) as caught:
        again.decided()
    one_sentence(caught.value, "sky.png", "its content has changed")

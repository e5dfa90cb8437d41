# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of a .blend file as a request: rendered while another file is open, and known by what is in it."""

import dataclasses
import json
import shutil

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.base.streams import quiet
from nim_addon.renders.request import Request
from nim_addon.scenes import scene_type


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]


@pytest.fixture
def blend(tmp_path, empty_file):
    """A .blend with two scenes: an empty one, and a sphere that rises, of 24 x 16 pixels."""
    kind = scene_type("sphere")
    scene = kind.build(kind.parameters(), "nodes")
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 32, 50
    scene.cycles.samples, scene.cycles.seed = 2, 5
    for frame in (1, 10):
        scene.objects["Sphere"].location.z = frame
        scene.objects["Sphere"].keyframe_insert("location", frame=frame)
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mine.blend"), copy=True)
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    return tmp_path / "mine.blend"


def test_a_blend_is_rendered_while_another_file_is_open(blend, tmp_path):
    before = set(bpy.data.user_map())
    bpy.context.scene.frame_set(10)  # of the open file, which the other does not follow
    asked = Request.of_blend(blend, "NIM sphere")
    made = asked.render(tmp_path / "out")
    assert made.exr.name == "mine.exr"
    assert (made.record["size"], made.record["samples"], made.record["seed"]) == ([24, 16], 2, 5)
    assert "caustics" not in made.record
    assert {data.name for data in set(bpy.data.user_map()) - before} <= {"Render Result"} and bpy.data.filepath == ""
    assert before <= set(bpy.data.user_map())
    again, record = Request.again(made.png)
    assert again == Request.of_blend(blend, "NIM sphere", size=(24, 16), samples=2, seed=5, denoise=False)
    assert record == made.record and again.render(tmp_path / "out").was_there and again.key() == asked.key()

    later = dataclasses.replace(asked, frame=10).render(tmp_path / "out", "later")
    assert later.record["frame"] == 10
    assert np.abs(pixels(later.exr) - pixels(made.exr)).max() > 0.1
    small = dataclasses.replace(asked, size=(12, 8), samples=1).render(tmp_path / "out", "small")
    assert pixels(small.exr).shape == (8, 12, 3)


def test_a_blend_is_what_is_in_it(blend, tmp_path, one_sentence):
    other = shutil.copy(blend, tmp_path / "other.blend")
    asked = Request.of_blend(blend, "NIM sphere")
    assert asked.key() == Request.of_blend(other, "NIM sphere").key()
    assert Request.from_record(json.loads(json.dumps(asked.record()))) == asked
    assert dataclasses.replace(asked, frame=3).key() != asked.key()
    for words, says in (
        ((tmp_path / "none.blend",), "there is no file"),
        ((blend,), "has the scenes"),
        ((blend, "Sphere"), "has no scene 'Sphere'"),
    ):
        with pytest.raises(ValueError) as caught:
            Request.of_blend(*words)
        assert says in str(caught.value)
    (tmp_path / "text.blend").write_text("BLENDER")
    with pytest.raises(ValueError) as caught:
        Request.of_blend(tmp_path / "text.blend")
    one_sentence(caught.value, "not a Blender file")

    with blend.open("ab") as stream:
        stream.write(b"more")
    with pytest.raises(ValueError) as caught:
        Request.from_record(asked.record(), "the plan")
    one_sentence(caught.value, "the plan", "its content has changed")
    with pytest.raises(ValueError, match="its content has changed"):
        asked.render(tmp_path / "new")
    assert not (tmp_path / "new").exists()
    with pytest.raises(ValueError, match="its own parameters and backend"):
        dataclasses.replace(asked, backend="osl")


def test_cycles_renders_a_blend_that_is_set_to_another_engine(blend, tmp_path):
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        bpy.data.scenes["NIM sphere"].render.engine = "BLENDER_WORKBENCH"
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"), copy=True)
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    by_cycles, by_another = (
        Request.of_blend(file, "NIM sphere").render(tmp_path / "out") for file in (blend, tmp_path / "other.blend")
    )
    assert np.array_equal(pixels(by_cycles.exr), pixels(by_another.exr))

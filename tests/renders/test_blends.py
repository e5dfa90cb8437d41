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
from nim_addon.renders.request import Request, Session
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


def test_the_open_file_is_not_brought_into_itself(blend, tmp_path, one_sentence):
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(blend))
    with pytest.raises(ValueError) as caught:
        Request.of_blend(blend, "NIM sphere").render(tmp_path / "out")
    one_sentence(caught.value, "mine.blend is open", "a copy")


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


def changed(blend, change, *, into=None):
    """The .blend, or a copy `into` another file, once `change` has been called of its scene."""
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        change(bpy.data.scenes["NIM sphere"])
        bpy.ops.wm.save_as_mainfile(filepath=str(into or blend), copy=bool(into))
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    return into or blend


def test_a_render_region_that_crops_is_the_picture(blend, tmp_path, one_sentence):
    def crop(scene):
        scene.render.use_border = scene.render.use_crop_to_border = True
        scene.render.border_min_x, scene.render.border_max_x = 0.31, 0.77
        scene.render.border_min_y, scene.render.border_max_y = 0.2, 0.9
        with quiet():
            bpy.ops.render.render(scene=scene.name)
        bpy.data.images["Render Result"].save_render(str(tmp_path / "by_blender.png"), scene=scene)

    asked = Request.of_blend(changed(blend, crop), "NIM sphere")
    made = asked.render(tmp_path)
    assert made.record["size"] == [11, 11] and pixels(made.exr).shape == (11, 11, 3)
    assert np.array_equal(pixels(made.png), pixels(tmp_path / "by_blender.png"))
    again, _ = Request.again(made.exr)
    assert np.array_equal(pixels(again.render(tmp_path, "again").exr), pixels(made.exr))
    for size in ((22, 22), (7, 5), (300, 1)):
        assert pixels(dataclasses.replace(asked, size=size).render(tmp_path, "other").exr).shape == (*size[::-1], 3)
    large = dataclasses.replace(asked, size=(44, 44), samples=16).render(tmp_path, "large")
    parts = pixels(large.exr).reshape(11, 4, 11, 4, 3).mean((1, 3))
    well = dataclasses.replace(asked, samples=256).render(tmp_path, "well")
    assert np.median(np.abs(parts - pixels(well.exr))) < 0.05  # of the same part of the whole

    for width, size, says in ((0.1, (16384, 16), "ask for fewer"), (0, None, "has no pixels")):
        changed(blend, lambda scene, width=width: setattr(scene.render, "border_max_x", 0.31 + width))
        with pytest.raises(ValueError) as caught:
            Request.of_blend(blend, "NIM sphere", size=size).render(tmp_path / "new")
        one_sentence(caught.value, "render region", says)


def test_a_picture_that_is_too_small_for_blender_is_refused(tmp_path, empty_file, one_sentence):
    with pytest.raises(ValueError) as caught:
        Request.of("sphere", size=(8, 3), samples=1).render(tmp_path / "new")
    one_sentence(caught.value, "8 x 3", "4 x 4")


def test_a_part_of_a_size_is_cut_as_blender_cuts_it(blend, tmp_path):
    def odd(scene):
        scene.render.resolution_x, scene.render.resolution_percentage = 45, 37

    assert Request.of_blend(changed(blend, odd), "NIM sphere").decided().size == (16, 11)


def test_what_a_blend_is_linked_from_belongs_to_it(blend, tmp_path, one_sentence):
    deep, between = tmp_path / "deep.blend", tmp_path / "between.blend"

    def library(file, make):
        with quiet():
            bpy.ops.wm.read_homefile(use_empty=True)
            make()
            bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)

    def sheet(shift=0):
        mesh = bpy.data.meshes.new("Sheet")
        mesh.from_pydata([(shift, 0, 3), (shift + 9, 0, 3), (shift, 9, 3)], [], [(0, 1, 2)])
        mesh.use_fake_user = True

    def linked(file, kind):
        with bpy.data.libraries.load(str(file), link=True) as (held, wanted):
            setattr(wanted, kind, getattr(held, kind))
        return getattr(wanted, kind)[0]

    def thing():
        bpy.data.objects.new("Thing", linked(deep, "meshes")).use_fake_user = True

    library(deep, sheet)
    library(between, thing)
    changed(blend, lambda scene: scene.collection.objects.link(linked(between, "objects")))
    asked = Request.of_blend(blend, "NIM sphere")
    made = asked.render(tmp_path / "out")
    assert set(made.record["blend"]["files"]) == {str(deep), str(between)}
    again, _ = Request.again(made.exr)
    key = asked.key()
    assert again.render(tmp_path / "out", "mine").was_there and again.key() == key
    library(deep, lambda: sheet(shift=1))
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    with pytest.raises(ValueError) as caught:
        again.render(tmp_path / "out", "again")
    one_sentence(caught.value, str(deep), "its content has changed")
    assert asked.key() != key and not asked.render(tmp_path / "out", keep=True).was_there
    deep.unlink()
    assert dict(asked.decided().blend.files)[str(deep)] == ""


def test_at_a_frame_its_data_is_as_keyframes_and_drivers_have_it(blend, tmp_path):
    """Blender writes back only what moves in the scene of the window: lights, media and what is shown were of the saved frame."""

    def move(scene):
        lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
        scene.collection.objects.link(lamp)
        ball = scene.objects["Sphere"]
        node = ball.material_slots[0].material.node_tree.nodes.new("ShaderNodeValue")
        node.name = "Moves"
        for frame, energy, hidden in ((1, 0.0, True), (3, 8.0, False)):
            lamp.data.energy, ball.hide_render, node.outputs[0].default_value = energy, hidden, energy
            lamp.data.keyframe_insert("energy", frame=frame)
            ball.keyframe_insert("hide_render", frame=frame)
            node.outputs[0].keyframe_insert("default_value", frame=frame)
        hidden = bpy.data.objects.new("Hidden", bpy.data.lights.new("Hidden", "POINT"))
        scene.collection.objects.link(hidden)
        for frame, height in ((3, 7.0), (1, 0.0)):  # the saved one last, which nothing evaluates anew
            hidden.location.z = hidden.data.energy = hidden["own"] = height
            for owner, path in ((hidden, "location"), (hidden, '["own"]'), (hidden.data, "energy")):
                owner.keyframe_insert(path, frame=frame)
        hidden.hide_viewport = True  # which a render does not ask
        ball.modifiers.new("A.B", "ARRAY").driver_add("count").driver.expression = "frame + 1"
        scene.frame_set(1)

    moves = changed(blend, move, into=tmp_path / "moves.blend")
    with Session(Request.of_blend(moves, "NIM sphere", frame=3)) as session:
        lamp, ball = session.scene.objects["Lamp"], session.scene.objects["Sphere"]
        node = ball.material_slots[0].material.node_tree.nodes["Moves"]
        assert (lamp.data.energy, ball.hide_render, node.outputs[0].default_value) == (8.0, False, 8.0)
        assert ball.modifiers["A.B"].count == 4
        hidden = session.scene.objects["Hidden"]
        assert (hidden.location.z, hidden.data.energy, hidden["own"]) == (7.0, 7.0, 7.0) and hidden.hide_viewport


def test_what_is_brought_in_keeps_its_name_beside_the_same_in_the_open_file(blend, tmp_path):
    """Sentences named "Scene.001" where the person's scene is "Scene"."""

    def named(scene):
        bpy.data.scenes["Scene"].name = "Other"
        scene.name, scene.camera.name = "Scene", "Cube"  # as in the file that Blender opens with
        scene.objects["Sphere"].data.materials[0].name = "Material"

    file = changed(blend, named, into=tmp_path / "named.blend")
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    open_file = {(type(data).__name__, data.name) for data in bpy.data.user_map()} | {("Image", "Render Result")}
    scene = bpy.context.scene
    with Session(Request.of_blend(file, "Scene")) as session:
        own = session.scene
        assert (own.name, own.camera.name) == ("Scene", "Cube") and own != scene
        assert own.objects["Sphere"].data.materials[0].name == "Material"
        own.camera = None
        with pytest.raises(RuntimeError, match="the scene 'Scene' has no camera"):
            session.check()
    assert {(type(data).__name__, data.name) for data in bpy.data.user_map()} <= open_file
    assert bpy.context.scene == scene and scene.name == "Scene"

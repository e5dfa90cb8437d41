# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake keeps of a person's scene, and gives back when it is cleared; and when it no longer is of the scene."""

import math

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics import placing
from nim_addon.caustics.digest import digest
from nim_addon.scenes import sphere
from tests.caustics.rig import bake


def test_what_a_person_put_into_the_collection_stays_in_the_scene(build):
    scene = build()
    bake(scene)
    mine, box = bpy.data.objects.new("Mine", None), bpy.data.collections.new("Box")
    caustics.baked(scene).objects.link(mine)
    caustics.baked(scene).children.link(box)
    bake(scene)
    caustics.clear(scene)
    assert "Mine" in scene.collection.objects and "Box" in scene.collection.children


@pytest.mark.parametrize("change", ["emptied", "another"])
def test_a_sky_changed_after_the_bake_can_be_cleared(change, empty_file):
    scene = sphere.build(sphere.SphereParameters(n=1.5, sun_angle=0.5), "nodes")
    sky = scene.world
    method = sky.cycles.sampling_method
    bake(scene)
    if change == "emptied":
        sky.node_tree.nodes.clear()
    else:
        scene.world = bpy.data.worlds.new("Mine")
    caustics.clear(scene)
    assert not caustics.left(scene) and not scene.objects["Ground"].hide_render
    assert sky.cycles.sampling_method == method
    if change == "another":
        assert sky.node_tree.nodes["NIM Sun hidden"].outputs[0].default_value == 0


def test_what_was_hidden_comes_back_though_its_copy_was_deleted(build):
    scene = build()
    bake(scene)
    collection = caustics.baked(scene)
    bpy.data.batch_remove([*collection.objects, collection])
    assert scene.objects["Floor"].hide_render and caustics.left(scene)
    caustics.clear(scene)
    assert not scene.objects["Floor"].hide_render and not caustics.left(scene)
    assert scene.objects["Lamp"].data.cycles.use_multiple_importance_sampling


def test_namesakes_from_a_library_are_told_apart(build, tmp_path):
    scene = build()
    wanted = bake(scene)["Floor"]
    caustics.clear(scene)
    scene.objects["Floor"].location.x, scene.objects["Ball"].location.x = 40, 40
    index = scene.objects["Ball"].data.materials[0].node_tree.nodes["NIM Interface"].inputs["Index Inside"]
    index.default_value = -1.5
    bpy.data.libraries.write(str(tmp_path / "far.blend"), {scene.objects["Floor"], scene.objects["Ball"]})
    index.default_value = 1.5
    own = {name: scene.objects[name] for name in ("Floor", "Ball")}
    for obj in own.values():
        obj.location.x = 0
        scene.collection.objects.unlink(obj)
    with bpy.data.libraries.load(str(tmp_path / "far.blend"), link=True) as (_, to):
        to.objects = ["Floor", "Ball"]
    for obj in (*to.objects, *own.values()):
        scene.collection.objects.link(obj)
    assert bake(scene)["Floor"] == pytest.approx(wanted, rel=0.05)
    assert own["Floor"].hide_render and not to.objects[0].hide_render


@pytest.mark.parametrize("name", ["Floor", "Lamp"])
def test_overrides_of_a_library_stay_as_they_are(name, build, tmp_path, one_sentence):
    scene = build()
    held = bpy.data.collections.new("Held")
    held.objects.link(scene.objects[name])
    bpy.data.libraries.write(str(tmp_path / "held.blend"), {held})
    bpy.data.objects.remove(scene.objects[name])
    with bpy.data.libraries.load(str(tmp_path / "held.blend"), link=True) as (_, to):
        to.objects = [name]
    obj = to.objects[0].override_create()
    scene.collection.objects.link(obj)
    obj.data.override_create(remap_local_usages=True)
    # a mark on them is not saved, and nothing would find them again
    with pytest.raises(ValueError) as error:
        bake(scene)
    one_sentence(error.value, "overrid")
    assert not caustics.left(scene) and not obj.hide_render


def test_caustics_may_lie_in_another_collection(build):
    scene = build()
    bake(scene)
    box = bpy.data.collections.new("Box")
    scene.collection.children.link(box)
    box.children.link(caustics.baked(scene))
    scene.collection.children.unlink(caustics.baked(scene))
    assert caustics.baked(scene) and not caustics.out_of_date(scene)
    mine = bpy.data.objects.new("Mine", None)
    caustics.baked(scene).objects.link(mine)
    scene.objects["Ball"].location.x = 1
    assert caustics.out_of_date(scene)
    caustics.clear(scene)
    assert not caustics.left(scene) and "NIM Caustics" not in bpy.data.collections
    assert box in set(scene.collection.children) and "Mine" in scene.objects


def test_a_copy_that_was_taken_for_its_surface_makes_caustics_out_of_date(build, tmp_path):
    scene = build()
    scene.objects["Floor"].rotation_euler = (0.1, 0.2, 0.3)
    bake(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    scene = bpy.context.scene
    copy = next(obj for obj in caustics.baked(scene).objects if obj.type == "MESH")
    copy.name, copy.hide_viewport = "Mine", True
    assert not caustics.out_of_date(scene)
    copy.location.x += 1
    assert caustics.out_of_date(scene)
    copy.location.x -= 1
    assert not caustics.out_of_date(scene)
    bpy.data.objects.remove(copy)
    assert caustics.out_of_date(scene)
    bake(scene)
    assert not caustics.out_of_date(scene)


def test_how_things_are_shown_does_not_make_caustics_out_of_date(build):
    scene = build()
    modifier = scene.objects["Ball"].modifiers.new("Decimate", "DECIMATE")
    modifier.decimate_type, modifier.delimit = "DISSOLVE", {"NORMAL", "MATERIAL", "SEAM", "SHARP"}
    marks = {digest(scene)}
    modifier.show_expanded = not modifier.show_expanded
    modifier.show_viewport = not modifier.show_viewport
    marks.add(digest(scene))
    assert len(marks) == 1
    modifier.angle_limit = math.radians(30)
    assert digest(scene) not in marks


def test_a_state_that_is_none_and_a_folder_that_is_not_there(build, tmp_path, one_sentence):
    scene = build()
    np.save(tmp_path / "state.npy", np.zeros(3))
    with caustics.Bake(scene, texels=64, photons=1 << 12) as baking:
        assert not baking.load(tmp_path / "state.npy")
    with pytest.raises(OSError) as error:
        bake(scene, file=tmp_path / "nowhere" / "state")
    one_sentence(error.value, "nowhere")


def test_a_bake_that_fails_at_its_end_leaves_the_scene_as_it_was(build, monkeypatch):
    scene = build()

    def full(*_):
        raise MemoryError("no room for another lamp")

    monkeypatch.setattr(placing, "split", full)
    with pytest.raises(MemoryError):
        bake(scene)
    assert not caustics.baked(scene) and not any(obj.hide_render for obj in scene.objects)
    assert not [obj.name for obj in scene.objects if "NIM" in obj.name]

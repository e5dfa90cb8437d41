# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that adds a floor: when it is offered, where the floor is, and that caustics land on it."""

import bpy
import numpy as np
import pytest

from nim_addon import caustics, checks
from nim_addon.caustics import baking, landing
from nim_addon.cycles import settings
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
from nim_addon.scenes import surfaces
from nim_addon.ui import caustics_bake

from .test_caustics import drawn, known

OFFERED = "Nothing is there for the bent light to land on | nim.add_floor"


@pytest.fixture
def scene(addon, monkeypatch):
    """The file that Blender starts with, in which the cube is a NIM; a million photons are twenty thousand."""
    monkeypatch.setattr(caustics_bake, "MILLION", 20_000)
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 14)
    scene = bpy.context.scene
    scene.nim_caustics.photons, scene.nim_caustics.texels = 1, "512"
    settings.lossless(scene, "nodes")
    cube().data.materials[0] = interface_material("NIM", Medium(-1.5), backend="nodes")
    bpy.ops.ed.undo_push(message="Scene")
    return scene


def cube():
    return bpy.data.objects["Cube"]


def refused(scene):
    """Whether a bake is, for want of what light lands on."""
    try:
        with caustics.Bake(scene):
            return False
    except ValueError as error:
        assert "for light to land on" in str(error)
        return True


def test_a_scene_without_a_floor_is_offered_one_on_which_caustics_are_baked(scene, press):
    assert OFFERED in drawn(scene)
    with pytest.raises(RuntimeError, match="no diffuse surface"):
        press("nim.bake_caustics")
    assert press("nim.add_floor") == {"FINISHED"}
    known(scene)
    assert OFFERED not in drawn(scene)
    assert bpy.context.selected_objects == [cube()] and checks.problems(scene) == []
    assert press("nim.bake_caustics") == {"FINISHED"}
    (copy,) = (obj for obj in scene.objects if obj.type == "MESH" and obj.get(caustics.CAUSTICS_MARK))
    assert copy.name == "NIM Caustics Floor" and scene.objects["Floor"].hide_render
    bpy.data.objects.remove(scene.objects["Floor"])  # its copy is none that a bake could use
    known(scene)
    assert OFFERED in drawn(scene)


def test_one_undo_takes_it_back(scene, press):
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "materials")}
    press("nim.add_floor")
    bpy.ops.ed.undo()
    assert {kind: len(getattr(bpy.data, kind)) for kind in before} == before


def test_it_lies_just_below_the_lowest_point_ten_times_as_wide(scene, press):
    cube().scale, cube().rotation_euler, cube().location = (1, 2, 1), (0.5, 0, 0.3), (3, -2, 1)
    bpy.context.view_layer.update()
    points = np.array([cube().matrix_world @ vertex.co for vertex in cube().data.vertices])
    press("nim.add_floor")
    bpy.context.view_layer.update()
    floor = scene.objects["Floor"]
    corners = np.array([floor.matrix_world @ vertex.co for vertex in floor.data.vertices])
    size = np.ptp(points, axis=0).max()
    assert 0 < points[:, 2].min() - corners[:, 2].max() < 0.01 * size
    np.testing.assert_allclose(np.ptp(corners, axis=0), (10 * size, 10 * size, 0), atol=1e-4)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    np.testing.assert_allclose(corners.mean(axis=0)[:2], middle[:2], atol=1e-4)


def plane(scene, material=None):
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1.1))
    if material:
        bpy.context.object.data.materials.append(material)
    return bpy.context.object


def unused_slot(scene):
    cube().data.materials.append(surfaces.plain("Unused", (0.5, 0.5, 0.5)))


def instanced(scene):
    holder, floor = bpy.data.collections.new("Held"), plane(scene)
    for collection in floor.users_collection:
        collection.objects.unlink(floor)
    holder.objects.link(floor)
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", holder
    scene.collection.objects.link(empty)


def another_nim(scene):
    plane(scene, interface_material("Pane", Medium(1.5), backend="nodes"))


def hidden(scene):
    plane(scene).hide_render = True


def hidden_in_the_view(scene):
    plane(scene).hide_viewport = True


CASES = [
    (lambda scene: None, True),
    (plane, False),
    (unused_slot, True),
    (instanced, True),
    (another_nim, True),
    (hidden, True),
    (hidden_in_the_view, False),
]


@pytest.mark.parametrize(("change", "lacks"), CASES, ids=lambda value: getattr(value, "__name__", None))
def test_it_is_offered_where_a_bake_is_refused(scene, change, lacks):
    change(scene)
    assert landing.lacks_floor(scene) == refused(scene) == lacks
    known(scene)
    assert (OFFERED in drawn(scene)) == lacks


def test_it_is_not_added_in_another_mode_nor_to_a_scene_of_a_library(scene, press, tmp_path):
    bpy.context.view_layer.objects.active = cube()
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Leave the mode you are in for Object Mode first"):
        press("nim.add_floor")
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {scene})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.scenes = [scene.name]
    with bpy.context.temp_override(scene=wanted.scenes[0]):
        assert not bpy.ops.nim.add_floor.poll()


def test_where_nothing_bends_light_none_is_offered_and_none_is_added(scene, press):
    cube().data.materials.clear()
    assert not landing.lacks_floor(scene)
    with pytest.raises(RuntimeError, match="Nothing bends light here"):
        press("nim.add_floor")
    assert "Floor" not in bpy.data.objects

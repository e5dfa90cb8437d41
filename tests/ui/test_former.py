# SPDX-License-Identifier: GPL-3.0-or-later
"""What Restore Former Materials gives back is that of each slot, whatever was done to the slots since."""

import bpy
import pytest

from nim_addon.cycles.material import interface_nodes


def select(object_):
    for other in bpy.context.view_layer.objects:
        other.select_set(other == object_)
    bpy.context.view_layer.objects.active = object_


@pytest.fixture
def four(addon):
    """A cube of four slots, a face each: of the mesh, of the object, of the mesh, and an empty one; by what each is known."""
    cube = bpy.data.objects["Cube"]
    cube.data.materials.clear()
    for name in ("First", "Under", "Third", None):
        cube.data.materials.append(bpy.data.materials.new(name) if name else None)
    cube.material_slots[1].link = "OBJECT"
    cube.material_slots[1].material = bpy.data.materials.new("Own")
    for place, face in enumerate(cube.data.polygons):
        face.material_index = min(place, 3)
    select(cube)
    return cube


def worn_by(object_):
    return [(slot.link, slot.material and slot.material.name) for slot in object_.material_slots]


def at(object_, place):
    object_.active_material_index = place
    return bpy.context.temp_override(object=object_, active_object=object_, selected_objects=[object_])


def remove(object_, place):
    with at(object_, place):
        bpy.ops.object.material_slot_remove()


def move(object_, place, direction):
    with at(object_, place):
        bpy.ops.object.material_slot_move(direction=direction)


def add_before(object_, name):
    with at(object_, 0):
        bpy.ops.object.material_slot_add()
    slot = object_.material_slots[-1]
    slot.link, slot.material = "DATA", bpy.data.materials.new(name)
    for place in range(len(object_.material_slots) - 1, 0, -1):
        move(object_, place, "UP")


def rename(object_):
    for slot in object_.material_slots:
        for material in {slot.material, object_.data.materials[slot.slot_index]} - {None}:
            material.name += " Renamed"


CHANGES = {
    "first removed": lambda cube: remove(cube, 0),
    "object's own removed": lambda cube: remove(cube, 1),
    "last removed": lambda cube: remove(cube, 3),
    "two removed": lambda cube: (remove(cube, 2), remove(cube, 0)),
    "moved down": lambda cube: move(cube, 0, "DOWN"),
    "moved far": lambda cube: [move(cube, place, "UP") for place in (3, 2, 1)],
    "one added before": lambda cube: add_before(cube, "Added"),
    "one added and two removed": lambda cube: (add_before(cube, "Added"), remove(cube, 3), remove(cube, 1)),
    "renamed": rename,
    "renamed and first removed": lambda cube: (rename(cube), remove(cube, 0)),
}


@pytest.mark.parametrize("slots", ["ALL", "ACTIVE"])
@pytest.mark.parametrize("change", CHANGES)
def test_what_was_done_to_slots_since_is_as_if_it_had_been_done_before(four, press, change, slots):
    """Restore Former Materials gives what the same change gives of an object that was never converted."""
    bpy.ops.object.duplicate()
    other = bpy.context.object  # with a mesh of its own
    select(four)
    four.active_material_index = 1
    press("nim.convert", slots=slots)
    CHANGES[change](four)
    select(four)
    press("nim.revert")
    names = worn_by(four)
    if "renamed" not in change:  # those of the other are of the same materials
        select(other)
        CHANGES[change](other)
    elif "removed" in change:
        remove(other, 0)
    assert names == [(link, name and name.replace(".001", "")) for link, name in worn_by(other)]
    assert not any(interface_nodes(material) and material.users for material in bpy.data.materials)


@pytest.mark.parametrize("linked", [True, False])
def test_a_duplicate_is_taken_back_by_itself(four, press, linked):
    before = worn_by(four)
    press("nim.convert")
    bpy.ops.object.duplicate(linked=linked)
    twin = bpy.context.object
    remove(twin, 0)  # of a linked duplicate that is the original's too
    press("nim.revert")
    assert worn_by(twin) == before[1:] and all(interface_nodes(slot.material) for slot in four.material_slots)
    select(four)
    press("nim.revert")
    assert worn_by(four) == (before[1:] if linked else before)


def test_another_medium_after_a_slot_went_keeps_what_was_first(four, press):
    before = worn_by(four)
    press("nim.convert")
    remove(four, 0)
    add_before(four, "Added")
    press("nim.convert", inside="nim-4.1", replace=True)
    press("nim.revert")
    assert worn_by(four) == [("DATA", "Added"), *before[1:]]


def test_a_slot_removed_undone_and_redone(four, press):
    before = worn_by(four)
    press("nim.convert")
    bpy.ops.ed.undo_push(message="converted")
    remove(four, 0)
    bpy.ops.ed.undo_push(message="removed")
    bpy.ops.ed.undo()
    cube = bpy.data.objects["Cube"]
    press("nim.revert")
    assert worn_by(cube) == before


def test_files_of_earlier_versions_are_taken_back_by_place(four, press):
    before = worn_by(four)
    press("nim.convert")
    for entry in four.nim.former:
        entry.property_unset("worn")
        entry.property_unset("mesh_material")
    press("nim.revert")
    assert worn_by(four) == before


def test_what_join_moved_into_the_mesh_is_taken_back_too(four, press):
    bpy.ops.mesh.primitive_cube_add()
    other = bpy.context.object
    other.data.materials.append(bpy.data.materials.new("Other"))
    select(four)
    four.active_material_index = 0
    press("nim.convert", slots="ACTIVE")
    other.select_set(True)
    bpy.ops.object.join()
    press("nim.revert")
    assert [name for _, name in worn_by(four)] == ["First", "Own", "Third", None, "Other"]
    assert not any(map(interface_nodes, bpy.data.materials))

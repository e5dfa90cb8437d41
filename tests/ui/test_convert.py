# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh made a NIM in one click, and given back exactly as it was."""

import bpy
import pytest

from nim_addon.cycles.material import interface_material, interface_nodes, interface_of
from nim_addon.physics import Medium


def state(object_):
    """All that "Take Back" must restore of an object's materials."""
    object_ = bpy.data.objects[object_]
    slots = []
    for slot in object_.material_slots:
        link = slot.link
        slot.link = "OBJECT"
        slots.append((link, slot.material))
        slot.link = link
    return slots, list(object_.data.materials), [face.material_index for face in object_.data.polygons]


def is_nim(object_):
    return all(interface_nodes(slot.material) for slot in object_.material_slots) and len(object_.material_slots) > 0


def select(*objects):
    for object_ in bpy.context.view_layer.objects:
        object_.select_set(object_ in objects)
    bpy.context.view_layer.objects.active = objects[0] if objects else None


@pytest.fixture
def cube(addon):
    """The default cube with a second material on one face and an own material in the object's first slot."""
    cube = bpy.data.objects["Cube"]
    cube.data.materials.append(bpy.data.materials.new("Second"))
    cube.data.polygons[2].material_index = 1
    cube.material_slots[0].link = "OBJECT"
    cube.material_slots[0].material = bpy.data.materials.new("Own")
    select(cube)
    return cube


def test_one_click_and_back(cube, press):
    before = state("Cube")
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(cube) and interface_of(interface_nodes(cube.active_material)[0]).inside == Medium(-1.5)
    assert list(cube.data.materials) == before[1], "the mesh keeps its own"
    assert press("nim.revert") == {"FINISHED"}
    assert state("Cube") == before
    assert not [material for material in bpy.data.materials if interface_nodes(material)], "nothing is left over"


def test_undo_and_redo(cube, press):
    bpy.ops.ed.undo_push(message="before")
    press("nim.convert")
    bpy.ops.ed.undo()
    cube = bpy.data.objects["Cube"]
    assert not is_nim(cube) and not len(cube.nim.former)
    bpy.ops.ed.redo()
    cube = bpy.data.objects["Cube"]
    assert is_nim(cube) and len(cube.nim.former) == 2
    press("nim.revert")
    bpy.ops.ed.undo()
    assert is_nim(bpy.data.objects["Cube"])


def test_several_that_share_a_mesh_without_slots(addon, press):
    mesh = bpy.data.objects["Cube"].data
    mesh.materials.clear()
    twin = bpy.data.objects.new("Twin", mesh)
    bpy.context.collection.objects.link(twin)
    other = bpy.data.objects.new("Bystander", mesh)
    bpy.context.collection.objects.link(other)
    cube = bpy.data.objects["Cube"]
    for first, second in ((cube, twin), (twin, cube)):
        select(cube, twin)
        press("nim.convert")
        assert is_nim(cube) and is_nim(twin) and cube.active_material == twin.active_material
        assert other.active_material is None
        select(first)
        press("nim.revert")
        assert is_nim(second) and not is_nim(first)
        select(second)
        press("nim.revert")
        assert not mesh.materials and not cube.material_slots and not other.material_slots


def test_again_with_another_medium_keeps_what_was_first(cube, press):
    before = state("Cube")
    press("nim.convert")
    press("nim.convert", inside="custom", n_inside=-2.0, mu_inside=3.0, outside="water", replace=True)
    interface = interface_of(interface_nodes(cube.active_material)[0])
    assert interface.inside == Medium(-2.0, -3.0) and interface.outside.n == pytest.approx(1.33)
    press("nim.revert")
    assert state("Cube") == before


@pytest.fixture
def said(monkeypatch, addon):
    """What nim.convert reports, as pairs (kind, text)."""
    from nim_addon.ui.convert import NIM_OT_convert

    texts = []
    whole = NIM_OT_convert.execute

    class Told:
        def __init__(self, operator):
            self.operator = operator

        def __getattr__(self, name):
            return getattr(self.operator, name)

        def report(self, kind, text):
            texts.append((*kind, text))

    monkeypatch.setattr(NIM_OT_convert, "execute", lambda self, context: whole(Told(self), context))
    return texts


def wear(object_, material, slot=0, link="DATA"):
    object_.material_slots[slot].link = link
    object_.material_slots[slot].material = material


@pytest.mark.parametrize("link", ["DATA", "OBJECT"])
def test_what_is_one_already_stays_as_it_is_and_that_is_said(cube, press, said, link):
    mine = interface_material("Mine", Medium(-2.2), backend="nodes")
    wear(cube, mine, 0, link)  # the second slot is that of one face
    before, materials = state("Cube"), len(bpy.data.materials)
    assert press("nim.convert") == {"CANCELLED"}
    assert state("Cube") == before and len(bpy.data.materials) == materials and not len(cube.nim.former)
    assert said == [
        ("WARNING", "Cube is negative-index already, n = -2.2: it stays as it is; change n in the panel"),
    ]
    interface_nodes(mine)[0].inputs["Index Inside"].default_value = 0  # no index at all: it may be worked at
    assert press("nim.convert") == {"CANCELLED"}
    assert said[1][1] == "Cube has an interface already, Mine: it stays as it is"
    assert press("nim.convert", replace=True) == {"FINISHED"}
    assert is_nim(cube) and cube.active_material != mine
    press("nim.revert")
    assert state("Cube") == before, "and is not lost"


def test_others_are_made_one_beside_it(cube, press, said):
    ball = bpy.data.objects.new("Ball", bpy.data.meshes.new("Ball"))
    ball.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mine = interface_material("Mine", Medium(1.33), Medium(-2.2), backend="nodes")  # water in a NIM
    ball.data.materials.append(mine)
    bpy.context.collection.objects.link(ball)
    select(cube, ball)
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(cube) and ball.active_material == mine and not len(ball.nim.former)
    assert said == [
        (
            "WARNING",
            "1 made negative-index. Ball is negative-index already, n = -2.2: it stays as it is; change n in the panel",
        )
    ]


@pytest.mark.parametrize("way", ["glass", "a slot without faces"])
def test_what_is_none_yet_becomes_one(cube, press, way):
    mine = interface_material("Mine", Medium(1.5 if way == "glass" else -2.2), backend="nodes")
    wear(cube, mine, 1)
    if way != "glass":
        cube.data.polygons[2].material_index = 0
    assert press("nim.convert") == {"FINISHED"}
    assert {interface_of(interface_nodes(slot.material)[0]).inside.n for slot in cube.material_slots} == {-1.5}


def test_the_redo_panel_makes_another_of_what_was_none(cube, press):
    """As Blender redoes an operator: what it did is undone, and it runs again with other values."""
    bpy.ops.ed.undo_push(message="before")
    press("nim.convert")
    bpy.ops.ed.undo()
    assert press("nim.convert", inside="nim-4.1") == {"FINISHED"}
    cube = bpy.data.objects["Cube"]
    assert interface_of(interface_nodes(cube.active_material)[0]).inside.n == pytest.approx(-4.1)


def test_names_tell_no_index(cube, press):
    press("nim.convert")
    assert cube.active_material.name == "Cube Interface"
    for name in ("Sphere Interface", "Sphere Interface.001"):
        press("nim.add_object")
        assert bpy.context.object.active_material.name == name


def test_an_index_of_zero_changes_nothing(cube, press):
    before, materials = state("Cube"), len(bpy.data.materials)
    with pytest.raises(RuntimeError, match="n = 0 refracts nothing"):
        press("nim.convert", inside="custom", n_inside=0.0)
    assert state("Cube") == before and len(bpy.data.materials) == materials and not len(cube.nim.former)


def test_linked_objects_are_named_and_the_others_done(cube, press, tmp_path):
    from nim_addon.base.streams import quiet

    library = str(tmp_path / "library.blend")
    mesh = bpy.data.meshes.new("Faceless")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    with quiet():
        bpy.data.libraries.write(library, {bpy.data.objects.new("Linked", mesh)})
        with bpy.data.libraries.load(library, link=True) as (_, into):
            into.objects = ["Linked"]
    linked = into.objects[0]
    bpy.context.collection.objects.link(linked)
    wearer = bpy.data.objects.new("Wearer", linked.data)  # a local object, its mesh linked and without a slot
    bpy.context.collection.objects.link(wearer)
    select(cube, linked, wearer)
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(cube) and not is_nim(linked) and not is_nim(wearer) and not len(wearer.nim.former)
    select(linked)
    with pytest.raises(RuntimeError, match="Linked is linked from a library: make it local first"):
        press("nim.convert")


def test_it_survives_saving(cube, press, tmp_path):
    from nim_addon.base.streams import quiet

    press("nim.convert")
    file = str(tmp_path / "saved.blend")
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=file)
        bpy.ops.wm.open_mainfile(filepath=file)
    select(bpy.data.objects["Cube"])
    assert is_nim(bpy.data.objects["Cube"])
    press("nim.revert")
    slots, meshs, faces = state("Cube")
    assert [(link, own and own.name) for link, own in slots] == [("OBJECT", "Own"), ("DATA", None)]
    assert [material.name for material in meshs] == ["Material", "Second"] and faces[2] == 1


def test_poll_says_why_not(addon, press):
    select()
    with pytest.raises(RuntimeError, match="Select a mesh object first"):
        press("nim.convert")
    select(bpy.data.objects["Cube"])
    with pytest.raises(RuntimeError, match="None of the selected meshes"):
        press("nim.revert")

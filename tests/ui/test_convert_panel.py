# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Material panel offers for what is selected: what comes next, and nothing that is done already."""

from types import SimpleNamespace

import bpy
import pytest

from nim_addon.cycles.material import interface_nodes


@pytest.fixture
def cube(addon):
    """The default cube, selected, with a second material on one face."""
    cube = bpy.data.objects["Cube"]
    cube.data.materials.append(bpy.data.materials.new("Second"))
    cube.data.polygons[2].material_index = 1
    select(cube)
    return cube


def select(*objects):
    for object_ in bpy.context.view_layer.objects:
        object_.select_set(object_ in objects)
    bpy.context.view_layer.objects.active = objects[0] if objects else None


def is_nim(object_):
    return all(interface_nodes(slot.material) for slot in object_.material_slots)


class Buttons:
    """A layout that notes what can be pressed: {operator or menu: what it is given}."""

    def __init__(self):
        self.there = {}

    def column(self, **_):
        return self

    def operator(self, name, **_):
        return self.there.setdefault(name, SimpleNamespace())

    def menu(self, name, **_):
        self.there[name] = None


def offered():
    from nim_addon.ui.convert import draw_buttons

    layout = Buttons()
    draw_buttons(layout, bpy.context)
    return layout.there


def press_make(press):
    """As a person does who sees the button."""
    return press("nim.convert", **vars(offered()["nim.convert"]))


def test_the_panel_offers_what_comes_next(cube, press):
    assert list(offered()) == ["nim.convert"]
    press_make(press)
    assert is_nim(cube) and list(offered()) == ["nim.revert"], "it is made: nothing is left to make"
    press("nim.revert")
    assert list(offered()) == ["nim.convert"]
    press("nim.add_object")
    assert not offered(), "it is one from the beginning"
    select()
    assert list(offered()) == ["NIM_MT_add_mesh"]
    select(bpy.data.objects["Camera"])
    assert list(offered()) == ["NIM_MT_add_mesh"]
    select(cube)
    cube.select_set(False)
    assert list(offered()) == ["NIM_MT_add_mesh"], "it is active still, which nobody means"
    press("nim.convert")  # of the properties, where the active object is meant
    assert list(offered()) == ["nim.revert"]


def test_the_panel_offers_to_make_the_slot_that_is_none_yet(cube, press):
    cube.active_material_index = 1
    press("nim.convert", slots="ACTIVE")
    assert list(offered()) == ["nim.revert"]
    cube.active_material_index = 0
    assert list(offered()) == ["nim.convert", "nim.revert"]
    assert press_make(press) == {"FINISHED"}
    assert is_nim(cube) and list(offered()) == ["nim.revert"]
    press("nim.revert")
    press("nim.convert")
    assert is_nim(cube), "the next one is made as a whole again"


def test_the_panel_offers_to_make_the_others_that_are_selected(cube, press):
    press("nim.convert")
    bpy.ops.mesh.primitive_uv_sphere_add()
    other = bpy.context.object
    select(cube, other)
    assert list(offered()) == ["nim.convert", "nim.revert"]
    press_make(press)
    assert is_nim(other) and list(offered()) == ["nim.revert"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Enabling and disabling: nothing is left behind, and no work is done twice."""

import sys

import bpy

from nim_addon.cycles import versions
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
from nim_addon.ui.versions import update_opened_file


def registered():
    return {name for name in dir(bpy.types) if name.startswith(("NIM_", "nim_"))}


def test_enable_disable_enable_leaves_nothing(addon):
    import addon_utils

    before = registered()
    addon_utils.disable(addon, default_set=True)
    assert not registered()
    for kind in (bpy.types.Scene, bpy.types.Material, bpy.types.Object, bpy.types.WindowManager):
        assert not [name for name in kind.bl_rna.properties.keys() if name.startswith("nim")]  # noqa: SIM118
    addon_utils.enable(addon, default_set=True)
    assert registered() == before


def test_an_opened_file_is_brought_up_to_date(addon, data):
    bpy.ops.wm.open_mainfile(filepath=str(data / "earlier_version.blend"))
    assert {"First", "Linked", "Nodes"} <= set(bpy.data.materials.keys())
    assert not versions.outdated()
    assert not bpy.ops.nim.update_file.poll()


def test_a_file_that_was_open_before_is_updated_by_a_button_and_undo_takes_it_back(addon, data, press):
    import addon_utils

    addon_utils.disable(addon, default_set=True)
    bpy.ops.wm.open_mainfile(filepath=str(data / "earlier_version.blend"))
    assert len(versions.outdated()) == 2
    addon_utils.enable(addon, default_set=True)
    bpy.ops.ed.undo_push(message="Before")
    assert press("nim.update_file") == {"FINISHED"}
    assert not versions.outdated()
    bpy.ops.ed.undo()
    assert len(versions.outdated()) == 2


def test_looking_through_an_opened_file_takes_the_same_work_however_many_materials_are_in_it(addon):
    def work():
        calls = 0

        def counted(_, event, __):
            nonlocal calls
            calls += event in ("call", "c_call")

        sys.setprofile(counted)
        update_opened_file()
        sys.setprofile(None)
        return calls

    interface_material("First", Medium(-1.5), backend="nodes")
    one = work()
    for index in range(50):
        interface_material(f"{index}", Medium(-1.5), backend="nodes")
    assert work() <= one

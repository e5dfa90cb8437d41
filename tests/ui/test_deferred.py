# SPDX-License-Identifier: GPL-3.0-or-later
"""What timers do can change data where Blender's mark that it is read-only has stayed set."""

import bpy
import pytest

from nim_addon.ui import deferred, live


@pytest.fixture
def read_only(addon):
    """read_only(function) -> called while Blender has its data marked as read-only, as it does for a node that is asked."""
    acts = []

    class Asked(bpy.types.Node):
        bl_idname = "NIMTestAsked"
        bl_label = "Asked"

        @classmethod
        def poll(cls, tree):
            acts.pop()()
            return True

    bpy.utils.register_class(Asked)

    def called(function):
        failed = []

        def act():
            try:
                function()
            except Exception as error:
                failed.append(error)

        acts.append(act)
        bpy.data.node_groups.new("Asked", "ShaderNodeTree").nodes.new("NIMTestAsked")
        for error in failed:
            raise error

    yield called
    bpy.utils.unregister_class(Asked)


def darken():
    bpy.data.objects["Cube"].hide_render = True


def test_what_waits_can_change_data_where_others_cannot(read_only):
    cube = bpy.data.objects["Cube"]
    with pytest.raises(AttributeError, match="not allowed"):
        read_only(darken)
    assert not cube.hide_render
    read_only(lambda: deferred.do(darken))
    assert cube.hide_render


def test_it_returns_and_raises_what_is_called(read_only):
    found = []

    def outer(number):
        return deferred.writing(len, "x" * number)

    read_only(lambda: found.append(deferred.writing(outer, 3)))
    assert found == [3] == [deferred.writing(outer, 3)]
    for call in (read_only, lambda function: function()):
        with pytest.raises(ZeroDivisionError):
            call(lambda: deferred.writing(divmod, 1, 0))


def test_live_builds_there_too(read_only):
    bpy.context.window_manager.nim_live = True
    settings = bpy.context.scene.nim_scenes
    settings.scene, settings.backend = "sphere", "nodes"
    bpy.ops.nim.build_scene()
    bpy.context.scene.nim_scenes.sphere.companions = True
    read_only(live.tick)
    assert "Red" in bpy.context.scene.objects
    bpy.context.window_manager.nim_live = False

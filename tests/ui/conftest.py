# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the user interface share: the add-on enabled by Blender in a file as it starts for a person."""

import pytest


@pytest.fixture
def addon(default_file):
    """The add-on, enabled as the preferences do it; disabled afterwards. Yields its module name."""
    import addon_utils

    assert addon_utils.enable("nim_addon", default_set=True, handle_error=lambda error: (_ for _ in ()).throw(error))
    yield "nim_addon"
    addon_utils.disable("nim_addon", default_set=True)


@pytest.fixture
def press():
    """press(operator, **properties) -> its result set; an undo step is pushed, as for a person. Errors are raised."""
    import bpy

    def pressed(operator, **properties):
        group, _, name = operator.partition(".")
        return getattr(getattr(bpy.ops, group), name)("EXEC_DEFAULT", True, **properties)

    return pressed


@pytest.fixture
def settings(addon):
    """The settings of the scene that is shown, whichever that is by then."""

    import bpy

    class Current:
        def __getattr__(self, name):
            return getattr(bpy.context.scene.nim_scenes, name)

        def __setattr__(self, name, value):
            setattr(bpy.context.scene.nim_scenes, name, value)

    return Current()

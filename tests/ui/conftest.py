# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the user interface share: the add-on enabled by Blender in a file as it starts for a person."""

from types import SimpleNamespace

import bpy
import pytest


class Layout:
    """A layout that takes down what is drawn on it, as Blender's would take it."""

    enabled = True

    def __init__(self, drawn=None, shown=None):
        self.drawn = [] if drawn is None else drawn
        self.shown = [] if shown is None else shown  # the owners of the properties, in order

    def __getattr__(self, name):
        if name in ("row", "column", "box", "split", "grid_flow"):
            return lambda **_: Layout(self.drawn, self.shown)
        if name in ("label", "separator", "template_icon", "template_list"):
            return lambda *_, **values: self.drawn.append((name, values.get("text", values.get("icon_value"))))
        raise AttributeError(name)

    def panel(self, name, default_closed=False):
        assert default_closed
        self.drawn.append(("panel", name))
        return Layout(self.drawn, self.shown), Layout(self.drawn, self.shown)

    def prop(self, data, name, text=None, **_):
        assert name in data.bl_rna.properties, name
        self.drawn.append(("prop" if self.enabled else "greyed", name))
        self.shown.append(data)

    def operator(self, name, text=None, icon="NONE", depress=False, translate=True, emboss=True):
        group, _, verb = name.partition(".")
        getattr(getattr(bpy.ops, group), verb).get_rna_type()
        self.drawn.append(("operator", name))
        return SimpleNamespace()

    def menu(self, name, text=None, icon="NONE"):
        assert issubclass(getattr(bpy.types, name), bpy.types.Menu)
        self.drawn.append(("menu", name))

    @property
    def text(self):
        return "\n".join(str(value) for kind, value in self.drawn if kind == "label")


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

    def pressed(operator, **properties):
        group, _, name = operator.partition(".")
        return getattr(getattr(bpy.ops, group), name)("EXEC_DEFAULT", True, **properties)

    return pressed


@pytest.fixture
def settings(addon):
    """The settings of the scene that is shown, whichever that is by then."""

    class Current:
        def __getattr__(self, name):
            return getattr(bpy.context.scene.nim_scenes, name)

        def __setattr__(self, name, value):
            setattr(bpy.context.scene.nim_scenes, name, value)

    return Current()


@pytest.fixture
def draw():
    """draw(material, width) -> the Layout on which the panel of the Material properties was drawn."""

    def drawn(material, width=300):
        layout = Layout()
        context = SimpleNamespace(
            material=material,
            object=bpy.data.objects["Cube"],
            scene=bpy.context.scene,
            region=SimpleNamespace(width=width),
            preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0, pixel_size=1.0)),
        )
        bpy.types.NIM_PT_material.draw(SimpleNamespace(layout=layout), context)
        return layout

    return drawn

# SPDX-License-Identifier: GPL-3.0-or-later
"""A 3D view that another engine than Cycles draws says so where it shows an interface, and a button changes it."""

from types import SimpleNamespace

import blf
import bpy
import pytest

from nim_addon.cycles import settings
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium

from .conftest import Layout


@pytest.fixture
def view(addon):
    """The 3D view of the file that Blender starts with, in which a cube is a NIM."""
    from nim_addon.ui import warnings

    warnings.forget()
    settings.lossless(bpy.context.scene, "nodes")
    bpy.data.objects["Cube"].data.materials[0] = interface_material("NIM", Medium(-1.5), backend="nodes")
    bpy.context.view_layer.update()  # as a window does before it draws
    areas = [area for area in bpy.data.screens["Layout"].areas if area.type == "VIEW_3D"]
    return areas[0].spaces.active


def said(view):
    from nim_addon.ui import viewport

    return viewport.wrong_engine(view, bpy.context.scene)


@pytest.mark.parametrize(
    "shading, engine, wrong",
    [
        ("MATERIAL", "CYCLES", "EEVEE"),
        ("RENDERED", "BLENDER_WORKBENCH", "Workbench"),
        ("RENDERED", "CYCLES", None),
        ("SOLID", "BLENDER_WORKBENCH", None),
        ("WIREFRAME", "CYCLES", None),
    ],
)
def test_a_view_that_is_wrong_says_by_which_engine(view, shading, engine, wrong):
    view.shading.type, bpy.context.scene.render.engine = shading, engine
    assert said(view) == wrong


def test_nothing_is_said_where_there_is_no_interface(view):
    view.shading.type = "MATERIAL"
    assert said(view) == "EEVEE" and said(None) is None
    bpy.data.objects["Cube"].hide_render = True
    bpy.context.view_layer.update()
    assert said(view) is None


def test_the_button_shows_it_rendered(view, press):
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    area.spaces.active.shading.type = "RENDERED"
    assert said(area.spaces.active) == "Workbench"
    with bpy.context.temp_override(window=window, area=area):
        assert press("nim.view_rendered") == {"FINISHED"}
    assert area.spaces.active.shading.type == "RENDERED" and bpy.context.scene.render.engine == "CYCLES"
    assert said(area.spaces.active) is None


def test_undo_after_the_button_takes_back_the_next_step_alone(view, press):
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    bpy.ops.ed.undo_push(message="start")
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=area):
        press("nim.view_rendered")
    bpy.context.scene.cycles.transparent_max_bounces = 77
    bpy.ops.ed.undo_push(message="bounces")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert scene.cycles.transparent_max_bounces != 77 and scene.render.engine == "CYCLES"
    bpy.ops.ed.undo()
    assert bpy.context.scene.render.engine == "BLENDER_WORKBENCH"


def test_the_note_over_a_view_has_room_beside_what_lies_over_that(view):
    view.shading.type = "MATERIAL"

    def note(width, **over):
        from nim_addon.ui import viewport

        region = SimpleNamespace(type="WINDOW", x=0, width=width)
        others = [SimpleNamespace(type=kind, x=x, y=x, width=wide) for kind, (x, wide) in over.items()]
        area = SimpleNamespace(regions=[region, *others])
        system = SimpleNamespace(ui_scale=1.0)
        context = SimpleNamespace(space_data=view, scene=bpy.context.scene, region=region, area=area)
        context.preferences = SimpleNamespace(system=system)
        return viewport.note(context)

    assert note(2000) == [
        "EEVEE draws this view and cannot bend a ray backwards: it shows no refraction. Use Rendered, with Cycles."
    ]
    lines = note(400)
    assert " ".join(lines) == note(2000)[0] and len(lines) == 2 and len(note(400, TOOLS=(0, 150))) == 3
    assert note(400, UI=(250, 150)) == note(250) and note(400, UI=(0, 150)) == note(400, TOOLS=(0, 150))
    assert note(400, HUD=(5, 145)) == note(400, TOOLS=(0, 150)) and note(400, HEADER=(0, 400)) == lines
    assert note(400, UI=(399, 1)) == note(400, HUD=(0, 150)) == lines == note(400, UI=(400, 150)), (
        "hidden, or beside it"
    )
    assert all(blf.dimensions(0, line)[0] < 400 for line in lines)
    assert len(note(1)) == len(note(2000)[0].split()), "a word is not broken"
    view.shading.type = "SOLID"
    assert note(400) == []


@pytest.mark.parametrize("shading, shapes", [("SOLID", True), ("WIREFRAME", True), ("MATERIAL", False)])
def test_a_solid_view_says_that_it_shows_no_refraction(view, shading, shapes):
    from nim_addon.ui import viewport

    view.shading.type = shading
    assert viewport.shows_shapes(view, bpy.context.scene) == shapes
    layout = Layout()
    screen = SimpleNamespace(
        space_data=view,
        scene=bpy.context.scene,
        region=SimpleNamespace(width=300),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    assert viewport.draw_note(layout, screen) != shapes
    assert ("operator", "nim.view_rendered") in layout.drawn
    assert ("Solid views show no refraction" in layout.text) == shapes
    bpy.data.objects["Cube"].hide_render = True
    bpy.context.view_layer.update()
    assert not viewport.shows_shapes(view, bpy.context.scene)

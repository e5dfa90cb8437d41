# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu of presets: the pictures of the figures set a scene as they were rendered; a person's own are Blender's."""

import dataclasses
import types

import bpy
import pytest

from nim_addon.figures.registry import FIGURES
from nim_addon.renders.request import Request
from nim_addon.scenes import SCENES
from nim_addon.ui import presets, scene_settings

OFFERED = [
    (name, figure, recipe) for name in SCENES for figure, recipes in presets.recipes_of(name) for recipe in recipes
]

# As an earlier version brought it along, and as Blender writes one.
FILE = """# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

settings = bpy.context.scene.nim_scenes.pool
settings.liquid = "nim"
settings.liquid_n = -1.33
settings.mu = -10.0
settings.use_mu = True
settings.view = "window"
settings.sky = "sunny"
settings.sun_angle = 0.53
settings.waves = 0.04
settings.seed = 1
settings.time = 0.0
"""


@pytest.fixture
def own(monkeypatch, tmp_path):
    """The folder of a person's own presets of the sphere, empty."""

    def resource(kind, path="", create=False):
        folder = tmp_path / path
        folder.mkdir(parents=True, exist_ok=True)
        return str(folder)

    folder = tmp_path / "presets" / "nim_addon" / "sphere"
    monkeypatch.setattr(bpy.utils, "user_resource", resource)
    monkeypatch.setattr(bpy.utils, "preset_paths", lambda subdir: [str(folder)] if folder.is_dir() else [])
    return folder


def spoil(group):
    """Set a group of settings to anything but a preset."""
    for name in type(group).__annotations__:
        known = group.bl_rna.properties[name]
        if known.type == "ENUM":
            setattr(group, name, known.enum_items[-1].identifier)
        elif known.type == "BOOLEAN":
            setattr(group, name, not known.default)
        elif known.type in ("FLOAT", "INT"):
            setattr(group, name, known.hard_max)


@pytest.mark.parametrize(
    ("name", "figure", "recipe"), OFFERED, ids=[f"{figure.number}-{recipe.name}" for _, figure, recipe in OFFERED]
)
def test_a_picture_sets_all_as_it_was_rendered(settings, press, name, figure, recipe):
    settings.scene = name
    spoil(getattr(settings, name))
    assert press("nim.load_figure", scene=name, figure=figure.number, recipe=recipe.name) == {"FINISHED"}
    assert settings.problem == ""
    wanted = Request.of(name, recipe.settings).parameters
    assert (scene_settings.parameters_of(settings), settings.spectral) == (wanted, recipe.spectral)
    assert presets.MENUS[name].bl_label == f"Figure {figure.number}: {presets.caption(recipe.caption)}"


def test_all_that_the_panel_can_set_is_offered():
    assert len(OFFERED) == len({(figure.number, recipe.name) for _, figure, recipe in OFFERED}) >= 39
    # and what only a figure has of its own, a camera or a scene, is not
    offered = {(figure.number, recipe.name) for _, figure, recipe in OFFERED}
    left_out = [
        recipe
        for figure in FIGURES.values()
        for recipe in figure.recipes
        if recipe.shown and (figure.number, recipe.name) not in offered
    ]
    assert left_out and all(recipe.pose or recipe.change or recipe.scene not in SCENES for recipe in left_out)


def test_a_caption_reads_as_a_label():
    captions = {
        "water": "Water",
        "NIM, mu = -10": "NIM, μ = -10",
        "n = -1.5": "n = -1.5",
        "eta = -1": "η = -1",
        "20 degrees off the vertical": "20 degrees off the vertical",
        "multi": "Multi",
    }
    assert {text: presets.caption(text) for text in captions} == captions


@pytest.mark.parametrize("name", SCENES)
def test_the_menu_shows_each_with_its_caption_under_the_title_of_its_figure(addon, name):
    drawn = []

    def operator(idname, text, **how):
        drawn.append(types.SimpleNamespace(idname=idname, text=text))
        return drawn[-1]

    layout = types.SimpleNamespace(operator=operator, label=lambda text, **how: drawn.append(text))
    menu = presets.MENUS[name]
    stand_in = types.SimpleNamespace(layout=layout, scene=menu.scene, preset_subdir=menu.preset_subdir)
    menu.draw(stand_in, bpy.context)
    expected = []
    for figure, recipes in presets.recipes_of(name):
        expected += [
            f"Figure {figure.number}: {presets.caption(figure.title)}",
            *(presets.caption(recipe.caption) for recipe in recipes),
        ]
    assert [item if isinstance(item, str) else item.text for item in drawn] == expected
    for item in drawn:
        if not isinstance(item, str):
            assert bpy.ops.nim.load_figure(scene=item.scene, figure=item.figure, recipe=item.recipe) == {"FINISHED"}


def test_undo_takes_a_picture_back(settings, press):
    settings.scene, settings.sphere.n = "sphere", -2.0
    bpy.ops.ed.undo_push(message="Set")
    press("nim.load_figure", scene="sphere", figure="5.4", recipe="sphere_-1.33")
    assert settings.sphere.n == pytest.approx(-1.33)
    bpy.ops.ed.undo()
    assert settings.sphere.n == -2.0


def test_what_is_no_picture_of_the_scene_is_said(settings, press):
    for given in ({"scene": "glass", "figure": "5.4", "recipe": "sphere_-1.33"}, {"scene": "cellar"}, {}):
        with pytest.raises(RuntimeError, match="is no preset of this scene"):
            press("nim.load_figure", **given)


def test_a_view_that_a_picture_sets_moves_the_camera_of_a_built_scene(settings, press):
    settings.scene, settings.pool.view = "pool", "window"
    press("nim.build_scene")
    before = bpy.context.scene.camera.matrix_basis.copy()
    press("nim.load_figure", scene="pool", figure="5.3", recipe="nim_side")
    assert settings.pool.view == "side" and bpy.context.scene.camera.matrix_basis != before


def test_a_person_saves_and_removes_presets(settings, press, own):
    settings.scene, settings.sphere.n = "sphere", -2.0
    assert press("nim.preset", name="Mine") == {"FINISHED"}
    file = own / "Mine.py"
    settings.sphere.n = 1.5
    press("nim.load_preset", filepath=str(file), menu_idname="NIM_MT_sphere_presets")
    assert settings.sphere.n == -2.0
    with pytest.raises(RuntimeError, match="choose another name"):
        press("nim.preset", name="Mine")
    # the one that was loaded last is now a picture of a figure: it stays, and so does what is not named
    press("nim.load_figure", scene="sphere", figure="5.4", recipe="sphere_1.5")
    with pytest.raises(RuntimeError, match="is not one of your own"):
        press("nim.preset", remove_active=True)
    press("nim.load_preset", filepath=str(file), menu_idname="NIM_MT_sphere_presets")
    assert press("nim.preset", remove_active=True) == {"FINISHED"}
    assert not file.exists()
    with pytest.raises(RuntimeError, match="is no preset"):
        press("nim.load_preset", filepath=str(own / "none.py"), menu_idname="NIM_MT_sphere_presets")


def test_the_menu_shows_a_persons_own_after_those_of_the_figures(addon, press, own):
    bpy.context.scene.nim_scenes.scene = "sphere"
    press("nim.preset", name="Mine")
    shown = []
    layout = types.SimpleNamespace(
        operator=lambda idname, **how: types.SimpleNamespace(),
        label=lambda **how: None,
        separator=lambda: shown.append("line"),
    )
    menu = presets.MENUS["sphere"]
    stand_in = types.SimpleNamespace(
        layout=layout,
        scene=menu.scene,
        preset_subdir=menu.preset_subdir,
        bl_idname=menu.bl_idname,
        path_menu=lambda folders, operator, **how: shown.append((folders, operator, how["props_default"])),
    )
    menu.draw(stand_in, bpy.context)
    assert shown == ["line", ([str(own)], "nim.load_preset", {"menu_idname": "NIM_MT_sphere_presets"})]


def test_a_preset_of_an_earlier_version_loads(settings, press, tmp_path):
    file = tmp_path / "Figure_5.10_NIM_mu_-10.py"
    file.write_text(FILE)
    settings.scene = "pool"
    assert press("nim.load_preset", filepath=str(file), menu_idname="NIM_MT_pool_presets") == {"FINISHED"}
    expected = SCENES["pool"].parameters(liquid="nim", mu=-10, view="window", sky="sunny", waves=0.04)
    assert scene_settings.parameters_of(settings) == expected
    assert presets.MENUS["pool"].bl_label == "Figure 5.10 NIM mu -10"


def test_a_picture_in_all_wavelengths_sets_that_too(settings, press, monkeypatch):
    name, figure, recipe = OFFERED[0]
    spectral = dataclasses.replace(recipe, spectral=True)
    monkeypatch.setattr(presets, "recipes_of", lambda scene: [(figure, [spectral])])
    settings.scene = name
    press("nim.load_figure", scene=name, figure=figure.number, recipe=recipe.name)
    assert settings.spectral
    monkeypatch.setattr(presets, "recipes_of", lambda scene: [(figure, [recipe])])
    press("nim.load_figure", scene=name, figure=figure.number, recipe=recipe.name)
    assert not settings.spectral

# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes panel: its settings mirror the dataclasses, and its operators do what they say."""

import dataclasses
import shlex
from pathlib import Path

import bpy
import pytest

from nim_addon import checks, command
from nim_addon.cycles import spectral
from nim_addon.physics import MEDIA, Medium
from nim_addon.scenes import SCENES, scene_type
from nim_addon.scenes import stage as stages
from nim_addon.ui import jobs, scene_settings, scenes, variants

FIELDS = [(name, field) for name, chosen in SCENES.items() for field in dataclasses.fields(chosen.parameters)]


@pytest.fixture
def build(press):
    """build() -> the bpy.types.Scene that the button made, materials in nodes."""

    def built():
        assert press("nim.build_scene") == {"FINISHED"}
        return bpy.context.scene

    return built


@pytest.mark.parametrize(("name", "field"), FIELDS, ids=[f"{name}-{field.name}" for name, field in FIELDS])
def test_each_property_mirrors_its_field(settings, name, field):
    group = getattr(settings, name)
    shown = group.bl_rna.properties[field.name]
    data = field.metadata
    assert shown.name
    assert shown.description.lower().startswith(data["description"].lower())
    if data["kind"] in ("number", "integer"):
        assert (shown.hard_min, shown.hard_max) == (data["low"], data["high"])
    elif data["kind"] in ("choice", "mesh"):
        # the numbers are in people's files: a new choice comes last
        assert [(item.identifier, item.value) for item in shown.enum_items][: len(data["choices"])] == [
            (word, number) for number, word in enumerate(data["choices"])
        ]
    if shown.type == "ENUM":
        assert all(item.description for item in shown.enum_items), "a tooltip for every choice"
    own = scene_settings.value_of(group, field)
    assert own == (field.default if not isinstance(own, str) else str(field.default))


def test_numbers_of_enums_are_what_older_files_hold(settings):
    def numbers(group, name):
        return {item.identifier: item.value for item in group.bl_rna.properties[name].enum_items}

    assert numbers(bpy.context.scene.nim_scenes, "scene") == {
        "glass": 0,
        "pool": 1,
        "sphere": 2,
        "sea": 3,
        "prism": 4,
        "drop": 5,
        "lens": 6,
        "ball": 7,
        "window": 8,
    }
    assert numbers(settings.pool, "view") == {"side": 0, "top": 1, "window": 2}
    assert numbers(settings.pool, "sky") == {"overcast": 0, "sunny": 1}
    assert numbers(settings.glass, "figures") == {"none": 0, "monkey": 1, "file": 100}
    assert numbers(settings.glass, "liquid")["nim"] == 3
    assert {*MEDIA.values()} - {MEDIA["air"]} == {
        MEDIA[word] for word in scene_settings.LIQUID_NUMBERS if word in MEDIA
    }


def test_settings_give_the_numbers_a_person_typed(settings):
    settings.scene = "sphere"
    settings.sphere.n, settings.sphere.use_mu, settings.sphere.mu = -1.33, True, -2.7
    assert scene_settings.parameters_of(settings) == SCENES["sphere"].parameters(n=-1.33, mu=-2.7)
    settings.scene = "glass"
    settings.glass.liquid, settings.glass.liquid_n = "custom", -1.1
    assert scene_settings.parameters_of(settings).liquid == Medium(-1.1)
    settings.glass.use_liquid_mu, settings.glass.liquid_mu = True, -3
    assert scene_settings.parameters_of(settings).liquid == Medium(-1.1, -3)


def test_a_medium_is_written_as_on_the_command_line(settings):
    settings.scene = "glass"
    settings.glass.liquid, settings.glass.liquid_words = "words", "n=-1.33,length=0.05"
    assert scene_settings.parameters_of(settings).liquid == Medium.parse("n=-1.33,length=0.05")
    settings.glass.liquid_words = "n-bk8"
    assert "did you mean n-bk7?" in settings.problem
    settings.scene = "sphere"
    settings.sphere.n_medium, settings.sphere.n_words = "words", "gold"
    assert scene_settings.parameters_of(settings) == SCENES["sphere"].parameters(n="gold")
    settings.sphere.n_medium = "number"
    assert scene_settings.parameters_of(settings) == SCENES["sphere"].parameters()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("sphere", ["n=n-bk7"]),
        ("sphere", ["n=-1.33+1e-07j", "mu=-10"]),
        ("sphere", ["n=-1.33", "mu=-10"]),
        ("pool", ["liquid=gold", "waves=0.1"]),
        ("pool", ["liquid=n=-1.33,length=2", "mu=-10"]),
        ("sea", ["liquid=n=1.21"]),
        ("glass", ["liquid=none"]),
    ],
)
def test_a_panel_takes_over_any_medium(settings, name, words):
    parameters = SCENES[name].parameters.read(words)
    settings.scene = name
    scene_settings.take(getattr(settings, name), parameters)
    assert scene_settings.parameters_of(settings) == parameters
    scene_settings.take(getattr(settings, name), SCENES[name].parameters())
    assert scene_settings.parameters_of(settings) == SCENES[name].parameters()


@pytest.mark.parametrize("name", SCENES)
def test_build_shows_the_scene_with_its_settings(settings, build, name):
    settings.scene, settings.quality = name, "DRAFT"
    home = bpy.context.scene
    home_objects = set(home.objects)
    scene = build()
    assert scene != home
    assert scene[stages.STAGE_MARK] == name
    assert set(home.objects) == home_objects
    assert bpy.context.window.scene == scene
    assert settings.scene == name
    assert (scene.cycles.samples, scene.render.resolution_percentage) == (32, 50)
    settings.quality = "FINAL"  # a built scene follows at once
    assert (scene.cycles.samples, scene.render.resolution_percentage) == (2048, 100)
    views = [area.spaces.active for area in bpy.context.screen.areas if area.type == "VIEW_3D"]
    assert all(view.region_3d.view_perspective == "CAMERA" for view in views)


def test_a_new_view_moves_the_camera_and_nothing_else(settings, build):
    settings.scene = "pool"
    scene = build()
    objects, before = set(scene.objects), scene.camera.matrix_basis.copy()
    settings.pool.waves = 0.1
    assert scene.camera.matrix_basis == before
    settings.pool.view = "window"
    assert set(scene.objects) == objects
    moved = scene.camera.matrix_basis.copy()
    assert moved != before
    assert (build().camera.matrix_basis, scene.camera.data.sensor_fit) == (moved, "VERTICAL")


def test_building_again_keeps_what_a_person_added_and_undo_brings_the_former_back(settings, build):
    settings.scene = "sphere"
    scene = build()
    mine = bpy.data.objects.new("Mine", None)
    scene.collection.objects.link(mine)
    bpy.ops.ed.undo_push(message="added")
    settings.sphere.companions = True
    bpy.ops.ed.undo_push(message="set")
    build()
    assert {"Mine", "Red", "Blue"} <= set(bpy.context.scene.objects.keys())
    bpy.ops.ed.undo()
    scene = bpy.data.scenes["NIM sphere"]
    assert {"Mine", "Sphere"} <= set(scene.objects.keys())
    assert "Red" not in scene.objects
    assert scene.camera


def test_undo_of_the_first_build_leaves_the_file_as_it_was(settings, press):
    before = set(bpy.data.scenes.keys()), set(bpy.data.objects.keys())
    bpy.ops.ed.undo_push(message="start")
    press("nim.build_scene")
    assert "NIM glass" in bpy.data.scenes
    bpy.ops.ed.undo()
    assert (set(bpy.data.scenes.keys()), set(bpy.data.objects.keys())) == before
    assert bpy.context.window.scene.name == "Scene"


CLASHES = [
    ("pool", {"liquid": "none", "use_mu": True}, "needs a liquid"),
    ("sphere", {"n": 1.5, "use_mu": True, "mu": -1.0}, "a positive index needs mu above 0"),
    ("sphere", {"n": 0.0}, "refracts nothing"),
    ("glass", {"figures": "file", "figures_file": "/nowhere/bunny.ply"}, "there is no file"),
]


@pytest.mark.parametrize(("name", "values", "says"), CLASHES, ids=[clash[2] for clash in CLASHES])
def test_settings_that_clash_get_one_sentence_and_nothing_is_built(settings, press, one_sentence, name, values, says):
    settings.scene = name
    for key, value in values.items():
        setattr(getattr(settings, name), key, value)
    one_sentence(settings.problem, says)
    for operator in ("nim.build_scene", "nim.copy_command", "nim.render_headless", "nim.render_variants"):
        with pytest.raises(RuntimeError, match=says):
            press(operator)
    assert len(bpy.data.scenes) == 1


def test_a_mesh_file_that_holds_no_mesh_leaves_everything_as_it_was(settings, press, tmp_path):
    (tmp_path / "empty.stl").write_text("solid\nendsolid\n")
    settings.glass.figures, settings.glass.figures_file = "file", str(tmp_path / "empty.stl")
    before = set(bpy.data.user_map())
    with pytest.raises(RuntimeError, match="there is no mesh to be read"):
        press("nim.build_scene")
    assert set(bpy.data.user_map()) == before


def settings_of(line):
    """Scene, parameters and the rest of a `nimray render` line, as the command itself reads it."""
    words = shlex.split(line)
    assert words[0] == "nimray"
    arguments = command.parser().parse_args(words[1:])
    size = arguments.size((800, 600)) if arguments.size else (800, 600)
    parameters = scene_type(arguments.scene).parameters.read(arguments.assignments)
    return arguments.scene, parameters, arguments.samples, size, arguments.backend


def test_copied_command_renders_the_same(settings, press, tmp_path):
    mesh = tmp_path / "my bunny.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    settings.quality, settings.backend = "DRAFT", "nodes"
    values = {"figures": "file", "figures_file": str(mesh), "liquid": "nim-mu10", "straw": False, "view": "top"}
    for key, value in values.items():
        setattr(settings.glass, key, value)
    assert press("nim.copy_command") == {"FINISHED"}
    line = scenes.quoted(["nimray", *scenes.render_words(bpy.context.scene.nim_scenes)])
    assert settings_of(line) == ("glass", scene_settings.parameters_of(settings), 32, (400, 300), "nodes")


def test_nothing_is_left_when_the_add_on_is_disabled(addon):
    import addon_utils

    addon_utils.disable(addon, default_set=True)
    assert not hasattr(bpy.types.Scene, "nim_scenes")


def test_a_scene_is_built_in_all_wavelengths_and_taken_back(settings, build, press):
    settings.scene, settings.quality, settings.backend = "sphere", "DRAFT", "nodes"
    settings.sphere.n_medium, settings.sphere.n_words = "words", "nim-causal"
    settings.spectral = True
    assert not spectral.is_spectral(bpy.context.scene), "which is not built"
    scene = build()
    assert scene.nim_scenes.spectral and spectral.is_spectral(scene) and checks.problems(scene) == []
    settings.spectral = False
    assert not spectral.is_spectral(scene)
    settings.spectral = True
    build()
    assert spectral.is_spectral(scene) and checks.problems(scene) == [], "and what is new in it shines in colours too"
    press("nim.spectral")
    assert not settings.spectral and not spectral.is_spectral(scene)
    press("nim.spectral")
    assert settings.spectral and spectral.is_spectral(scene)


def test_the_command_of_a_spectral_scene(settings):
    settings.scene, settings.spectral = "sphere", True
    words = scenes.render_words(bpy.context.scene.nim_scenes)
    assert words[words.index("--set") :][1] == "spectral=yes"
    assert jobs.request_of(bpy.context.scene.nim_scenes).spectral
    work = variants.all_variants(bpy.context.scene.nim_scenes, Path("nowhere"))
    assert all(request.spectral for request in work.requests.values()) and work.compared["set"] == ["spectral=yes"]
    assert "spectral" in work.joined

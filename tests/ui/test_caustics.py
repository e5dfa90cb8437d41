# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that bakes caustics: what it makes, when it is out of date, how it stops, what it says."""

import types

import bpy
import numpy as np
import pytest

from nim_addon import caustics as engine
from nim_addon.base.streams import quiet
from nim_addon.caustics import baking, frames
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces
from nim_addon.ui import caustics, caustics_bake, caustics_looks, deferred

KINDS = (
    "scenes",
    "objects",
    "meshes",
    "materials",
    "lights",
    "cameras",
    "worlds",
    "images",
    "node_groups",
    "collections",
)


@pytest.fixture
def scene(addon, monkeypatch):
    """The default file with a ball of NIM over a floor in the sun; a million photons are twenty thousand."""
    monkeypatch.setattr(caustics_bake, "MILLION", 20_000)
    monkeypatch.setattr(caustics_bake, "ROUND", 5_000)
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 14)
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    add("Floor", shapes.rectangle((-4, -4), (4, 4), -1.0), surfaces.plain("Floor", (0.5, 0.5, 0.5)))
    add("Ball", shapes.cube_sphere(8), interface_material("NIM", Medium(-1.5), backend="nodes"))
    lamp = scene.objects["Light"]
    lamp.data.type, lamp.rotation_euler = "SUN", (0, 0, 0)
    scene.nim_caustics.photons, scene.nim_caustics.texels = 1, "512"
    bpy.ops.ed.undo_push(message="Scene")
    return scene


def add(name, mesh, material):
    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(mesh[0]).tolist(), [], mesh[1])
    data.materials.append(material)
    object_ = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(object_)
    return object_


def names():
    return {kind: {item.name for item in getattr(bpy.data, kind)} - {"Render Result"} for kind in KINDS}


def known(scene):
    """What the panel knows, after what was changed has reached the scene."""
    bpy.context.view_layer.update()
    return caustics_looks.LOOKS.known(scene)


def drawn(scene, shading="SOLID"):
    """The texts of the panel, and the buttons without one, beside a 3D view of that shading."""
    texts = []

    def draw(name, *given, **how):
        text = how.get("text") or (given[0] if name == "operator" and "text" not in how else "")
        if text:
            texts.append(text)
        return layout

    layout = types.SimpleNamespace()
    for name in ("row", "column", "operator", "label", "progress", "prop"):
        setattr(layout, name, lambda *given, name=name, **how: draw(name, *given, **how))
    view = types.SimpleNamespace(system=types.SimpleNamespace(ui_scale=1))
    space = types.SimpleNamespace(active=types.SimpleNamespace(shading=types.SimpleNamespace(type=shading)))
    screen = types.SimpleNamespace(areas=[types.SimpleNamespace(type="VIEW_3D", spaces=space)])
    region = types.SimpleNamespace(width=600)
    context = types.SimpleNamespace(scene=scene, region=region, preferences=view, screen=screen)
    caustics.NIM_PT_caustics.draw(types.SimpleNamespace(layout=layout), context)
    return " | ".join(texts)


def test_the_button_bakes_and_clear_gives_the_scene_back(scene, press, capfd):
    before = names()
    assert "Bake Caustics | No caustics yet | Sun: Light" in drawn(scene), "there is nothing yet to show"
    with pytest.raises(RuntimeError, match="This scene has no baked caustics"):
        press("nim.clear_caustics")
    assert press("nim.bake_caustics") == {"FINISHED"}
    report = engine.baked(scene)[engine.REPORT].to_dict()
    assert report["photons"] == pytest.approx(20_000, rel=0.01)
    assert report["seconds"] > 0
    image = next(image for image in bpy.data.images if image.name.startswith(engine.COLLECTION))
    assert report["megabytes"] == pytest.approx(image.size[0] * image.size[1] * 16 / 1e6)
    assert scene.objects["Floor"].hide_render
    assert not {
        name for name in names()["scenes"] | names()["materials"] if name.startswith("NIM p")
    }  # no photons left
    text = drawn(scene)
    assert "Bake Again | nim.view_rendered | Up to date | Light lands on copies of Floor, hidden meanwhile | " in text
    assert "Caustics baked onto Floor, hidden now behind copies that shine: " in capfd.readouterr().out
    assert text.split(" | ")[4].startswith("1 million photons in 0:") and text.split(" | ")[4].endswith(" MB")
    engine.baked(scene)[engine.REPORT]["seconds"], engine.baked(scene)[engine.REPORT]["megabytes"] = 75.0, 12.4
    caustics_looks.forget()
    known(scene)
    assert "1 million photons in 1:15, 12 MB" in drawn(scene)
    assert press("nim.clear_caustics") == {"FINISHED"}
    assert names() == before
    assert not scene.objects["Floor"].hide_render
    assert "No caustics yet" in drawn(scene)


def test_the_button_that_shows_them_stands_there_until_a_view_does(scene, press):
    """Cycles is what shows them: Rendered by EEVEE is not enough."""
    press("nim.bake_caustics")
    assert scene.render.engine != "CYCLES"
    for shading in ("SOLID", "MATERIAL", "RENDERED"):
        assert "nim.view_rendered" in drawn(scene, shading)
    scene.render.engine = "CYCLES"
    assert "nim.view_rendered" in drawn(scene, "MATERIAL") and "nim.view_rendered" not in drawn(scene, "RENDERED")


def test_a_new_scene_is_traced_quickly_and_what_was_baked_goes_on_as_it_was(scene, press, tmp_path):
    """Earlier versions traced 16 million where nobody said how many."""
    assert bpy.data.scenes.new("New").nim_caustics.photons == 4
    press("nim.bake_caustics")
    report = engine.baked(scene)[engine.REPORT]
    report["settings"] = ["16", "512", "0"]
    frames_of = bpy.data.scenes.new("Frames")
    frames.Frames("//x", 16 * engine.MILLION, 512).keep(frames_of)
    for name in ("Scene", "Frames"):
        bpy.data.scenes[name].nim_caustics.property_unset("photons")
    bpy.data.scenes.new("Chosen").nim_caustics.photons = 2
    frames.Frames("//x", 16 * engine.MILLION, 512).keep(bpy.data.scenes["Chosen"])
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "former.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "former.blend"))
    photons = {scene.name: scene.nim_caustics.photons for scene in bpy.data.scenes}
    assert photons == {"Scene": 16, "Frames": 16, "Chosen": 2, "New": 4}


@pytest.mark.parametrize("report", [{"photons": 20000.0}, {"size": 1}, 3])
def test_a_report_of_an_early_version_is_unknown_in_what_it_lacks(scene, press, report):
    press("nim.bake_caustics")
    collection = engine.baked(scene)
    collection[engine.REPORT] = report
    caustics.keep_photons()
    assert known(scene).report == (report if isinstance(report, dict) else {})
    assert ("not known: bake again" in drawn(scene)) == isinstance(report, dict)
    scene.objects["Ball"].location.x += 0.1
    scene.view_layers[0].update()
    assert frames.wanted(scene) == (20000 if report == {"photons": 20000.0} else engine.PHOTONS, None)


def test_it_is_out_of_date_by_what_counts_and_by_nothing_else(scene, press):
    press("nim.bake_caustics")
    scene.camera.location.x += 1
    assert not known(scene).stale
    with pytest.raises(RuntimeError, match="up to date"):
        press("nim.bake_caustics")
    ball, light = scene.objects["Ball"], scene.objects["Light"]
    index = bpy.data.materials["NIM"].node_tree.nodes["NIM Interface"].inputs["Index Inside"]
    changes = [
        (lambda: setattr(ball.location, "x", 0.5), lambda: setattr(ball.location, "x", 0.0)),
        (lambda: setattr(index, "default_value", -1.4), lambda: setattr(index, "default_value", -1.5)),
        (lambda: setattr(light.data, "energy", 7.0), lambda: setattr(light.data, "energy", 1000.0)),
    ]
    for change, back in changes:
        change()
        assert known(scene).stale
        assert caustics_bake.NIM_OT_bake_caustics.poll(bpy.context)
        assert "Out of date" in drawn(scene)
        back()
        assert not known(scene).stale
    ball.location.x = 0.5
    ball.keyframe_insert("location", frame=10)
    ball.location.x = 0.0
    ball.keyframe_insert("location", frame=1)
    scene.frame_set(10)
    assert caustics_looks.LOOKS.known(scene).stale
    scene.frame_set(1)
    assert not caustics_looks.LOOKS.known(scene).stale
    scene.nim_caustics.seed = 5  # other noise: nothing is out of date, but there is something to bake
    assert not known(scene).stale
    assert press("nim.bake_caustics") == {"FINISHED"}


def test_a_look_is_not_taken_for_a_change_and_only_what_counts_is_looked_at(scene, press, monkeypatch):
    press("nim.bake_caustics")
    bpy.context.view_layer.update()
    looks = []
    real = engine.out_of_date
    monkeypatch.setattr(engine, "out_of_date", lambda *given: looks.append(1) or real(*given))
    ball, camera = scene.objects["Ball"], scene.camera
    assert not known(scene).stale and len(looks) == 1
    for change in (
        lambda: None,
        lambda: ball.select_set(not ball.select_get()),
        lambda: setattr(bpy.context.view_layer.objects, "active", camera),
        lambda: setattr(camera.location, "x", camera.location.x + 1),
        lambda: setattr(camera.data, "lens", 70),
        lambda: setattr(scene.render, "resolution_x", 99),
        lambda: setattr(scene.cycles, "samples", 9),
    ):
        change()
        assert not known(scene).stale
    assert len(looks) == 1
    scene.objects["Floor"].location.z -= 0.1  # which is hidden while its copy shines
    assert known(scene).stale and len(looks) == 2
    # what is edited is not looked at before it is left
    bpy.context.view_layer.objects.active = ball
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.translate(value=(0, 0, 0.5))
    scene.objects["Floor"].location.z += 0.1
    assert known(scene).stale and len(looks) == 2
    bpy.ops.object.mode_set(mode="OBJECT")
    assert known(scene).stale and len(looks) == 3


def test_a_change_is_looked_at_once_it_is_still(monkeypatch):
    """Without a window there are no timers: these stand for Blender's."""
    timers, now, done = {}, [100.0], []
    stand_in = types.SimpleNamespace(
        is_registered=lambda function: function in timers,
        register=lambda function, first_interval: timers.update({function: now[0] + first_interval}),
        unregister=timers.pop,
    )
    manager = types.SimpleNamespace(windows=[])
    stand_in = types.SimpleNamespace(
        app=types.SimpleNamespace(background=False, timers=stand_in),
        context=types.SimpleNamespace(window_manager=manager),
        data=bpy.data,
    )
    monkeypatch.setattr(deferred, "bpy", stand_in)
    monkeypatch.setattr(deferred, "time", types.SimpleNamespace(monotonic=lambda: now[0]))

    def wait(seconds):
        now[0] += seconds
        for function in [timer for timer, due in timers.items() if due <= now[0] + 1e-9]:
            again = function()
            del timers[function]
            if again is not None:
                timers[function] = now[0] + again

    deferred.do(done.append, "late", after=0.5)
    deferred.do(done.append, "soon")
    wait(0)
    assert done == ["soon"]
    for _ in range(3):
        wait(0.4)
        deferred.do(done.append, "late", after=0.5)
    assert done == ["soon"]
    deferred.do(lambda: deferred.do(done.append, "more"))
    wait(0)
    assert done == ["soon", "more"]
    wait(0.5)
    assert done == ["soon", "more", "late"] and not timers


def test_one_undo_takes_it_back(scene, press):
    before = names()
    press("nim.bake_caustics")
    assert names() != before
    bpy.ops.ed.undo()
    assert names() == before
    scene = bpy.context.scene
    assert not scene.objects["Floor"].hide_render and not known(scene).baked
    bpy.ops.ed.redo()
    assert known(bpy.context.scene).baked


def pressed(reports):
    """What the operator has while it is modal: Blender makes no instance of it without a window."""
    return caustics_bake.Press(lambda level, text: reports.append((level, text)))


def test_stopped_early_nothing_is_changed_and_after_two_rounds_the_rest_is_kept(scene, one_sentence):
    before, reports = names(), []
    press = pressed(reports)
    assert press.tick(scene) == press.tick(scene) == set()  # started, and a round
    with pytest.raises(RuntimeError, match="being baked"):
        bpy.ops.nim.bake_caustics()
    assert press.stop() == {"CANCELLED"}
    assert names() == before and "nothing is changed" in reports[-1][1]
    press = pressed(reports)
    for _ in range(3):
        press.tick(scene)
    assert press.run.part == 0.5 and "left" in press.run.text()
    press.run.started -= 90
    assert press.stop() == {"FINISHED"}
    assert "onto Floor, hidden now behind copies that shine: 0.5 million photons in 1:3" in reports[-1][1]
    assert "| 0.5 million photons in 1:3" in drawn(scene)
    said = "Stopped at 0.5 of 1 million photons: Bake Again traces them all"
    assert said in drawn(scene) and "Up to date" not in drawn(scene)
    assert caustics_bake.NIM_OT_bake_caustics.poll(bpy.context)  # there are more to trace
    scene.objects["Ball"].location.x = 0.5
    assert known(scene).stale and "Out of date" in drawn(scene) and "Stopped at" not in drawn(scene)
    scene.objects["Ball"].location.x = 0.0
    bpy.ops.nim.bake_caustics()
    assert "Up to date" in drawn(scene)


def test_a_scene_that_changes_or_goes_ends_it(scene, addon):
    before, reports = names(), []
    press = pressed(reports)
    for _ in range(5):
        assert press.tick(scene) == set()
    scene.objects["Ball"].location.x = 0.3
    assert press.tick(scene) == {"CANCELLED"}
    assert names() == before and "changed while" in reports[-1][1]
    press = pressed(reports)
    press.tick(scene)
    bpy.ops.ed.undo_push(message="Meanwhile")
    bpy.ops.ed.undo()
    assert press.tick(bpy.context.scene) == {"CANCELLED"} and caustics_bake.under_way() is None
    press = pressed(reports)
    other = bpy.data.scenes.new("Other")
    press.tick(bpy.context.scene)
    bpy.context.window.scene = other
    bpy.data.scenes.remove(bpy.data.scenes["Scene"])
    assert press.tick(other) == {"CANCELLED"} and caustics_bake.under_way() is None
    assert not [scene.name for scene in bpy.data.scenes if scene.name.startswith("NIM")]


def test_another_file_or_the_end_of_the_add_on_ends_it(scene, addon):
    import addon_utils

    press = pressed([])
    press.tick(scene)
    addon_utils.disable(addon, default_set=True)
    assert caustics_bake.under_way() is None and "NIM photons" not in bpy.data.scenes
    addon_utils.enable(addon, default_set=True)
    press = pressed([])
    press.tick(bpy.context.scene)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert press.tick(bpy.context.scene) == {"CANCELLED"} and caustics_bake.under_way() is None


def test_what_cannot_be_baked_is_said_in_one_sentence(scene, press):
    before = names()
    light, ball, floor = (scene.objects[name] for name in ("Light", "Ball", "Floor"))

    def refused(words):
        with pytest.raises(RuntimeError, match=words):
            press("nim.bake_caustics")
        assert names() == before and caustics_bake.under_way() is None

    light.hide_render = True
    assert "No lamp shines here (hidden from renders, or without power: Light)" in drawn(scene)
    refused(r"no light to trace \(hidden from renders, or without power: Light\); let one shine")
    hall = bpy.data.collections.new("Hall")
    scene.collection.children.link(hall)
    hall.objects.link(light)
    bpy.context.collection.objects.unlink(light)
    light.hide_render, hall.hide_render = False, True
    before["collections"].add("Hall")
    refused("without power: Light")
    hall.hide_render, light.data.type, light.location = False, "POINT", ball.location
    refused("stands within a medium")
    light.data.type, ball.hide_render = "SUN", True
    refused("no interface or mirror")
    ball.hide_render, floor.scale = False, (0, 0, 0)
    refused("no area for light to land on")
    floor.hide_render = True
    refused(r"no diffuse surface for light to land on \(hidden from renders: Floor\); show one")
    bpy.data.objects.remove(floor)
    before["objects"].remove("Floor")
    refused(r"no diffuse surface of its own for light to land on; add a ground or a floor \(one that")


def test_a_cube_made_a_nim_bakes(addon, monkeypatch):
    """The first that a person tries: the default cube, Make Negative-Index, a plane below, Bake Caustics."""
    monkeypatch.setattr(caustics_bake, "MILLION", 20_000)
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 14)
    bpy.ops.nim.convert()
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1.5))
    bpy.context.scene.nim_caustics.photons, bpy.context.scene.nim_caustics.texels = 1, "512"
    assert bpy.ops.nim.bake_caustics() == {"FINISHED"}
    assert [copy.name for copy in engine.baked(bpy.context.scene).objects if copy.type == "MESH"] == [
        "NIM Caustics Plane"
    ]


def test_what_is_not_traced_is_said_by_the_button(scene):
    """Light that would be counted twice, and glass that is rough: before anything is traced, with who it is."""
    lamp = scene.objects["Light"]
    lamp.data.use_shadow = False
    with pytest.raises(RuntimeError, match=r"the lamp Light throws no shadows.*switch its Shadow on"):
        bpy.ops.nim.bake_caustics()
    lamp.data.use_shadow = True
    frosted = bpy.data.materials.new("Frosted")
    nodes = Nodes(empty_tree(frosted))
    nodes.end(nodes.add("ShaderNodeBsdfPrincipled", inputs={"Transmission Weight": 1.0, "Roughness": 0.5}))
    scene.objects["Ball"].data.materials[0] = frosted
    with pytest.raises(RuntimeError, match="Frosted of Ball lets light through in part or roughly"):
        bpy.ops.nim.bake_caustics()
    assert not engine.baked(scene) and "NIM photons" not in bpy.data.scenes

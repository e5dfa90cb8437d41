# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands in the view beside the settings: what has changed is said, Build asks only for what is lost, Live follows."""

from types import SimpleNamespace

import bpy
import pytest

from nim_addon.scenes import SCENES
from nim_addon.ui import built, live, scenes, standing

from .conftest import Layout


@pytest.fixture
def build(settings, press):
    """build(scene) -> the bpy.types.Scene that the button made."""

    def pressed(scene=None):
        settings.backend = "nodes"
        if scene:
            settings.scene = scene
        assert press("nim.build_scene") == {"FINISHED"}
        return bpy.context.scene

    return pressed


@pytest.fixture
def on(addon):
    """Live, switched on."""
    bpy.context.window_manager.nim_live = True
    yield
    bpy.context.window_manager.nim_live = False


class Panel(Layout):
    """A layout that takes down texts and what is said on the button, and lets the rest be drawn."""

    def operator(self, name, text=None, **_):
        self.drawn.append((name, text))
        return SimpleNamespace()

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, name

    def __getattr__(self, name):
        return super().__getattr__(name) if name in ("label", "separator") else lambda *_, **__: self


def drawn():
    """The sentences that the panel says of what stands, and what its button says."""
    layout = Panel()
    context = SimpleNamespace(
        scene=bpy.context.scene,
        window_manager=bpy.context.window_manager,
        region=SimpleNamespace(width=9000),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    scenes.NIM_PT_scenes.draw(SimpleNamespace(layout=layout), context)
    sentences = [line for line in layout.text.splitlines() if " " in line]
    return "\n".join(sentences), next(text for name, text in layout.drawn if name == "nim.build_scene")


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_that_was_just_built_stands(settings, build, name):
    scene = build(name)
    assert standing.is_standing(scene) and standing.changed(scene) == [] and not built.holds(scene)
    assert drawn() == ("", "Build Again")


def test_what_has_changed_since_is_said_by_its_name(settings, build):
    assert drawn() == ("", "Build")
    build("pool")
    settings.pool.waves, settings.pool.seed = 0.1, 7
    assert drawn() == ("Not in the view yet: Waves, Seed", "Build Again")
    settings.pool.waves, settings.pool.seed = 0.02, 1
    assert drawn() == ("", "Build Again")
    settings.pool.view = "window"
    assert drawn() == ("", "Build Again"), "the camera moves at once"
    settings.quality = "DRAFT"
    assert drawn() == ("", "Build Again"), "and so does the size"
    settings.spectral = True
    assert drawn() == ("", "Build Again"), "and colours"
    assert not built.holds(bpy.context.scene), "none of which is a change by hand"
    settings.scene = "glass"
    assert drawn() == ("The view shows Pool: Build makes Glass", "Build")
    settings.scene, settings.pool.use_mu, settings.pool.liquid = "pool", True, "none"
    assert "needs a liquid" in drawn()[0]


def test_the_built_scene_varies_what_was_chosen(settings, build):
    settings.scene = "pool"
    chosen = bpy.context.scene.nim_variants
    chosen.pool, chosen.pool_values, chosen.sphere = "n", "-1.1, 1.1", "n"
    scene = build()
    assert scene.nim_variants != chosen
    assert (scene.nim_variants.pool, scene.nim_variants.pool_values) == ("n", "-1.1, 1.1")
    assert (scene.nim_variants.sphere, scene.nim_variants.sphere_values) == ("n", "-1.5, -1, 1.33")


def test_a_backend_that_is_missing_is_no_error_before_it_is_built(settings, build, on, monkeypatch):
    from nim_addon.cycles.closures import backends

    scene = build("sphere")
    monkeypatch.setattr(backends, "osl_available", lambda: False)
    settings.backend = "osl"
    assert standing.changed(scene) == ["Backend"] and drawn()[0] == "Not in the view yet: Backend"
    assert live.tick() is None and standing.changed(scene) == ["Backend"]
    assert "Sphere" in scene.objects and not built.holds(scene)


def test_undo_brings_back_what_was_built(settings, build):
    build("sphere")
    settings.sphere.companions = True
    bpy.ops.ed.undo_push(message="set")
    build()
    assert drawn() == ("", "Build Again")
    bpy.ops.ed.undo()
    assert drawn() == ("Not in the view yet: Companions", "Build Again")


def moved(scene):
    scene.objects["Sphere"].location.x += 0.1


def shaped(scene):
    scene.objects["Sphere"].data.vertices[0].co.x += 0.1
    scene.objects["Sphere"].data.update()


def another_index(scene):
    scene.objects["Sphere"].active_material.nim.n_inside = -2.2


def hidden(scene):
    scene.objects["Sphere"].hide_set(True)


def removed(scene):
    bpy.data.objects.remove(scene.objects["Ground"])


def darker(scene):
    scene.view_settings.exposure -= 1


def wider(scene):
    scene.render.resolution_x += 1


def bent(scene):
    scene.objects["Sphere"].modifiers.new("Bend", "SIMPLE_DEFORM")


def brighter(scene):
    next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND").inputs[
        "Strength"
    ].default_value *= 2


def looked_elsewhere(scene):
    scene.camera.location.z += 1


CHANGES = [moved, shaped, another_index, hidden, removed, darker, wider, bent, brighter, looked_elsewhere]


@pytest.mark.parametrize("change", CHANGES, ids=[change.__name__ for change in CHANGES])
def test_a_change_by_hand_is_known_and_live_waits_for_it(settings, build, on, change):
    scene = build("sphere")
    assert drawn()[0] == ""
    change(scene)
    bpy.context.view_layer.update()
    assert built.holds(scene)
    assert drawn()[0] == "Live waits: it was changed by hand, or holds baked caustics"
    settings.sphere.companions = True
    live.tick()
    assert "Red" not in scene.objects
    build()
    assert not built.holds(scene) and "Red" in scene.objects
    settings.sphere.companions = False
    live.tick()
    assert "Red" not in scene.objects


def test_what_a_person_adds_is_no_change_and_stays(settings, build, on):
    scene = build("sphere")
    mine = bpy.data.objects.new("Mine", bpy.data.meshes.new("Mine"))
    scene.collection.objects.link(mine)
    mine.select_set(True)
    bpy.context.view_layer.objects.active = scene.objects["Sphere"]
    assert not built.holds(scene)
    settings.sphere.companions = True
    live.tick()
    assert {"Mine", "Red", "Blue", "Sphere"} <= set(scene.objects.keys()) and scene.objects["Mine"] == mine
    assert bpy.context.view_layer.objects.active == scene.objects["Sphere"] and mine.select_get()
    assert drawn() == ("", "Build Again")


def test_baked_caustics_are_kept_by_live(settings, build, on, monkeypatch):
    from nim_addon import caustics

    scene = build("sphere")
    collection = bpy.data.collections.new("NIM Caustics")
    from nim_addon.cycles.visibility import CAUSTICS_MARK

    collection[CAUSTICS_MARK] = True
    scene.collection.children.link(collection)
    assert caustics.baked(scene) == collection
    settings.sphere.companions = True
    live.tick()
    assert caustics.baked(scene) == collection and "Red" not in scene.objects
    assert drawn()[0].splitlines()[1].startswith("Live waits")


def test_live_keeps_the_view_the_samples_and_the_size(settings, build, on):
    scene = build("sphere")
    scene.cycles.samples, scene.render.resolution_percentage = 7, 33
    views = [area.spaces.active for area in bpy.context.screen.areas if area.type == "VIEW_3D"]
    settings.sphere.n = -2.0
    live.tick()
    assert standing.changed(scene) == []
    assert (scene.cycles.samples, scene.render.resolution_percentage) == (7, 33)
    assert views and all(view.region_3d.view_perspective == "CAMERA" for view in views)
    views[0].region_3d.view_perspective = "PERSP"
    settings.sphere.n = -1.0
    live.tick()
    assert views[0].region_3d.view_perspective == "PERSP"


def test_undo_of_a_setting_that_live_followed_is_one_step(settings, build, on):
    bpy.ops.ed.undo_push(message="start")
    scene = build("sphere")
    settings.sphere.companions = True
    live.tick()  # while the mouse is still down
    settings.sphere.n = -2.0
    bpy.ops.ed.undo_push(message="as Blender does when the mouse is let go")
    live.tick()
    assert standing.changed(scene) == [] and "Red" in scene.objects
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert scene.name == "NIM sphere" and "Red" not in scene.objects and not settings.sphere.companions
    assert standing.changed(scene) == [] and not built.holds(scene)
    live.follow_undo()
    bpy.ops.ed.redo()
    scene = bpy.context.scene
    assert "Red" in scene.objects and settings.sphere.n == -2.0
    live.tick()
    assert standing.changed(scene) == [] and not built.holds(scene)


def test_live_builds_nothing_where_nothing_stands_or_settings_clash(settings, build, on):
    settings.scene = "sphere"
    settings.sphere.n = -2.0
    live.tick()
    assert len(bpy.data.scenes) == 1
    assert drawn()[0] == "Live follows what is built: press Build once"
    scene = build()
    settings.sphere.n = 0.0
    before = scene.objects["Sphere"]
    live.tick()
    assert scene.objects["Sphere"] == before and "refracts nothing" in drawn()[0]


def test_live_waits_while_an_object_is_edited(settings, build, on):
    scene = build("sphere")
    bpy.context.view_layer.objects.active = scene.objects["Sphere"]
    bpy.ops.object.mode_set(mode="EDIT")
    settings.sphere.companions = True
    assert live.tick() == live.RETRY and "Red" not in scene.objects
    bpy.ops.object.mode_set(mode="OBJECT")


def test_live_waits_while_caustics_are_baked_and_looks_again_after_undo(settings, build, on, monkeypatch):
    scene = build("sphere")
    settings.sphere.companions = True
    with monkeypatch.context() as patch:
        patch.setattr(live.caustics_bake, "under_way", lambda: True)
        assert live.tick() == live.RETRY and "Red" not in scene.objects
    bpy.app.timers.unregister(live.tick)
    live.follow_undo()
    assert bpy.app.timers.is_registered(live.tick) and live.tick() is None and "Red" in scene.objects


def test_live_is_off_in_a_file_that_is_opened_and_follows_nothing_while_off(settings, build, on, tmp_path):
    build("sphere")
    settings.sphere.n = -2.0
    assert bpy.app.timers.is_registered(live.tick)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "live.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "live.blend"))
    assert not bpy.context.window_manager.nim_live and not bpy.app.timers.is_registered(live.tick)
    assert live.follow not in standing.FOLLOWERS
    settings.sphere.n = -1.0
    assert not bpy.app.timers.is_registered(live.tick) and live.tick() is None
    assert standing.changed(bpy.context.scene) == ["Index"]


def test_live_follows_one_change_after_the_other(settings, on):
    assert bpy.ops.nim.build_scene() == {"FINISHED"}
    for angle in (20, 30, 40):
        settings.glass.sun_angle = angle
        live.tick()
        assert standing.changed(bpy.context.scene) == [] and all(bpy.context.view_layer.objects)

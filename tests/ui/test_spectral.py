# SPDX-License-Identifier: GPL-3.0-or-later
"""The Spectral panel: one button sets a scene up and takes all of it back, and the panel says what it did."""

import json
from types import SimpleNamespace

import bpy
import pytest

from nim_addon.cycles import spectral
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium

from .conftest import Layout


@pytest.fixture
def material(addon):
    """A material of index -1.5 in air, worn by the default cube, which a lamp and a sky shine on."""
    from nim_addon.ui import warnings

    warnings.forget()
    material = interface_material("NIM", Medium(-1.5), backend="nodes")
    bpy.data.objects["Cube"].data.materials[0] = material
    bpy.context.scene.render.engine = "CYCLES"
    return material


@pytest.fixture
def panel():
    """panel() -> the Layout on which the Spectral panel was drawn."""

    def drawn():
        layout = Layout()
        system = SimpleNamespace(ui_scale=1.0, pixel_size=1.0)
        context = SimpleNamespace(
            scene=bpy.context.scene,
            region=SimpleNamespace(width=5000),
            preferences=SimpleNamespace(system=system),
        )
        bpy.types.NIM_PT_spectral.draw(SimpleNamespace(layout=layout), context)
        return layout

    return drawn


def state():
    """All that the button may change of the file that Blender starts with."""
    scene = bpy.context.scene
    cube, lamp = bpy.data.objects["Cube"], bpy.data.objects["Light"]
    trees = (scene.world.node_tree, lamp.data.node_tree, cube.data.materials[0].node_tree)
    return (
        json.dumps({path: scene.path_resolve(path) for path in spectral.KEPT}),
        [sorted(node.name for node in tree.nodes) for tree in trees if tree],
        [obj.animation_data is not None and len(obj.animation_data.drivers) for obj in (cube, lamp)],
        [tuple(obj.delta_location) for obj in (cube, lamp)],
        sorted(scene.keys()),
    )


def test_the_button_sets_up_and_takes_back(material, press, panel):
    before = state()
    assert "Renders all wavelengths at once" in panel().text
    assert press("nim.spectral") == {"FINISHED"}
    scene = bpy.context.scene
    assert spectral.is_spectral(scene) and scene.render.use_motion_blur and state() != before
    text = panel().text
    assert "Weighted by wavelength: lamps 1, materials 0, sky: yes." in text
    assert "Real motion blur" in text and "Nothing here disperses yet" in text
    assert press("nim.spectral") == {"FINISHED"}
    assert not spectral.is_spectral(scene)
    assert state()[0] == before[0] and state()[2:] == before[2:] and "Renders all" in panel().text


def test_where_something_disperses_nothing_is_said_of_it(material, press, panel):
    material.nim.medium_inside = "n-bk7"
    press("nim.spectral")
    assert "Nothing here disperses yet" not in panel().text


def test_what_spoils_the_colours_is_said_with_its_button(material, press, panel):
    material.nim.medium_inside = "n-bk7"
    press("nim.spectral")
    assert ("operator", "nim.mend") not in panel().drawn
    bpy.context.scene.render.motion_blur_shutter = 0.5
    from nim_addon.ui import warnings

    warnings.forget()
    layout = panel()
    assert "Real motion blur and all wavelengths exclude each other." in layout.text
    assert ("operator", "nim.mend") in layout.drawn


def test_undo_takes_it_back_too(material, press):
    bpy.ops.ed.undo_push(message="before")
    before = state()
    press("nim.spectral")
    bpy.ops.ed.undo()
    assert not spectral.is_spectral(bpy.context.scene) and state() == before


def test_it_needs_object_mode(material, press):
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Object Mode first"):
        press("nim.spectral")
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_scene_of_another_file_is_left_alone(material, press, tmp_path):
    bpy.data.libraries.write(str(tmp_path / "other.blend"), {bpy.context.scene})
    with bpy.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (there, wanted):
        wanted.scenes = there.scenes[:1]
    bpy.context.window.scene = wanted.scenes[0]
    with pytest.raises(RuntimeError, match="make it local first"):
        press("nim.spectral")


def test_where_no_backend_is_to_be_had_it_says_so(material, press, monkeypatch):
    def refuses(scene, backend):
        raise RuntimeError(f"this Blender has no {backend}.")

    monkeypatch.setattr(spectral, "set_up", refuses)
    before = state()
    with pytest.raises(RuntimeError, match=r"^Error: this Blender has no nodes"):  # which the scene is set to
        press("nim.spectral")
    assert state() == before


def test_what_was_done_is_known_after_a_file_is_loaded(material, press, panel, tmp_path):
    press("nim.spectral")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert spectral.done(bpy.context.scene) == (1, 0, True)
    assert "lamps 1, materials 0, sky: yes" in panel().text


def test_what_was_said_of_one_wavelength_is_gone_as_soon_as_the_button_is_pressed(material, press):
    """Blender tells of no change that a driver or a property of the scene makes, so the button tells by itself."""
    from nim_addon.ui import warnings

    material.nim.medium_inside = "n-bk7"
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    assert "one_wavelength" in [problem.code for problem in warnings.known(scene).problems]
    bpy.ops.nim.spectral()
    assert "one_wavelength" not in [problem.code for problem in warnings.known(scene).problems]
    bpy.ops.nim.spectral()
    assert "one_wavelength" in [problem.code for problem in warnings.known(scene).problems]


@pytest.fixture
def without_cycles(material):
    """The scene with Cycles switched off, as in the preferences."""
    import addon_utils

    addon_utils.disable("cycles")
    assert not hasattr(bpy.context.scene, "cycles")
    yield bpy.context.scene
    addon_utils.enable("cycles")


def test_without_cycles_the_button_and_the_checks_say_so(without_cycles, press, panel):
    from nim_addon import checks
    from nim_addon.ui import warnings

    with pytest.raises(RuntimeError, match="Cycles is switched off in the preferences"):
        press("nim.spectral")
    panel()
    warnings.forget()
    found = warnings.found(without_cycles)
    assert [problem.code for problem in found] == ["engine"] == [p.code for p in checks.problems(without_cycles)]
    assert found[0].sentence.startswith("Cycles is switched off") and found[0].remedy is None

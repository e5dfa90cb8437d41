# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of a render of all wavelengths: each thing that spoils it is said, and set right where a button can."""

import bpy
import pytest

from nim_addon import checks
from nim_addon.checks.sight import look
from nim_addon.checks.spectral_checks import find
from nim_addon.cycles import dispersive, drift, spectral
from nim_addon.cycles.material import interface_nodes, set_medium
from nim_addon.cycles.nodes import Nodes
from nim_addon.cycles.visibility import as_rendered
from nim_addon.physics import Medium
from tests.checks import rig
from tests.checks.rig import add, box, codes, slab, sun


@pytest.fixture
def scene(scene):
    """The rig with a slab that disperses, rendered in all wavelengths by nodes."""
    rig.build(scene)
    set_medium(interface_nodes(slab().data.materials[0])[0], "Inside", Medium.parse("nim-causal"))
    spectral.set_up(scene)
    return scene


def sentences(scene):
    with as_rendered(scene) as depsgraph:
        return [problem.sentence for problem in find(look(scene, depsgraph))]


def test_what_was_set_up_is_right_and_what_was_not_is_said(scene):
    assert codes(scene) == [] and drift.DRIFTS in slab() and drift.DRIFTS in sun()
    spectral.undo(scene)
    assert codes(scene) == ["one_wavelength"] and "NIM" in sentences(scene)[0] and "550 nm alone" in sentences(scene)[0]
    checks.mend(scene)
    assert codes(scene) == [] and spectral.is_spectral(scene)


def blur_off(scene):
    scene.render.use_motion_blur = False


def real_blur(scene):
    scene.render.motion_blur_shutter = 0.5


def centred(scene):
    scene.render.motion_blur_position = "CENTER"


def rolling(scene):
    scene.cycles.rolling_shutter_type = "TOP"


def bent_curve(scene):
    scene.render.motion_blur_shutter_curve.curves[0].points[0].location = (0, 0)
    scene.render.motion_blur_shutter_curve.update()


@pytest.mark.parametrize(
    "spoil, words",
    [
        (blur_off, "Motion Blur is off"),
        (real_blur, "frames: 0.5"),
        (centred, "does not start on the frame"),
        (rolling, "rolls"),
        (bent_curve, "not flat"),
    ],
)
def test_a_shutter_that_gives_no_wavelengths_is_said_and_mended(scene, spoil, words):
    spoil(scene)
    assert codes(scene) == ["shutter"] and words in sentences(scene)[0]
    checks.mend(scene)
    assert codes(scene) == []


def test_what_moves_while_the_shutter_is_open_is_said(scene):
    slab().keyframe_insert("location", index=0, frame=scene.frame_current)
    slab().location.x = 5
    slab().keyframe_insert("location", index=0, frame=scene.frame_current + 4)
    slab().location.x = 0
    assert codes(scene) == ["moves_in_colours"] and sentences(scene)[0].startswith("Slab: it moves")
    drift.hold(slab())  # as what need not tell the time is
    assert "moves_in_colours" not in codes(scene)


def test_light_that_came_later_has_no_wavelength_yet(scene):
    lamp = bpy.data.objects.new("Late", bpy.data.lights.new("Late", "POINT"))
    lamp.data.shadow_soft_size = 1.0
    scene.collection.objects.link(lamp)
    assert "white_light" in codes(scene) and "Late: its light has no wavelengths" in sentences(scene)[0]
    checks.mend(scene, "white_light")
    assert not {"white_light", "moved_since"} & set(codes(scene))


def test_what_was_moved_since_cannot_tell_the_wavelength(scene):
    slab().location.x = 0.25
    scene.view_layers[0].update()
    assert codes(scene) == ["moved_since"] and sentences(scene)[0].startswith("Slab: it was moved")
    checks.mend(scene)
    assert codes(scene) == []


def test_a_lamp_that_nodes_cannot_tell_the_wavelength_is_said(scene, monkeypatch):
    spectral.undo(scene)
    monkeypatch.setattr(drift, "lamps_drift", lambda: True)
    spectral.set_up(scene)
    monkeypatch.setattr(drift, "lamps_drift", lambda: False)
    assert "white_lamp" in codes(scene) and sentences(scene)[-1].startswith("Sun: before Blender 4.5")
    spectral.undo(scene)
    spectral.set_up(scene)  # which takes OSL for it
    assert "white_lamp" not in codes(scene) and scene.cycles.shading_system


def test_what_became_rough_since_would_be_lit_without_colours(scene):
    interface_nodes(slab().data.materials[0])[0].inputs["Roughness"].default_value = 0.2
    assert codes(scene) == ["white_facets"] and sentences(scene)[0].startswith("NIM: it is rough and disperses")
    checks.mend(scene)
    assert codes(scene) == []


def test_a_sky_tells_the_wavelength_by_osl_which_is_turned_on_for_it(scene, render):
    spectral.undo(scene)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    sun().hide_render = True
    scene.cycles.shading_system = False
    before = render(scene).mean()
    spectral.set_up(scene)
    assert scene.cycles.shading_system and codes(scene) == []
    assert render(scene).mean() == pytest.approx(before, rel=0.05)  # black before OSL was turned on
    scene.cycles.shading_system = False
    assert codes(scene) == ["black_sky"]
    checks.mend(scene)
    assert scene.cycles.shading_system and codes(scene) == []
    spectral.undo(scene)
    assert not scene.cycles.shading_system


def test_a_sky_cannot_tell_the_wavelength_by_nodes(scene, monkeypatch):
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    monkeypatch.setattr(spectral, "osl_available", lambda: False)
    spectral.set_up(scene)
    assert codes(scene) == ["white_sky"] and "dome" in sentences(scene)[0]


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="earlier Blenders are right")
def test_a_volume_in_colours_is_said_in_blender_5(scene):
    material = bpy.data.materials.new("Haze")
    nodes = Nodes(material.node_tree)
    material.node_tree.nodes.clear()
    node = dispersive.medium_node(material.node_tree, Medium.parse("water-daimon"), "nodes")
    volume = nodes.add("ShaderNodeVolumeAbsorption", inputs={"Density": node.outputs["Absorption"]})
    nodes.add("ShaderNodeOutputMaterial", inputs={"Volume": volume.outputs[0]})
    add(scene, "Haze", box(0.5, 0.5, 0.7), material)
    assert "volume_in_colours" in codes(scene)
    checks.mend(scene, "volume_in_colours")
    assert "volume_in_colours" not in codes(scene) and scene.cycles.volume_biased

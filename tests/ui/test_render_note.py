# SPDX-License-Identifier: GPL-3.0-or-later
"""A render by another engine than Cycles says, as it starts, that it shows no refraction; where there is some to be shown."""

import wave

import bpy
import pytest

from nim_addon.base.streams import quiet
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
from nim_addon.ui import render_note


class Flat(bpy.types.RenderEngine):
    """An engine that needs no graphics card: its pictures are black."""

    bl_idname = "NIM_TEST_FLAT"
    bl_label = "Flat"

    def render(self, depsgraph):
        """Nothing."""


@pytest.fixture
def scene(addon):
    """The default file, whose cube is a NIM, to be rendered small by another engine."""
    bpy.utils.register_class(Flat)
    scene = bpy.context.scene
    bpy.data.objects["Cube"].data.materials[0] = interface_material("NIM", Medium(-1.5), backend="nodes")
    scene.render.engine = "NIM_TEST_FLAT"
    scene.render.resolution_x = scene.render.resolution_y = 4
    yield scene
    bpy.utils.unregister_class(Flat)


def said(scene, capfd):
    capfd.readouterr()
    bpy.ops.render.render(scene=scene.name)
    return [line for line in capfd.readouterr().out.splitlines() if line.startswith("Negative-Index Materials")]


def test_a_render_by_another_engine_is_told_of(scene, capfd):
    (line,) = said(scene, capfd)
    assert "NIM_TEST_FLAT cannot bend a ray backwards: this render shows no refraction. Use Cycles." in line
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    assert not said(scene, capfd)


def test_nothing_is_said_where_nothing_of_ours_is_rendered(scene, capfd):
    bpy.data.objects["Cube"].hide_render = True
    assert not said(scene, capfd)
    held = bpy.data.collections.new("Held")
    held.objects.link(bpy.data.objects.new("Inner", bpy.data.objects["Cube"].data))
    maker = bpy.data.objects.new("Maker", None)
    maker.instance_type, maker.instance_collection = "COLLECTION", held
    scene.collection.objects.link(maker)
    assert said(scene, capfd), "of an instance, too"


def test_every_view_layer_counts_that_is_rendered_as_it_is(scene):
    first, second = scene.view_layers[0], scene.view_layers.new("Second")
    first.layer_collection.children[0].exclude = True
    assert render_note.wrong_engine(scene), "the second shows it"
    second.use = False
    assert render_note.wrong_engine(scene) is None
    second.use, second.material_override = True, bpy.data.materials.new("Clay")
    assert render_note.wrong_engine(scene) is None


def test_of_strips_their_scenes_count(scene, tmp_path):
    # a Blender without Audaspace adds no sounds
    with wave.open(str(tmp_path / "still.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(8000))
    edited = bpy.data.scenes.new("Edited")
    for one in (edited, scene):
        editor = one.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        if one == edited:
            strips.new_scene("Strip", scene, 1, 1)
            assert render_note.wrong_engine(edited) == "NIM_TEST_FLAT"
        else:
            if bpy.app.build_options.audaspace:
                strips.new_sound("Sound", str(tmp_path / "still.wav"), 1, 1)
            assert render_note.wrong_engine(scene) == "NIM_TEST_FLAT"
            strips.new_image("Image", "none.png", 2, 1)
    assert render_note.wrong_engine(scene) is None, "its picture shows a file"
    scene.render.use_sequencer = False
    assert render_note.wrong_engine(scene) == "NIM_TEST_FLAT"


def test_what_people_call_the_engines(scene):
    scene.render.engine = "BLENDER_WORKBENCH"
    assert render_note.wrong_engine(scene) == "Workbench"
    scene.render.engine = "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT"
    assert render_note.wrong_engine(scene) == "EEVEE"
    scene.render.engine = "CYCLES"
    assert render_note.wrong_engine(scene) is None


def test_a_report_is_made_of_it_beside_a_window(scene, press, capfd):
    with quiet():
        assert press("nim.note_render") == {"CANCELLED"}
    assert press("nim.note_render", engine="EEVEE") == {"FINISHED"}
    assert "Warning: EEVEE cannot bend a ray backwards" in capfd.readouterr().out


def compositor(scene):
    """The nodes that make the picture of a scene, of which there are none."""
    scene.render.use_compositing = True
    if hasattr(scene, "compositing_node_group"):  # from 5.0
        scene.compositing_node_group = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
        return scene.compositing_node_group.nodes
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree.nodes


def test_of_a_compositor_those_scenes_count_that_it_takes_in(scene):
    nodes = compositor(scene)
    assert render_note.wrong_engine(scene) is None, "its picture shows no scene"
    nodes.new("CompositorNodeRLayers").scene = scene
    assert render_note.wrong_engine(scene) == "NIM_TEST_FLAT"
    other = bpy.data.scenes.new("Other")
    nodes[0].scene = other
    assert render_note.wrong_engine(scene) is None
    inner = compositor(other)
    assert render_note.wrong_engine(other) is None
    inner.new("CompositorNodeRLayers").scene = scene
    assert render_note.wrong_engine(other) == "NIM_TEST_FLAT"
    other.render.use_compositing = False
    assert render_note.wrong_engine(other) is None

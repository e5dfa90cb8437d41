# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library: registered by one click, catalogued, with previews that show something, and it renders."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures import INTERFACE, version_of
from nim_addon.cycles.material import interface_nodes, interface_of
from nim_addon.physics import MEDIA, Medium
from nim_addon.scenes.sphere import ball
from nim_addon.scenes.stage import Stage
from nim_addon.ui import assets, preferences

from .conftest import Layout

FILE = assets.FOLDER / "nim_assets.blend"
KINDS = ("materials", "objects", "node_groups", "collections")


@pytest.fixture
def stored(empty_file):
    """What the library holds, appended: a list of data-blocks marked as assets."""
    with bpy.data.libraries.load(str(FILE), assets_only=True) as (there, wanted):
        for kind in KINDS:
            setattr(wanted, kind, getattr(there, kind))
    return [data for kind in KINDS for data in getattr(wanted, kind)]


def libraries():
    return [library.name for library in bpy.context.preferences.filepaths.asset_libraries]


def test_one_click_adds_the_library_and_one_takes_it_out(addon, press):
    before = libraries()
    assert press("nim.register_assets") == {"FINISHED"}
    assert libraries() == [*before, assets.NAME]
    assert assets.library().import_method.startswith("APPEND")  # what is dragged in can be changed
    assert not bpy.ops.nim.register_assets.poll()
    assert press("nim.unregister_assets") == {"FINISHED"}
    assert libraries() == before
    assert not bpy.ops.nim.unregister_assets.poll()


def test_it_is_offered_once(addon, press):
    """In the panel, until it is added or declined; one that was taken out is not offered again."""

    def offered():
        layout = Layout()
        preferences.draw_offer(layout)
        return [name for kind, name in layout.drawn if kind == "operator"]

    assert offered() == ["nim.register_assets", "nim.decline_assets"]
    press("nim.register_assets")
    assert not offered()
    press("nim.unregister_assets")
    assert not offered()
    preferences.settings().offer_assets = True
    assert offered()
    press("nim.decline_assets")
    assert not offered()


def test_the_offer_ends_the_panel_and_is_not_among_the_buttons_of_a_material(addon, press):
    def operators():
        layout = Layout()
        preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0, pixel_size=1.0))
        there = {name: getattr(bpy.context, name) for name in ("scene", "object", "selected_objects", "mode")}
        context = SimpleNamespace(region=SimpleNamespace(width=9000), preferences=preferences, **there)
        bpy.types.NIM_PT_convert.draw(SimpleNamespace(layout=layout), context)
        return [name for kind, name in layout.drawn if kind == "operator"]

    assert operators()[-3:] == ["nim.convert", "nim.register_assets", "nim.decline_assets"]
    press("nim.convert")
    assert operators()[-1] == "nim.revert" and "nim.register_assets" not in operators()


def test_a_missing_library_is_said(addon, press, monkeypatch, tmp_path):
    monkeypatch.setattr(assets, "FOLDER", tmp_path)
    with pytest.raises(RuntimeError, match="install the add-on again"):
        press("nim.register_assets")


def test_every_asset_has_catalog_description_tags_and_preview(stored):
    lines = (assets.FOLDER / "blender_assets.cats.txt").read_text().splitlines()
    catalogs = {line.split(":")[0] for line in lines if line.count(":") == 2 and line[0] != "#"}
    assert len(stored) == 25
    for data in stored:
        about = data.asset_data
        assert about.catalog_id in catalogs, data.name
        assert about.description and len(about.tags) >= 2 and not about.author
        assert about.license == "CC0-1.0", data.name
        width, height = data.preview.image_size
        assert width >= 128
        pixels = np.array(data.preview.image_pixels_float[:]).reshape(height, width, 4)
        assert pixels[..., :3].std() > 0.05, f"{data.name} shows nothing"
        assert pixels[..., 3].min() == 1.0


def test_the_library_is_small_and_of_the_present_version(stored):
    assert FILE.stat().st_size < 1_500_000
    groups = [group for group in bpy.data.node_groups if INTERFACE.is_of(group)]
    assert [group.name for group in groups] == ["NIM Interface (nodes)"]
    assert version_of(groups[0]) == INTERFACE.version, "run python3 build.py blends"


def test_the_materials_are_the_media(stored):
    media = {data.name: interface_of(interface_nodes(data)[0]).inside for data in stored if data.id_type == "MATERIAL"}
    held = [medium for medium in media.values() if medium.dispersion is None]
    near = {(round(medium.n, 4), round(medium.mu, 4)) for medium in held}
    assert near == {(medium.n, medium.mu) for name, medium in MEDIA.items() if name not in ("vacuum", "air")}
    liquids = {name: medium for name, medium in media.items() if medium.dispersion is not None}
    assert {name: liquid.content for name, liquid in liquids.items()} == {
        "Water (measured)": Medium.parse("water-daimon").content,
        "NIM Liquid (causal)": Medium.parse("nim-causal").content,
        "NIM Liquid (normal)": Medium.parse("nim-normal").content,
    }


def test_what_is_dragged_into_a_file_renders(stored, render):
    stage = Stage("assets", (32, 32), "nodes")
    shown = next(data for data in stored if data.name == "NIM -1.5")
    ball(stage, "Sphere", (0, 0, 0), 1.0, shown)
    stage.camera((0, -4, 0), (0, 0, 0), 35)
    world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    stage.world(world)
    stage.scene.cycles.samples = 4
    assert render(stage.scene).mean() == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("name", ["Glass of NIM with a Straw", "Flat Lens in its Frame"])
def test_a_scene_is_dragged_in_and_bends_backwards(stored, name):
    """As Blender drops a collection: an instance of it, which stands in the scene with all its interfaces."""
    from nim_addon.cycles.visibility import as_rendered, shown

    scene = bpy.context.scene
    instance = bpy.data.objects.new(name, None)
    instance.instance_type, instance.instance_collection = "COLLECTION", bpy.data.collections[name]
    scene.collection.objects.link(instance)
    with as_rendered(scene) as depsgraph:
        materials = {material for surface in shown(scene, depsgraph) for material in surface.materials}
    interfaces = [interface_of(node) for material in materials for node in interface_nodes(material)]
    assert any(interface.bends_backwards for interface in interfaces)
    for obj in bpy.data.collections[name].objects:
        assert obj.type != "CAMERA" and not obj.keys(), "nothing of the stage that it was built on"


def test_the_objects_are_closed_and_face_outwards(stored):
    import bmesh

    for data in stored:
        # panes of other laws have faces alone
        if isinstance(data, bpy.types.Object) and interface_nodes(data.active_material):
            shape = bmesh.new()
            shape.from_mesh(data.data)
            assert shape.calc_volume(signed=True) > 0, data.name
            assert all(edge.is_manifold for edge in shape.edges), data.name
            shape.free()

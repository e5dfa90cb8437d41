# SPDX-License-Identifier: GPL-3.0-or-later
"""The Add menus: bodies that are closed, face outwards and lie at the cursor; nodes with ready media."""

import bpy
import numpy as np
import pytest

from nim_addon import checks
from nim_addon.checks.solids import Solid
from nim_addon.cycles import graded, settings
from nim_addon.cycles.closures import GRADED_CORE, LENSLET_WINDOW, UNIAXIAL_SLAB, preview
from nim_addon.cycles.lenslets import window_of
from nim_addon.cycles.material import interface_nodes, interface_of
from nim_addon.cycles.slabs import slab_of
from nim_addon.physics import MEDIA, Medium
from nim_addon.physics.graded import Profile
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.uniaxial import UniaxialSlab


@pytest.mark.parametrize(
    "shape, size, extent",
    [
        ("sphere", 2.0, (2, 2, 2)),
        ("cube", 3.0, (3, 3, 3)),
        ("slab", 2.0, (2, 2, 0.2)),
        ("prism", 2.0, (2, 2, np.sqrt(3))),
        ("liquid", 0.5, (0.5, 0.5, 0.25)),
    ],
)
def test_bodies(addon, press, shape, size, extent):
    bpy.context.scene.cursor.location = (1, 2, 3)
    assert press("nim.add_object", shape=shape, size=size, medium="nim-mu10") == {"FINISHED"}
    object_ = bpy.context.object
    assert object_.select_get() and bpy.context.selected_objects == [object_]
    assert tuple(object_.location) == (1, 2, 3) and object_.name.partition(".")[0] == shape.title()
    assert interface_of(interface_nodes(object_.active_material)[0]).inside.mu == -10
    mesh = object_.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    (part,) = Solid(mesh).parts
    assert part.closed and part.agreeing and part.volume > 0
    points = np.array([vertex.co for vertex in mesh.vertices])
    assert np.ptp(points, axis=0) == pytest.approx(extent, rel=1e-4)
    if shape == "sphere":
        assert np.linalg.norm(points, axis=1) == pytest.approx(size / 2, rel=1e-5)
    if shape == "liquid":
        corners = np.array([normal.vector for normal in object_.data.corner_normals])
        assert np.unique(np.abs(corners[:, 2]).round(4)).tolist() == [0, 1], "flat top and bottom, a round side"


def test_a_flat_lens(addon, press):
    """Upright, of n = mu, as wide and thick as it is told."""
    bpy.context.scene.cursor.location = (1, 2, 3)
    assert press("nim.add_flat_lens", thickness=0.5, width=3, n=-1.05) == {"FINISHED"}
    object_ = bpy.context.object
    assert object_.select_get() and tuple(object_.location) == (1, 2, 3) and object_.name == "Flat Lens"
    interface = interface_of(interface_nodes(object_.active_material)[0])
    assert (interface.inside.n, interface.inside.mu) == pytest.approx((-1.05, -1.05)) and interface.outside == Medium(
        1.0
    )
    (part,) = Solid(object_.data).parts
    assert part.closed and part.agreeing and part.volume > 0
    assert tuple(object_.dimensions) == pytest.approx((3, 0.5, 3))


def test_undo_takes_the_body_away(addon, press):
    bpy.ops.ed.undo_push(message="before")
    count = len(bpy.data.objects)
    press("nim.add_object")
    assert len(bpy.data.objects) == count + 1
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == count


def test_an_index_of_zero_adds_nothing(addon, press):
    count = len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.materials)
    with pytest.raises(RuntimeError, match="n = 0 refracts nothing"):
        press("nim.add_object", medium="custom", n=0.0)
    assert (len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.materials)) == count


def test_a_node_needs_a_shader_tree(addon, press):
    with pytest.raises(RuntimeError, match="Open a material in the Shader Editor first"):
        press("nim.add_node")


@pytest.fixture
def editor(addon):
    """editor(tree) -> a Shader editor that shows a tree, as an override of the context. A window without a screen has one too
    once an area is turned into one.
    """
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    former, area.ui_type = area.ui_type, "ShaderNodeTree"
    region = next(region for region in area.regions if region.type == "WINDOW")

    def shown(tree):
        area.spaces.active.pin = True
        area.spaces.active.node_tree = tree
        return bpy.context.temp_override(window=window, area=area, region=region)

    yield shown
    area.ui_type = former


def test_a_node_with_ready_media(editor, press):
    tree = bpy.data.materials["Material"].node_tree
    with editor(tree):
        space = bpy.context.space_data
        space.cursor_location = (30, 40)
        assert press("nim.add_node", medium="nim-4.1") == {"FINISHED"}
        node = tree.nodes.active
        assert interface_of(node).inside.n == pytest.approx(-4.1) and interface_of(node).outside == Medium(1.0)
        assert tuple(node.location) == (30, 40) and [other for other in tree.nodes if other.select] == [node]
        space.path.start(node.node_tree)
        with pytest.raises(RuntimeError, match="cannot be put into its own group"):
            press("nim.add_node")


NODE_OPERATORS = {
    "nim.add_node": ({}, {}),
    "nim.add_slab_node": ({"along": -3.0}, {"along": 3.0}),
    "nim.add_lenslet_node": ({"eta": -1.0}, {"eta": 1.0}),
    "nim.add_graded_ball_node": ({"device": "magnifier"}, {"device": "luneburg"}),
}


@pytest.mark.parametrize("operator", NODE_OPERATORS)
def test_a_node_is_shown_in_eevee_as_one_of_make_negative_index_is(editor, press, operator):
    tree = bpy.data.materials["Material"].node_tree
    before = tree.get_output_node("CYCLES"), tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    with editor(tree):
        for kept, values in enumerate(NODE_OPERATORS[operator]):
            press(operator, **values)
            node, shown = tree.nodes.active, tree.get_output_node("EEVEE")
            assert [other for other in tree.nodes if other.select] == [node] and shown.target == "EEVEE"
            source = shown.inputs["Surface"].links[0].from_node
            if operator == "nim.add_node":
                assert source == node or kept, "the first one's"
            else:
                veil = source.inputs[2].links[0].from_node.inputs["Color"].default_value
                assert tuple(veil)[:3] == pytest.approx(preview.POSITIVE if kept else preview.NEGATIVE)
                for other in [other for other in tree.nodes if other.type in ("OUTPUT_MATERIAL", "MIX_SHADER")]:
                    if other != before[0]:
                        tree.nodes.remove(other)
        assert (tree.get_output_node("CYCLES"), before[0].inputs["Surface"].links[0].from_node) == before


def test_what_eevee_shows_of_a_mixture_or_within_a_group_is_as_a_person_has_it(editor, press):
    tree = bpy.data.materials["Material"].node_tree
    mixed, output = tree.nodes.new("ShaderNodeMixShader"), tree.get_output_node("CYCLES")
    tree.links.new(mixed.outputs[0], output.inputs["Surface"])
    group = bpy.data.node_groups.new("Own", "ShaderNodeTree")
    for held in (tree, group):
        with editor(held):
            press("nim.add_node")
        assert {node.target for node in held.nodes if node.type == "OUTPUT_MATERIAL"} <= {"ALL"}


def test_every_medium_can_be_chosen():
    from nim_addon.ui.media import MEDIUM_NUMBERS

    chosen = {(MEDIA[name].n, MEDIA[name].mu) for name in MEDIUM_NUMBERS}
    assert chosen == {(medium.n, medium.mu) for medium in MEDIA.values()} and len(chosen) == len(MEDIUM_NUMBERS)
    assert len(set(MEDIUM_NUMBERS.values()) | {0}) == len(MEDIUM_NUMBERS) + 1


def test_every_entry_of_the_menus_can_be_drawn(addon):
    """Each names an operator that there is, with properties and an icon that it has, and a text of its own."""
    from nim_addon.ui import add, add_interface

    icons = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items.keys()
    media = [entry for entries in add_interface.MEDIA_NODES for entry in entries]
    for entries in (
        [e for thing in add.THINGS for e in thing.OBJECTS],
        [e for thing in add.THINGS for e in thing.NODES] + media,
    ):
        assert len({entry.text for entry in entries}) == len(entries)
        for entry in entries:
            properties = getattr(bpy.ops.nim, entry.operator.removeprefix("nim.")).get_rna_type().properties
            assert set(entry.values) <= set(properties.keys()) and entry.icon in icons and entry.icon != "NONE"
            for name in {"shape", "medium"} & set(entry.values):
                assert entry.values[name] in properties[name].enum_items


def test_menus_come_and_go(addon):
    import addon_utils

    def ours():
        menus = (bpy.types.NODE_MT_add, bpy.types.VIEW3D_MT_mesh_add)
        return [draw for menu in menus for draw in menu._dyn_ui_initialize() if draw.__module__.startswith("nim_addon")]

    assert len(ours()) == 2
    addon_utils.disable(addon, default_set=True)
    assert ours() == []
    addon_utils.enable(addon, default_set=True)


def test_a_lenslet_window(addon, press):
    """Upright, its front towards -y, and what it is told to be."""
    bpy.context.scene.cursor.location = (1, 2, 3)
    assert press("nim.add_lenslet_window", eta=-1.2, width=3, offset=(0.25, -0.5)) == {"FINISHED"}
    object_ = bpy.context.object
    assert object_.select_get() and tuple(object_.location) == (1, 2, 3) and object_.name == "Lenslet Window"
    (face,) = object_.data.polygons
    assert tuple(face.normal) == pytest.approx((0, -1, 0)) and tuple(object_.dimensions) == pytest.approx((3, 0, 3))
    (node,) = LENSLET_WINDOW.nodes_of(object_.active_material)
    assert window_of(node) == LensletWindow((node.inputs["Eta U"].default_value,) * 2, (0.25, -0.5))
    assert node.inputs["Eta U"].default_value == pytest.approx(-1.2)
    press("nim.add_lenslet_window", eta=-1.0, offset=(0, 0), finite=True, aperture=0.75)
    (node,) = LENSLET_WINDOW.nodes_of(bpy.context.object.active_material)
    assert window_of(node) == LensletWindow(-1.0, aperture=0.75)


def test_a_hyperbolic_slab(addon, press):
    """Two faces, as far apart as its material is thick."""
    assert press("nim.add_slab", across=1.5, along=-2, thickness=0.25, width=3) == {"FINISHED"}
    object_ = bpy.context.object
    assert object_.name == "Hyperbolic Slab" and tuple(object_.dimensions) == pytest.approx((3, 0.25, 3))
    (node,) = UNIAXIAL_SLAB.nodes_of(object_.active_material)
    assert slab_of(node) == UniaxialSlab(1.5, -2.0, 0.25)
    assert all(face.normal.y * face.center.y > 0 and abs(face.normal.y) == 1 for face in object_.data.polygons)


@pytest.mark.parametrize(
    ("operator", "values", "words"),
    [
        ("nim.add_lenslet_window", {"eta": 0.0}, "eta = 0"),
        ("nim.add_lenslet_window", {"finite": True, "aperture": 0.0}, "aperture = 0"),
        ("nim.add_slab", {"along": 0.0}, "along = 0"),
    ],
)
def test_what_is_no_window_and_no_slab_adds_nothing(addon, press, operator, values, words):
    count = len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.materials)
    with pytest.raises(RuntimeError, match=words):
        press(operator, **values)
    assert (len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.materials)) == count


@pytest.mark.parametrize(
    "values, profile",
    [
        ({"device": "eaton", "use_cap": True, "cap": 2.5}, Profile("eaton", cap=2.5)),
        ({"device": "magnifier", "core": 0.7}, Profile("magnifier", core=0.7)),
        (
            {"device": "cloak", "hollow": 0.5, "use_core": True, "core": 0.6, "surface": "black", "use_cap": True},
            Profile("cloak", core=0.6, surface="black", hollow=0.5),
        ),
        ({"device": "luneburg", "core": 0.7}, Profile("luneburg")),
    ],
)
def test_a_graded_ball(addon, press, values, profile):
    """Round, around the cursor, as large as its material says, and what it is told to be."""
    bpy.context.scene.cursor.location = (1, 2, 3)
    assert press("nim.add_graded_ball", radius=1.5, **values) == {"FINISHED"}
    object_ = bpy.context.object
    assert tuple(object_.location) == (1, 2, 3) and object_.name == "Graded Ball"
    radii = [vertex.co.length for vertex in object_.data.vertices]
    assert max(radii) == pytest.approx(1.5) and min(radii) == pytest.approx(1.5)
    assert all(face.normal.dot(face.center) > 0 and face.use_smooth for face in object_.data.polygons)
    (node,) = graded.profile_nodes(object_.active_material)
    found = graded.profile_of(node)
    assert (found.n, found.core, found.surface) == (profile.n, profile.core, profile.surface)
    assert (found.cap, found.hollow) == (profile.cap, pytest.approx(profile.hollow))
    assert node.inputs["Radius"].default_value == 1.5


def test_a_graded_ball_around_a_core_that_is_seen(addon, press):
    """The core is a ball of its own, which moves with the shell; the checks find nothing wrong, and a cloak has none."""
    scene = bpy.context.scene
    scene.cursor.location = (1, 2, 3)
    settings.lossless(scene, "nodes")
    for known in list(bpy.data.objects):
        bpy.data.objects.remove(known)
    values = {"device": "magnifier", "core": 0.5, "surface": "textured"}
    assert press("nim.add_graded_ball", radius=2.0, **values) == {"FINISHED"}
    shell = bpy.context.object
    (core,) = shell.children
    (node,) = graded.profile_nodes(shell.active_material)
    assert graded.closure_of_profile(graded.profile_of(node)) is GRADED_CORE
    shell.location, shell.scale = (4, 5, 6), (0.5, 0.5, 0.5)
    bpy.context.view_layer.update()
    assert checks.problems(scene) == []
    evaluated = core.evaluated_get(bpy.context.evaluated_depsgraph_get())
    away = [(evaluated.matrix_world @ vertex.co - shell.location).length for vertex in evaluated.data.vertices]
    assert min(away) == pytest.approx(0.5, abs=1e-4) and max(away) == pytest.approx(0.5, abs=1e-4)
    count = len(bpy.data.objects), len(bpy.data.materials)
    with pytest.raises(RuntimeError, match="a cloak hides what is in it"):
        press("nim.add_graded_ball", device="cloak", use_core=True, core=0.8, surface="textured")
    assert (len(bpy.data.objects), len(bpy.data.materials)) == count

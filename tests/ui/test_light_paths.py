# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths as drawn: they land where Snell says, are replaced, cleared and undone, and change no picture."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from nim_addon.cycles.graded import graded_ball_material
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.slabs import slab_material
from nim_addon.cycles.visibility import PATHS_MARK
from nim_addon.physics import Interface, Medium
from nim_addon.physics.balls import POINTS
from nim_addon.physics.graded import Profile
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.rays import Kind, Plane, Shapes, Sphere, trace
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import glass, shapes, sphere
from nim_addon.ui import light_curves, light_tracing
from tests.ui.drawn_paths import add, add_floor, add_interface, direction, drawn


@pytest.fixture
def scene(addon):
    """The default file without its cube, with rays from the 3D cursor."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.context.scene.nim_rays.source = "CURSOR"
    return bpy.context.scene


def data():
    """What the file holds, by name; the list of the wheel's own brushes and such is left out by being the same."""
    kinds = ("objects", "curves", "materials", "collections", "meshes", "node_groups")
    return {kind: {item.name for item in getattr(bpy.data, kind)} for kind in kinds}


@pytest.mark.parametrize("n", [1.33, -1.33])
def test_a_ray_through_a_plane_lands_where_snell_says(scene, press, n):
    add_interface(n, shapes.rectangle((-5, -5), (5, 5)))
    add_floor(-1)
    scene.cursor.location = (-1, 0, 1)
    assert press("nim.light_paths", rays=1, aim="DIRECTION", direction=(3, 0, -3)) == {"FINISHED"}
    incident, full = drawn(Kind.INCIDENT)
    np.testing.assert_allclose(incident, [[(-1, 0, 1), (0, 0, 0)]], atol=1e-5)
    transmitted, radius = drawn(Kind.TRANSMITTED)
    x = math.tan(math.asin(math.sin(math.radians(45)) / n))
    np.testing.assert_allclose(transmitted, [[(0, 0, 0), (x, 0, -1)]], atol=1e-5)
    reflected, weak = drawn(Kind.REFLECTED)
    np.testing.assert_allclose(direction(reflected), [(math.sqrt(0.5), 0, math.sqrt(0.5))], atol=1e-6)
    R = float(Interface(Medium(n)).fresnel(math.sqrt(0.5)).R)
    for got, energy in ((full, 1), (radius, 1 - R), (weak, R)):
        assert got[0] ** (1 / light_curves.THINNING) == pytest.approx(energy, abs=1e-5)


def test_in_what_absorbs_a_path_tapers(scene):
    ball = Shapes(Sphere((0, 0, 0), 1, Interface(Medium.parse("n=-1.5,length=2"))))
    paths = trace(ball, (0, 0.3, 5), (0, 0, -1), bounces=2)
    light_curves.draw(scene, "cursor", paths, 0.01, False)
    radii = [
        [point.radius for point in spline.points]
        for kind in Kind
        for obj in bpy.data.objects
        if obj.get(PATHS_MARK) and obj.name.startswith(kind.name.capitalize())
        for spline in obj.data.splines
    ]
    order = np.argsort(paths.kind, kind="stable")
    wanted = np.stack([paths.energy, paths.arriving], -1)[order] ** light_curves.THINNING
    np.testing.assert_allclose(radii, wanted, rtol=1e-6)
    assert (wanted[:, 1] < 0.9 * wanted[:, 0]).sum() == 2  # the way there within, and back


@pytest.mark.parametrize("n", [-1.5, 1.5])
def test_a_beam_through_a_moved_and_mirrored_ball_is_the_analytic_one(scene, press, n):
    scene.cursor.location = (-1, 2, 3)
    z = 3 + np.linspace(-0.4, 0.4, 9)
    analytic = Shapes(Sphere((1, 2, 3), 0.5, Interface(Medium(n))))
    expected = trace(analytic, np.stack([np.full(9, -1.0), np.full(9, 2.0), z], -1), (1, 0, 0), bounces=2)
    errors = []
    for divisions in (24, 48):
        ball = add_interface(n, shapes.cube_sphere(divisions), smooth=True)
        turn = Euler((0.5, 0.6, 0.7)).to_matrix().to_4x4()
        ball.matrix_world = Matrix.Translation((1, 2, 3)) @ turn @ Matrix.Diagonal((-0.5, 0.5, 0.5, 1))
        press("nim.light_paths", rays=9, bounces=2, fit=False, width=0.8, reach=1.0)
        errors.append(0)
        for kind in Kind:
            ends, _ = drawn(kind)
            chosen = expected.kind == kind
            assert len(ends) == chosen.sum()
            wrong = np.abs(direction(ends) - expected.direction[chosen]).max()
            errors[-1] = max(errors[-1], wrong, np.abs(ends[:, 0] - expected.start[chosen]).max())
        bpy.data.objects.remove(ball)
    # interpolated normals are wrong by how far a facet lies under the sphere, which four bends make up to ten times
    # as much; the faces' own would be wrong by their angle, 0.03, and get better with it, not with its square
    assert errors[1] < 10 * (1 - math.cos(math.radians(90 / 48 / math.sqrt(2)))), errors
    assert errors[1] < 0.4 * errors[0], errors


def test_a_beam_through_a_luneburg_ball_is_curved_to_its_far_rim(scene, press):
    material = graded_ball_material("Lens", Profile("luneburg"), backend="nodes", radius=0.5)
    ball = add("Lens", *shapes.cube_sphere(24), material, smooth=True)
    ball.data.transform(Matrix.Scale(0.5, 4))
    turn = Euler((0.5, 0.6, 0.7)).to_matrix().to_4x4()
    ball.matrix_world = Matrix.Translation((1, 2, 3)) @ turn @ Matrix.Diagonal((-3, 3, 3, 1))
    scene.cursor.location = (-2, 2, 3)
    press("nim.light_paths", rays=7, fit=False, width=2.0, reach=1.0, aim="DIRECTION", direction=(1, 0, 0))
    pieces, _ = drawn(Kind.TRANSMITTED)
    out = pieces[np.linalg.norm(pieces[:, 1] - (1, 2, 3), axis=1) > 1.5 + 1e-3]
    assert len(out) == 7 and len(pieces) == 7 * POINTS
    np.testing.assert_allclose(out[:, 0], np.tile((2.5, 2, 3), (7, 1)), atol=1e-5)
    sines = np.linspace(-1, 1, 7) / 1.5
    np.testing.assert_allclose(np.sort(direction(out)[:, 2]), np.sort(sines), atol=1e-5)
    assert not len(drawn(Kind.REFLECTED)[0])
    # a function is not kept in the file, and so not known
    material = graded_ball_material("Function", Profile(lambda r: np.sqrt(2 - r * r)), backend="nodes")
    ball.data.materials[0] = material
    with pytest.raises(RuntimeError, match="no visible mesh"):
        press("nim.light_paths")


def test_flat_faces_bend_by_their_own_normals(scene, press):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    scene.cursor.location = (-3, 0, 0)
    press("nim.light_paths", rays=1, aim="DIRECTION", direction=(1, 0.3, 0.1))
    out = drawn(Kind.TRANSMITTED)[0][1]
    np.testing.assert_allclose(direction(out[None]), direction(np.array([[(0, 0, 0), (1, 0.3, 0.1)]])), atol=1e-6)


def test_modifiers_and_instances_count_and_what_is_hidden_does_not(scene, press):
    wall = add_interface(-1.5, shapes.rectangle((-1, -1), (1, 1)))
    array = wall.modifiers.new("Array", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = 3, False, True
    array.constant_offset_displace = (0, 0, -1)
    scene.cursor.location = (0, 0, 2)
    down = {"rays": 1, "aim": "FORWARD", "least": 0.5}  # the cursor looks down
    press("nim.light_paths", **down)
    np.testing.assert_allclose(drawn(Kind.TRANSMITTED)[0][:, 0, 2], (0, -1, -2), atol=1e-5)
    group = bpy.data.collections.new("Group")
    scene.collection.children.link(group)
    bpy.context.collection.objects.unlink(wall)
    group.objects.link(wall)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", group
    instance.location.z = 0.5
    scene.collection.objects.link(instance)
    press("nim.light_paths", **down)
    np.testing.assert_allclose(drawn(Kind.TRANSMITTED)[0][:, 0, 2], (0.5, 0, -0.5, -1, -1.5, -2), atol=1e-5)
    wall.hide_set(True)  # from the viewport, not from renders
    press("nim.light_paths", **down)
    np.testing.assert_allclose(drawn(Kind.TRANSMITTED)[0][:, 0, 2], (0.5, 0, -0.5, -1, -1.5, -2), atol=1e-5)
    assert wall.hide_get()
    layer = bpy.context.view_layer.layer_collection.children["Group"]
    layer.exclude = True
    press("nim.light_paths", **down)
    np.testing.assert_allclose(drawn(Kind.TRANSMITTED)[0][:, 0, 2], (0.5, -0.5, -1.5), atol=1e-5)
    layer.exclude = False
    instance.hide_render = True
    press("nim.light_paths", **down)
    np.testing.assert_allclose(drawn(Kind.TRANSMITTED)[0][:, 0, 2], (0, -1, -2), atol=1e-5)


def test_what_cuts_the_rays_is_said(scene, press, capfd):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    press("nim.light_paths", source="SIDE", bounces=0)
    assert "Warning: After 0 bounces 100 % of the light ends at a surface; raise Bounces" in capfd.readouterr().out
    press("nim.light_paths", source="SIDE", bounces=1)
    assert "Warning: After 1 bounces 96 % of the light ends at a surface" in capfd.readouterr().out
    press("nim.light_paths", source="SIDE", bounces=8, least=0.99)
    assert "Warning: Branches with 100 % of the light have less than the Least Energy" in capfd.readouterr().out
    press("nim.light_paths", source="SIDE", bounces=8, least=0.001)
    assert "Warning" not in capfd.readouterr().out


def test_the_camera_and_the_lamp_and_the_cursor_keep_their_own(scene, press):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    scene.cursor.location = (-5, 0, 0)
    for source in ("CURSOR", "CAMERA", "LAMP", "CURSOR", "CAMERA"):
        press("nim.light_paths", source=source, rays=2)
    assert {object_[PATHS_MARK] for object_ in scene.objects if object_.get(PATHS_MARK)} == {
        "cursor",
        "camera",
        "lamp Light",
    }
    assert len(drawn(Kind.INCIDENT)[0]) == 6
    assert [c.name for c in scene.collection.children if c.get(PATHS_MARK)] == [light_curves.COLLECTION]
    assert len([m for m in bpy.data.materials if m.get(PATHS_MARK)]) == 3
    incident = [item for item in scene.objects if item.get(PATHS_MARK) and item.data.name.startswith("Incident")]
    begins = {item[PATHS_MARK]: {spline.points[0].radius for spline in item.data.splines} for item in incident}
    # of a tube that is pointed at the lens one would see the inside
    assert begins == {"camera": {0.0}, "cursor": {1.0}, "lamp Light": {1.0}}
    # what is drawn stops no rays
    before = drawn(Kind.TRANSMITTED)[0]
    press("nim.light_paths", source="CAMERA", rays=2)
    np.testing.assert_array_equal(drawn(Kind.TRANSMITTED)[0], before)


def test_clear_leaves_the_file_as_it_was_and_what_a_person_put_there(scene, press, capfd):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    assert not bpy.ops.nim.light_paths_clear.poll()
    before = data()
    scene.cursor.location = (-5, 0, 0)
    press("nim.light_paths")
    assert data() != before
    assert "Info: Light paths drawn; rays: 21, pieces: " in capfd.readouterr().out
    mine = bpy.data.objects.new("Mine", None)
    light_curves.collection_of(scene).objects.link(mine)
    press("nim.light_paths_clear")
    assert mine.name in scene.collection.objects
    bpy.data.objects.remove(mine)
    assert data() == before


def test_clear_hands_back_what_the_scene_has_already_and_what_is_not_its_namesake(scene, press, tmp_path):
    file = str(tmp_path / "library.blend")
    stranger = bpy.data.objects.new("Mine", None)
    bpy.data.libraries.write(file, {stranger})
    bpy.data.objects.remove(stranger)
    with bpy.data.libraries.load(file, link=True) as (_, chosen):
        chosen.objects = ["Mine"]
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    press("nim.light_paths", rays=3)
    paths, top = light_curves.collection_of(scene), scene.collection
    child, another = bpy.data.collections.new("Child"), bpy.data.collections.new("Another")
    mine = bpy.data.objects.new("Mine", None)
    for home in (paths, top):
        home.children.link(child)
        home.objects.link(mine)
    paths.children.link(another)
    paths.objects.link(chosen.objects[0])
    press("nim.light_paths_clear")
    assert {child, another} <= set(top.children)
    assert {mine, chosen.objects[0]} <= set(top.objects)
    assert light_curves.collection_of(scene) is None


def test_undo_and_redo(scene, press):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    scene.cursor.location = (-5, 0, 0)
    bpy.ops.ed.undo_push(message="before")
    before = data()
    press("nim.light_paths", rays=3)
    after = data()
    press("nim.light_paths_clear")
    assert data() == before
    bpy.ops.ed.undo()
    assert data() == after and len(drawn(Kind.INCIDENT)[0]) == 3
    bpy.ops.ed.undo()
    assert data() == before and bpy.context.scene.nim_rays.rays == 21
    bpy.ops.ed.redo()
    assert data() == after and bpy.context.scene.nim_rays.rays == 3


def test_the_scene_keeps_the_settings(scene, press, tmp_path):
    add_interface(-1.5, shapes.box((-1, -1, -1), (1, 1, 1)))
    scene.cursor.location = (-5, 0, 0)
    press("nim.light_paths", rays=4, arrangement="FAN")
    scene.nim_rays.rays = 6
    press("nim.light_paths")  # what is left open is as the scene has it
    assert len(drawn(Kind.INCIDENT)[0]) == 6
    file = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    settings = bpy.context.scene.nim_rays
    assert (settings.rays, settings.arrangement) == (6, "FAN")
    assert settings.thickness == pytest.approx(0.007 * math.sqrt(12))  # as fitted
    assert bpy.data.scenes.new("Another").nim_rays.rays == 21


def test_media_that_a_link_decides_stop_rays_and_are_named(scene, press, capfd):
    first = add_interface(-1.5, shapes.rectangle((-1, -1), (1, 1), 0.0))
    second = add_interface(-1.5, shapes.rectangle((-1, -1), (1, 1), 1.0))
    second.data.materials[0].name = "Animated"
    tree = second.data.materials[0].node_tree
    tree.links.new(tree.nodes.new("ShaderNodeValue").outputs[0], tree.nodes["NIM Interface"].inputs["Index Inside"])
    scene.cursor.location = (0, 0, 2)
    press("nim.light_paths", rays=1, aim="FORWARD")
    assert "Warning: Rays end at Animated: " in capfd.readouterr().out
    np.testing.assert_allclose(drawn(Kind.INCIDENT)[0][0, 1], (0, 0, 1), atol=1e-6)
    # a node that leads nowhere is no interface
    tree = first.data.materials[0].node_tree
    tree.links.clear()
    with pytest.raises(RuntimeError, match="no visible mesh of this scene has a NIM Interface material"):
        press("nim.light_paths")


def test_failures_say_why_and_change_nothing(scene, press, capfd, monkeypatch):
    scene.cursor.location = (-5, 0, 0)
    before = data()
    with pytest.raises(RuntimeError, match="no visible mesh of this scene has a NIM Interface material"):
        press("nim.light_paths")
    assert data() == before
    box = add_interface(-30, shapes.box((-1, -1, -1), (1, 1, 1)))
    before = data()
    with pytest.raises(RuntimeError, match="direction of the rays is zero"):
        press("nim.light_paths", aim="DIRECTION", direction=(0, 0, 0))
    with monkeypatch.context() as patch:
        patch.setattr(light_tracing, "MOST_SEGMENTS", 50)
        with pytest.raises(RuntimeError, match="pieces; take fewer rays or bounces, or a higher least energy"):
            press("nim.light_paths")
    camera, scene.camera = scene.camera, None
    with pytest.raises(RuntimeError, match="no camera"):
        press("nim.light_paths", source="CAMERA")
    scene.camera = camera
    assert data() == before and scene.nim_rays.source == "CURSOR"
    press("nim.light_paths", aim="DIRECTION", direction=(-1, 0, 0))
    assert "Warning: No ray met an object that bends light" in capfd.readouterr().out
    bpy.context.view_layer.objects.active = box
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="poll"):
        press("nim.light_paths")
    bpy.ops.object.mode_set(mode="OBJECT")


def test_disabling_takes_the_settings_along(addon):
    import addon_utils

    assert hasattr(bpy.types.Scene, "nim_rays")
    addon_utils.disable(addon)
    assert not hasattr(bpy.types.Scene, "nim_rays")
    addon_utils.enable(addon)


@pytest.mark.parametrize("kind", [sphere, glass])
def test_200_rays_of_8_bounces_are_drawn_in_all_their_pieces(addon, press, kind):
    scene = kind.build(kind.SphereParameters() if kind is sphere else kind.GlassParameters(), "nodes")
    bpy.context.window.scene = scene
    scene.cursor.location = (-3, 0, 1.1) if kind is sphere else (-0.2, 0, 0.05)
    press("nim.light_paths", rays=200, bounces=8, arrangement="CONE")
    bpy.context.view_layer.update()
    pieces = sum(len(drawn(kind, scene)[0]) for kind in Kind)
    assert pieces > 1000


def test_paths_are_seen_and_change_nothing_else(scene, press, render):
    add_interface(-1.5, shapes.cube_sphere(8), smooth=True)
    add_floor(-1.5)
    scene.camera.matrix_world = Matrix.Translation((0, 0, 5))
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 8, False, False
    scene.cycles.transparent_max_bounces = 64
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.cursor.location = (-3, 0, 0)
    straight = {"rays": 1, "fit": False, "thickness": 0.15, "reach": 9.0, "width": 1.0, "roll": 0.0}

    without = render(scene)
    changed = {}
    for through in (True, False):
        press("nim.light_paths", through=through, **straight)
        for object_ in (object_ for object_ in scene.objects if object_.get(PATHS_MARK)):
            assert not (object_.visible_diffuse or object_.visible_glossy or object_.visible_volume_scatter)
            assert not object_.visible_shadow and object_.visible_camera and object_.visible_transmission == through
        changed[through] = np.abs(render(scene) - without).max(axis=-1)
        # it is seen beside the ball, and nothing is lit or shaded by it
        assert changed[through][11:13, :4].max() > 0.1
        assert max(changed[through][:6].max(), changed[through][-6:].max()) < 1e-3
    # in the middle of the ball only where that is wanted; else there is some noise, as a ray passes unseen surfaces
    assert changed[True][11:13, 10:14].mean() > 0.3
    assert changed[False][11:13, 10:14].mean() < 0.03


def glass_of_blender(tint):
    material = bpy.data.materials.new("Glass")
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs={"Color": (*tint, 1.0), "Roughness": 0.0}))
    return material


@pytest.mark.parametrize(
    "made",
    [
        lambda tint: interface_material("NIM", Medium(-1.5), backend="nodes", tint=tint),
        lambda tint: interface_material("Glass", Medium(1.5), backend="nodes", tint=tint),
        lambda tint: interface_material("NIM", Medium.parse("n=-1.5,length=2"), backend="nodes", volume=True),
        glass_of_blender,
    ],
    ids=["NIM", "glass", "absorbing", "Blender's"],
)
def test_curves_are_seen_behind_what_is_tinted_or_absorbs(scene, made, render):
    add("Pane", *shapes.box((-2, -2, 0), (2, 2, 1)), made((0.3, 0.9, 0.4)))
    scene.camera.matrix_world = Matrix.Translation((0, 0, 6))
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 8, False, False
    scene.cycles.transparent_max_bounces = scene.cycles.max_bounces = scene.cycles.transmission_bounces = 24
    scene.render.resolution_x = scene.render.resolution_y = 24
    without = render(scene)
    beyond = Shapes(Plane((0, 0, -50), (0, 0, 1)))  # which the ray does not meet
    light_curves.draw(scene, "side", trace(beyond, (-1, 0, -1), (1, 0, 0), reach=2.0), 0.3, True)
    changed = (render(scene) - without)[10:14].max(axis=(0, 1))
    assert changed[1] > 0.2 and changed[2] > 0


def test_beams_through_a_window_of_lenslets_and_a_hyperbolic_slab(scene, press):
    turn = Matrix.Translation((1, 2, 3)) @ Euler((0.5, 0.6, 0.7)).to_matrix().to_4x4()
    normal, x = np.array(turn.col[2])[:3], np.array(turn.col[0])[:3]
    # the window is turned to the light, which comes 30 degrees from its normal
    d = math.sin(math.pi / 6) * x - math.cos(math.pi / 6) * normal
    window = add("Window", *shapes.rectangle((-2, -2), (2, 2)), lenslet_material("Window", LensletWindow(-1.0)))
    window.matrix_world = turn
    scene.cursor.location = np.array((1, 2, 3)) - d
    press("nim.light_paths", rays=1, fit=False, reach=1.0, aim="DIRECTION", direction=d)
    (piece,) = drawn(Kind.TRANSMITTED)[0]
    np.testing.assert_allclose(piece[0], (1, 2, 3), atol=1e-5)
    np.testing.assert_allclose(piece[1] - piece[0], d - 2 * (d @ x) * x, atol=1e-5)
    slab = UniaxialSlab(2.0, -3.0, 0.25)
    window.data.materials[0] = slab_material("Slab", slab)
    window.scale = 2, 2, 2
    press("nim.light_paths", rays=1, fit=False, reach=1.0, aim="DIRECTION", direction=d)
    pieces, _ = drawn(Kind.TRANSMITTED)
    ends = np.array((1, 2, 3)) - 0.5 * normal + 0.5 * np.array(slab.slopes(math.pi / 6))[:, None] * x
    out = np.array([piece for piece in pieces if np.linalg.norm(piece[0] - (1, 2, 3)) > 1e-3])
    np.testing.assert_allclose(out[np.argsort(out[:, 0] @ x), 0], ends[np.argsort(ends @ x)], atol=1e-5)
    np.testing.assert_allclose(direction(out), [d, d], atol=1e-5)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays meet is what a render shows, and where they meet it is exact to more than Blender casts."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from mathutils.bvhtree import BVHTree

from nim_addon.cycles import casting
from nim_addon.cycles.casting import Meshes
from nim_addon.cycles.visibility import CAUSTICS_MARK, as_rendered, shown
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces


def add(scene, vertices, faces, material=None, smooth=False):
    mesh = bpy.data.meshes.new("Thing")
    mesh.from_pydata(np.asarray(vertices).tolist(), [], faces)
    mesh.materials.append(material)
    if smooth:
        mesh.shade_smooth()
    thing = bpy.data.objects.new("Thing", mesh)
    scene.collection.objects.link(thing)
    return thing


def hit(scene, origins, directions):
    """The Hit, and the Meshes, of what a render of the scene shows."""
    origins, directions = np.broadcast_arrays(np.atleast_2d(origins).astype(float), np.atleast_2d(directions))
    with as_rendered(scene) as depsgraph:
        meshes = Meshes(shown(scene, depsgraph), depsgraph)
        return meshes.hit(origins, directions.astype(float)), meshes


def geometry_nodes(thing, material=None, instances=None):
    """A modifier that sets a material, or makes the geometry a mesh instance at each of the points `instances`."""
    tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    enter, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    given = enter.outputs[0]
    if material:
        wear = tree.nodes.new("GeometryNodeSetMaterial")
        wear.inputs["Material"].default_value = material
        tree.links.new(given, wear.inputs["Geometry"])
        given = wear.outputs[0]
    if instances:
        line, place = tree.nodes.new("GeometryNodeMeshLine"), tree.nodes.new("GeometryNodeInstanceOnPoints")
        line.inputs["Count"].default_value, line.inputs["Offset"].default_value = instances, (0, 0, 2)
        tree.links.new(line.outputs[0], place.inputs["Points"])
        tree.links.new(given, place.inputs["Instance"])
        given = place.outputs[0]
    tree.links.new(given, leave.inputs[0])
    thing.modifiers.new("Nodes", "NODES").node_group = tree


def test_normals_of_a_stretched_ball_are_those_of_the_ellipsoid(scene, nim):
    ball = add(scene, *shapes.cube_sphere(32), nim, smooth=True)
    ball.scale = stretch = np.array((2.0, 1.0, 0.4))
    outwards = np.random.default_rng(1).normal(size=(50, 3)) * stretch
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    found, _ = hit(scene, 9 * outwards, -outwards)
    at = (9 - found.distance)[:, None] * outwards
    np.testing.assert_allclose(np.linalg.norm(at / stretch, axis=1), 1, atol=1e-3)
    normals = at / stretch**2
    np.testing.assert_allclose(found.normal, normals / np.linalg.norm(normals, axis=1, keepdims=True), atol=5e-3)
    assert (found.which == 0).all()


@pytest.mark.parametrize("how", ["slot", "set material", "override", "group", "nested instances", "node instances"])
def test_a_material_counts_wherever_it_comes_from(scene, nim, how):
    plain = surfaces.plain("Plain", (0.5, 0.5, 0.5))
    thing = add(scene, *shapes.rectangle((-1, -1), (1, 1)), nim if "instances" in how else plain)
    expected = 0.0
    if how == "slot":
        thing.material_slots[0].link = "OBJECT"
        thing.material_slots[0].material = nim
    elif how == "set material":
        geometry_nodes(thing, nim)
    elif how == "override":
        scene.view_layers[0].material_override = nim
    elif how == "group":
        tree = bpy.data.node_groups.new("Mine", "ShaderNodeTree")
        tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        inner = tree.nodes.new("ShaderNodeGroup")
        inner.node_tree = nim.node_tree.nodes["NIM Interface"].node_tree
        tree.links.new(inner.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
        outer = plain.node_tree.nodes.new("ShaderNodeGroup")
        outer.node_tree = tree
        end = next(node for node in plain.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
        plain.node_tree.links.new(outer.outputs[0], end.inputs["Surface"])
    elif how == "nested instances":
        scene.collection.objects.unlink(thing)
        for z in (0.5, 1.0):  # an empty that repeats a collection with the thing, or with the empty before
            group = bpy.data.collections.new("Group")
            group.objects.link(thing)
            thing = bpy.data.objects.new("Instance", None)
            thing.instance_type, thing.instance_collection = "COLLECTION", group
            thing.location.z = z
        scene.collection.objects.link(thing)
        expected = 1.5
    else:
        geometry_nodes(thing, instances=3)
        expected = 4.0
    found, meshes = hit(scene, (0.3, 0.2, 9), (0, 0, -1))
    np.testing.assert_allclose(found.distance, 9 - expected, atol=1e-6)
    assert found.which.tolist() == [0] and meshes.interfaces[0].inside == Medium(-1.5)
    assert meshes.high[2] == pytest.approx(expected, abs=1e-6) and not meshes.unknown


def test_curves_with_a_thickness_stop_rays_and_what_a_bake_made_does_not(scene, nim):
    add(scene, *shapes.rectangle((-1, -1), (1, 1)), nim)
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.25
    curve.splines.new("POLY").points.add(1)
    for point, x in zip(curve.splines[0].points, (-1, 1), strict=True):
        point.co = x, 0, 2, 1
    scene.collection.objects.link(bpy.data.objects.new("Curve", curve))
    copy = add(scene, *shapes.rectangle((-1, -1), (1, 1), 3.0))
    copy[CAUSTICS_MARK] = True
    found, _ = hit(scene, [(0, 0, 9), (0, 0.9, 9)], (0, 0, -1))
    np.testing.assert_allclose(found.distance, (6.75, 9), atol=1e-5)
    assert found.which.tolist() == [-1, 0]


def test_slots_of_one_mesh_and_the_bounds_of_those_that_bend(scene, nim):
    vertices, faces = shapes.box((-1, -1, -1), (1, 1, 1))
    thing = add(scene, vertices, faces, surfaces.plain("Plain", (0.5, 0.5, 0.5)))
    thing.data.materials.append(nim)
    top = next(one for one in thing.data.polygons if one.normal.z > 0.9)
    top.material_index = 8  # beyond the slots: the last one counts
    thing.location.x = 10
    found, meshes = hit(scene, [(10, 0, 9), (19, 0, 0)], [(0, 0, -1), (-1, 0, 0)])
    assert found.which.tolist() == [0, -1]
    np.testing.assert_allclose(meshes.low, (9, -1, 1), atol=1e-6)
    np.testing.assert_allclose(meshes.high, (11, 1, 1), atol=1e-6)
    assert list(meshes.bounds) == [thing]


def test_hits_of_many_objects_are_the_nearest_and_exact_to_double_precision(scene, nim):
    """Turned, mirrored, stretched boxes beside each other: each hit is where the planes of the corners say."""
    rng = np.random.default_rng(2)
    vertices, faces = shapes.box((-1, -1, -1), (1, 1, 1))
    mesh = add(scene, vertices, faces, nim).data
    boxes = [scene.objects[0]] + [bpy.data.objects.new("Box", mesh) for _ in range(29)]
    for thing in boxes:
        if thing.name not in scene.collection.objects:
            scene.collection.objects.link(thing)
        scale = Matrix.Diagonal((*rng.uniform(0.2, 2, 2), -rng.uniform(0.2, 2), 1))
        thing.matrix_world = (
            Matrix.Translation(rng.uniform(-4, 4, 3)) @ Euler(rng.uniform(0, 6, 3)).to_matrix().to_4x4() @ scale
        )
    origins, directions = rng.uniform(-9, 9, (400, 3)), rng.uniform(-4, 4, (400, 3))
    directions -= origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    bpy.context.view_layer.update()
    found, _ = hit(scene, origins, directions)
    nearest = np.full(400, np.inf)
    for thing in boxes:
        matrix = np.array(thing.matrix_world, float)
        local = np.linalg.inv(matrix)
        o, d = origins @ local[:3, :3].T + local[:3, 3], directions @ local[:3, :3].T
        first, last = np.sort(np.stack([(-1 - o) / d, (1 - o) / d]), axis=0)
        enter, leave = first.max(axis=1), last.min(axis=1)
        at = np.where(enter > 0, enter, leave)
        nearest = np.where((enter < leave) & (at > 0) & (at < nearest), at, nearest)
    assert np.isfinite(nearest).sum() > 100
    np.testing.assert_allclose(found.distance, nearest, rtol=1e-10)
    assert (found.which == np.where(np.isfinite(nearest), 0, -1)).all()


def test_faces_of_many_corners_are_met_in_each_of_their_triangles(scene, nim):
    turn = np.linspace(0, 2 * np.pi, 7, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn), 0.2 * np.cos(3 * turn)], -1)
    add(scene, [*rim, (9, 9, 9), (8, 9, 9), (9, 8, 9)], [[7, 8, 9], list(range(7))], nim)
    at = np.random.default_rng(3).uniform(-0.55, 0.55, (60, 2))
    found, _ = hit(scene, np.insert(at, 2, 5, axis=1), (0, 0, -1))
    mesh = scene.objects[0].data
    mesh.calc_loop_triangles()
    for (x, y), distance in zip(at, found.distance, strict=True):
        for triangle in mesh.loop_triangles:
            a, b, c = (np.array(mesh.vertices[i].co, float) for i in triangle.vertices)
            u, v = np.linalg.solve(np.stack([b - a, c - a], -1)[:2], np.array((x, y)) - a[:2])
            if u >= 0 and v >= 0 and u + v <= 1:
                assert 5 - distance == pytest.approx((a + u * (b - a) + v * (c - a))[2], abs=1e-9)
                break
        else:
            raise AssertionError("no triangle there")


def test_custom_and_flat_normals_are_those_of_the_corners(scene, nim):
    thing = add(scene, *shapes.rectangle((-1, -1), (1, 1)), nim, smooth=True)
    leaning = np.array((0.3, 0.1, 1)) / np.linalg.norm((0.3, 0.1, 1))
    thing.data.normals_split_custom_set([leaning] * 4)
    found, _ = hit(scene, (0.2, 0.3, 1), (0, 0, -1))
    np.testing.assert_allclose(found.normal, [leaning], atol=1e-3)
    thing = add(scene, *shapes.rectangle((-1, -1), (1, 1), 0.5), nim)
    np.testing.assert_allclose(hit(scene, (0.2, 0.3, 1), (0, 0, -1))[0].normal, [(0, 0, 1)], atol=1e-7)


def test_small_meshes_are_met_as_by_a_tree(scene, nim, monkeypatch):
    corners = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)])  # a face that is not convex
    flat = add(scene, np.insert(corners, 2, 0.3, axis=1), [tuple(range(6))], nim)
    flat.scale = (1, -1, 1)
    box = add(scene, *shapes.box((-1, -1, -1), (1, 1, 1)))
    box.rotation_euler, box.scale, box.location = (0.3, 0.7, 0.2), (1, 2, -0.5), (0.5, 0, -1)
    ball = add(scene, *shapes.cube_sphere(8), nim, smooth=True)
    ball.location = (-1, -1, 0.5)
    rounded = add(scene, *shapes.box((-0.7, -0.7, -0.7), (0.7, 0.7, 0.7)), nim, smooth=True)
    rounded.location, rounded.rotation_euler = (-1, 1.5, 0.5), (0.5, 0.1, 0.9)
    random = np.random.default_rng(3)
    origins = random.uniform(-4, 4, (2000, 3))
    directions = random.normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found, _ = hit(scene, origins, directions)
    monkeypatch.setattr(casting, "FEW", 0)
    by_tree, _ = hit(scene, origins, directions)
    assert np.isfinite(found.distance).sum() > 200 and {-1, 0} == set(found.which[np.isfinite(found.distance)].tolist())
    np.testing.assert_array_equal(found.which, by_tree.which)
    # each is worked out in its own way, in double precision
    np.testing.assert_allclose(found.distance, by_tree.distance, rtol=1e-13)
    np.testing.assert_allclose(found.normal, by_tree.normal, atol=1e-14)


def test_no_ray_passes_between_the_triangles_of_a_small_mesh(scene, nim):
    box = add(scene, *shapes.box((-1, -1, -1), (1, 1, 1)), nim)
    box.rotation_euler = (0.3, 0.7, 0.2)
    share = np.linspace(0, 1, 1001)[:, None]
    diagonal = np.array(((-1.0, -1.0), (1.0, 1.0)))
    edges = [share * diagonal[0] + (1 - share) * diagonal[1], share * (1, -1) + (1 - share) * (-1, 1)]
    at = np.concatenate([np.insert(edge, 2, 1.0, axis=1) for edge in edges])[1:-1]
    turn = np.array(box.rotation_euler.to_matrix())
    found, _ = hit(scene, at @ turn.T * 0.999 + turn[:, 2] * 2, -turn[:, 2])
    np.testing.assert_allclose(found.distance, 2, atol=0.01)


def test_only_meshes_whose_bounds_a_ray_meets_get_a_tree_and_small_ones_none(scene, nim, monkeypatch):
    add(scene, *shapes.rectangle((-1, -1), (1, 1), -3), nim)
    add(scene, *shapes.cube_sphere(7), nim)
    add(scene, *shapes.cube_sphere(8), nim).location.x = 9
    trees = []

    class Counted:
        @staticmethod
        def FromObject(thing, depsgraph):
            trees.append(len(thing.data.polygons))
            return BVHTree.FromObject(thing, depsgraph)

    monkeypatch.setattr(casting, "BVHTree", Counted)
    with as_rendered(scene) as depsgraph:
        meshes = Meshes(shown(scene, depsgraph), depsgraph)
        assert trees == []
        for _ in range(2):
            meshes.hit(np.array([(0.0, 0.0, 5.0)]), np.array([(0.0, 0.0, -1.0)]))
        assert trees == [294]


def test_no_interface_leaves_no_bounds(scene):
    assert not hit(scene, (0, 0, 1), (0, 0, -1))[1].bounds
    add(scene, *shapes.rectangle((-1, -1), (1, 1)))
    add(scene, [(0, 0, 0)], [])
    found, meshes = hit(scene, (0, 0, 1), (0, 0, -1))
    assert not meshes.bounds and found.which.tolist() == [-1] and found.distance[0] == pytest.approx(1)


def test_faces_are_met_from_either_side_and_not_beside_them():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
    solid = casting.Faces(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    origins = np.array([(0.2, 0.2, 5), (0.9, 0.9, 5), (0.2, 0.2, -5.0), (0.2, 0.2, 0.1)])
    distance, normals = solid.meet(origins, np.tile((0, 0, -1.0), (4, 1)))
    np.testing.assert_allclose(distance, [4.4, np.inf, np.inf, 0.1], rtol=1e-6)
    np.testing.assert_allclose(normals, [np.full(3, 3**-0.5), (0, 0, 0), (0, 0, 0), (0, 0, -1)], atol=1e-6)


def test_boxes_are_entered_from_outside_from_within_and_along_their_sides():
    origins = np.array([(-3, 0.5, 0.5), (0.5, 0.5, 0.5), (-3, 1.0, 0.5), (3, 0.5, 0.5), (-3, 1.05, 0.5)])
    low, high = np.array([(0, 0, 0), (0, 0, 0.0)]), np.array([(1, 1, 1), (2, 2, 2.0)])
    found = casting.entries(origins, np.tile((1.0, 0, 0), (5, 1)), low, high, np.array([0.1, 0.0]))
    expected = [(2.9, 3), (0, 0), (2.9, 3), (np.inf, np.inf), (2.9, 3)]
    np.testing.assert_allclose(found, expected)
    assert casting.entries(origins, np.tile((1.0, 0, 0), (5, 1)), low, high)[4].tolist() == [np.inf, 3]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The arrays of a mesh are what its vertices, corners and faces say one by one."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from nim_addon.cycles import meshes


@pytest.fixture
def mesh(empty_file):
    """A triangle of material 1, a quad of material 5."""
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (2, 3, 4)], [], [(0, 1, 2), (1, 4, 3, 2)])
    mesh.polygons[0].material_index, mesh.polygons[1].material_index = 1, 5
    return mesh


def test_arrays_are_those_of_the_mesh(mesh):
    np.testing.assert_array_equal(meshes.vertices(mesh), [vertex.co for vertex in mesh.vertices])
    assert meshes.vertices(mesh).dtype == np.float32
    assert meshes.corners(mesh).tolist() == [0, 1, 2, 1, 4, 3, 2]
    assert meshes.starts(mesh).tolist() == [0, 3, 7]
    assert meshes.faces(meshes.corners(mesh), meshes.starts(mesh)) == [[0, 1, 2], [1, 4, 3, 2]]
    assert meshes.slots(mesh, 3).tolist() == [1, 2]
    assert meshes.slots(mesh, 1).tolist() == [0, 0]
    own = [tuple(triangle.vertices) for triangle in mesh.loop_triangles]
    assert len(own) == 3 and [tuple(one) for one in meshes.triangles(mesh)] == own
    corners = meshes.corners(mesh)[meshes.triangles(mesh, "loops")]
    np.testing.assert_array_equal(corners, meshes.triangles(mesh))
    assert meshes.read(mesh.polygons, "area").shape == (2,) and meshes.read(mesh.polygons, "normal", 3).shape == (2, 3)


def test_vertices_stand_where_a_matrix_puts_them(mesh):
    matrix = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.7, 4, "X") @ Matrix.Diagonal((2, -1, 1, 1))
    placed = meshes.vertices(mesh, matrix)
    assert placed.dtype == float
    np.testing.assert_allclose(placed, [matrix @ vertex.co for vertex in mesh.vertices], atol=1e-6)


def test_arrays_are_those_of_what_is_shown_while_a_mesh_is_edited(empty_file):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.modifiers.new("Divide", "SUBSURF")
    bpy.ops.object.mode_set(mode="EDIT")
    mesh = cube.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert len(mesh.vertices) > 8
    np.testing.assert_array_equal(meshes.vertices(mesh), [vertex.co for vertex in mesh.vertices])
    assert meshes.corners(mesh).tolist() == [loop.vertex_index for loop in mesh.loops]
    assert meshes.corner_edges(mesh).tolist() == [loop.edge_index for loop in mesh.loops]


def test_an_empty_mesh_has_empty_arrays(empty_file):
    mesh = bpy.data.meshes.new("Empty")
    assert meshes.vertices(mesh).shape == (0, 3) and meshes.corners(mesh).shape == (0,)
    assert meshes.starts(mesh).tolist() == [0] and meshes.triangles(mesh).shape == (0, 3)
    assert meshes.faces(meshes.corners(mesh), meshes.starts(mesh)) == []
    low, high = meshes.bounds(meshes.vertices(mesh))
    assert low.tolist() == high.tolist() == [0, 0, 0]


def test_a_box_has_eight_corners():
    found = meshes.box_corners((0, 1, 2), (3, 4, 5))
    assert {tuple(corner) for corner in found} == {(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)}

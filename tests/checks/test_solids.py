# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of meshes, their holes and sides, on vertices welded by distance: against shapes whose answer is known."""

from itertools import pairwise

import bpy
import numpy as np
import pytest

from nim_addon.checks.solids import Solid, components
from nim_addon.scenes import shapes
from nim_addon.scenes.glass import GlassParameters, build


def solid(vertices, faces, split=False, shift=0.0):
    """A Solid of arrays; with `split` each face has vertices of its own, moved at random by up to `shift`."""
    vertices = np.asarray(vertices, float)
    if split:
        corners = np.concatenate([np.asarray(face) for face in faces])
        vertices = vertices[corners] + np.random.default_rng(2).uniform(-shift, shift, (len(corners), 3))
        ends = np.cumsum([len(face) for face in faces])
        faces = [range(end - len(face), end) for face, end in zip(faces, ends, strict=True)]
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(vertices.tolist(), [], [list(map(int, face)) for face in faces])
    return Solid(mesh)


def cube(size=2.0, at=(0, 0, 0)):
    return shapes.box(np.subtract(at, size / 2), np.add(at, size / 2))


@pytest.mark.parametrize("split, shift", [(False, 0), (True, 0), (True, 1e-6)])
@pytest.mark.parametrize("place", [0.0, 1000.0])
def test_a_cube_is_closed_and_of_its_volume(split, shift, place):
    (part,) = solid(*cube(at=(place, 0, 0)), split, shift * (1 + place / 100)).parts
    assert part.closed and part.agreeing and part.volume == pytest.approx(8, rel=1e-3)
    assert part.area == pytest.approx(24, rel=1e-3) and part.net < 1e-2 * part.area


def test_the_poles_of_a_nurbs_sphere_are_no_holes(empty_file):
    # a ring of vertices a rounding apart at each
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    obj = bpy.context.object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    (part,) = Solid(obj.to_mesh()).parts
    assert part.closed and part.volume == pytest.approx(4.13, abs=0.01)


def test_a_gap_that_can_be_seen_is_no_seam():
    (*_, part) = solid(*cube(), True, 1e-3).parts
    assert part.holes == 4


@pytest.mark.parametrize("split", [False, True])
def test_what_is_turned_is_found(split):
    vertices, faces = shapes.cube_sphere(6)
    turned = np.random.default_rng(1).random(len(faces)) < 0.3
    shape = solid(vertices, [face[::-1] if flip else face for face, flip in zip(faces, turned, strict=True)], split)
    (part,) = shape.parts
    assert not part.agreeing and part.orientable and np.array_equal(shape.turned, turned)
    assert part.volume == pytest.approx(solid(vertices, faces).parts[0].volume, rel=1e-3)


def test_a_moebius_strip_has_no_two_sides():
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    rims = [
        [((2 + s * np.cos(t / 2)) * np.cos(t), (2 + s * np.cos(t / 2)) * np.sin(t), s * np.sin(t / 2)) for t in turn]
        for s in (-0.5, 0.5)
    ]
    faces = [(i, i + 1, 13 + i, 12 + i) for i in range(11)] + [(11, 12, 0, 23)]
    (part,) = solid(np.concatenate(rims), faces).parts
    assert not part.orientable and not part.closed


def test_parts_that_touch_at_an_edge_are_two():
    vertices, faces, _ = shapes.joined(cube(), cube(at=(2, 2, 0)))
    parts = solid(vertices, faces).parts
    assert [part.closed for part in parts] == [True, True] and [part.volume for part in parts] == pytest.approx([8, 8])


def test_a_liquid_that_meets_the_wall_of_its_glass_leaves_no_hole(empty_file):
    scene = build(GlassParameters(), "nodes")
    (obj,) = [obj for obj in scene.objects if obj.name == "Glass"]
    parts = Solid(obj.data).parts
    assert len(parts) == 3 and not any(part.holes for part in parts) and all(part.seams == 240 for part in parts)


def test_faces_twice():
    vertices, faces = cube()
    shape = solid(np.concatenate([vertices, vertices]), [*faces, *(tuple(np.add(face, 8)[::-1]) for face in faces[:2])])
    assert shape.doubled.tolist() == [False] * 6 + [True] * 2
    (part,) = shape.parts
    assert part.closed and part.volume == pytest.approx(8)


def test_holes_have_outlines_that_fill_them():
    vertices, faces = cube()
    for split in (False, True):
        shape = solid(vertices, faces[2:], split)
        outlines = shape.outlines()
        assert [len(outline) for outline, _ in outlines] == [4, 4]
        filled = solid(
            shape.points, [*np.split(shape.corners, shape.begins[1:-1]), *(outline for outline, _ in outlines)]
        )
        (part,) = filled.parts
        assert part.closed and part.agreeing and part.volume == pytest.approx(8)


def test_within():
    vertices, faces, _ = shapes.joined(cube(4), cube(2), cube(1, (5, 0, 0)))
    shape = solid(vertices, faces, True)
    for point, parts in [((0, 0, 0.1), {0, 1}), ((1.5, 0.1, 0), {0}), ((5.1, 0, 0), {2}), ((3, 0, 0), set())]:
        assert shape.within(np.array(point, float)) == parts


def test_components():
    rng = np.random.default_rng(3)
    group = rng.integers(0, 7, 300)
    group[:7] = range(7)
    pairs = [(5, 5)]
    for k in range(7):
        members = rng.permutation(np.flatnonzero(group == k))
        pairs += pairwise(members)
    label = components(300, *np.array(pairs).T)
    lowest = [np.flatnonzero(group == k)[0] for k in range(7)]
    assert label.tolist() == [lowest[k] for k in group]


def test_a_mesh_without_faces():
    assert solid(np.zeros((0, 3)), []).parts == () and solid([(0, 0, 0), (1, 0, 0)], []).parts == ()

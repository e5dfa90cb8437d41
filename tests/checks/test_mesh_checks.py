# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that do not fit are said and mended; what is right is neither said nor touched."""

import bpy

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
import numpy as np
import pytest

from nim_addon import checks
from nim_addon.checks import mesh_checks
from nim_addon.cycles.material import interface_material, interface_nodes
from nim_addon.cycles.visibility import PATHS_MARK
from nim_addon.scenes import SCENES
from nim_addon.scenes.cube import CubeParameters
from nim_addon.scenes.cube import build as build_cube
from tests.checks.pieces import AIR, GLASS, MONKEY, NIM, WATER, add, ball, box, codes, found, sheet, volumes


def state():
    """All meshes and all values of interfaces in the file."""
    meshes = {}
    for mesh in bpy.data.meshes:
        points, corners = np.empty(3 * len(mesh.vertices), np.float32), np.empty(len(mesh.loops), np.int32)
        mesh.vertices.foreach_get("co", points)
        mesh.loops.foreach_get("vertex_index", corners)
        meshes[mesh.name] = points.tolist(), corners.tolist()
    values = {
        material.name: [socket.default_value for node in interface_nodes(material) for socket in list(node.inputs)[:4]]
        for material in bpy.data.materials
    }
    return meshes, values, [[slot.material.name for slot in obj.material_slots] for obj in bpy.data.objects]


def hollow_ball_of_two(inner):
    add("Ball", NIM, ball(1))
    inner("Cavity")


RIGHT = {
    "split": lambda: add("Ball", NIM, ball(1), split=True),
    "parts": lambda: add("Boxes", NIM, *(box(1, (3 * i, 0, 0)) for i in range(5)), split=True),
    "shell": lambda: add("Shell", NIM, ball(1), ball(0.5, inwards=True), split=True),
    "shell in shell": lambda: add(
        "Shells", NIM, ball(1), ball(0.8, inwards=True), ball(0.6), ball(0.4, inwards=True), split=True
    ),
    # the surface of a cavity may be made either way, as long as the media agree
    "cavity, NIM behind": lambda: hollow_ball_of_two(lambda name: add(name, NIM, ball(0.5, inwards=True))),
    "cavity, air behind": lambda: hollow_ball_of_two(lambda name: add(name, (AIR, NIM), ball(0.5))),
    "ball in ball": lambda: hollow_ball_of_two(lambda name: add(name, (GLASS, NIM), ball(0.5))),
    "touching at an edge": lambda: add("Boxes", NIM, box(2), box(2, (2, 2, 0))),
    "mirrored": lambda: setattr(add("Ball", NIM, ball(1)), "scale", (-1, 1, 1)),
    "small beside large": lambda: add("Both", NIM, box(100), box(1e-3, (80, 0, 0))),
}


@pytest.mark.parametrize("build", RIGHT.values(), ids=RIGHT)
def test_what_is_right_is_left_as_it_is(scene, build):
    build()
    assert found(scene) == []
    before = state()
    assert checks.mend(scene) == [] and state() == before


@pytest.mark.parametrize("build", RIGHT.values(), ids=RIGHT)
def test_what_is_closed_has_an_end_to_its_volume(scene, build):
    build()
    for material in bpy.data.materials:
        tree = material.node_tree
        volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
        tree.links.new(volume.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    before = state()
    assert "open_volume" not in codes(scene)
    checks.mend(scene)
    assert state()[0] == before[0]


@pytest.mark.parametrize("split", [False, True])
def test_only_the_part_that_is_inside_out_is_turned(scene, split):
    obj = add("Boxes", NIM, box(2), box(1, (3, 0, 0), inwards=True), split=split)
    (problem,) = found(scene)
    assert problem.code == "normals" and problem.sentence == "Some parts of Boxes are inside out: 1 of 2."
    checks.mend(scene)
    assert volumes(obj) == pytest.approx([8, 1]) and codes(scene) == []


def test_the_inner_surface_of_a_shell_is_turned_in(scene):
    obj = add("Shell", NIM, ball(1), ball(0.5), split=True)
    assert codes(scene) == ["normals"]
    checks.mend(scene)
    outer, inner = volumes(obj)
    assert outer > 0 > inner and codes(scene) == []


def test_the_object_in_an_object_of_the_same_is_turned_in(scene):
    material = interface_material("NIM", NIM, backend="nodes")
    add("Ball", material, ball(1))
    inner = add("Inner", material, ball(0.5))
    (problem,) = found(scene)
    assert problem.objects == ("Inner",) and problem.remedy == "Turn them in"
    checks.mend(scene)
    assert volumes(inner)[0] < 0 and codes(scene) == []


def test_single_faces_that_do_not_agree_are_turned(scene):
    obj = add("Ball", NIM, ball(1), ball(0.5, (3, 0, 0)), split=True)
    for face in (3, 77, 500):
        obj.data.polygons[face].flip()
    assert codes(scene) == ["normals"]
    checks.mend(scene)
    assert min(volumes(obj)) > 0 and codes(scene) == []


def test_what_another_object_needs_as_it_is_is_not_turned(scene):
    material = interface_material("NIM", NIM, backend="nodes")
    add("Ball", material, ball(1))
    cavity = add("Cavity", material, ball(0.5, inwards=True))
    free = add("Free", material, mesh=cavity.data)
    free.location.x = 5
    (problem,) = found(scene)
    assert problem.objects == ("Free",) and problem.remedy is None and mesh_checks.SHARED in problem.sentence
    free.data = free.data.copy()
    assert [problem.remedy for problem in found(scene)] == ["Turn them out"]


@pytest.mark.parametrize("split", [False, True])
def test_a_hole_is_said_and_filled(scene, split):
    obj = add("Box", NIM, box(2), split=split, without=1)
    obj.data.uv_layers.new(name="UV")
    count = len(obj.data.vertices)
    (problem,) = found(scene)
    assert problem.code == "open" and problem.sentence.startswith("Box has holes") and problem.remedy
    checks.mend(scene)
    assert codes(scene) == [] and volumes(obj) == pytest.approx([8])
    assert len(obj.data.vertices) == count and obj.data.uv_layers, "nothing is merged or lost"


def test_shape_keys_stay_when_a_hole_is_filled(scene):
    obj = add("Box", NIM, box(2), without=1)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Wide").data[0].co.x -= 1
    checks.mend(scene)
    keys = obj.data.shape_keys.key_blocks
    assert codes(scene) == [] and [key.name for key in keys] == ["Basis", "Wide"]
    assert keys["Wide"].data[0].co.x == keys["Basis"].data[0].co.x - 1


def test_normals_of_its_own_are_turned_with_a_mesh(scene):
    obj = add("Ball", NIM, ball(1, segments=64, inwards=True))
    mesh = obj.data
    mesh.shade_smooth()
    mesh.normals_split_custom_set([-mesh.vertices[corner.vertex_index].co.normalized() for corner in mesh.loops])
    assert codes(scene) == ["normals"]
    checks.mend(scene)
    out = [normal.vector.dot(mesh.vertices[corner.vertex_index].co) for normal, corner in zip(
        mesh.corner_normals, mesh.loops, strict=True)]  # fmt: skip
    assert codes(scene) == [] and min(out) > 0.99


def test_mend_all_turns_what_was_open_and_inside_out(scene):
    obj = add("Box", NIM, box(2, inwards=True), without=1)
    assert [problem.code for problem in checks.mend(scene)] == ["open", "normals"]
    assert codes(scene) == [] and volumes(obj) == pytest.approx([8])


def test_the_hole_in_a_smooth_ball_stays_smooth(scene):
    obj = add("Ball", NIM, ball(1), without=1)
    obj.data.shade_smooth()
    checks.mend(scene)
    assert all(face.use_smooth for face in obj.data.polygons) and codes(scene) == []


def test_a_monkey_is_open_and_cannot_be_filled(scene):
    """Its eyes would be bodies that reach into its head."""
    add("Monkey", NIM, MONKEY)
    (problem,) = found(scene)
    assert problem.code == "open" and problem.remedy is None and mesh_checks.BY_HAND in problem.sentence


def test_a_sheet_is_right_only_where_its_rim_ends_at_something(scene):
    obj = add("Sheet", NIM, sheet(1))
    (problem,) = found(scene)
    assert problem.code == "open" and problem.sentence.startswith("Sheet is a sheet") and problem.remedy is None
    add("Basin", None, box(1.9, (0, 0, -0.5)))
    assert codes(scene) == []
    obj.scale = (0.5, 0.5, 1)
    bpy.data.objects["Basin"].location.z = -3
    assert codes(scene) == ["open"]


def test_a_sheet_that_spans_all_that_is_seen_is_right(scene):
    """A sea without a shore."""
    add("Sea", NIM, sheet(500)).rotation_euler = (0.1, 0, 0.3)
    buoy = add("Buoy", None, box(2))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location = (7, -7, 5)
    scene.collection.objects.link(scene.camera)
    assert codes(scene) == []
    buoy.location.y = 600
    assert codes(scene) == ["open"]
    buoy[PATHS_MARK] = "sun"  # drawn light paths are no part of what is seen
    assert codes(scene) == []


def test_a_hole_that_other_things_close_is_none(scene):
    mesh = add("Box", NIM, box(2, (0, 0, 1))).data
    with mesh_checks.edited(mesh) as shape:
        bottom = [face for face in shape.faces if face.normal.z < -0.5]
        bmesh.ops.delete(shape, geom=bottom, context="FACES_ONLY")
    assert codes(scene) == ["open"]
    add("Floor", None, sheet(5))
    assert codes(scene) == []


def test_edges_that_a_neighbour_divides_are_no_hole(scene):
    """A cube with one face cut into four, its neighbours' edges whole."""
    obj = add("Box", NIM, box(2), without=1)
    shape = bmesh.new()
    shape.from_mesh(obj.data)
    rim = [edge for edge in shape.edges if edge.is_boundary]
    outline = {vert for edge in rim for vert in edge.verts}
    shape.faces.ensure_lookup_table()
    normal = -sum((face.normal for face in shape.faces), shape.faces[0].normal * 0).normalized()
    middle = sum((vert.co for vert in outline), normal * 0) / 4
    center = shape.verts.new(middle)
    for edge in rim:
        a, b = (vert.co.copy() for vert in edge.verts)
        half = shape.verts.new((a + b) / 2)
        for end in edge.verts:
            face = shape.faces.new((end, half, center))
            face.normal_update()
            if face.normal.dot(normal) < 0:
                face.normal_flip()
    shape.to_mesh(obj.data)
    shape.free()
    assert codes(scene) == []


def test_faces_twice_in_one_mesh(scene):
    obj = add("Box", NIM, box(2), box(2))
    (problem,) = found(scene)
    assert problem.code == "doubled" and "faces twice in the same place (6)" in problem.sentence
    checks.mend(scene)
    assert len(obj.data.polygons) == 6 and codes(scene) == []


@pytest.mark.parametrize(
    "name, parameters",
    [
        *(("glass", {"liquid": liquid, "figures": "monkey"}) for liquid in (None, WATER, NIM, GLASS)),
        ("glass", {"view": "top", "straw": False}),
        ("pool", {"waves": 0.0}),
        ("pool", {"waves": 0.2, "liquid": WATER}),
        ("sea", {"waves": 0.0}),
        ("sea", {"waves": 0.4, "liquid": NIM}),
        ("sphere", {"n": 1.5, "companions": True}),
        ("cube", {}),
        ("sphere", {"n": "gold"}),
        ("glass", {"liquid": "n=-1.33,length=0.05"}),
        ("glass", {"liquid": "n=-1.33,length=0.05", "straw": False}),
        ("glass", {"liquid": "water-daimon"}),
        ("pool", {"liquid": "n=-1.33,length=2", "view": "window"}),
        ("pool", {"liquid": "n=1.33,length=2", "waves": 0.0}),
        ("sea", {"liquid": "n=1.33,length=2"}),
        ("sea", {"liquid": "n=-1.33,length=2", "waves": 0.0}),
    ],
    ids=str,
)
def test_the_project_s_own_scenes_are_right(empty_file, name, parameters):
    if name == "cube":
        scene = build_cube(CubeParameters(), "nodes")
    else:
        scene = SCENES[name].build(SCENES[name].parameters(**parameters), "nodes")
    # what disperses is shown at one wavelength until it is asked for all
    assert [problem for problem in checks.problems(scene) if problem.code != "one_wavelength"] == []


# ------------------------------------------------------------------------------------- what must not be mended


def test_a_wall_between_bodies_of_one_mesh_is_said(scene):
    """Without the second of its faces, the first would stand within the body."""
    add("Boxes", NIM, box(2), box(2, (2, 0, 0)))
    (problem,) = found(scene)
    assert problem.code == "doubled" and problem.remedy is None


def test_modifiers_may_put_parts_side_by_side(scene):
    obj = add("Box", NIM, box(1, (1, 0, 0), inwards=True))
    obj.modifiers.new("Twice", "MIRROR")
    assert [problem.remedy for problem in found(scene)] == ["Turn them out"]
    checks.mend(scene)
    assert codes(scene) == [] and volumes(obj) == pytest.approx([1])


def test_texts_are_judged_as_the_meshes_that_they_become(scene):
    text = bpy.data.curves.new("Text", "FONT")
    text.body = "IM"
    text.materials.append(interface_material("NIM", NIM, backend="nodes"))
    scene.collection.objects.link(bpy.data.objects.new("Text", text))
    (problem,) = found(scene)
    assert problem.code == "open" and problem.remedy is None and problem.sentence.endswith("end at something.")
    text.extrude = 0.1
    assert codes(scene) == ["coarse"], "its sides are shaded smooth round the corners"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30, 1e-30, 0.0])
def test_numbers_that_no_mesh_should_have(scene, value):
    corners = [(value, 0, 0), (0, 0, 0), (0, value, 0), (0, 0, value)]
    mesh = bpy.data.meshes.new("Odd")
    mesh.from_pydata(corners, [], [(0, 1, 2), (0, 3, 1), (1, 3, 2), (0, 2, 3)])
    obj = add("Odd", NIM, mesh=mesh)
    add("Ball", NIM, ball(1))
    found(scene)
    obj.location = (value,) * 3
    obj.scale.x = value
    found(scene)
    checks.mend(scene)


@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["Ball", "Floor"])
def test_a_vertex_that_is_nowhere_is_said_and_removed(scene, name, number):
    objects = {"Ball": add("Ball", NIM, ball(1)), "Floor": add("Floor", None, sheet(9, (0, 0, -2)))}
    mesh = objects[name].data
    count = len(mesh.vertices)
    mesh.vertices[5].co.x = number
    mesh.update()
    (problem,) = found(scene)
    assert problem.sentence == (
        f"{name} has vertices whose coordinates are no finite numbers (1), so that its shape is not known."
    )
    checks.mend(scene, "placeless")
    assert len(mesh.vertices) == count - 1 and "placeless" not in codes(scene)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and media that do not fit are said and mended; what is right is neither said nor touched."""

import bpy

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
import numpy as np
import pytest
from mathutils import Matrix

from nim_addon import checks
from nim_addon.checks import mesh_checks
from nim_addon.cycles import settings
from nim_addon.cycles.material import interface_material, interface_nodes
from nim_addon.cycles.visibility import PATHS_MARK
from nim_addon.physics import MEDIA, Medium
from nim_addon.scenes import SCENES, shapes
from nim_addon.scenes.cube import CubeParameters
from nim_addon.scenes.cube import build as build_cube

NIM, AIR, WATER, GLASS = Medium(-1.5), MEDIA["air"], MEDIA["water"], MEDIA["glass"]


@pytest.fixture
def scene(empty_file):
    scene = bpy.context.scene
    settings.lossless(scene, "nodes")
    return scene


def ball(radius, at=(0, 0, 0), segments=32, inwards=False):
    return "uvsphere", {"u_segments": segments, "v_segments": segments // 2, "radius": radius}, at, inwards


def box(size, at=(0, 0, 0), inwards=False):
    return "cube", {"size": size}, at, inwards


def sheet(size, at=(0, 0, 0), inwards=False):
    return "grid", {"x_segments": 4, "y_segments": 4, "size": size}, at, inwards


MONKEY = ("monkey", {}, (0, 0, 0), False)


def mesh_of(*pieces, split=False, without=0):
    """A mesh of pieces; each face with vertices of its own if `split`; the first faces left out."""
    shape = bmesh.new()
    for kind, how, at, inwards in pieces:
        before = set(shape.faces)
        operator = f"create_{kind}"  # bmesh.ops keeps no more than a pointer to the name, which must outlive the call
        getattr(bmesh.ops, operator)(shape, matrix=Matrix.Translation(at), **how)
        if inwards:
            bmesh.ops.reverse_faces(shape, faces=[face for face in shape.faces if face not in before])
    bmesh.ops.delete(shape, geom=list(shape.faces)[:without], context="FACES_ONLY")
    if split:
        bmesh.ops.split_edges(shape, edges=shape.edges)
    mesh = bpy.data.meshes.new("Mesh")
    shape.to_mesh(mesh)
    shape.free()
    return mesh


def add(name, material, *pieces, mesh=None, **how):
    """An object of pieces that wears a material, or one between those media."""
    mesh = mesh or mesh_of(*pieces, **how)
    if isinstance(material, (Medium, tuple)):
        media = material if isinstance(material, tuple) else (material,)
        material = interface_material(f"{name}'s", *media, backend="nodes")
    if not mesh.materials:
        mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def found(scene):
    bpy.context.view_layer.update()
    return checks.problems(scene)


def codes(scene):
    return [problem.code for problem in found(scene)]


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
    return meshes, values, [[slot.material.name for slot in thing.material_slots] for thing in bpy.data.objects]


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


def volumes(thing):
    """Of its parts, with their signs."""
    return [part.volume for part in mesh_checks.Solid(thing.data).parts]


@pytest.mark.parametrize("split", [False, True])
def test_only_the_part_that_is_inside_out_is_turned(scene, split):
    thing = add("Boxes", NIM, box(2), box(1, (3, 0, 0), inwards=True), split=split)
    (problem,) = found(scene)
    assert problem.code == "normals" and problem.sentence == "Some parts of Boxes are inside out: 1 of 2."
    checks.mend(scene)
    assert volumes(thing) == pytest.approx([8, 1]) and codes(scene) == []


def test_the_inner_surface_of_a_shell_is_turned_in(scene):
    thing = add("Shell", NIM, ball(1), ball(0.5), split=True)
    assert codes(scene) == ["normals"]
    checks.mend(scene)
    outer, inner = volumes(thing)
    assert outer > 0 > inner and codes(scene) == []


def test_the_object_in_an_object_of_the_same_is_turned_in(scene):
    material = interface_material("NIM", NIM, backend="nodes")
    add("Ball", material, ball(1))
    inner = add("Inner", material, ball(0.5))
    (problem,) = found(scene)
    assert problem.things == ("Inner",) and problem.remedy == "Turn them in"
    checks.mend(scene)
    assert volumes(inner)[0] < 0 and codes(scene) == []


def test_single_faces_that_do_not_agree_are_turned(scene):
    thing = add("Ball", NIM, ball(1), ball(0.5, (3, 0, 0)), split=True)
    for face in (3, 77, 500):
        thing.data.polygons[face].flip()
    assert codes(scene) == ["normals"]
    checks.mend(scene)
    assert min(volumes(thing)) > 0 and codes(scene) == []


def test_what_another_object_needs_as_it_is_is_not_turned(scene):
    material = interface_material("NIM", NIM, backend="nodes")
    add("Ball", material, ball(1))
    cavity = add("Cavity", material, ball(0.5, inwards=True))
    free = add("Free", material, mesh=cavity.data)
    free.location.x = 5
    (problem,) = found(scene)
    assert problem.things == ("Free",) and problem.remedy is None and mesh_checks.SHARED in problem.sentence
    free.data = free.data.copy()
    assert [one.remedy for one in found(scene)] == ["Turn them out"]


@pytest.mark.parametrize("split", [False, True])
def test_a_hole_is_said_and_filled(scene, split):
    thing = add("Box", NIM, box(2), split=split, without=1)
    thing.data.uv_layers.new(name="UV")
    count = len(thing.data.vertices)
    (problem,) = found(scene)
    assert problem.code == "open" and problem.sentence.startswith("Box has holes") and problem.remedy
    checks.mend(scene)
    assert codes(scene) == [] and volumes(thing) == pytest.approx([8])
    assert len(thing.data.vertices) == count and thing.data.uv_layers, "nothing is merged or lost"


def test_shape_keys_stay_when_a_hole_is_filled(scene):
    thing = add("Box", NIM, box(2), without=1)
    thing.shape_key_add(name="Basis")
    thing.shape_key_add(name="Wide").data[0].co.x -= 1
    checks.mend(scene)
    keys = thing.data.shape_keys.key_blocks
    assert codes(scene) == [] and [key.name for key in keys] == ["Basis", "Wide"]
    assert keys["Wide"].data[0].co.x == keys["Basis"].data[0].co.x - 1


def test_normals_of_its_own_are_turned_with_a_mesh(scene):
    thing = add("Ball", NIM, ball(1, segments=64, inwards=True))
    mesh = thing.data
    mesh.shade_smooth()
    mesh.normals_split_custom_set([-mesh.vertices[corner.vertex_index].co.normalized() for corner in mesh.loops])
    assert codes(scene) == ["normals"]
    checks.mend(scene)
    out = [normal.vector.dot(mesh.vertices[corner.vertex_index].co) for normal, corner in zip(
        mesh.corner_normals, mesh.loops, strict=True)]  # fmt: skip
    assert codes(scene) == [] and min(out) > 0.99


def test_mend_all_turns_what_was_open_and_inside_out(scene):
    thing = add("Box", NIM, box(2, inwards=True), without=1)
    assert [problem.code for problem in checks.mend(scene)] == ["open", "normals"]
    assert codes(scene) == [] and volumes(thing) == pytest.approx([8])


def test_the_hole_in_a_smooth_ball_stays_smooth(scene):
    thing = add("Ball", NIM, ball(1), without=1)
    thing.data.shade_smooth()
    checks.mend(scene)
    assert all(face.use_smooth for face in thing.data.polygons) and codes(scene) == []


def test_a_monkey_is_open_and_cannot_be_filled(scene):
    """Its eyes would be bodies that reach into its head."""
    add("Monkey", NIM, MONKEY)
    (problem,) = found(scene)
    assert problem.code == "open" and problem.remedy is None and mesh_checks.BY_HAND in problem.sentence


def test_a_sheet_is_right_only_where_its_rim_ends_at_something(scene):
    thing = add("Sheet", NIM, sheet(1))
    (problem,) = found(scene)
    assert problem.code == "open" and problem.sentence.startswith("Sheet is a sheet") and problem.remedy is None
    add("Basin", None, box(1.9, (0, 0, -0.5)))
    assert codes(scene) == []
    thing.scale = (0.5, 0.5, 1)
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
    with mesh_checks._Edited(mesh) as shape:
        bottom = [face for face in shape.faces if face.normal.z < -0.5]
        bmesh.ops.delete(shape, geom=bottom, context="FACES_ONLY")
    assert codes(scene) == ["open"]
    add("Floor", None, sheet(5))
    assert codes(scene) == []


def test_edges_that_a_neighbour_divides_are_no_hole(scene):
    """A cube with one face cut into four, its neighbours' edges whole."""
    thing = add("Box", NIM, box(2), without=1)
    shape = bmesh.new()
    shape.from_mesh(thing.data)
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
    shape.to_mesh(thing.data)
    shape.free()
    assert codes(scene) == []


def test_faces_twice_in_one_mesh(scene):
    thing = add("Box", NIM, box(2), box(2))
    (problem,) = found(scene)
    assert problem.code == "doubled" and "6 faces twice" in problem.sentence
    checks.mend(scene)
    assert len(thing.data.polygons) == 6 and codes(scene) == []


# ------------------------------------------------------------------------------------------------------- media


def test_a_bubble_whose_outside_was_forgotten(scene):
    add("Ball", NIM, ball(1))
    bubble = add("Bubble", (AIR, AIR), ball(0.3, (0.4, 0, 0)))
    (problem,) = found(scene)
    assert problem.sentence == "Bubble lies in NIM -1.5 (Ball), but its outside is n = 1."
    checks.mend(scene)
    assert (
        codes(scene) == []
        and interface_nodes(bubble.data.materials[0])[0].inputs["Index Outside"].default_value == -1.5
    )


def test_a_material_that_is_right_elsewhere_is_copied(scene):
    add("Ball", NIM, ball(1))
    glass = interface_material("Glass", GLASS, backend="nodes")
    inner, free = add("Inner", glass, ball(0.3)), add("Free", glass, ball(0.3, (3, 0, 0)))
    (problem,) = found(scene)
    assert problem.things == ("Inner",)
    checks.mend(scene)
    assert codes(scene) == []
    assert free.material_slots[0].material == glass != inner.material_slots[0].material
    assert interface_nodes(glass)[0].inputs["Index Outside"].default_value == 1


def test_many_bubbles_are_one_problem(scene):
    add("Ball", NIM, ball(1))
    air = interface_material("Air", AIR, backend="nodes")
    for place in (-0.6, 0, 0.6):
        add(f"Bubble {place}", air, ball(0.2, (place, 0, 0)))
    (problem,) = found(scene)
    assert "and 2 more lie in NIM -1.5" in problem.sentence
    checks.mend(scene)
    assert codes(scene) == []


def test_what_a_node_decides_is_not_judged(scene):
    add("Ball", NIM, ball(1))
    tree = add("Bubble", (AIR, AIR), ball(0.3)).data.materials[0].node_tree
    fresnel = tree.nodes.new("ShaderNodeLayerWeight")
    node = next(node for node in tree.nodes if node.type == "GROUP")
    tree.links.new(fresnel.outputs[0], node.inputs["Index Outside"])
    assert codes(scene) == []


def test_bodies_that_overlap(scene):
    add("A", NIM, box(2))
    add("B", NIM, box(2, (1, 0.2, 0.3)))
    (problem,) = found(scene)
    assert "overlap" in problem.sentence and problem.remedy is None


def test_of_two_that_face_each_other_none_is_known_to_be_wrong(scene):
    add("A", NIM, ball(1))
    add("B", (NIM, WATER), ball(1, (3, 0, 0)))
    (problem,) = found(scene)
    assert "face each other" in problem.sentence and problem.remedy is None
    for place in (3, 6):
        add(f"C{place}", NIM, ball(1, (0, place, 0)))
    (problem,) = found(scene)
    assert problem.things == ("B",) and problem.remedy
    checks.mend(scene)
    assert codes(scene) == []


@pytest.mark.parametrize(
    "material, side, medium, wrong",
    [
        ("Liquid to air", "Inside", Medium(-2.2), "Glass to liquid lies in NIM -2.2 (Liquid to air)"),
        ("Glass to liquid", "Outside", WATER, "Glass to liquid lies in NIM -1.33 (Liquid to air)"),
        ("Glass to air", "Inside", Medium(1.6), "Glass to liquid and Glass to air have their inside in common"),
    ],
    ids=lambda value: str(value),
)
def test_media_of_the_glass_scene_fit(empty_file, material, side, medium, wrong):
    scene = SCENES["glass"].build(SCENES["glass"].parameters(), "nodes")
    node = interface_nodes(bpy.data.materials[material])[0]
    node.inputs[f"Index {side}"].default_value = medium.n
    node.inputs[f"Permeability {side}"].default_value = medium.mu
    (problem,) = checks.problems(scene)
    assert problem.sentence.startswith(wrong) and problem.remedy
    checks.mend(scene)
    assert checks.problems(scene) == []


def test_a_nim_in_the_water_of_a_glass(empty_file):
    kind = SCENES["glass"]
    scene = kind.build(kind.parameters(liquid=WATER), "nodes")
    thing = add("Ball", NIM, ball(0.01, (0, 0, 0.05)))
    bpy.context.scene.collection.objects.unlink(thing)
    scene.collection.objects.link(thing)
    (problem,) = checks.problems(scene)
    assert problem.sentence == "Ball lies in n = 1.33 (Glass), but its outside is n = 1."
    checks.mend(scene)
    assert checks.problems(scene) == []


@pytest.mark.parametrize(
    "name, how",
    [
        *(("glass", {"liquid": liquid, "figures": "monkey"}) for liquid in (None, WATER, NIM, GLASS)),
        ("glass", {"view": "top", "straw": False}),
        ("pool", {"waves": 0.0}),
        ("pool", {"waves": 0.2, "liquid": WATER}),
        ("sea", {"waves": 0.0}),
        ("sea", {"waves": 0.4, "liquid": NIM}),
        ("sphere", {"n": 1.5, "companions": True}),
        ("cube", {}),
    ],
    ids=str,
)
def test_the_project_s_own_scenes_are_right(empty_file, name, how):
    if name == "cube":
        scene = build_cube(CubeParameters(), "nodes")
    else:
        scene = SCENES[name].build(SCENES[name].parameters(**how), "nodes")
    assert checks.problems(scene) == []


# ------------------------------------------------------------------------------------------------------- place


def test_a_copy_in_the_same_place(scene):
    thing = add("Ball", NIM, ball(1))
    copy = add("Copy", None, mesh=thing.data)
    (problem,) = found(scene)
    assert problem.code == "touching" and "are in the same place" in problem.sentence and problem.remedy is None
    copy.location.z = 2.5
    assert codes(scene) == []


def test_a_box_that_rests_on_the_floor_exactly(scene):
    thing = add("Box", NIM, box(2, (0, 0, 1)))
    add("Floor", None, sheet(5))
    (problem,) = found(scene)
    assert problem.code == "touching" and "Box and Floor have faces in the same place" in problem.sentence
    checks.mend(scene)
    assert codes(scene) == [] and 0 < thing.location.z < 1e-3 and tuple(thing.location)[:2] == (0, 0)
    thing.location.z = 0
    thing.lock_location[2] = True
    assert [one.remedy for one in found(scene)] == [None]


@pytest.mark.parametrize("segments, coarse", [(16, True), (24, True), (32, False), (64, False)])
def test_coarse_smooth_surfaces(scene, segments, coarse):
    thing = add("Ball", NIM, ball(1, segments=segments))
    assert codes(scene) == []
    thing.data.shade_smooth()
    assert codes(scene) == ["coarse"] * coarse
    if coarse:
        thing.modifiers.new("Finer", "SUBSURF").render_levels = 2
        assert codes(scene) == []


@pytest.mark.parametrize("distance, far", [(1e3, False), (1e4, True)])
def test_far_from_the_origin(scene, distance, far):
    add("Ball", NIM, ball(1)).location.y = distance
    assert codes(scene) == ["far"] * far


# ------------------------------------------------------------------------------------- what must not be mended


CUP = [(0, 0), (1, 0), (1, 2), (0.9, 2), (0.9, 0.1), (0, 0.1)]


def turned(name, medium, profile):
    vertices, faces, _ = shapes.revolve(profile, 64)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    return add(name, medium, mesh=mesh)


@pytest.mark.parametrize("reach", [0.9, 0.95])
def test_a_cup_that_is_wet_in_part_is_not_given_one_outside(scene, reach):
    """A liquid's surface in a cup of one material: the wall below it borders on the liquid, the rest on air."""
    turned("Cup", GLASS, CUP)
    turned("Water", WATER, [(reach, 1.5), (0, 1.5)])
    (problem,) = found(scene)
    assert "Cup lies partly in n = 1.33 (Water)" in problem.sentence and problem.remedy is None


LIQUIDS = [
    ([(0, 0), (1, 0), (1, 2), (0.9, 2), (0.9, 1.5)], GLASS, AIR),
    ([(0.9, 1.5), (0.9, 0.1), (0, 0.1)], GLASS, NIM),
    ([(0.9, 1.5), (0, 1.5)], NIM, AIR),
]


def test_a_liquid_of_three_objects_whose_rims_meet(scene):
    """The glass to the air, the glass to the liquid and the liquid to the air: open, but closed by each other."""
    for number, (profile, *media) in enumerate(LIQUIDS):
        turned(f"Part {number}", tuple(media), profile)
    bubble = add("Bubble", (AIR, NIM), ball(0.2, (0.2, 0.1, 0.7)))
    assert found(scene) == []
    interface_nodes(bubble.data.materials[0])[0].inputs["Index Outside"].default_value = 1.0
    (problem,) = found(scene)
    assert problem.things == ("Bubble",) and problem.remedy
    checks.mend(scene)
    assert codes(scene) == []
    bpy.data.objects["Part 2"].location.x = 0.2
    assert "open" in codes(scene)


def test_a_liquid_that_stands_off_the_wall_is_right(scene):
    turned("Cup", GLASS, CUP)
    turned("Water", WATER, [(0, 0.11), (0.89, 0.11), (0.89, 1.5), (0, 1.5)])
    assert found(scene) == []


def test_a_liquid_that_fills_its_cup_exactly_touches_it(scene):
    turned("Cup", GLASS, CUP)
    turned("Water", WATER, [(0, 0.1), (0.9, 0.1), (0.9, 1.5), (0, 1.5)])
    (problem,) = found(scene)
    assert problem.code == "touching" and problem.remedy is None, "no step would part all of the wall"


def test_a_wall_between_bodies_of_one_mesh_is_said(scene):
    """Without the second of its faces, the first would stand within the body."""
    add("Boxes", NIM, box(2), box(2, (2, 0, 0)))
    (problem,) = found(scene)
    assert problem.code == "doubled" and problem.remedy is None


def test_modifiers_may_put_parts_side_by_side(scene):
    thing = add("Box", NIM, box(1, (1, 0, 0), inwards=True))
    thing.modifiers.new("Twice", "MIRROR")
    assert [problem.remedy for problem in found(scene)] == ["Turn them out"]
    checks.mend(scene)
    assert codes(scene) == [] and volumes(thing) == pytest.approx([1])


def test_texts_are_judged_as_the_meshes_that_they_become(scene):
    text = bpy.data.curves.new("Text", "FONT")
    text.body = "IM"
    text.materials.append(interface_material("NIM", NIM, backend="nodes"))
    scene.collection.objects.link(bpy.data.objects.new("Text", text))
    (problem,) = found(scene)
    assert problem.code == "open" and problem.remedy is None and problem.sentence.endswith("end at something.")
    text.extrude = 0.1
    assert codes(scene) == ["coarse"], "its sides are shaded smooth round the corners"


def test_a_bubble_in_a_collection_instance(scene):
    held = bpy.data.collections.new("Held")
    for thing in (add("Ball", NIM, ball(1)), add("Bubble", (AIR, AIR), ball(0.3))):
        scene.collection.objects.unlink(thing)
        held.objects.link(thing)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", held
    instance.location, instance.scale = (5, 0, 0), (-2, 2, 2)
    scene.collection.objects.link(instance)
    (problem,) = found(scene)
    assert problem.sentence == "Bubble lies in NIM -1.5 (Ball), but its outside is n = 1."
    checks.mend(scene)
    assert codes(scene) == []


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30, 1e-30, 0.0])
def test_numbers_that_no_mesh_should_have(scene, value):
    corners = [(value, 0, 0), (0, 0, 0), (0, value, 0), (0, 0, value)]
    mesh = bpy.data.meshes.new("Odd")
    mesh.from_pydata(corners, [], [(0, 1, 2), (0, 3, 1), (1, 3, 2), (0, 2, 3)])
    thing = add("Odd", NIM, mesh=mesh)
    add("Ball", NIM, ball(1))
    found(scene)
    thing.location = (value,) * 3
    thing.scale.x = value
    found(scene)
    checks.mend(scene)

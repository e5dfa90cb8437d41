# SPDX-License-Identifier: GPL-3.0-or-later
"""The glass: a closed mesh, its faces between the right media, a straw that clears it, and what light does there."""

import struct

import bpy
import numpy as np
import pytest
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from nim_addon.physics import MEDIA, Interface, Medium
from nim_addon.scenes import SCENES, glass, surfaces

AIR, GLASS, WATER, NIM = MEDIA["air"], MEDIA["glass"], MEDIA["water"], MEDIA["nim"]
FILLINGS = {"none": None, "water": WATER, "nim": NIM}

pytestmark = pytest.mark.usefixtures("empty_file")


def build(*settings):
    return glass.build(glass.GlassParameters.read(settings))


def vertices_of(object_):
    """World positions (N, 3) of an object's vertices."""
    points = np.empty((len(object_.data.vertices), 3), np.float32)
    object_.data.vertices.foreach_get("co", points.ravel())
    return points @ np.array(object_.matrix_basis.to_3x3()).T + np.array(object_.matrix_basis.translation)


def sides(material):
    """The media (inside, outside) that a material of the add-on stands between."""
    values = {socket.name: socket.default_value for socket in material.node_tree.nodes["NIM Interface"].inputs}
    pairs = [(values[f"Index {side}"], values[f"Permeability {side}"]) for side in ("Inside", "Outside")]
    return [Medium(round(n, 6), round(mu, 6)) for n, mu in pairs]


def white_world(scene, strength):
    scene.world = surfaces.sky("White", (1, 1, 1), (1, 1, 1), strength=strength)
    scene.world.cycles.sampling_method = "NONE"


def size_and_samples(scene, size, samples):
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *size, 100
    scene.cycles.samples = samples


# -- geometry ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("filling", FILLINGS)
def test_glass_is_closed_and_the_liquid_shares_its_ring(filling):
    build(f"liquid={filling}")
    mesh = bpy.data.objects["Glass"].data
    assert not mesh.validate()
    faces_of_edge = np.zeros((3, len(mesh.edges)), int)
    for face in mesh.polygons:
        for loop in face.loop_indices:
            faces_of_edge[face.material_index, mesh.loops[loop].edge_index] += 1
    shell, surface = faces_of_edge[:2].sum(axis=0), faces_of_edge[2]
    assert set(shell[shell + surface > 0]) <= {0, 2}
    rim_of_surface = surface == 1
    if FILLINGS[filling] is None:
        assert len(mesh.materials) == 1 and not surface.any()
    else:
        # the liquid ends where air and liquid part on the wall, and nowhere else
        assert rim_of_surface.sum() == glass.SEGMENTS
        assert (faces_of_edge[:, rim_of_surface] == 1).all()
        assert set(surface[~rim_of_surface & (surface > 0)]) == {2}
        positions = np.array([vertex.co for vertex in mesh.vertices])
        assert len(np.unique(positions, axis=0)) == len(positions)


@pytest.mark.parametrize("filling", ["none", "water", "nim", "n=-1.33,mu=-10"])
def test_a_straight_line_meets_media_in_order(filling):
    """Along any line through the glass, each face's near medium is the one that the line is in: no gap, no overlap."""
    build(f"liquid={filling}")
    object_ = bpy.data.objects["Glass"]
    pairs = [sides(material) for material in object_.data.materials]
    tree = BVHTree.FromPolygons(vertices_of(object_).tolist(), [tuple(face.vertices) for face in object_.data.polygons])
    rng = np.random.default_rng(1)
    met = set()
    for _ in range(400):
        aim = rng.uniform((-0.039, -0.039, 0), (0.039, 0.039, 0.13))
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        place, within, last = Vector(aim - 0.5 * direction), AIR, None
        while (hit := tree.ray_cast(place, Vector(direction)))[0] is not None:
            point, normal, index, _ = hit
            place = point + Vector(direction) * 1e-6
            if index == last:  # a line crosses a flat face once: this is rounding
                continue
            inside, outside = pairs[object_.data.polygons[index].material_index]
            near, far = (outside, inside) if normal.dot(Vector(direction)) < 0 else (inside, outside)
            assert near == within
            met.add((near, far))
            within, last = far, index
        assert within == AIR
    liquid = glass.GlassParameters(filling).liquid
    expected = {(AIR, GLASS), (GLASS, AIR)}
    if liquid is not None:
        expected |= {(GLASS, liquid), (liquid, GLASS), (liquid, AIR), (AIR, liquid)}
    assert met == expected


def test_the_profile_has_the_normals_of_its_lines_and_arcs():
    """At each point the normal is that of the line before or after it, or stands halfway between two chords of an arc."""
    points, normals = glass.glass_profile()
    step = np.diff(points, axis=0)
    right = np.stack([step[:, 1], -step[:, 0]], axis=1) / np.linalg.norm(step, axis=1, keepdims=True)
    before, after = np.vstack([right[:1], right]), np.vstack([right, right[-1:]])
    between = (before + after) / np.linalg.norm(before + after, axis=1, keepdims=True)
    off = np.linalg.norm([before - normals, after - normals, between - normals], axis=2).min(axis=0)
    assert off.max() < 1e-6
    assert (points[0], points[-1], points[:, 1].max()) == (pytest.approx([0, 0]), pytest.approx([0, glass.BASE]), 0.13)


def test_normals_are_those_of_the_round_glass():
    """Corner normals within 0.1 degrees of the surface of revolution; sharp only around the liquid's surface."""
    build("liquid=nim")
    mesh = bpy.data.objects["Glass"].data
    normals = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    corners = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    slots = np.array([face.material_index for face in mesh.polygons for _ in face.loop_indices])
    profile, turned = glass.glass_profile()
    radius = np.linalg.norm(corners[:, :2], axis=1)
    nearest = np.linalg.norm(np.stack([radius, corners[:, 2]], 1)[:, None] - profile, axis=2).argmin(axis=1)
    outwards = corners[:, :2] / np.maximum(radius, 1e-9)[:, None]
    expected = np.column_stack([turned[nearest, :1] * outwards, turned[nearest, 1]])
    expected[slots == 2] = (0, 0, 1)
    assert np.degrees(np.linalg.norm(normals - expected, axis=1).max()) < 0.1
    sharp = {edge.index for edge in mesh.edges if edge.use_edge_sharp}
    around = {mesh.loops[i].edge_index for face in mesh.polygons if face.material_index == 2 for i in face.loop_indices}
    assert len(sharp) == glass.SEGMENTS and sharp <= around


def clearance(points):
    """Distance (N) from points in the hollow of the glass, or above it, to the glass; negative within the glass."""
    radius, height = np.linalg.norm(points[:, :2], axis=1), points[:, 2] - glass.GAP
    inner, edge, lip = glass.RADIUS - glass.WALL, glass.INNER_EDGE, glass.WALL / 2
    within_corner = (radius > inner - edge) & (height < glass.BASE + edge)
    corner = edge - np.hypot(radius - (inner - edge), height - (glass.BASE + edge))
    hollow = np.where(within_corner, corner, np.minimum(inner - radius, height - glass.BASE))
    rim = np.hypot(radius - (inner + lip), height - (glass.HEIGHT - lip)) - lip
    return np.where(height > glass.HEIGHT - lip, rim, hollow)


def test_straw_leans_in_the_glass_without_touching_it():
    build()
    straw = bpy.data.objects["Straw"]
    points = vertices_of(straw)
    along = np.linspace(0, 1, 2001)[:, None]
    half = len(points) // 4  # rings of the tube: inner, outer, outer at the far end, inner
    low, high = points[half : 2 * half], points[2 * half : 3 * half]
    outside = np.concatenate([a + along * (b - a) for a, b in zip(low, high, strict=True)])
    gaps = clearance(outside)
    assert gaps.min() > 0.5 * glass.GAP
    # it rests on the base and on the rim, as near as the gap
    assert gaps[outside[:, 2] < 0.02].min() < 2 * glass.GAP
    assert gaps[outside[:, 2] > 0.12].min() < 2 * glass.GAP
    level = glass.LEVEL + glass.GAP
    assert points[:, 2].min() < level < points[:, 2].max()
    start, tilt = glass.straw_pose()
    crossing = start[0] - np.tan(tilt) * (level - start[2])
    assert -0.015 < crossing < -glass.STRAW_RADIUS  # a little left of the axis


def test_glass_stands_clear_of_the_table():
    build("figures=monkey")
    assert vertices_of(bpy.data.objects["Glass"])[:, 2].min() == pytest.approx(glass.GAP)
    assert np.abs(vertices_of(bpy.data.objects["Table"])[:, 2]).max() == 0
    for name in ("Green", "Red", "Blue"):
        points = vertices_of(bpy.data.objects[name])
        assert points[:, 2].min() == pytest.approx(0, abs=1e-7)
        assert np.linalg.norm(points[:, :2], axis=1).min() > glass.RADIUS
    assert bpy.data.objects["Green"].location.y > 0 > bpy.data.objects["Red"].location.y
    assert bpy.data.objects["Red"].location.x < 0 < bpy.data.objects["Blue"].location.x


# -- a scene of a file -------------------------------------------------------------------------------------------------


def test_building_again_leaves_nothing_over(held):
    settings = ["liquid=nim", "figures=monkey"]
    build(*settings)
    once = held()
    for other in (["liquid=none", "view=top", "straw=off"], settings):
        build(*other)
    assert held() == once


def test_builds_from_a_used_file(tmp_path):
    mine = bpy.data.objects.new("Glass", bpy.data.meshes.new("Glass"))
    bpy.context.scene.collection.objects.link(mine)
    build()
    scene = build("figures=monkey")
    assert mine.name == "Glass" and mine.name not in scene.objects
    bpy.data.meshes.remove(mine.data)
    path = tmp_path / "glass.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
    assert path.stat().st_size < 1_000_000


def test_scene_is_registered_and_its_cameras_differ():
    assert SCENES["glass"].build is glass.build and SCENES["glass"].parameters is glass.GlassParameters
    side = build("view=side").camera.location.copy()
    top = build("view=top").camera.location
    assert np.degrees(np.arctan2(top.z, -top.y)) > 60 > 20 > np.degrees(np.arctan2(side.z - glass.LEVEL, -side.y)) > 5


# -- parameters --------------------------------------------------------------------------------------------------------


def test_defaults_are_the_nim_from_the_side():
    parameters = glass.GlassParameters()
    assert parameters.liquid == NIM and parameters.view == "side" and parameters.figures == "none"
    assert glass.GlassParameters.read(["liquid=none"]).liquid is None
    assert glass.GlassParameters.read(["liquid=1.9"]).liquid == Medium(1.9)
    assert glass.GlassParameters(**parameters.plain()) == parameters


@pytest.mark.parametrize(
    ("setting", "word"),
    [
        ("liquid=milk", "water"),
        ("liquid=0", "negative"),
        ("view=sid", "side"),
        ("figures=bunny", "monkey"),
        ("figures=/nowhere/bunny.ply", "no file"),
        ("glas=1", "liquid"),
    ],
)
def test_wrong_settings_are_refused_in_words(setting, word, one_sentence):
    with pytest.raises(ValueError) as caught:
        glass.GlassParameters.read([setting])
    one_sentence(caught.value, word)


PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
2 0 0
0 3 0
0 0 5
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""
OBJ = "v 0 0 0\nv 2 0 0\nv 0 0 -3\nv 0 5 0\no a\nf 1 3 2\nf 1 2 4\nusemtl blue\no b\nf 1 4 3\nf 2 3 4\n"


def stl():
    corners = np.array([(0, 0, 0), (2, 0, 0), (0, 3, 0), (0, 0, 5)], np.float32)
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    body = b"".join(np.zeros(3, np.float32).tobytes() + corners[list(face)].tobytes() + b"\0\0" for face in faces)
    return b"\0" * 80 + struct.pack("<I", len(faces)) + body


@pytest.mark.parametrize(("name", "content"), [("t.ply", PLY.encode()), ("t.obj", OBJ.encode()), ("T.STL", stl())])
def test_a_mesh_file_becomes_three_statues(name, content, tmp_path, held):
    path = tmp_path / name
    path.write_bytes(content)
    build("figures=monkey")
    before = held()
    build(f"figures={path}")
    assert held() == before
    assert bpy.data.objects["Red"].data is bpy.data.objects["Green"].data
    points = np.array([vertex.co for vertex in bpy.data.objects["Red"].data.vertices])
    extent = np.ptp(points, axis=0)
    # 2 by 3 by 5, tallest along z, on the table and over the origin
    np.testing.assert_allclose(extent, glass.STATUE_SIZE * np.array([0.4, 0.6, 1.0]), rtol=1e-5)
    np.testing.assert_allclose(points.min(axis=0), [-extent[0] / 2, -extent[1] / 2, 0], atol=1e-7)
    colors = [bpy.data.objects[name].material_slots[0].material.name for name in ("Green", "Red", "Blue")]
    assert colors == ["Green", "Red", "Blue"]


BROKEN = {
    "garbage.ply": b"not a mesh\0\xff",
    "garbage.obj": b"not a mesh\0\xff",
    "garbage.stl": b"not a mesh\0\xff",
    "empty.obj": b"",
    "uncounted.ply": PLY.replace("vertex 4", "vertex four").encode(),  # takes Blender 4.5 and 5.0 down
    "cut.ply": PLY.encode()[:-40],
    "points.ply": PLY.replace("element face 4", "element face 0").encode(),
    "dot.obj": b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n",
    "cut.stl": stl()[:-60],
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_mesh_file_is_refused_and_leaves_everything_as_it_was(name, tmp_path, one_sentence, held):
    path = tmp_path / name
    path.write_bytes(BROKEN[name])
    build("liquid=water")
    scene, before = bpy.data.scenes["NIM glass"], held()
    with pytest.raises(ValueError) as caught:
        build(f"figures={path}")
    one_sentence(caught.value, name, "PLY, OBJ or STL", "monkey")
    assert held() == before and bpy.data.scenes["NIM glass"] == scene


# -- renders -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", ["side", "top"])
@pytest.mark.parametrize("filling", FILLINGS)
def test_white_furnace(filling, view, render):
    """The glass alone in a white world cannot be seen: no path is lost on the way through."""
    scene = build(f"liquid={filling}", f"view={view}", "straw=off")
    bpy.data.objects["Table"].hide_render = True
    white_world(scene, 1.0)
    size_and_samples(scene, (40, 40), 64)
    picture = render(scene)
    assert picture.mean() == pytest.approx(1.0, abs=1e-3)
    assert picture.max() < 1 + 1e-5


def straw_in_liquid(scene, liquid, size):
    """Mask (height, width) of the pixels whose ray goes through the wall and the liquid straight to the straw."""
    camera = scene.camera
    corners = [np.array(camera.rotation_euler.to_matrix() @ c) for c in camera.data.view_frame(scene=scene)]
    right_top, _, left_bottom, left_top = corners
    across, down = ((np.arange(n) + 0.5) / n for n in size)
    d = left_top + across[None, :, None] * (right_top - left_top) + down[:, None, None] * (left_bottom - left_top)
    d = d.reshape(-1, 3) / np.linalg.norm(d.reshape(-1, 3), axis=1, keepdims=True)
    seen = np.arange(len(d))
    origin = np.broadcast_to(np.array(camera.location), d.shape)
    for radius, inside, outside, sign in (
        (glass.RADIUS, GLASS, AIR, 1),
        (glass.RADIUS - glass.WALL, GLASS, liquid, -1),
    ):
        a, b = (d[:, :2] ** 2).sum(axis=1), (origin * d)[:, :2].sum(axis=1)
        root = b * b - a * ((origin[:, :2] ** 2).sum(axis=1) - radius**2)
        hits = root > 0
        seen, d = seen[hits], d[hits]
        origin = origin[hits] - ((b + np.sqrt(np.maximum(root, 0))) / a)[hits, None] * d
        d = Interface(inside, outside).refract(d, sign * origin * (1, 1, 0))
        height = origin[:, 2] - glass.GAP
        wet = (height < glass.LEVEL) & (height > glass.BASE + glass.INNER_EDGE) & np.isfinite(d).all(axis=1)
        seen, origin, d = seen[wet], origin[wet], d[wet]
    # where each ray is nearest to the straw's axis
    foot, tilt = glass.straw_pose()
    axis = np.array([-np.sin(tilt), 0, np.cos(tilt)])
    between, cosine = origin - foot, d @ axis
    along = ((between @ axis) * cosine - (between * d).sum(axis=1)) / (1 - cosine**2)
    nearest = origin + along[:, None] * d
    distance = np.linalg.norm(np.cross(nearest - foot, axis), axis=1)
    height = nearest[:, 2] - glass.GAP
    met = (along > 0) & (height < glass.LEVEL - 0.002) & (height > glass.BASE + glass.STRAW_RADIUS)
    mask = np.zeros(size[0] * size[1], bool)
    mask[seen] = met & (distance < 0.6 * glass.STRAW_RADIUS)  # well within the outline, by a pixel or so
    return mask.reshape(size[1], size[0])


def test_straw_breaks_left_in_water_and_right_in_a_nim(render):
    """A white straw in the dark: it is seen where Snell's law puts it, through every liquid (thesis 5.1)."""
    size = (160, 160)
    shift, in_air = {}, None
    for filling, liquid in FILLINGS.items():
        scene = build(f"liquid={filling}")
        bpy.data.objects["Table"].hide_render = True
        white_world(scene, 0.0)
        shader = bpy.data.objects["Straw"].data.materials[0].node_tree
        glow, output = shader.nodes.new("ShaderNodeEmission"), shader.nodes["Material Output"]
        shader.links.new(glow.outputs[0], output.inputs["Surface"])
        size_and_samples(scene, size, 32)
        picture = render(scene)[..., 0]
        expected = straw_in_liquid(scene, liquid or AIR, size)
        assert expected.sum() > 100
        # two crossings of the wall leave 0.83 to 0.96 of the light
        assert picture[expected].min() > 0.75
        # in the highest such row, the straw's middle column: FILLINGS starts with the empty glass
        row = np.flatnonzero(expected.any(axis=1))[0]
        in_air = picture if liquid is None else in_air
        shift[filling] = np.subtract(*(np.flatnonzero(seen[row] > 0.5).mean() for seen in (picture, in_air)))
    assert shift["water"] < -1 and shift["nim"] > 4

# SPDX-License-Identifier: GPL-3.0-or-later
"""What is simulated in a person's scene is in a picture where it is when Blender plays the scene, baked or not."""

import shutil
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.base.streams import quiet
from nim_addon.renders import simulated
from nim_addon.renders.external import files_of, missing_files
from nim_addon.renders.request import Request
from nim_addon.ui import render_scene

START, FRAME = 3, 10
PLACES = {"Rigid": -8, "Zone": -4, "Cloth": 0, "Disk": 4, "Inner": 10, "Still": 8}
WIDE = 24


def sinking_zone():
    """Geometry nodes that sink what they are given by .1 a frame."""
    group = bpy.data.node_groups.new("Sinking", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes, links = group.nodes, group.links
    begin, end = nodes.new("GeometryNodeSimulationInput"), nodes.new("GeometryNodeSimulationOutput")
    begin.pair_with_output(end)
    moved = nodes.new("GeometryNodeTransform")
    moved.inputs["Translation"].default_value = (0, 0, -0.1)
    links.new(nodes.new("NodeGroupInput").outputs[0], begin.inputs["Geometry"])
    links.new(begin.outputs["Geometry"], moved.inputs["Geometry"])
    links.new(moved.outputs["Geometry"], end.inputs["Geometry"])
    links.new(end.outputs["Geometry"], nodes.new("NodeGroupOutput").inputs[0])
    return group


@pytest.fixture
def blend(tmp_path, empty_file):
    """A .blend, saved before anything is played, of cubes that fall from a height of 5, one of them baked to disk."""
    scene = bpy.context.scene
    white = bpy.data.materials.new("White")
    if not white.node_tree:  # which a material has from 5.0 on
        white.use_nodes = True
    white.node_tree.nodes.clear()
    shining, out = (white.node_tree.nodes.new(f"ShaderNode{name}") for name in ("Emission", "OutputMaterial"))
    white.node_tree.links.new(shining.outputs[0], out.inputs[0])
    for name, place in PLACES.items():
        bpy.ops.mesh.primitive_cube_add(size=1, location=(place, 0, 5))
        bpy.context.object.name = name
        bpy.context.object.data.materials.append(white)
        if name == "Rigid":
            bpy.ops.rigidbody.object_add()
        elif name == "Zone":
            bpy.context.object.modifiers.new("Zone", "NODES").node_group = sinking_zone()
        elif name != "Still":
            bpy.context.object.modifiers.new("Cloth", "CLOTH").point_cache.frame_end = FRAME + 2
    # one that only an instance of its collection brings in
    inner, instance = bpy.data.collections.new("Inner"), bpy.data.objects.new("Instance", None)
    inner.objects.link(scene.objects["Inner"])
    scene.collection.objects.unlink(scene.objects["Inner"])
    instance.instance_type, instance.instance_collection = "COLLECTION", inner
    scene.collection.objects.link(instance)
    camera = scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0, -40, 4), (np.pi / 2, 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", WIDE
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 240, 80, 100
    file = tmp_path / "mine.blend"
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(file))  # a cache on disk is beside a file
        cache = scene.objects["Disk"].modifiers[0].point_cache
        cache.use_disk_cache = True
        with bpy.context.temp_override(object=scene.objects["Disk"], point_cache=cache):
            bpy.ops.ptcache.bake(bake=True)
        scene.frame_set(FRAME)
        scene.frame_start = START  # from which on zones are simulated; what has a cache is from its own
        bpy.ops.wm.save_as_mainfile(filepath=str(file))
        bpy.ops.wm.open_mainfile(filepath=str(file))
    yield file
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)


def lowest(file):
    """{name: z of the lowest pixel of each cube}."""
    lit = oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., 0] > 0.5
    height, width = lit.shape
    rows = {name: np.nonzero(lit[:, round((place + WIDE / 2) * width / WIDE)])[0] for name, place in PLACES.items()}
    return {name: 4 + (height / 2 - found.max() - 1) * WIDE / width for name, found in rows.items()}


def played():
    """The same, of the open file, as Blender plays it."""
    scene = bpy.context.scene
    for frame in range(1, FRAME + 1):
        scene.frame_set(frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return {
        one.object.original.name: min((one.matrix_world @ vertex.co).z for vertex in one.object.data.vertices)
        for one in depsgraph.object_instances
        if one.object.type == "MESH"
    }


@pytest.mark.parametrize("frame", [None, FRAME])
def test_what_falls_is_where_it_falls_to(blend, tmp_path, frame):
    there = played()
    assert there["Still"] == 4.5 and there["Zone"] == pytest.approx(4.5 - 0.1 * (FRAME - START + 1), abs=1e-5)
    assert all(z < 4.3 for name, z in there.items() if name != "Still")
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    made = Request.of_blend(blend, frame=frame).render(tmp_path / "out")
    assert lowest(made.exr) == pytest.approx(there, abs=0.11)


def test_a_copy_has_what_is_baked_to_disk(blend, tmp_path):
    there = played()
    copy = tmp_path / "else" / "copy.blend"
    render_scene.save_copy(copy)
    made = Request.of_blend(copy).render(tmp_path / "out")
    assert lowest(made.exr) == pytest.approx(there, abs=0.11)


def test_a_copy_without_links_is_a_copy_of_that_too(tmp_path, monkeypatch):
    blend, copy = tmp_path / "a.blend", tmp_path / "else" / "b.blend"
    (tmp_path / "blendcache_a").mkdir()
    (tmp_path / "blendcache_a" / "41_000001_00.bphys").write_bytes(b"1")
    copy.parent.mkdir()
    simulated.bring(tmp_path / "none.blend", copy)
    assert list(copy.parent.iterdir()) == []

    def refuses(*_, **__):
        raise OSError

    monkeypatch.setattr(Path, "symlink_to", refuses)
    simulated.bring(blend, copy)
    simulated.bring(blend, copy)  # it is there
    assert (copy.parent / "blendcache_b" / "41_000001_00.bphys").read_bytes() == b"1"


def test_what_is_baked_to_disk_belongs_to_the_picture(blend, tmp_path, one_sentence):
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    made = Request.of_blend(blend, size=(24, 8)).render(tmp_path / "out")
    again, _ = Request.again(made.exr)
    cached = tmp_path / "blendcache_mine"
    assert any(Path(file).parent == cached for file, _ in again.blend.files)
    shutil.move(cached, tmp_path / "gone")
    with pytest.raises(ValueError) as caught:
        again.render(tmp_path / "out", "again")
    one_sentence(caught.value, "blendcache_mine", "_*_00.bphys", "is missing")
    scene = Request.of_blend(blend).blend.append()
    assert [Path(file).parent for file in missing_files(scene)] == [cached]
    assert dict(files_of(scene))[missing_files(scene)[0]] == ""


def test_a_cache_is_known_by_its_own_name_and_place(blend):
    scene = bpy.context.scene
    cache = scene.objects["Disk"].modifiers[0].point_cache
    cache.name, cache.index = "own", 3
    simulated.find_beside(scene, blend)
    assert simulated.files_of_caches(scene) == [str(blend.parent / "blendcache_mine" / "own_*_03.bphys")]


def test_only_what_is_not_baked_is_played(blend):
    scene = bpy.context.scene
    assert set(simulated.played(scene)) == {scene.name, "Zone", "Cloth", "Inner"}
    body = scene.objects["Rigid"].rigid_body
    body.enabled = False
    assert scene.name not in simulated.played(scene)
    body.enabled, body.kinematic = True, True  # it is where keyframes put it
    assert scene.name not in simulated.played(scene)
    scene.objects["Zone"].modifiers[0].show_render = False
    for name in ("Cloth", "Inner"):
        bpy.data.objects[name].modifiers[0].show_render = False
    assert simulated.played(scene) == []

    grown = scene.objects["Still"].modifiers.new("Grown", "PARTICLE_SYSTEM").particle_system
    assert simulated.played(scene) == ["Still"]
    grown.settings.type = "HAIR"
    assert simulated.played(scene) == []
    grown.use_hair_dynamics = True
    assert simulated.played(scene) == ["Still"]
    scene.objects["Still"].modifiers.clear()
    outer = bpy.data.node_groups.new("Outer", "GeometryNodeTree")
    outer.nodes.new("GeometryNodeGroup").node_tree = scene.objects["Zone"].modifiers[0].node_group
    scene.objects["Still"].modifiers.new("Nested", "NODES").node_group = outer
    assert simulated.played(scene) == ["Still"]
    scene.objects["Still"].modifiers.clear()
    painted = scene.objects["Still"].modifiers.new("Paint", "DYNAMIC_PAINT")
    with bpy.context.temp_override(object=scene.objects["Still"], active_object=scene.objects["Still"]):
        bpy.ops.dpaint.type_toggle(type="CANVAS")
    surface = painted.canvas_settings.canvas_surfaces[0]
    assert simulated.played(scene) == ["Still"]
    surface.surface_format = "IMAGE"
    assert simulated.played(scene) == []


def test_a_scene_with_rigid_bodies_goes_again(blend, tmp_path):
    """Blender falls over, often, if what they are and what ties them together go in any order, once they were played."""
    played()
    copy = shutil.copy(blend, tmp_path / "copy.blend")
    for number in range(6):
        Request.of_blend(copy, size=(24, 8)).render(tmp_path / "out", str(number))

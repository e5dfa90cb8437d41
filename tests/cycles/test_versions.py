# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of earlier versions, and files that go from one Blender to the next: materials keep what they were given.

tests/data/earlier_version.blend was saved by Blender 4.5 with the first two forms of the group, before it had a version:
"First" and "Linked" use OSL with the first shader, "Nodes" uses the first layout of the nodes.
"""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from nim_addon.cycles import versions
from nim_addon.cycles.closures import CLOSURES, INTERFACE, backends, script
from nim_addon.cycles.closures.closure import VERSION_MARK
from nim_addon.cycles.material import asked_interfaces, interface_material, interface_nodes
from nim_addon.physics import Medium
from nim_addon.scenes.sphere import ball
from nim_addon.scenes.stage import Stage

ROOT = Path(__file__).parents[2]
# What each backend's group held when its closure's version was last raised, by the closure's shader.
FINGERPRINTS = {
    "nim_interface": {"osl": "0b8dcb6184b816be", "nodes": "0914c7221b4c66fd"},
    "nim_shutter": {"osl": "6a685c889f452bd9", "nodes": "a9e68e22ad0e4aa6"},
    "nim_clear_path": {"osl": "f397775b73ea8c91", "nodes": "02ce0ae3dca101a9"},
    "nim_graded_ball": {"osl": "6b71c5a09e9e8618", "nodes": "3e3a6f198091004c"},
    "nim_lenslet_window": {"osl": "77f40c15e8e0deae", "nodes": "7743f727ded7db70"},
    "nim_uniaxial_slab": {"osl": "89a4f77a60c019f2", "nodes": "1f2d9689574d7153"},
    "nim_graded_core": {"osl": "50fa4a056b967c44", "nodes": "8adb0e0be901f7b1"},
}


@pytest.fixture
def compiled(monkeypatch):
    """The list of shader sources compiled so far."""
    texts = []
    compiler = script.bytecode_of
    monkeypatch.setattr(script, "bytecode_of", lambda shader, text: texts.append(text) or compiler(shader, text))
    return texts


@pytest.fixture
def earlier(data, empty_file):
    """The materials of the stored file, as they were saved, in an empty one."""
    with bpy.data.libraries.load(str(data / "earlier_version.blend")) as (stored, wanted):
        wanted.materials = stored.materials
    return {one.name: one for one in wanted.materials}


def values(node):
    """What a person set on an interface node, by socket."""
    return {s.name: s.default_value if s.type == "VALUE" else tuple(s.default_value) for s in node.inputs}


def links(one):
    return {(link.from_node.name, link.from_socket.name, link.to_socket.name) for link in one.node_tree.links}


def fingerprint(closure, group):
    """A hash of all that decides what a group renders; where its nodes lie, their order and their labels do not."""
    facts = [[s.identifier, s.name, s.type, str(s.default), s.min, s.max] for s in closure.sockets]
    if closure.backend_of(group) == "osl":
        return digest([facts, closure.source()])
    leave = next(node for node in group.nodes if node.type == "GROUP_OUTPUT")
    return digest([facts, calculated(leave, {})])


def calculated(node, known):
    """A hash of a node and of all that feeds it."""
    if node not in known:
        inputs = []
        for socket in node.inputs if node.type != "GROUP_INPUT" else ():
            feeding = [[link.from_socket.name, calculated(link.from_node, known)] for link in socket.links]
            inputs.append([socket.identifier, feeding or value_of(socket)])
        kinds = [str(getattr(node, key, "")) for key in ("operation", "data_type", "distribution", "clamp_factor")]
        known[node] = digest([node.bl_idname, kinds, inputs])
    return known[node]


def value_of(socket):
    held = getattr(socket, "default_value", None)
    return [f"{x:.6g}" for x in held] if hasattr(held, "__len__") else None if held is None else f"{held:.6g}"


def digest(facts):
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("closure", CLOSURES, ids=lambda closure: closure.shader)
def test_a_changed_group_has_a_new_version(empty_file, closure, backend):
    group = closure.group(backend)
    assert group[VERSION_MARK] == closure.version
    if bpy.app.version[:2] != (4, 5):
        pytest.skip("Blender's own nodes have other sockets in each version: the fingerprint is of those of 4.5")
    assert fingerprint(closure, group) == FINGERPRINTS.get(closure.shader, {}).get(backend), (
        "the group is not what it was: raise its version in cycles/closures/, so that older files are brought up to date, run "
        "build.py blends, and put the new fingerprint here"
    )


def test_an_earlier_file_is_brought_up_to_date(earlier, compiled):
    before = {name: (values(interface_nodes(one)[0]), links(one)) for name, one in earlier.items()}
    assert before["Nodes"][0]["Index Inside"] == pytest.approx(-4.1)
    assert ("Bump", "Normal", "Normal") in before["Linked"][1]
    done = versions.update()
    assert sorted(done.updated) == ["NIM Interface", "NIM Interface (nodes)"]
    assert not done.left_alone
    new = {socket.name: 0.0 for socket in INTERFACE.sockets if socket.since > 1}
    eevee = {("NIM Interface", "EEVEE", "Surface")}
    for name, one in earlier.items():
        assert values(interface_nodes(one)[0]) == before[name][0] | new and links(one) == before[name][1] | eevee
        assert not new.keys() & before[name][0].keys()
    for backend in ("osl", "nodes"):
        group = next(g for g in bpy.data.node_groups if g.get(INTERFACE.shader) == backend)
        fresh = INTERFACE.new_group(backend)
        assert [n.bl_idname for n in group.nodes] == [n.bl_idname for n in fresh.nodes]
        assert len(group.links) == len(fresh.links)
        assert [i.name for i in group.interface.items_tree] == [i.name for i in fresh.interface.items_tree]
    assert compiled == [INTERFACE.source()]
    assert not versions.outdated()
    assert versions.update() == ([], [])
    assert len(compiled) == 1
    # the values that are keyed are the material's own, and move as before
    mesh = bpy.data.meshes.new("Keyed")
    mesh.materials.append(earlier["Linked"])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Keyed", mesh))
    bpy.context.scene.frame_set(6)
    assert interface_nodes(earlier["Linked"])[0].inputs["Permeability Inside"].default_value == pytest.approx(-4)
    # and what is made from now on uses the same group
    assert INTERFACE.group("osl") == interface_nodes(earlier["First"])[0].node_tree


def test_what_is_brought_up_to_date_renders_the_same(earlier, render):
    stage = Stage("versions", (32, 32), "osl")
    thing = ball(stage, "Sphere", (0, 0, 0), 1.0, earlier["First"])
    stage.camera((0, -4, 0), (0, 0, 0), 35)
    world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    stage.world(world)
    stage.scene.cycles.samples = 4
    versions.update()
    for name in ("First", "Nodes"):
        thing.data.materials[0] = earlier[name]
        stage.scene.cycles.shading_system = name == "First"
        if name == "First":  # its tint shows in a white furnace
            assert render(stage.scene)[16, 16].tolist() == pytest.approx([1.0, 0.4, 0.1], abs=0.25)
        else:
            assert render(stage.scene).mean() == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_a_socket_that_is_new_comes_where_it_belongs(empty_file, backend, compiled):
    one = interface_material("Sphere", Medium(-1.5, -2.0), Medium(1.33), backend=backend)
    node = interface_nodes(one)[0]
    group = node.node_tree
    tree = group.interface.items_tree
    group.interface.remove(next(i for i in tree if i.name == "Permeability Outside"))
    group.interface.move(next(i for i in tree if i.name == "Normal"), 1)
    del group[VERSION_MARK]
    known, before = values(node), len(compiled)
    assert "Permeability Outside" not in known
    versions.update()
    now = values(node)
    assert [socket.name for socket in node.inputs] == [socket.name for socket in INTERFACE.sockets]
    assert now.pop("Permeability Outside") == 1.0
    assert now == known
    assert len(compiled) == before, "the shader is the same"


def test_a_linked_group_is_left_alone_with_a_reason(data, empty_file, one_sentence):
    with bpy.data.libraries.load(str(data / "earlier_version.blend"), link=True) as (stored, wanted):
        wanted.materials = ["Nodes"]
    done = versions.update()
    assert not done.updated
    one_sentence(done.left_alone[0], "NIM Interface (nodes)", "earlier_version.blend")
    # but linking one does not keep an own one from being made
    assert INTERFACE.group("nodes").library is None


def test_a_group_of_a_later_version_is_left_alone(empty_file, one_sentence):
    group = INTERFACE.group("nodes")
    group[VERSION_MARK] = INTERFACE.version + 1
    done = versions.update()
    assert not done.updated
    one_sentence(done.left_alone[0], "later version")


def test_without_osl_an_earlier_shader_is_left_for_a_blender_that_has_it(earlier, monkeypatch, one_sentence):
    monkeypatch.setattr(backends, "osl_available", lambda: False)
    done = versions.update()
    assert done.updated == ["NIM Interface (nodes)"]
    one_sentence(done.left_alone[0], "OSL")
    assert len(interface_nodes(earlier["First"])[0].node_tree.nodes) == 3


# ------------------------------------------------------------------------------------------------ files that are not well


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("version", ["two", 2.5, [1, 2], -7])
def test_a_version_that_is_none_is_an_earlier_one(version, backend, empty_file):
    node = interface_nodes(interface_material("Sphere", Medium(-1.33, -10.0), backend=backend))[0]
    known = values(node)
    node.node_tree[VERSION_MARK] = version
    assert versions.update().updated == [INTERFACE.group_name(backend)]
    assert node.node_tree[VERSION_MARK] == INTERFACE.version and values(node) == known


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("what", ["nodes", "sockets", "all", "links", "type"])
@pytest.mark.parametrize("by", ["opening", "new material"])
def test_a_group_that_was_emptied_is_filled_again(by, what, backend, empty_file, render):
    one = interface_material("Sphere", Medium(-1.5), backend=backend)
    group = interface_nodes(one)[0].node_tree
    if what in ("nodes", "all"):
        group.nodes.clear()
    if what in ("sockets", "all"):
        group.interface.clear()
    if what == "links":
        group.links.clear()
    if what == "type":
        group.interface.remove(next(i for i in group.interface.items_tree if i.name == "Index Inside"))
        group.interface.new_socket("Index Inside", in_out="INPUT", socket_type="NodeSocketColor")
    if what in ("sockets", "all"):  # and until then it is no interface, of which anything would ask its numbers
        assert not interface_nodes(one) and not asked_interfaces(one)
    if by == "opening":
        assert versions.update().updated == [INTERFACE.group_name(backend)]
    interface_material("Another", Medium(1.33), backend=backend)
    assert len(bpy.data.node_groups) == 1 and not versions.outdated()
    node = one.node_tree.nodes[INTERFACE.label]
    assert [socket.name for socket in node.inputs] == [socket.name for socket in INTERFACE.sockets]
    assert [socket.name for socket in node.outputs] == ["BSDF", "EEVEE"]
    assert interface_nodes(one) == [node]
    if what in ("nodes", "links"):
        assert node.inputs["Index Inside"].default_value == -1.5 and node.outputs[0].is_linked
    fresh = INTERFACE.new_group(backend)
    assert [n.bl_idname for n in group.nodes] == [n.bl_idname for n in fresh.nodes]
    assert len(group.links) == len(fresh.links)


@pytest.mark.parametrize("mark", ["osl", "nodes", 1, "other", [1, 2]])
def test_our_mark_on_what_is_no_shader_says_nothing(mark, empty_file):
    tree = bpy.data.node_groups.new("Of geometry", "GeometryNodeTree")
    tree[INTERFACE.shader], tree[VERSION_MARK] = mark, "x"
    assert versions.update() == ([], []) and not versions.outdated()
    for backend in ("osl", "nodes"):
        one = interface_material("Sphere", Medium(-1.5), backend=backend)
        assert interface_nodes(one)[0].node_tree != tree
    assert len(tree.nodes) == 0 and tree[VERSION_MARK] == "x"


def test_a_mark_that_is_not_ours_says_nothing(empty_file):
    tree = bpy.data.node_groups.new("A person's own", "ShaderNodeTree")
    for mark in ("other", [1, 2], {"a": 1}):
        tree[INTERFACE.shader] = mark
        assert not versions.outdated()
        holder = interface_material("Sphere", Medium(-1.5), backend="nodes")
        holder.node_tree.nodes[INTERFACE.label].node_tree = tree
        assert not interface_nodes(holder) and not asked_interfaces(holder)


def test_beside_a_group_of_a_later_version_one_of_this_is_made(empty_file):
    later = INTERFACE.group("nodes")
    later[VERSION_MARK] = INTERFACE.version + 1
    own = INTERFACE.group("nodes")
    assert own != later and own[VERSION_MARK] == INTERFACE.version
    assert INTERFACE.group("nodes") == own


APPENDED = """
import os, sys, bpy, addon_utils
addon_utils.enable("nim_addon", default_set=True)
from nim_addon.cycles import versions
with bpy.data.libraries.load(sys.argv[1], link=False) as (stored, wanted):
    wanted.materials = ["First"]
bpy.context.view_layer.update()
assert not versions.outdated()
bpy.ops.wm.append(filename="Nodes", directory=sys.argv[1] + "/Material/")
bpy.context.view_layer.update()
assert {"First", "Nodes"} <= set(bpy.data.materials.keys())
assert not versions.outdated(), versions.outdated()
assert all(group["nim_version"] for group in bpy.data.node_groups)
print("present", bpy.app.version_string, flush=True)
os._exit(0)  # the module of Blender 4.2 crashes as it exits where any class is registered
"""


def test_materials_that_are_appended_are_brought_up_to_date(data, tmp_path):
    stored = tmp_path / "earlier.blend"
    stored.write_bytes((data / "earlier_version.blend").read_bytes())
    assert "present" in run(sys.executable, APPENDED, stored)


# ------------------------------------------------------------------------------------------------ other Blenders

SAVED_IN_ONE = """
import sys, bpy, addon_utils
addon_utils.enable("nim_addon", default_set=True)
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
for backend in ("osl", "nodes"):
    one = interface_material(backend, Medium(-1.33, -10.0), Medium(1.5), backend=backend, tint=(1.0, 0.5, 0.25))
    one.use_fake_user = True
    node = one.node_tree.nodes["NIM Interface"]
    node.inputs["Permeability Outside"].default_value = 2.0
    node.inputs["Permeability Outside"].keyframe_insert("default_value", frame=1)
    value = one.node_tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = -2.418
    one.node_tree.links.new(value.outputs[0], node.inputs["Index Inside"])
chosen = bpy.context.scene.nim_scenes
chosen.scene = "pool"
chosen.pool.waves, chosen.pool.seed, chosen.pool.sky, chosen.quality = 0.125, 7, "sunny", "GOOD"
assert bpy.ops.nim.build_scene() == {"FINISHED"}
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""

OPENED_IN_ANOTHER = """
import sys, bpy, addon_utils
addon_utils.enable("nim_addon", default_set=True)
from nim_addon.cycles import versions
from nim_addon.cycles.closures import script
def compile(shader, text):
    raise AssertionError("compiled on load")
script.bytecode_of = compile
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not versions.outdated()
for backend in ("osl", "nodes"):
    node = bpy.data.materials[backend].node_tree.nodes["NIM Interface"]
    held = {s.name: s.default_value for s in node.inputs}
    assert node.node_tree["nim_interface"] == backend
    assert abs(held["Index Inside"] + 1.33) < 1e-6 and held["Permeability Inside"] == -10, held
    assert held["Index Outside"] == 1.5 and held["Permeability Outside"] == 2, held
    assert list(held["Tint"]) == [1.0, 0.5, 0.25, 1.0], held
    assert node.inputs["Index Inside"].links[0].from_node.outputs[0].default_value < -2.4
    assert bpy.data.materials[backend].node_tree.animation_data.action
    group = node.node_tree
    assert len(group.links) > 6 and all(link.is_valid for link in group.links)
chosen = bpy.data.scenes["NIM pool"].nim_scenes
assert chosen.scene == "pool" and chosen.quality == "GOOD"
assert (chosen.pool.waves, chosen.pool.seed, chosen.pool.sky) == (0.125, 7, "sunny")
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
print("survived", bpy.app.version_string)
"""


def run(python, script, path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "BLENDER_USER_RESOURCES": str(path.parent)}
    # the module of Blender 4.2 crashes as it exits where any class was registered
    script += "import os\nsys.stdout.flush()\nos._exit(0)\n"
    done = subprocess.run(
        [str(python), "-c", script, str(path)], capture_output=True, text=True, env=environment, timeout=120
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("version", ["5.0", "5.2"])
def test_a_file_goes_on_to_a_later_blender(version, tmp_path):
    other = ROOT / f".venv-{version}" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not other.exists() or bpy.app.version_string >= version:
        pytest.skip(f"no environment of Blender {version}, or this is it: python3 build.py setup --blender {version}")
    path = tmp_path / "saved.blend"
    run(sys.executable, SAVED_IN_ONE, path)
    assert "survived" in run(other, OPENED_IN_ANOTHER, path)

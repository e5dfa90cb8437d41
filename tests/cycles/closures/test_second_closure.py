# SPDX-License-Identifier: GPL-3.0-or-later
"""A second closure is a shader, its sockets, its twin in nodes, and its name in CLOSURES: all else it has from Closure.

A mirror with a tint stands for it.
"""

import bpy
import numpy as np
import pytest

from nim_addon import checks
from nim_addon.caustics.bending import Bending, check, own_groups
from nim_addon.checks.sight import look
from nim_addon.cycles import closures, versions
from nim_addon.cycles.closures import INTERFACE, Closure, Socket, closure_of, script, version_of
from nim_addon.cycles.closures.closure import VERSION_MARK
from nim_addon.cycles.material import (
    asked_closures,
    asked_interfaces,
    interface_material,
    interface_nodes,
    switch_backend,
)
from nim_addon.cycles.nodes import empty_tree
from nim_addon.cycles.visibility import as_rendered, asked, is_interface
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage

# ------------------------------------------------------------------------------------------------ osl/nim_mirror.osl

SHADER = """
#include "stdcycles.h"

shader nim_mirror(
    float share = 0.5 [[ string label = "Share", string help = "Of the light that is kept", float min = 0, float max = 1 ]],
    color tint = 1.0 [[ string label = "Tint", string help = "Factor on all light" ]],
    output closure color BSDF = 0)
{
    color kept = share * tint;
    BSDF = kept * reflection(N);
}
"""

# ------------------------------------------------------------------------------------------------ closures/mirror.py


def twin(sheet):
    sheet.frame("Mirror")
    share, tint = sheet.inputs("share", "tint")
    kept = share * tint
    sheet.name(locals())
    inputs = {"Color": kept, "Roughness": 0.0}
    sheet.end(sheet.node("ShaderNodeBsdfAnisotropic", "mirrored", inputs, distribution="GGX"))


MIRROR = Closure(
    shader="nim_mirror",
    label="Tinted Mirror",
    sockets=(
        Socket("share", "Share", "NodeSocketFloat", 0.5, 0.0, 1.0, "Of the light that is kept"),
        Socket("tint", "Tint", "NodeSocketColor", (1.0, 1.0, 1.0, 1.0), None, None, "Factor on all light"),
    ),
    version=3,
    twin=twin,
    heart="BSDF_GLOSSY",
)

# ------------------------------------------------------------------------------------------------ what it then can do

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])


@pytest.fixture(autouse=True)
def mirrors(empty_file, monkeypatch):
    """As if the mirror stood in osl/ and in CLOSURES; the list of the shaders that are compiled."""
    texts, compiled = script.source, []
    compiler = script.bytecode_of
    monkeypatch.setattr(closures, "CLOSURES", (*closures.CLOSURES, MIRROR))
    monkeypatch.setattr(script, "source", lambda shader: SHADER if shader == "nim_mirror" else texts(shader))
    monkeypatch.setattr(script, "bytecode_of", lambda shader, text: compiled.append(shader) or compiler(shader, text))
    return compiled


def mirror(backend, share=0.75, tint=(1.0, 0.5, 0.25)):
    """A material that is a mirror, and its node."""
    material = bpy.data.materials.new("Mirror")
    tree = empty_tree(material)
    node = MIRROR.new_node(tree, backend)
    node.inputs["Share"].default_value, node.inputs["Tint"].default_value = share, (*tint, 1.0)
    tree.links.new(node.outputs["BSDF"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material, node


@both_backends
def test_its_group_has_its_sockets_its_version_and_its_name(backend, mirrors):
    material, node = mirror(backend)
    group = node.node_tree
    assert group.name == {"osl": "Tinted Mirror", "nodes": "Tinted Mirror (nodes)"}[backend]
    assert MIRROR.group(backend) == group == mirror(backend)[1].node_tree, "all materials share it"
    assert node.label == "Tinted Mirror" and MIRROR.nodes_of(material) == [node]
    items = {item.name: item for item in group.interface.items_tree if item.in_out == "INPUT"}
    assert (items["Share"].min_value, items["Share"].max_value, items["Share"].default_value) == (0, 1, 0.5)
    assert [item.description for item in items.values()] == [socket.description for socket in MIRROR.sockets]
    assert version_of(group) == 3 and MIRROR.backend_of(group) == backend and MIRROR.is_present(group)
    assert mirrors == (["nim_mirror"] if backend == "osl" else [])


def test_both_backends_show_the_same(render):
    pictures = []
    for backend in ("osl", "nodes"):
        stage = Stage("mirror", (32, 32), backend)
        stage.mesh("Mirror", *shapes.rectangle((-9, -9), (9, 9)), mirror(backend)[0])
        halves = surfaces.shining("Wall", lambda nodes: nodes.add("ShaderNodeTexCoord").outputs["Generated"])
        stage.mesh("Wall", [(-9, 4, 0), (9, 4, 0), (9, 4, 9), (-9, 4, 9)], [(0, 1, 2, 3)], halves)
        stage.world(surfaces.sky("White", (1, 1, 1), (1, 1, 1)))
        stage.camera((0, -4, 2), (0, 0, 0), 40)
        stage.scene.cycles.samples = 4
        pictures.append(render(stage.scene))
    assert pictures[0].std() > 0.05
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-5)


def test_switching_keeps_its_values_and_is_nothing_to_the_interface():
    material, node = mirror("osl")
    nim = interface_material("NIM", Medium(-1.5), backend="osl")
    for backend in ("nodes", "osl", "nodes"):
        assert MIRROR.switch(material, backend) == 1 and INTERFACE.switch(material, backend) == 0
        assert node.node_tree == MIRROR.group(backend)
        assert node.inputs["Share"].default_value == 0.75 and node.outputs[0].is_linked
    assert INTERFACE.backend_of(interface_nodes(nim)[0].node_tree) == "osl", "which was not switched"


@both_backends
def test_what_is_older_or_emptied_is_brought_up_to_date(backend, mirrors):
    material, node = mirror(backend)
    interface_material("NIM", Medium(-1.5), backend=backend)
    before = len(mirrors)
    assert not versions.outdated()
    group = node.node_tree
    group[VERSION_MARK] = 2  # in which it had no share, and the tint stood first
    group.interface.remove(next(item for item in group.interface.items_tree if item.name == "Share"))
    group.nodes.clear()
    assert versions.outdated() == [group]
    if backend == "osl":
        group.nodes.new("ShaderNodeScript").script = bpy.data.texts["nim_mirror.osl"]
        bpy.data.texts["nim_mirror.osl"].from_string("shader nim_mirror(output closure color BSDF = 0) {}")
    assert versions.update() == ([MIRROR.group_name(backend)], [])
    assert not versions.outdated() and version_of(group) == 3
    assert [socket.name for socket in node.inputs] == ["Share", "Tint"]
    assert node.inputs["Share"].default_value == 0.5 and tuple(node.inputs["Tint"].default_value) == (1, 0.5, 0.25, 1)
    assert mirrors[before:] == (["nim_mirror"] if backend == "osl" else [])
    group[VERSION_MARK] = 4
    assert "later version" in versions.update().left_alone[0]
    assert MIRROR.group(backend) != group, "one of a later version is not ours to touch"


@both_backends
def test_neither_is_taken_for_the_other(backend):
    material, node = mirror(backend)
    nim = interface_material("NIM", Medium(-1.5), backend=backend)
    (interface,) = interface_nodes(nim)
    assert closure_of(node.node_tree) is MIRROR and closure_of(interface.node_tree) is INTERFACE
    assert closure_of(None) is None and closure_of(material.node_tree) is None
    assert not is_interface(node) and not MIRROR.is_node(interface)
    assert interface_nodes(material) == asked_interfaces(material) == MIRROR.nodes_of(nim) == []
    assert MIRROR.group(backend) == node.node_tree and INTERFACE.group(backend) == interface.node_tree
    stage = Stage("mirror", (32, 32), backend)
    stage.mesh("Mirror", *shapes.rectangle((-1, -1), (1, 1)), material)
    with as_rendered(stage.scene) as depsgraph:
        assert not look(stage.scene, depsgraph).worn
    node.node_tree = interface.node_tree
    assert is_interface(node) and not MIRROR.is_node(node)


@both_backends
def test_what_is_in_its_groups_is_its_own(backend):
    """Whoever follows the nodes of a material meets the closure, in either form, and not the nodes that it is made of."""
    material, node = mirror(backend)
    assert [found.node for found in asked(material)] == [found.node for found in asked_closures(material)] == [node]
    assert own_groups(material.node_tree) == [] and node.node_tree == MIRROR.group(backend)


@both_backends
def test_caustics_refuse_what_they_are_not_told_about(backend, one_sentence):
    material, _ = mirror(backend)
    for meet in (check, Bending().of):
        with pytest.raises(ValueError) as error:
            meet(material, "Wall")
        assert "Tinted Mirror" in one_sentence(str(error.value)) and "Wall" in str(error.value)
    check(interface_material("NIM", Medium(-1.5), backend=backend), "Wall")


def test_settings_are_checked_for_it_too():
    material, node = mirror("osl")
    stage = Stage("mirror", (32, 32), "osl")
    stage.mesh("Mirror", *shapes.rectangle((-1, -1), (1, 1)), material)
    scene = stage.scene
    assert checks.backends([material]) == {"osl": ("Mirror",)} and checks.problems(scene) == []
    scene.cycles.shading_system, scene.cycles.max_bounces = False, 1
    assert {problem.code for problem in checks.problems(scene)} >= {"osl_off", "bounces"}
    checks.MENDS["osl_missing"](scene, checks.Problem("osl_missing", (), {}, None, materials=("Mirror",)))
    assert node.node_tree == MIRROR.group("nodes") and node.inputs["Share"].default_value == 0.75


def test_a_material_is_switched_with_all_its_closures():
    material, node = mirror("osl")
    nim = INTERFACE.new_node(material.node_tree, "osl")
    assert switch_backend(material, "nodes") == 2
    assert (node.node_tree, nim.node_tree) == (MIRROR.group("nodes"), INTERFACE.group("nodes"))

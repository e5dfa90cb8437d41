# SPDX-License-Identifier: GPL-3.0-or-later
"""The groups of a closure: their sockets are the shader's, the same in both backends, and materials keep what they set."""

import itertools
import re

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures import CLOSURES, INTERFACE
from nim_addon.cycles.closures.script import bytecode_of, script_of
from nim_addon.cycles.material import NODE_NAME, interface_material, switch_backend
from nim_addon.physics import Medium

every_closure = pytest.mark.parametrize("closure", CLOSURES, ids=[closure.label for closure in CLOSURES])


@every_closure
def test_sockets_are_the_shaders_own(closure):
    bytecode = bytecode_of(closure.shader, closure.source())
    line = re.compile(r"^param\t(\w+)\t(\w+)\t([^\t]*?)\s*\t(.*)$", re.MULTILINE)
    found = []
    for kind, identifier, default, rest in line.findall(bytecode):
        meta = dict(re.findall(r"%meta\{\w+,(\w+),([^}]*)\}", rest))
        found.append((identifier, kind, [float(word) for word in default.split()], meta))
    assert [identifier for identifier, *_ in found] == [socket.identifier for socket in closure.sockets]
    vectors = dict.fromkeys(("normal", "vector"), "NodeSocketVector")
    types = {"float": "NodeSocketFloat", "color": "NodeSocketColor", **vectors}
    for socket, (_, kind, default, meta) in zip(closure.sockets, found, strict=True):
        assert types[kind] == socket.type
        assert meta["label"] == f'"{socket.name}"'
        assert meta["help"] == f'"{socket.description}"'
        assert default == list(np.ravel(socket.default))[: len(default)]
        assert (socket.min, socket.max) == tuple(float(meta[key]) if key in meta else None for key in ("min", "max"))


@every_closure
def test_group_sockets_carry_ranges_descriptions_and_defaults(closure, empty_file):
    group = closure.group()
    items = [item for item in group.interface.items_tree if item.in_out == "INPUT"]
    assert [item.name for item in items] == [socket.name for socket in closure.sockets]
    for item, socket in zip(items, closure.sockets, strict=True):
        assert item.socket_type == socket.type and item.description == socket.description
        assert np.allclose(item.default_value, socket.default)
        if socket.min is not None:
            assert (item.min_value, item.max_value) == (socket.min, socket.max)
    # from the group's socket to the shader's parameter of the same meaning
    by_identifier = {socket.identifier: socket for socket in script_of(group).inputs}
    for socket in closure.sockets:
        (link,) = by_identifier[socket.identifier].links
        assert link.from_node.type == "GROUP_INPUT" and link.from_socket.name == socket.name


@every_closure
def test_groups_of_both_backends_have_the_same_sockets(closure, empty_file):
    def sockets(backend):
        items = closure.group(backend).interface.items_tree
        keys = ("name", "identifier", "socket_type", "description", "hide_value", "min_value", "max_value")
        return [[getattr(item, key, None) for key in keys] + [str(getattr(item, "default_value", 0))] for item in items]

    assert [row[:-1] for row in sockets("osl")] == [row[:-1] for row in sockets("nodes")]


def test_switching_keeps_values_links_and_keyframes(empty_file):
    material = interface_material("A", Medium(-1.33, -10), Medium(1.5), tint=(0.2, 0.4, 0.6), backend="osl")
    tree = material.node_tree
    node = tree.nodes[NODE_NAME]
    mesh = bpy.data.meshes.new("Body")  # what no object shows is not animated
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Body", mesh))
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], node.inputs["Permeability Inside"])
    index = node.inputs["Index Inside"]
    index.keyframe_insert("default_value", frame=1)
    index.default_value = -2
    index.keyframe_insert("default_value", frame=11)
    driver = node.inputs["Index Outside"].driver_add("default_value").driver
    driver.expression = "1 + frame / 100"
    scene = bpy.context.scene

    def values():
        scene.frame_set(1)
        scene.frame_set(6)
        return [np.ravel(socket.default_value).tolist() for socket in node.inputs]

    before = values()
    assert -2 < before[0][0] < -1.33 and before[2][0] == pytest.approx(1.06)
    for backend in ("nodes", "osl", "nodes"):
        assert switch_backend(material, backend) == 1
        assert node.node_tree == INTERFACE.group(backend)
        assert values() == before
        assert node.inputs["Permeability Inside"].links[0].from_node == noise
        assert node.outputs["BSDF"].links[0].to_node.type == "OUTPUT_MATERIAL"


@every_closure
def test_frames_of_the_nodes_do_not_lie_on_each_other(closure, empty_file):
    boxes = {}
    for node in closure.new_group("nodes").nodes:
        if node.parent:  # hidden nodes and reroutes are a point, about which Blender draws a frame
            boxes.setdefault(node.parent.label, []).append(tuple(node.location))
    least, most = np.array((20, 60)), np.array((170, 40))
    boxes = {label: (np.min(places, axis=0) - least, np.max(places, axis=0) + most) for label, places in boxes.items()}
    for (one, (low, high)), (other, (bottom, top)) in itertools.combinations(boxes.items(), 2):
        assert (high <= bottom).any() or (top <= low).any(), f"{one} | {other}"

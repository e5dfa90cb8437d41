# SPDX-License-Identifier: GPL-3.0-or-later
"""Formulas in nodes: Cycles calculates what Python does, in as few nodes, and they stand where they can be read."""

import itertools
import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures.formulas import (
    Sheet,
    choose,
    dot,
    equal,
    length,
    maximum,
    minimum,
    normalize,
    sqrt,
)
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.scenes import shapes
from nim_addon.scenes.stage import Stage

A, B, C = 0.3, -1.7, 2.5
V, W = np.array([0.2, -0.5, 0.9]), np.array([-1.1, 0.4, 0.3])


@pytest.fixture
def sheet(empty_file):
    """A Sheet whose group takes three numbers, a, b and c, and two vectors, v and w."""
    group = bpy.data.node_groups.new("Formulas", "ShaderNodeTree")
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    for name in "abcvw":
        kind = "Vector" if name in "vw" else "Float"
        group.interface.new_socket(name.upper(), in_out="INPUT", socket_type=f"NodeSocket{kind}")
    sheet = Sheet(group, {name: name.upper() for name in "abcvw"})
    sheet.frame("First")
    return sheet


def nodes(sheet, type_="ShaderNodeMath"):
    return [node for node in sheet.tree.nodes if node.bl_idname == type_]


def closed(sheet, value):
    """End the sheet with a closure that shines with a value."""
    sheet.end(sheet.node("ShaderNodeEmission", "shines", {"Color": value}))


FORMULAS = {
    "a + b * c": lambda a, b, c, v, w: a + b * c,
    "0.5 * a + c": lambda a, b, c, v, w: 0.5 * a + c,
    "c + a * b - (1 + 2 * b)": lambda a, b, c, v, w: c + a * b - (1 + 2 * b),
    "1 - a - b": lambda a, b, c, v, w: 1 - a - b,
    "2 / a + c / 2": lambda a, b, c, v, w: 2 / a + c / 2,
    "-(a * b) + 3": lambda a, b, c, v, w: -(a * b) + 3,
    "abs(b)": lambda a, b, c, v, w: abs(b),
    "(a > b) + 2 * (b > a) + 4 * (b < c)": lambda a, b, c, v, w: (a > b) + 2 * (b > a) + 4 * (b < c),
    "2 v - w": lambda a, b, c, v, w: 2 * v - w,
    "v w + c v": lambda a, b, c, v, w: v * w + c * v,
    "-v": lambda a, b, c, v, w: -v,
}


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
def test_cycles_calculates_what_python_does(formula, sheet, render):
    shown(sheet, formula(*sheet.inputs(*"abcvw")), formula(A, B, C, V, W), render)


FUNCTIONS = {
    "sqrt": (lambda a, b, c, v, w: sqrt(c), math.sqrt(C)),
    "sqrt of a negative number": (lambda a, b, c, v, w: sqrt(b), 0),
    "minimum": (lambda a, b, c, v, w: minimum(a, b), B),
    "maximum": (lambda a, b, c, v, w: maximum(a, b), A),
    "equal": (lambda a, b, c, v, w: equal(a, 0.31, within=0.02) + 2 * equal(a, 0.31, within=0.001), 1),
    "dot": (lambda a, b, c, v, w: dot(v, w), float(V @ W)),
    "length": (lambda a, b, c, v, w: length(v), float(np.linalg.norm(V))),
    "normalize": (lambda a, b, c, v, w: normalize(v), V / np.linalg.norm(V)),
    "choose a number": (lambda a, b, c, v, w: choose(a > b, b, c) + choose(b > a, b, c), B + C),
    "choose a vector": (lambda a, b, c, v, w: choose(a > b, v, w), V),
}


@pytest.mark.parametrize("formula, expected", FUNCTIONS.values(), ids=FUNCTIONS)
def test_functions(formula, expected, sheet, render):
    shown(sheet, formula(*sheet.inputs(*"abcvw")), expected, render)


def shown(sheet, value, expected, render):
    """Render a plane that shines with 5 + a value of the sheet, so that it is positive."""
    five = sheet.node("ShaderNodeCombineXYZ", "5", {0: 5.0, 1: 5.0, 2: 5.0}) if value.is_vector() else 5
    closed(sheet, value + five)
    stage = Stage("formulas", (8, 8), "nodes")
    material = bpy.data.materials.new("Formula")
    tree = Nodes(empty_tree(material))
    inputs = dict(zip("ABCVW", (A, B, C, V.tolist(), W.tolist()), strict=True))
    tree.end(tree.add("ShaderNodeGroup", node_tree=sheet.tree, inputs=inputs))
    stage.mesh("Plane", *shapes.rectangle((-9, -9), (9, 9)), material)
    stage.camera((0, 0, 3), (0, 0, 0), 40)
    stage.scene.cycles.samples = 1
    got = render(stage.scene).astype(float).mean((0, 1))
    np.testing.assert_allclose(got, 5 + np.broadcast_to(expected, 3), rtol=1e-5)


def test_what_was_calculated_is_not_calculated_again(sheet):
    a, b, c = sheet.inputs("a", "b", "c")
    closed(sheet, (a * b - c) / (a * b + c) + (a * b - c))
    operations = sorted(node.operation for node in nodes(sheet))
    assert operations == ["ADD", "ADD", "DIVIDE", "MULTIPLY", "SUBTRACT"]


def test_a_product_in_a_sum_takes_no_node_of_its_own(sheet):
    a, b, c = sheet.inputs("a", "b", "c")
    closed(sheet, c + a * b)
    (node,) = nodes(sheet)
    assert node.operation == "MULTIPLY_ADD"
    assert [socket.links[0].from_socket.name for socket in node.inputs] == ["A", "B", "C"]


def test_a_product_that_has_a_name_keeps_its_node(sheet):
    a, b, c = sheet.inputs("a", "b", "c")
    product = a * b
    sheet.name({"product": product})
    closed(sheet, product + c)
    assert [node.operation for node in nodes(sheet)] == ["MULTIPLY", "ADD"]


def test_labels_are_the_formulas(sheet):
    a, b, c, v, w = sheet.inputs(*"abcvw")
    half = 0.5 * (a - (b - c))
    square = (a + b) * (a + b)
    along = (square / (half * c)) * v
    total = abs(dot(along, w)) * c
    sheet.name({"half": half, "total": total})
    closed(sheet, total)
    labels = [node.label for node in nodes(sheet) + nodes(sheet, "ShaderNodeVectorMath")]
    assert labels == [
        "b - c", "a - (b - c)", "half", "a + b", "(a + b)^2", "half c", "(a + b)^2 / (half c)", "|(a + b)^2 / (half c) v . w|",
        "total", "(a + b)^2 / (half c) v", "(a + b)^2 / (half c) v . w",
    ]  # fmt: skip


def test_nodes_stand_to_the_right_of_those_that_feed_them_and_never_on_another(sheet):
    a, b, c = sheet.inputs("a", "b", "c")
    first = sheet.frame("First part")
    d = sqrt(a * b - c) / (a + c)
    second = sheet.frame("Second part", after=first, top=-100)
    closed(sheet, (d + a) * (d - b) * c)
    for link in sheet.tree.links:
        if link.to_node.type != "GROUP_OUTPUT":
            assert link.from_node.location.x < link.to_node.location.x, link.to_node.label
    boxes = [node for node in sheet.tree.nodes if node.type not in ("FRAME", "REROUTE")]
    for one, other in itertools.combinations(boxes, 2):
        apart = abs(one.location.x - other.location.x), abs(one.location.y - other.location.y)
        assert apart[0] >= one.width or apart[1] >= 24, (one.label, other.label)
    assert first.right <= second.left

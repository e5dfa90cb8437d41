# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of nodes that are read instead of filled: the same in all, and never those of something else."""

import dataclasses
from pathlib import Path

import bpy
import pytest

from nim_addon.cycles import nodes
from nim_addon.cycles.closures import CLOSURES, INTERFACE, SHUTTER, Closure, formulas, interface, template

each = pytest.mark.parametrize("closure", CLOSURES, ids=lambda closure: closure.shader)


def twin(sheet):
    sheet.frame("A constant")
    node = sheet.node("ShaderNodeBsdfAnisotropic", "mirrored", {"Roughness": 0.0})
    sheet.end(node)


@pytest.fixture
def filled(monkeypatch):
    """The list of the groups that are filled node by node from now on."""
    made = []
    monkeypatch.setattr(template, "_kept", {})
    way = Closure.filled
    monkeypatch.setattr(Closure, "filled", lambda self, backend: made.append(self) or way(self, backend))
    return made


def described(group):
    """All that a person or Cycles finds in a group, but for what does nothing there and begins otherwise in Blender 5.2."""
    place = {node: number for number, node in enumerate(group.nodes)}
    return {
        "name": group.name,
        "marks": dict(group.items()),
        "fake user": group.use_fake_user,
        "sockets": [
            {key: value_of(getattr(item, key, None)) for key in ("name", "description", "default_value", "hide_value")}
            | {key: getattr(item, key, None) for key in ("in_out", "socket_type", "min_value", "max_value")}
            for item in group.interface.items_tree
        ],
        "nodes": [node_of(node, place) for node in group.nodes],
        "links": {
            tuple(end_of(socket, place) for socket in (link.from_socket, link.to_socket)) for link in group.links
        },
    }


def node_of(node, place):
    own = [key for key in node.bl_rna.properties.keys() if key not in bpy.types.Node.bl_rna.properties]  # noqa: SIM118
    own += ["bl_idname", "name", "label", "hide", "location", "mute"]
    own += [] if node.type == "FRAME" else ["width"]  # as wide as what stands in it
    values = [
        (s.identifier, s.hide, None if s.is_linked else value_of(getattr(s, "default_value", None)))
        for s in node.inputs
    ]
    return (
        {key: value_of(getattr(node, key)) for key in own if key != "subsurface_method"}
        | {"marks": dict(node.items()), "parent": place.get(node.parent)}
        | {"inputs": [value for value in values if value[0] != "Subsurface Scale"]}
        | {"outputs": [(s.identifier, s.hide) for s in node.outputs]}
    )


def end_of(socket, place):
    return place[socket.node], socket.is_output, socket.identifier


def value_of(value):
    if isinstance(value, bool | int | float | str | None):
        return value
    return tuple(value) if hasattr(value, "__len__") else type(value).__name__


@each
def test_what_is_shipped_is_what_would_be_filled(empty_file, filled, closure):
    read = closure.new_group("nodes")
    assert not filled, "it is of other formulas: run python3 build.py blends closures"
    libraries, groups = len(bpy.data.libraries), len(bpy.data.node_groups)
    assert (libraries, groups) == (0, 1)
    found = described(read)
    bpy.data.node_groups.remove(read)
    assert found == described(closure.filled("nodes"))


@pytest.mark.parametrize(
    "change",
    [
        {"version": INTERFACE.version + 1},
        {"sockets": (*INTERFACE.sockets[:3], INTERFACE.sockets[3]._replace(default=2.0), *INTERFACE.sockets[4:])},
        {"twin": twin},
        {"label": "Another"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_what_is_of_something_else_is_not_used(empty_file, filled, change):
    changed = dataclasses.replace(INTERFACE, **change)
    group = changed.new_group("nodes")
    assert filled == [changed]
    first = described(group)
    group.name = "First"
    # and is kept for the next time
    assert described(changed.new_group("nodes")) == first
    assert filled == [changed]
    assert len(described(INTERFACE.new_group("nodes"))["nodes"]) > 300 and filled == [changed]


@pytest.mark.parametrize("module", [formulas, nodes, interface], ids=lambda module: module.__name__.rpartition(".")[2])
def test_what_was_made_by_other_formulas_is_not_used(empty_file, filled, monkeypatch, tmp_path, module):
    changed = tmp_path / "changed.py"
    changed.write_text(Path(module.__file__).read_text() + "\n# and more\n")
    monkeypatch.setattr(module, "__file__", str(changed))
    closure = dataclasses.replace(INTERFACE)
    closure.new_group("nodes")
    assert filled == [closure]


@pytest.mark.parametrize("content", [None, b"", b"BLENDER-v405", "cut"])
def test_without_the_file_it_is_filled(empty_file, filled, monkeypatch, tmp_path, content):
    file = tmp_path / "closures.blend"
    if content is not None:
        file.write_bytes(template.SHIPPED.read_bytes()[:4000] if content == "cut" else content)
    monkeypatch.setattr(template, "SHIPPED", file)
    group = SHUTTER.new_group("nodes")
    assert filled == [SHUTTER]
    assert SHUTTER.is_present(group) and not bpy.data.libraries


def test_a_twin_that_is_in_no_file_is_filled(empty_file, filled):
    space = {"__name__": "of_no_file"}
    exec("def twin(sheet):\n    sheet.frame('A')\n    sheet.end(sheet.node('ShaderNodeBsdfDiffuse', 'D'))", space)
    closure = dataclasses.replace(SHUTTER, twin=space["twin"])
    for _ in range(2):
        closure.new_group("nodes")
    assert filled == [closure]

# SPDX-License-Identifier: GPL-3.0-or-later
"""What all closures have in common: a node group whose sockets carry ranges and tooltips, with the optics in OSL or in nodes.

All materials of a file share one group for each backend. It says in custom properties whose it is and which form it was
filled with, so that files of earlier versions can be brought up to date; materials keep what they set and linked.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import secrets
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy

from .. import nodes
from . import formulas, script, template
from .backends import resolve
from .formulas import Sheet

# The custom property that holds which form of sockets and optics a group was filled with; what has none is of the first.
VERSION_MARK = "nim_version"
HANDLE = "nim_handle"  # of a node that the twin names, for handles() to find


class Socket(NamedTuple):
    """An input of the group: `identifier` is the shader's parameter, the rest what a person sees.

    since: the version whose groups were the first to have it; those of earlier ones are read without it
    """

    identifier: str
    name: str
    type: str
    default: Any
    min: float | None
    max: float | None
    description: str
    hide_value: bool = False  # of what only a link can give
    since: int = 1


class Output(NamedTuple):
    """An output of the group: `identifier` is the shader's output parameter, the rest what a person sees."""

    identifier: str
    name: str
    type: str


BSDF = Output("BSDF", "BSDF", "NodeSocketShader")
EEVEE = Output("EEVEE", "EEVEE", "NodeSocketShader")  # of the preview, for a material's output of that engine


@dataclass(frozen=True, eq=False)
class Closure:
    """A way in which a surface bends or mirrors light; or, with other outputs, what a shader knows for others.

    shader:    of osl/, without .osl; the custom property that holds a group's backend has the same name
    label:     what a person reads on its nodes
    sockets:   of its groups, with the labels, ranges and texts of the shader's metadata
    version:   to be raised with every change to the sockets, the shader or the twin: versions.update() mends older files
    twin:      function(sheet) that writes the same formulas on the formulas.Sheet of a group; build() returns what it does
    heart:     type of a node without which the twin is not whole
    outputs:   of its groups; the BSDF where nothing is said
    preview:   function(sheet) that writes what EEVEE shows, the last output then, and returns it; the twin writes it by itself
    """

    shader: str
    label: str
    sockets: tuple[Socket, ...]
    version: int
    twin: Callable[[Sheet], Any]
    heart: str
    outputs: tuple[Output, ...] = (BSDF,)
    preview: Callable[[Sheet], formulas.Value] | None = None

    # -------------------------------------------------------------------------------------------- its groups

    def group_name(self, backend: str) -> str:
        """What a group of that backend, "osl" or "nodes", is called."""
        return self.label if backend == "osl" else f"{self.label} (nodes)"

    def is_of(self, tree: bpy.types.NodeTree | None) -> bool:
        """Whether a node tree is a shader's and says that it is a shared group of this closure, whole or not."""
        # the first version knew no nodes, and marked its groups with a 1
        return tree is not None and tree.bl_idname == "ShaderNodeTree" and tree.get(self.shader) in ("osl", "nodes", 1)

    def is_node(self, node: bpy.types.Node) -> bool:
        """Whether a node is one of this closure: it holds a group of it, and the numbers that describe it."""
        return node.type == "GROUP" and self.is_of(node.node_tree) and self._numbers.issubset(node.inputs.keys())

    @functools.cached_property  # since panels ask while they are drawn
    def _numbers(self):
        return {socket.name for socket in self.sockets if socket.type == "NodeSocketFloat" and socket.since == 1}

    def backend_of(self, group: bpy.types.NodeTree) -> str:
        """The backend, "osl" or "nodes", of a group that is_of() this closure."""
        return "nodes" if group[self.shader] == "nodes" else "osl"

    def is_present(self, group: bpy.types.NodeTree) -> bool:
        """Whether a group that is_of() this closure is of this version, and has the sockets and the optics of it."""
        sockets = {(item.in_out, item.name): item.socket_type for item in _items(group)}
        wanted = {("INPUT", socket.name): socket.type for socket in self.sockets}
        wanted |= {("OUTPUT", output.name): output.type for output in self.outputs}
        heart = "SCRIPT" if self.backend_of(group) == "osl" else self.heart
        return (
            version_of(group) == self.version
            and wanted.items() <= sockets.items()
            and any(node.type == heart for node in group.nodes)
            and any(node.type == "GROUP_OUTPUT" and self._feeds(node) for node in group.nodes)
        )

    def _feeds(self, leave):
        return all(leave.inputs[output.name].is_linked for output in self.outputs)

    def group(self, backend: str = "auto") -> bpy.types.NodeTree:
        """The node group of that backend in this file, made on first use; every material shares it.

        One that is of an earlier version, or that was emptied, is filled anew in place; one of a later version is not
        ours to touch, and one is made beside it. Raises as backends.resolve() does.
        """
        backend = resolve(backend)
        ours = (g for g in bpy.data.node_groups if self.is_of(g) and self.backend_of(g) == backend and not g.library)
        group = next((g for g in ours if version_of(g) <= self.version), None)
        if group is None:
            group = self.new_group(backend)
        elif not self.is_present(group):
            self.refill(group)
        if backend == "osl":
            script.update(group, self.shader, self.source())
        return group

    def new_group(self, backend: str) -> bpy.types.NodeTree:
        """A further group of that backend, "osl" or "nodes", whose shader is not compiled yet."""
        if backend == "osl":
            return self.filled(backend)
        group = template.load(self.made_of, self.group_name(backend))
        if group is None:
            group = self.filled(backend)
            template.keep(self.made_of, group)
        return group

    def filled(self, backend: str) -> bpy.types.NodeTree:
        """A further group of that backend, filled node by node; the shader of "osl" is not compiled yet."""
        group = bpy.data.node_groups.new(self.group_name(backend), "ShaderNodeTree")
        self._fill(group, backend)
        return group

    @functools.cached_property
    def made_of(self) -> str:
        """What its groups in nodes are made of, as a hash: their sockets, the twin's module, and how formulas become nodes."""
        facts = repr((self.shader, self.label, self.sockets, self.version, self.outputs))
        written = hashlib.sha256(facts.encode())
        try:
            twins = {sys.modules[writer.__module__]: None for writer in (self.twin, self.preview) if writer}
            for module in (*twins, formulas, nodes):
                written.update(inspect.getsource(module).encode())
        except (OSError, TypeError, KeyError):  # of a twin that is in no file: of this process alone
            return secrets.token_hex()[:60]
        return written.hexdigest()[:60]

    def new_copy(self, name: str) -> bpy.types.NodeTree:
        """A group in nodes of that name that is none of this closure's, for others to change; see handles()."""
        group = self.new_group("nodes")
        del group[self.shader], group[VERSION_MARK]
        group.name = name
        return group

    def refill(self, group: bpy.types.NodeTree) -> None:
        """Give a group that is_of() this closure its present form; what materials set and linked there stays.

        The shader is compiled only if it is another one. Raises RuntimeError where that cannot be, in a Blender without OSL.
        """
        backend = self.backend_of(group)
        compiled = script.compiled_in(group)
        had = {(item.name, item.socket_type) for item in _items(group) if item.in_out == "INPUT"}
        self._fill(group, backend)
        if backend == "osl":
            script.restore(group, compiled)
            script.update(group, self.shader, self.source())
        # a socket that is new stands at 0 in the nodes that were there before it
        new = [socket for socket in self.sockets if (socket.name, socket.type) not in had]
        for node in _users(group) if new else ():
            for socket in new:
                node.inputs[socket.name].default_value = socket.default

    def _fill(self, group, backend):
        group[self.shader], group[VERSION_MARK] = backend, self.version
        self.build(group, backend)

    def build(self, group: bpy.types.NodeTree, backend: str) -> Any:
        """Give a node group the sockets and the optics of this closure, without a mark that it is one of its groups.

        Sockets that it has are kept, found by name, and with them what every material set or linked there.
        Returns what the twin does, or None for "osl".
        """
        self._give_sockets(group)
        group.nodes.clear()
        sheet = Sheet(group, {socket.identifier: socket.name for socket in self.sockets})
        if backend == "osl":
            of_shader = self.outputs[:-1] if self.preview else self.outputs
            script.fill(group, self.shader, self.sockets, of_shader)
            if self.preview:
                sheet.end(self.preview(sheet), first=len(of_shader))
            return None
        made = self.twin(sheet)
        for name, node in made._asdict().items() if made else ():
            node[HANDLE] = name
        return made

    def _give_sockets(self, group):
        types = {item.name: item.type for item in (*self.sockets, *self.outputs)}
        for item in _items(group):  # another one of that name
            if types.get(item.name, item.socket_type) != item.socket_type:
                group.interface.remove(item)
        kept = {(item.in_out, item.name): item for item in _items(group)}
        wanted = [*(("OUTPUT", output) for output in self.outputs), *(("INPUT", socket) for socket in self.sockets)]
        # a preview comes last: Blender numbers sockets as they come, and keeps values of nodes by these numbers
        first = len(self.outputs) - bool(self.preview)
        for in_out, socket in wanted[:first] + wanted[len(self.outputs) :] + wanted[first : len(self.outputs)]:
            if (in_out, socket.name) not in kept:
                kept[in_out, socket.name] = group.interface.new_socket(
                    socket.name, in_out=in_out, socket_type=socket.type
                )
        for socket in self.sockets:
            item = kept["INPUT", socket.name]
            item.description = socket.description
            item.default_value = socket.default
            if socket.min is not None:
                item.min_value, item.max_value = socket.min, socket.max
            item.hide_value = socket.hide_value
        for place, (in_out, socket) in enumerate(wanted):
            if kept[in_out, socket.name].index != place:
                group.interface.move(kept[in_out, socket.name], place)

    # -------------------------------------------------------------------------------------------- its shader and its nodes

    def source(self) -> str:
        """The text of its shader."""
        return script.source(self.shader)

    def needs_compiling(self, group: bpy.types.NodeTree) -> bool:
        """Whether a group that is_of() this closure, of the backend "osl", holds another shader than the present one."""
        node = script.script_of(group)
        return not (node and node.script and node.script.as_string() == self.source())

    def new_node(self, tree: bpy.types.NodeTree, backend: str = "auto") -> bpy.types.Node:
        """A new node of this closure in a shader's tree, unlinked. Raises as backends.resolve() does; nothing is made then."""
        group = self.group(backend)
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        node.name = node.label = self.label
        node.width = 220
        return node

    def nodes_of(self, material: bpy.types.Material | None) -> list[bpy.types.Node]:
        """The nodes of this closure in a material (or None), those of a group within a group not counted."""
        nodes = material.node_tree.nodes if material and material.node_tree else ()
        return [node for node in nodes if self.is_node(node)]

    def switch(self, material: bpy.types.Material, backend: str) -> int:
        """Give every node of this closure in a material the group of another backend; values and links stay.

        Returns how many nodes there were. Raises as backends.resolve() does.
        """
        group = self.group(backend)
        nodes = self.nodes_of(material)
        for node in nodes:
            node.node_tree = group
        return len(nodes)


def handles(group: bpy.types.NodeTree) -> dict[str, bpy.types.Node]:
    """The nodes of a group in nodes that its closure's twin names, by their names."""
    return {node[HANDLE]: node for node in group.nodes if HANDLE in node}


def version_of(group: bpy.types.NodeTree) -> int:
    """The version of a closure's group; 0 where what stands there is no version."""
    version = group.get(VERSION_MARK, 1)
    return version if isinstance(version, int) else 0


def _items(group):
    return [item for item in group.interface.items_tree if item.item_type == "SOCKET"]


def _users(group):
    trees = [*bpy.data.node_groups, *(material.node_tree for material in bpy.data.materials if material.node_tree)]
    return [node for tree in trees for node in tree.nodes if node.type == "GROUP" and node.node_tree == group]

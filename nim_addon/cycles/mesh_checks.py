# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the meshes that wear an interface: holes and normals, and the mending of them."""

from typing import NamedTuple

import bpy  # noqa: F401

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
import numpy as np

from .problem import Problem, about, own_data
from .sight import Sight


class Surface(NamedTuple):
    """What a mesh's faces enclose: are they closed, do neighbours agree on a side, and is that side the outer one?"""

    closed: bool
    agreeing: bool
    outward: bool


def find(sight: Sight) -> list[Problem]:
    """The Problems of the meshes that wear an interface."""
    found = []
    for one, worn in _wearers(sight).items():
        shape = sight.measured(one, "surface", surface)
        if shape is None:
            continue
        thing = one.original
        materials = tuple(sorted(material.name for material in worn))
        if shape.closed and not (shape.agreeing and shape.outward):
            text = "The normals of {name} point inwards, so that inside and outside are exchanged."
            if not shape.agreeing:
                text = "The normals of {name} do not agree, so that inside and outside are exchanged here and there."
            own = _own_surface(thing, shape)
            modified = own.agreeing and own.outward
            found.append(about(thing, "normals", text, "Turn them out", materials, modified))
        filled = tuple(sorted(material.name for material in worn if _has_volume(material)))
        if filled and not shape.closed:
            text = "{name} has holes, but its material has a volume, which then has no end."
            modified = _own_surface(thing, shape).closed
            found.append(about(thing, "open_volume", text, "Close the holes", filled, modified))
    return found


def _wearers(sight):
    """{Shown: the interface materials that it wears}, each object of the file once."""
    first, worn = {}, {}
    for material, those in sight.worn.items():
        for one in those:
            one = first.setdefault(one.original, one)
            if material not in worn.setdefault(one, []):
                worn[one].append(material)
    return worn


def surface(mesh):
    """The Surface of a bpy.types.Mesh: closed where each edge has two faces, outward where it encloses a volume > 0."""
    corners = len(mesh.loops)
    if not corners:
        return Surface(False, True, True)
    edge, vertex = np.empty(corners, np.int32), np.empty(corners, np.int32)
    mesh.loops.foreach_get("edge_index", edge)
    mesh.loops.foreach_get("vertex_index", vertex)
    ends = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    faces = np.bincount(edge, minlength=len(ends))
    # two faces that agree run along their common edge in opposite directions
    forward = np.bincount(edge, weights=vertex == ends[edge, 0], minlength=len(ends))
    used = faces > 0
    closed = bool(np.all(faces[used] == 2))
    agreeing = bool(np.all(forward[faces == 2] == 1))
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    mesh.calc_loop_triangles()
    triangles = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    a, b, c = np.moveaxis((points - points.mean(axis=0)).astype(float)[triangles], 1, 0)
    return Surface(closed, agreeing, bool(np.sum(a * np.cross(b, c)) >= 0))


def _own_surface(thing, shape):
    """The Surface of a mesh object without its modifiers; `shape`: the one with them."""
    return surface(thing.data) if thing.modifiers else shape


def _has_volume(material):
    output = material.node_tree.get_output_node("CYCLES")
    return output is not None and output.inputs["Volume"].is_linked


def _turn_out(scene, problem):
    for mesh in own_data(problem):
        if not surface(mesh).agreeing:
            with _Edited(mesh) as shape:
                bmesh.ops.recalc_face_normals(shape, faces=shape.faces)
        # only where it is still inside out: two objects may share it, and the first has turned it
        if not surface(mesh).outward:
            mesh.flip_normals()
            mesh.update()


def _close(scene, problem):
    for mesh in own_data(problem):
        with _Edited(mesh) as shape:
            bmesh.ops.holes_fill(shape, edges=[edge for edge in shape.edges if edge.is_boundary], sides=0)
            bmesh.ops.recalc_face_normals(shape, faces=shape.faces)


class _Edited:
    """A mesh as a bmesh, written back at the end."""

    def __init__(self, mesh):
        self.mesh = mesh

    def __enter__(self):
        self.shape = bmesh.new()
        self.shape.from_mesh(self.mesh)
        return self.shape

    def __exit__(self, *error):
        if error[0] is None:
            self.shape.to_mesh(self.mesh)
            self.mesh.update()
        self.shape.free()


MENDS = {"normals": _turn_out, "open_volume": _close}

# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of balls, boxes and sheets that wear an interface, and what the checks say of them."""

import bpy

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
from mathutils import Matrix

from nim_addon import checks
from nim_addon.checks.solids import Solid
from nim_addon.cycles.material import interface_material
from nim_addon.physics import MEDIA, Medium
from nim_addon.scenes import shapes

NIM, AIR, WATER, GLASS = Medium(-1.5), MEDIA["air"], MEDIA["water"], MEDIA["glass"]


def ball(radius, at=(0, 0, 0), segments=32, inwards=False):
    return "uvsphere", {"u_segments": segments, "v_segments": segments // 2, "radius": radius}, at, inwards


def box(size, at=(0, 0, 0), inwards=False):
    return "cube", {"size": size}, at, inwards


def sheet(size, at=(0, 0, 0), inwards=False):
    return "grid", {"x_segments": 4, "y_segments": 4, "size": size}, at, inwards


MONKEY = ("monkey", {}, (0, 0, 0), False)
CUP = [(0, 0), (1, 0), (1, 2), (0.9, 2), (0.9, 0.1), (0, 0.1)]


def mesh_of(*pieces, split=False, without=0):
    """A mesh of pieces; each face with vertices of its own if `split`; the first faces left out."""
    shape = bmesh.new()
    for primitive, sizes, at, inwards in pieces:
        before = set(shape.faces)
        operator = (
            f"create_{primitive}"  # bmesh.ops keeps no more than a pointer to the name, which must outlive the call
        )
        getattr(bmesh.ops, operator)(shape, matrix=Matrix.Translation(at), **sizes)
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
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def found(scene):
    """The Problems of a scene as it is now."""
    bpy.context.view_layer.update()
    return checks.problems(scene)


def codes(scene):
    """Those of the Problems of a scene as it is now."""
    return [problem.code for problem in found(scene)]


def volumes(obj):
    """Those of an object's parts, with their signs."""
    return [part.volume for part in Solid(obj.data).parts]


def turned(name, medium, profile):
    """An object with the surface that a profile (r, z) leaves as it turns about the axis."""
    vertices, faces, _ = shapes.revolve(profile, 64)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    return add(name, medium, mesh=mesh)

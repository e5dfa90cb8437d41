# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of light paths share: interfaces to be met, and the drawn pieces read back."""

import bpy
import numpy as np

from nim_addon.cycles.material import interface_material
from nim_addon.cycles.visibility import PATHS_MARK
from nim_addon.physics import Medium
from nim_addon.scenes import shapes, surfaces


def add(name, vertices, faces, material, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(vertices).tolist(), [], faces)
    mesh.materials.append(material)
    if smooth:
        mesh.shade_smooth()
    object_ = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(object_)
    return object_


def add_interface(n, mesh, smooth=False):
    return add("NIM", *mesh, interface_material("NIM", Medium(n), backend="nodes"), smooth)


def add_floor(z):
    return add("Floor", *shapes.rectangle((-50, -50), (50, 50), z), surfaces.plain("Floor", (0.5, 0.5, 0.5)))


def drawn(kind, scene=None):
    """Start and end (S, 2, 3) and radius (S,) of the drawn pieces of a Kind, in the order they were drawn."""
    ends, radius = [], []
    for object_ in (scene or bpy.context.scene).objects:
        if object_.get(PATHS_MARK) and object_.data.materials[0][PATHS_MARK] == kind.name:
            assert object_.type == "CURVE"
            for spline in object_.data.splines:
                assert len(spline.points) == 2
                ends.append([point.co[:3] for point in spline.points])
                radius.append(spline.points[0].radius)
    return np.array(ends).reshape(-1, 2, 3), np.array(radius)


def direction(ends):
    along = ends[:, 1] - ends[:, 0]
    return along / np.linalg.norm(along, axis=1, keepdims=True)

# SPDX-License-Identifier: GPL-3.0-or-later
"""A narrow beam onto an object that may be moved, turned and scaled, and where and how much of it lands on a floor beyond."""

import bpy
import mathutils
import numpy as np

from nim_addon.cycles import settings
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.render import pixels_of

OFFSET = 64.0  # added to what the floor tells, so that what glows is positive
ACROSS = 12  # pixels of the beam
SAMPLES = 64


def body(vertices, faces, material, matrix):
    """A mesh of a material that stands where a matrix (4, 4) says."""
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata(np.asarray(vertices, float).tolist(), [], faces)
    mesh.materials.append(material)
    thing = bpy.data.objects.new("Body", mesh)
    bpy.context.scene.collection.objects.link(thing)
    # an object by itself cannot be sheared
    thing.parent = bpy.data.objects.new("Parent", None)
    thing.matrix_parent_inverse = mathutils.Matrix(np.asarray(matrix).tolist())
    return thing


def floor(point, axes, between=(-OFFSET, OFFSET)):
    """A large plane through a point, black but where the first of the two numbers that it tells lies `between` two bounds.

    axes: two unit vectors in it; it glows by (x + OFFSET, y + OFFSET, 1), how far along them it is hit
    """
    point, axes = np.asarray(point, float), np.asarray(axes, float)
    material = bpy.data.materials.new("Floor")
    nodes = Nodes(empty_tree(material))
    away = nodes.vector("SUBTRACT", nodes.add("ShaderNodeNewGeometry").outputs["Position"], point.tolist())
    told = [
        nodes.add("ShaderNodeVectorMath", operation="DOT_PRODUCT", inputs={0: away, 1: axis.tolist()}).outputs["Value"]
        for axis in axes
    ]
    inside = nodes.math(
        "MULTIPLY", nodes.math("GREATER_THAN", told[0], between[0]), nodes.math("LESS_THAN", told[0], between[1])
    )
    x, y = (nodes.math("ADD", number, OFFSET) for number in told)
    color = nodes.add("ShaderNodeCombineXYZ", inputs={0: x, 1: y, 2: 1.0}).outputs[0]
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": color, "Strength": inside}))
    material.cycles.emission_sampling = "NONE"
    corners = [point + OFFSET * (a * axes[0] + b * axes[1]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return body(corners, [(0, 1, 2, 3)], material, np.eye(4))


def landing(target, direction, backend, distance=4.0, width=1e-3):
    """How much of a beam along a unit direction through a target lands on the floor, and where, (2,), in its mean.

    And the standard error of how much: each pixel is an estimate of its own.
    """
    scene = bpy.context.scene
    settings.lossless(scene, backend)
    scene.cycles.samples, scene.cycles.pixel_filter_type, scene.cycles.seed = SAMPLES, "BOX", 1
    world = scene.world = bpy.data.worlds.new("Dark")
    nodes = Nodes(empty_tree(world))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": (0, 0, 0)}), "World")
    data = bpy.data.cameras.new("Beam")
    data.type, data.ortho_scale, data.clip_start = "ORTHO", width, 1e-3
    camera = scene.camera = bpy.data.objects.new("Beam", data)
    scene.collection.objects.link(camera)
    d = mathutils.Vector(direction)
    camera.matrix_world = mathutils.Matrix.Translation(mathutils.Vector(target) - distance * d) @ (
        d.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    )
    scene.render.resolution_x = scene.render.resolution_y = ACROSS
    scene.render.resolution_percentage = 100
    pixels = pixels_of(scene).reshape(-1, 3).astype(float)
    x, y, share = pixels.mean(axis=0)
    error = (
        max(pixels[:, 2].std(ddof=1), 12**-0.5 / SAMPLES) / ACROSS
    )  # pixels count whole paths, and are rounded to them
    return share, np.array([x, y]) / max(share, 1e-12) - OFFSET, error


def pose(angles=(0.0, 0.0, 0.0), scale=(1.0, 1.0, 1.0), place=(0.0, 0.0, 0.0)):
    """The matrix (4, 4) of an object turned by Euler angles, scaled along its own axes, and moved."""
    return np.array(mathutils.Matrix.LocRotScale(place, mathutils.Euler(angles), scale))

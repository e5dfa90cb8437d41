# SPDX-License-Identifier: GPL-3.0-or-later
"""A straw in a glass on a table, with or without a liquid in it (thesis figures 5.1, 5.2 and 5.5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles import absorption, meshes
from ..cycles.material import interface_material, interface_nodes
from ..physics import MEDIA, Medium
from . import mesh_files, shapes, surfaces
from .parameters import Parameters, choice, liquid, mesh_file, number, switch
from .stage import Pose, Stage, staged

SIZE = (720, 720)  # pixels of its picture, where nothing else is asked for
# Lengths in metres. The glass is a tumbler: walls of 2.5 mm, a rounded rim, a base of 10 mm with rounded edges.
RADIUS, HEIGHT, WALL, BASE = 0.040, 0.130, 0.0025, 0.010
FOOT_EDGE, INNER_EDGE = 0.002, 0.006
LEVEL = 0.086
SEGMENTS = 240  # leaves 3 um between a facet and the circle

# The body of what a liquid absorbs reaches so far into the glass and the air: much more than rays are rounded, and next
# to nothing of their way.
SKIN = 2e-6

# As wide as nothing: keeps two surfaces that would touch apart.
GAP = 0.0001

# The straw stands on the inner base and leans on the rim, GAP from either.
STRAW_RADIUS, STRAW_WALL, STRAW_LENGTH = 0.0035, 0.0004, 0.200
STRAW_FOOT = 0.0255  # x of its lower end, y = 0; it leans towards -x

# Where each statue stands, its turn in degrees and its colour.
STATUE_SIZE = 0.06
STATUES = {
    "Green": ((0.010, 0.120, 0), 30, (0.03, 0.42, 0.05)),
    "Red": ((-0.076, -0.050, 0), 20, (0.66, 0.03, 0.02)),
    "Blue": ((0.076, -0.050, 0), -20, (0.02, 0.09, 0.62)),
}
TABLE_RADIUS = 0.80

# The sky's strength; towards the sun in it, a Gaussian, and its irradiance across its rays, whatever its width.
SKY = 1.4
TOWARDS_SUN, SUN_IRRADIANCE = (-0.55, 0.30, 0.78), (3.748, 3.467, 2.998)

VIEWS = {
    "side": "From the side, through the wall of the glass",
    "top": "From above, into the glass",
}
FIGURES = {"none": "No figures", "monkey": "Blender's monkey, three times, in three colors"}


@dataclass(frozen=True)
class GlassParameters(Parameters):
    """Parameters of the glass scene."""

    liquid: Medium | None = liquid(MEDIA["nim"], "what fills the glass: none, water, nim or any medium")
    view: str = choice("side", "where the camera looks from", VIEWS)
    straw: bool = switch(True, "the straw in the glass")
    figures: str = mesh_file(
        "none", "three small statues around the glass: Blender's monkey or a mesh of your own", FIGURES
    )
    sun_angle: float = number(24.0, "width of the sun; its light stays the same", 0.25, 30.0, "degrees")


@staged(GlassParameters)
def build(parameters: GlassParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from GlassParameters; returns the bpy.types.Scene. Glass on the z axis, table at z = 0, metres.

    Raises ValueError, before anything is built, where the file that `figures` names holds no mesh.
    """
    statue = None if parameters.figures == "none" else statue_mesh(parameters.figures)
    stage = Stage("glass", SIZE, backend)
    # a round table: its edge is as far away to the side, where the glass shows it too, as behind
    table = surfaces.checker("Table", (0.62, 0.37, 0.17), (0.12, 0.05, 0.022), 0.020)
    stage.mesh("Table", *shapes.revolve([(TABLE_RADIUS, 0), (0, 0)], 256)[:2], table)
    glass(stage, parameters.liquid, immersed=parameters.straw)
    if parameters.straw:
        straw(stage)
    if statue is not None:
        statues(stage, statue, subdivide=parameters.figures == "monkey")
    stage.world(
        surfaces.sky(
            "Studio",
            (0.95, 0.93, 0.90),
            (0.30, 0.45, 0.75),
            strength=SKY,
            ground=(0.24, 0.31, 0.38),
            glow=surfaces.sun(TOWARDS_SUN, np.divide(SUN_IRRADIANCE, SKY), parameters.sun_angle),
        ),
        aim=256,
    )
    stage.camera(*pose(parameters))
    return stage.scene


def pose(parameters: GlassParameters) -> Pose:
    """The Pose of the camera for GlassParameters."""
    # the angle counts across the height, so that a wide picture cuts off neither straw nor table
    if parameters.view == "top":
        return Pose((0, -0.20, 0.60), (0, -0.004, 0.05), 18, "VERTICAL")
    # above the level by 11 degrees: enough to see into the liquid through the wall and, in a NIM, up to its surface
    aim, angle = (0.084, 17) if parameters.figures == "none" else (0.074, 18.5)
    return Pose((0, -0.80, 0.240), (0, 0, aim), angle, "VERTICAL")


def glass_profile() -> tuple[NDArray, NDArray]:
    """Profile of the glass for shapes.revolve: points (N, 2) and unit normals (N, 2), radius and height in metres.

    It runs from the axis out under the foot, up the outer wall, over the rim and down to the axis again, so the glass
    lies to its left. Corners are arcs, so that one normal a point will do; one point is at the level of the liquid.
    """
    inner, lip = RADIUS - WALL, WALL / 2
    foot = shapes.arc((RADIUS - FOOT_EDGE, FOOT_EDGE), FOOT_EDGE, -90, 0, 8)
    rim = shapes.arc((RADIUS - lip, HEIGHT - lip), lip, 0, 180, 16)
    corner = shapes.arc((inner - INNER_EDGE, BASE + INNER_EDGE), INNER_EDGE, 0, -90, 12)
    points = np.concatenate([[(0, 0)], foot, rim, [(inner, LEVEL)], corner, [(0, BASE)]])
    turns = np.radians(
        np.concatenate([[-90], np.linspace(-90, 0, 9), np.linspace(0, 180, 17), [180], np.linspace(180, 90, 13), [90]])
    )
    return points, np.stack([np.cos(turns), np.sin(turns)], axis=-1)


def glass(stage: Stage, filling: Medium | None, immersed: bool = False) -> bpy.types.Object:
    """The glass, and the liquid (a Medium, or None) in it, as one mesh; returns the object.

    Each of its materials stands between the two media that meet there. The faces of the glass point out of the glass,
    into the air or the liquid; those of the liquid's surface point up. Liquid and wall share the ring where they meet,
    so that there is neither gap nor overlap.
    immersed: whether something stands in the liquid. What that absorbs is then a body of its own; otherwise the faces
              take it from light that comes to them
    """
    profile, profile_normals = glass_profile()
    vertices, faces, origin = shapes.revolve(profile, SEGMENTS)
    heading = vertices[:, :2] / np.maximum(np.linalg.norm(vertices[:, :2], axis=1, keepdims=True), 1e-12)
    # a point on the axis is one vertex, any other a ring of them
    normals = np.repeat(profile_normals, np.where(profile[:, 0] > 0, SEGMENTS, 1), axis=0)
    normals = np.column_stack([normals[:, :1] * heading, normals[:, 1]])
    corner_normals = normals[np.concatenate(faces)]
    material = MEDIA["glass"]
    materials = [interface_material("Glass to air", material, backend=stage.backend)]
    slots = np.zeros(len(faces), int)
    ring = []
    if filling is not None:
        materials.append(interface_material("Glass to liquid", material, filling, backend=stage.backend))
        materials.append(interface_material("Liquid to air", filling, backend=stage.backend))
        if immersed and absorption.absorbs(filling):
            for wetted in materials[1:]:
                (node,) = interface_nodes(wetted)
                absorption.leave_to_volume(node, "Inside", "Outside")
            _absorbing_body(stage, filling, profile, profile_normals)
        ring = np.flatnonzero(vertices[:, 2] == LEVEL)
        surface = [(int(a), int(b), len(vertices)) for a, b in zip(ring, np.roll(ring, -1), strict=True)]
        vertices = np.vstack([vertices, (0, 0, LEVEL)])
        faces = [*faces, *surface]
        wet = origin >= np.flatnonzero(profile[:, 1] == LEVEL)[0]
        slots = np.concatenate([wet, np.full(len(surface), 2)])
        corner_normals = np.vstack([corner_normals, np.tile((0.0, 0.0, 1.0), (3 * len(surface), 1))])
    object_ = stage.mesh("Glass", vertices, faces, materials, slots=slots, normals=corner_normals, location=(0, 0, GAP))
    # Cycles keeps the normals on the two sides of an edge apart only where the edge is marked sharp.
    edges = meshes.read(object_.data.edges, "vertices", 2, np.int32)
    object_.data.edges.foreach_set("use_edge_sharp", np.isin(edges, ring).all(axis=1))
    return object_


def _absorbing_body(stage, filling, profile, profile_normals):
    """What the liquid absorbs, as a closed body without a surface, SKIN beyond the liquid all around."""
    wet = slice(int(np.flatnonzero(profile[:, 1] == LEVEL)[0]), None)
    wall = profile[wet] - SKIN * profile_normals[wet]  # into the glass
    # up the wall, so that the faces point out of the liquid
    outline = np.concatenate([wall[::-1], [(wall[0, 0], LEVEL + SKIN), (0, LEVEL + SKIN)]])
    outline[[0, -1], 0] = 0.0  # exactly on the axis
    body = shapes.revolve(outline, SEGMENTS)[:2]
    stage.mesh("Liquid", *body, absorption.volume_material("In the liquid", filling), location=(0, 0, GAP))


def straw_pose() -> tuple[NDArray, float]:
    """Lower end of the straw's axis (3,), in metres, and its tilt from the vertical, in radians."""
    rim = np.array([-(RADIUS - WALL / 2), HEIGHT - WALL / 2])
    reach = STRAW_RADIUS + WALL / 2 + GAP
    tilt = 0.0
    for _ in range(20):  # the foot rises as the straw tilts: settles to 1e-12 in a few steps
        foot = np.array([STRAW_FOOT, BASE + GAP + STRAW_RADIUS * math.sin(tilt)])
        x, z = rim - foot
        tilt = math.atan2(-x, z) - math.asin(reach / math.hypot(x, z))
    return np.array([foot[0], 0.0, foot[1] + GAP]), tilt


def straw(stage: Stage) -> bpy.types.Object:
    """The straw: an opaque, striped tube with a wall; returns the object. Its own z axis runs along it, foot at 0."""
    start, tilt = straw_pose()
    tube = shapes.tube((0, 0, 0), (0, 0, STRAW_LENGTH), STRAW_RADIUS, 128, STRAW_RADIUS - STRAW_WALL)
    paint = surfaces.spiral("Straw", (0.82, 0.80, 0.76), (0.62, 0.03, 0.03), 0.018)
    object_ = stage.mesh("Straw", *tube, paint, location=start)
    object_.rotation_euler = (0, -tilt, 0)
    return object_


def statues(stage: Stage, mesh: bpy.types.Mesh, subdivide: bool = False) -> None:
    """Three objects around the glass that share `mesh`: green behind, red and blue in front (thesis figure 5.5)."""
    mesh.name = "Statue"  # free now that the scene before this one is gone
    mesh.materials.append(None)  # each object brings its own
    for name, (place, turn, color) in STATUES.items():
        object_ = stage.object(name, mesh, place)
        object_.rotation_euler = (0, 0, math.radians(turn))
        slot = object_.material_slots[0]
        slot.link, slot.material = "OBJECT", surfaces.plain(name, color)
        if subdivide:
            object_.modifiers.new("Subdivide", "SUBSURF").render_levels = 2


def statue_mesh(source: str) -> bpy.types.Mesh:
    """A new bpy.types.Mesh of "monkey", or of the mesh file at that path, STATUE_SIZE in its longest extent.

    It stands on z = 0, centred on the z axis, turned as Blender's own importer turns it. Raises ValueError, and leaves
    nothing behind, where the file holds no mesh.
    """
    mesh = _monkey() if source == "monkey" else _of_file(source)
    points = meshes.vertices(mesh).astype(float)
    low, high = points.min(axis=0), points.max(axis=0)
    foot = (*(low + high)[:2] / 2, low[2])
    mesh.vertices.foreach_set("co", ((points - foot) * (STATUE_SIZE / (high - low).max())).astype(np.float32).ravel())
    mesh.shade_smooth()
    if source != "monkey":
        mesh.set_sharp_from_angle(angle=math.radians(40))
    return mesh


def _monkey():
    solid = bmesh.new()
    bmesh.ops.create_monkey(solid)
    mesh = bpy.data.meshes.new("Statue")
    solid.to_mesh(mesh)
    solid.free()
    return mesh


def _of_file(source):
    try:
        read = mesh_files.read(source)
    except (OSError, ValueError, MemoryError) as error:
        reason = getattr(error, "strerror", None) or str(error) or "there is not enough memory"
        raise ValueError(
            f"figures: there is no mesh to be read in {source!r}, as {reason}; "
            "give a PLY, OBJ or STL file that has faces, or monkey, or none."
        ) from None
    # Blender's numbers are short: of a mesh that is far away, or a speck, they would keep little
    points = (read.vertices - read.vertices.min(axis=0)) / np.ptp(read.vertices, axis=0).max()
    mesh = bpy.data.meshes.new("Statue")
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(len(read.corners))
    mesh.loops.foreach_set("vertex_index", read.corners.astype(np.int32))
    mesh.polygons.add(len(read.counts))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(read.counts) - read.counts).astype(np.int32))
    mesh.update(calc_edges=True)
    mesh.validate()  # a face that is there twice goes
    return mesh

# SPDX-License-Identifier: GPL-3.0-or-later
"""What a goniometer measures of the closures other than the interface: windows of lenslets, uniaxial slabs, graded balls.

Windows and slabs lie in strips over the floor, as interfaces do. Into a ball one ray is sent: the walls of a box around it
glow with the place that was hit, which must lie on the line on which the equations let the ray leave.
"""

from __future__ import annotations

import math

import bpy
import mathutils
import numpy as np

from ..physics import graded
from ..physics.graded import DEVICES, Profile
from ..physics.lenslet import LensletWindow
from ..physics.uniaxial import UniaxialSlab
from .goniometer import (
    FURNACE_TOLERANCE,
    LANDING_TOLERANCE,
    PITCH,
    SAMPLES,
    Check,
    ball,
    beam,
    glowing_floor,
    landing,
    reflectance,
    rig,
    strip,
    within,
    world,
)
from .graded import graded_ball_material, graded_core_material
from .lenslets import lenslet_material
from .nodes import Nodes, empty_tree
from .render import pixels_of
from .slabs import slab_material

WINDOWS = (
    LensletWindow(-1.0),
    LensletWindow(-1.2),
    LensletWindow(0.8),
    LensletWindow(-0.5, offset=(0.3, 0.0)),
    LensletWindow(2.0, offset=(-0.2, 0.0)),
)
WINDOW_ANGLES = (0.0, 45.0, 75.0)
SLABS = (UniaxialSlab(2.25, 4.0, 0.5), UniaxialSlab(1.5, -3.0, 0.5), UniaxialSlab(4.0, -1.0, 0.5))
SLAB_ANGLES = (20.0, 60.0)
SINES = (0.3, 0.9)  # of angles of incidence on balls
FURNACES = ("luneburg", "magnifier")
LINE_TOLERANCE = 5e-5  # of the radius
SHELL = Profile("magnifier", core=0.5, surface="textured")
CORE_TOLERANCE = 1e-3  # of the radius: how far the facets of the core lie within it
BIAS = 16.0  # added to places, so that what glows with them is positive
WALLS = 6.0  # how far from the middle they stand


def _labels(name, flipped=False):
    return {"incident": "vacuum", "transmitted": name, "signs": "++", "side": "inside" if flipped else "outside"}


# ------------------------------------------------------------------------------------------------ strips


def measure_windows(angle: float, backend: str) -> list[Check]:
    """Where rays land behind WINDOWS of lenslets, from either side, for a beam at an angle in degrees; "osl" or "nodes"."""
    views = [(window, flipped) for window in WINDOWS for flipped in (False, True)]
    blocks = _strips(backend, angle, lenslet_material, views)
    theta, checks = math.radians(angle), []
    for (window, flipped), block in zip(views, blocks, strict=True):
        down = (math.sin(theta), 0, -math.cos(theta))
        x, _, z = window.bend(down, (0, 0, -1 if flipped else 1), (1, 0, 0))
        labels = _labels(f"lenslets {window.eta[0]:g}", flipped)
        checks.append(within("landing", labels, angle, float(-x / z), landing(block, angle), LANDING_TOLERANCE))
    return checks


def measure_uniaxial(angle: float, backend: str) -> list[Check]:
    """What SLABS reflect, and where, in the mean of both polarisations, what passes lands; the same arguments."""
    blocks = _strips(backend, angle, slab_material, [(slab, False) for slab in SLABS])
    theta, checks = math.radians(angle), []
    for slab, block in zip(SLABS, blocks, strict=True):
        labels = _labels(f"uniaxial {slab.across:g}, {slab.along:g}")
        T, shifts = np.array(slab.transmittances(theta)), np.nan_to_num(slab.shifts(theta))
        checks.append(reflectance("R", labels, angle, 1 - float(T.mean()), block[..., 0].ravel()))
        x = math.tan(theta) + float(np.sum(T * shifts) / np.sum(T))
        # which of two rays a path takes is chance: the mean scatters with their distance
        scatter = abs(float(shifts[0] - shifts[1])) / math.sqrt(block[..., 0].size * SAMPLES)
        checks.append(within("landing", labels, angle, x, landing(block, angle), LANDING_TOLERANCE + scatter))
    return checks


def _strips(backend, angle, make, views):
    """Blocks of pixels (ALONG, ACROSS, 3) of a beam on strips of what make() makes of each, flipped or not."""
    with rig(backend) as scene:
        world(scene, (1, 0, 0))
        strip(scene, glowing_floor(), 0, len(views) * PITCH, -1.0)
        for row, (law, flipped) in enumerate(views):
            material = make("NIM strip", law, backend=backend)
            strip(scene, material, row * PITCH, (row + 1) * PITCH, 0.0, flipped)
        beam(scene, angle, len(views))
        return np.split(pixels_of(scene), len(views))


# ------------------------------------------------------------------------------------------------ balls


def measure_ball(device: str, backend: str) -> list[Check]:
    """How far off their lines rays leave a graded ball, one of graded.DEVICES; of FURNACES, that no light is lost."""
    profile, checks = Profile(device), []
    with rig(backend) as scene:
        ball(scene, graded_ball_material("NIM ball", profile, backend=backend), 32)
        _walls(scene)
        for sine in SINES:
            place, start, d = _hit(scene, sine)
            carried = graded.carry(profile, start, d)
            off = float(np.linalg.norm(np.cross(place - carried.points, carried.directions)))
            checks.append(within("line", _labels(device), math.degrees(math.asin(sine)), 0.0, off, LINE_TOLERANCE))
    if device in FURNACES:
        with rig(backend) as scene:
            material = graded_ball_material("NIM furnace", profile, backend=backend)
            checks.append(_furnace(scene, device, [(material, 1.0, 32)]))
    return checks


def measure_core(_, backend: str) -> list[Check]:
    """Where rays land on the core within a SHELL, and that a white one in a white world is not seen."""
    checks, name = [], f"shell of {SHELL.n}"
    with rig(backend) as scene:
        ball(scene, graded_core_material("NIM ball", SHELL, backend=backend), 48)
        ball(scene, _place(), 96, SHELL.core)
        for sine in SINES:
            place, start, d = _hit(scene, sine)
            entry = start + (-start @ d - math.sqrt(1 - sine**2)) * d
            round_ = d - (d @ entry) * entry
            angle = math.atan2(place @ round_ / np.linalg.norm(round_), place @ entry)
            expected = float(graded.landing(SHELL, sine).angle)  # negative in a NIM
            checks.append(
                within("landing", _labels(name), math.degrees(math.asin(sine)), expected, angle, CORE_TOLERANCE)
            )
    with rig(backend) as scene:
        white = _material("ShaderNodeBsdfDiffuse", Color=(1.0, 1.0, 1.0))
        shell = graded_core_material("NIM furnace", SHELL, backend=backend)
        return [*checks, _furnace(scene, name, [(shell, 1.0, 48), (white, SHELL.core, 96)])]


def _furnace(scene, name, balls):
    """The Check that these (material, radius, segments) are not seen in a white world."""
    world(scene, (1, 1, 1))
    for material, radius, segments in balls:
        ball(scene, material, segments, radius)
        scene.collection.objects[-1].data.shade_flat()  # smooth faces of a diffuse ball lose light
    beam(scene, 0.0, 2)
    scene.camera.data.ortho_scale, scene.camera.location = 2.0, (0, 0, 4)
    scene.cycles.samples = 8
    return within("furnace", _labels(name), 0.0, 1.0, float(pixels_of(scene).mean()), FURNACE_TOLERANCE)


def _material(type_, **inputs):
    material = bpy.data.materials.new("NIM wall")
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add(type_, inputs=inputs))
    material.cycles.emission_sampling = "NONE"
    return material


def _place():
    """A material that glows with the place that was hit, and BIAS."""
    material = _material("ShaderNodeEmission")
    nodes = Nodes(material.node_tree)
    place = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    emission = next(node for node in material.node_tree.nodes if node.type == "EMISSION")
    nodes.feed(emission.inputs["Color"], nodes.vector("ADD", place, (BIAS,) * 3))
    return material


def _walls(scene):
    import bmesh

    shape, mesh = bmesh.new(), bpy.data.meshes.new("NIM wall")
    bmesh.ops.create_cube(shape, size=2 * WALLS)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(_place())
    scene.collection.objects.link(bpy.data.objects.new("NIM wall", mesh))


def _hit(scene, sine):
    """The place (3,) where a ray ends that passes the origin at that distance; where it starts, and its direction."""
    beam(scene, 0.0, 1)
    data, camera = scene.camera.data, scene.camera
    data.ortho_scale = 1e-8  # all of it is one ray
    d = np.array((0.48, -0.6, 0.64))
    across = np.cross(d, (0.1, 0.7, 0.4))
    start = sine * across / np.linalg.norm(across) - 3 * d
    turn = mathutils.Vector(d).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.matrix_world = mathutils.Matrix.Translation(start) @ turn
    frame = np.array(camera.matrix_world)  # of single precision
    scene.render.resolution_x = scene.render.resolution_y = 2
    scene.cycles.samples = 4
    return pixels_of(scene).reshape(-1, 3).mean(axis=0) - BIAS, frame[:3, 3], -frame[:3, 2]


# What verify() does of it: functions of an argument and the backend, and the arguments.
STEPS = [
    *((measure_windows, angle) for angle in WINDOW_ANGLES),
    *((measure_uniaxial, angle) for angle in SLAB_ANGLES),
    *((measure_ball, device) for device in DEVICES),
    (measure_core, None),
]

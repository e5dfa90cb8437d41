# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded balls and windows of lenslets beside Blender's own Glass, both backends, and beside shells of our own interface.

Alternating, without set-up, in a white world: a ball that fills the picture, or a plate that does; prints ratios. The error is
that of the line on which a ray leaves a Luneburg ball, where it meets walls six radii away: the median over rays.
"""

import math
import statistics
import time

import bpy
import mathutils
import numpy as np

from nim_addon.base.streams import quiet
from nim_addon.cycles.graded import graded_ball_material
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.render import pixels_of
from nim_addon.physics import Medium, graded
from nim_addon.physics.graded import Profile
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage

ROUNDS = 7
SIZE, SAMPLES = 128, 128
SHELLS = (32, 128)
SINES = np.linspace(0.05, 0.95, 13)
WALLS, BIAS = 6.0, 16.0
LUNEBURG = Profile("luneburg")


def glass():
    """Blender's own glass of index 1.5, mirror-smooth."""
    material = bpy.data.materials.new("Glass")
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs={"IOR": 1.5, "Roughness": 0.0}))
    return material


def round_mesh(radius, segments):
    """A smooth ball."""
    import bmesh  # there once bpy is

    mesh, shape = bpy.data.meshes.new("Ball"), bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=radius)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    return mesh


def stage_of(things, backend):
    """A stage in a white world of meshes and their materials, seen from the front, each as wide as the picture."""
    stage = Stage("laws", (SIZE, SIZE), backend)
    for mesh, material in things:
        mesh.materials.append(material)
        stage.object("Thing", mesh)
    stage.camera((0, -8, 0), (0, 0, 0), 2 * math.degrees(math.asin(1 / 8)))
    stage.world(surfaces.sky("White", (1, 1, 1), (1, 1, 1)))
    return stage


def flat_mesh(thickness):
    """A plate across the picture, or one face of it where the thickness is 0."""
    mesh = bpy.data.meshes.new("Plate")
    if thickness:
        vertices, faces = shapes.box((-1, -thickness / 2, -1), (1, thickness / 2, 1))
    else:
        vertices, faces = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [(0, 1, 2, 3)]
    mesh.from_pydata(np.asarray(vertices).tolist(), [], faces)
    return mesh


def shells(count, backend):
    """Concentric balls of our interface, matched, whose indices are those of Luneburg's in the middle of each shell."""
    radii = np.linspace(1, 0, count, endpoint=False)
    indices = [1.0, *np.sqrt(2 - (radii - 0.5 / count) ** 2)]
    media = [Medium(float(n), float(n)) for n in indices]
    return [
        (round_mesh(radius, 128), interface_material("Shell", inside, outside, backend=backend))
        for radius, inside, outside in zip(radii, media[1:], media, strict=False)
    ]


def rendering(scene, samples):
    """Processor seconds of a render."""
    scene.cycles.samples = samples
    with quiet():
        started = time.process_time()
        bpy.ops.render.render(scene=scene.name)
    return time.process_time() - started


def timed(programs):
    """{name: processor seconds of the samples, round by round} of functions that make a stage."""
    times = {name: [] for name in programs}
    for turn in range(ROUNDS + 1):
        for name, make in programs.items():
            scene = make().scene
            one, all_of_them = rendering(scene, 1), rendering(scene, SAMPLES)
            if turn:  # the first round warms up; what one sample takes longer than a sample is set-up
                times[name].append((all_of_them - one) * SAMPLES / (SAMPLES - 1))
    return times


def beside_glass():
    """Print what a ball and a window take, each beside Blender's Glass in the same place and backend."""
    programs, pairs = {}, {}
    for backend in ("nodes", "osl"):
        window = LensletWindow(-1.0)
        made = {
            f"Glass ball, {backend}": lambda b=backend: stage_of([(round_mesh(1.0, 64), glass())], b),
            f"graded ball, {backend}": lambda b=backend: stage_of(
                [(round_mesh(1.0, 64), graded_ball_material("Ball", LUNEBURG, backend=b))], b
            ),
            f"Glass plate, {backend}": lambda b=backend: stage_of([(flat_mesh(0.1), glass())], b),
            f"lenslet window, {backend}": lambda b=backend, w=window: stage_of(
                [(flat_mesh(0.0), lenslet_material("Window", w, backend=b))], b
            ),
        }
        programs |= made
        pairs |= {f"graded ball, {backend}": f"Glass ball, {backend}"}
        pairs |= {f"lenslet window, {backend}": f"Glass plate, {backend}"}
    times = timed(programs)
    print(f"{SIZE} x {SIZE}, {SAMPLES} samples, {ROUNDS} rounds, Blender {bpy.app.version_string}")
    print(f"{'':22}{'CPU s':>8}   ratio, round by round: median, min, max")
    for name, taken in times.items():
        line = f"{name:22}{statistics.median(taken):8.2f}"
        if other := pairs.get(name):
            ratios = [a / b for a, b in zip(taken, times[other], strict=True)]
            line += f"   to {other}: {statistics.median(ratios):.3f}, {min(ratios):.3f}, {max(ratios):.3f}"
        print(line)


def walls(stage):
    """A box around the origin that glows with the place of each of its points."""
    material = bpy.data.materials.new("Place")
    nodes = Nodes(empty_tree(material))
    place = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": nodes.vector("ADD", place, (BIAS,) * 3)}))
    material.cycles.emission_sampling = "NONE"
    stage.mesh("Walls", *shapes.box((-WALLS,) * 3, (WALLS,) * 3), material)


def errors(stage):
    """How far off their lines, in radii, rays of SINES leave a Luneburg ball, by a path each."""
    walls(stage)
    scene = stage.scene
    data = scene.camera.data
    data.type, data.ortho_scale, data.clip_start = "ORTHO", 1e-8, 1e-3
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.cycles.samples = 1
    off = []
    for sine in SINES:
        d = np.array((0.48, -0.6, 0.64))
        across = np.cross(d, (0.1, 0.7, 0.4))
        start = sine * across / np.linalg.norm(across) - 3 * d
        turn = mathutils.Vector(d).to_track_quat("-Z", "Y").to_matrix().to_4x4()
        scene.camera.matrix_world = mathutils.Matrix.Translation(start) @ turn
        carried = graded.carry(LUNEBURG, start, d)
        place = pixels_of(scene)[0, 0] - BIAS
        off.append(np.linalg.norm(np.cross(place - carried.points, carried.directions)))
    return off


def beside_shells():
    """Print the time and the error of a graded ball, and of as many shells of our interface as SHELLS says."""
    programs = {"graded ball": [(round_mesh(1.0, 64), graded_ball_material("Ball", LUNEBURG, backend="osl"))]}
    programs |= {f"{count} shells": shells(count, "osl") for count in SHELLS}
    print(f"{'Luneburg, OSL':22}{'CPU s':>8}{'error':>10}   median of {len(SINES)} rays")
    first = None
    for name, things in programs.items():
        stage = stage_of(things, "osl")
        rendering(stage.scene, 1)
        samples = max(2, SAMPLES // len(things))
        one, more = rendering(stage.scene, 1), rendering(stage.scene, samples)
        taken = (more - one) * SAMPLES / (samples - 1)
        first = first or taken
        error = statistics.median(errors(stage))
        print(f"{name:22}{taken:8.2f}{error:10.1e}   {taken / first:.1f} of the graded ball's time")


beside_glass()
beside_shells()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Our material beside Blender's own Glass BSDF, both backends: the sphere scene, alternating, without set-up; prints ratios."""

import resource
import statistics
import subprocess
import sys
import tempfile
import time

import bpy

from nim_addon.base.streams import quiet
from nim_addon.cycles.material import NODE_NAME, switch_backend
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Medium
from nim_addon.scenes import scene_type

ROUNDS = 7
SIZE, SAMPLES = 256, 48


def glass_bsdf(name):
    """Blender's own glass of index 1.5, mirror-smooth."""
    material = bpy.data.materials.new(name)
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs={"IOR": 1.5, "Roughness": 0.0}))
    return material


def rendering(scene, samples):
    """Processor seconds of a render."""
    scene.cycles.samples = samples
    with quiet():
        started = time.process_time()
        bpy.ops.render.render(scene=scene.name)
    return time.process_time() - started


def programs(scene):
    """Functions by name that put a material into the sphere's scene, of a medium and a backend."""
    sphere = scene.objects["Sphere"]
    ours = sphere.material_slots[0].material
    values = ours.node_tree.nodes[NODE_NAME].inputs
    native = glass_bsdf("Glass")

    def ours_at(n, backend):
        def use():
            medium = Medium(n)
            values["Index Inside"].default_value, values["Permeability Inside"].default_value = medium.n, medium.mu
            scene.cycles.shading_system = backend == "osl"
            switch_backend(ours, backend)
            sphere.material_slots[0].material = ours

        return use

    def glass(backend):
        def use():
            scene.cycles.shading_system = backend == "osl"
            sphere.material_slots[0].material = native

        return use

    return {
        "Glass BSDF, SVM": glass("nodes"),
        "nodes, n = 1.5": ours_at(1.5, "nodes"),
        "nodes, n = -1.5": ours_at(-1.5, "nodes"),
        "Glass BSDF, OSL": glass("osl"),
        "OSL, n = 1.5": ours_at(1.5, "osl"),
        "OSL, n = -1.5": ours_at(-1.5, "osl"),
    }


def materials():
    """Print what a sample takes with each of the materials."""
    kind = scene_type("sphere")
    scene = kind.build(kind.parameters())
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    uses = programs(scene)
    times = {name: [] for name in uses}
    for turn in range(ROUNDS + 1):
        for name, use in uses.items():
            use()
            one, all_of_them = rendering(scene, 1), rendering(scene, SAMPLES)
            if turn:  # the first round warms up
                # what one sample takes longer than a sample is set-up
                times[name].append((all_of_them - one) * SAMPLES / (SAMPLES - 1))
    print(f"sphere scene, {SIZE} x {SIZE}, {SAMPLES} samples, {ROUNDS} rounds, Blender {bpy.app.version_string}")
    print(f"{'':18}{'CPU s':>8}   ratio, round by round: median, min, max")
    for name, taken in times.items():
        others = ["Glass BSDF, OSL" if name.startswith("OSL") else "Glass BSDF, SVM"]
        if name.startswith("nodes"):
            others.append(name.replace("nodes", "OSL"))
        line = f"{name:18}{statistics.median(taken):8.2f}"
        for other in others:
            if other != name:
                ratios = [a / b for a, b in zip(taken, times[other], strict=True)]
                line += f"   to {other}: {statistics.median(ratios):.3f}, {min(ratios):.3f}, {max(ratios):.3f}"
        print(line)


def command():
    """Print how long the command takes to the files of one sample, and how much memory."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "nim_addon", "render", "sphere", "--samples", "1", "--size", "64x64"]
        walls = []
        for _ in range(5):
            started = time.perf_counter()
            subprocess.run([*words, "--out", folder, "--quiet"], check=True)
            walls.append(time.perf_counter() - started)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(
        f"from command to the files of one sample at 64 x 64: {statistics.median(walls):.2f} s, peak memory {peak:.0f} MB"
    )


materials()
command()

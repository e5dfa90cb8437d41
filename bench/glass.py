# SPDX-License-Identifier: GPL-3.0-or-later
"""Our closure beside Blender's own Glass BSDF: the sphere scene, in one process, alternating; prints ratios of times."""

import resource
import statistics
import subprocess
import sys
import tempfile
import time

import bpy

from nim_addon.cycles.material import NODE_NAME
from nim_addon.cycles.render import quiet
from nim_addon.physics import Medium
from nim_addon.scenes import scene_type

ROUNDS = 9
SIZE, SAMPLES = 256, 64


def glass_bsdf(name):
    """Blender's own glass of index 1.5, mirror-smooth."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    glass = tree.nodes.new("ShaderNodeBsdfGlass")
    glass.inputs["IOR"].default_value = 1.5
    glass.inputs["Roughness"].default_value = 0.0
    tree.links.new(glass.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def main():
    """Print the table."""
    kind = scene_type("sphere")
    scene = kind.build(kind.parameters())
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.cycles.samples = SAMPLES
    sphere = scene.objects["Sphere"]
    ours = sphere.material_slots[0].material
    values = ours.node_tree.nodes[NODE_NAME].inputs
    native = glass_bsdf("Glass")

    def ours_at(n):
        def use():
            medium = Medium(n)
            values["Index Inside"].default_value, values["Permeability Inside"].default_value = medium.n, medium.mu
            sphere.material_slots[0].material = ours

        return use

    def glass():
        sphere.material_slots[0].material = native

    programs = {
        "Glass BSDF, n = 1.5": glass,
        "NIM Interface, n = 1.5": ours_at(1.5),
        "NIM Interface, n = -1.5": ours_at(-1.5),
    }
    times = {name: [] for name in programs}
    for turn in range(ROUNDS + 1):
        for name, use in programs.items():
            use()
            with quiet():
                started = time.perf_counter()
                bpy.ops.render.render(scene=scene.name)
            if turn:  # the first round warms up
                times[name].append(time.perf_counter() - started)
    base = times["Glass BSDF, n = 1.5"]
    print(
        f"sphere scene, {SIZE} x {SIZE}, {SAMPLES} samples, OSL on both sides, {ROUNDS} rounds, Blender {bpy.app.version_string}"
    )
    print(f"{'':26}{'seconds':>9}{'ratio to Glass: median':>25}{'min':>7}{'max':>7}")
    for name, taken in times.items():
        ratios = [a / b for a, b in zip(taken, base, strict=True)]
        middle = statistics.median(ratios)
        print(f"{name:26}{statistics.median(taken):9.2f}{middle:25.3f}{min(ratios):7.3f}{max(ratios):7.3f}")
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "nim_addon", "render", "sphere", "--samples", "1", "--size", "64x64"]
        walls = []
        for _ in range(5):
            started = time.perf_counter()
            subprocess.run([*command, "--out", folder, "--quiet"], check=True)
            walls.append(time.perf_counter() - started)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(
        f"from command to the files of one sample at 64 x 64: {statistics.median(walls):.2f} s, peak memory {peak:.0f} MB"
    )


main()

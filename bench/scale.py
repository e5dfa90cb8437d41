# SPDX-License-Identifier: GPL-3.0-or-later
"""What large scenes cost: a ball of 5 million triangles, and 200 pairs of a ball and a tile below it among 1,000 objects.

Each line is a process of its own, so that its peak memory is its own; times are of the processor, and of the clock.
"""

import json
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np

from nim_addon import caustics, checks
from nim_addon.base.streams import quiet
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium

TRIANGLES = 5_000_000
OBJECTS, PAIRS, PHOTONS, TEXELS = 1000, 200, 200_000, 128
RAYS = 31


def ball(triangles):
    """The scene of a new file with a smooth ball of about so many triangles in the place of its cube; the object."""
    bpy.ops.wm.read_factory_settings()
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    steps = round((triangles / 2) ** 0.5)
    # the poles are a little open, so that all faces have an area
    height, turn = np.meshgrid(
        np.linspace(1e-3, np.pi - 1e-3, steps + 1), np.linspace(0, 2 * np.pi, steps, endpoint=False), indexing="ij"
    )
    points = np.stack([np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn), np.cos(height)], -1)
    row, column = np.meshgrid(np.arange(steps), np.arange(steps), indexing="ij")
    a, b = row * steps + column, row * steps + (column + 1) % steps
    faces = np.stack([a, a + steps, b + steps, a, b + steps, b], -1).astype(np.int32).reshape(-1, 3)
    mesh = bpy.data.meshes.new("Ball")
    mesh.vertices.add(points.size // 3)
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    thing = bpy.data.objects.new("Ball", mesh)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    bpy.context.view_layer.update()
    return thing


def nim_ball():
    """The same of index -1.5, with what Cycles needs for it."""
    thing = ball(TRIANGLES)
    thing.data.materials.append(interface_material("NIM", Medium(-1.5)))
    bpy.context.view_layer.update()
    return thing


def enabled():
    """Register the add-on, as its panels and operators need."""
    import addon_utils

    addon_utils.enable("nim_addon", default_set=True)


def measured(action):
    """Run it: its processor and wall seconds, and its peak memory in MB over what there was before."""
    status = Path("/proc/self/clear_refs")
    if status.exists():
        status.write_text("5")  # Linux: the peak begins anew
    before = memory("VmRSS")
    processor, wall = time.process_time(), time.perf_counter()
    with quiet():
        action()
    return time.process_time() - processor, time.perf_counter() - wall, memory("VmHWM") - before


def memory(name):
    """Megabytes of this process: VmRSS now, VmHWM at its peak."""
    status = Path("/proc/self/status")
    if not status.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    return next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith(name)) / 2**10


def paths():
    """Light paths."""
    nim_ball()
    enabled()
    return measured(lambda: bpy.ops.nim.light_paths(rays=RAYS))


def check():
    """All checks, as before a render."""
    nim_ball()
    return measured(lambda: checks.problems(bpy.context.scene))


def convert():
    """Make Negative-Index."""
    ball(TRIANGLES)
    enabled()
    return measured(bpy.ops.nim.convert)


class Layout:
    """Stands for a bpy.types.UILayout: there is no window here."""

    def __getattr__(self, name):
        return lambda *words, **properties: Layout()


def redraw():
    """The slowest panel in the sidebar, once it knows the scene."""
    nim_ball()
    enabled()
    panels = [one for one in bpy.types.Panel.__subclasses__() if getattr(one, "bl_category", "") == "NIM"]
    panels = [one for one in panels if one.bl_space_type == "VIEW_3D"]

    class Context:
        region = SimpleNamespace(width=300)
        preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0), addons=bpy.context.preferences.addons)

        def __getattr__(self, name):
            return getattr(bpy.context, name)

    class Panel:
        layout = Layout()

    slowest = 0.0
    for panel in panels:
        if hasattr(panel, "poll") and not panel.poll(Context()):
            continue
        panel.draw(Panel, Context())
        times = [measured(lambda panel=panel: panel.draw(Panel, Context()))[1] for _ in range(21)]
        slowest = max(slowest, statistics.median(times))
    return slowest, slowest, 0.0


def bake():
    """A bake of PHOTONS in a scene of OBJECTS, with PAIRS of a ball of index -1.5 and a tile below it, under a sun."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    bpy.ops.object.shade_smooth()
    round_one = bpy.context.object.data
    bpy.data.objects.remove(bpy.context.object)
    round_one.materials.append(interface_material("NIM", Medium(-1.5)))
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    tile = bpy.context.object.data
    bpy.data.objects.remove(bpy.context.object)
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.angle = 0.01
    side = round(PAIRS**0.5) + 1

    def put(data, index, z, scale):
        thing = bpy.data.objects.new(data.name, data)
        thing.location, thing.scale = (3 * (index % side), 3 * (index // side), z), (scale,) * 3
        scene.collection.objects.link(thing)

    put(sun, 0, 9, 1)
    for index in range(PAIRS):
        put(round_one, index, 2, 0.4)
    for index in range(OBJECTS - PAIRS - 1):
        put(tile, index, 0, 3)
    bpy.context.view_layer.update()
    return measured(lambda: caustics.bake(scene, photons=PHOTONS, texels=TEXELS))


LINES = {
    "paths": (f"{RAYS} light paths, {TRIANGLES:,} triangles", paths),
    "check": ("checks, the same", check),
    "convert": ("Make Negative-Index, the same", convert),
    "redraw": ("slowest panel's redraw, the same", redraw),
    "bake": (f"bake of {PHOTONS:,} photons, {OBJECTS:,} objects", bake),
}


def main(words):
    """Print the table, or, called with the name of a line, what it measured."""
    if words and words[0] in LINES:
        print(json.dumps(LINES[words[0]][1]()))
        return
    print(
        f"{'Blender ' + bpy.app.version_string:48}{'CPU s':>9}{'wall s':>9}{'peak MB over the scene':>25}", flush=True
    )
    for name, (text, _) in LINES.items():
        child = subprocess.run([sys.executable, __file__, name], stdout=subprocess.PIPE, text=True, check=True)
        processor, wall, peak = json.loads(child.stdout.strip().split("\n")[-1])
        print(f"{text:48}{processor:9.3f}{wall:9.3f}{peak:25.0f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

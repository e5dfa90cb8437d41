# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person waits for: the command's first word, the add-on's start, a scene, a redraw, light paths, the rendered view.

  .venv/bin/python bench/waits.py [LAB-SCRIPT LAB-FOLDER]

Times are of the processor, the least of several runs; a run by itself is as slow as the machine is busy. The rendered view
and light paths over a view need a window: they are timed in a Blender lab where one is named (docs/press/press.py says what that
is), on the clock, so that the machine must be quiet; how busy it is stands above.
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import bpy

from nim_addon.base.streams import quiet
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
from nim_addon.scenes import SCENES

RUNS = 5
OTHERS = 19  # materials of a NIM beside the one that is drawn
ROOT = Path(__file__).resolve().parents[1]
# What is to be kept below, seconds.
REGISTRATION, REDRAW, OVERLAY = 0.030, 0.001, 0.050


class Layout:
    """Stands for a bpy.types.UILayout: there is no window here."""

    def __getattr__(self, name):
        return lambda *_, **__: Layout()

    def panel(self, *_, **__):
        """A part that is folded out."""
        return Layout(), Layout()


def least(action: Callable[[], object], before: Callable[[], object] = lambda: None, runs: int = RUNS) -> float:
    """Seconds of the processor, of the quickest of some runs."""
    taken = []
    for _ in range(runs):
        before()
        started = time.process_time()
        with quiet():
            action()
        taken.append(time.process_time() - started)
    return min(taken)


def version():
    """`nimray --version`, a process."""

    def once():
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "nim_addon", "--version"], stdout=subprocess.DEVNULL, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return min(once() for _ in range(RUNS))


def enabling():
    """The add-on, switched on again."""
    import addon_utils  # there once bpy is

    addon_utils.enable("nim_addon", default_set=True)
    return least(
        lambda: addon_utils.enable("nim_addon", default_set=True),
        lambda: addon_utils.disable("nim_addon", default_set=True),
    )


def redraw():
    """The material's panel, among OTHERS."""
    for number in range(OTHERS + 1):
        mesh = bpy.data.objects["Cube"].data.copy()
        mesh.materials[0] = material = interface_material(f"NIM {number}", Medium(-1.5), backend="nodes")
        bpy.context.collection.objects.link(bpy.data.objects.new(f"NIM {number}", mesh))
    bpy.context.view_layer.update()
    context = SimpleNamespace(
        material=material,
        object=bpy.context.collection.objects[-1],
        scene=bpy.context.scene,
        region=SimpleNamespace(width=300),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0, pixel_size=1.0)),
    )
    return least(lambda: bpy.types.NIM_PT_material.draw(SimpleNamespace(layout=Layout()), context), runs=50)


def light_paths():
    """200 rays of 8 bounces on the scene of the sphere."""
    bpy.context.window.scene = SCENES["sphere"].build(SCENES["sphere"].parameters(), "nodes")
    bpy.context.scene.cursor.location = (-3, 0, 1.1)

    def draw():
        bpy.ops.nim.light_paths(rays=200, bounces=8, arrangement="CONE")
        bpy.context.view_layer.update()

    return least(draw, runs=3)


def in_lab(name, script, folder):
    """What bench/NAME.py tells, run in a lab's Blender."""
    with tempfile.TemporaryDirectory() as out:
        file = Path(out, "seconds.json")
        told = {f"{name.upper()}_ROOT": str(ROOT), f"{name.upper()}_OUT": str(file), "LAB_BIND": f"{ROOT}:{out}"}
        words = [script, "-d", folder, "shot", ROOT / "bench" / f"{name}.py", Path(out, "end.png")]
        done = subprocess.run(
            words,
            env={"LAB_TIMEOUT": "900", **os.environ, **told},
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        if not file.exists():
            raise RuntimeError(f"{name} was not timed:\n{done.stdout[-2000:]}")
        return json.loads(file.read_text())


def main():
    """Print the table."""
    print(f"load of the machine, per core: {os.getloadavg()[0] / (os.cpu_count() or 1):.1f}")
    print(f"{'Blender ' + bpy.app.version_string:52}{'CPU ms':>9}{'goal':>7}")

    def line(text, seconds, goal=None):
        print(f"{text:52}{1000 * seconds:9.2f}" + (f"{1000 * goal:7.0f}" if goal else ""), flush=True)

    line("nimray --version", version())
    bpy.ops.wm.read_factory_settings()
    line("switching the add-on on", enabling(), REGISTRATION)
    line(f"redrawing the material's panel, of {OTHERS + 1} materials", redraw(), REDRAW)
    for name, scene_type in SCENES.items():
        line(f"building the {name}", least(lambda made=scene_type: made.build(made.parameters()), runs=3))
    line("light paths of 200 rays and 8 bounces", light_paths())
    if len(sys.argv) > 2:
        print(f"\n{'in the lab, medians':52}{'clock':>9}{'CPU ms':>9}{'goal':>7}")
        goal = f"{1000 * OVERLAY:7.0f}"
        seconds = in_lab("first_pixel", *sys.argv[1:3])
        print(
            f"{f'n changed to another pixel, {len(seconds)} times':52}{1000 * statistics.median(seconds):9.2f}",
            flush=True,
        )
        for name, taken in in_lab("overlay", *sys.argv[1:3]).items():
            seen, *spent = (1000 * statistics.median(column) for column in zip(*taken, strict=True))
            print(
                f"{f'light paths, {name}: traced and drawn':52}{spent[0] + spent[2]:9.2f}{spent[1] + spent[3]:9.2f}{goal}"
            )
            print(f"{'    of that, drawn':52}{spent[2]:9.2f}{spent[3]:9.2f}")
            print(f"{'    from the change until it is drawn':52}{seen:9.2f}", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # a Blender that is a module may hang where it ends by itself

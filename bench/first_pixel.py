# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a person who changes n waits for another pixel of the rendered view: run by waits.py in a Blender with a window.

FIRST_PIXEL_ROOT is the checkout, FIRST_PIXEL_OUT the file that the seconds go to, as JSON. The screen itself is read, some 200
times a second: from the change until the middle of the view is another one. Between two changes the view comes to rest, so
that no noise is taken for a change.
"""

import json
import os
import struct
import sys
import time
import traceback

import addon_utils
import bpy
import lab

ROOT, OUT = os.environ["FIRST_PIXEL_ROOT"], os.environ["FIRST_PIXEL_OUT"]
CHANGES = 20
REST = 1.5  # seconds without another pixel
FIRST = 15.0  # seconds that the first picture has
LONGEST = 60.0
SAMPLES = 4
SIDE = 16  # pixels that are looked at

sys.path.insert(0, ROOT)
state = {"pixels": None, "seen": 0.0, "changed": None, "taken": [], "done": False}


def middle():
    """The pixels in the middle of the view, as the screen shows them: of the file that Xvfb keeps them in."""
    area = lab.area("VIEW_3D")
    region = next(one for one in area.regions if one.type == "WINDOW")
    with open(os.environ["LAB_FB"], "rb") as file:
        head = struct.unpack(">25I", file.read(100))
        height, line = head[5], head[12]
        first = head[0] + 12 * head[19] + (height - region.y - region.height // 2) * line
        rows = []
        for row in range(SIDE):
            file.seek(first + row * line + 4 * (region.x + region.width // 2))
            rows.append(file.read(4 * SIDE))
    return b"".join(rows)


def watch():
    """Note when the middle of the view is another one."""
    pixels, now = middle(), time.perf_counter()
    if pixels != state["pixels"]:
        state["pixels"], state["seen"] = pixels, now
        if state["changed"] is not None:
            state["taken"].append(now - state["changed"])
            state["changed"] = None


def begin():
    """Show the scene of the sphere, rendered by Cycles."""
    addon_utils.enable("nim_addon", default_set=True)
    scene = bpy.context.scene
    scene.nim_scenes.scene = "sphere"
    with bpy.context.temp_override(window=lab.window(), area=lab.area("VIEW_3D")):
        bpy.ops.nim.build_scene("EXEC_DEFAULT")
        scene = bpy.context.window.scene
    scene.cycles.preview_samples, scene.cycles.use_preview_denoising = SAMPLES, False
    view = lab.area("VIEW_3D").spaces.active
    view.shading.type, view.overlay.show_overlays = "RENDERED", False
    state["seen"] = time.perf_counter() + FIRST


def change():
    """Change n, as the panel does."""
    material = lab.window().scene.objects["Sphere"].active_material
    node = next(node for node in material.node_tree.nodes if "Index Inside" in node.inputs)
    node.inputs["Index Inside"].default_value = -1.2 - 0.5 * (len(state["taken"]) % 2)


def tick():
    """Timer: change n once the view has come to rest."""
    try:
        now = time.perf_counter()
        if state["pixels"] is not None or now > state["seen"]:
            watch()
        if state["changed"] is not None:
            if now - state["changed"] > LONGEST:
                raise TimeoutError("no other pixel")
        elif len(state["taken"]) == CHANGES:
            with open(OUT, "w") as file:
                json.dump(state["taken"], file)
            state["done"] = True
            return None
        elif now - state["seen"] > REST and state["pixels"] is not None:
            state["changed"] = time.perf_counter()
            change()
        return 0.004
    except Exception:
        traceback.print_exc()
        state["done"] = True
        return None


begin()
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
lab.wait_for(lambda: state["done"])
lab.settle = 0.1

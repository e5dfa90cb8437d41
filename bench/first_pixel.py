# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a person who changes n waits for another pixel of the rendered view: run by waits.py in a Blender with a window.

FIRST_PIXEL_ROOT is the checkout, FIRST_PIXEL_OUT the file that the seconds go to, as JSON. A draw handler reads the middle
of the view: from the change until it is drawn anew with other values. Between two changes the view comes to rest, so that no
noise is taken for a change.
"""

import json
import os
import sys
import time
import traceback

import addon_utils
import bpy
import gpu
import lab
import numpy as np

ROOT, OUT = os.environ["FIRST_PIXEL_ROOT"], os.environ["FIRST_PIXEL_OUT"]
CHANGES = 20
REST = 1.0  # seconds without another pixel
LONGEST = 60.0
SAMPLES = 4
SIDE = 16  # pixels that are looked at

sys.path.insert(0, ROOT)
state = {"pixels": None, "seen": 0.0, "changed": None, "taken": [], "done": False}


def watch():
    """Draw handler: note when the middle of the view is another one."""
    _, _, width, height = gpu.state.viewport_get()
    corner = width // 2 - SIDE // 2, height // 2 - SIDE // 2
    buffer = gpu.state.active_framebuffer_get().read_color(*corner, SIDE, SIDE, 3, 0, "FLOAT")
    pixels = np.array(buffer.to_list())
    now = time.perf_counter()
    if state["pixels"] is None or abs(pixels - state["pixels"]).max() > 1e-3:
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
    bpy.types.SpaceView3D.draw_handler_add(watch, (), "WINDOW", "POST_PIXEL")
    view = lab.area("VIEW_3D").spaces.active
    view.shading.type, view.overlay.show_overlays = "RENDERED", False
    state["seen"] = time.perf_counter() + 10


def change():
    """Change n, as the panel does."""
    material = lab.window().scene.objects["Sphere"].active_material
    node = next(node for node in material.node_tree.nodes if "Index Inside" in node.inputs)
    node.inputs["Index Inside"].default_value = -1.2 - 0.5 * (len(state["taken"]) % 2)


def tick():
    """Timer: change n once the view has come to rest."""
    try:
        now = time.perf_counter()
        if state["pixels"] is None and now > state["seen"] + LONGEST:
            raise TimeoutError("the view is not drawn")
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
        return 0.05
    except Exception:
        traceback.print_exc()
        state["done"] = True
        return None


begin()
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
lab.wait_for(lambda: state["done"])
lab.settle = 0.1

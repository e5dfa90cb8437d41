# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a person waits for the light paths over a view after a change: run by waits.py in a Blender with a window.

OVERLAY_ROOT is the checkout, OVERLAY_OUT the file that the seconds go to, as JSON: of each scene and each kind of change the
seconds until the lines are drawn; those of tracing, by the clock and of the processor; and those of drawing, batches included.
"""

import json
import os
import sys
import time
import traceback

import addon_utils
import bpy
import lab

ROOT, OUT = os.environ["OVERLAY_ROOT"], os.environ["OVERLAY_OUT"]
RAYS, BOUNCES = 200, 8
SCENES = {"sphere": "Sphere", "prism": "Prism", "ball": "Ball"}  # what is changed in each
CHANGES = 10
REST = 0.6  # seconds between two, so that none follows another closely
LONGEST = 60.0

sys.path.insert(0, ROOT)
state = {
    "left": [],
    "taken": {},
    "begun": None,
    "within": None,
    "traced": None,
    "spent": None,
    "at": 0.0,
    "done": False,
}


def clocks():
    return time.perf_counter(), time.process_time()


def looked(look):
    """live_look's function that traces, timed."""

    def timed(*given):
        # of this thread: beside it, software GL may still draw the view
        begun = time.perf_counter(), time.thread_time()
        made = look(*given)
        state["traced"] = clocks()
        state["spent"] = [state["traced"][0] - begun[0], time.thread_time() - begun[1]]
        return made

    return timed


def before_drawing():
    """A callback ahead of the add-on's."""
    state["within"] = clocks()


def after_drawing():
    """A callback behind the add-on's: the lines of a change are drawn."""
    now = clocks()
    if state["begun"] is None or state["spent"] is None:
        return
    # it may have been traced in between
    within = [max(begin, end) for begin, end in zip(state["within"], state["traced"], strict=True)]
    drawn = [end - begin for end, begin in zip(now, within, strict=True)]
    state["taken"].setdefault(state["left"][0][0], []).append([now[0] - state["begun"], *state["spent"], *drawn])
    state["begun"], state["spent"], state["at"] = None, None, now[0]


def begin():
    """Switch the light paths on, over an empty scene."""
    addon_utils.enable("nim_addon", default_set=True)
    from nim_addon.ui import live_look

    view = lab.area("VIEW_3D").spaces.active
    view.shading.type, view.overlay.show_overlays = "SOLID", True
    space = bpy.types.SpaceView3D
    space.draw_handler_add(before_drawing, (), "WINDOW", "POST_VIEW")
    live_look.LOOKS.look = looked(live_look.LOOKS.look)
    with bpy.context.temp_override(window=lab.window(), area=lab.area("VIEW_3D")):
        bpy.ops.nim.light_paths_live()
    space.draw_handler_add(after_drawing, (), "WINDOW", "POST_VIEW")
    state["left"] = [
        (f"{scene}, {what}", scene, what, count)
        for scene in SCENES
        for what in ("n changed", "moved")
        for count in range(CHANGES + 1)
    ]


def show(name):
    """Build a scene and look at it."""
    bpy.context.window.scene.nim_scenes.scene = name
    with bpy.context.temp_override(window=lab.window(), area=lab.area("VIEW_3D")):
        bpy.ops.nim.build_scene("EXEC_DEFAULT")
    rays = lab.window().scene.nim_rays
    rays.rays, rays.bounces = RAYS, BOUNCES


def change(scene, what, count):
    """Change it, as a person does in a panel or the view."""
    from nim_addon.cycles import graded
    from nim_addon.cycles.material import set_medium
    from nim_addon.physics import Medium
    from nim_addon.physics.graded import Profile

    thing = lab.window().scene.objects[SCENES[scene]]
    nodes, other = thing.active_material.node_tree.nodes, count % 2
    if what == "moved":
        thing.location.x += 0.02 if other else -0.02
    elif scene == "ball":
        node = next(node for node in nodes if graded.is_profile_node(node))
        graded.set_profile(node, Profile("fisheye" if other else "luneburg"))
    else:
        node = next(node for node in nodes if "Index Inside" in node.inputs)
        if scene == "prism":
            set_medium(node, "Inside", Medium.parse("n-sf11" if other else "n-bk7"))
        else:
            node.inputs["Index Inside"].default_value = -1.2 - 0.5 * other


def tick():
    """Timer: the next change, once the last has come to rest."""
    try:
        now = time.perf_counter()
        if state["begun"] is not None:
            if now - state["begun"] > LONGEST:
                raise TimeoutError("no lines are drawn")
            return 0.02
        if now - state["at"] < REST:
            return 0.05
        left = state["left"]
        if state["taken"] or state["at"]:
            left.pop(0)
        if not left:
            # the first of each reads and compiles what later ones find
            with open(OUT, "w") as file:
                json.dump({name: taken[1:] for name, taken in state["taken"].items()}, file)
            state["done"] = True
            return None
        _, scene, what, count = left[0]
        if what == "n changed" and count == 0:
            show(scene)
        state["spent"], state["begun"] = None, time.perf_counter()
        change(scene, what, count)
        return 0.02
    except Exception:
        traceback.print_exc()
        state["done"] = True
        return None


begin()
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
lab.wait_for(lambda: state["done"])
lab.settle = 0.1

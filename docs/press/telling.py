# SPDX-License-Identifier: GPL-3.0-or-later
"""How the story of steps.py is told: each step is done, waited for, undone and redone where it changes data, and pictured."""

import faulthandler
import hashlib
import os
import time
import traceback

import bpy
import hands
import lab
import labels
import mark

OUT = os.environ["PRESS_OUT"]
ONLY = os.environ.get("PRESS_ONLY", "").split()
# Seconds for a picture of Cycles, as part of what a page's picture takes.
HASTE = float(os.environ.get("PRESS_HASTE", "1"))
LONGEST = 600  # seconds that anything may take, beside much else that the machine does
AT_REST = 3  # times, a fifth of a second apart, that the screen must be alike
# what saves the screen: the lab's own, since Blender's screenshots are black without a graphics card
grab = lab.window.__globals__["grab"]
lab_tick = lab.window.__globals__["tick"]

STEPS = []


def step(wait=1.5, shot=True, undo=0):
    """A step of the story.

    wait: seconds until it is over, a Work that Blender must have done, or a function that says whether it is; and then until
          the screen is at rest
    shot: whether a picture is taken then
    undo: of a step that changes data, how many steps Blender makes of it: they are undone, which must bring back what was
          before, and redone
    """

    def add(function):
        STEPS.append((function, wait, shot, undo))
        return function

    return add


class Work(float):
    """Seconds of work: on a machine that does much else too Blender gets longer for them."""

    LONGER = 6  # times as long, where less is to be done


def rendered(seconds):
    """The Work that Cycles needs for a picture, less if it is of no page."""
    return Work(max(4, seconds * HASTE))


def state_of_data():
    """What undo must bring back, as lines: scenes, objects and where they stand, what they wear, n, keyframes, images."""
    lines = []
    for scene in bpy.data.scenes:
        lines.append(f"scene {scene.name}: {scene.render.engine} {sorted(scene.objects.keys())}")
        lines.append(f"bounces of {scene.name}: {scene.cycles.max_bounces} {scene.cycles.transparent_max_bounces}")
    for obj in bpy.data.objects:
        place = [round(value, 4) + 0.0 for row in obj.matrix_basis for value in row]
        worn = [slot.material.name if slot.material else None for slot in obj.material_slots]
        lines.append(f"object {obj.name} {obj.type} {place} {worn}")
    for material in bpy.data.materials:
        tree = material.node_tree
        values = [
            (node.name, socket.name, round(socket.default_value, 4))
            for node in (tree.nodes if tree else ())
            for socket in node.inputs
            if socket.type == "VALUE"
        ]
        action = (
            tree.animation_data.action.name if tree and tree.animation_data and tree.animation_data.action else None
        )
        lines.append(f"material {material.name} {values} {action}")
    lines += [f"image {image.name}" for image in bpy.data.images if image.name not in ("Render Result", "Viewer Node")]
    return sorted(lines)


def compare(before, after, what):
    """Fail where undo or redo has not brought back what was."""
    gone, new = sorted(set(before) - set(after)), sorted(set(after) - set(before))
    if gone or new:
        raise AssertionError(f"{what} leaves another state; missing: {gone[:6]}, too much: {new[:6]}")


def redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if not (area.type == "VIEW_3D" and area.spaces.active.shading.type == "RENDERED"):
                area.tag_redraw()


def screen():
    """What is on the screen, as something to be compared."""
    with open(os.environ["LAB_FB"], "rb") as file:
        return hashlib.file_digest(file, "md5").digest()


def restless():
    """What may change on the screen though nobody does anything; "" where nothing will."""
    if hands.at_it:
        return "a hand is not done"
    if any(bpy.app.is_job_running(kind) for kind in ("RENDER_PREVIEW", "SHADER_COMPILATION")):
        return "Blender renders a preview, or makes shaders"
    deferred = hands.ours("ui.deferred")
    return "the add-on has put something off" if deferred and deferred._waiting else ""


def never_rests():
    """Whether it changes all the time: a view by EEVEE, too, draws sample after sample, each for long without a graphics card."""
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    views = [area.spaces.active for area in areas if area.type == "VIEW_3D"]
    jobs = hands.ours("ui.jobs")
    job = jobs and jobs.job()
    return any(view.shading.type in ("MATERIAL", "RENDERED") for view in views) or bool(job and job.running)


class Teller:
    """Tells the story from a timer: `done` once it is over, or has failed."""

    def __init__(self):
        if bpy.app.timers.is_registered(lab_tick):
            bpy.app.timers.unregister(
                lab_tick
            )  # it has all drawn again and again, which a busy machine is too slow for
        self.steps = [one for one in STEPS if not ONLY or one[0].__name__ in ONLY]
        self.done = False
        self.cut = set()
        self.at = 0
        self.way = iter(())
        self.until = None  # what is waited for: a function

    def tick(self):
        """A timer of Blender."""
        try:
            mark.take_away()
            if self.until is not None and not self.until():
                return 0.2
            self.until = None
            with bpy.context.temp_override(window=lab.window()):
                self.until = next(self.way)
            return 0.1
        except StopIteration:
            if self.at < len(self.steps):
                self.way = self._one(*self.steps[self.at])
                self.at += 1
                return 0.1
            if self.cut:
                self._fail("Labels are cut off:\n" + "\n".join(map(str, sorted(self.cut))))
            self.done = True
            bpy.app.timers.register(lab_tick, persistent=True)
            return None
        except Exception:
            # the others may tell more
            self._fail(f"{self.steps[self.at - 1][0].__name__}: {traceback.format_exc()}")
            self.way, self.until = iter(()), None
            return 0.1

    def _fail(self, text):
        print(text, flush=True)
        grab(os.path.join(OUT, f"failed-{self.at:02d}.png"))
        with open(os.path.join(OUT, "failed.txt"), "a") as file:
            file.write(f"{text}\n")

    def _one(self, function, wait, shot, undo):
        """Do a step; yields what is to be waited for."""
        name = function.__name__
        if os.environ.get("PRESS_STUCK"):  # say where Blender hangs
            faulthandler.dump_traceback_later(float(os.environ["PRESS_STUCK"]))
        print(f"[press] {name}", flush=True)
        begun = time.monotonic()
        before = state_of_data() if undo else None
        function()
        yield over(wait, AT_REST if shot and not undo else 1)
        if undo:
            after = state_of_data()
            if before == after:
                raise AssertionError(f"{name} changes nothing")
            for _ in range(undo):
                bpy.ops.ed.undo()
                yield over(0.3, rest=1)
            compare(before, state_of_data(), f"undo after {name}")
            for _ in range(undo):
                bpy.ops.ed.redo()
                yield over(0.3, rest=1)
            compare(after, state_of_data(), f"redo after {name}")
        self.cut |= {(name, *line) for line in labels.cut_off(lab.window())}
        if shot and undo:
            yield over(0, AT_REST)
        if shot:
            grab(os.path.join(OUT, f"{self.at:02d}-{name}.png"))
        print(f"[press] {name}: {time.monotonic() - begun:.1f} s", flush=True)


def over(wait, rest):
    """What says, asked again and again, when a wait is over; it fails where that takes too long. Blender draws in between.

    rest: times that the screen must be alike then
    """
    begun, worked = time.monotonic(), time.process_time()
    shown = []  # since it was over but for the screen

    def waited():
        passed = time.monotonic() - begun
        if callable(wait):
            return wait()
        if isinstance(wait, Work):
            # of two processors, of which Blender itself needs a part of one
            return passed >= wait and (time.process_time() - worked >= 1.5 * wait or passed >= wait.LONGER * wait)
        return passed >= wait

    def ask():
        why = "it is not over" if not waited() else restless()
        if why:
            shown.clear()
        else:
            if not shown and rest > 1:
                redraw()
            shown.append(screen())
            if len(shown) > rest and (never_rests() or len(set(shown[-rest:])) == 1):
                return True
            why = "the screen changes all the time"
        if time.monotonic() - begun > LONGEST:
            raise TimeoutError(f"not done after {LONGEST} s: {why}")
        return False

    return ask


def begin():
    """Tell the story; the lab waits for its end."""
    teller = Teller()
    bpy.app.timers.register(teller.tick, first_interval=0.5, persistent=True)
    lab.wait_for(lambda: teller.done)
    lab.settle = 0.1

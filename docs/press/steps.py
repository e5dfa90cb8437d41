# SPDX-License-Identifier: GPL-3.0-or-later
"""From an empty Blender with a window to every screen of the pages: only what a person presses and drags.

Run by press.py inside the lab's Blender. PRESS_ZIP is the extension, PRESS_OUT the folder that the pictures go to.
"""

import faulthandler
import os
import sys
import time
import traceback

import bpy
import lab

ZIP, OUT = os.environ["PRESS_ZIP"], os.environ["PRESS_OUT"]
MODULE = "bl_ext.user_default.nim_addon"
ONLY = os.environ.get("PRESS_ONLY", "").split()
# what saves the screen: the lab's own, since Blender's screenshots are black without a graphics card
grab = lab.window.__globals__["grab"]

STEPS = []


def step(wait=1.5, shot=True):
    """A step of the story: it is done, `wait` (seconds, or a function that says when) passes, a picture is taken."""

    def add(function):
        STEPS.append((function, wait, shot))
        return function

    return add


def press(operator, space="VIEW_3D", region="WINDOW", **properties):
    """Press the button of an operator, in an area of that type."""
    area = lab.area(space)
    part = next(one for one in area.regions if one.type == region)
    group, _, name = operator.partition(".")
    with bpy.context.temp_override(window=lab.window(), area=area, region=part):
        done = getattr(getattr(bpy.ops, group), name)("INVOKE_DEFAULT", True, **properties)
    print(f"{operator}: {', '.join(done)}", flush=True)
    if "CANCELLED" in done:
        raise RuntimeError(f"{operator} was cancelled")


def soon(function):
    """Call it again and again until the screen, which is drawn in between, is ready for it."""

    def attempt():
        try:
            function()
        except (AttributeError, TypeError):
            return 0.2

    bpy.app.timers.register(attempt, first_interval=0.3)


def sidebar(space, tab):
    """Open the sidebar of an area on a tab."""
    lab.area(space).spaces.active.show_region_ui = True

    def open_tab():
        region = next(one for one in lab.area(space).regions if one.type == "UI")
        if region.active_panel_category == "UNSUPPORTED":
            raise TypeError("not drawn yet")
        region.active_panel_category = tab

    soon(open_tab)


def event(kind, value="PRESS", at=(500, 500)):
    """A key, or the mouse, as Blender is told of it."""
    lab.window().event_simulate(type=kind, value=value, x=at[0], y=at[1])


def key(kind):
    """Press a key and let it go."""
    event(kind)
    event(kind, "RELEASE")


def settings():
    return lab.window().scene.nim_scenes


def shading(kind):
    view = lab.area("VIEW_3D").spaces.active
    view.shading.type = kind
    view.overlay.show_overlays = kind == "SOLID"


def show(editor):
    """Turn the largest area into that editor."""
    areas = lab.window().screen.areas
    max(areas, key=lambda area: area.width * area.height).ui_type = editor


def material_tab():
    """Open the Material tab of the Properties editor."""
    soon(lambda: setattr(lab.area("PROPERTIES").spaces.active, "context", "MATERIAL"))


def select(name):
    scene = lab.window().scene
    layer = lab.window().view_layer
    for thing in scene.objects:
        thing.select_set(thing.name == name, view_layer=layer)
    layer.objects.active = scene.objects[name]


# ------------------------------------------------------------------------------------------------ the story


@step()
def install():
    bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
    assert MODULE in bpy.context.preferences.addons
    show("PREFERENCES")
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "NIM"
    bpy.ops.preferences.addon_expand(module=MODULE)


def checked():
    return not sys.modules[f"{MODULE}.ui.blender_check"].check.running


@step(wait=checked)
def check():
    press("nim.check_blender", "PREFERENCES")


@step()
def first_look():
    show("VIEW_3D")
    sidebar("VIEW_3D", "NIM")


@step()
def sphere():
    settings().scene = "sphere"
    press("nim.build_scene")


@step(wait=40)
def sphere_rendered():
    shading("RENDERED")


@step(wait=40)
def sphere_changed():
    select("Sphere")
    material_tab()
    bpy.context.window.scene.objects["Sphere"].active_material.nim.n_inside = -2.2


@step(wait=3)
def asked():
    shading("SOLID")
    press("nim.build_scene")


@step(shot=False)
def answered():
    key("RET")


@step(wait=3)
def rays():
    select("Sphere")
    lab.window().scene.cursor.location = (0, -3, 1)
    press("nim.light_paths", source="CURSOR", rays=9, bounces=2, least=0.02)
    press("view3d.view_axis", type="RIGHT")
    press("view3d.view_selected")
    lab.area("VIEW_3D").spaces.active.region_3d.view_distance *= 1.2
    lab.area("VIEW_3D").spaces.active.shading.show_xray = True


@step(wait=2)
def rays_of_the_camera():
    lab.area("VIEW_3D").spaces.active.shading.show_xray = False
    press("view3d.view_camera")
    press("nim.light_paths_clear")
    press("nim.light_paths", source="CAMERA", arrangement="CONE")


@step(shot=False)
def rays_cleared():
    press("nim.light_paths_clear")


@step(wait=30)
def glass():
    settings().scene = "glass"
    press("nim.build_scene")
    shading("RENDERED")


@step(wait=30)
def glass_top():
    settings().glass.view = "top"


@step(wait=30)
def pool():
    shading("SOLID")
    settings().scene = "pool"
    press("nim.build_scene")
    shading("RENDERED")


@step(wait=20)
def pool_window():
    settings().pool.view = "window"


def half_done():
    job = sys.modules[f"{MODULE}.ui.jobs"].job()
    return job.progress()[0] > 0.3 or not job.running


def all_done():
    return not sys.modules[f"{MODULE}.ui.jobs"].job().running


@step(wait=half_done)
def headless():
    shading("SOLID")
    settings().scene = "sphere"
    settings().quality = "DRAFT"
    bpy.context.preferences.addons[MODULE].preferences.folder = OUT + "/renders"
    press("nim.render_headless")


@step(wait=all_done)
def headless_done():
    pass


@step(wait=3)
def result():
    lab.area("PROPERTIES").ui_type = "IMAGE_EDITOR"
    press("nim.open_result")


@step(shot=False)
def new_file():
    bpy.ops.wm.read_homefile(app_template="", use_empty=False, use_factory_startup=False)


@step(wait=2, shot=False)
def tab_of_the_new_file():
    sidebar("VIEW_3D", "NIM")


@step(wait=8)
def cube():
    press("nim.convert")


@step(wait=3)
def checks():
    for _ in range(14):  # the wheel, turned down
        press("view2d.scroll_down", region="UI")


@step(wait=1, shot=False)
def back_up():
    for _ in range(14):
        press("view2d.scroll_up", region="UI")


@step(wait=8)
def cube_mended():
    press("nim.mend")
    material_tab()  # not before: with EEVEE still on, its icon would take a processor without a graphics card minutes


@step(wait=30)
def cube_rendered():
    # something to be seen through it
    press("mesh.primitive_plane_add", size=20, location=(0, 0, -1.01))
    press("mesh.primitive_monkey_add", location=(-1.9, 2.6, 0))
    select("Cube")
    shading("RENDERED")


@step(wait=2)
def cube_rays():
    shading("SOLID")
    press("nim.light_paths")


@step(wait=2, shot=False)
def mouse():
    press("nim.light_paths_clear")
    press("nim.revert")
    event("MOUSEMOVE", "NOTHING")


@step(wait=2)
def add_mesh():
    press("wm.call_menu", name="VIEW3D_MT_mesh_add")


@step(wait=1, shot=False)
def menu_closed():
    key("ESC")


@step(wait=3)
def added():
    press("nim.add_object", shape="prism")


@step(wait=2, shot=False)
def nodes():
    show("ShaderNodeTree")
    event("MOUSEMOVE", "NOTHING", at=(900, 160))
    sidebar("NODE_EDITOR", "NIM")


@step(wait=3)
def node_sidebar():
    press("node.view_all", "NODE_EDITOR")


@step(wait=2)
def node_menu():
    event("MOUSEMOVE", "NOTHING")
    press("wm.call_menu", "NODE_EDITOR", name="NIM_MT_add_node")


@step(wait=1, shot=False)
def node_menu_closed():
    key("ESC")


@step(wait=8)
def assets():
    press("nim.register_assets", "NODE_EDITOR")
    show("ASSETS")

    def choose():
        lab.area("FILE_BROWSER").spaces.active.params.asset_library_reference = "Negative-Index Materials"

    soon(choose)


# ------------------------------------------------------------------------------------------------ telling it

state = {"at": -1, "since": 0.0, "done": False}
if ONLY:
    STEPS = [one for one in STEPS if one[0].__name__ in ONLY]


def tell():
    """Timer: wait until a step is over, take its picture, begin the next."""
    try:
        if state["at"] >= 0:
            function, wait, shot = STEPS[state["at"]]
            passed = time.monotonic() - state["since"]
            if not (wait() and passed > 1.5 if callable(wait) else passed >= wait):
                redraw()
                return 0.2
            if shot:
                grab(os.path.join(OUT, f"{state['at'] + 1:02d}-{function.__name__}.png"))
        state["at"] += 1
        if state["at"] == len(STEPS):
            state["done"] = True
            return None
        if os.environ.get("PRESS_STUCK"):  # say where Blender hangs
            faulthandler.dump_traceback_later(float(os.environ["PRESS_STUCK"]))
        print(f"[press] {STEPS[state['at']][0].__name__}", flush=True)
        state["since"] = time.monotonic()
        with bpy.context.temp_override(window=lab.window()):
            STEPS[state["at"]][0]()
        return 0.2
    except Exception:
        traceback.print_exc()
        with open(os.path.join(OUT, "failed.txt"), "w") as file:
            file.write(traceback.format_exc())
        state["done"] = True
        return None


def redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if not (area.type == "VIEW_3D" and area.spaces.active.shading.type == "RENDERED"):
                area.tag_redraw()


bpy.app.timers.register(tell, first_interval=0.5, persistent=True)
lab.wait_for(lambda: state["done"])
lab.settle = 0.1

# SPDX-License-Identifier: GPL-3.0-or-later
"""A NIM cube in an empty file: its index, its curve, its checks, its caustics, its light paths, its render."""

import os

import bpy
import lab
from hands import (
    MODULE,
    all_done,
    event,
    folded_again,
    half_done,
    key,
    needs,
    noted,
    ours,
    overheard,
    press,
    pushed,
    scroll,
    select,
    shading,
    show,
    sidebar,
    socket,
    soon,
    unfolded,
    where,
)
from telling import HASTE, OUT, rendered, step

ZIP = os.environ["PRESS_ZIP"]


# ------------------------------------------------------------------------------------------------ installed


@step()
def install():
    bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
    needs(MODULE in bpy.context.preferences.addons, "the add-on is not enabled")
    show("PREFERENCES")
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "Negative"
    bpy.ops.preferences.addon_expand(module=MODULE)


def checked():
    return not ours("ui.blender_check").check.running


@step(wait=checked)
def check():
    press("nim.check_blender", "PREFERENCES")


# ------------------------------------------------------------------------------------------------ a NIM cube


@step(wait=2, shot=False)
def empty():
    os.environ["HOME"] = OUT  # the pictures show ~/renders
    bpy.context.preferences.view.smooth_view = 0  # views turn at once, however busy the machine
    if HASTE < 1:  # no picture is of a page
        bpy.context.preferences.system.viewport_aa = "OFF"  # which draws each view eight times
    bpy.context.preferences.addons[MODULE].preferences.folder = OUT + "/renders"
    show("VIEW_3D")
    bpy.ops.wm.read_homefile(app_template="", use_empty=True)


@step(wait=2)
def first_look():
    shading("SOLID")
    sidebar("VIEW_3D", "NIM")


@step(wait=1, shot=False)
def mouse():
    event("MOUSEMOVE", "NOTHING")


@step(wait=2)
def add_mesh():
    press("wm.call_menu", name="NIM_MT_add_mesh")


@step(wait=1, shot=False)
def menu_closed():
    key("ESC")


@step(wait=3, undo=1)
def nim_cube():
    press("nim.add_object", shape="cube")


@step(wait=2, undo=1)
def index():
    socket().default_value = -1.3
    pushed("Index")


@step(wait=2, undo=1)
def keyframe():
    socket().keyframe_insert("default_value", frame=1)
    pushed("First Keyframe")


@step(wait=2)
def animated():
    scene = lab.window().scene
    scene.frame_set(20)
    socket().default_value = -2.0
    socket().keyframe_insert("default_value", frame=20)
    pushed("Second Keyframe")
    scene.frame_set(10)
    needs(-2.0 < socket().default_value < -1.3, f"n is {socket().default_value} between two keyframes")
    scene.frame_set(1)
    pushed("Frame")


# ------------------------------------------------------------------------------------------------ checks, caustics


@step(wait=2, shot=False)
def surroundings():
    world = lab.window().scene.world = bpy.data.worlds.new("World")
    world.color = (0.05, 0.05, 0.05)
    press("mesh.primitive_plane_add", size=12, location=(0, 0, -2))
    press("object.light_add", type="SPOT", location=(3, -2, 6), rotation=(0.35, 0.45, 0))
    lab.window().scene.objects["Spot"].data.energy = 1000
    lab.window().scene.objects["Spot"].data.spot_size = 0.5
    press("object.camera_add", location=(7, -7, 5), rotation=(1.05, 0, 0.785))
    lab.window().scene.camera = lab.window().scene.objects["Camera"]
    select("Cube")
    pushed("Surroundings")


@step(wait=3)
def problems():
    needs(ours("ui.warnings").found(lab.window().scene), "the checks find nothing, though the engine is not Cycles")
    scroll(14)


@step(wait=4, undo=1)
def mended():
    scroll(14, down=False)
    press("nim.mend")


@step(wait=2)
def hint():
    needs(ours("ui.warnings").known(lab.window().scene).hints, "no hint that caustics are to be baked")


def caustics_baked():
    return ours("ui.caustics_bake").under_way() is None


@step(wait=caustics_baked, undo=1)
def caustics():
    baking = lab.window().scene.nim_caustics
    baking.photons, baking.texels = 1, "512"
    press("nim.bake_caustics")


@step(wait=rendered(25))
def caustics_seen():
    press("view3d.view_camera")
    press("nim.view_rendered")
    shading("RENDERED")  # without overlays


@step(wait=2, shot=False)
def nodes():
    shading("SOLID")
    show("ShaderNodeTree")
    event("MOUSEMOVE", "NOTHING", at=(900, 160))
    sidebar("NODE_EDITOR", "NIM")


@step(wait=3)
def node_sidebar():
    lab.window().scene.nim_curve.angle = 0
    press("node.view_all", "NODE_EDITOR")


@step(wait=3)
def probe():
    lab.window().scene.nim_curve.angle = 1.1


@step(wait=1, shot=False)
def curve_copied():
    press("nim.copy_curve", "NODE_EDITOR", material=lab.window().scene.objects["Cube"].active_material.name_full)
    clipboard = bpy.context.window_manager.clipboard
    needs(clipboard.startswith("theta_i") and len(clipboard.splitlines()) > 80, f"copied: {clipboard[:60]!r}")


@step(wait=2)
def node_menu():
    event("MOUSEMOVE", "NOTHING")
    press("wm.call_menu", "NODE_EDITOR", name="NIM_MT_add_node")


@step(wait=1, shot=False)
def node_menu_closed():
    key("ESC")


# ------------------------------------------------------------------------------------------------ light paths


@step(wait=3, shot=False)
def back_in_the_view():
    show("VIEW_3D")
    sidebar("VIEW_3D", "NIM")
    select("Cube")


@step(wait=2)
def rays_off():
    event("MOUSEMOVE", "NOTHING", at=(60, 60))  # no ray is there to be read
    lab.window().scene.nim_rays.rays = 11
    press("view3d.view_axis", type="FRONT")
    press("view3d.view_selected")
    lab.area("VIEW_3D").spaces.active.region_3d.view_distance *= 2.2


def looked():
    """Whether live light paths are those of the scene as it is: on a busy machine what is deferred comes late."""
    return ours("ui.live_look").LOOKS.is_fresh(lab.window().scene)


@step(wait=looked)
def rays_live():
    press("nim.light_paths_live")


@step(wait=looked)
def rays_live_changed():
    noted["lines"] = len(ours("ui.live_look").known(lab.window().scene).lines.ends)
    needs(noted["lines"], "live light paths have no lines")
    lab.window().scene.frame_set(20)
    pushed("Frame")


@step(wait=looked, undo=1)
def handle():
    press("nim.light_handle")


@step(wait=looked)
def handle_turned():
    lab.window().scene.nim_rays.handle.rotation_euler.y -= 0.15  # and still meets the cube
    pushed("Turn")


def over_ray():
    """A place on a line of the live light paths."""
    ends = ours("ui.live_look").known(lab.window().scene).lines.ends.reshape(-1, 2, 3)
    places = (where(tuple(0.5 * (first + last))) for first, last in ends)
    return next((x, y) for x, y in places if 300 < x < 900 and 300 < y < 800)


def is_read():
    return noted.get("words")


@step(wait=is_read)
def reading():
    overheard(ours("ui.live_views"), "words")
    at = over_ray()
    event("MOUSEMOVE", "NOTHING", at=(at[0] + 3, at[1]))
    event("MOUSEMOVE", "NOTHING", at=at)


@step(wait=3, undo=1)
def curves():
    select("Cube")
    lab.window().scene.nim_rays.source = "SIDE"
    press("nim.light_paths")


@step(wait=2, undo=1)
def curves_cleared():
    press("nim.light_paths_clear")


@step(wait=2)
def rays_off_again():
    press("nim.light_paths_live")
    lab.window().scene.frame_set(1)
    pushed("Frame")


# ------------------------------------------------------------------------------------------------ EEVEE, the render


@step(wait=2)
def eevee():
    lab.area("VIEW_3D").spaces.active.shading.type = "MATERIAL"
    engine = ours("ui.viewport").wrong_engine(lab.area("VIEW_3D").spaces.active, lab.window().scene)
    needs(engine == "EEVEE", f"Material Preview is told to be drawn by {engine}")


@step(wait=half_done)
def render_this():
    shading("SOLID")
    scene = lab.window().scene
    scene.render.resolution_percentage, scene.cycles.samples = 15, 256
    scene.cycles.use_denoising = False  # for which not every build has what it takes
    press("view3d.view_camera")
    press("nim.render_scene")
    unfolded("NIM_PT_render")
    soon(lambda: scroll(14))


@step(wait=all_done)
def render_done():
    pass


@step(wait=1, shot=False)
def rendered_whole():
    job = ours("ui.jobs").job()
    needs(not job.problem and job.files and all(file.exists() for file in job.files), f"the render: {job.problem}")


@step(wait=1, shot=False)
def up_again():
    scroll(14, down=False)
    folded_again()

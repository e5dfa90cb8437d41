# SPDX-License-Identifier: GPL-3.0-or-later
"""The example scenes."""

import bpy
import lab
from hands import (
    all_done,
    half_done,
    key,
    material_tab,
    needs,
    ours,
    press,
    scroll,
    select,
    settings,
    shading,
    socket,
)
from telling import rendered, step

# ------------------------------------------------------------------------------------------------ example scenes


@step(wait=3, undo=1)
def sphere():
    settings().scene = "sphere"
    press("nim.build_scene")


@step(wait=rendered(40))
def sphere_rendered():
    shading("RENDERED")


@step(wait=rendered(40))
def sphere_changed():
    select("Sphere")
    material_tab()
    lab.window().scene.objects["Sphere"].active_material.nim.n_inside = -2.2


@step(wait=3)
def asked():
    shading("SOLID")
    press("nim.build_scene")


@step(wait=2, shot=False)
def answered():
    key("RET")


def has_followed():
    return abs(socket("Sphere").default_value + 2) < 1e-5


@step(wait=has_followed)
def live_on():
    bpy.context.window_manager.nim_live = True
    settings().sphere.n = -2.0


@step(wait=2)
def live_built():
    bpy.context.window_manager.nim_live = False


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


@step(wait=rendered(30))
def glass():
    settings().scene = "glass"
    press("nim.build_scene")
    shading("RENDERED")


@step(wait=rendered(30))
def pool_window():
    shading("SOLID")
    settings().scene = "pool"
    press("nim.build_scene")
    settings().pool.view = "window"
    press("nim.build_scene")
    shading("RENDERED")


@step(wait=half_done)
def in_background():
    shading("SOLID")
    settings().scene = "sphere"
    settings().quality = "DRAFT"
    press("nim.render_headless")
    scroll(30)


@step(wait=all_done, shot=False)
def in_background_done():
    scroll(30, down=False)


@step(wait=all_done)
def variants():
    group = lab.window().scene.nim_variants
    group.sphere, group.sphere_values = "n", "-1.5, 1.5"
    press("nim.render_variants")


@step(wait=3)
def result():
    job = ours("ui.jobs").job()
    needs(not job.problem and job.files, f"the variants: {job.problem}")
    lab.area("PROPERTIES").ui_type = "IMAGE_EDITOR"
    press("nim.open_result")

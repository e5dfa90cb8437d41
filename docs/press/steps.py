# SPDX-License-Identifier: GPL-3.0-or-later
"""From an empty Blender with a window to every screen of the pages: only what a person presses and drags.

Run by press.py inside the lab's Blender. PRESS_ZIP is the extension, PRESS_OUT the folder that the pictures go to.
"""

import os
import sys
import urllib.parse
import webbrowser
from pathlib import Path

import bpy
import lab

sys.path.insert(0, os.environ["PRESS_HERE"])

from bpy_extras.view3d_utils import location_3d_to_region_2d
from telling import OUT, begin, rendered, step

ZIP = os.environ["PRESS_ZIP"]
MODULE = "bl_ext.user_default.nim_addon"
MATERIALS, SCENES = "6f0c1c5e-9c1b-4b52-8d0e-2b7a3f5e1a11", "6f0c1c5e-9c1b-4b52-8d0e-2b7a3f5e1a15"  # catalogues
KEYS = {" ": "SPACE"}
noted = {}  # from one step to a later one
opened = []  # addresses
webbrowser.open = lambda address, *_, **__: opened.append(address) or True


def ours(name):
    """A module of the add-on."""
    return sys.modules[f"{MODULE}.{name}"]


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


def scroll(turns, down=True):
    """Turn the wheel over the sidebar."""
    for _ in range(turns):
        press("view2d.scroll_down" if down else "view2d.scroll_up", region="UI")


def event(kind, value="PRESS", at=(500, 500), **more):
    """A key, or the mouse, as Blender is told of it."""
    lab.window().event_simulate(type=kind, value=value, x=at[0], y=at[1], **more)


def key(kind, at=(500, 500)):
    """Press a key and let it go."""
    event(kind, at=at)
    event(kind, "RELEASE", at=at)


def typed(text):
    """Type a text."""
    for letter in text:
        for value in ("PRESS", "RELEASE"):
            event(KEYS.get(letter, letter.upper()), value, unicode=letter)


def settings():
    return lab.window().scene.nim_scenes


def shading(kind):
    view = lab.area("VIEW_3D").spaces.active
    view.shading.type = kind
    view.overlay.show_overlays = kind != "RENDERED"


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


def pushed(what):
    """A step of the undo stack, as Blender makes one where a person changes a value."""
    bpy.ops.ed.undo_push(message=what)


def socket(name="Cube"):
    """n inside, of the interface that an object wears."""
    nodes = lab.window().scene.objects[name].active_material.node_tree.nodes
    return next(node.inputs["Index Inside"] for node in nodes if "Index Inside" in node.inputs)


def middle_of(space):
    area = lab.area(space)
    return area.x + area.width // 2, area.y + area.height // 2


def where(place):
    """Where a place of the scene is on the screen."""
    area = lab.area("VIEW_3D")
    region = next(one for one in area.regions if one.type == "WINDOW")
    at = location_3d_to_region_2d(region, area.spaces.active.region_3d, place)
    return int(at.x + region.x), int(at.y + region.y)


def needs(holds, what):
    """Fail unless that holds."""
    if not holds:
        raise AssertionError(what)


# ------------------------------------------------------------------------------------------------ installed


@step()
def install():
    bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
    needs(MODULE in bpy.context.preferences.addons, "the add-on is not enabled")
    preferences = bpy.context.preferences.addons[MODULE].preferences
    preferences.folder = OUT + "/renders"
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
    press("wm.call_menu", name="VIEW3D_MT_mesh_add")


@step(wait=1, shot=False)
def menu_closed():
    key("ESC")


@step(wait=3, undo=True)
def nim_cube():
    press("nim.add_object", shape="cube")


@step(wait=2, undo=True)
def index():
    socket().default_value = -1.3
    pushed("Index")


@step(wait=2, undo=True)
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


@step(wait=2, shot=False)
def nodes():
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


# ------------------------------------------------------------------------------------------------ checks, caustics


@step(wait=2, shot=False)
def surroundings():
    show("VIEW_3D")
    sidebar("VIEW_3D", "NIM")
    press("mesh.primitive_plane_add", size=12, location=(0, 0, -2))
    press("object.light_add", type="SPOT", location=(3, -2, 6), rotation=(0.35, 0.45, 0))
    lab.window().scene.objects["Spot"].data.energy = 2000
    lab.window().scene.objects["Spot"].data.spot_size = 0.5
    press("object.camera_add", location=(7, -7, 5), rotation=(1.05, 0, 0.785))
    lab.window().scene.camera = lab.window().scene.objects["Camera"]
    select("Cube")
    pushed("Surroundings")


@step(wait=3)
def problems():
    needs(ours("ui.warnings").found(lab.window().scene), "the checks find nothing, though the engine is not Cycles")
    scroll(14)


@step(wait=4, undo=True)
def mended():
    scroll(14, down=False)
    press("nim.mend")


@step(wait=2)
def hint():
    needs(ours("ui.warnings").known(lab.window().scene).hints, "no hint that caustics are to be baked")


def caustics_baked():
    return ours("ui.caustics_bake").under_way() is None


@step(wait=caustics_baked, undo=True)
def caustics():
    baking = lab.window().scene.nim_caustics
    baking.photons, baking.texels = 1, "512"
    press("nim.bake_caustics")


@step(wait=rendered(25))
def caustics_seen():
    press("view3d.view_camera")
    shading("RENDERED")


# ------------------------------------------------------------------------------------------------ light paths


@step(wait=2)
def rays_off():
    shading("SOLID")
    select("Cube")
    press("view3d.view_axis", type="FRONT")
    press("view3d.view_selected")
    lab.area("VIEW_3D").spaces.active.region_3d.view_distance *= 1.6


@step(wait=4)
def rays_live():
    press("nim.light_paths_live")


@step(wait=4)
def rays_live_changed():
    noted["lines"] = len(ours("ui.live_look").known(lab.window().scene).lines.ends)
    needs(noted["lines"], "live light paths have no lines")
    lab.window().scene.frame_set(20)


@step(wait=3, undo=True)
def handle():
    press("nim.light_handle")


@step(wait=3)
def handle_turned():
    lab.window().scene.nim_rays.handle.rotation_euler.y += 0.3


def over_ray():
    """A place on a line of the live light paths."""
    ends = ours("ui.live_look").known(lab.window().scene).lines.ends.reshape(-1, 2, 3)
    return where(tuple(0.5 * (ends[0][0] + ends[0][1])))


@step(wait=2)
def reading():
    at = over_ray()
    event("MOUSEMOVE", "NOTHING", at=(at[0] + 3, at[1]))
    event("MOUSEMOVE", "NOTHING", at=at)


@step(wait=3, undo=True)
def curves():
    select("Cube")
    lab.window().scene.nim_rays.source = "SIDE"
    press("nim.light_paths")


@step(wait=2, undo=True)
def curves_cleared():
    press("nim.light_paths_clear")


@step(wait=2)
def rays_off_again():
    press("nim.light_paths_live")
    lab.window().scene.frame_set(1)


# ------------------------------------------------------------------------------------------------ EEVEE, the render


@step(wait=lambda: not bpy.app.is_job_running("SHADER_COMPILATION"))
def eevee():
    lab.area("VIEW_3D").spaces.active.shading.type = "MATERIAL"
    engine = ours("ui.viewport").wrong_engine(lab.area("VIEW_3D").spaces.active, lab.window().scene)
    needs(engine == "EEVEE", f"Material Preview is told to be drawn by {engine}")


def all_done():
    return not ours("ui.jobs").job().running


@step(wait=all_done)
def render_this():
    shading("SOLID")
    scene = lab.window().scene
    scene.render.resolution_percentage, scene.cycles.samples = 15, 8
    press("view3d.view_camera")
    press("nim.render_scene")


@step(wait=2)
def render_done():
    job = ours("ui.jobs").job()
    needs(not job.problem and job.files and all(file.exists() for file in job.files), f"the render: {job.problem}")
    scroll(14)


@step(wait=1, shot=False)
def up_again():
    scroll(14, down=False)


# ------------------------------------------------------------------------------------------------ example scenes


@step(wait=3, undo=True)
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


@step(wait=2)
def live_on():
    bpy.context.window_manager.nim_live = True
    noted["n"] = socket("Sphere").default_value
    settings().sphere.n = -2.0


@step(wait=2)
def live_built():
    built = socket("Sphere").default_value
    needs(abs(built + 2) < 1e-5, f"Live has not followed n = -2: it is {built}")
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


def half_done():
    job = ours("ui.jobs").job()
    return job.progress()[0] > 0.3 or not job.running


@step(wait=half_done)
def headless():
    shading("SOLID")
    settings().scene = "sphere"
    settings().quality = "DRAFT"
    press("nim.render_headless")


@step(wait=all_done)
def headless_done():
    pass


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


# ------------------------------------------------------------------------------------------------ a file as it begins


@step(shot=False)
def new_file():
    bpy.ops.wm.read_homefile(app_template="", use_empty=False, use_factory_startup=False)


@step(wait=2, shot=False)
def tab_of_the_new_file():
    shading("SOLID")
    sidebar("VIEW_3D", "NIM")


@step(wait=8, undo=True)
def cube():
    press("nim.convert")


@step(wait=3)
def checks():
    scroll(14)


@step(wait=1, shot=False)
def back_up():
    scroll(14, down=False)


@step(wait=4, undo=True)
def cube_mended():
    press("nim.mend")


@step(wait=rendered(30))
def cube_rendered():
    material_tab()  # not before: with EEVEE still on, its icon would take a processor without a graphics card minutes
    # something to be seen through it
    press("mesh.primitive_plane_add", size=20, location=(0, 0, -1.01))
    press("mesh.primitive_monkey_add", location=(-1.9, 2.6, 0))
    select("Cube")
    shading("RENDERED")


@step(wait=2, undo=True)
def taken_back():
    shading("SOLID")
    press("nim.revert")


@step(wait=2, undo=True)
def glass_kept():
    """Text that is made negative-index, and a glass whose index is kept."""
    press("object.text_add", location=(3, 0, 0))
    material = bpy.data.materials.new("Bottle")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, out = tree.nodes.new("ShaderNodeBsdfGlass"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["IOR"].default_value = 1.7
    tree.links.new(shader.outputs[0], out.inputs["Surface"])
    lab.window().scene.objects["Text"].data.materials.append(material)
    pushed("Glass")


@step(wait=3, undo=True)
def text_made():
    press("nim.convert")
    value = socket("Text").default_value
    needs(abs(value + 1.7) < 1e-5, f"a glass of 1.7 has become {value}")


@step(wait=2)
def pie():
    event("MOUSEMOVE", "NOTHING", at=middle_of("VIEW_3D"))
    press("wm.call_menu_pie", name="NIM_MT_pie")


@step(wait=1, shot=False)
def pie_closed():
    key("ESC", at=middle_of("VIEW_3D"))


@step(wait=2)
def object_menu():
    press("wm.call_menu", name="NIM_MT_object")


@step(wait=1, shot=False)
def object_menu_closed():
    key("ESC")


@step(wait=2)
def searched():
    event("MOUSEMOVE", "NOTHING", at=middle_of("VIEW_3D"))
    key("F3", at=middle_of("VIEW_3D"))
    soon(lambda: typed("caustic"))


@step(wait=1, shot=False)
def search_closed():
    key("ESC")
    key("ESC")


# ------------------------------------------------------------------------------------------------ help


def page_exists(address):
    """Whether an address is of a page that was installed, with that section."""
    parts = urllib.parse.urlsplit(address)
    page = Path(urllib.parse.unquote(parts.path))
    return page.is_file() and (not parts.fragment or f'id="{parts.fragment}"' in page.read_text())


@step(wait=1, shot=False)
def helped():
    pages = {panel.page for panel in bpy.types.Panel.__subclasses__() if getattr(panel, "page", "")}
    needs(len(pages) > 6, f"only {len(pages)} panels have a page")
    for page in sorted(pages):
        press("nim.help", page=page)
    press("wm.doc_view_manual", doc_id="nim.bake_caustics")
    press("wm.doc_view_manual", doc_id="NIM_PG_rays.rays")
    needs(len(opened) == len(pages) + 2, f"{len(pages) + 2} buttons have opened {opened}")
    missing = [address for address in opened if not page_exists(address)]
    needs(not missing, f"no such page: {missing}")


# ------------------------------------------------------------------------------------------------ Spanish


@step(wait=3)
def spanish():
    view = bpy.context.preferences.view
    view.language, view.use_translate_interface = "es", True
    select("Cube")


@step(wait=2)
def spanish_below():
    scroll(14)


@step(wait=2, shot=False)
def english():
    scroll(14, down=False)
    bpy.context.preferences.view.language = "en_US"


# ------------------------------------------------------------------------------------------------ assets


def browser():
    return lab.area("FILE_BROWSER")


def tile():
    """Where the first asset stands."""
    region = next(one for one in browser().regions if one.type == "WINDOW")
    return region.x + 60, region.y + region.height - 70


def drag(start, end):
    """Drag with the left button, as Blender is told of it bit by bit."""
    event("MOUSEMOVE", "NOTHING", at=start)

    def away():
        event("LEFTMOUSE", at=start)
        for part in range(1, 13):
            at = tuple(int(a + (b - a) * part / 12) for a, b in zip(start, end, strict=True))
            event("MOUSEMOVE", "NOTHING", at=at)

    def drop():
        event("MOUSEMOVE", "NOTHING", at=end)
        event("LEFTMOUSE", "RELEASE", at=end)

    bpy.app.timers.register(away, first_interval=1.0)
    bpy.app.timers.register(drop, first_interval=4.0)


def library(catalog):
    """Open our library in the browser."""

    def choose():
        browser().spaces.active.params.asset_library_reference = "Negative-Index Materials"
        browser().spaces.active.params.catalog_id = catalog

    soon(choose)


@step(wait=8)
def assets():
    press("nim.register_assets")
    areas = lab.window().screen.areas
    min(
        (area for area in areas if area.type in ("DOPESHEET_EDITOR", "TIMELINE")), key=lambda area: area.y
    ).ui_type = "ASSETS"
    library(MATERIALS)


@step(wait=3, shot=False)
def taller():
    area = browser()
    start = area.x + area.width // 2, area.y + area.height + 1
    drag(start, (start[0], start[1] + 260))


@step(wait=6, shot=False)
def other_cube():
    press("nim.revert")
    press("object.select_all", action="DESELECT")
    press("view3d.view_axis", type="FRONT")


@step(wait=8, undo=True)
def material_dragged():
    drag(tile(), where(lab.window().scene.objects["Cube"].matrix_world.translation))


@step(wait=4, shot=False)
def scenes_of_the_library():
    library(SCENES)


@step(wait=8, undo=True)
def scene_dragged():
    x, y = middle_of("VIEW_3D")
    drag(tile(), (x - 150, y - 60))


begin()

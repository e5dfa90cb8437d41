# SPDX-License-Identifier: GPL-3.0-or-later
"""A file as Blender begins it: converting, menus, help, Spanish, the asset library."""

import urllib.parse
import webbrowser
from pathlib import Path

import bpy
import lab
from hands import (
    drag,
    event,
    key,
    material_tab,
    middle_of,
    needs,
    noted,
    ours,
    pixels,
    press,
    pushed,
    scroll,
    select,
    shading,
    sidebar,
    socket,
    soon,
    typed,
    where,
)
from telling import rendered, step

MATERIALS, SCENES = "6f0c1c5e-9c1b-4b52-8d0e-2b7a3f5e1a11", "6f0c1c5e-9c1b-4b52-8d0e-2b7a3f5e1a15"  # catalogues
opened = []  # addresses
webbrowser.open = lambda address, *_, **__: opened.append(address) or True


# ------------------------------------------------------------------------------------------------ a file as it begins


@step(shot=False)
def new_file():
    bpy.ops.wm.read_homefile(app_template="", use_empty=False, use_factory_startup=False)


@step(wait=2, shot=False)
def tab_of_the_new_file():
    shading("SOLID")
    sidebar("VIEW_3D", "NIM")


@step(wait=2, undo=1)
def cube():
    press("nim.convert")


@step(wait=3)
def checks():
    scroll(14)


@step(wait=1, shot=False)
def back_up():
    scroll(14, down=False)


@step(wait=2, undo=1)
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


@step(wait=2, undo=1)
def taken_back():
    shading("SOLID")
    press("nim.revert")


@step(wait=2, undo=1)
def text():
    press("object.text_add", location=(3, 0, 0))


@step(wait=2, undo=1)
def glass_worn():
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


@step(wait=3, undo=1)
def text_made():
    press("nim.convert")
    value = socket("Text").default_value
    needs(abs(value + 1.7) < 1e-5, f"a glass of 1.7 has become {value}")


@step(wait=2)
def pie():
    event("MOUSEMOVE", "NOTHING", at=middle_of("VIEW_3D"))
    press("wm.call_menu_pie", name="NIM_MT_pie_context_menu")


@step(wait=1, shot=False)
def pie_closed():
    key("ESC", at=middle_of("VIEW_3D"))


@step(wait=2)
def object_menu():
    press("wm.call_menu", name="NIM_MT_object")


@step(wait=1, shot=False)
def object_menu_closed():
    key("ESC")


@step(wait=1.5, shot=False)
def search_opened():
    event("MOUSEMOVE", "NOTHING", at=middle_of("VIEW_3D"))
    key("F3", at=middle_of("VIEW_3D"))


@step(wait=2)
def searched():
    typed("caustic", middle_of("VIEW_3D"))


@step(wait=1, shot=False)
def search_closed():
    key("ESC", at=middle_of("VIEW_3D"))
    key("ESC", at=middle_of("VIEW_3D"))


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


def top_of_tile():
    """Its pixels, as far as they are to be seen before the browser is made taller, and how many colours they have."""
    x, y = tile()
    return pixels((x, y + 45), 80, 24)


def filled():
    """Whether the first asset's picture is there, and another one than before."""
    shown, colors = top_of_tile()
    return colors > 50 and shown != noted.get("tile")


def library(catalog):
    """Open a catalogue of our library in the browser."""

    def choose():
        browser().spaces.active.params.asset_library_reference = "Negative-Index Materials"
        browser().spaces.active.params.catalog_id = catalog

    soon(choose)


@step(wait=filled)
def assets():
    press("nim.register_assets")
    areas = lab.window().screen.areas
    min(
        (area for area in areas if area.type in ("DOPESHEET_EDITOR", "TIMELINE")), key=lambda area: area.y
    ).ui_type = "ASSETS"
    library(MATERIALS)


@step(wait=lambda: browser().height > noted["height"] + 200, shot=False)
def taller():
    area = browser()
    noted["height"] = area.height
    start = area.x + area.width // 2, area.y + area.height + 1
    drag(start, (start[0], start[1] + 260))


@step(wait=2, shot=False)
def other_cube():
    press("object.select_all", action="DESELECT")
    press("view3d.view_axis", type="FRONT")


def is_dropped():
    material = lab.window().scene.objects["Cube"].active_material
    return material is not None and ours("ui.material_values").active_node(material) is not None


@step(wait=is_dropped, undo=1)
def material_dragged():
    drag(tile(), where(lab.window().scene.objects["Cube"].matrix_world.translation))


@step(wait=1, shot=False)
def material_is_ours_to_change():
    material = lab.window().scene.objects["Cube"].active_material
    needs(ours("ui.material_values").active_node(material), f"{material.name} is not of the library")
    needs(material.is_editable, f"{material.name} cannot be changed: it is linked")


@step(wait=filled, shot=False)
def scenes_of_the_library():
    noted["tile"] = top_of_tile()[0]
    library(SCENES)


@step(wait=lambda: len(lab.window().scene.objects) > noted["objects"], undo=2)
def scene_dragged():
    noted["objects"] = len(lab.window().scene.objects)
    x, y = middle_of("VIEW_3D")
    drag(tile(), (x - 150, y - 60))

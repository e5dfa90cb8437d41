# SPDX-License-Identifier: GPL-3.0-or-later
"""The tab as a whole: in which order its panels stand, and which of them are open."""

import ast
from pathlib import Path
from types import SimpleNamespace

import blf
import bpy

from nim_addon import ui
from nim_addon.cycles.closures import CLOSURES
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.visibility import CAUSTICS_MARK
from nim_addon.physics import Medium
from nim_addon.ui import translations, warnings
from nim_addon.ui.light_settings import LEGENDS

from .conftest import Layout

FOLDED = "_folded"


def tab():
    """The panels of the tab in a 3D view, in their order; each of which Blender draws those below it too."""
    panels = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("NIM_PT_")]
    panels = [panel for panel in panels if panel.bl_space_type == "VIEW_3D"]
    return sorted(
        (panel for panel in panels if not getattr(panel, "bl_parent_id", "")), key=lambda panel: panel.bl_order
    )


def shown(context):
    """Of those, the names of what is drawn, in order, and what of it is folded at first."""
    drawn = [panel for panel in tab() if not hasattr(panel, "poll") or panel.poll(context)]
    return [panel.bl_idname for panel in drawn], [
        panel.bl_idname for panel in drawn if "DEFAULT_CLOSED" in getattr(panel, "bl_options", ())
    ]


def looked():
    warnings.forget()
    warnings.LOOKS.renew(bpy.context.scene.session_uid)


def test_the_tab_is_in_the_order_of_the_work_and_ends_with_the_example_scenes(addon, press):
    looked()
    names, folded = shown(bpy.context)
    assert names[:4] == ["NIM_PT_convert", "NIM_PT_checks", "NIM_PT_caustics", "NIM_PT_light_paths"]
    assert names[-1] == "NIM_PT_scenes" and names[-1] not in folded, "open where nothing is negative-index yet"
    press("nim.convert")
    looked()
    names, folded = shown(bpy.context)
    assert names[0] == "NIM_PT_convert" and names[-1] == "NIM_PT_scenes_folded" and names[-1] in folded
    press("nim.build_scene")
    looked()
    assert shown(bpy.context)[0][-1] == "NIM_PT_scenes", "open in one of them"


def test_what_belongs_to_the_example_scenes_stands_under_both_of_their_panels(addon):
    panels = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("NIM_PT_")]
    below = {panel.bl_idname: panel.bl_parent_id for panel in panels if getattr(panel, "bl_parent_id", "")}
    assert below and set(below.values()) == {"NIM_PT_scenes", f"NIM_PT_scenes{FOLDED}"}
    for name, parent in below.items():
        assert name.endswith(FOLDED) == parent.endswith(FOLDED)
        assert f"{name}{FOLDED}" in below or name.endswith(FOLDED)


def choices():
    """(class or kind, property, item) of every choice that the add-on gives a person."""
    owners = [(kind.__name__, kind) for kind in (bpy.types.Scene, bpy.types.Material, bpy.types.Object)]
    for cls in (cls for module in ui.MODULES for cls in getattr(module, "CLASSES", ())):
        is_operator = issubclass(cls, bpy.types.Operator)
        owner = getattr(bpy.ops.nim, cls.bl_idname.removeprefix("nim.")).get_rna_type() if is_operator else cls
        owners.append((cls.__name__, owner))
    for name, owner in owners:
        # panels, menus and gizmos have choices of Blender's own
        if isinstance(owner, type) and not issubclass(owner, bpy.types.PropertyGroup | bpy.types.ID):
            continue
        for known in owner.bl_rna.properties:
            if known.type == "ENUM" and (name.startswith(("NIM_", "nim_")) or known.identifier.startswith("nim")):
                for item in known.enum_items:
                    yield name, known.identifier, item


def test_every_choice_has_a_tooltip_that_says_more_than_its_name(addon):
    found = list(choices())
    assert len({(name, identifier) for name, identifier, _ in found}) > 20
    silent = [
        (name, identifier, item.identifier)
        for name, identifier, item in found
        if len(item.description.strip()) <= len(item.name) / 2 or item.description == item.name
    ]
    assert not silent


# What there is room for at the sidebar's own width, in Blender's units, as measured in pictures of 4.3 and 5.2: the label
# before a value, the label behind a check box, what a menu shows of its choice (less an icon), and a line of its own.
BEFORE, BEHIND, CHOSEN, ICON, LINE = 88, 112, 116, 18, 210
NODE = 138  # before the value of a node's socket
# Of these the panels draw no labels, or labels over the whole width.
WIDE = {"NIM_PG_material", "NIM_PG_curve", "NIM_PG_object", "NIM_PG_former_slot"}
# These stand in the preferences.
PREFERENCES = {"blender_check.py", "preferences.py"}


def wide(text):
    """How wide Blender draws a text, in units at a scale of 1."""
    blf.size(0, 11)
    return blf.dimensions(0, text)[0]


def in_languages(text, context=None):
    """The text, and its translations as a label or, with the context "Operator", as a button."""
    known = [given.get((context, text), given.get((None, text), text)) for given in translations.LANGUAGES.values()]
    return {text, *known}


def labels():
    """(where, text, room, context) of what the panels of the sidebar show on a line, as far as it is known beforehand."""
    groups = [cls for module in ui.MODULES for cls in getattr(module, "CLASSES", ())]
    for cls in (cls for cls in groups if issubclass(cls, bpy.types.PropertyGroup) and cls.__name__ not in WIDE):
        for known in cls.bl_rna.properties:
            if known.identifier not in ("rna_type", "name"):
                yield (
                    f"{cls.__name__}.{known.identifier}",
                    known.name,
                    BEHIND if known.type == "BOOLEAN" else BEFORE,
                    None,
                )
            for item in known.enum_items if known.type == "ENUM" else ():
                room = CHOSEN - ICON * (item.icon != "NONE")
                yield f"{cls.__name__}.{known.identifier}.{item.identifier}", item.name, room, None
    for closure in CLOSURES:
        for socket in closure.sockets:
            yield f"socket {socket.identifier}", socket.name, NODE, None
    for color, text in LEGENDS.items():
        yield f"legend {color}", text, LINE, None
    for source in Path(ui.__file__).parent.glob("*.py"):
        for call in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            kind = getattr(getattr(call, "func", None), "attr", "")
            if kind not in ("label", "operator") or source.name in PREFERENCES:
                continue
            for text in (keyword.value for keyword in call.keywords if keyword.arg == "text"):
                if isinstance(text, ast.Constant):
                    yield source.name, text.value, LINE, "Operator" if kind == "operator" else None


def test_nothing_is_cut_off_at_the_sidebars_own_width(addon):
    found = list(labels())
    assert len(found) > 200
    cut = {
        (where, shown): (round(wide(shown)), room)
        for where, text, room, context in found
        for shown in in_languages(text, context)
        if wide(shown) > room
    }
    assert not cut


def read_off(object_, selected=None):
    """The lines of the panel, less its offer, for an active object, which alone is selected where no other are given."""
    layout = Layout()
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0, pixel_size=1.0))
    selected = [object_] if selected is None and object_ else selected or []
    selected = {"object": object_, "selected_objects": selected, "mode": "OBJECT"}
    region = SimpleNamespace(width=9000)
    context = SimpleNamespace(scene=bpy.context.scene, region=region, preferences=preferences, **selected)
    bpy.types.NIM_PT_convert.draw(SimpleNamespace(layout=layout), context)
    return [line for line in layout.text.splitlines() if line != "Ready materials and objects:"]


def test_the_panel_shows_what_modifiers_and_instances_wear(addon):
    cube = bpy.data.objects["Cube"]
    maker = bpy.data.objects.new("Maker", None)
    assert read_off(None) == ["Select an object with a surface"]
    assert read_off(maker) == ["Maker, the active object, has no surface."]
    assert read_off(cube) == ["Cube is not negative-index yet."]
    cube.data.materials.append(None)
    assert read_off(cube) == ["Material is not negative-index yet."], "of the slot that is chosen"
    cube.data.materials.pop()
    held = bpy.data.collections.new("Held")
    held.objects.link(bpy.data.objects.new("Inner", cube.data.copy()))
    maker.instance_type, maker.instance_collection = "COLLECTION", held
    nim = interface_material("Mine", Medium(-1.5), backend="nodes")
    held.objects[0].data.materials[0] = nim
    tree = bpy.data.node_groups.new("Wear", "GeometryNodeTree")
    tree.nodes.new("GeometryNodeSetMaterial").inputs["Material"].default_value = nim
    cube.modifiers.new("Wear", "NODES").node_group = tree
    assert read_off(maker)[0] == "Maker: Mine" and read_off(cube)[0] == "Cube: Mine"
    cube.data.materials[0] = interface_material("Own", Medium(-2.0), backend="nodes")
    assert read_off(cube)[0] == "Cube: Own"


def test_the_panel_speaks_of_what_is_selected(addon):
    cube, camera = bpy.data.objects["Cube"], bpy.data.objects["Camera"]
    other = bpy.data.objects.new("Other", cube.data.copy())
    none = ["Select an object with a surface"]
    assert read_off(cube, []) == none, "the active object is the last one, which nobody means"
    assert read_off(cube, [camera]) == none
    assert read_off(cube, [camera, other]) == ["Other is not negative-index yet."]
    cube.data.materials[0] = interface_material("Mine", Medium(-1.5), backend="nodes")
    assert read_off(cube, [])[0] == "Cube: Mine", "its numbers are of use"
    assert read_off(cube, [other]) == ["Other is not negative-index yet."]


def test_the_panel_says_of_a_copy_that_shines_that_its_surface_is_hidden(addon):
    cube = bpy.data.objects["Cube"]
    cube[CAUSTICS_MARK] = True  # as a bake does with its copies
    assert read_off(cube)[0].startswith("Cube shines for a surface that is hidden meanwhile: change that, not this.")


def test_light_paths_show_first_what_one_needs_and_keep_the_rest_folded(addon):
    layout = Layout()
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0, pixel_size=1.0))
    region = SimpleNamespace(width=300)
    context = SimpleNamespace(
        scene=bpy.context.scene, region=region, preferences=preferences, selected_objects=[], space_data=None
    )
    bpy.types.NIM_PT_light_paths.draw(SimpleNamespace(layout=layout), context)
    fold = layout.drawn.index(("panel", "NIM_rays"))
    first = [name for kind, name in layout.drawn[:fold] if kind == "prop"]
    assert first == ["source", "rays"]
    assert ("operator", "nim.light_paths") in layout.drawn[:fold], "the buttons stand above"
    rest = {name for kind, name in layout.drawn[fold:] if kind == "prop"}
    assert {"color", "aim", "arrangement", "roll", "bounces", "least", "fit", "through"} == rest

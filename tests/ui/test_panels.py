# SPDX-License-Identifier: GPL-3.0-or-later
"""The tab as a whole: in which order its panels stand, and which of them are open."""

import bpy

from nim_addon import ui
from nim_addon.ui import warnings

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
        # panels and menus have choices of Blender's own
        if isinstance(owner, type) and issubclass(owner, bpy.types.Panel | bpy.types.Menu):
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""Show the node group as a person sees it: run in Blender with a window, from the repository's root; take a screenshot."""

import os
import sys

sys.path.insert(0, os.getcwd())

import bpy

from nim_addon.cycles.material import NODE_NAME, interface_material
from nim_addon.physics import Medium

material = interface_material("Sphere", Medium(-1.5), backend="nodes")
bpy.context.view_layer.objects.active.material_slots[0].material = material
window = bpy.context.window_manager.windows[0]
areas = sorted(window.screen.areas, key=lambda area: area.width * area.height)
area = areas[-1]
area.type = "NODE_EDITOR"
area.ui_type = "ShaderNodeTree"
space = area.spaces.active
space.show_region_ui = space.show_region_toolbar = False
with bpy.context.temp_override(window=window, area=area):
    bpy.ops.screen.screen_full_area(use_hide_panels=True)
steps = []


def enter():
    """Once the editor is drawn: into the group; once that is drawn: all of it in view."""
    area = next(area for area in window.screen.areas if area.type == "NODE_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region, screen=window.screen):
        if not steps:
            node = material.node_tree.nodes[NODE_NAME]
            material.node_tree.nodes.active = node
            for other in material.node_tree.nodes:
                other.select = other == node
            bpy.ops.node.group_edit()
        else:
            bpy.ops.node.select_all(action="DESELECT")
            bpy.ops.node.view_all()
    steps.append(None)
    return 2.0 if len(steps) < 2 else None


bpy.app.timers.register(enter, first_interval=2.0)

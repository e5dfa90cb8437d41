# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person sees of the add-on inside Blender: preferences, panels, operators and menus."""

import bpy

from . import (
    add,
    assets,
    blender_check,
    caustics,
    caustics_bake,
    caustics_frames,
    convert,
    deferred,
    escape,
    floor,
    help,
    jobs,
    light_handle,
    light_live,
    light_paths,
    light_settings,
    light_view,
    live,
    material,
    material_values,
    menus,
    preferences,
    presets,
    probe,
    render_note,
    render_scene,
    scene_settings,
    scenes,
    sky,
    spectral,
    standing,
    sweep,
    translations,
    variants,
    versions,
    viewport,
    warnings,
)

# In the order in which they register: a module may use the classes of those before it.
MODULES = (
    translations,
    deferred,
    help,
    blender_check,
    preferences,
    versions,
    warnings,
    sky,
    viewport,
    render_note,
    material_values,
    probe,
    material,
    convert,
    add,
    scene_settings,
    presets,
    standing,
    scenes,
    live,
    escape,
    jobs,
    variants,
    sweep,
    spectral,
    caustics_bake,
    caustics_frames,
    floor,
    caustics,
    render_scene,
    light_settings,
    light_handle,
    light_live,
    light_view,
    light_paths,
    menus,
    assets,
)


def register():
    """Register every module's CLASSES and HANDLERS, then what else it adds (menus, properties), if anything.

    Raises what Blender raises.
    """
    for module in MODULES:
        for cls in getattr(module, "CLASSES", ()):
            bpy.utils.register_class(cls)
        for name, handler in getattr(module, "HANDLERS", ()):
            getattr(bpy.app.handlers, name).append(handler)
        if hasattr(module, "register"):
            module.register()


def unregister():
    """Take back what register() did, backwards."""
    for module in reversed(MODULES):
        if hasattr(module, "unregister"):
            module.unregister()
        for name, handler in getattr(module, "HANDLERS", ()):
            getattr(bpy.app.handlers, name).remove(handler)
        for cls in reversed(getattr(module, "CLASSES", ())):
            bpy.utils.unregister_class(cls)

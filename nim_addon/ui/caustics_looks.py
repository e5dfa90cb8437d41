# SPDX-License-Identifier: GPL-3.0-or-later
"""What the caustics panel knows of a scene: what shines there, what is baked, and whether that still holds."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface

from .. import caustics
from ..base.text import listed
from ..caustics import frames, landing, lights
from ..caustics.digest import forget_changed
from ..cycles.visibility import CAUSTICS_HIDDEN, CAUSTICS_MARK
from .looks import Looks

SETTLED = 0.3  # seconds without a redraw before a change is looked at: not while an object is dragged

MESHES = {}  # the marks of meshes, as caustics.digest keeps them


class Known:
    """What drawing needs to know of a scene."""

    def __init__(self, scene: bpy.types.Scene):
        self.lights = _names_of_lights(scene)
        self.lamps = listed(obj.name for obj in scene.objects if obj.type == "LIGHT" and not obj.get(CAUSTICS_MARK))
        collection = caustics.baked(scene)
        self.baked = collection is not None
        self.surfaces = surfaces_of(scene)
        self.report = report = frames.report_of(collection)  # a script's own bake says nothing of itself
        # photons of a bake that was stopped before it had traced them; else 0
        self.asked = report.get("asked", 0) if not report.get("settings") and "photons" in report else 0
        self.left = caustics.left(scene) or frames.frames_of(scene) is not None
        self.kept = frames.kept(scene, range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
        self.lacks_floor = landing.lacks_floor(scene)
        self.stale = self.baked and caustics.out_of_date(scene, MESHES)


def surfaces_of(scene: bpy.types.Scene) -> str:
    """Names of what the caustics of a scene lie on: "Floor, Wall, Table..."; empty where there are none."""
    return listed(obj.name for obj in scene.objects if obj.get(CAUSTICS_HIDDEN))


def _names_of_lights(scene):
    """What is traced, by its type: "Sun: Key; Spot: Left, Right"; empty where nothing shines."""
    names = {pgettext_iface("Sky"): [pgettext_iface("its sun")]} if lights.sun_of(scene) else {}
    for lamp in lights.lamps_of(scene):
        light_type = lamp.data.bl_rna.properties["type"].enum_items[lamp.data.type].name
        names.setdefault(pgettext_iface(light_type), []).append(lamp.name)
    return "; ".join(f"{light_type}: {', '.join(those)}" for light_type, those in names.items())


def _look(scene):
    known = Known(scene)
    # what the look has changed and put back is evaluated now, or it would be taken for a change later
    for layer in {scene.view_layers[0], *(window.view_layer for window in bpy.context.window_manager.windows)}:
        layer.update()
    return known


# What is being edited is not evaluated as it will be rendered.
LOOKS = Looks(_look, lambda: bpy.context.mode == "OBJECT", SETTLED)


def up_to_date(scene: bpy.types.Scene) -> bool:
    """Whether baking would give what is there, as far as that is known."""
    # without a window a look is at once, and nothing can be changed for it while Blender asks what can be pressed
    known = LOOKS.last(scene) if bpy.app.background else LOOKS.known(scene)
    settings = scene.nim_caustics
    if not LOOKS.is_fresh(scene) or known.stale or not known.report:
        return False
    return list(known.report.get("settings", ())) == [str(settings.photons), settings.texels, str(settings.seed)]


def left(scene: bpy.types.Scene) -> bool:
    """Whether there is anything to clear, from what is known if that is fresh."""
    if LOOKS.is_fresh(scene):
        return LOOKS.last(scene).left
    return caustics.left(scene) or frames.frames_of(scene) is not None


@persistent
def note_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Called by Blender after a change, or a change of the frame."""
    if depsgraph is not None:
        forget_changed(MESHES, depsgraph)
    if _counts(depsgraph):
        LOOKS.outdate(scene)


def _counts(depsgraph):
    """Whether an update can be of what is traced or named here. What is hidden is not evaluated, and comes without any."""
    updates = depsgraph.updates if depsgraph else ()
    return not len(updates) or any(_is_change(update) for update in updates)


def _is_change(update):
    changed = update.id
    id_type = changed.type if isinstance(changed, bpy.types.Object) else type(changed).__name__.upper()
    told = update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading
    return id_type == "LIGHT" or (told and id_type != "CAMERA")


@persistent
def forget(*_) -> None:
    """Forget what is known: another file, or another state of this one."""
    LOOKS.forget()
    MESHES.clear()

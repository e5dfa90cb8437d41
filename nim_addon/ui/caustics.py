# SPDX-License-Identifier: GPL-3.0-or-later
"""The caustics panel: what is traced from the lamps, and whether what is baked still holds."""

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface
from bpy.props import EnumProperty, IntProperty, PointerProperty

from ..base.text import duration
from ..caustics import MILLION, baked
from ..caustics.frames import frames_of, report_of
from . import caustics_bake, caustics_frames, caustics_looks, viewport
from .panels import Sidebar, draw_sentence

# Blender files hold these numbers.
SIZES = [
    ("512", "512", "4 MB for the largest surface", "NONE", 0),
    ("1024", "1024", "16 MB for the largest surface", "NONE", 1),
    ("2048", "2048", "64 MB for the largest surface", "NONE", 2),
    ("4096", "4096", "256 MB for the largest surface", "NONE", 3),
]


class NIM_PG_caustics(bpy.types.PropertyGroup):
    """How the caustics of a scene are traced: Scene.nim_caustics."""

    photons: IntProperty(
        name="Million Photons",
        description=(
            "How many are traced from all lamps together, in millions. A million takes a second or two; 4 draw a clean "
            "picture, 16 or more its finest lines"
        ),
        default=4,
        min=1,
        max=1000,
    )
    texels: EnumProperty(
        name="Texture Size",
        description="Edge of the texture of the surface where most light lands; the others get as many texels a photon",
        items=SIZES,
        default="2048",
    )
    seed: IntProperty(name="Seed", description="Another number gives other noise", default=0, min=0, max=2**20)


class NIM_PT_caustics(Sidebar, bpy.types.Panel):
    """Light that is bent and mirrored onto surfaces, traced from the lamps"""

    bl_idname = "NIM_PT_caustics"
    bl_label = "Caustics"
    page = "caustics"
    bl_order = 20

    def draw(self, context):
        layout = self.layout
        settings = context.scene.nim_caustics
        known = caustics_looks.LOOKS.known(context.scene)
        run = caustics_bake.under_way()
        row = layout.row(align=True)
        text = "Bake Again" if known and known.baked else "Bake Caustics"
        row.operator("nim.bake_caustics", text=text, icon="LIGHT_SUN")
        row.operator("nim.clear_caustics", text="", icon="TRASH")
        if run is not None:
            layout.progress(factor=run.part, text=run.text())
            layout.label(text="Esc: stop, and keep what is traced")
        elif known:
            if known.baked and not viewport.is_rendered(context.screen, context.scene):
                layout.operator("nim.view_rendered", icon="SHADING_RENDERED")
            _draw_known(layout, context, known)
        column = layout.column()
        column.enabled = run is None
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(settings, "photons")
        column.prop(settings, "texels")
        column.prop(settings, "seed")
        numbers = caustics_frames.range_of(context.scene)
        text = pgettext_iface("Bake Frames {} to {}").format(numbers.start, numbers.stop - 1)
        column.operator("nim.bake_caustics_frames", text=text, icon="RENDER_ANIMATION", translate=False)


def _draw_known(layout, context, known):
    column = layout.column(align=True)
    if known.kept:
        there, count = known.kept
        column.label(
            text=pgettext_iface("Frames kept: {} of {}").format(there, count), icon="RENDER_ANIMATION", translate=False
        )
    if known.kept and not known.baked:
        text = pgettext_iface("Nothing is kept of this frame, or the scene has changed since: bake the frames again")
        draw_sentence(column, context, text, "ERROR")
    elif not known.baked:
        column.label(text="No caustics yet", icon="INFO")
    elif known.stale:
        draw_sentence(column, context, pgettext_iface("Out of date: the scene has changed since"), "ERROR")
    elif known.asked:
        text = pgettext_iface("Stopped at {traced} of {asked} million photons: Bake Again traces them all").format(
            traced=caustics_bake.millions(known.report["photons"]), asked=caustics_bake.millions(known.asked)
        )
        draw_sentence(column, context, text, "INFO")
    else:
        column.label(text="Up to date", icon="CHECKMARK")
    if known.surfaces:
        text = pgettext_iface("Light lands on copies of {names}, hidden meanwhile").format(names=known.surfaces)
        draw_sentence(column, context, text, "BLANK1")
    if known.report and not {"photons", "seconds", "megabytes", "settings"} <= known.report.keys():
        text = pgettext_iface("How these were traced, by an early version, is not known: bake again")
        draw_sentence(column, context, text, "INFO")
    elif known.report:
        report = known.report
        text = pgettext_iface("{millions} million photons in {time}, {size:.0f} MB").format(
            millions=caustics_bake.millions(report["photons"]),
            time=duration(report["seconds"]),
            size=max(report["megabytes"], 1),
        )
        draw_sentence(column, context, text, "BLANK1")
    none = pgettext_iface("No lamp shines here: add a sun, a point, a spot or an area")
    if known.lamps:
        none = pgettext_iface(
            "No lamp shines here (hidden from renders, or without power: {names}). Let one shine, or add one"
        )
    draw_sentence(layout, context, known.lights or none.format(names=known.lamps), "LIGHT" if known.lights else "ERROR")
    if known.lacks_floor:
        draw_sentence(layout, context, pgettext_iface("Nothing is there for the bent light to land on"), "ERROR")
        layout.operator("nim.add_floor", icon="MESH_PLANE")


@persistent
def keep_photons(*_) -> None:
    """Called by Blender after it opened a file: what an earlier version baked by its default, 16 million, goes on with that."""
    for scene in bpy.data.scenes:
        kept, collection = frames_of(scene), baked(scene)
        settings = report_of(collection).get("settings")  # empty where the bake was stopped before its end
        photons = kept.photons // MILLION if kept else int(settings[0]) if settings else 0
        if photons and not scene.nim_caustics.is_property_set("photons"):
            scene.nim_caustics.photons = photons


CLASSES = (NIM_PG_caustics, NIM_PT_caustics)
HANDLERS = (
    ("depsgraph_update_post", caustics_looks.note_change),
    ("frame_change_post", caustics_looks.note_change),
    ("undo_post", caustics_looks.forget),
    ("redo_post", caustics_looks.forget),
    ("load_post", caustics_looks.forget),
    ("load_post", keep_photons),
)


def register():
    """Give every scene its settings."""
    bpy.types.Scene.nim_caustics = PointerProperty(
        type=NIM_PG_caustics, name="Caustics", description="How the caustics of this scene are traced"
    )


def unregister():
    """Take them back."""
    caustics_looks.forget()
    del bpy.types.Scene.nim_caustics

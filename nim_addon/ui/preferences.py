# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences."""

from types import SimpleNamespace

import bpy

from ..base.options import MOST_SAMPLES
from ..base.shipped import PACKAGE
from ..cycles import versions
from . import assets, backends, blender_check, menus

BACKENDS = (
    ("auto", "Automatic", "OSL where this Blender and the render device have it, else Blender's own nodes", "NONE", 0),
    ("osl", "OSL", backends.OSL, "NONE", 1),
    ("nodes", "Nodes", "The same optics in Blender's own nodes, for builds and devices without OSL", "NONE", 2),
)
DEFAULTS = {"backend": "auto", "samples": 128, "folder": "", "offer_assets": True}


class NIM_AP_preferences(bpy.types.AddonPreferences):
    """What holds for every file."""

    bl_idname = PACKAGE

    backend: bpy.props.EnumProperty(
        name="Backend",
        description="What new materials and scenes are made of",
        items=BACKENDS,
        default=DEFAULTS["backend"],
    )
    samples: bpy.props.IntProperty(
        name="Samples",
        description="Paths a pixel of new scenes",
        min=1,
        soft_max=4096,
        max=MOST_SAMPLES,
        default=DEFAULTS["samples"],
    )
    folder: bpy.props.StringProperty(
        name="Renders",
        description="Folder for background renders; empty: renders beside the file, or in the home folder before it is saved",
        subtype="DIR_PATH",
        default=DEFAULTS["folder"],
    )

    offer_assets: bpy.props.BoolProperty(
        name="Offer Assets",
        description="Offer the asset library in the panel, until it is added or declined",
        default=DEFAULTS["offer_assets"],
    )

    def draw(self, context):
        layout = self.layout
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        backends.draw_choice(column, self)
        column.prop(self, "samples")
        column.prop(self, "folder")

        menus.draw_key(layout, context)
        row = layout.row()
        row.operator("nim.unregister_assets" if assets.library() else "nim.register_assets", icon="ASSET_MANAGER")
        if versions.outdated():
            row.operator("nim.update_file", icon="FILE_REFRESH")
        row.operator("nim.check_blender", icon="CHECKMARK")
        blender_check.draw(layout)


def settings() -> NIM_AP_preferences | SimpleNamespace:
    """The add-on's preferences; where it is registered without being enabled, their defaults."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon and addon.preferences else SimpleNamespace(**DEFAULTS)


def draw_offer(layout: bpy.types.UILayout) -> None:
    """Draw the offer of the library, apart from what is above, until it is taken or declined once."""
    if settings().offer_assets and not assets.library():
        layout.separator()
        column = layout.column(align=True)
        column.label(text="Ready materials and objects:")
        row = column.row(align=True)
        row.operator("nim.register_assets", icon="ASSET_MANAGER")
        row.operator("nim.decline_assets", text="", icon="X")


class NIM_OT_decline_assets(bpy.types.Operator):
    """Offer the asset library no more; the add-on's preferences still have the button"""

    bl_idname = "nim.decline_assets"
    bl_label = "No Asset Library"
    bl_options = {"INTERNAL"}

    def execute(self, context):
        """Remember that in the preferences."""
        settings().offer_assets = False
        context.preferences.is_dirty = True
        return {"FINISHED"}


CLASSES = (NIM_AP_preferences, NIM_OT_decline_assets)


def register() -> None:
    """Nothing more than the class."""


def unregister() -> None:
    """Nothing more than the class."""

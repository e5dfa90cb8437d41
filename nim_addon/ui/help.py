# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages, from where a person needs them: a "?" on each panel, and Online Manual in each context menu."""

from __future__ import annotations

import fnmatch

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..base import shipped

# What a page tells of, as Blender writes it where a context menu asks for the manual: the first that fits is taken.
MANUAL = (
    ("bpy.ops.nim.register_assets*", "material#the-asset-library"),
    ("bpy.ops.nim.unregister_assets*", "material#the-asset-library"),
    ("bpy.ops.nim.check_blender*", "first-minutes#install"),
    ("bpy.ops.nim.mend*", "material#checks"),
    ("bpy.ops.nim.check_meshes*", "material#checks"),
    ("bpy.ops.nim.convert*", "material#making-and-taking-back"),
    ("bpy.ops.nim.revert*", "material#making-and-taking-back"),
    ("bpy.ops.nim.switch_backend*", "material#backends"),
    ("bpy.ops.nim.add_sky*", "material#checks"),
    ("bpy.ops.nim.add_floor*", "caustics"),
    ("bpy.ops.nim.add_*", "material#adding"),
    ("bpy.ops.nim.spectral*", "material#all-wavelengths-in-one-render"),
    ("bpy.ops.nim.*caustics*", "caustics"),
    ("bpy.ops.nim.light_*", "scenes#light-paths"),
    ("bpy.ops.nim.*sweep*", "many-machines"),
    ("bpy.ops.nim.build_scene*", "scenes#build"),
    ("bpy.ops.nim.load_*", "scenes#presets"),
    ("bpy.ops.nim.preset*", "scenes#presets"),
    ("bpy.ops.nim.copy_command*", "command-line#render"),
    ("bpy.ops.nim.render_scene*", "own-scene#render-in-the-background"),
    ("bpy.ops.nim.*render*", "scenes#render-the-example"),
    ("bpy.ops.nim.*", "material#where-the-buttons-are"),
    ("bpy.types.nim_ap_preferences.*", "first-minutes#install"),
    ("bpy.types.nim_pg_caustics.*", "caustics"),
    ("bpy.types.nim_pg_rays.*", "scenes#light-paths"),
    ("bpy.types.nim_pg_sweep.*", "many-machines"),
    ("bpy.types.nim_pg_render.*", "own-scene#render-in-the-background"),
    ("bpy.types.nim_pg_variants.*", "scenes#render-the-example"),
    ("bpy.types.nim_pg_scenes.*", "scenes"),
    ("bpy.types.nim_pg_glass.*", "scenes"),
    ("bpy.types.nim_pg_*", "material#the-panel"),
)


def section_of(operator: str) -> str:
    """The page, and its section, that tell of an operator, such as "nim.mend", as MANUAL has them."""
    return next(page for pattern, page in MANUAL if fnmatch.fnmatchcase(f"bpy.ops.{operator}", pattern))


def explained(operator: str, sentence: str) -> str:
    """What went wrong, translated already, with the section of the pages that tells of the operator."""
    title = section_of(operator).rpartition("#")[2].replace("-", " ").capitalize()
    end = "" if sentence.endswith((".", "?", "!")) else "."
    return f"{sentence}{end} " + rpt_('See "{}" in the help (?).').format(title)


def fail(operator: bpy.types.Operator, sentence: str) -> set[str]:
    """Report why an operator did not do what it is for, and where that is explained; returns what its execute() returns."""
    operator.report({"ERROR"}, explained(type(operator).bl_idname, sentence))
    return {"CANCELLED"}


class NIM_OT_help(bpy.types.Operator):
    """Open the page that explains this"""

    bl_idname = "nim.help"
    bl_label = "Help"
    bl_options = {"INTERNAL"}

    page: bpy.props.StringProperty(
        name="Page", description="Name of the page, and of its section", options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context):
        address = shipped.page(self.page)
        if not address:
            self.report({"ERROR"}, rpt_("The pages are missing from this installation: install the add-on again"))
            return {"CANCELLED"}
        return bpy.ops.wm.url_open(url=address)


def manual() -> tuple[str, tuple[tuple[str, str], ...]]:
    """What Blender asks for the manual: the beginning of all addresses, and of each pattern the rest."""
    return "", tuple((pattern, address) for pattern, page in MANUAL if (address := shipped.page(page)))


CLASSES = (NIM_OT_help,)


def register() -> None:
    """Tell Blender of the manual."""
    bpy.utils.register_manual_map(manual)


def unregister() -> None:
    """Take that back."""
    bpy.utils.unregister_manual_map(manual)

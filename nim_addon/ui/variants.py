# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants of the chosen scene: a picture for each value of one of its parameters, side by side, each with its caption."""

from __future__ import annotations

import dataclasses
import zlib
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface

from ..renders.montage import caption
from ..renders.request import Request
from ..scenes import SCENES
from ..scenes.parameters import file_name
from ..sweeps import axes, plan
from . import jobs, scenes
from .panels import Sidebar, draw_sentence
from .scene_settings import NIM_PG_scenes, description_of, label_of
from .translations import OWN

USUAL = "USUAL"
MOST = 24  # pictures side by side
USUAL_TEXTS = ("The Usual", "What shows best what the scene is about, such as empty, with water and with a NIM")
N_OF_LIQUID = ("n", "Index", "Refractive index of the liquid")
# What the values begin with, for a person to change; of a choice all of its words.
HINT = "-1.5, -1, 1.33"
FIRST = {"index": [HINT], "liquid": ["none", "water", "nim"], "switch": ["no", "yes"]}


def _fields(scene):
    return {field.name: field for field in dataclasses.fields(SCENES[scene].parameters)}


def varied(scene: str) -> list[tuple[str, str, str]]:
    """(name, label, description) of what may be varied in a scene: all of its parameters, and n of its liquid."""
    fields = _fields(scene)
    found = [(name, label_of(field), description_of(field)) for name, field in fields.items()]
    if "n" not in fields and sum(field.metadata["kind"] == "liquid" for field in fields.values()) == 1:
        found.insert(0, N_OF_LIQUID)
    return found


def _first(scene, name):
    """The values that a parameter begins with, as a person writes them."""
    field = _fields(scene).get(name)
    if field is None:
        return HINT if name == N_OF_LIQUID[0] else ""
    return ", ".join(FIRST.get(field.metadata["kind"], field.metadata.get("choices", ())))


def _items(scene):
    """The items of a scene's menu; files hold their numbers, which are made of the names, so that new ones may come."""
    return [
        (USUAL, *USUAL_TEXTS, "NONE", 0),
        *((*item, "NONE", zlib.crc32(item[0].encode()) & 0x7FFFFFFF) for item in varied(scene)),
    ]


def _chosen(scene):
    """The function that begins with values of the parameter that was just chosen for that scene."""
    return lambda self, _context: setattr(self, f"{scene}_values", _first(scene, getattr(self, scene)))


class NIM_PG_variants(bpy.types.PropertyGroup):
    """What the variants of each scene differ in, by the scene's name: a parameter, and its values."""


for _name in SCENES:
    NIM_PG_variants.__annotations__[_name] = bpy.props.EnumProperty(
        name="Vary",
        description="The parameter that is another one in each picture",
        items=_items(_name),
        default=USUAL,
        translation_context=OWN,
        update=_chosen(_name),
    )
    NIM_PG_variants.__annotations__[f"{_name}_values"] = bpy.props.StringProperty(
        name="Values",
        description="One for each picture, such as -1.5, -1, 1.33, or from, to and step, such as -1.5:1.5:0.5",
    )


def _usual(request: Request) -> list[list[str]]:
    """The settings of each picture that shows what is compared in the scene, the settings' own NIM where they have one."""
    scene_type, parameters = SCENES[request.scene], request.parameters
    (key,), variants = scene_type.compared, scene_type.variants()
    medium = parameters.medium if key == "n" else getattr(parameters, key)
    if medium is not None and getattr(medium, "is_nim", False):
        apart = key == "n" and medium.is_real  # its mu is a parameter of its own
        variants[-1] = str(medium).split(",") if apart else [f"{key}={medium}"]
    return variants


def _asked(scene: str, key: str, text: str) -> list[list[str]]:
    """The settings of each picture that a person's values ask for; ValueError, one sentence, for values that are none."""
    if not text.strip():
        raise ValueError(f"{key} has no values; {axes.VALUES_FORM}.")
    liquids = [name for name, field in _fields(scene).items() if field.metadata["kind"] == "liquid"]
    found = []
    for value in axes.values_of(text):
        settings = plan.settings_of(scene, {key: value})
        found.append([part for name, own in settings.items() for part in axes.apart(name, own, liquids)])
    return found


def all_variants(settings: NIM_PG_scenes, folder: Path) -> jobs.Work:
    """What renders the scene once for each value of what is varied, side by side.

    Raises ValueError, one sentence, where the settings clash, or the values are none, are too many, or the same.
    """
    request = jobs.request_of(settings)
    parameters, scene = request.parameters, settings.scene
    group = settings.id_data.nim_variants
    key = getattr(group, scene)
    variants = _usual(request) if key == USUAL else _asked(scene, key, getattr(group, f"{scene}_values"))
    if len(variants) < 2:
        raise ValueError(f"one value of {key} is one picture; give at least two.")
    if len(variants) > MOST:
        raise ValueError(f"{len(variants)} pictures are too many side by side; give at most {MOST}, or take a sweep.")
    keys = {text.partition("=")[0] for texts in variants for text in texts}
    if any(_fields(scene)[name].metadata["kind"] in ("liquid", "index") or name == "n" for name in keys):
        keys.add("mu")  # a medium brings its own permeability
    kept = [text for text in parameters.assignments() if text.partition("=")[0] not in keys]
    shared = kept + ["spectral=yes"] * request.spectral
    joined = jobs.free_name(folder, f"{file_name(scene, shared)}_compare")
    requests = {}
    for variant in variants:
        made = dataclasses.replace(request, parameters=type(parameters).read([*kept, *variant]))
        name = file_name(joined, variant)
        if made in requests.values() or name in requests:
            raise ValueError(f"{' '.join(variant)} is there twice; give each value once.")
        requests[name] = made
    # in the order in which `nimray compare` has them
    compared = {**({"set": shared} if shared else {}), "compares": [" ".join(variant) for variant in variants]}
    captions = tuple(map(caption, variants))
    return jobs.Work(joined, requests, joined=joined, compared=compared, captions=captions)


class NIM_OT_render_variants(jobs.Start, bpy.types.Operator):
    """Render a picture for each value, in the background, and all of them side by side into one image, each with its caption"""

    bl_idname = "nim.render_variants"
    bl_label = "Render All Variants"

    def execute(self, context):
        return self.start(all_variants)


class NIM_PT_variants(Sidebar, bpy.types.Panel):
    """A picture for each value of a parameter, side by side"""

    bl_idname = "NIM_PT_variants"
    bl_label = "Variants"
    page = "scenes#render-the-example"
    bl_parent_id = "NIM_PT_scenes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings, group = context.scene.nim_scenes, context.scene.nim_variants
        scene = settings.scene
        column = layout.column(align=True)
        column.prop(group, scene)
        if getattr(group, scene) != USUAL:
            column.prop(group, f"{scene}_values", placeholder=HINT)
        count, problem = _looked(settings)
        if problem:
            draw_sentence(layout, context, problem, "ERROR")
        text = pgettext_iface("Render {} Variants").format(count) if count else pgettext_iface("Render All Variants")
        layout.operator("nim.render_variants", text=text, icon="RENDERLAYERS", translate=False)


_last: tuple = (None, (0, ""))  # of what the panel drew last: the settings, and what _looked() said of them


def _looked(settings):
    """How many pictures the settings make, and the sentence that says what is wrong with their values, or ""."""
    global _last
    if settings.problem:
        return 0, ""  # which the panel above says
    group, scene = settings.id_data.nim_variants, settings.scene
    values = [getattr(getattr(settings, scene), name) for name in type(getattr(settings, scene)).__annotations__]
    asked = scene, settings.spectral, getattr(group, scene), getattr(group, f"{scene}_values"), *values
    if _last[0] != asked:
        try:
            said = len(all_variants(settings, Path()).requests), ""
        except ValueError as error:
            said = 0, str(error)
        _last = asked, said
    return _last[1]


CLASSES = (NIM_PG_variants, NIM_OT_render_variants, *scenes.open_and_folded(NIM_PT_variants))


def register():
    """Let scenes hold what their variants differ in."""
    bpy.types.Scene.nim_variants = bpy.props.PointerProperty(
        name="Variants", description="What the variants of a scene differ in", type=NIM_PG_variants
    )


def unregister():
    """Take that away."""
    del bpy.types.Scene.nim_variants

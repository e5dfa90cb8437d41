# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes panel is set to: the dataclasses of the scenes' parameters as Blender's properties, and back."""

import dataclasses
import json
from collections.abc import Callable

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..cycles import spectral
from ..physics import MEDIA, Medium
from ..scenes import SCENES
from ..scenes import stage as stages
from ..scenes.parameters import Parameters
from . import backends, built, preferences
from .media import DISPERSIVE_TEXTS, numbers_of, plain
from .translations import OWN

# Blender files hold these numbers: they stay, and new names get new ones.
SCENE_NUMBERS = {"glass": 0, "pool": 1, "sphere": 2, "sea": 3, "prism": 4, "drop": 5, "lens": 6, "ball": 7, "window": 8}
LIQUID_NUMBERS = {"none": 0, "custom": 1, "water": 2, "nim": 3, "glass": 4, "diamond": 5}
LIQUID_NUMBERS |= {"nim-1.025": 6, "nim-1.5": 7, "nim-2.418": 8, "nim-4.1": 9, "nim-mu10": 10, "nim-mu25": 11}
FILE_NUMBER = WORDS_NUMBER = 100  # a mesh file, or a medium, of one's own, after all the words there may ever be
LIQUID_NUMBERS |= {"words": WORDS_NUMBER}
INDEX_NUMBERS = {"number": 0, "words": WORDS_NUMBER}
QUALITY_ITEMS = [
    ("DEFAULT", "Default", "The samples of the add-on's preferences, full size", "NONE", 0),
    ("DRAFT", "Draft", "32 samples, half size: seconds", "NONE", 1),
    ("GOOD", "Good", "256 samples, full size: minutes", "NONE", 2),
    ("FINAL", "Final", "2048 samples, full size: as long as it takes", "NONE", 3),
]
BACKEND_ITEMS = [
    ("default", "Default", "As in the add-on's preferences", "NONE", 0),
    ("auto", "Automatic", "OSL where this Blender has it, else Blender's own nodes", "NONE", 1),
    ("osl", "OSL", backends.OSL, "NONE", 2),
    ("nodes", "Nodes", "Blender's own nodes, which run in any build", "NONE", 3),
]

# The item of a Medium, or of None; of names for the same one the first.
LIQUIDS = {None: "none"} | {MEDIA[word]: word for word in reversed(LIQUID_NUMBERS) if word in MEDIA}

# Samples a pixel (None: those of the preferences) and the part of the scene's own size in percent.
QUALITIES = {"DEFAULT": (None, 100), "DRAFT": (32, 50), "GOOD": (256, 100), "FINAL": (2048, 100)}

WORDS_TEXTS = ("Own Medium", "Any medium by its name, its numbers or its file")
INDEX_TEXTS = {"number": ("Own Index", "The index, and the permeability, that are typed in"), "words": WORDS_TEXTS}
LIQUID_TEXTS = {
    "none": ("None (Empty)", "Nothing but air"),
    "custom": ("Own Index", "The index, and the permeability, that are typed in"),
    "words": WORDS_TEXTS,
    "water": ("Water", "The index of water, in all colors alike"),
    "glass": ("Glass", "The index of common glass, in all colors alike"),
    "diamond": ("Diamond", "The index of diamond, in all colors alike"),
}
NIM_TEXTS = {
    True: "Light bends to the other side, as much as by a common medium of the opposite index",
    False: "Light bends to the other side, and its permeability makes the surface a brighter mirror",
}
LABELS = {"n": "Index", "mu": "Permeability"}
# Where a number that the others leave open starts as a person takes it over: a NIM's permeability, a core, a cap, a lenslet.
FIRST = {"mu": -1.0, "core": 0.8, "cap": 3.0, "aperture": 0.5}


# ------------------------------------------------------------------------------- a dataclass as Blender's properties


def label_of(field: dataclasses.Field) -> str:
    """What the panel calls a field of Parameters."""
    degrees = " (°)" if field.metadata.get("unit") == "degrees" else ""
    return LABELS.get(field.name, field.name.replace("_", " ").title()) + degrees


def description_of(field: dataclasses.Field) -> str:
    """What the panel's tooltip says of a field of Parameters."""
    data = field.metadata
    unit = f", in {data['unit']}" if data.get("unit") else ""
    return data["description"][0].upper() + data["description"][1:] + unit


def _texts(field):
    return {
        "name": label_of(field),
        "description": description_of(field),
        "translation_context": OWN,
        "update": _changed,
    }


def _float(name, description, low, high, default, unit=""):
    return FloatProperty(
        name=name,
        description=description,
        default=default,
        min=low,
        max=high,
        precision=3,
        step=1,
        unit={"m": "LENGTH", "s": "TIME_ABSOLUTE"}.get(unit, "NONE"),
        translation_context=OWN,
        update=_changed,
    )


def _switch_of_own(label, description):
    return BoolProperty(name=f"Own {label}", description=description, default=False, update=_changed)


def _number_properties(field, fields, chosen):
    data, name = field.metadata, field.name
    start = FIRST[name] if getattr(chosen, name) is None else getattr(chosen, name)
    own = {name: _float(label_of(field), description_of(field), data["low"], data["high"], start, data["unit"])}
    if field.default is None:
        own[f"use_{name}"] = _switch_of_own(label_of(field), "Set it here, rather than leave it to the rest")
    return own


def _known_media(self, context, text):
    """The names of media in which a text occurs, each with what a panel says of it."""
    told = {name: words[0] for name, words in DISPERSIVE_TEXTS.items()} | {name: str(MEDIA[name]) for name in MEDIA}
    return [(name, words) for name, words in told.items() if text.lower() in f"{name} {words}".lower()]


def _words_property(default=""):
    return StringProperty(
        name="Medium",
        translation_context=OWN,
        search=_known_media,
        search_options={"SUGGESTION"},
        default=default,
        description="Any medium, as --set takes it: n-bk7, n=-1.33,length=0.05, or the path of a .yml file of "
        "refractiveindex.info",
        update=_changed,
    )


def _index_properties(field, fields, chosen):
    name, items = field.name, [(word, *INDEX_TEXTS[word], "NONE", number) for word, number in INDEX_NUMBERS.items()]
    kind = EnumProperty(
        name="Medium",
        description="What it is made of",
        items=items,
        default="number",
        translation_context=OWN,
        update=_changed,
    )
    return {f"{name}_medium": kind, **_number_properties(field, fields, chosen), f"{name}_words": _words_property()}


def _integer_properties(field, fields, chosen):
    low, high = field.metadata["low"], field.metadata["high"]
    return {field.name: IntProperty(default=field.default, min=low, max=high, **_texts(field))}


def _switch_properties(field, fields, chosen):
    return {field.name: BoolProperty(default=field.default, **_texts(field))}


def _liquid_properties(field, fields, chosen):
    name = field.name
    items = [(word, *_liquid_texts(word), "NONE", number) for word, number in LIQUID_NUMBERS.items()]
    own = {name: EnumProperty(items=items, default=LIQUIDS.get(field.default, "words"), **_texts(field))}
    help_n = "Refractive index of the liquid; negative for a NIM"
    own[f"{name}_n"] = _float("Index", help_n, -10.0, 10.0, field.default.n)
    if "mu" not in fields:
        help_mu = "Relative permeability of the liquid; it has the sign of the index"
        own[f"{name}_mu"] = _float("Permeability", help_mu, -100, 100, FIRST["mu"])
        help_use = "Set it here; else it is 1 with the sign of the index"
        own[f"use_{name}_mu"] = _switch_of_own("Permeability", help_use)
    own[f"{name}_words"] = _words_property("" if field.default in LIQUIDS else str(field.default))
    return own


def _liquid_texts(word):
    """What the menu calls a liquid, and what its tooltip says."""
    if word not in MEDIA:
        return LIQUID_TEXTS[word]
    medium = MEDIA[word]
    name, told = ("NIM", NIM_TEXTS[abs(medium.mu) == 1]) if medium.is_nim else LIQUID_TEXTS[word]
    return f"{name} ({numbers_of(medium)})", told


def _choices(field):
    meanings = field.metadata["meanings"].items()
    return [(word, word.title(), meaning, "NONE", number) for number, (word, meaning) in enumerate(meanings)]


def _choice_properties(field, fields, chosen):
    texts = _texts(field)
    if field.name == "view":
        texts["update"] = _view_changed
    return {field.name: EnumProperty(items=_choices(field), default=field.default, **texts)}


def _mesh_properties(field, fields, chosen):
    items = [*_choices(field), ("file", "File", "A mesh file of your own", "NONE", FILE_NUMBER)]
    file = StringProperty(name="File", description="A PLY, OBJ or STL file", subtype="FILE_PATH", update=_changed)
    return {field.name: EnumProperty(items=items, default=field.default, **_texts(field)), f"{field.name}_file": file}


# By the kind of a field of Parameters: the properties that hold it, and whatever its value may need. Each is given the
# field, all of them by name, and the Parameters that are chosen where nothing is set.
_PROPERTIES = {
    "number": _number_properties,
    "index": _index_properties,
    "integer": _integer_properties,
    "switch": _switch_properties,
    "liquid": _liquid_properties,
    "choice": _choice_properties,
    "mesh": _mesh_properties,
}


def _group(scene_type):
    """The type of a property group that holds what the dataclass of a SceneType does."""
    fields = {field.name: field for field in dataclasses.fields(scene_type.parameters)}
    properties, chosen = {}, scene_type.parameters()
    for field in fields.values():
        properties |= _PROPERTIES[field.metadata["kind"]](field, fields, chosen)
    return type(
        f"NIM_PG_{scene_type.name}",
        (bpy.types.PropertyGroup,),
        {"__doc__": f"Parameters of the {scene_type.name} scene.", "__annotations__": properties},
    )


# ------------------------------------------------------------------------------- what they hold


def value_of(group: bpy.types.PropertyGroup, field: dataclasses.Field) -> object:
    """What a group holds of a field of its scene's Parameters."""
    kind, name = field.metadata["kind"], field.name
    value = getattr(group, name)
    if kind == "number":
        return None if field.default is None and not getattr(group, f"use_{name}") else plain(value)
    if kind == "index":
        return getattr(group, f"{name}_words") if getattr(group, f"{name}_medium") == "words" else plain(value)
    if kind == "liquid":
        if value == "words":
            return getattr(group, f"{name}_words")
        if value != "custom":
            return None if value == "none" else MEDIA[value]
        own = hasattr(group, f"use_{name}_mu") and getattr(group, f"use_{name}_mu")
        return Medium(plain(getattr(group, f"{name}_n")), plain(getattr(group, f"{name}_mu")) if own else None)
    if kind == "mesh" and value == "file":
        return bpy.path.abspath(getattr(group, f"{name}_file"))
    return value


def parameters_of(settings: "NIM_PG_scenes") -> Parameters:
    """What the settings (a Scene.nim_scenes) say of the chosen scene; ValueError, one sentence, where they clash."""
    parameters = SCENES[settings.scene].parameters
    group = getattr(settings, settings.scene)
    return parameters(**{field.name: value_of(group, field) for field in dataclasses.fields(parameters)})


def take(group: bpy.types.PropertyGroup, parameters: Parameters) -> None:
    """Give a scene's group the values of its Parameters, all of them, whatever was set before."""
    values = {name: group.bl_rna.properties[name].default for name in type(group).__annotations__}
    for name in (text.partition("=")[0] for text in parameters.assignments()):
        value = getattr(parameters, name)
        if isinstance(value, Medium) and value not in LIQUIDS:
            values[f"{name}_words"] = str(value)
            values[f"{name}_medium" if f"{name}_medium" in values else name] = "words"
        else:
            values[name] = LIQUIDS[value] if value is None or isinstance(value, Medium) else value
        if f"use_{name}" in values:
            values[f"use_{name}"] = True
    for name, value in values.items():
        setattr(group, name, value)


def copy_settings(source: bpy.types.PropertyGroup, target: bpy.types.PropertyGroup) -> None:
    """Give one property group the values of another of its type, groups within it too."""
    for name, value in ((name, getattr(source, name)) for name in type(source).__annotations__):
        if isinstance(value, bpy.types.PropertyGroup):
            copy_settings(value, getattr(target, name))
        else:
            setattr(target, name, value)


def samples_of(settings: "NIM_PG_scenes") -> tuple[int, int]:
    """Samples a pixel, and percent of the scene's own size, of the chosen quality."""
    samples, percent = QUALITIES[settings.quality]
    return samples or preferences.settings().samples, percent


def backend_of(settings: "NIM_PG_scenes") -> str:
    """The backend to build with: "auto", "osl" or "nodes"."""
    return preferences.settings().backend if settings.backend == "default" else settings.backend


# ------------------------------------------------------------------------------- what follows a change

# Functions of a bpy.types.Scene that are called after each change of its settings.
FOLLOWERS: list[Callable[[bpy.types.Scene], None]] = []


def _changed(self, context):
    """Keep the sentence that says what clashes, so that no redraw has to find out, and tell who follows."""
    settings = self.id_data.nim_scenes
    try:
        parameters_of(settings)
        settings.problem = ""
    except ValueError as error:
        settings.problem = str(error)
    for follower in FOLLOWERS:
        follower(self.id_data)


def _view_changed(self, context):
    """Move the camera of a built scene; nothing else of it changes."""
    _changed(self, context)
    scene = self.id_data
    settings = scene.nim_scenes
    camera = scene.camera if scene.get(stages.STAGE_MARK) == settings.scene else None
    if self != getattr(settings, settings.scene):
        return
    if camera is not None and camera.get(stages.STAGE_MARK) == settings.scene and not settings.problem:
        parameters = parameters_of(settings)
        with built.ours(scene, view=json.dumps(parameters.view)):
            stages.aim(camera, *SCENES[settings.scene].pose(parameters))


def _quality_changed(self, context):
    scene = self.id_data
    if scene.get(stages.STAGE_MARK) == self.scene:
        apply_quality(scene)


def apply_quality(scene: bpy.types.Scene) -> None:
    """Give a built scene the samples and the size that its settings say."""
    scene.cycles.samples, scene.render.resolution_percentage = samples_of(scene.nim_scenes)


def _spectral_changed(self, context):
    scene = self.id_data
    if scene.get(stages.STAGE_MARK) == self.scene:
        with built.ours(scene):
            apply_spectral(scene)


def apply_spectral(scene: bpy.types.Scene) -> None:
    """Let a built scene be rendered in all wavelengths at once, or not, as its settings say."""
    if scene.nim_scenes.spectral:
        spectral.set_up(scene)
    else:
        spectral.undo(scene)


# ------------------------------------------------------------------------------- the groups


GROUPS = {name: _group(scene_type) for name, scene_type in SCENES.items()}


class NIM_PG_scenes(bpy.types.PropertyGroup):
    """What the scenes panel holds, in each Blender scene; the group of each of our scenes, by its name, follows."""

    scene: EnumProperty(
        name="Scene",
        description="Which scene to build",
        items=[
            (name, name.title(), scene_type.shows, "NONE", SCENE_NUMBERS[name]) for name, scene_type in SCENES.items()
        ],
        default="glass",
        update=_changed,
    )
    quality: EnumProperty(
        name="Quality",
        description="Samples a pixel and size of the picture; a built scene follows at once",
        items=QUALITY_ITEMS,
        default="DEFAULT",
        update=_quality_changed,
    )
    backend: EnumProperty(
        name="Backend",
        description="What the optics of the materials are made of",
        items=BACKEND_ITEMS,
        default="default",
        update=_changed,
    )
    spectral: BoolProperty(
        name="Spectral",
        description="All wavelengths in one render, so that media show their colors; a built scene follows at once",
        default=False,
        update=_spectral_changed,
    )
    problem: StringProperty(
        name="Problem", description="What clashes in the settings; empty if nothing", options={"HIDDEN"}
    )


NIM_PG_scenes.__annotations__ |= {
    name: PointerProperty(name=name.title(), description=f"Parameters of the {name}", type=group)
    for name, group in GROUPS.items()
}
CLASSES = (*GROUPS.values(), NIM_PG_scenes)


def register():
    """Give every scene its settings."""
    bpy.types.Scene.nim_scenes = PointerProperty(
        name="NIM Scenes", description="Settings of the NIM scenes panel", type=NIM_PG_scenes
    )


def unregister():
    """Take them back."""
    del bpy.types.Scene.nim_scenes

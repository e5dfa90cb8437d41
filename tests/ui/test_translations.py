# SPDX-License-Identifier: GPL-3.0-or-later
"""The translations are complete: every text that a person may read has a translation, and none is left over.

The wheels are built without translation, so what Blender makes of a dictionary can be seen in a Blender with a window
only. What it is given can be held against all that it shows, and that is done here.
"""

import ast
import inspect
import re
import string
from pathlib import Path

import bpy
import pytest

from nim_addon import checks, ui
from nim_addon.checks import (
    backdrop,
    ball_checks,
    hints,
    loss_checks,
    media_checks,
    mesh_checks,
    pane_checks,
    place_checks,
    ray_checks,
    spectral_checks,
    value_checks,
)
from nim_addon.cycles import problem, settings
from nim_addon.cycles.closures import CLOSURES
from nim_addon.physics import limits
from nim_addon.scenes import SCENES
from nim_addon.ui import presets, translations

# The modules whose texts are looked for: what the panels show of the checks is written there.
SOURCES = sorted(Path(ui.__file__).parent.glob("*.py"))
CHECKS = (
    backdrop,
    ball_checks,
    checks,
    hints,
    limits,
    loss_checks,
    media_checks,
    mesh_checks,
    pane_checks,
    place_checks,
    problem,
    ray_checks,
    settings,
    spectral_checks,
    value_checks,
)
SOURCES += [Path(module.__file__) for module in CHECKS]
# Literals of these modules that read like a text, and why they are none.
NOT_SHOWN = {
    "Color": "socket",
    "Volume": "socket",
    "Transparent Depth": "socket",
    "Is Shadow Ray": "socket",
    "Filter Width": "socket",
    "Strength": "socket",
    "Emission Strength": "socket",
    "Workbench": "name of an engine, the same in every language",
    "Cycles": "name of an engine, the same in every language",
    "Negative-Index Materials": "name of the add-on and its asset library",
    "NIM Light Paths": "name of a collection",
    "Object Mode": "name of a key map",
    "Floor": "name of an object",
    "Error": "looked for in the log of a second Blender",
    "λ (nm)": "label within the picture of the curve",
    "Rs": "label within the picture of the curve",
    "Rp": "label within the picture of the curve",
    "{name}: {backend}": "nothing to translate",
    "Air, vacuum": "part of a medium's label, which is translated as a whole",
    "Water": "part of a medium's label",
    "Diamond": "part of a medium's label",
    "ModelViewProjectionMatrix": "name of a matrix in a shader, given by Blender",
}
# Words that stay as they are; a text of nothing else, numbers apart, needs no translation.
SAME = {"n", "k", "mu", "μ", "θ", "R", "T", "Rₛ", "Rₚ", "NIM", "OSL", "Blender", "Auto"}


def needs_translation(text):
    return not set(re.findall(r"[^\W\d_]+", text)) <= SAME


def shown_by_blender():
    """{text: where} of names and tooltips that Blender has from the classes, their properties and the node's sockets."""
    texts = {}

    def add(where, *those):
        texts.update({text: where for text in those if text})

    def add_properties(where, owner, chosen):
        for item in (owner.bl_rna.properties[name] for name in chosen):
            add(f"{where}.{item.identifier}", item.name, item.description)
            if item.type == "ENUM":
                for choice in item.enum_items:
                    add(f"{where}.{item.identifier}", choice.name, choice.description)

    for cls in (cls for module in ui.MODULES for cls in getattr(module, "CLASSES", ())):
        owner = cls
        if issubclass(cls, bpy.types.Operator):
            owner = getattr(bpy.ops.nim, cls.bl_idname.removeprefix("nim.")).get_rna_type()
            add(cls.__name__, owner.name, owner.description)
        elif issubclass(cls, bpy.types.Panel | bpy.types.Menu):
            # the label of a preset menu is the preset that was loaded last
            add(cls.__name__, cls.__doc__, "" if hasattr(cls, "preset_subdir") else cls.bl_label)
        # Blender's own classes bring properties of their own, with their translations
        ours = [base for base in cls.__mro__ if base.__module__.startswith(ui.__package__)]
        names = {name for base in ours for name in inspect.get_annotations(base)}
        add_properties(cls.__name__, owner, sorted(names))
    for kind in (bpy.types.Scene, bpy.types.Material, bpy.types.Object, bpy.types.WindowManager):
        add_properties(kind.__name__, kind, [name for name in kind.bl_rna.properties.keys() if name.startswith("nim")])  # noqa: SIM118
    for socket in (socket for closure in CLOSURES for socket in closure.sockets):
        add(f"socket {socket.identifier}", socket.name, socket.description)
    return {text: where for text, where in texts.items() if needs_translation(text)}


def reads_like_a_text(literal):
    """Whether a string in the source looks as if a person should read it: it begins as a sentence, or has a space."""
    if "\n" in literal or re.fullmatch(r"ShaderNode\w+|\w*_\w*", literal):
        return False
    return bool(re.match(r"[A-Z][a-z]", literal) or " " in literal.strip()) and needs_translation(literal)


def choices(node):
    """The expressions that an argument may be: itself, or both of "this if so, else that"."""
    return [*choices(node.body), *choices(node.orelse)] if isinstance(node, ast.IfExp) else [node]


def written_in(source):
    """{literal: where} of the texts in a module: those given to a translating function, and all that read like one."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    asked = {name.asname or name.name for node in nodes if isinstance(node, ast.ImportFrom) for name in node.names}
    asked = {name for name in asked if name.startswith("pgettext")} | {"say", "iface_", "rpt_"}
    none = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    none |= {id(node.value) for node in nodes if isinstance(node, ast.Expr)}  # docstrings
    calls = [node for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    given = {id(part) for call in calls if call.func.id in asked and call.args for part in choices(call.args[0])}
    literals = [node for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return {
        node.value: f"{source.name}:{node.lineno}"
        for node in literals
        if id(node) not in none and (id(node) in given or reads_like_a_text(node.value))
    }


@pytest.fixture
def texts(addon):
    """{text: where} of all that a person may read."""
    found = {}
    for source in SOURCES:
        found.update(written_in(source))
    for figure, recipes in (chosen for name in SCENES for chosen in presets.recipes_of(name)):
        captions = (recipe.caption for recipe in recipes)
        found |= {text: f"figure {figure.number}" for text in (figure.title, *captions) if needs_translation(text)}
    return {text: where for text, where in found.items() if text not in NOT_SHOWN} | shown_by_blender()


@pytest.mark.parametrize("language", translations.LANGUAGES)
def test_every_text_has_a_translation(texts, language):
    missing = {text: where for text, where in texts.items() if (None, text) not in translations.LANGUAGES[language]}
    assert not missing, f"add these to locale/{language}.po, or to NOT_SHOWN: {missing}"


@pytest.mark.parametrize("language", translations.LANGUAGES)
def test_no_translation_is_left_over(texts, language):
    left = sorted({text for _, text in translations.LANGUAGES[language]} - set(texts))
    assert not left, f"nothing shows these any more: {left}"


def test_what_is_said_to_be_no_text_is_there(addon):
    written = set().union(*(written_in(source) for source in SOURCES))
    assert set(NOT_SHOWN) <= written


@pytest.mark.parametrize("language", translations.LANGUAGES)
def test_translations_have_the_same_places_to_fill_in(language):
    def places(text):
        return sorted((name, form) for _, name, form, _ in string.Formatter().parse(text) if name is not None)

    for (_, text), translated in translations.LANGUAGES[language].items():
        assert places(translated) == places(text), text
        assert translated.strip() == translated != "", text
        assert (translated[-1] in ".:") == (text[-1] in ".:"), text


def test_every_text_is_given_to_blender_as_label_and_as_button(texts):
    for given in translations.dictionary().values():
        assert {("*", text) for text in texts} <= set(given)
        assert {("Operator", text) for text in texts} <= set(given)


def test_what_names_a_context_is_for_that_alone(monkeypatch):
    both = {("Operator", "Bake"): "Capturar", (None, "Bake"): "Captura"}
    monkeypatch.setattr(translations, "LANGUAGES", {"es": both})
    given = {("*", "Bake"): "Captura", ("Operator", "Bake"): "Capturar", (translations.OWN, "Bake"): "Captura"}
    assert translations.dictionary() == {"es": given}


@pytest.mark.skipif(not bpy.app.build_options.international, reason="the wheels are built without translation")
def test_blender_speaks_spanish_while_the_addon_is_enabled(addon):
    import addon_utils

    view = bpy.context.preferences.view
    language = view.language
    look_up = bpy.app.translations.pgettext
    try:
        view.language = "es"
        assert look_up("Make Negative-Index", "Operator") == "Hacer de índice negativo"
        assert look_up("Index") == "Identificador"  # Blender's own word, of another meaning
        assert look_up("Index", translations.OWN) == "Índice"
        addon_utils.disable(addon, default_set=True)
        assert look_up("Make Negative-Index", "Operator") == "Make Negative-Index"
        addon_utils.enable(addon, default_set=True)
        assert look_up("Make Negative-Index", "Operator") == "Hacer de índice negativo"
    finally:
        view.language = language


def test_texts_are_spelled_as_blenders_own(texts):
    """And "interface", which a newcomer takes for Blender's own, names the node alone, or the material that has it."""
    # micrometres: of a sentence that the command says too
    british = re.compile(r"colour|\bgrey\b|(?<!micro)metres?\b|catalogue|behaviour|\bcentre|\bmatt\b", re.IGNORECASE)
    node = ("NIM Interface", "interface node", "Add Interface", "Interface of index", "media of the interface")
    shown = {text: where for text, where in texts.items() if not where.startswith("socket ")}
    assert not {text: where for text, where in shown.items() if british.search(text)}
    said = {text: where for text, where in shown.items() if "interface" in text.lower() and text != "Interface"}
    assert not {text: where for text, where in said.items() if not any(words in text for words in node)}

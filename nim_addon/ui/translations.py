# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's texts in other languages than English: a .po file each, in locale/."""

import bpy

from ..base.shipped import LOCALE, PACKAGE
from . import po

# Where Blender has a word of its own, that is shown: this context is for the few texts that its word does not fit.
OWN = "NIM"
CONTEXTS = (bpy.app.translations.contexts.default, bpy.app.translations.contexts.operator_default, OWN)
LANGUAGES = {file.stem: po.read(file) for file in sorted(LOCALE.glob("*.po"))}


def dictionary() -> dict[str, dict[tuple[str, str], str]]:
    """The texts as Blender takes them: {language: {(context, text): translation}}.

    One that names no context is in all of them where none has its own, as the same words are a label here and a button,
    which is an operator's name, there.
    """
    filled = {}
    for language, texts in LANGUAGES.items():
        general = {(context, text): told for (own, text), told in texts.items() if not own for context in CONTEXTS}
        filled[language] = general | {key: told for key, told in texts.items() if key[0]}
    return filled


def register():
    """Give Blender the texts."""
    bpy.app.translations.register(PACKAGE, dictionary())


def unregister():
    """Take them back."""
    bpy.app.translations.unregister(PACKAGE)

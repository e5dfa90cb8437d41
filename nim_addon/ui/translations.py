# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's texts in other languages than English."""

import bpy

from .spanish import TEXTS

PACKAGE = __package__.rpartition(".")[0]
# Where Blender has a word of its own, that is shown: this context is for the few texts that its word does not fit.
OWN = "NIM"
CONTEXTS = (bpy.app.translations.contexts.default, bpy.app.translations.contexts.operator_default, OWN)
LANGUAGES = {"es": TEXTS}


def dictionary():
    """The texts as Blender takes them: {language: {(context, text): translation}}.

    Each is in every context, as the same words are a label here and a button, which is an operator's name, there.
    """
    return {
        language: {(context, text): translated for text, translated in texts.items() for context in CONTEXTS}
        for language, texts in LANGUAGES.items()
    }


CLASSES = ()


def register():
    """Give Blender the texts."""
    bpy.app.translations.register(PACKAGE, dictionary())


def unregister():
    """Take them back."""
    bpy.app.translations.unregister(PACKAGE)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences, and what others read of them."""

import bpy

import nim_addon
from nim_addon.base import options
from nim_addon.ui import preferences


def test_settings_are_the_preferences(addon):
    assert preferences.settings() == bpy.context.preferences.addons[addon].preferences
    assert {key: getattr(preferences.settings(), key) for key in preferences.DEFAULTS} == preferences.DEFAULTS
    preferences.settings().backend = "nodes"
    assert preferences.settings().backend == "nodes"


def test_settings_without_being_enabled_are_the_defaults(default_file):
    nim_addon.register()
    try:
        assert vars(preferences.settings()) == preferences.DEFAULTS
    finally:
        nim_addon.unregister()


def test_the_backends_are_those_of_the_material():
    assert tuple(item[0] for item in preferences.BACKENDS) == options.BACKENDS
    assert [item[4] for item in preferences.BACKENDS] == [0, 1, 2]


def test_every_property_says_what_it_is(addon):
    for prop in preferences.settings().bl_rna.properties:
        if prop.identifier in preferences.DEFAULTS:
            assert prop.name and prop.description

# SPDX-License-Identifier: GPL-3.0-or-later
"""Enabling and disabling: nothing is left behind, and neither takes time."""

import time

import bpy

import nim_addon


def registered():
    return {name for name in dir(bpy.types) if name.startswith(("NIM_", "nim_"))}


def test_enable_disable_enable_leaves_nothing(addon):
    import addon_utils

    before = registered()
    addon_utils.disable(addon, default_set=True)
    assert not registered()
    assert not any(hasattr(kind, "nim") for kind in (bpy.types.Scene, bpy.types.Material, bpy.types.Object))
    addon_utils.enable(addon, default_set=True)
    assert registered() == before


def test_registration_is_instant(addon):
    nim_addon.unregister()
    started = time.perf_counter()
    nim_addon.register()
    assert time.perf_counter() - started < 0.05

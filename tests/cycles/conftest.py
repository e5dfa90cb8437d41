# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of cycles share: an empty scene, and a material of a NIM for it."""

import bpy
import pytest

from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium


@pytest.fixture
def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


@pytest.fixture
def nim(scene):
    return interface_material("NIM", Medium(-1.5), backend="nodes")

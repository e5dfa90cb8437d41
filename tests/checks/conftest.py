# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of checks share: a scene without settings that lose light."""

import bpy
import pytest

from nim_addon.cycles import settings


@pytest.fixture
def scene(empty_file):
    scene = bpy.context.scene
    settings.lossless(scene, "nodes")
    return scene

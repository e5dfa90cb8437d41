# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the scenes share: what a file holds."""

import bpy
import pytest


@pytest.fixture
def held():
    """held() -> the sorted names of all data that the file holds, by the collection of bpy.data that holds them."""

    def names():
        collections = [p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]
        return {name: sorted(data.name for data in getattr(bpy.data, name)) for name in collections}

    return names

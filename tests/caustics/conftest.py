# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of caustics share: a ball of glass over a floor."""

import bpy
import pytest

from nim_addon.cycles.material import interface_material
from nim_addon.physics import Medium
from tests.caustics.rig import dark_scene, material_of, mesh_object, sheet

ENERGY = {"SUN": 3.0, "POINT": 500.0}


@pytest.fixture
def build(empty_file):
    """build(lamp) -> a scene: a ball of glass at z = 2 over a floor of 8 m at z = 0, a lamp at z = 6, an eye above."""

    def ball_over_floor(lamp="SUN"):
        scene = dark_scene(lamp, ENERGY[lamp], height=6, eye=9, width=8.0)
        bpy.ops.mesh.primitive_ico_sphere_add(radius=1, location=(0, 0, 2), subdivisions=3)
        ball = bpy.context.object
        ball.name = "Ball"
        ball.data.materials.append(interface_material("Glass", Medium(1.5), backend="nodes"))
        ball.data.shade_smooth()
        mesh_object("Floor", sheet(4), material_of("ShaderNodeBsdfPrincipled", "Paint"))
        return scene

    return ball_over_floor

# SPDX-License-Identifier: GPL-3.0-or-later
"""A sky and a soft, low sun for a scene in which there is nothing to bend."""

import bpy
from bpy.app.translations import pgettext_rpt

from ..scenes import sphere, surfaces

# The sky of the sphere scene, so dark that the lamp of a new file and a white floor are well exposed with it.
STRENGTH = 0.3
# From behind what the camera of a new file sees; its irradiance across its rays is for a strength of 1, its width in degrees.
TOWARDS_SUN, SUN_IRRADIANCE, SUN_WIDTH = (-0.6, 0.5, 0.5), (2.4, 1.6, 0.9), 16.0
MAP_WIDTH = 256  # pixels of the map by which Cycles finds the sun, as in the scene


class NIM_OT_add_sky(bpy.types.Operator):
    """Give the scene a world with a blue sky, a horizon and a soft sun, in place of its own"""

    bl_idname = "nim.add_sky"
    bl_label = "Add Sky"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only in a scene that can be changed."""
        if not context.scene.is_editable:
            cls.poll_message_set("The scene is linked from a library: make it local first")
            return False
        return True

    def execute(self, context):
        """Make the world, and light the scene with it."""
        sun = surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, SUN_WIDTH)
        world = surfaces.sky("Sky", sphere.HORIZON, sphere.ZENITH, strength=STRENGTH, glow=sun)
        world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", MAP_WIDTH
        context.scene.world = world
        for view in context.scene.view_layers:
            if view.world_override:  # which hides that of the scene
                view.world_override = world
        self.report({"INFO"}, pgettext_rpt("The scene has a sky: {name}").format(name=world.name))
        return {"FINISHED"}


CLASSES = (NIM_OT_add_sky,)

# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

settings = bpy.context.scene.nim_scenes.glass
settings.liquid = "water"
settings.liquid_n = -1.33
settings.liquid_mu = -1.0
settings.use_liquid_mu = False
settings.view = "side"
settings.straw = True
settings.figures = "none"
settings.figures_file = ""
settings.sun_angle = 0.53

# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

settings = bpy.context.scene.nim_scenes.sea
settings.liquid = "water"
settings.liquid_n = 1.33
settings.liquid_mu = -1.0
settings.use_liquid_mu = False
settings.view = "up"
settings.waves = 0.1
settings.seed = 1
settings.time = 0.0

# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

settings = bpy.context.scene.nim_scenes.pool
settings.liquid = "nim"
settings.liquid_n = -1.33
settings.mu = -1.0
settings.use_mu = False
settings.view = "top"
settings.sky = "sunny"
settings.sun_angle = 0.53
settings.waves = 0.04
settings.seed = 1
settings.time = 0.0

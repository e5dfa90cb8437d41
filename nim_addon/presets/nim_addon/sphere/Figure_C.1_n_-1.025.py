# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

settings = bpy.context.scene.nim_scenes.sphere
settings.n = -1.025
settings.mu = -1.0
settings.use_mu = False
settings.companions = False
settings.sun_angle = 0.53

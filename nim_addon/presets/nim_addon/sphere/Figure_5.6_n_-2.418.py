# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

settings = bpy.context.scene.nim_scenes.sphere
settings.n = -2.418
settings.mu = -1.0
settings.use_mu = False
settings.companions = True
settings.sun_angle = 16.0

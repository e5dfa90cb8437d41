# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be asked of a render: the choices and limits that the command line, the records in images and the panel share."""

# Of scenes.SCENES, for those who must not import bpy to name them.
SCENE_NAMES = ("glass", "pool", "sphere", "sea", "drop", "prism", "lens", "ball", "window")
BACKENDS = ("auto", "osl", "nodes")  # what the materials are made of; auto is OSL where there is some
BACKEND_NAMES = {"osl": "OSL", "nodes": "Blender's own nodes"}
CAUSTICS = ("path", "traced")  # the light of the sun behind an interface: found by chance, or traced from the sun
LARGEST_SIDE = 16384  # pixels
MOST_SAMPLES = 1 << 20
MOST_SEED = 2**31 - 1
MOST_PHOTONS = 1 << 40
LAST_FRAME = 1048574  # of Blender's animations, whose first is 0
FPS = 24  # frames a second, where nothing else is said
MOST_PASSES = 64  # renders whose mean is one spectral picture
MOST_WAVELENGTHS = 512  # renders of one wavelength each, of which a spectral image is made

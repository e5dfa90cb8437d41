# SPDX-License-Identifier: GPL-3.0-or-later
"""From an empty Blender with a window to every screen of the pages: only what a person presses and drags.

Run by press.py inside the lab's Blender. PRESS_ZIP is the extension, PRESS_OUT the folder that the pictures go to.
"""

import importlib
import os
import sys

sys.path.insert(0, os.environ["PRESS_HERE"])

import telling

for chapter in ("story_cube", "story_scenes", "story_file"):
    importlib.import_module(chapter)
telling.begin()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Write each scene, or only those named, with its default parameters to a .blend beside this file.

In Blender's own nodes, so that any build and device can render them.
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

# Blender notes the user's home folder in each file it saves
os.environ["HOME"] = "/"

import bpy

from nim_addon.base.files import whole
from nim_addon.base.streams import quiet
from nim_addon.scenes import SCENES, scene_type

folder = Path(__file__).resolve().parent
try:
    kinds = [scene_type(name) for name in sys.argv[1:] or SCENES]
except ValueError as error:
    print(f"make.py: {error}", file=sys.stderr)
    sys.exit(2)  # the words are wrong, as everywhere else; 1 is a failure
for kind in kinds:
    # saved elsewhere and copied: a .blend records the path it was saved to
    with tempfile.TemporaryDirectory() as work, quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        spare = bpy.context.scene
        bpy.context.window.scene = kind.build(kind.parameters(), "nodes")
        bpy.data.scenes.remove(spare)
        bpy.context.scene.render.filepath = f"//{kind.name}"
        bpy.data.orphans_purge()
        made = Path(work, f"{kind.name}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=str(made), compress=True)
        whole(folder / f"{kind.name}.blend", lambda part, made=made: shutil.copy(made, part))
    print(f"{kind.name}.blend, {(folder / f'{kind.name}.blend').stat().st_size / 1e3:.0f} kB")

# SPDX-License-Identifier: GPL-3.0-or-later
"""Write nim_addon/assets/closures.blend: the closures' groups in Blender's own nodes, which take long to fill."""

import os
import shutil
import tempfile
from pathlib import Path

# Blender notes the user's home folder in each file it saves
os.environ["HOME"] = "/"

import bpy

from nim_addon.base.files import whole
from nim_addon.base.streams import quiet
from nim_addon.cycles.closures import CLOSURES, template


def main(target=template.SHIPPED):
    """Fill the groups anew, and write them."""
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    groups = {closure.made_of: closure.filled("nodes") for closure in CLOSURES}
    with tempfile.TemporaryDirectory() as work, quiet():
        made = Path(work, target.name)
        template.write(made, groups)
        whole(target, lambda part: shutil.copy(made, part))
    print(f"{target.name}, {len(groups)} groups, {target.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()

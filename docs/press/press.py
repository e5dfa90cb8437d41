# SPDX-License-Identifier: GPL-3.0-or-later
"""Press what a person presses in a real Blender with a window, from an empty one on, and take a picture of each step.

  .venv/bin/python docs/press/press.py LAB-SCRIPT LAB-FOLDER OUT [--pages]

LAB-SCRIPT LAB-FOLDER is a Blender lab: `LAB-SCRIPT -d LAB-FOLDER shot SCRIPT.py PICTURE.png` runs SCRIPT.py in a Blender
with a window. OUT is the folder for the pictures of all steps. --pages cuts those of the pages out of them into
docs/images. Some minutes, since Cycles renders on the CPU.
"""

import os
import subprocess
import sys
from pathlib import Path

import OpenImageIO as oiio

ROOT = Path(__file__).resolve().parents[2]
SIZE = (1600, 1100)
VIEW = (0, 0, 1312, 1000)
# picture on a page: the step, and what is shown of its screen (left, top, right, bottom)
PICTURES = {
    "preferences": ("check", (175, 280, 1312, 600)),
    "first-sphere": ("sphere_rendered", VIEW),
    "first-index": ("sphere_changed", VIEW),
    "first-cube": ("cube", VIEW),
    "first-cube-rendered": ("cube_rendered", VIEW),
    "panel": ("node_sidebar", (180, 40, 1312, 860)),
    "checks": ("checks", (1020, 362, 1300, 972)),
    "add-mesh": ("add_mesh", (200, 380, 900, 870)),
    "add-node": ("node_menu", (180, 470, 1000, 1096)),
    "assets": ("assets", (0, 30, 1312, 400)),
    "scene-glass": ("glass", VIEW),
    "scene-pool": ("pool_window", VIEW),
    "replace": ("asked", VIEW),
    "headless": ("headless", (1020, 75, 1312, 642)),
    "rays": ("rays", VIEW),
}
WIDEST = 960


def press(script, lab, out):
    """Build the extension and tell the story in that lab; the exit code."""
    subprocess.run([sys.executable, ROOT / "build.py", "package"], check=True)
    zips = sorted((ROOT / "dist").glob("nim_addon-*.zip"), key=lambda file: file.stat().st_mtime)
    out.mkdir(parents=True, exist_ok=True)
    told = {"PRESS_ZIP": str(zips[-1]), "PRESS_OUT": str(out), "LAB_BIND": str(out), "LAB_TIMEOUT": "1200"}
    told["LAB_SIZE"] = "{}x{}".format(*SIZE)
    words = [script, "-d", lab, "shot", ROOT / "docs" / "press" / "steps.py", out / "end.png"]
    # the dialog is answered by a key that Blender is told was pressed
    code = subprocess.run([*words, "--enable-event-simulate"], cwd=ROOT, env={**os.environ, **told}).returncode
    return code or (out / "failed.txt").exists()


def cut(out):
    """Cut the pages' pictures out of the steps'."""
    for name, (step, (left, top, right, bottom)) in PICTURES.items():
        file = next(out.glob(f"[0-9]*-{step}.png"))
        part = oiio.ImageBufAlgo.cut(oiio.ImageBuf(str(file)), oiio.ROI(left, right, top, bottom))
        if right - left > WIDEST:
            part = oiio.ImageBufAlgo.resize(part, roi=oiio.ROI(0, WIDEST, 0, (bottom - top) * WIDEST // (right - left)))
        part.specmod().attribute("Compression", "jpeg:85")
        part.write(str(ROOT / "docs" / "images" / f"{name}.jpg"), "uint8")


if __name__ == "__main__":
    script, lab, out = (Path(word).resolve() for word in sys.argv[1:4])
    failed = press(script, lab, out)
    if not failed and "--pages" in sys.argv:
        cut(out)
    sys.exit(bool(failed))

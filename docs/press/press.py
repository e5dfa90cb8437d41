# SPDX-License-Identifier: GPL-3.0-or-later
"""Press what a person presses in a real Blender with a window, from an empty one on, and take a picture of each step.

  .venv/bin/python docs/press/press.py LAB-SCRIPT LAB-FOLDER OUT [--pages]

LAB-SCRIPT LAB-FOLDER is a Blender lab: `LAB-SCRIPT -d LAB-FOLDER shot SCRIPT.py PICTURE.png` runs SCRIPT.py in a Blender
with a window. OUT is the folder for the pictures of all steps, and for contact sheets of them. --pages cuts those of the pages
out of them into docs/images. Some minutes, since Cycles renders on the CPU; longer beside others, as it waits for what is to be
seen, not for a time.

It fails where Blender says that something went wrong, a label is cut off, or nothing is to be seen of what is drawn over a view.
PRESS_ZIP=FILE presses an extension that was built before, PRESS_ONLY="STEP STEP" some of the steps.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import OpenImageIO as oiio

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SIZE = (1600, 1100)
VIEW = (0, 0, 1312, 1000)
IN_VIEW = (100, 120, 1000, 760)
# picture on a page: the step, and what is shown of its screen (left, top, right, bottom)
PICTURES = {
    "preferences": ("check", (175, 280, 1312, 588)),
    "first-sphere": ("sphere_rendered", VIEW),
    "first-index": ("sphere_changed", VIEW),
    "first-cube": ("cube", VIEW),
    "first-cube-rendered": ("cube_rendered", VIEW),
    "panel": ("node_sidebar", (180, 40, 1312, 860)),
    "checks": ("cube", (1020, 480, 1312, 1000)),
    "add-mesh": ("add_mesh", (400, 460, 1100, 800)),
    "add-node": ("node_menu", (180, 470, 1000, 1096)),
    "assets": ("material_dragged", (0, 735, 1312, 1050)),
    "scene-glass": ("glass", VIEW),
    "scene-pool": ("pool_window", VIEW),
    "replace": ("asked", VIEW),
    "rays": ("rays", VIEW),
    "rays-live": ("reading", VIEW),
    "probe": ("probe", (1020, 75, 1312, 1000)),
    "render-panel": ("render_this", (1020, 735, 1312, 1000)),
}
WIDEST = 960
# What is drawn over a view: the step, the one before it is drawn, and where in the screen it must be seen.
OVERLAYS = {
    "rays_live": ("rays_off", IN_VIEW),
    "rays_live_changed": ("rays_live", IN_VIEW),
    "handle_turned": ("handle", IN_VIEW),
    "reading": ("handle_turned", IN_VIEW),
    "curves": ("rays_off", IN_VIEW),
    "probe": ("node_sidebar", (1020, 75, 1312, 1000)),
    "eevee": ("rays_off_again", IN_VIEW),
    "pie": ("text_made", IN_VIEW),
    "material_dragged": ("assets", IN_VIEW),
}
LEAST_PIXELS = 150
HASTE = 0.25  # of the seconds that Cycles has for a page's picture, where none is made
# What Blender says where a panel, a handler or an operator fails.
ERROR = re.compile(r"Traceback|^Error[: ]|rna_ui|rna_ui\w+: .*not found|Python script error|uiItem\w+: ")


def press(script, lab, out, haste):
    """Build the extension and tell the story in that lab; the sentences that say what went wrong.

    haste: of the seconds that Cycles has for a page's picture, the part that it has
    """
    zip_of_it = os.environ.get("PRESS_ZIP")  # one that was built before
    if not zip_of_it:
        subprocess.run([sys.executable, ROOT / "build.py", "package"], check=True)
        zip_of_it = max((ROOT / "dist").glob("nim_addon-*.zip"), key=lambda file: file.stat().st_mtime)
    out.mkdir(parents=True, exist_ok=True)
    for old in (*out.glob("[0-9]*-*.png"), *out.glob("failed.*")):
        old.unlink()
    told = {"PRESS_ZIP": str(zip_of_it), "PRESS_OUT": str(out), "PRESS_HERE": str(HERE), "PRESS_HASTE": str(haste)}
    told |= {"LAB_BIND": f"{out}:{Path(zip_of_it).parent}", "LAB_TIMEOUT": "7200", "LAB_SIZE": "{}x{}".format(*SIZE)}
    words = [script, "-d", lab, "shot", HERE / "steps.py", out / "end.png"]
    # keys and drags are events that Blender is told of
    words = [*words, "--enable-event-simulate"]
    said = []
    with subprocess.Popen(
        words, cwd=ROOT, env={**os.environ, **told}, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            said.append(line)
    (out / "said.txt").write_text("".join(said))
    wrong = [f"exit code {process.returncode}"] if process.returncode else []
    wrong += [(out / "failed.txt").read_text()] if (out / "failed.txt").exists() else []
    wrong += [line.strip() for line in said if ERROR.search(line)]
    if not os.environ.get("PRESS_ONLY"):
        wrong += [] if wrong else empty(out)
    return wrong


def picture(out, step):
    """The picture of a step, as an oiio.ImageBuf."""
    return oiio.ImageBuf(str(next(out.glob(f"[0-9]*-{step}.png"))))


def empty(out):
    """What of the things drawn over a view is not to be seen: a sentence each."""
    wrong = []
    for step, (before, (left, top, right, bottom)) in OVERLAYS.items():
        region = oiio.ROI(left, right, top, bottom)
        shown = [
            oiio.ImageBufAlgo.cut(picture(out, name), region).get_pixels(oiio.FLOAT)[..., :3] for name in (step, before)
        ]
        changed = int((abs(shown[0] - shown[1]).max(axis=-1) > 0.1).sum())
        print(f"{step}: {changed} pixels are others than at {before}")
        if changed < LEAST_PIXELS:
            wrong.append(f"{step} shows no more than {before}: {changed} pixels are others")
    return wrong


def sheets(out):
    """Contact sheets of all steps, to be looked at."""
    files = sorted(out.glob("[0-9]*-*.png"))
    across, down, width = 3, 3, 800
    height = width * SIZE[1] // SIZE[0]
    for number, start in enumerate(range(0, len(files), across * down), start=1):
        sheet = oiio.ImageBuf(oiio.ImageSpec(across * width, down * height, 3, "uint8"))
        for place, file in enumerate(files[start : start + across * down]):
            small = oiio.ImageBufAlgo.resize(oiio.ImageBuf(str(file)), roi=oiio.ROI(0, width, 0, height, 0, 1, 0, 3))
            oiio.ImageBufAlgo.paste(sheet, place % across * width, place // across * height, 0, 0, small)
        sheet.write(str(out / f"sheet-{number}.png"))


def cut(out):
    """Cut the pages' pictures out of the steps'."""
    for name, (step, (left, top, right, bottom)) in PICTURES.items():
        part = oiio.ImageBufAlgo.cut(picture(out, step), oiio.ROI(left, right, top, bottom))
        if right - left > WIDEST:
            part = oiio.ImageBufAlgo.resize(part, roi=oiio.ROI(0, WIDEST, 0, (bottom - top) * WIDEST // (right - left)))
        part.specmod().attribute("Compression", "jpeg:80")
        part.write(str(ROOT / "docs" / "images" / f"{name}.jpg"), "uint8")


if __name__ == "__main__":
    script, lab, out = (Path(word).resolve() for word in sys.argv[1:4])
    pages = "--pages" in sys.argv
    wrong = press(script, lab, out, 1 if pages else HASTE)
    sheets(out)
    for sentence in wrong:
        print(f"press.py: {sentence}", file=sys.stderr)
    if pages and not wrong:
        cut(out)
    sys.exit(bool(wrong))

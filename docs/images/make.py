# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the pictures of the README with nimray and put them side by side: run with the Python of .venv, from the root."""

import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from nim_addon.renders.request import Request

FOLDER = Path(__file__).parent
# picture: size of each part, samples, and the parts: scene and settings
PICTURES = {
    "sphere": ((800, 600), 256, [["sphere"]]),
    "glass": ((400, 480), 256, [["glass", f"liquid={liquid}"] for liquid in ("none", "water", "nim")]),
    "pool": ((600, 460), 256, [["pool", "view=window", f"liquid={liquid}"] for liquid in ("water", "nim")]),
}


def picture(name):
    """Render one picture and write it as NAME.jpg."""
    size, samples, parts = PICTURES[name]
    shown = []
    with tempfile.TemporaryDirectory() as work:
        for i, (scene, *settings) in enumerate(parts):
            request = Request.of(scene, settings, size=size, samples=samples, denoise=True)
            shown.append(oiio.ImageBuf(str(request.render(work, str(i)).png)).get_pixels(oiio.UINT8))
    whole = np.ascontiguousarray(np.hstack(shown))
    image = oiio.ImageBuf(oiio.ImageSpec(whole.shape[1], whole.shape[0], 3, oiio.UINT8))
    image.set_pixels(oiio.ROI(), whole)
    image.specmod().attribute("Compression", "jpeg:90")
    image.write(str(FOLDER / f"{name}.jpg"))


for name in sys.argv[1:] or PICTURES:
    picture(name)

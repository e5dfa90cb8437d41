# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the pages in a folder light enough for the extension's zip: pictures as WebP, and no wider than a page shows them.

Run with the Python of an environment that build.py makes: light_pages.py FOLDER
"""

import os
import sys
from pathlib import Path

import OpenImageIO as oiio

WIDEST, QUALITY = 640, 60


def lighten(folder: Path) -> None:
    """Rewrite the pictures of the pages in a folder, and the pages that show them."""
    names = {}
    for file in sorted((folder / "_images").iterdir()):
        if file.suffix in (".jpg", ".png"):
            image = oiio.ImageBuf(str(file))
            width, height = image.spec().width, image.spec().height
            if width > WIDEST:
                image = oiio.ImageBufAlgo.resize(image, roi=oiio.ROI(0, WIDEST, 0, round(height * WIDEST / width)))
            image.specmod().attribute("Compression", f"webp:{QUALITY}")
            light = file.with_suffix(".webp")
            if not image.write(str(light), "uint8"):
                raise OSError(f"{light} cannot be written: {image.geterror()}")
            file.unlink()
            names[f"_images/{file.name}"] = f"_images/{light.name}"
    for page in folder.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        for name, light in names.items():
            text = text.replace(name, light)
        page.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    lighten(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)

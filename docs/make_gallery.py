# SPDX-License-Identifier: GPL-3.0-or-later
"""Write docs/gallery.md and its pictures from what `nimray figures --all --quality final --out FOLDER` made.

  .venv/bin/python docs/make_gallery.py FOLDER [FOLDER ...]

Each figure is taken from the first of the folders that has it; one that none of them has stays on the page as it is, and so
does what stands above PAGE_MARK, which is written by hand.
"""

import json
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

DOCS = Path(__file__).resolve().parent
PAGE, IMAGES = DOCS / "gallery.md", DOCS / "images"
PAGE_MARK = "<!-- docs/make_gallery.py writes what follows; above this line the page is written by hand. -->"
WIDEST, HEAVIEST = 1600, 300_000
LONG = 8  # claims; a longer table is folded


def main(folders: list[str]) -> int:
    """Write the page and the pictures of all figures that lie in `folders`; returns the exit code."""
    records = {}
    for folder in map(Path, folders):
        for file in folder.glob("figure-*.json"):
            record = json.loads(file.read_text(encoding="utf-8"))
            records.setdefault(record["figure"], (folder, record))
    if not records:
        print("make_gallery.py: no figure-*.json there; give a folder that `nimray figures` wrote.", file=sys.stderr)
        return 2
    by_hand, mark, made = PAGE.read_text(encoding="utf-8").partition(PAGE_MARK)
    if not mark:
        print(f"make_gallery.py: {PAGE.name} has lost its mark, {PAGE_MARK!r}.", file=sys.stderr)
        return 1
    for old in IMAGES.glob("figure-*.*"):
        if old.stem.removeprefix("figure-") in records:
            old.unlink()
    sections = dict(re.findall(r"^(## (\S+) .*?)(?=^## |\Z)", made, re.DOTALL | re.MULTILINE))
    sections = {number: section.rstrip() + "\n" for section, number in sections.items()}
    sections |= {number: _section(record, _picture(folder, record)) for number, (folder, record) in records.items()}
    chosen = [sections[number] for number in sorted(sections, key=in_order)]
    PAGE.write_text("\n".join([f"{by_hand}{PAGE_MARK}\n\n{_sum(chosen)}", *chosen]), encoding="utf-8")
    return 0


def in_order(number: str) -> tuple:
    """A key that sorts figures: 5.10 after 5.9, the appendices last."""
    chapter, _, place = number.partition(".")
    return not chapter.isdigit(), chapter.zfill(4), int(place)


def _picture(folder, record):
    """The name of the figure's picture, written to IMAGES: a drawing as it is, a render as a JPEG light enough."""
    source = folder / record["picture"]
    if source.suffix == ".svg" and source.stat().st_size <= HEAVIEST:
        target = IMAGES / f"figure-{record['figure']}.svg"
        shutil.copyfile(source, target)
        return target.name
    image = oiio.ImageBuf(str(source.with_suffix(".png")))
    width, height = image.spec().width, image.spec().height
    if width > WIDEST:
        size = oiio.ROI(0, WIDEST, 0, round(height * WIDEST / width))
        image = oiio.ImageBufAlgo.resize(image, filtername="lanczos3", roi=size)
    # nothing but the pixels: neither the record of the render nor the name of a machine
    pixels = np.ascontiguousarray(image.get_pixels(oiio.UINT8)[..., :3])
    target = IMAGES / f"figure-{record['figure']}.jpg"
    for quality in (88, 84, 80, 75, 70, 60, 50):
        plain = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8))
        plain.set_pixels(plain.roi, pixels)
        plain.specmod().attribute("Compression", f"jpeg:{quality}")
        if not plain.write(str(target)):
            raise OSError(plain.geterror())
        if target.stat().st_size <= HEAVIEST:
            return target.name
    raise OSError(f"{target.name} stays heavier than {HEAVIEST} bytes.")


def _sum(sections):
    summaries = re.findall(
        r"^<summary>(\d+) claims?, (?:all hold|(\d+) FAIL)</summary>$", "\n".join(sections), re.MULTILINE
    )
    claims, failed = (sum(int(number or 0) for number in numbers) for numbers in zip(*summaries, strict=True))
    verdict = f"{failed} of {claims} claims fail" if failed else f"all {claims} claims hold"
    return f"{len(sections)} figures; {verdict}.\n"


def _section(record, picture):
    """One figure: its picture, its caption, what must hold, and the table of its claims."""
    title = _escaped(record["title"])
    command = f"nimray figures {record['figure']}" + (" --quality final" if record["quality"] == "final" else "")
    source = f"{record['quality'].capitalize()} quality, Blender {record['blender']}, nimray {record['nimray']}"
    lines = [f"## {record['figure']} {title}", "", f"![Figure {record['figure']}: {title}](images/{picture})", ""]
    if record["shows"].rstrip(".") != record["title"].rstrip("."):
        lines += [_escaped(record["shows"]), ""]
    said = {claim["text"] for claim in record["claims"]}
    must = [_escaped(sentence) for sentence in record["must_hold"] if sentence not in said]
    lines += [f"- {sentence}" for sentence in must] + ([""] if must else [])
    return "\n".join([*lines, *_table(record["claims"]), "", f"{source}: `{command}`", ""])


def _table(claims):
    holding = sum(claim["holds"] for claim in claims)
    outcome = "all hold" if holding == len(claims) else f"{len(claims) - holding} FAIL"
    summary = f"{len(claims)} claim{'s' * (len(claims) != 1)}, {outcome}"
    opened = "" if len(claims) > LONG else " open"
    rows = [
        f"| {_escaped(claim['text'])}{'' if claim['holds'] else ' **(fails)**'} | {claim['predicted']:.5g} | "
        f"{claim['measured']:.5g} | {claim['allowed']:.2g} | {_escaped(claim['unit'])} |"
        for claim in claims
    ]
    head = ["| claim | predicted | measured | allowed | unit |", "| --- | ---: | ---: | ---: | --- |"]
    return [f"<details{opened}>", f"<summary>{summary}</summary>", "", *head, *rows, "", "</details>"]


def _escaped(text):
    """Plain text as Markdown."""
    return re.sub(r"([\\`*_\[\]<>|$])", r"\\\1", text)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

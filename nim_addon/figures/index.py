# SPDX-License-Identifier: GPL-3.0-or-later
"""The page that shows every figure of a folder beside its claims, predicted and measured. Plain HTML."""

import html
import re
from pathlib import Path, PurePosixPath
from urllib.parse import quote

from ..base import records
from ..base.files import files_to
from ..base.text import counted
from ..base.version import VERSION
from .recipes import in_order

TITLE = "Figures, rendered and measured"

STYLE = """
:root { color-scheme: light dark; --line: #8886; --soft: #8881; --good: #1a7f37; --bad: #c4302b; }
body { margin: 0 auto; max-width: 62rem; padding: 1rem; font: 1rem/1.5 system-ui, sans-serif; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2.5rem 0 .25rem; }
img { display: block; width: 100%; height: auto; background: #fff; border-radius: 4px; }
figure { margin: .75rem 0; } figcaption, .small { font-size: .9rem; opacity: .8; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid var(--line); vertical-align: top; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.holds { color: var(--good); } .fails { color: var(--bad); font-weight: bold; }
ol { columns: 20rem; padding-left: 0; list-style: none; } li a { text-decoration: none; }
"""


def check(folder: str | Path) -> None:
    """Raise OSError, one sentence, where write() would replace a FOLDER/index.html that it did not write."""
    page = Path(folder) / "index.html"
    if page.exists() and not (page.is_file() and f"<title>{TITLE}</title>" in page.read_text("utf-8", "replace")):
        raise OSError(f"{page} is not a page of figures; it is kept: name another folder.")


def read(file: Path) -> dict:
    """The record of a figure that the Path `file` holds; ValueError, one sentence, where it is cut off or another's."""
    try:
        record = records.parse(file.read_text(encoding="utf-8"))
        if record["nimray"] == VERSION:
            if not re.fullmatch(r"(\d{1,2}|[A-Z])\.\d{1,2}", record["figure"], re.ASCII):
                raise ValueError
            _page([record])  # whole is what the page can show
        elif not isinstance(record["nimray"], str):
            raise TypeError
    except (AttributeError, KeyError, TypeError, ValueError):
        raise ValueError(f"{file} is not a whole record of a figure; delete it, or name another folder.") from None
    return record


def write(folder: str | Path) -> Path:
    """Write FOLDER/index.html anew from the records (figure-*.json) in it; returns its path. Raises as read() does."""
    folder = Path(folder)
    shown = [read(file) for file in folder.glob("figure-*.json")]
    shown.sort(key=lambda record: in_order(record["figure"]))
    with files_to(folder, "index") as (part, finish):
        page = part / "page.html"
        page.write_text(_page(shown), encoding="utf-8")
        return finish(page)[0]


def number(value: float) -> str:
    """A number as the page and the command print it."""
    return f"{value:.4g}"


def _page(figures):
    claims = [claim for record in figures for claim in record["claims"]]
    failed = sum(not claim["holds"] for claim in claims)
    verdict = f"{failed} of {len(claims)} claims fail" if failed else f"all {len(claims)} claims hold"
    contents = "".join(
        f'<li><a href="#figure-{record["figure"]}">{_mark(record["holds"])} {record["figure"]} '
        f"{html.escape(record['title'])}</a></li>"
        for record in figures
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{TITLE}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{TITLE}</h1>\n<p>{counted(len(figures), 'figure')}, {verdict}. Each claim is a number, "
        "predicted by theory or by rays traced without the renderer (in C.2, by its path tracer), and measured in a render.</p>\n"
        f"<ol>{contents}</ol>\n{''.join(map(_figure, figures))}</body>\n</html>\n"
    )


def _mark(holds):
    word, sign = ("holds", "&#10003;") if holds else ("fails", "&#10007;")
    return f'<span class="{word}" role="img" aria-label="{word}">{sign}</span>'


def _figure(record):
    escape = html.escape
    title = f"{record['figure']} {record['title']}"
    parts = ", ".join(
        f'<a href="{_link(file)}">{escape(caption or Path(file).stem)}</a>' for caption, file in record["parts"]
    )
    must = "".join(f"<li>{escape(sentence)}</li>" for sentence in record["must_hold"])
    return (
        f'<section id="figure-{record["figure"]}">\n<h2>{escape(title)}</h2>\n'
        f'<figure><a href="{_link(record["picture"])}"><img src="{_link(record["picture"])}" loading="lazy" '
        f'alt="{escape(record["shows"])}"></a>\n<figcaption>{escape(record["shows"])}'
        f"{f' Single pictures: {parts}.' if parts else ''}</figcaption></figure>\n"
        f'<ul class="small">{must}</ul>\n{_table(record["claims"])}'
        f'<p class="small">{escape(record["quality"])} quality, nimray {escape(record["nimray"])}, Blender '
        f'{escape(record["blender"])}, <a href="figure-{record["figure"]}.json">record</a></p>\n</section>\n'
    )


def _link(file):
    """What leads to a file below the page's folder, and nowhere else; ValueError for any other."""
    path = PurePosixPath(file)
    if path.is_absolute() or ".." in path.parts:
        raise ValueError
    return html.escape(quote(str(path)))


def _table(claims):
    rows = "".join(
        f"<tr><td>{_mark(claim['holds'])}</td><td>{html.escape(claim['text'])}</td>"
        + "".join(f'<td class="number">{number(claim[key])}</td>' for key in ("predicted", "measured"))
        + f'<td class="number">&#177; {claim["allowed"]:.2g}</td><td>{html.escape(claim["unit"])}</td></tr>\n'
        for claim in claims
    )
    head = (
        '<th></th><th>claim</th><th class="number">predicted</th><th class="number">measured</th>'
        '<th class="number">allowed</th><th>unit</th>'
    )
    return f'<div class="scroll"><table>\n<tr>{head}</tr>\n{rows}</table></div>\n'

# SPDX-License-Identifier: GPL-3.0-or-later
"""The one look of the drawn figures, and how their files are written. matplotlib is needed here, and only when drawing."""

import io
import os
from contextlib import AbstractContextManager
from pathlib import Path
from types import ModuleType

from ..base.files import whole

# Okabe and Ito's colours, told apart with any colour vision; every use has a second sign, so that grey print works too.
INK, GREY = "#1a1a1a", "#767676"
BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#007A5A"

SUFFIXES = (".svg", ".png", ".pdf")

_LOOK = {
    "font.family": ["DejaVu Sans"],
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "legend.facecolor": "white",
    "legend.edgecolor": "none",
    "legend.framealpha": 1.0,
    "lines.linewidth": 1.6,
    "figure.dpi": 100,
    "mathtext.fontset": "dejavusans",
    # letters as outlines: the same everywhere, where a missing font would push formulas apart; the words are in comments
    "svg.fonttype": "path",
    "svg.hashsalt": "nim",
    "pdf.fonttype": 42,
}
# nothing that differs from one run to the next
_METADATA = {
    ".svg": {"Date": None, "Creator": None},
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def matplotlib() -> ModuleType:
    """The module, or a RuntimeError that says how to get it."""
    windows = os.environ.pop("MPLBACKEND", None)  # of which none is opened, and one that is not there ends the import
    try:
        import matplotlib
        import matplotlib.figure
    except ImportError:
        raise RuntimeError("matplotlib is missing, which draws the figures; run: pip install matplotlib") from None
    finally:
        if windows is not None:
            os.environ["MPLBACKEND"] = windows
    return matplotlib


def look() -> AbstractContextManager:
    """A context in which figures are made and saved."""
    return matplotlib().rc_context(_LOOK)


def sheet(width: float, height: float, rows: int = 1, columns: int = 1, **options) -> tuple:
    """A figure of width x height inches and its axes, an array (rows, columns); to be called within look()."""
    figure = matplotlib().figure.Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def known_suffix(file: str | Path) -> str:
    """The suffix of a file that can be drawn; ValueError for any other."""
    suffix = Path(file).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(
            f"{str(file)!r} ends in none of {', '.join(SUFFIXES)}, which a drawing can be written as; "
            "name it like rays.svg."
        )
    return suffix


def save(figure, title: str, *files: str | Path) -> list[Path]:
    """Write the figure to each of the files, .svg, .png (150 dots an inch) or .pdf; returns their Paths. Raises as whole().

    `title` is kept in the file, for those who list or hear it rather than see it.
    """
    written = []
    for file, suffix in [(file, known_suffix(file)) for file in files]:
        # by way of memory: on a full disk matplotlib's PDF ends in an error of its own
        drawing = io.BytesIO()
        with look():
            figure.savefig(drawing, format=suffix[1:], dpi=150, metadata=_METADATA[suffix] | {"Title": title})
        written.append(whole(file, lambda part, drawing=drawing: part.write_bytes(drawing.getvalue())))
    return written


def number(value: float) -> str:
    """A number as it is printed: a true minus sign, no trailing zeros."""
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")

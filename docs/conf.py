# SPDX-License-Identifier: GPL-3.0-or-later
"""How Sphinx makes the pages: Markdown by MyST, equations as MathML, the API from the docstrings. Run by build.py docs."""

import html
import inspect
import logging
import re
import sys
import tomllib
from pathlib import Path

import ziamath.fonts
from docutils import nodes
from fontTools import subset
from latex2mathml.converter import convert

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

project = "Negative-Index Materials"
release = tomllib.loads((ROOT / "nim_addon" / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["press", "images"]
suppress_warnings = ["config.cache"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
highlight_language = "text"
smartquotes = False

autodoc_mock_imports = ["bpy", "bmesh", "mathutils", "OpenImageIO", "matplotlib"]  # Blender is not needed to read
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
add_module_names = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = f"{project} {release}"
FONT = Path(ziamath.fonts.__file__).parent / "STIXTwoMath-Regular.ttf"
# a font with what equations need: some systems have none, and their fractions and roots then overlap
html_static_path = ["style", str(FONT)]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
html_show_copyright = False
html_copy_source = False
html_show_sourcelink = False

# ------------------------------------------------------------------------------------------------ equations
# MathML, which browsers draw by themselves: no script, nothing from the network.


# the converter puts no space behind a function's name and its power, nor before them where a factor stands there
FUNCTION = re.compile(r"<msup><mi>(?:sin|cos|tan)</mi>.*?</msup>|<mi>(?:arc)?(?:sin|cos|tan)</mi>")
FACTOR = re.compile(r"</m(?:i|n|sub|sup)>(?=(?:<msup>)?<mi>(?:arc)?(?:sin|cos|tan)</mi>)")
SPACE = r'\g<0><mspace width="0.17em"/>'


def mathml(latex, display):
    """The MathML of an equation; `display`: "inline" or "block"."""
    return FUNCTION.sub(SPACE, FACTOR.sub(SPACE, convert(latex, display=display)))


def inline_equation(translator, node):
    """Write an equation of a line of text."""
    translator.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def display_equation(translator, node):
    """Write an equation of its own."""
    translator.body.append(f'<div class="equation">{mathml(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


def lighten_font(app, error):
    """Leave of the font only what the equations need: all of it would weigh as much as all other pages together."""
    pages = "".join(page.read_text(encoding="utf-8") for page in Path(app.outdir).rglob("*.html"))
    letters = html.unescape("".join(re.findall(r"<math.*?</math>", pages, re.DOTALL)))
    font = Path(app.outdir, "_static", FONT.name)
    if error is None:
        logging.getLogger("fontTools").setLevel(logging.WARNING)
        options = subset.Options()
        options.layout_features = ["*"]
        with subset.load_font(str(FONT), options) as whole:
            part = subset.Subsetter(options)
            part.populate(text=letters)
            part.subset(whole)
            subset.save_font(whole, str(font), options)


# ------------------------------------------------------------------------------------------------ docstrings
# They are plain text: `code` in single backticks, and lines "name: meaning", indented where they go on.

ITEM = re.compile(r"(\w+(?:, \w+)*): +(\S.*)")


def marked_up(text):
    """A line of plain text as reStructuredText: `code` stays code, and no other character is markup."""
    parts = re.split(r"`([^`]+)`", text)
    parts[::2] = [re.sub(r"([\\*`|_<>])", r"\\\1", part) for part in parts[::2]]
    return "".join(f"``{part}``" if at % 2 else part for at, part in enumerate(parts))


def read_docstring(app, what, name, thing, options, lines):
    """Turn the lines of a docstring into reStructuredText, in place: each "name: meaning" becomes an item of a list."""
    answer, within = [], False
    for at, line in enumerate(lines):
        item = ITEM.fullmatch(line) if at else None  # the first line is a sentence
        if item:
            answer += [*([] if within else [""]), f"- ``{item[1]}``: {marked_up(item[2])}"]
            within = True
        elif within and line.startswith(" "):
            answer.append(f"  {marked_up(line.strip())}")
        else:
            answer += [*([""] if within else []), marked_up(line.strip())]
            within = False
    lines[:] = [*answer, ""]


def leave_out(app, what, name, thing, skip, options):
    """Leave out what Python writes of itself: the docstrings of a NamedTuple's fields and of an enum's methods."""
    said = inspect.getdoc(thing) or ""
    return True if said.startswith("Alias for field number") else None


def setup(app):
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (inline_equation, None), (display_equation, None))
    app.connect("autodoc-process-docstring", read_docstring)
    app.connect("autodoc-skip-member", leave_out)
    app.connect("build-finished", lighten_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

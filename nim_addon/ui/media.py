# SPDX-License-Identifier: GPL-3.0-or-later
"""The media that a person chooses from, for a panel and as properties of an operator; the backend of a new material."""

import math

import bpy
import numpy as np

from ..cycles.material import osl_available, resolve
from ..physics import MEDIA, Medium
from . import preferences
from .translations import OWN

# Of media with the same numbers the first stands for all. The numbers are kept in files: never change one.
MEDIUM_NUMBERS = {
    "air": 1,
    "water": 2,
    "glass": 3,
    "diamond": 4,
    "nim-1.025": 5,
    "nim-1.33": 6,
    "nim-1.5": 7,
    "nim-2.418": 8,
    "nim-4.1": 9,
    "nim-mu10": 10,
    "nim-mu25": 11,
}
# Those that disperse, or have loss: measured ones, and negative-index ones to teach with.
MEASURED_NUMBERS = {
    "water-daimon": 20,
    "n-bk7": 21,
    "n-sf11": 22,
    "fused-silica": 23,
    "diamond-peter": 24,
    "silver": 25,
    "gold": 26,
}
TAUGHT_NUMBERS = {"nim-causal": 30, "nim-normal": 31, "nim-mirror": 32, "fishnet": 33}
DISPERSIVE_NUMBERS = MEASURED_NUMBERS | TAUGHT_NUMBERS
MEDIUM_NAMES = {"air": "Air, vacuum", "water": "Water", "glass": "Glass", "diamond": "Diamond"}
# What a panel says of those: the name, where the numbers come from, and what they are good for.
DISPERSIVE_TEXTS = {
    "water-daimon": (
        "Water (measured)",
        "Water at 20 °C, after Daimon and Masumura 2007 and Hale and Querry 1973: blue bends most, as in a rainbow",
    ),
    "n-bk7": (
        "N-BK7 (crown glass)",
        "Schott's most common glass, after its catalog: the small dispersion of a window",
    ),
    "n-sf11": (
        "N-SF11 (flint glass)",
        "Schott's dense flint, after its catalog: prisms of it spread the colors widely",
    ),
    "fused-silica": ("Fused silica", "Quartz glass, after Malitson 1965: the least dispersion among the glasses here"),
    "diamond-peter": ("Diamond (measured)", "After Peter 1923: its dispersion is the fire of cut stones"),
    "silver": ("Silver", "After Johnson and Christy 1972: a mirror of all colors, nothing is seen through it"),
    "gold": ("Gold", "After Johnson and Christy 1972: a mirror of yellow and red, nothing is seen through it"),
    "nim-causal": (
        "NIM, causal",
        "n = -1.33 at 550 nm, ε = μ after Drude: the least dispersion that causality allows a NIM without loss; "
        "red bends most, by far",
    ),
    "nim-normal": (
        "NIM, normal",
        "n = -1.33 at 550 nm, a small dispersion of the right sign, |n| grows to the red; less of it than causality demands",
    ),
    "nim-mirror": (
        "NIM, mirrored glass",
        "n = -1.33 at 550 nm, the curve of a glass with its sign turned: blue bends most, which no NIM without loss can do",
    ),
    "fishnet": (
        "Fishnet (infrared)",
        "The NIM that Valentine and others made in 2008, in false colors: 1200 to 1775 nm are shown as 380 to 730 nm; n is "
        "positive in the blue, negative in the red",
    ),
}
CUSTOM, ABSORBING, FILE = "custom", "absorbing", "file"
ABSORBING_NUMBER, FILE_NUMBER = 91, 90
SIDES = ("inside", "outside")
# The range of the node's sockets.
MOST_N, MOST_MU, MOST_K = 10.0, 100.0, 100.0


def number(value: float) -> str:
    """A number as a person writes it: four digits that count, no trailing zeros."""
    return f"{value:.4g}"


def plain(value: float) -> float:
    """The shortest decimal that a value of Blender's single precision stands for: -1.33, not -1.3300000429."""
    return float(str(np.float32(value)))


def numbers_of(medium: Medium) -> str:
    """The numbers of a medium, short enough for a menu in the sidebar: n, and mu where it is not 1 with the sign of n."""
    if abs(medium.mu) == 1:
        return f"n = {number(medium.n)}"
    return f"{number(medium.n)}, μ = {number(medium.mu)}"


def _label(name):
    medium = MEDIA[name]
    return f"{MEDIUM_NAMES.get(name, 'NIM')} ({numbers_of(medium)})"


def _help(name):
    medium = MEDIA[name]
    return f"n = {number(medium.n)}, μ = {number(medium.mu)}"


def _heading(text):
    return ("", text, "", "NONE", 0)


# As a menu shows them, each part a column under its heading.
MEDIUM_ITEMS = (
    _heading("One number"),
    *((name, _label(name), _help(name), "NONE", value) for name, value in MEDIUM_NUMBERS.items()),
    _heading("Measured, by wavelength"),
    *((name, *DISPERSIVE_TEXTS[name], "NONE", value) for name, value in MEASURED_NUMBERS.items()),
    _heading("To teach with, by wavelength"),
    *((name, *DISPERSIVE_TEXTS[name], "NONE", value) for name, value in TAUGHT_NUMBERS.items()),
    _heading("Your own"),
    (CUSTOM, "Own values", "The n and μ that are typed in", "NONE", 0),
)
# And of a material that is there already.
PANEL_ITEMS = (
    *MEDIUM_ITEMS,
    (
        ABSORBING,
        "Own values, absorbing",
        "The n and μ that are typed in, in which light falls to 1/e over the absorption length, in all colors alike",
        "NONE",
        ABSORBING_NUMBER,
    ),
    (
        FILE,
        "From a file...",
        "n and k by wavelength, of a .yml file of the refractiveindex.info database",
        "NONE",
        FILE_NUMBER,
    ),
)


def medium_property(default: str, name: str, description: str):
    """An EnumProperty of the ready media, for an operator."""
    return bpy.props.EnumProperty(
        name=name, description=description, items=MEDIUM_ITEMS, default=default, translation_context=OWN
    )


def index_property(default: float):
    """A FloatProperty of n, for an operator whose medium is "custom"."""
    return bpy.props.FloatProperty(
        name="n",
        description="Refractive index; any but 0",
        min=-MOST_N,
        max=MOST_N,
        default=default,
        step=1,
        precision=3,
    )


def permeability_property():
    """A FloatProperty of |mu|, for an operator whose medium is "custom"."""
    return bpy.props.FloatProperty(
        name="|μ|",
        description="Relative permeability; it takes the sign of n",
        min=0.001,
        max=MOST_MU,
        default=1.0,
        step=10,
        precision=3,
    )


def chosen_medium(name: str, n: float, mu: float) -> Medium:
    """The Medium of an enum item; of n and mu where it is "custom". Raises ValueError for n = 0."""
    if name != CUSTOM:
        return Medium.parse(name)
    n = plain(n)
    return Medium(n, math.copysign(plain(mu), n) if n else None)


def backend_for(scene: bpy.types.Scene, choice: str | None = None) -> str:
    """The backend, "osl" or "nodes", of a new material, such that it renders in `scene` as that is set up.

    choice: "osl", "nodes" or "auto"; the preferences' if None. "auto" is OSL only where the scene has it turned on.
    """
    choice = choice or preferences.settings().backend
    if choice == "osl" and osl_available():
        return "osl"
    if choice == "nodes" or not getattr(scene, "cycles", None) or not scene.cycles.shading_system:
        return "nodes"
    return resolve("auto", scene)


def draw_choice(layout: bpy.types.UILayout, operator: bpy.types.Operator, medium: str, n: str, mu: str) -> None:
    """Draw an operator's three properties of those names: the numbers only where the medium is of own values."""
    column = layout.column(align=True)
    column.use_property_split = True
    column.prop(operator, medium)
    if getattr(operator, medium) == CUSTOM:
        column.prop(operator, n)
        column.prop(operator, mu)

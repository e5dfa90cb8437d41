# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures by number."""

from itertools import chain
from types import MappingProxyType

from ..base.text import unknown
from . import (
    ball,
    ball_diagram,
    caustics,
    coloured_caustics,
    cube,
    curves,
    diagrams,
    drop,
    glass,
    lens,
    point_source,
    pool,
    prism,
    sea,
    sphere,
    wave,
    window,
)
from .recipes import Figure, in_order

MODULES = (
    cube,
    sphere,
    glass,
    pool,
    sea,
    caustics,
    prism,
    drop,
    coloured_caustics,
    point_source,
    wave,
    lens,
    curves,
    diagrams,
    ball_diagram,
    ball,
    window,
)  # each has FIGURES, a tuple of Figure

FIGURES = MappingProxyType(
    {
        figure.number: figure
        for figure in sorted(
            chain.from_iterable(module.FIGURES for module in MODULES), key=lambda figure: in_order(figure.number)
        )
    }
)


def figure(number: str) -> Figure:
    """The Figure of that number; ValueError names those that exist, the nearest first."""
    if number not in FIGURES:
        raise ValueError(unknown("figure", number, list(FIGURES)))
    return FIGURES[number]

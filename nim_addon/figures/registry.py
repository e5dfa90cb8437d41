# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures by number."""

from functools import partial
from itertools import chain
from types import MappingProxyType

from ..scenes.parameters import unknown
from . import caustics, cube, curves, diagrams, glass, pool, sea, sphere
from .recipes import Figure, in_order

MODULES = (cube, sphere, glass, pool, sea, caustics)  # each has FIGURES, a tuple of Figure


def _drawn(module):
    """The Figures of a module that draws without rendering: its FIGURES are a dict of number and title."""
    return [
        Figure(
            number,
            title,
            title + ".",
            tuple(claim.text for claim in module.claims(number)),
            measure=lambda images, number=number: module.claims(number),
            draw=partial(module.draw, number),
        )
        for number, title in module.FIGURES.items()
    ]


FIGURES = MappingProxyType(
    {
        figure.number: figure
        for figure in sorted(
            chain(*(module.FIGURES for module in MODULES), _drawn(curves), _drawn(diagrams)),
            key=lambda figure: in_order(figure.number),
        )
    }
)


def figure(number):
    """The Figure of that number; ValueError names those that exist, the nearest first."""
    if number not in FIGURES:
        raise ValueError(unknown("figure", number, list(FIGURES)))
    return FIGURES[number]

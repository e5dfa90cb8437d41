# SPDX-License-Identifier: GPL-3.0-or-later
"""What a figure is made of: recipes that fix a scene, the images they give, and what must hold in them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .measure import Camera

QUALITIES = ("draft", "final")


@dataclass(frozen=True)
class Recipe:
    """One render.

    name:     of its files, and of its image in measure(); letters, digits, dots, dashes
    scene:    name of one of scenes.SCENES, or of those OF_FIGURES
    settings: texts "key=value", as `nimray render --set` takes them
    draft:    size (width, height) in pixels, and samples, at that quality
    final:    the same; as the draft where left out, which is right for what is only measured
    change:   None, or a function of the built bpy.types.Scene that changes it; its code is part of the image's record
    pose:     None, or a scenes.stage.Pose in place of the scene's own
    photons:  how many photons bring the caustics, at draft and at final quality; None: they are found by chance
    spectral: whether all wavelengths are in it
    wavelength: the only one that is, nanometres; None: media as at 550 nm, or all where it is spectral
    seeds:    how many renders of different noise
    shown:    whether it is a part of the sheet, or only measured
    caption:  one line on it
    """

    name: str
    scene: str
    settings: tuple = ()
    draft: tuple = ((480, 360), 64)
    final: tuple | None = None
    change: Callable | None = None
    pose: tuple | None = None
    photons: tuple | None = None
    spectral: bool = False
    wavelength: float | None = None
    seeds: int = 1
    shown: bool = True
    caption: str = ""

    def __post_init__(self):
        if self.change:
            from ..renders.changes import register  # which needs Blender, as drawn figures do not

            register(self.change)

    def frame(self, quality: str) -> tuple:
        """Size and samples at a quality, "draft" or "final"."""
        return self.final if quality == "final" and self.final else self.draft


class Image(NamedTuple):
    """What a recipe gave: (seeds, H, W, 3) linear pixels, the measure.Camera that saw them, and the scene's Parameters."""

    each: np.ndarray
    camera: Camera
    parameters: object

    @property
    def pixels(self) -> np.ndarray:
        """(H, W, 3), the mean over the seeds."""
        return self.each.mean(axis=0)


@dataclass(frozen=True)
class Figure:
    """A figure of the thesis.

    number:    as the thesis has it, "5.4"
    title:     a few words
    shows:     a caption in our own words
    stated:    sentences, what must hold; left out where the texts of the claims say it, as they do of a drawn figure
    recipes:   its renders; those shown make the sheet, from left to right, `columns` in a row (0: all in one row)
    measure:   function of a dict of Image by the recipe's name; returns a list of claims.Claim
    draw:      for a figure without renders: function of a folder (Path) that writes its files there and returns their
               paths, the picture to show first (SVG or PNG)
    """

    number: str
    title: str
    shows: str
    stated: tuple = ()
    recipes: tuple = ()
    measure: Callable = lambda images: []
    draw: Callable | None = None
    columns: int = 0

    @cached_property
    def must_hold(self) -> tuple:
        """The sentences that say what is claimed."""
        return self.stated or tuple(claim.text for claim in self.measure({}))


def drawn_figure(number: str, title: str, claims: Callable, draw: Callable) -> Figure:
    """A Figure that is drawn, not rendered, and shows what its title says.

    claims: function that returns its list of claims.Claim; draw: as Figure has it
    """
    return Figure(number, title, f"{title}.", measure=lambda images: claims(), draw=draw)


def in_order(number: str) -> tuple:
    """A key that sorts figures by number: 5.10 after 5.9, the appendices last."""
    chapter, _, place = number.partition(".")
    return (0, int(chapter), int(place)) if chapter.isdigit() else (1, ord(chapter), int(place))

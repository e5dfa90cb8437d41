# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes by name: what each shows, its parameters, and the function that builds it."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import bpy  # the wheel has bmesh only once bpy is imported

from ..base.text import unknown
from ..physics import MEDIA, Medium
from . import ball, cube, drop, glass, lens, pool, prism, sea, sphere, window
from .parameters import Parameters, written
from .stage import Pose


class SceneType(NamedTuple):
    """A scene that can be asked for by its name.

    shows:      one line on what it shows
    parameters: the dataclass of its parameters
    build:      function of parameters and a backend, as material.resolve takes it, that returns a scene
    pose:       function of parameters that says where the camera stands
    compared:   by the name of a parameter, the values that show the scene empty, with water and with a NIM
    size:       of its picture, (width, height) in pixels, where nothing else is asked for
    """

    name: str
    shows: str
    parameters: type[Parameters]
    build: Callable[..., bpy.types.Scene]
    pose: Callable[[Any], Pose]
    compared: Mapping[str, tuple]
    size: tuple[int, int]

    def variants(self) -> list[list[str]]:
        """The settings, texts "key=value", of each of the pictures that show what is `compared`."""
        return [[f"{key}={written(value)}"] for key, values in self.compared.items() for value in values]


FILLINGS = {"liquid": (None, MEDIA["water"], MEDIA["nim"])}


SCENES = MappingProxyType(
    {
        scene.name: scene
        for scene in (
            SceneType(
                "glass",
                "a straw in a glass on a table, filled with water, a NIM or nothing (thesis 5.1, 5.2, 5.5)",
                glass.GlassParameters,
                glass.build,
                glass.pose,
                FILLINGS,
                glass.SIZE,
            ),
            SceneType(
                "pool",
                "a tiled swimming pool, from outside or from under the surface (thesis 5.3, 5.7, 5.9, 5.10)",
                pool.PoolParameters,
                pool.build,
                pool.pose,
                FILLINGS,
                pool.SIZE,
            ),
            SceneType(
                "sphere",
                "a transparent sphere on a patterned ground (thesis 5.4, 5.6)",
                sphere.SphereParameters,
                sphere.build,
                sphere.pose,
                {"n": (1.0, 1.33, -1.33)},
                sphere.SIZE,
            ),
            SceneType(
                "sea",
                "the open sea from below its surface (thesis 2.4)",
                sea.SeaParameters,
                sea.build,
                sea.pose,
                FILLINGS,
                sea.SIZE,
            ),
            SceneType(
                "drop",
                "a drop in the sun, and what it throws back onto a wall: a rainbow, or none",
                drop.DropParameters,
                drop.build,
                drop.pose,
                FILLINGS,
                drop.SIZE,
            ),
            SceneType(
                "prism",
                "a prism of glass or of a NIM in the light of a slit, and its spectrum on a screen",
                prism.PrismParameters,
                prism.build,
                prism.pose,
                {"medium": tuple(map(Medium.parse, ("n-bk7", "nim-mirror", "nim-causal")))},
                prism.SIZE,
            ),
            SceneType(
                "lens",
                "a flat lens: a plate of n = mu = -1, a ball behind it and its image before it",
                lens.LensParameters,
                lens.build,
                lens.pose,
                {"n": (1.0, 1.33, -1.0)},
                lens.SIZE,
            ),
            SceneType(
                "ball",
                "a graded ball in a garden: a lens, a fish-eye, a magnifier, or what nobody sees",
                ball.BallParameters,
                ball.build,
                ball.pose,
                {"device": ("luneburg", "magnifier", "cloak")},
                ball.SIZE,
            ),
            SceneType(
                "window",
                "a chess piece behind a window of lenslets, or of a medium through which it is seen twice",
                window.WindowParameters,
                window.build,
                window.pose,
                {"eta": (1.0, 0.8, -1.0)},
                window.SIZE,
            ),
        )
    }
)

# Those that only figures show: nobody is offered them.
OF_FIGURES = MappingProxyType(
    {
        "cube": SceneType(
            "cube",
            "a ball in a cube of glass under water",
            cube.CubeParameters,
            cube.build,
            cube.pose,
            {},
            cube.SIZE,
        )
    }
)


def scene_type(name: str, *, of_figures: bool = False) -> SceneType:
    """The SceneType of that name; ValueError names the scenes that exist, the nearest first.

    of_figures: whether it may be one that only figures show
    """
    if of_figures and name in OF_FIGURES:
        return OF_FIGURES[name]
    if name not in SCENES:
        raise ValueError(unknown("scene", name, list(SCENES)))
    return SCENES[name]

# SPDX-License-Identifier: GPL-3.0-or-later
"""A transparent sphere on a patterned ground, under a sky with a horizon (thesis figures 5.4 and 5.6)."""

from dataclasses import dataclass

from ..cycles.material import interface_material
from ..physics import Medium
from . import shapes, surfaces
from .parameters import Parameters, number, switch
from .stage import Stage


@dataclass(frozen=True)
class SphereParameters(Parameters):
    """Parameters of the sphere scene."""

    n: float = number(-1.5, "refractive index of the sphere", -10.0, 10.0)
    mu: float = number(None, "relative permeability of the sphere; the sign of n if left out", -100.0, 100.0)
    companions: bool = switch(False, "an opaque red sphere behind, a blue one in front")

    def __post_init__(self):
        super().__post_init__()
        medium = Medium(self.n, self.mu)
        object.__setattr__(self, "mu", medium.mu)

    @property
    def medium(self):
        """The Medium inside the sphere."""
        return Medium(self.n, self.mu)


def build(parameters, backend="auto"):
    """Build the scene from SphereParameters; returns the bpy.types.Scene. The radius is 1 m, the camera looks along +y."""
    stage = Stage("sphere", (800, 600), backend)
    stage.mesh(
        "Ground",
        *shapes.rectangle((-200, -200), (200, 200)),
        # no joint of the pattern runs under the sphere's middle: it would show as a seam in the sky that it mirrors
        surfaces.checker("Ground", (0.78, 0.70, 0.56), (0.11, 0.09, 0.075), 0.8),
        location=(0.3, 0.2, 0),
    )
    # Resting on the ground, with a gap as wide as nothing: 1 mm keeps the two surfaces from touching.
    ball(stage, "Sphere", (0, 0, 1.001), 1.0, interface_material("Sphere", parameters.medium, backend=stage.backend))
    if parameters.companions:
        ball(stage, "Red", (0.55, 2.6, 0.6), 0.6, surfaces.plain("Red", (0.75, 0.03, 0.02)))
        ball(stage, "Blue", (-0.82, -1.9, 0.35), 0.35, surfaces.plain("Blue", (0.02, 0.08, 0.7)))
    stage.world(
        surfaces.sky(
            "Sky",
            (0.62, 0.80, 1.0),
            (0.03, 0.14, 0.55),
            glow=((-0.56, -0.36, 0.75), (62.0, 54.0, 42.0), 8.0),
        ),
        aim=256,
    )
    stage.camera((0, -7.0, 1.9), (0, 0, 0.95), 34)
    return stage.scene


def ball(stage, name, center, radius, material):
    """A sphere that is round to 1e-5 of its radius: a few quads that Blender divides and casts onto the sphere."""
    vertices, faces = shapes.cube_sphere(8)
    thing = stage.mesh(name, vertices * radius, faces, material, smooth=True, location=center)
    divide = thing.modifiers.new("Divide", "SUBSURF")
    divide.subdivision_type = "SIMPLE"
    divide.levels, divide.render_levels = 2, 4
    cast = thing.modifiers.new("Round", "CAST")
    cast.cast_type, cast.factor, cast.use_radius_as_size = "SPHERE", 1.0, False
    cast.size = radius
    return thing

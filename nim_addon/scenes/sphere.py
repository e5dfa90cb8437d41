# SPDX-License-Identifier: GPL-3.0-or-later
"""A transparent sphere on a patterned ground, under a sky with a horizon (thesis figures 5.4 and 5.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import bpy

from ..cycles.material import interface_material
from ..physics import Medium
from . import shapes, surfaces
from .parameters import Parameters, index, number, switch
from .stage import Pose, Stage, staged

SIZE = (800, 600)  # pixels of its picture, where nothing else is asked for
# Lengths in metres, colours linear RGB. The sphere rests on the ground, with a gap as wide as nothing: 1 mm keeps the
# two surfaces from touching.
CENTER, RADIUS = (0.0, 0.0, 1.001), 1.0
# No joint of the pattern runs under the sphere's middle: it would show as a seam in the sky that it mirrors.
LIGHT, DARK, TILE, JOINT, GROUND = (0.78, 0.70, 0.56), (0.11, 0.09, 0.075), 0.8, (0.3, 0.2), 200.0
HORIZON, ZENITH = (0.62, 0.80, 1.0), (0.03, 0.14, 0.55)
# Towards the sun, a Gaussian, and its irradiance across its rays, whatever its width.
TOWARDS_SUN, SUN_IRRADIANCE = (-0.56, -0.36, 0.75), (3.748, 3.265, 2.539)


class Ball(NamedTuple):
    """An opaque sphere beside the transparent one."""

    name: str
    center: tuple[float, float, float]
    radius: float
    color: surfaces.RGB


COMPANIONS = (
    Ball("Red", (0.55, 2.6, 0.6), 0.6, (0.75, 0.03, 0.02)),
    Ball("Blue", (-0.82, -1.9, 0.35), 0.35, (0.02, 0.08, 0.7)),
)


@dataclass(frozen=True)
class SphereParameters(Parameters):
    """Parameters of the sphere scene; `n` is the Medium where a real index and `mu` do not say all of it."""

    n: float | Medium = index(-1.5, "refractive index of the sphere, or any medium", -10.0, 10.0)
    mu: float | None = number(None, "relative permeability of the sphere; the sign of n if left out", -100.0, 100.0)
    roughness: float = number(0.0, "roughness of its surface, as in Blender's Glass; 0 is smooth", 0.0, 1.0)
    companions: bool = switch(False, "an opaque red sphere behind, a blue one in front")

    sun_angle: float = number(16.0, "width of the sun; its light stays the same", 0.25, 30.0, "degrees")

    def __post_init__(self):
        super().__post_init__()
        medium = self.medium
        # numbers where they say it all; else the medium holds its own mu
        n, mu = (medium.n, medium.mu) if medium.is_real else (medium, None)
        object.__setattr__(self, "n", n)
        object.__setattr__(self, "mu", mu)

    @property
    def medium(self) -> Medium:
        """The Medium inside the sphere."""
        if isinstance(self.n, Medium):
            return self.n if self.mu is None else self.n.with_mu(self.mu)
        return Medium(self.n, self.mu)


@staged(SphereParameters)
def build(parameters: SphereParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from SphereParameters; returns the bpy.types.Scene. The radius is 1 m, the camera looks along +y."""
    stage = Stage("sphere", SIZE, backend)
    stage.mesh(
        "Ground",
        *shapes.rectangle((-GROUND, -GROUND), (GROUND, GROUND)),
        surfaces.checker("Ground", LIGHT, DARK, TILE),
        location=(*JOINT, 0),
    )
    material = interface_material("Sphere", parameters.medium, backend=stage.backend, roughness=parameters.roughness)
    ball(stage, "Sphere", CENTER, RADIUS, material)
    for companion in COMPANIONS if parameters.companions else ():
        material = surfaces.plain(companion.name, companion.color)
        ball(stage, companion.name, companion.center, companion.radius, material)
    stage.world(surfaces.sky("Sky", HORIZON, ZENITH, glow=sun(parameters)), aim=256)
    stage.camera(*pose(parameters))
    return stage.scene


def sun(parameters: SphereParameters) -> surfaces.Glow:
    """The sun of these SphereParameters."""
    return surfaces.sun(TOWARDS_SUN, SUN_IRRADIANCE, parameters.sun_angle)


def pose(parameters: SphereParameters | None = None) -> Pose:
    """The Pose of the camera, the same for all SphereParameters."""
    return Pose((0, -7.0, 1.9), (0, 0, 0.95), 34)


def ball(stage: Stage, name: str, center: tuple, radius: float, material: bpy.types.Material) -> bpy.types.Object:
    """A sphere that is round to 1e-5 of its radius: a few quads that Blender divides and casts onto the sphere."""
    vertices, faces = shapes.cube_sphere(8)
    object_ = stage.mesh(name, vertices * radius, faces, material, smooth=True, location=center)
    make_round(object_, radius)
    return object_


def make_round(object_: bpy.types.Object, radius: float) -> None:
    """Let Blender divide the quads of a cube_sphere() object and cast them onto the sphere of that radius."""
    divide = object_.modifiers.new("Divide", "SUBSURF")
    divide.subdivision_type = "SIMPLE"
    divide.levels, divide.render_levels = 2, 4
    cast = object_.modifiers.new("Round", "CAST")
    cast.cast_type, cast.factor, cast.use_radius_as_size = "SPHERE", 1.0, False
    cast.size = radius

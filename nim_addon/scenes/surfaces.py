# SPDX-License-Identifier: GPL-3.0-or-later
"""Opaque materials and skies of the scenes, in Blender's own nodes. Colours are linear RGB, lengths metres."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import bpy
import numpy as np
from numpy.typing import ArrayLike

from ..caustics import lights
from ..cycles.nodes import Nodes, empty_tree

RGB: TypeAlias = tuple[float, float, float]
Paint: TypeAlias = Callable[[Nodes], Any]  # returns a colour: an RGB, or the output of a node


class Glow(NamedTuple):
    """A soft sun, added to a sky: a Gaussian of the angle from its middle."""

    towards: Sequence[float]  # it, of any length
    color: Sequence[float]  # of its middle, the radiance in RGB
    width: float  # half of it, from the middle to where it has fallen to 1 / e, in degrees


def plain(name: str, color: RGB) -> bpy.types.Material:
    """A Lambertian material of one colour."""
    return diffuse(name, lambda nodes: color)


def diffuse(name: str, paint: Paint) -> bpy.types.Material:
    """A Lambertian material; `paint(nodes)` returns its colour, an RGB triple or an output."""
    material = bpy.data.materials.new(name)
    nodes = Nodes(empty_tree(material))
    color = paint(nodes)
    if not isinstance(color, bpy.types.NodeSocket):
        material.diffuse_color = (*color, 1.0)
    nodes.end(nodes.add("ShaderNodeBsdfDiffuse", inputs={"Color": color}))
    return material


def shining(name: str, paint: Paint, strength: float = 1.0) -> bpy.types.Material:
    """A material that only emits; `paint(nodes)` returns its colour, an RGB triple or an output."""
    material = bpy.data.materials.new(name)
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": paint(nodes), "Strength": strength}))
    return material


def checker(name: str, light: RGB, dark: RGB, size: float) -> bpy.types.Material:
    """A Lambertian board of squares of side `size`, in object space, x and y only."""

    def paint(nodes):
        place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
        xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place})
        cells = [nodes.math("FLOOR", nodes.math("DIVIDE", xyz.outputs[axis], size)) for axis in (0, 1)]
        odd = nodes.math("FLOORED_MODULO", nodes.math("ADD", *cells), 2.0)
        return nodes.mix(odd, light, dark)

    return diffuse(name, paint)


def sky(
    name: str, horizon: RGB, zenith: RGB, *, strength: float = 1.0, ground: RGB | None = None, glow: Glow | None = None
) -> bpy.types.World:
    """A World: `horizon` colour blending with the elevation to `zenith`; `ground` (or horizon) below the horizon.

    glow: None, or a sun in it; lights.sun_of() finds it, and caustics.Bake can hide it from paths that were scattered
    """
    world = bpy.data.worlds.new(name)
    nodes = Nodes(empty_tree(world))
    direction = nodes.add("ShaderNodeTexCoord").outputs["Generated"]
    up = nodes.add("ShaderNodeSeparateXYZ", inputs={0: direction}).outputs["Z"]
    elevation = nodes.math("DIVIDE", nodes.math("ARCSINE", up), math.pi / 2)
    # MAXIMUM keeps the horizon's colour below it
    color = nodes.mix(nodes.math("MAXIMUM", elevation), horizon, zenith)
    if ground is not None:
        color = nodes.mix(nodes.math("GREATER_THAN", up), ground, color)
    if glow is not None:
        towards, tone, width = glow
        towards = tuple(np.divide(towards, np.linalg.norm(towards)))
        cosine = nodes.add("ShaderNodeVectorMath", operation="DOT_PRODUCT", inputs={0: direction, 1: towards})
        angle = nodes.math("ARCCOSINE", nodes.math("MINIMUM", cosine.outputs["Value"], 1.0))
        ratio = nodes.math("DIVIDE", angle, math.radians(width))
        gauss = nodes.math("EXPONENT", nodes.math("MULTIPLY", nodes.math("MULTIPLY", ratio, ratio), -1.0))
        scattered = nodes.math("GREATER_THAN", nodes.add("ShaderNodeLightPath").outputs["Diffuse Depth"], 0.5)
        hidden = nodes.add("ShaderNodeValue", name=lights.SUN_HIDDEN).outputs[0]
        hidden.default_value = 0.0
        seen = nodes.math("SUBTRACT", 1.0, nodes.math("MULTIPLY", scattered, hidden))
        gauss = nodes.math("MULTIPLY", gauss, seen)
        irradiance = np.multiply(tone, strength * gaussian(width))
        world[lights.SUN_PROPERTY] = [*np.negative(towards).tolist(), *irradiance.tolist(), math.radians(2 * width)]
        color = nodes.vector("ADD", color, nodes.scale(tone, gauss))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": color, "Strength": strength}), "World")
    return world


def sun(towards: ArrayLike, irradiance: ArrayLike, width: float) -> Glow:
    """The Glow `width` degrees wide, from 1/e to 1/e, that gives this irradiance in RGB across its rays."""
    return Glow(tuple(np.asarray(towards)), tuple(np.divide(irradiance, gaussian(width / 2))), width / 2)


def gaussian(width: float) -> float:
    """Irradiance across its rays of a Gaussian `glow` of peak radiance 1 and that half-width in degrees: steradians."""
    angle, step = np.linspace(0, np.pi / 2, 20001, retstep=True)
    return float(np.pi * np.sum(np.exp(-np.square(angle / math.radians(width))) * np.sin(2 * angle)) * step)


def spiral(name: str, light: RGB, dark: RGB, pitch: float) -> bpy.types.Material:
    """A Lambertian barber's pole: a dark stripe that winds about the object's z axis once in every `pitch`."""

    def paint(nodes):
        place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
        x, y, z = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs
        turn = nodes.math("DIVIDE", nodes.math("ARCTAN2", y, x), 2 * math.pi)
        phase = nodes.math("FRACT", nodes.math("ADD", nodes.math("DIVIDE", z, pitch), turn))
        return nodes.mix(nodes.math("GREATER_THAN", phase, 0.5), light, dark)

    return diffuse(name, paint)


def tiles(
    nodes: Nodes, u: Any, v: Any, size: float, low: Any, high: Any, joint: RGB, width: float
) -> bpy.types.NodeSocket:
    """The colour of square tiles of side `size` with joints of colour `joint` and that `width` between them.

    u, v: outputs, metres along the surface; low, high: colours (RGB or outputs) each tile is a random mixture of.
    """
    place = nodes.add("ShaderNodeCombineXYZ", inputs={0: u, 1: v}).outputs[0]
    first, second, mortar = (c if isinstance(c, bpy.types.NodeSocket) else (*c, 1.0) for c in (low, high, joint))
    node = nodes.add(
        "ShaderNodeTexBrick",
        inputs={
            "Vector": place,
            "Color1": first,
            "Color2": second,
            "Mortar": mortar,
            "Scale": 1.0,
            "Mortar Size": width / 2,  # measured from the edge of a brick: half a joint
            "Mortar Smooth": 0.0,
            "Brick Width": size,
            "Row Height": size,
        },
        offset=0.0,
        squash=1.0,
    )
    return node.outputs["Color"]


def overcast(name: str, zenith: RGB) -> bpy.types.World:
    """A World: the overcast sky of the CIE, `zenith` times (1 + 2 sin(elevation)) / 3, its horizon's colour below."""
    world = bpy.data.worlds.new(name)
    nodes = Nodes(empty_tree(world))
    direction = nodes.add("ShaderNodeTexCoord").outputs["Generated"]
    up = nodes.add("ShaderNodeSeparateXYZ", inputs={0: direction}).outputs["Z"]
    strength = nodes.math("DIVIDE", nodes.math("ADD", nodes.math("MULTIPLY", nodes.math("MAXIMUM", up), 2.0), 1.0), 3.0)
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": zenith, "Strength": strength}), "World")
    return world

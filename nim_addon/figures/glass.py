# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 5.1, 5.2 and 5.5: a straw in a glass, from the side and from above, and three statues around the glass.

The renders that are measured show what shines and nothing else; glass_optics says what they must show.
"""

import math

import bpy
import numpy as np

from ..scenes import glass as scene_of
from ..scenes import shapes, surfaces
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .glass_optics import (
    LEVEL,
    MARK_HEIGHT,
    MARK_RADIUS,
    PAINTED,
    bottom_share,
    light_shares,
    lip_depth,
    millimetres,
    piece_area,
    statue_magnification,
    straw_columns,
    table_magnification,
    traced_green,
    traced_side,
    traced_statues,
    traced_straw,
    traced_table,
)
from .measure import compare
from .recipes import Figure, Image, Recipe

LIQUIDS = ("none", "water", "nim")
NAMES = {"none": "empty", "water": "water", "nim": "NIM"}

# From where the scene's own cameras stand, but nearer to what matters.
SIDE = Pose(scene_of.pose(scene_of.GlassParameters(view="side")).eye, (0, 0, 0.053), 7, "VERTICAL")
TOP = Pose(scene_of.pose(scene_of.GlassParameters(view="top")).eye, (0, 0, 0.065), 9, "VERTICAL")
BEHIND = Pose(SIDE.eye, (0, 0, 0.050), 3.5, "VERTICAL")
ZOOM = Pose(TOP.eye, (0.012, 0.013, 0.065), 6.6, "VERTICAL")

# Renders of different noise, whose scatter, beside that of the traced pictures, decides how near the two must come.
SEEDS = 8
# The relative gap between a facet and the circle: a length in the render may be off by it.
FACET = 1 - math.cos(math.pi / scene_of.SEGMENTS)
PROBE = ((96, 96), 8)

# Of the straw, metres from its foot: a piece near the bottom, and one near the surface of the liquid.
PIECES = {"near the bottom": (0.014, 0.034), "near the surface": (0.055, 0.075)}


# ------------------------------------------------------------------------------------------------ changes to the scene


def _only(scene, *names):
    """Show only the glass and the objects named, and put out the sky."""
    probes.set_up(scene)
    probes.show_only(scene, "Glass", *names)
    scene.world = None


def _direct(scene):
    """Let nothing be seen by reflection: thousands of faint mirror images shift a mean that is to hold three digits."""
    scene.cycles.glossy_bounces = 0
    for object_ in scene.objects:
        object_.visible_glossy = False


def _glow_by_place(name, paint):
    """A material that shines with `paint(nodes, x, y, z)`, RGB of numbers or outputs, of the object's own coordinates."""

    def color(nodes):
        place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
        x, y, z = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs
        return nodes.add("ShaderNodeCombineXYZ", inputs=dict(enumerate(paint(nodes, x, y, z)))).outputs[0]

    return surfaces.shining(name, color)


def painted_side(scene: bpy.types.Scene) -> None:
    """The straw shines red, a disc on the bottom green; the surface of the liquid is opaque and shines blue."""
    _only(scene, "Straw")
    probes.paint(probes.find(scene, "Straw"), probes.glow("Red", (1, 0, 0)))
    glass = probes.find(scene, "Glass").data
    if len(glass.materials) == 3:
        glass.materials[2] = probes.glow("Blue", (0, 0, 1))
    vertices, faces, _ = shapes.revolve([(MARK_RADIUS, 0), (0, 0)], 128)
    disc = bpy.data.meshes.new("Mark")
    disc.from_pydata(vertices.tolist(), [], faces)
    disc.materials.append(probes.glow("Green", (0, 1, 0)))
    mark = bpy.data.objects.new("Mark", disc)
    mark.location = (0, 0, MARK_HEIGHT)
    scene.collection.objects.link(mark)


def painted_straw(scene: bpy.types.Scene) -> None:
    """The straw shines red and, the further from its foot, the more green."""
    _only(scene, "Straw")

    def paint(nodes, x, y, z):
        return 1, nodes.math("DIVIDE", z, scene_of.STRAW_LENGTH), 0

    probes.paint(probes.find(scene, "Straw"), _glow_by_place("Length", paint))


def painted_table(scene: bpy.types.Scene) -> None:
    """The table near the glass shines with its own coordinates: red grows along x, green along y, blue is 1."""
    _only(scene, "Table")
    _direct(scene)

    def paint(nodes, x, y, z):
        # what is far away is seen by reflection only, and would be nothing but noise
        square = nodes.math("ADD", nodes.math("MULTIPLY", x, x), nodes.math("MULTIPLY", y, y))
        near = nodes.math("LESS_THAN", square, PAINTED**2)

        def coordinate(value):
            return nodes.math("MULTIPLY", nodes.math("ADD", nodes.math("DIVIDE", value, 2 * PAINTED), 0.5), near)

        return coordinate(x), coordinate(y), near

    probes.paint(probes.find(scene, "Table"), _glow_by_place("Place", paint))


def painted_statues(scene: bpy.types.Scene) -> None:
    """Each statue shines in the colour of its name."""
    _only(scene, "Red", "Green", "Blue")
    for axis, name in enumerate(("Red", "Green", "Blue")):
        statue = probes.find(scene, name)
        statue.modifiers.clear()  # the mesh that the prediction traces
        statue.material_slots[0].material = probes.glow(name, tuple(np.eye(3)[axis]))


def painted_green(scene: bpy.types.Scene) -> None:
    """The green statue alone: red is where it shines, green grows from its left to its right, blue upwards."""
    _only(scene, "Green")
    _direct(scene)
    statue = probes.find(scene, "Green")
    statue.modifiers.clear()

    def paint(nodes, x, y, z):
        # its own axes are turned against the scene's
        across = nodes.math(
            "SUBTRACT",
            nodes.math("MULTIPLY", x, math.cos(statue.rotation_euler.z)),
            nodes.math("MULTIPLY", y, math.sin(statue.rotation_euler.z)),
        )
        high = nodes.math("DIVIDE", z, 2 * scene_of.STATUE_SIZE)
        return 1, nodes.math("ADD", nodes.math("DIVIDE", across, 2 * scene_of.STATUE_SIZE), 0.5), high

    statue.material_slots[0].material = _glow_by_place("Across", paint)


def _claim(text, predicted, measured, allowed, unit=""):
    return Claim(text, predicted, measured, allowed + FACET * abs(predicted), unit)


def measure_side(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.1."""
    claims = []
    empty = images["side_none"]
    camera, traced_empty = empty.camera, traced_side(empty)
    scale = millimetres(camera, (0, 0, LEVEL))

    def straw_break(filled, bare):
        return scale * np.nanmean(straw_columns(filled, camera) - straw_columns(bare, camera))

    for liquid in LIQUIDS:
        image = images[f"side_{liquid}"]
        traced = traced_empty if liquid == "none" else traced_side(image)
        pair = (traced,), (image.each,)
        if liquid != "none":
            shift = compare(straw_break, (traced, traced_empty), (image.each, empty.each))
            claims.append(
                _claim(f"{NAMES[liquid]}: the straw breaks to the right by (left where negative)", *shift, "mm")
            )
        share = compare(lambda pixels: bottom_share(pixels, camera), *pair)
        text = f"{NAMES[liquid]}: share of the side of the glass, up to the level, that shows the bottom"
        claims.append(_claim(text, *share))
        if liquid != "none":
            for x in (0.0, 0.6):
                depth = compare(lambda pixels, x=x: lip_depth(pixels, camera, x), *pair)
                place = f"{x:g} radii off" if x else "in the middle"
                text = f"{NAMES[liquid]}: depth of the lip, the surface seen from below, {place}"
                claims.append(_claim(text, *depth, "mm"))
    return claims


def measure_table(images: dict[str, Image]) -> list[Claim]:
    """Those claims of figure 5.2 that are on the table: they hold the third digit of the index."""
    claims = []
    for liquid in LIQUIDS[1:]:
        image = images[f"table_{liquid}"]

        def magnification(pixels, image=image):
            return table_magnification(pixels, image.camera, image.parameters.liquid)

        larger = compare(magnification, (traced_table(image),), (image.each,))
        for way, numbers in zip(("wider", "deeper"), larger, strict=True):
            claims.append(
                _claim(f"{NAMES[liquid]}: the table under the glass appears {way} than it is, times", *numbers)
            )
    return claims


def measure_top(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.2."""
    nim, water = (images[f"straw_{liquid}"] for liquid in ("nim", "water"))

    def ratios(in_nim, in_water):
        low, high = (
            piece_area(in_nim, nim.camera, piece) / piece_area(in_water, water.camera, piece)
            for piece in PIECES.values()
        )
        return low, high, low / high

    larger = compare(ratios, (traced_straw(nim), traced_straw(water)), (nim.each, water.each))
    texts = [f"the straw {name}: its area in the NIM, times that in water" for name in PIECES]
    texts.append("the straw is larger the deeper it is: those two, one by the other")
    straw_claims = [_claim(text, *numbers) for text, numbers in zip(texts, larger, strict=True)]
    return straw_claims + measure_table(images)


def measure_statues(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure 5.5."""
    claims = []
    image = images["statues_nim"]
    traced = traced_statues(image)
    for channel, name in ((0, "red, in front on the left"), (2, "blue, in front on the right"), (1, "green, behind")):

        def shares(pixels, channel=channel):
            return light_shares(pixels, image.camera, channel)

        right, off = compare(shares, (traced,), (image.each,))
        start = f"NIM: share of the light of the {name},"
        claims.append(_claim(f"{start} that comes from further out than half the radius", *off))
        claims.append(_claim(f"{start} that comes from the right half", *right))
    for liquid in LIQUIDS[1:]:
        image = images[f"green_{liquid}"]

        def magnification(pixels, camera=image.camera):
            return statue_magnification(pixels, camera)

        larger = compare(magnification, (traced_green(image),), (image.each,))
        for way, numbers in zip(("width", "height"), larger, strict=True):
            text = f"{NAMES[liquid]}: {way} of the green statue in the middle, negative where flipped, times its own"
            claims.append(_claim(text, *numbers))
    return claims


# ------------------------------------------------------------------------------------------------ the figures


def _shown(name, settings, captions, pose=None):
    return tuple(
        Recipe(
            f"{name}_{liquid}",
            "glass",
            (f"liquid={liquid}", *settings),
            draft=((240, 240), 32),
            final=((800, 800), 48),
            pose=pose,
            caption=captions.format(NAMES[liquid]),
        )
        for liquid in LIQUIDS
    )


def _probe(name, settings, change, pose, liquids, draft=PROBE):
    return tuple(
        Recipe(
            f"{name}_{liquid}",
            "glass",
            (f"liquid={liquid}", *settings),
            draft=draft,
            change=change,
            pose=pose,
            seeds=SEEDS,
            shown=False,
        )
        for liquid in liquids
    )


_BOTH = LIQUIDS[1:]
_STATUES = ("figures=monkey", "straw=off")

FIGURES = (
    Figure(
        "5.1",
        "A straw in a glass, from the side",
        "Empty, with water, and with a NIM of index -1.33. Below the level, water shows the straw further to the left, the "
        "NIM on the other side of the glass. What comes in through the wall runs upwards in the NIM: it hides the bottom "
        "of the glass, and shows the liquid's surface from below, as a lip.",
        (
            "The straw breaks to the left in water and to the right in the NIM, each by the predicted amount.",
            "The NIM hides the bottom of the glass.",
            "The underside of the NIM's surface is seen through the side of the glass, as a lip that is deepest in its middle.",
        ),
        _shown("glass", (), "{}") + _probe("side", (), painted_side, SIDE, LIQUIDS),
        measure_side,
    ),
    Figure(
        "5.2",
        "A straw in a glass, from above",
        "Empty, with water, and with a NIM of index -1.33; below, the same from the same place, closer. In the NIM the "
        "straw turns at the level to the other side and grows towards its foot; the board under the glass is larger too.",
        (
            "The straw is larger in the NIM than in water, the more so the deeper, by the predicted ratio.",
            "The table under the glass is magnified as predicted, more through the NIM than through water.",
        ),
        _shown("glass", ("view=top",), "{}")
        + _shown("zoom", ("view=top",), "{}, closer", ZOOM)
        + _probe("straw", ("view=top",), painted_straw, TOP, _BOTH, ((144, 144), 8))
        + _probe("table", ("view=top", "straw=off"), painted_table, TOP, _BOTH),
        measure_top,
        columns=3,
    ),
    Figure(
        "5.5",
        "Three statues and a glass",
        "With water and with a NIM of index -1.33. The green statue stands behind the glass, the red and the blue one "
        "before it. The sides of the NIM show the two in front; its middle shows the one behind, narrow and turned round.",
        (
            "The red and the blue statue, in front, appear in the sides of the NIM.",
            "The green statue, behind, appears in its middle.",
            "It is flipped from left to right there, not upside down.",
        ),
        _shown("glass", _STATUES, "{}")[1:]
        + _probe("statues", _STATUES, painted_statues, SIDE, ("nim",))
        + _probe("green", _STATUES, painted_green, BEHIND, _BOTH),
        measure_statues,
    ),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of graded balls: a mirror that a NIM makes larger, what nobody sees, and three classical balls.

Measured are the directions in which rays leave, under a sky whose colours tell them, and where they land; and whole
pictures of the ball on a board, against the same rays carried in double precision.
"""

import math

import bpy
import mathutils
import numpy as np

from ..scenes import ball as scene_of
from ..scenes import shapes, surfaces
from ..scenes.stage import STAGE_MARK, Pose
from . import ball_optics as optics
from . import probes
from .claims import Claim
from .measure import Camera, block_scores, impact
from .recipes import Figure, Image, Recipe

CENTER, RADIUS = scene_of.CENTER, scene_of.RADIUS
SEEDS, PASSES = 8, 16
BOARD, SKY = ((128, 96), 8), ((160, 160), 16)
# From afar, so that rays are nearly parallel, and straight at the middle, so that the picture is round.
EYE = (0.0, -40.0, CENTER[2])
STRAIGHT = Pose(EYE, CENTER, 2 * math.degrees(math.atan(1.05 / 40)))
ACROSS = 1.98  # of the view of parallel rays, in radii: the corners lie outside of the ball
GAP = 2e-4  # radii, from the rim to where light lands
BEHIND, BACK = 6.0, 8.0  # of a camera that sees what comes back, and of the screen behind it, before the ball
CORES, ANGLES = (0.8, 0.5), (15.0, 30.0, 45.0, 55.0)  # of the magnifiers; degrees
HOLLOW, TOO_LARGE = 0.6, 0.7
CAP, STRAIGHT_BEYOND = 3.0, math.sqrt(0.75)
INNER = 0.9  # p up to which landings are compared


# ------------------------------------------------------------------------------------------------ changes to the scene


def on_a_board(scene: bpy.types.Scene) -> None:
    """The ball on a board that shines with its own colour, under a sky that tells directions."""
    probes.set_up(scene)
    _tell_directions(scene)
    probes.show_only(scene, "Ball", "Lawn")
    lawn = probes.find(scene, "Lawn")
    probes.paint(lawn, surfaces.checker("Board", optics.LIGHT, optics.DARK, optics.TILE))
    lawn.location.xy = optics.JOINT
    probes.unlit(scene)


def under_a_sky(scene: bpy.types.Scene) -> None:
    """The ball alone, under a sky that tells directions: one ray a pixel, through its middle."""
    _set_up_for_rays(scene)
    _tell_directions(scene)


def _tell_directions(scene):
    def color(nodes, direction):
        inputs = {0: direction, 1: (0.5, 0.5, 0.5), 2: (0.5, 0.5, 0.5)}
        return nodes.add("ShaderNodeVectorMath", operation="MULTIPLY_ADD", inputs=inputs).outputs[0]

    probes.sky(scene, color)


def _set_up_for_rays(scene):
    probes.set_up(scene)
    probes.show_only(scene, "Ball")
    probes.through_the_middles(scene)


def under_an_empty_sky(scene: bpy.types.Scene) -> None:
    """The same without the ball."""
    under_a_sky(scene)
    probes.show_only(scene)


def unlit(scene: bpy.types.Scene) -> None:
    """The garden as it is, but every surface shines with its own colour."""
    probes.set_up(scene)
    probes.unlit(scene)


def unlit_and_empty(scene: bpy.types.Scene) -> None:
    """The same without the ball."""
    unlit(scene)
    probes.find(scene, "Ball").hide_render = True


def in_white(scene: bpy.types.Scene) -> None:
    """The ball alone in a white world."""
    probes.set_up(scene)
    probes.show_only(scene, "Ball")
    probes.sky(scene, lambda nodes, direction: (1, 1, 1))


def bare(scene: bpy.types.Scene) -> None:
    """A mirror in the place of the ball."""
    mirror = bpy.data.materials.new("Mirror")
    nodes = probes.Nodes(probes.empty_tree(mirror))
    nodes.end(nodes.add("ShaderNodeBsdfAnisotropic", inputs={"Color": (1, 1, 1, 1), "Roughness": 0.0}))
    probes.paint(probes.find(scene, "Ball"), mirror)


def onto_the_far_rim(scene: bpy.types.Scene) -> None:
    """Parallel rays, which land on a screen that touches the far rim and tells where, in (x, z) radii."""
    _landing(scene, RADIUS * (1 + GAP), 0.0)


def back_onto_a_screen(scene: bpy.types.Scene) -> None:
    """Parallel rays, which land on a screen behind the camera."""
    _landing(scene, -RADIUS * BACK, math.pi)


def from_rim_to_rim(scene: bpy.types.Scene) -> None:
    """Rays of an eye on the near rim, which land on the same screen as those of onto_the_far_rim()."""
    _landing(scene, RADIUS * (1 + GAP), 0.0)
    camera = scene.camera
    camera.data.type, camera.data.angle = "PERSP", math.radians(120)
    camera.data.clip_start = 1e-5
    camera.location = np.add(CENTER, (0, -RADIUS * (1 + GAP), 0))


def _landing(scene, y, turned):
    """Parallel rays, along y, onto a screen that tells by its colours where it is met."""
    _set_up_for_rays(scene)
    probes.sky(scene)

    def paint(nodes):
        place = nodes.add("ShaderNodeTexCoord").outputs["Object"]
        return probes.coded(nodes, place, 1 / 8)

    data = bpy.data.meshes.new("Screen")
    vertices, faces = shapes.rectangle((-4, -4), (4, 4))
    data.from_pydata(vertices.tolist(), [], faces)
    data.materials.append(surfaces.shining("Screen", paint))
    screen = bpy.data.objects.new("Screen", data)
    # its x and y are x and z of the world, seen from either side
    screen.location, screen.rotation_euler = np.add(CENTER, (0, y, 0)), (math.pi / 2, 0, 0)
    screen[STAGE_MARK] = scene[STAGE_MARK]  # it goes when the scene is built anew
    scene.collection.objects.link(screen)
    camera = scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", ACROSS * RADIUS
    camera.location = np.add(CENTER, (0, -BEHIND, 0))
    camera.rotation_euler = mathutils.Vector((0, 1, 0)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.view_layer.update()


# ------------------------------------------------------------------------------------------------ what is read off


def whole(images, name):
    """The claim that a picture on the board is that of rays carried without Cycles."""
    image = images[f"board_{name}"]
    predicted = optics.predicted_board(image.parameters.profile, CENTER, RADIUS, image.camera, PASSES)
    scores, expected = block_scores(image.each, predicted)
    rms = float(np.sqrt(np.mean(np.square(scores))))
    text = f"{name}: distance to the picture by numpy, rms of 8 x 8 pixels in each colour"
    return Claim(text, expected, rms, 0.15, "standard errors")


class Seen:
    """What the pixels of a ball tell under the sky of directions.

    p:       (N,) sine of the angle of incidence, of those pixels that lie within the ball
    turned:  (N,) by which angle the ray was turned, 0 to pi, radians; NaN of those that end
    """

    def __init__(self, image: Image, most: float = 0.98):
        p = impact(image.camera, CENTER, RADIUS)
        inside = p < most
        _, came = image.camera.pixel_rays()
        went = optics.directions_of(image.pixels[inside])
        self.p = p[inside]
        cosine = np.clip(np.sum(came[inside] * went, axis=-1), -1, 1)
        self.turned = np.arccos(cosine)


def magnification(seen: Seen, angle: float, near: float = 4.0) -> float:
    """By how much larger than in a bare mirror of the same outline one sees what is at an angle, degrees, from the way back."""
    back = np.degrees(math.pi - seen.turned)
    here = np.abs(back - angle) < near
    ratio = seen.p[here] / np.sin(np.radians(back[here] / 2))
    return float(np.mean(ratio))


def straight_from(seen: Seen, within: float = 1.0) -> float:
    """The p from which on rays are turned by less than an angle, degrees."""
    astray = seen.p[~(np.degrees(seen.turned) < within)]
    return float(astray.max()) if len(astray) else 0.0


def dark_radius(pixels: np.ndarray, camera: Camera, finer: int = 4) -> float:
    """The radius, in the ball's, of a disc in its middle that is as large as the light that is missing in a white world."""
    offsets = (np.arange(finer) + 0.5) / finer
    p = []
    for x in offsets:
        for y in offsets:
            _, d = camera.pixel_rays((x, y))
            away = np.subtract(CENTER, camera.eye)
            along = d @ away
            p.append(np.linalg.norm(along[..., None] * d - away, axis=-1).ravel() / RADIUS)
    p = np.sort(np.concatenate(p))
    missing = float(np.sum(1 - pixels.mean(axis=-1)))
    return float(p[round(missing * finer**2)])


def landings(image: Image) -> tuple[np.ndarray, np.ndarray]:
    """Where parallel rays come, and where they land, (N, 2) each, in radii from the axis: of those that meet the ball."""
    side = len(image.pixels)
    place = ((np.arange(side) + 0.5) / side - 0.5) * ACROSS
    came = np.stack(np.meshgrid(place, -place), axis=-1)
    inside = np.linalg.norm(came, axis=-1) < INNER
    return came[inside], probes.decoded(image.pixels, 1 / 8)[inside] / RADIUS


# ------------------------------------------------------------------------------------------------ the claims


def measure_magnifier(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure E.2."""
    claims = []
    for a in CORES:
        seen = Seen(images[f"sky_{a:g}"])
        for angle in ANGLES:
            text = (
                f"a = {a:g}: what lies {angle:g} degrees from the way back, as far from the middle as in a bare mirror"
            )
            claims.append(Claim(text, 1 / a, magnification(seen, angle), 0.002, "times"))
        most = 2 * math.degrees(math.asin(a * 0.98))
        text = f"a = {a:g}: the largest angle from the way back that is seen up to p = 0.98"
        claims.append(Claim(text, most, float(np.degrees(math.pi - seen.turned.min())), 1.0, "degrees"))
    return claims + [whole(images, f"{a:g}") for a in CORES]


def measure_unseen(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure E.3."""
    claims = []
    inside = impact(images["garden_empty"].camera, CENTER, RADIUS) < 1
    for name in ("cloak", "invisible"):
        off = np.abs(images[f"sky_{name}"].pixels - images["sky_empty"].pixels)
        text = f"{name}: what the ball changes in a smooth sky, the largest difference of any pixel"
        claims.append(Claim(text, 0, float(off.max()), 1e-5))
        off = np.abs(images[f"garden_{name}"].pixels - images["garden_empty"].pixels).max(axis=-1)[inside]
        claims.append(
            Claim(f"{name}: what it changes in the garden, median of its pixels", 0, float(np.median(off)), 1e-5)
        )
        text = f"{name}: pixels that it changes by 0.01, at edges in the garden, share of its own"
        claims.append(Claim(text, 0, float(np.mean(off > 0.01)), 0.01))
    disc = images["white_imperfect"]
    text = f"a cloak of {HOLLOW:g} around a core of {TOO_LARGE:g}: radius of the dark disc"
    predicted = (TOO_LARGE - HOLLOW) / (1 - HOLLOW)
    claims.append(Claim(text, predicted, dark_radius(disc.pixels, disc.camera), 0.002, "radii"))
    text = f"an invisible ball of n up to {CAP:g}: light goes straight on from p ="
    claims.append(Claim(text, STRAIGHT_BEYOND, straight_from(Seen(images["sky_capped"], 0.96)), 0.01))
    return [*claims, whole(images, "capped"), whole(images, "imperfect")]


def measure_classics(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure E.4."""
    _, focus = landings(images["rim_luneburg"])
    _, antipode = landings(images["rim_fisheye"])
    came, back = landings(images["back_eaton"])
    return [
        Claim("Luneburg: parallel rays land on the axis, rms distance from it", 0, _rms(focus), 0.001, "radii"),
        Claim(
            "fish-eye: rays of the rim land at its antipode, rms distance from it", 0, _rms(antipode), 0.002, "radii"
        ),
        Claim(
            "Eaton: rays come back on the other side of the axis, rms distance from there",
            0,
            _rms(back + came),
            0.001,
            "radii",
        ),
        *(whole(images, name) for name in ("luneburg", "fisheye", "eaton")),
    ]


def _rms(distances):
    return float(np.sqrt(np.mean(np.sum(np.square(distances), axis=-1))))


# ------------------------------------------------------------------------------------------------ the figures


def _picture(name, settings, caption, change=None):
    return Recipe(
        name, "ball", settings, draft=((480, 360), 96), final=((1280, 960), 256), change=change, caption=caption
    )


def _probe(name, settings, change, frame=SKY, pose=STRAIGHT, seeds=1):
    return Recipe(name, "ball", settings, draft=frame, change=change, pose=pose, seeds=seeds, shown=False)


def _board(name, settings):
    return _probe(f"board_{name}", settings, on_a_board, BOARD, None, SEEDS)


GARDEN = ((240, 180), 32)
CLOAK, CLOAKED = ("device=cloak",), ("device=cloak", "head=yes")
IMPERFECT = ("device=cloak", f"core={TOO_LARGE:g}", "surface=black")
CAPPED = ("device=invisible", f"cap={CAP:g}")

FIGURES = (
    Figure(
        "E.2",
        "A thin shell of a NIM makes a mirror larger",
        "A mirror ball (left) shows the garden behind the camera. Beside it are mirrors of 0.8 and of 0.5 of its radius in a "
        "shell of a NIM that fills the same outline, n = -1 at the rim and -1 / a^2 on the mirror. They show the same 1.25 "
        "and twice as large, as mirrors would of 1.25 and 2 times the radius, cut off at the outline. After Qiu (2012), profile "
        "derived.",
        (
            "The magnification is 1 / a, at all angles.",
            "What is further than 2 arcsin(a) from the way back is not seen.",
            "The whole picture, on a board, is the one by numpy, to its own noise.",
        ),
        (
            _picture("bare", ("device=magnifier",), "a bare mirror", bare),
            *(_picture(f"magnifier_{a:g}", ("device=magnifier", f"core={a:g}"), f"a = {a:g}") for a in CORES),
            *(_probe(f"sky_{a:g}", ("device=magnifier", f"core={a:g}"), under_a_sky) for a in CORES),
            *(_board(f"{a:g}", ("device=magnifier", f"core={a:g}")) for a in CORES),
        ),
        measure_magnifier,
    ),
    Figure(
        "E.3",
        "A cloak and an invisible ball in a garden, perfect and not",
        "Above, a cloak with a head in it stands on the path, and nothing is seen of either; nor of an invisible ball. Below, "
        "a cloak whose core is 0.7 of its radius where 0.6 is hidden shows a dark disc of a quarter of its radius; an "
        "invisible ball whose index ends at 3 is so in its outermost ring alone, and bends all the rest. After Danner "
        "(2010); these are the ideal media, without birefringence.",
        (
            "Cloak and invisible ball change nothing, to 1e-5.",
            "A core too large by d is seen as a disc of radius d / (1 - a).",
            "With n up to 3 light goes straight on beyond p = 0.866.",
            "The whole picture, on a board, is the one by numpy, to its own noise.",
        ),
        (
            _picture("cloak", CLOAKED, "a cloak, a head in it"),
            _picture("invisible", ("device=invisible",), "an invisible ball"),
            _picture("imperfect", IMPERFECT, "a cloak, its core too large"),
            _picture("capped", CAPPED, "an invisible ball, n up to 3"),
            _probe("sky_empty", CLOAK, under_an_empty_sky),
            _probe("sky_cloak", CLOAK, under_a_sky),
            _probe("sky_invisible", ("device=invisible",), under_a_sky),
            _probe("sky_capped", CAPPED, under_a_sky),
            _probe("garden_empty", CLOAK, unlit_and_empty, GARDEN, None),
            _probe("garden_cloak", CLOAKED, unlit, GARDEN, None),
            _probe("garden_invisible", ("device=invisible",), unlit, GARDEN, None),
            _probe("white_imperfect", IMPERFECT, in_white),
            _board("imperfect", IMPERFECT),
            _board("capped", CAPPED),
        ),
        measure_unseen,
        columns=2,
    ),
    Figure(
        "E.4",
        "Luneburg's lens, Maxwell's fish-eye, Eaton's ball",
        "From left to right: a lens of n = sqrt(2 - r^2), which has the half space behind it upside down; one of "
        "n = 2 / (1 + r^2), with the same smaller, and within its rim all that is around it once more; and one of "
        "n = sqrt(2 / r - 1), which sends all light back, so that the house behind the camera is seen in it, turned by half a "
        "turn.",
        (
            "A parallel beam meets on the far rim of Luneburg's lens.",
            "Light of a point of the fish-eye's rim meets at its antipode.",
            "Eaton's ball sends every ray back, as far from the axis on the other side.",
            "The whole picture, on a board, is the one by numpy, to its own noise.",
        ),
        (
            *(
                _picture(name, (f"device={name}",), caption)
                for name, caption in (("luneburg", "Luneburg"), ("fisheye", "fish-eye"), ("eaton", "Eaton"))
            ),
            _probe("rim_luneburg", ("device=luneburg",), onto_the_far_rim),
            _probe("rim_fisheye", ("device=fisheye",), from_rim_to_rim),
            _probe("back_eaton", ("device=eaton",), back_onto_a_screen),
            *(_board(name, (f"device={name}",)) for name in ("luneburg", "fisheye", "eaton")),
        ),
        measure_classics,
    ),
)

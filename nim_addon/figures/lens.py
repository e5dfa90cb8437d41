# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure E.5: the flat lens, its image before it, and what becomes of that beside n = -1.

A pinhole stands where the image is and looks at the plate: each pixel is a ray, and light that tells where it came from says
where that ray lands. All other rays of the plate are these, run back.
"""

import math

import bpy
import numpy as np

from ..physics import flat_lens
from ..scenes import lens as scene_of
from ..scenes import shapes, surfaces
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .measure import blocks, slope
from .recipes import Figure, Image, Recipe

INDICES = (-1.0, -1.05, -0.95)
USUAL = scene_of.LensParameters()
# A place behind the plate is coded as 1/2 + place / CODE, from the axis.
CODE = 4.0
# Where the image is, and a metre before the plate; straight at it.
PINHOLE = Pose(USUAL.image, (0.0, 1.0, scene_of.MIDDLE), 100, "VERTICAL")
FAR = Pose((0.0, -1.0, scene_of.MIDDLE), (0.0, 1.0, scene_of.MIDDLE), 8, "VERTICAL")
WIDEST = math.radians(50)  # from the axis of the pinhole's rays to the edge of its picture
# At the ball through the plate, aside of the axis.
CLOSE = Pose((0.25, -1.6, 0.55), (0.0, USUAL.image[1], scene_of.MIDDLE), 11, "VERTICAL")


# changes to the scene


def places(scene: bpy.types.Scene) -> None:
    """Only the plate, and a screen through the middle of the ball, which is red by x, green by z, and 1 in blue."""
    probes.set_up(scene)
    probes.show_only(scene, "Lens")
    probes.sky(scene)

    def place(nodes):
        xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeNewGeometry").outputs["Position"]})
        x, z = xyz.outputs["X"], nodes.math("SUBTRACT", xyz.outputs["Z"], scene_of.MIDDLE)
        return probes.coded(nodes, nodes.add("ShaderNodeCombineXYZ", inputs={0: x, 1: z}).outputs[0], 1 / CODE)

    vertices, faces = shapes.rectangle((-2.0, -2.0), (2.0, 2.0))
    data = bpy.data.meshes.new("Screen")
    data.from_pydata(vertices[:, [0, 2, 1]].tolist(), [], faces)
    data.materials.append(surfaces.shining("Screen", place))
    probes.add(scene, "Screen", data, (0, probes.find(scene, "Ball").location.y, scene_of.MIDDLE))


def shining(scene: bpy.types.Scene) -> None:
    """Only the plate, the ball and its pole, which shine with their own colours before a black sky."""
    probes.set_up(scene)
    probes.show_only(scene, "Lens", "Ball", "Pole")
    probes.unlit(scene)
    probes.sky(scene)


def nearer(scene: bpy.types.Scene) -> None:
    """The same without the plate, and nearer by twice its thickness."""
    shining(scene)
    probes.show_only(scene, "Ball", "Pole")
    for name in ("Ball", "Pole"):
        probes.find(scene, name).location.y -= 2 * USUAL.thickness


# the claims


def _rays(image):
    """tan(theta) and the distance from the axis, positive on the ray's own side, of each pixel's ray: (H, W) both."""
    look = image.camera.pixel_rays()[1]
    way = look[..., ::2] / look[..., 1:2]
    tangent = np.linalg.norm(way, axis=-1)
    return tangent, np.sum(probes.decoded(image.pixels, 1 / CODE) * way, axis=-1) / tangent


def spread_claims(image: Image) -> list[Claim]:
    """How far from the ray's own point of n = -1 rays land, all of them and at most, of a picture by the PINHOLE."""
    parameters = image.parameters
    n, d = parameters.n, parameters.thickness
    tangent, x = _rays(image)
    round_ = tangent < math.tan(WIDEST)
    wanted = flat_lens.landing(n, np.arctan(tangent), d, d - parameters.distance, parameters.distance)
    off = float(np.median(np.abs(x - wanted)[round_]))
    footprint = float(np.median(np.abs(np.diff(wanted, axis=1))[round_[:, 1:]]))
    found = float(np.quantile(np.abs(x[round_]), 0.95))
    return [
        Claim(
            f"n = {n:g}: from the axis, 95 % of the rays to 50 degrees",
            flat_lens.spread(n, d, WIDEST),
            found,
            2e-4,
            "m",
        ),
        Claim(f"n = {n:g}: a ray, from where it is to land, median", 0, off, footprint / 10 + 1e-5, "m"),
    ]


def depth_claim(image: Image) -> Claim:
    """How much nearer the screen is seen near the axis, by a picture from FAR."""
    parameters = image.parameters
    tangent, x = _rays(image)
    far = -FAR.eye[1] + parameters.thickness + parameters.distance
    near = tangent < math.tan(math.radians(4))
    text = f"n = {parameters.n:g}: what is behind the plate appears nearer by"
    wanted = flat_lens.nearer(parameters.n, parameters.thickness)
    return Claim(text, float(wanted), far - slope(x[near], tangent[near]), 5e-4, "m")


def likeness_claim(seen: Image, moved: Image) -> Claim:
    """How far two pictures of the same noise differ at most, by the means of blocks."""
    off = float(np.abs(blocks(seen.pixels) - blocks(moved.pixels)).max())
    text = "n = -1: the ball and its pole, against the same without a plate and 2 d nearer: block by block, at most"
    return Claim(text, 0, off, 0.01)


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of the figure."""
    claims = [claim for n in INDICES for claim in spread_claims(images[f"image_{n:g}"])]
    claims += [depth_claim(images[f"far_{n:g}"]) for n in INDICES]
    return [*claims, likeness_claim(images["seen"], images["moved"])]


# the figure


def _measured(name, n, change, pose, **more):
    return Recipe(name, "lens", (f"n={n:g}",), change=change, pose=pose, shown=False, **more)


SHOWN = (
    ("without", "without a plate", ("n=1",)),
    ("lens", "n = -1", ()),
    ("side", "n = -1, from the side", ("view=side",)),
    ("beside", "n = -1.3, from the side", ("view=side", "n=-1.3")),
)

FIGURES = (
    Figure(
        "E.5",
        "A flat lens: a plate of n = mu = -1",
        "A ball stands 15 cm behind a plate 30 cm thick. At n = -1 each of its points has an image 15 cm before the plate, in "
        "the hoop: upright, as large as the ball, and from wherever one looks. All that is behind the plate is seen twice its "
        "thickness nearer, as the pole shows, whose upper end is seen over the frame. At n = -1.3 rays aside of the axis miss "
        "the image. Ray optics: no claim is made of anything finer than half a wavelength.",
        (
            "At n = -1 all rays of a point meet in one; at -1.05 and -0.95 they spread as Snell's law says.",
            "What is behind the plate appears nearer by d (1 - 1 / n), which is 2 d at n = -1.",
            "Through the plate of n = -1 the ball looks as it does without the plate, 2 d nearer.",
        ),
        (
            *(
                Recipe(name, "lens", settings, draft=((360, 270), 64), final=((640, 480), 128), caption=caption)
                for name, caption, settings in SHOWN
            ),
            *(_measured(f"image_{n:g}", n, places, PINHOLE, draft=((256, 256), 8)) for n in INDICES),
            *(_measured(f"far_{n:g}", n, places, FAR, draft=((64, 64), 8)) for n in INDICES),
            _measured("seen", -1, shining, CLOSE, draft=((128, 128), 32)),
            _measured("moved", -1, nearer, CLOSE, draft=((128, 128), 32)),
        ),
        measure,
        columns=2,
    ),
)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure D.1: prisms of glass and of negative-index media, and their spectra.

What turns light is measured apart from what shows it: cameras look back through the prism at a sky that codes directions, at
one wavelength, or at each path's own, which the sky tells as well. On the screen, the light of single wavelengths is
measured as photons bring it; in the eye behind the prism, the colours of the slit against those of the closed form.
"""

import math

import bpy
import numpy as np

from ..caustics import lights
from ..cycles import spectral, wavelength
from ..cycles.nodes import Nodes
from ..physics import REPRESENTATIVE_NM, VISIBLE_NM
from ..scenes import shapes, surfaces
from ..scenes.prism import PrismParameters, screen, way
from ..scenes.stage import Pose
from . import probes
from .claims import Claim
from .measure import STANDARD_ERRORS
from .prism_optics import (
    centroids,
    deviation,
    deviation_back,
    in_colour,
    landing,
    looking_back,
    on_the_screen,
    passed_back,
    spread,
    through_the_prism,
    turned,
)
from .recipes import Figure, Image, Recipe

# The media, each with an apex and an angle of incidence at which all of its light gets out.
SETTINGS = {
    "n-bk7": ("apex=60", "incidence=45"),
    "nim-mirror": ("apex=20", "incidence=0"),
    "nim-normal": ("apex=20", "incidence=0"),
    "nim-causal": ("apex=15", "incidence=0"),
}
NAMES = {"n-bk7": "N-BK7", "nim-mirror": "NIM mirror", "nim-normal": "NIM normal", "nim-causal": "NIM causal"}
WAVES, ENDS = (400, 500, 600, 700), (400, 700)
SHOWN = ("n-bk7", "nim-mirror", "nim-causal")
SEEN = ("n-bk7", "nim-mirror", "nim-normal")  # of the last, an eye sees few colours from one place
NARROW_SLIT = "slit=0.5"
DOME = 50.0  # metres, half the side of the box around the scene that tells directions
LEVEL = "elevation=0"
ACROSS = 0.004  # metres that a camera of parallel rays sees, which looks back through the prism
NEAR = 1.0  # degrees about the spectrum within which light has passed the prism and was not reflected within it
HEIGHT = 0.013  # metres above the table of the middle of what is measured on the screen
# Green light leaves at right angles, and red not so aslant that single precision shows.
PHOTON_SETTINGS = {"nim-causal": ("apex=8", "incidence=-10.6670")}
BESIDE = 8  # columns of dark on either side of the spectrum
LEAST_LEFT = 0.5  # of a path's light: all of it but for what no wave carries
MICROMETRES = 1e-3  # of the number of nanometres: what a picture holds of a wavelength is about 1
AWAY = 1.0  # metres from the screen to the camera that measures it
SEEN_OF_IT, PIXELS = 0.016, 160  # of the screen: the side of the square that is measured, metres; its pixels
PHOTONS = 1 << 22

# changes to the scene


def directions(scene: bpy.types.Scene) -> None:
    """Only the prism, under a sky that codes directions, seen by parallel rays."""
    probes.set_up(scene)
    _parallel(scene)
    probes.show_only(scene, "Prism")
    probes.sky(scene, lambda nodes, direction: probes.coded(nodes, direction, 0.5))


def by_photon(scene: bpy.types.Scene) -> None:
    """Only the prism, in all wavelengths; a box around it tells in red and green where light goes, in blue its wavelength."""
    probes.set_up(scene)
    _parallel(scene)
    probes.show_only(scene, "Prism")
    probes.sky(scene)
    box = bpy.data.meshes.new("Dome")
    vertices, faces = shapes.box((-DOME,) * 3, (DOME,) * 3)
    box.from_pydata(vertices.tolist(), [], [face[::-1] for face in faces])
    box.materials.append(surfaces.shining("Dome", lambda nodes: (1, 1, 1)))
    scene.collection.objects.link(bpy.data.objects.new("Dome", box))
    bpy.context.view_layer.update()
    spectral.set_up(scene)  # after which nothing is to be weighted
    material = box.materials[0]
    nodes = Nodes(material.node_tree)
    weight = next(node for node in material.node_tree.nodes if wavelength.is_node(node))
    light = weight.outputs[wavelength.WAVELENGTH]
    # Incoming is where the light goes that a path brings
    xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeNewGeometry").outputs["Incoming"]}).outputs
    inputs = {0: xyz["X"], 1: xyz["Y"], 2: nodes.math("MULTIPLY", light, MICROMETRES)}
    color = nodes.add("ShaderNodeCombineXYZ", inputs=inputs)
    (emission,) = [node for node in material.node_tree.nodes if node.type == "EMISSION"]
    material.node_tree.links.new(color.outputs[0], emission.inputs["Color"])
    material.cycles.emission_sampling = "NONE"


def _parallel(scene):
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", ACROSS


def on_white(scene: bpy.types.Scene) -> None:
    """The screen, white, with no light but the sun's, and nothing that would be seen before it or throw light onto it."""
    probes.set_up(scene)
    probes.show_only(scene, "Screen", "Prism", "Wall")
    sun = lights.sun_of(scene)
    assert sun is not None
    half = math.degrees(sun.angle) / 2
    radiance = tuple(np.divide(sun.irradiance, surfaces.gaussian(half)))
    glow = surfaces.Glow(tuple(np.negative(sun.direction)), radiance, half)
    scene.world = surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=glow)
    probes.paint(probes.find(scene, "Screen"), surfaces.plain("White", (1, 1, 1)))
    for name in ("Prism", "Wall"):
        probes.find(scene, name).visible_camera = False
    scene.cycles.max_bounces = 0
    bpy.context.view_layer.update()


def measured_spectrum(scene: bpy.types.Scene) -> None:
    """The scene in all wavelengths, to be measured."""
    probes.set_up(scene)
    spectral.set_up(scene)


# what is read off


def deviation_claims(images, medium):
    """Of each wavelength: the deviation."""
    claims = []
    for nm in WAVES:
        image = images[f"turned_{medium}_{nm}"]
        wanted = float(deviation(image.parameters, nm))
        x, y = np.moveaxis(probes.decoded(image.pixels, 0.5), -1, 0)
        found = turned(image.camera, np.arctan2(-y, -x))
        found = found[np.abs(found - wanted) < NEAR]
        value = float(np.median(found)) if len(found) else math.nan
        claims.append(Claim(f"{NAMES[medium]}: deviation at {nm} nm", wanted, value, 1e-4, "degrees"))
    return claims


def photon_claims(images, medium):
    """Of each path of one sample: how it was turned, by its own wavelength."""
    image = images[f"photons_{medium}"]
    pixels = image.pixels.astype(float)
    left = np.hypot(pixels[..., 0], pixels[..., 1])  # of a path's light, as directions lie in the plane
    x, y, micrometres = (pixels[left > LEAST_LEFT] / left[left > LEAST_LEFT][:, None]).T
    found, nm = turned(image.camera, np.arctan2(y, x)), micrometres / MICROMETRES
    wanted = deviation_back(image.parameters, np.clip(nm, *VISIBLE_NM))
    through = (found > wanted.min() - NEAR) & (found < wanted.max() + NEAR)
    off = (found - wanted)[through]
    # the paths' wavelengths are as likely as what they add to a picture
    share = float(passed_back(image.parameters, nm[::8]).mean())
    name, most = NAMES[medium], float(np.abs(off).max()) if off.size else math.nan
    error = STANDARD_ERRORS * math.sqrt(share * (1 - share) / found.size)
    claims = [Claim(f"{name}: share of the photons that pass", share, off.size / found.size, error)]
    for text, value in (("rms", math.sqrt(np.mean(np.square(off)))), ("the most", most)):
        text = f"{name}: a photon's deviation less that of its own wavelength, {text}"
        claims.append(Claim(text, 0.0, float(value), 1e-4, "degrees"))
    both = float(wanted[through].std()), float(found[through].std())
    claims.append(Claim(f"{name}: spread of the photons' deviations, a standard deviation", *both, 1e-4, "degrees"))
    return claims


def screen_claims(images, medium):
    """Where light lands on the screen, and how wide the spectrum and each line of it are there."""
    claims, ends, noise = [], [], 0.0
    for nm in ENDS:
        image = images[f"screen_{medium}_{nm}"]
        place, places = on_the_screen(image.parameters, nm)
        number, width = landing(image.parameters, nm, PHOTONS), float(places.std())
        middle, wide = _line(image)
        error = STANDARD_ERRORS * width / math.sqrt(number * SEEN_OF_IT)
        # what photons are spread by, and what pixels do, adds to the light's own width as variances do
        pixel = SEEN_OF_IT / PIXELS / math.sqrt(12)
        least, most = (math.hypot(width, pixel, by) for by in spread(places, number))
        ends.append((place, middle))
        noise = math.hypot(noise, error)
        name = f"{NAMES[medium]}, {nm} nm, on the screen"
        widths = (least + most) / 2, wide, (most - least) / 2 + error / math.sqrt(2)
        claims.append(Claim(f"{name}: its place", *_mm(place, middle, error), "mm"))
        claims.append(Claim(f"{name}: its width, a standard deviation", *_mm(*widths), "mm"))
    wide = [end - start for start, end in zip(*ends, strict=True)]
    claims.append(Claim(f"{NAMES[medium]}, on the screen: from {ENDS[0]} to {ENDS[1]} nm", *_mm(*wide, noise), "mm"))
    return claims


def _mm(*lengths):
    return [1e3 * length for length in lengths]


def _line(image):
    """The place and the width, a standard deviation, of the light on the screen, metres from the screen's middle."""
    board, row = screen(image.parameters), image.pixels[..., 0].mean(axis=0)
    # the camera's right is the screen's left
    shifts = (0.5 - (np.arange(PIXELS) + 0.5) / PIXELS) * SEEN_OF_IT
    shifts += float(np.subtract(image.camera.target[:2], board.middle) @ board.along)
    middle = float(row @ shifts / row.sum())
    return middle, math.sqrt(float(row @ np.square(shifts - middle) / row.sum()))


def colour_claims(images, medium):
    """The colours that the eye sees: where each of the channels lies, and how much light there is."""
    image = images[f"eye_{medium}"]
    nm = np.arange(VISIBLE_NM[0] + 0.5, VISIBLE_NM[1])
    wanted = in_colour(through_the_prism(image.parameters, image.camera, nm), nm)
    lit = np.flatnonzero(np.abs(wanted).max(axis=1) > 0)
    first, last = max(lit[0] - BESIDE, 0), lit[-1] + 1 + BESIDE
    middle = image.pixels.shape[0] // 2
    row = image.pixels[middle - 8 : middle + 8].mean(axis=0)
    # what the wall sends to the eye beside the slit
    dark = np.concatenate([row[first - 2 * BESIDE : first], row[last : last + 2 * BESIDE]]).mean(axis=0)
    wanted, found = wanted[first:last], row[first:last] - dark
    step = math.degrees(1 / image.camera.scale)
    name = f"{NAMES[medium]}, seen through it"
    pair = [(centroids(part) + first - len(row) / 2) * step for part in (wanted, found)]
    claims = [
        Claim(f"{name}: where {channel} lies, from the middle", float(one), float(other), step / 2, "degrees")
        for channel, one, other in zip(("red", "green", "blue"), *pair, strict=True)
    ]
    apart = [float(one[2] - one[0]) for one in pair]
    claims.append(Claim(f"{name}: from red to blue", *apart, step / 2, "degrees"))
    for channel, one, other in zip(("red", "green", "blue"), wanted.sum(axis=0), found.sum(axis=0), strict=True):
        text = f"{name}: light in {channel}, in columns of the slit's"
        claims.append(Claim(text, float(one), float(other), 0.02 * float(one)))
    return claims


def measure(images: dict[str, Image]) -> list[Claim]:
    """The claims of figure D.1."""
    claims = []
    for medium in SETTINGS:
        claims += deviation_claims(images, medium)
        claims += photon_claims(images, medium)
    for medium in SHOWN:
        claims += screen_claims(images, medium)
    for medium in SEEN:
        claims += colour_claims(images, medium)
    return claims


# the figure


def _measured():
    for medium, settings in SETTINGS.items():
        own = (f"medium={medium}", *settings, LEVEL)
        for nm in WAVES:
            pose = looking_back(PrismParameters.read(own), nm)
            name = f"turned_{medium}_{nm}"
            yield Recipe(
                name, "prism", own, draft=((16, 16), 1), change=directions, wavelength=nm, pose=pose, shown=False
            )
        own = (f"medium={medium}", *PHOTON_SETTINGS.get(medium, settings), LEVEL)
        pose = looking_back(PrismParameters.read(own), REPRESENTATIVE_NM)
        yield Recipe(f"photons_{medium}", "prism", own, draft=((128, 128), 1), change=by_photon, pose=pose, shown=False)
    for medium in SEEN:
        yield Recipe(
            f"eye_{medium}",
            "prism",
            (f"medium={medium}", *SETTINGS[medium], "view=through", "light=lamp", NARROW_SLIT),
            draft=((400, 32), 256),
            change=measured_spectrum,
            shown=False,
        )
    for medium in SHOWN:
        own = (f"medium={medium}", *SETTINGS[medium])
        parameters = PrismParameters.read(own)
        board, view = screen(parameters), 2 * math.degrees(math.atan(SEEN_OF_IT / 2 / AWAY))
        for nm in ENDS:
            leaves = way(parameters, parameters.medium.at(nm).n)
            target = board.middle + board.place(leaves) * board.along
            pose = Pose((*(target + AWAY * board.facing).tolist(), HEIGHT), (*target.tolist(), HEIGHT), view)
            yield Recipe(
                f"screen_{medium}_{nm}",
                "prism",
                own,
                draft=((PIXELS, PIXELS), 16),
                photons=(PHOTONS, PHOTONS),
                change=on_white,
                wavelength=nm,
                pose=pose,
                shown=False,
            )


def _shown():
    for view in ("side", "above", "screen", "through"):
        through = view == "through"
        light = ("light=lamp", NARROW_SLIT) if through else ()
        for medium in SEEN if through else SHOWN:
            yield Recipe(
                f"{view}_{medium}",
                "prism",
                (f"medium={medium}", *SETTINGS[medium], f"view={view}", *light),
                draft=((240, 180), 32),
                final=((432, 324), 64),
                photons=None if through else (1 << 20, 1 << 20),
                spectral=True,
                caption=f"{NAMES[medium]}, {view}",
            )


FIGURES = (
    Figure(
        "D.1",
        "A prism of glass and prisms of negative-index media, and their spectra",
        "White light comes through a slit: from the side, from above, on the screen, and as an eye behind the prism sees a "
        "narrow slit. From left to right a prism of N-BK7, 60 degrees; a NIM of glass's curve with its sign turned, 20 degrees; "
        "a NIM of the least dispersion that causality allows without loss, 15 degrees, in whose place the last row has one of "
        "little dispersion of the right sign. A NIM sends light to the other side, towards the apex. Violet is bent most where "
        "the index is largest there, as in glass and its mirror, and red where causality has its way.",
        (
            "Each wavelength is turned by what the closed form says, in all four media, by a NIM to the other side.",
            "In one render of all wavelengths each photon is turned by its own wavelength's angle, to 1e-4 degrees.",
            "On the screen each wavelength's light lands where it must, in a line as wide as the slit and the sun make it.",
            "The colours seen through the prism lie where the closed form has them, in the order of the index.",
        ),
        (*_shown(), *_measured()),
        measure,
        columns=3,
    ),
)

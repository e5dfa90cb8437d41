# SPDX-License-Identifier: GPL-3.0-or-later
"""A prism on a table in a dim room: the sun comes through a slit in the wall, and its spectrum falls on a screen.

After the description of Naranjo-Correa and Martinez-Borreguero (2024), prisms of glass and of negative-index media in white
light; the media are our own. Where a wavelength's light goes, physics.deviation says: way() puts it into this room.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles.material import interface_material
from ..physics import REPRESENTATIVE_NM, Medium
from ..physics.deviation import apex_for, incidence_for, prism
from . import shapes, surfaces
from .parameters import Parameters, choice, liquid, number
from .stage import Pose, Stage, staged

SIZE = (800, 600)  # pixels of its picture, where nothing else is asked for
# Lengths in metres. The table is z = 0. Light travels along +x, and its middle meets the prism's first face in the origin.
SIDE, HEIGHT = 0.04, 0.06  # of the prism: its two faces, and its edges
GAP = 0.0001  # as wide as nothing: keeps the prism off the table
WALL, THICK, WALL_HALF, WALL_TOP = -0.10, 0.004, 0.8, 0.5  # x of its front; half its width
OPEN = 0.05  # the slit's height
TABLE = (0.85, 0.75)  # how far it reaches along +x and to both sides
SCREEN_LOW, SCREEN_TOP, NARROWEST, WIDEST = 0.0005, 0.12, 0.12, 0.96  # the screen's edges, and its width
LAMP = 0.02  # how far behind the wall the sheet glows
PAPER, DARK, WHITE = (0.62, 0.62, 0.62), (0.035, 0.035, 0.035), (0.8, 0.8, 0.8)
HORIZON, ZENITH = (0.28, 0.28, 0.28), (0.12, 0.12, 0.12)
SUN_IRRADIANCE = (20.0, 20.0, 20.0)  # across its rays, whatever the sun's width
SIDE_SEES = 0.3  # of a wide screen, what is to be seen from the side
EYE = 0.25  # from the prism to the eye that looks through it
GLOW = 1.0  # radiance of the sheet
MOST_TURNED = math.radians(85)  # from +x, for the screen to stand before the wall
ENDS_NM = (400.0, 700.0)  # what the screen is wide enough for

VIEWS = {
    "side": "From the side: slit, prism and screen",
    "above": "From above, where the light's way shows on the table",
    "screen": "Straight at the screen, with the spectrum on it",
    "through": "Through the prism, at the slit",
}
LIGHTS = {
    "sun": "The sun behind the slit, whose spectrum falls onto the screen",
    "lamp": "A sheet that glows behind the slit, to look at through the prism",
}


@dataclass(frozen=True)
class PrismParameters(Parameters):
    """Parameters of the prism scene."""

    medium: Medium | None = liquid(Medium.parse("n-bk7"), "what the prism is made of, or none")
    view: str = choice(
        "side",
        "from the side, from above, straight at the screen, or through the prism at the slit",
        VIEWS,
    )
    light: str = choice("sun", "the sun behind the slit, or a sheet that glows, to look at through the prism", LIGHTS)
    apex: float | None = number(
        None, "angle between the prism's faces; 60, or 20 of a NIM, if left out", 1.0, 120.0, "degrees"
    )
    incidence: float | None = number(
        None,
        "angle of incidence, from the base's side; if left out what green light passes symmetrically with, or 0 of a NIM",
        -85.0,
        85.0,
        "degrees",
    )
    elevation: float = number(
        3.0, "how far the sun's light slants down, so that the table shows it", 0.0, 10.0, "degrees"
    )
    slit: float = number(1.5, "width of the slit", 0.25, 20.0, "mm")
    distance: float = number(0.4, "from the prism to the screen", 0.125, 0.5, "m")
    sun_angle: float = number(
        0.125, "width of the sun, of which 0.53 is the real one's; its light stays the same", 0.0625, 5.0, "degrees"
    )

    def __post_init__(self):
        super().__post_init__()
        if self.medium is not None:
            if self.apex is None:
                object.__setattr__(self, "apex", round(math.degrees(apex_for(self.medium.n)), 6))
            if self.incidence is None:
                object.__setattr__(self, "incidence", _incidence(self))
            green = way(self, self.medium.n)
            if green is None or abs(green.angle) > MOST_TURNED:
                light = f"light of {REPRESENTATIVE_NM:g} nm"
                does = f"let no {light} through" if green is None else f"send {light} back from"
                raise ValueError(
                    f"apex = {self.apex:g} and incidence = {self.incidence:g} {does} a prism of {self.medium}; take a "
                    "smaller apex, or leave both out."
                )

    @property
    def opening(self) -> float:
        """The width of the slit, metres."""
        return self.slit / 1000

    @property
    def slope(self) -> float:
        """How far the light slants down, radians: that of the sun; the glowing sheet's is looked at along the table."""
        return math.radians(self.elevation) if self.light == "sun" else 0.0


def _incidence(parameters):
    """The angle of incidence, degrees, that suits the medium and the apex; a grazing one where nothing passes."""
    n = index_along(parameters.medium.n, parameters.slope)
    angle = math.degrees(incidence_for(n, math.radians(parameters.apex)))
    return round(angle, 4) if math.isfinite(angle) else 85.0


class Way(NamedTuple):
    """The middle of the light of one wavelength after the prism, seen from above.

    start: (2,) where it leaves the prism; angle: radians, its direction, from +x towards +y
    """

    start: NDArray
    angle: float


def way(parameters: PrismParameters, n: float, offset: float = 0.0, turn: float = 0.0) -> Way | None:
    """The Way of light of index n that came through the slit `offset` metres to its left (+y); None if it does not get out.

    turn: radians, its direction there, from +x towards +y. Without a prism it goes straight on.
    """
    offset -= WALL * math.tan(turn)  # at the origin's x
    if parameters.medium is None:
        return Way(np.array([0.0, offset]), turn)
    n = index_along(n, parameters.slope)
    apex, incidence = _angles(parameters)
    incidence += turn
    sine = math.sin(incidence) / n
    turned = float(prism(n, apex, incidence))
    if abs(sine) > 1 or math.isnan(turned):
        return None
    corners = outline(parameters)
    # along the first face to where it is met, and through the prism to the second
    face = corners[0] - corners[2]
    face /= np.linalg.norm(face)
    ahead = np.array([math.cos(turn), math.sin(turn)])
    entry = face * np.linalg.solve(np.column_stack([face, -ahead]), (0.0, offset))[0]
    inward = np.array([face[1], -face[0]])
    inside = math.cos(math.asin(sine)) * inward + sine * face
    second = corners[1] - corners[0]
    length, along = np.linalg.solve(np.column_stack([inside, -second]), corners[0] - entry)
    if length <= 0 or not 0 < along < 1:
        return None
    return Way(entry + length * inside, turn - turned)


def _angles(parameters: PrismParameters) -> tuple[float, float]:
    """Apex and incidence, radians, which are chosen where there is a medium."""
    assert parameters.apex is not None and parameters.incidence is not None
    return math.radians(parameters.apex), math.radians(parameters.incidence)


def outline(parameters: PrismParameters) -> NDArray:
    """The prism's corners (3, 2) from above: its apex, and its base's on the side where light leaves and where it enters."""
    apex, incidence = _angles(parameters)
    half = apex / 2
    corners = np.array([(0, 1), (2, -1), (-2, -1)]) * SIDE / 2 * [math.sin(half), math.cos(half)]
    corners -= (corners[0] + corners[2]) / 2  # the middle of the first face
    turn = half - incidence
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    return corners @ rotation.T


class Screen(NamedTuple):
    """The screen: its middle (2,) from above, the unit vectors (2,) along it, to its left from the prism, and towards the
    prism, and its width."""

    middle: NDArray
    along: NDArray
    facing: NDArray
    width: float

    def place(self, way: Way) -> float:
        """Where light meets the screen, metres from its middle along it."""
        ahead = np.array([math.cos(way.angle), math.sin(way.angle)])
        reach = float((way.start - self.middle) @ self.facing) / -float(ahead @ self.facing)
        return float((way.start + reach * ahead - self.middle) @ self.along)


def screen(parameters: PrismParameters) -> Screen:
    """The Screen: across the green light, and as wide as the spectrum needs, from 400 to 700 nm."""
    middle = way(parameters, parameters.medium.n if parameters.medium else 1.0)
    assert middle is not None
    ahead = np.array([math.cos(middle.angle), math.sin(middle.angle)])
    along = np.array([-ahead[1], ahead[0]])
    found = Screen(middle.start + parameters.distance * ahead, along, -ahead, NARROWEST)
    reach = [0.0]
    for wavelength in ENDS_NM if parameters.medium else ():
        end = way(parameters, parameters.medium.at(wavelength).n)
        if end is not None and abs(end.angle - middle.angle) < math.radians(80):
            reach.append(abs(found.place(end)))
    return found._replace(width=min(WIDEST, max(NARROWEST, 2.4 * max(reach))))


@staged(PrismParameters)
def build(parameters: PrismParameters, backend: str = "auto") -> bpy.types.Scene:
    """Build the scene from PrismParameters; returns the bpy.types.Scene. The table is at z = 0, lengths are metres."""
    stage = Stage("prism", SIZE, backend)
    x, y = TABLE
    stage.mesh("Table", *shapes.rectangle((WALL, -y), (x, y)), surfaces.plain("Paper", PAPER))
    _wall(stage, parameters.opening)
    if parameters.medium is not None:
        material = interface_material("Prism", parameters.medium, backend=stage.backend)
        stage.mesh("Prism", *shapes.upright(outline(parameters)[::-1], GAP, HEIGHT), material)
    white = screen(parameters)
    edges = [white.middle + side * white.width / 2 * white.along for side in (1, -1)]
    corners = [(*edge, z) for z, order in ((SCREEN_LOW, edges), (SCREEN_TOP, edges[::-1])) for edge in order]
    stage.mesh("Screen", corners, [(0, 1, 2, 3)], surfaces.plain("White", WHITE))
    glow = None
    if parameters.light == "sun":
        towards = (-math.cos(parameters.slope), 0.0, math.sin(parameters.slope))
        glow = surfaces.sun(towards, SUN_IRRADIANCE, parameters.sun_angle)
    else:
        vertices, faces = shapes.rectangle((-0.5 * OPEN, -0.02), (0.5 * OPEN, 0.02))
        sheet = np.column_stack([np.full(4, WALL - LAMP), vertices[:, 1], vertices[:, 0] + OPEN / 2])
        stage.mesh(
            "Sheet", sheet, [face[::-1] for face in faces], surfaces.shining("Sheet", lambda nodes: (1, 1, 1), GLOW)
        )
    stage.world(surfaces.sky("Dim room", HORIZON, ZENITH, glow=glow), aim=None if glow is None else 1024)
    stage.camera(*pose(parameters))
    return stage.scene


def _wall(stage, slit):
    """The wall, with the slit: three boxes that touch nothing but each other."""
    back = WALL - THICK
    sides = [
        shapes.box((back, low, 0), (WALL, high, OPEN)) for low, high in ((-WALL_HALF, -slit / 2), (slit / 2, WALL_HALF))
    ]
    top = shapes.box((back, -WALL_HALF, OPEN), (WALL, WALL_HALF, WALL_TOP))
    stage.mesh("Wall", *shapes.joined(*sides, top)[:2], surfaces.plain("Wall", DARK))


def pose(parameters: PrismParameters) -> Pose:
    """The Pose of the camera for PrismParameters."""
    white = screen(parameters)
    x, y = white.middle.tolist()
    if parameters.view == "above":
        # from the wall to the whole of the screen, which stands aslant
        ends = white.middle + np.outer((-0.5, 0.5), white.width * white.along)
        low, high = np.minimum(ends.min(axis=0), (WALL, -0.05)), np.maximum(ends.max(axis=0), (0.0, 0.05))
        middle = ((low + high) / 2).tolist()
        reach = 1.06 * max(high[0] - low[0], SIZE[0] / SIZE[1] * (high[1] - low[1]))
        target = (middle[0], middle[1] + 1e-4, 0.0)
        return Pose((*middle, 1.5), target, 2 * math.degrees(math.atan(reach / 2 / 1.5)))
    if parameters.view == "screen":
        back = min(0.36, max(0.2, 0.5 * white.width))
        eye = white.middle + back * white.facing
        angle = 2 * math.degrees(math.atan(max(0.036, white.width / 2.2) / back))
        return Pose((*eye.tolist(), 0.05), (x, y, 0.016), angle)
    if parameters.view == "through":
        start = white.middle + parameters.distance * white.facing
        eye = start - EYE * white.facing
        return Pose((*eye.tolist(), OPEN / 2), (*start.tolist(), OPEN / 2), _spread(parameters))
    # on the far side of the light, so that it sees the front of the screen
    eye = np.array([-0.07, math.copysign(0.36, -y), 0.28])
    ends = [white.middle + end * white.along for end in np.array([-0.5, 0.5]) * min(white.width, SIDE_SEES)]
    return _around(
        eye, np.array([(0.85 * WALL, 0.0, 0.0), *((*end.tolist(), z) for end in ends for z in (0.0, SCREEN_TOP))])
    )


def _around(eye, points):
    """The Pose of an eye that sees points (N, 3), which are all before it, with a margin."""
    away = points - eye
    azimuth = np.arctan2(away[:, 1], away[:, 0])
    low = np.arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1]))
    turn, tilt = (float(angle.min() + angle.max()) / 2 for angle in (azimuth, low))
    ahead = np.array([math.cos(turn) * math.cos(tilt), math.sin(turn) * math.cos(tilt), math.sin(tilt)])
    right = np.array([math.sin(turn), -math.cos(turn), 0.0])
    depth = away @ ahead
    reach = np.abs(away @ right / depth).max(), SIZE[0] / SIZE[1] * np.abs(away @ np.cross(right, ahead) / depth).max()
    return Pose(
        tuple(eye.tolist()), tuple((eye + 0.5 * ahead).tolist()), 2 * math.degrees(math.atan(1.06 * max(reach)))
    )


def _spread(parameters):
    """How many degrees an eye at the screen's place must see, for the spectrum with as much dark on both sides."""
    ends = [way(parameters, parameters.medium.at(end).n) for end in ENDS_NM] if parameters.medium else []
    angles = [end.angle for end in ends if end is not None]
    return min(60.0, max(8.0, 3 * math.degrees(max(angles) - min(angles)))) if len(angles) == 2 else 20.0


def index_along(n: float, slope: float) -> float:
    """The index that light which slants against a prism's cross-section is turned by, seen along the prism's edge.

    Its component along the edge stays the same: n' = sqrt(n^2 - sin^2 e) / cos e, with n's sign (Born and Wolf, 4.7.2, of
    skew rays). slope (e): radians.
    """
    return math.copysign(math.sqrt(max(n * n - math.sin(slope) ** 2, 1e-12)) / math.cos(slope), n)

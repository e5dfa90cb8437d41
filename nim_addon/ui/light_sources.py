# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light paths start: beside the interfaces, at the 3D cursor, at the camera, or at lamps."""

import itertools
import math

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt

from ..cycles.casting import Meshes
from .light_settings import Settings

# Of a beam from the side so many rays should meet an interface first, from outside, neither grazing nor head-on.
ENOUGH = 0.9
AT_LEAST = 0.5  # where no beam has so many: the share of the best, with which it is looked for no further away
STEEP = 0.3  # the least cosine of what is not grazing
HEAD_ON = math.cos(math.radians(10))  # the greatest of what is seen to be bent
SLANT = math.radians(30)  # of a beam to a face that it would meet head-on
NARROW = 0.25  # of the extent across it: the width of a beam that is one beam still behind a face or two
WIDE = 0.8  # and of one that meets most of what is there
LOOKED_AT = 50  # of a beam from the side at most so many rays are looked at
FLAT = 0.15  # thinner than this share of its second extent something is a sheet, such as the surface of a liquid


def starts(
    context: bpy.types.Context, settings: Settings, surfaces: Meshes, depsgraph: bpy.types.Depsgraph
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The rays of each source: {name: (origins (N, 3), directions (N, 3))}; with settings.fit it sets their sizes.

    surfaces: with at least one interface; ValueError with a sentence where settings lead nowhere
    """
    target = surfaces.bounds.get(context.active_object, (surfaces.low, surfaces.high))
    if settings.fit:
        # as properties, so that whoever takes the fit off goes on from here
        settings.thickness, settings.reach = 0.007 * surfaces.size, surfaces.size
    if settings.source == "SIDE":
        return {"side": _from_the_side(context.scene, settings, surfaces, target, depsgraph)}
    if settings.fit:  # from the handle as from the side, where it is added
        share = NARROW if settings.source == "HANDLE" else WIDE
        settings.width = share * float(np.median(target[1] - target[0]))
    middle = (target[0] + target[1]) / 2
    if settings.source == "HANDLE":
        return {"handle": _from_the_handle(context.scene, settings, depsgraph)}
    return {
        name: _from(settings, matrix, is_sun, middle, surfaces.size, context.scene.cursor)
        for name, matrix, is_sun in _sources(context, settings.source, depsgraph)
    }


def lamps(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected lamps; where none is, the scene's lamp if there is just one."""
    chosen = [object_ for object_ in context.selected_objects if object_.type == "LIGHT"]
    if not chosen:
        chosen = [object_ for object_ in context.scene.objects if object_.type == "LIGHT"]
        chosen = chosen if len(chosen) == 1 else []
    return chosen


def handle_of(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The object that rays of that scene start from, if it is still in it."""
    handle = scene.nim_rays.handle
    return handle if handle and scene.objects.get(handle.name) == handle else None


def _from_the_handle(scene, settings, depsgraph):
    """Origins and directions (N, 3) of rays along the Z axis of the handle, side by side along its X axis."""
    handle = handle_of(scene)
    if handle is None:
        raise ValueError(pgettext_rpt("Light paths: the scene has no handle; add one, or choose another source"))
    matrix = np.array(handle.evaluated_get(depsgraph).matrix_world.normalized(), float)
    axis = matrix[:3, 2]
    up = matrix[:3, 0] - axis * (axis @ matrix[:3, 0])
    up = up / np.linalg.norm(up) if np.linalg.norm(up) > 0 else across(axis, 0.0)
    up = math.cos(settings.roll) * up + math.sin(settings.roll) * np.cross(axis, up)
    return _rays(settings, matrix[:3, 3], axis, settings.width, settings.arrangement == "BEAM", up)


def _sources(context, source, depsgraph):
    """Of each source its name, its matrix (4, 4), and whether it is a sun."""
    scene = context.scene
    if source == "CURSOR":
        return [("cursor", np.array(scene.cursor.matrix, float), False)]
    objects = lamps(context) if source == "LAMP" else [scene.camera] if scene.camera else []
    if not objects:
        raise ValueError(
            pgettext_rpt("Light paths: no lamp is selected, and there is not just one; select a lamp")
            if source == "LAMP"
            else pgettext_rpt("Light paths: the scene has no camera; add one, or choose another source")
        )
    return [
        (
            f"lamp {object_.name}" if source == "LAMP" else "camera",
            np.array(object_.evaluated_get(depsgraph).matrix_world, float),
            object_.type == "LIGHT" and object_.data.type == "SUN",
        )
        for object_ in objects
    ]


def _from(settings, matrix, is_sun, middle, size, cursor):
    """Origins and directions (N, 3) of the rays of one source, whose target is at `middle`."""
    place = matrix[:3, 3]
    if settings.aim == "TARGET" and np.linalg.norm(middle - place) < 1e-3 * size:
        # as in a new file, where cursor and cube are both at the origin: in there nothing would be bent
        place = middle - (size, 0, 0)
    if is_sun or settings.aim == "FORWARD":
        axis = _direction(-matrix[:3, 2])
    else:
        axis = _direction(settings.direction if settings.aim == "DIRECTION" else middle - place)
    if is_sun:
        # from nowhere near: a beam that is centred on the target, and starts outside of everything that bends
        place = (middle if settings.aim == "TARGET" else np.array(cursor.location, float)) - axis * size
    return _rays(settings, place, axis, settings.width, is_sun or settings.arrangement == "BEAM")


def _direction(vector):
    vector = np.array(vector, float)
    if not np.linalg.norm(vector) > 0:
        raise ValueError(
            pgettext_rpt("Light paths: the direction of the rays is zero; give another, or choose another aim")
        )
    return vector / np.linalg.norm(vector)


def across(axis: np.ndarray, roll: float) -> np.ndarray:
    """The direction (3,) in which a beam along `axis` is wide: upright, turned by the roll; about the vertical the y axis."""
    upright = np.array((0.0, 0.0, 1.0) if abs(axis[2]) < 0.9999 else (0.0, 1.0, 0.0))
    upright -= axis * (axis @ upright)
    upright /= np.linalg.norm(upright)
    return math.cos(roll) * upright + math.sin(roll) * np.cross(axis, upright)


def _rays(settings, place, axis, width, parallel, up=None):
    """Origins and directions (N, 3) of rays from `place` about the unit vector `axis`; up: (3,) where a beam is wide."""
    up = across(axis, settings.roll) if up is None else up
    spread = np.linspace(-0.5, 0.5, settings.rays)[:, None] if settings.rays > 1 else np.zeros((1, 1))
    if parallel:
        return place + width * spread * up, np.broadcast_to(axis, (settings.rays, 3))
    if settings.arrangement == "FAN":
        directions = np.cos(settings.angle * spread) * axis + np.sin(settings.angle * spread) * up
    else:
        # equal steps of height on the unit sphere, each turned by the golden angle, are spread evenly
        step = np.arange(settings.rays)[:, None]
        cosine = 1 - (1 - math.cos(settings.angle / 2)) * (step + 0.5) / settings.rays
        turn = step * math.pi * (3 - math.sqrt(5))
        aside = np.cos(turn) * up + np.sin(turn) * np.cross(axis, up)
        directions = cosine * axis + np.sqrt(1 - cosine**2) * aside
    return np.broadcast_to(place, directions.shape), directions


# ---------------------------------------------------------------- from the side


def _from_the_side(scene, settings, surfaces, target, depsgraph):
    """Origins and directions (N, 3) that start outside of all there is and meet interfaces, as far as such are found."""
    boxes = [target]
    if target[0] is surfaces.low:  # of interfaces that lie apart the middle may be empty: then one of them will do
        boxes += sorted(surfaces.bounds.values(), key=lambda box: -np.linalg.norm(box[1] - box[0]))
    best, most = None, -1.0
    for (low, high), beyond in itertools.product(boxes, (False, True)):
        axes = _axes(scene, settings, high - low, depsgraph)
        share, start = _best(
            surfaces, (start for axis in axes for start in _beside(settings, surfaces, low, high, axis, beyond))
        )
        if share > most:
            best, most = start, share
        if most >= AT_LEAST:
            break
    if settings.fit:
        settings.width = best[2]
    return best[:2]


def _best(surfaces, starts):
    """Of ways to start the first that is good enough, or else the best: its share, and itself."""
    best, most = None, -1.0
    for start in starts:
        share = _share(surfaces, *start[:2])
        if share > most:
            best, most = start, share
        if most >= ENOUGH:
            break
    return most, best


def _axes(scene, settings, extent, depsgraph):
    """Unit vectors along which a beam could come, the best first: across the camera's view; at a slant to a sheet."""
    if settings.aim == "DIRECTION":
        return [_direction(settings.direction)]
    right, away, up = np.eye(3)
    if scene.camera:
        view = np.array(scene.camera.evaluated_get(depsgraph).matrix_world, float)[:3, 0]
        # along an axis of the scene, as most objects stand; x where the camera looks between two
        side = 1 if abs(view[1]) > 1.5 * abs(view[0]) else 0
        right = np.eye(3)[side] * (1 if view[side] >= 0 else -1)
        away = np.cross(up, right)
    slants = [right - up, right + away, right - away, away - up, -right - up, right + up]
    straight = [right, -right, away, -away, -up, up]
    if _is_sheet(extent):
        normal = np.eye(3)[np.argmin(extent)]
        order = sorted(slants, key=lambda axis: abs(axis @ normal) < 0.5) + straight
    else:
        order = straight[:1] + slants[:1] + straight[1:] + slants[1:]
    return [_direction(axis) for axis in order]


def _beside(settings, surfaces, low, high, axis, beyond):
    """Origins, directions and width of rays along `axis` that start outside of the box, or `beyond` all interfaces.

    Before those, of rays that lean, and meet at a slant what these meet: head-on nothing is bent.
    """
    middle, extent = (low + high) / 2, high - low
    straight = _towards(settings, surfaces, middle, extent, axis, beyond)
    if settings.aim != "DIRECTION" and not _is_sheet(extent):
        origin = straight[0].mean(axis=0)
        distance = surfaces.hit(origin[None], axis[None]).distance[0]
        if np.isfinite(distance):
            leaning = math.cos(SLANT) * axis - math.sin(SLANT) * across(axis, settings.roll)
            yield _towards(settings, surfaces, origin + distance * axis, extent, leaning, beyond)
    yield straight


def _is_sheet(extent):
    thin, second = np.sort(extent)[:2]
    return thin < FLAT * second


def _towards(settings, surfaces, place, extent, axis, beyond):
    """Origins, directions and width of rays along `axis` to a place of something of that extent."""
    before = 0.75 * np.linalg.norm(extent)
    if beyond:
        corners = np.array(np.meshgrid(*np.stack([surfaces.low, surfaces.high], -1))).reshape(3, -1).T
        before = max(before, -np.min((corners - place) @ axis) + 0.25 * np.linalg.norm(extent))
    width = NARROW * float(np.linalg.norm(across(axis, settings.roll) * extent)) if settings.fit else settings.width
    return *_rays(settings, place - before * axis, axis, width, settings.arrangement == "BEAM"), width


def _share(surfaces, origins, directions):
    """The share of rays that start outside and meet an interface first, so that they are seen to bend; a little for any other."""
    some = slice(None, None, 1 + len(origins) // LOOKED_AT)
    origins, directions = origins[some], directions[some]
    ahead, behind = surfaces.hit(origins, directions), surfaces.hit(origins, -directions)
    meets = ahead.which >= 0
    outside = np.sum(-directions * behind.normal, axis=1) <= 0
    cosine = -np.sum(directions * ahead.normal, axis=1)
    good = meets & outside & (cosine > STEEP) & (cosine < HEAD_ON)
    return float(np.mean(good + 0.01 * meets))

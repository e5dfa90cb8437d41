# SPDX-License-Identifier: GPL-3.0-or-later
"""Interfaces where, or as coarse as, a render cannot show them right: in the same place as others, or far away."""

import bpy
import numpy as np

from ..cycles import meshes
from ..cycles.problem import Problem, about
from .sight import Sight
from .surroundings import Surroundings

# Degrees between smooth neighbours: UV spheres of 16 x 8, 24 x 12, 32 x 16 (22.5, 15, 11.25) show what is behind them
# 3.0, 1.5 and 0.9 % wrong (n = -1.5, blocks of 4 x 4 of 64 x 64 pixels): it goes with the square.
COARSE, COARSE_ERROR = 12.5, 3.0 / 22.5**2
MOST_FACES = 100_000  # faces of a mesh that is not coarse
# Times its size, from the origin: at 2,900 times a sphere shows what is behind it 0.6 to 2 % wrong, at 29,000 3 to 9 %.
FAR = 2_000
# Of the points on an object that lie on faces of another: beyond, it is a copy.
COPY = 0.9
# Of the normals where two touch: beyond, they are all alike; and how far the two are then moved apart, of their size.
FLAT, GAP = 0.95, 1e-4


def find(sight: Sight, around: Surroundings) -> list[Problem]:
    """The Problems of where and how fine the interfaces of a sight are."""
    return _touching(around) + _coarse(sight, around) + _far(around)


def _touching(around):
    """Faces of two objects in the same place: which of them a ray meets is chance, and the other is met after it or not."""
    shares, points, ways = {}, {}, {}
    for patch in around.patches:
        found, sums, count = around.touching(patch)
        points[patch.body] = points.get(patch.body, 0) + count
        for other, share in found.items():
            pair = patch.body, other
            shares[pair], ways[pair] = shares.get(pair, 0) + share, ways.get(pair, 0) + sums[other]
    found, named = [], set()
    for (index, other), share in shares.items():
        body, second = around.bodies[index], around.bodies[other]
        pair = frozenset((body.name, second.name))
        if pair in named or share < 2:
            continue
        named.add(pair)
        text = "{name} and {other} have faces in the same place, of which one or the other is met: move one a little."
        remedy, values = None, {"name": body.name, "other": second.name}
        if min(share, shares.get((other, index), share)) > COPY * points[index]:
            text = "{name} and {other} are in the same place, where one or the other is met: move or remove one."
        # where they touch in one plane they can be moved apart
        elif np.linalg.norm(ways[index, other]) > FLAT * share and _is_free(body.shown):
            remedy = "Separate the faces"
            values["step"] = (-GAP * body.size * ways[index, other] / np.linalg.norm(ways[index, other])).tolist()
        objects = (body.name, second.name) if other in points else (body.name,)
        found.append(Problem("touching", (text,), values, remedy, objects, body.worn))
    return found


def _is_free(shown):
    """Whether an object stands where its own location says, which this file may change."""
    obj = shown.original
    moved = obj.parent or obj.constraints or obj.animation_data or any(obj.lock_location)
    return shown.single and not (moved or obj.library or obj.override_library)


def _move(scene, problem):
    obj = bpy.data.objects[problem.values["name"], None]
    obj.location = [place + step for place, step in zip(obj.location, problem.values["step"], strict=True)]


def _coarse(sight, around):
    found = {}
    for body in around.bodies:
        obj = body.object
        if obj in found or not body.media:
            continue
        angle = sight.measured(body.shown, "coarseness", coarseness)
        # what the viewport divides less often than a render does
        for modifier in obj.modifiers:
            if modifier.type == "SUBSURF" and modifier.show_render and angle is not None:
                shown = modifier.levels if modifier.show_viewport else 0
                angle /= 2 ** max(0, modifier.render_levels - shown)
                angle *= not _is_adaptive(obj, modifier)
        if angle is not None and angle > COARSE:
            text = (
                "{name} is coarse for a smooth surface: faces differ by {angle:.0f} degrees, and what it shows is some "
                "{error:.0f} % off: subdivide it, or shade it flat."
            )
            error = COARSE_ERROR * angle**2
            found[obj] = about(obj, "coarse", text, None, body.worn, angle=angle, error=error)
    return list(found.values())


def _is_adaptive(obj, modifier):
    """Whether a Subdivision Surface is divided to pixels: of the object up to Blender 4.5, then of the modifier."""
    owner = modifier if hasattr(modifier, "use_adaptive_subdivision") else obj.cycles
    return bool(getattr(owner, "use_adaptive_subdivision", False))


def coarseness(mesh: bpy.types.Mesh) -> float:
    """The angle in degrees between faces that are shaded as one surface: root of its mean square, over all of a mesh."""
    edges, faces = len(mesh.edges), len(mesh.polygons)
    if faces > MOST_FACES:
        return 0.0
    smooth = meshes.read(mesh.polygons, "use_smooth", dtype=bool)
    if not smooth.any():
        return 0.0
    edge = meshes.corner_edges(mesh)
    sharp = meshes.read(mesh.edges, "use_edge_sharp", dtype=bool)
    normal, area = meshes.read(mesh.polygons, "normal", 3), meshes.read(mesh.polygons, "area")
    face = np.repeat(np.arange(faces), np.diff(meshes.starts(mesh)))
    order = np.argsort(edge, kind="stable")
    count = np.bincount(edge, minlength=edges)
    pairs = face[order[count[edge[order]] == 2]].reshape(-1, 2)
    first, other = pairs.T
    soft = smooth[first] & smooth[other] & ~sharp[np.flatnonzero(count == 2)]
    cosine = np.einsum("ij,ij->i", normal[first], normal[other])
    square = np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2 * soft
    # each face shows the mean over its edges
    total = np.bincount(first, square, faces) + np.bincount(other, square, faces)
    sides = np.maximum(np.bincount(face, minlength=faces), 1)
    return float(np.sqrt(np.average(total / sides, weights=np.maximum(area, 1e-30))))


def _far(around):
    found = {}
    for body in around.bodies:
        obj = body.object
        if body.media and obj not in found and body.size > 0:
            times = np.abs([body.low, body.high]).max() / body.size
            if times > FAR:
                text = (
                    "{name} is {times:,.0f} times its size away from the origin, too far for the numbers of a render: move "
                    "everything there."
                )
                found[obj] = about(obj, "far", text, None, body.worn, times=times)
    return list(found.values())


MENDS = {"touching": _move}

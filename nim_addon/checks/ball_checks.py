# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded balls where, or as, a render cannot show them right: a ball meets a ray once, as a sphere in vacuum."""

from __future__ import annotations

from typing import NamedTuple

import bpy
import mathutils
import numpy as np

from ..cycles import meshes
from ..cycles.laws import asked_law, law_of
from ..cycles.material import asked_interfaces, interface_of
from ..cycles.problem import Problem, about
from ..cycles.visibility import Shown
from ..physics.balls import Ball, Shell
from .ray_checks import give_size, sizeless
from .sight import Sight

UNEVEN = 1e-3  # by how much the scales of a ball along its axes may differ
INSIDE = 0.999  # radii
UNMATCHED = 1e-3  # by how much index and impedance around a ball may differ from 1
CROSSINGS = 64  # of a line through a body, at most


class _Found(NamedTuple):
    """A Shown that is a graded ball, its Ball or Shell in the world, and the names of its materials."""

    shown: Shown
    law: Ball | Shell
    materials: tuple[str, ...]


def find(sight: Sight) -> list[Problem]:
    """The Problems of the graded balls of a sight."""
    balls = [found for shown in sight.shown if (found := _ball(shown)) is not None]
    if not balls:
        return []
    found = []
    for ball in balls:
        found += _uneven(ball) + _camera(sight, ball) + _within(sight, ball) + _around(sight, ball)
    return found + ([] if sight.worn else _lamps(sight))  # which ray_checks.lamps() has of interfaces


def _ball(shown):
    for material in shown.materials:
        asked = asked_law(material)
        law = law_of(asked, np.array(shown.matrix.copy())) if asked else None
        if isinstance(law, Ball | Shell):
            return _Found(shown, law, (material.name,))
    return None


def _uneven(ball):
    obj, axes = ball.shown.original, np.array(ball.shown.matrix.copy())[:3, :3]
    lengths = np.linalg.norm(axes, axis=0)
    slant = np.abs(np.triu(axes.T @ axes, 1)).max() / lengths.max() ** 2
    if lengths.max() - lengths.min() <= UNEVEN * lengths.max() and slant <= UNEVEN:
        return []
    text = "{name} is not scaled evenly: a graded ball is a sphere, and the rest of the object shows what is behind it."
    own = ball.shown.single and not obj.parent and not obj.constraints
    return [about(obj, "uneven_ball", text, "Scale it evenly" if own else None, ball.materials, owner=obj)]


def _camera(sight, ball):
    camera = sight.scene.camera
    if camera is None or _off(ball, camera.evaluated_get(sight.depsgraph).matrix_world.translation) >= 1:
        return []
    text = "The camera is in {name}: rays that start within a graded ball pass straight out of it."
    return [about(ball.shown.original, "camera_in_ball", text, None, ball.materials, owner=ball.shown.original)]


def notes(sight: Sight) -> list[Problem]:
    """What a cloak hides: right, but not to be wondered at. A Problem without a remedy for each thing in a hollow."""
    text = "{other} is in the hollow of {name}, and is not seen: that is the cloak."
    found = []
    for ball in filter(None, map(_ball, sight.shown)):
        for name, far in _in(sight, ball).items():
            if far <= _hidden(ball):
                obj = ball.shown.original
                found.append(about(obj, "cloaked", text, None, ball.materials, owner=obj, other=name))
    return found


def _within(sight, ball):
    """What is in a ball is not seen: but for the core of a shell, and what a cloak hides, which notes() tell."""
    text = (
        "{other} is in {name}, and is neither seen nor lit there: a ray jumps from where it enters to where it leaves."
    )
    obj, seen = ball.shown.original, 1.01 * ball.law.profile.core if isinstance(ball.law, Shell) else 0.0
    return [
        about(obj, "in_ball", text, None, ball.materials, owner=obj, other=name)
        for name, far in _in(sight, ball).items()
        if far > max(seen, _hidden(ball))
    ]


def _hidden(ball):
    return ball.law.profile.hollow if ball.law.profile.is_cloak else 0.0


def _in(sight, ball):
    """{name: how far from the middle it reaches, in radii} of each object that is wholly in a ball."""
    found = {}
    for other in sight.shown:
        matrix = np.array(other.matrix.copy())
        if other.original == ball.shown.original:
            continue
        if _off(ball, matrix[:3, :3] @ np.mean(other.object.bound_box, axis=0) + matrix[:3, 3]) >= INSIDE:
            continue
        points = meshes.read(other.mesh.vertices, "co", 3) @ matrix[:3, :3].T + matrix[:3, 3]
        far = np.linalg.norm(points - ball.law.center, axis=1) / ball.law.radius
        if len(far) and far.max() < INSIDE:
            found[other.original.name] = max(far.max(), found.get(other.original.name, 0.0))  # of its instances
    return found


def _around(sight, ball):
    """A ball is made for an index of 1 around it; in a body of another one its rim would reflect, and bend."""
    for material, wearers in sight.worn.items():
        interface = interface_of(*asked_interfaces(material)[0])
        medium = interface and interface.inside
        if not medium or (abs(medium.n - 1) < UNMATCHED and abs(medium.impedance - 1) < UNMATCHED):
            continue
        for body in wearers:
            if _encloses(body, ball.law.center):
                text = "{name} is in {body}, of n = {n:.4g}: its rim is matched to n = 1, and nothing else is rendered."
                values = {"body": body.original.name, "n": medium.n}
                obj = ball.shown.original
                return [about(obj, "rim_unmatched", text, None, ball.materials, owner=obj, **values)]
    return []


def _encloses(body, center):
    """Whether a point is within a closed mesh: a line upwards meets its faces an odd number of times."""
    inverse = body.matrix.copy().inverted_safe()
    at, up = inverse @ mathutils.Vector(center), (inverse.to_3x3() @ mathutils.Vector((0.013, 0.007, 1))).normalized()
    for count in range(CROSSINGS):
        met, place, _, _ = body.object.ray_cast(at, up)
        if not met:
            return count % 2 == 1
        at = place + 1e-5 * up * max(1.0, place.length)
    return False


def _off(ball, place):
    return np.linalg.norm(np.subtract(place, ball.law.center)) / ball.law.radius


def _lamps(sight):
    text = "The light {name} has no size: a graded ball casts a shadow in it, and is never seen to bend it."
    lights = [lamp for lamp in sight.lamps if not lamp.data.cycles.is_portal and sizeless(lamp.data)]
    return [about(lamp, "light_at_ball", text, "Give it a size") for lamp in lights]


def _scale_evenly(scene, problem):
    obj = bpy.data.objects[problem.values["name"], None]
    # its radius is that of x
    obj.scale = (abs(obj.scale.x),) * 3


MENDS = {"uneven_ball": _scale_evenly, "light_at_ball": give_size}

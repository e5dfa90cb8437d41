# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an interface's own absorption is not that of its medium: it knows the last straight way to its faces only."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from ..cycles.material import absorb_by_volume, absorbs, asked_interfaces
from ..cycles.problem import LINKED, Problem
from .bodies import BACK, FRONT, Body
from .borders import Borders
from .sight import Sight

SIDES = {FRONT: "Outside", BACK: "Inside"}
FAINT = 1e-3  # of the light, over the size of a body: what is lost less is not seen
SLIPPING = 0.1  # of the rays: more, and it is open
POINTS = 24  # on what may stand within a body


def find(sight: Sight, borders: Borders) -> list[Problem]:
    """The Problems of interfaces that absorb where light also ends at something else, or where nothing closes them in."""
    found = {}
    for body, patch, side in _absorbing(borders):
        if body.object in found:
            continue
        standing, is_open = _within(sight, borders, body, patch, side)
        if standing:
            text = (
                "{name} absorbs on straight ways to its own faces only, but {other} stands in what absorbs: let a volume "
                "absorb instead."
            )
        elif is_open:
            text = (
                "{name} absorbs where no faces close it in, so that light from elsewhere loses nothing on its way: make it "
                "a closed body."
            )
        else:
            continue
        material = body.shown.materials[patch.slot]
        remedy = "Use a volume" if standing and _is_free(body, patch, side, material) else None
        texts = (text, LINKED) if material.library else (text,)
        found[body.object] = Problem(
            "absorbs", texts, {"name": body.name, "other": standing}, remedy, (body.name,), (material.name,)
        )
    return list(found.values())


def _absorbing(borders) -> Iterator[tuple[Body, object, str]]:
    """(Body, Patch, side) of the interfaces that absorb by themselves on that side so much that it is seen."""
    known = {}
    for patch in borders.patches:
        body = borders.around.bodies[patch.body]
        material = body.shown.materials[patch.slot]
        for side, name in SIDES.items():
            if (material, side) not in known:
                nodes = asked_interfaces(material)
                known[material, side] = absorbs(nodes[0].node, name, nodes[0].path) if len(nodes) == 1 else 0.0
            if known[material, side] * body.size > FAINT:
                yield body, patch, side


def _within(sight, borders, body, patch, side):
    """The name of what else light meets on that side of a Patch, or None; and whether it goes on without end there."""
    around = borders.around
    if around.blind or body.heavy:
        return None, False
    key = (patch.body, patch.part)
    closed = body.solid.parts[patch.part].closed
    if side == BACK and closed:
        for other in around.bodies:
            if not other.media and not other.open and any(key in around.within(point) for point in _points(other)):
                return other.name, False
        for lamp in sight.lamps:
            if key in around.within(np.array(lamp.matrix_world.translation)):
                return lamp.name, False
    hits = [hit for hits in around.leaving(patch, side) for hit in hits]
    for hit in hits:
        if hit is not None and not around.bodies[hit.body].media:
            return around.bodies[hit.body].name, False
    # some slip through between faces
    lost = sum(hit is None for hit in hits) > SLIPPING * len(hits)
    return None, lost and not (closed and side == BACK)


def _points(body):
    """Some points (N, 3) of a body in the world."""
    points = body.solid.points
    return body.world(points[np.unique(np.linspace(0, len(points) - 1, POINTS).astype(int))].astype(float))


def _is_free(body, patch, side, material):
    """Whether a volume can do it: within a closed body, by a material of this file whose node is its own."""
    nodes = asked_interfaces(material)
    return (
        side == BACK
        and body.solid.parts[patch.part].closed
        and not material.library
        and not nodes[0].path
        and not material.node_tree.animation_data
        and not material.node_tree.get_output_node("CYCLES").inputs["Volume"].is_linked
    )


def _use_volume(scene, problem):
    for name in problem.materials:
        material = bpy.data.materials[name, None]
        absorb_by_volume(asked_interfaces(material)[0].node, material.node_tree.get_output_node("CYCLES"))


MENDS = {"absorbs": _use_volume}

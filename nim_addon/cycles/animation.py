# SPDX-License-Identifier: GPL-3.0-or-later
"""The curves by which keyframes move what a data-block has."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator

import bpy


def curves_of(owner: bpy.types.ID) -> Iterator[tuple[bpy.types.FCurve, bpy.types.NlaStrip | None]]:
    """The curves of the action of a data-block and of its NLA strips, each with the strip, in whose time it is."""
    for player, strip in _players(owner):
        for curve in _curves(player.action, getattr(player, "action_slot", None)):
            yield curve, strip


def actions_of(owner: bpy.types.ID) -> list[bpy.types.Action]:
    """The actions that a data-block, or an NLA strip of it, plays."""
    return [player.action for player, _ in _players(owner) if player.action]


def settle(scene: bpy.types.Scene, used: Iterable[bpy.types.ID]) -> None:
    """Let what a scene uses have the values that keyframes and drivers give it at the scene's frame.

    Blender evaluates them for every scene, but writes back only those of the one in the window. Of what is
    hidden in the viewport it evaluates none: that is settled within visibility.as_rendered().
    """
    depsgraph = scene.view_layers[0].depsgraph
    for data in used:
        evaluated = data.evaluated_get(depsgraph)
        for owner, now in ((data, evaluated), *_trees(data, evaluated)):
            if animation := getattr(owner, "animation_data", None):
                paths = {curve.data_path for curve, _ in curves_of(owner)}
                for path in paths | {driver.data_path for driver in animation.drivers}:
                    holder, _, name = path.rpartition(".")
                    # of what is gone, or is not to be written
                    with contextlib.suppress(ValueError, AttributeError, TypeError):
                        setattr(owner.path_resolve(holder) if holder else owner, name, now.path_resolve(path))


def undriven(scene: bpy.types.Scene, used: Iterable[bpy.types.ID]) -> list[tuple[str, str]]:
    """(name, expression) of the drivers of what a scene uses that Blender could not run at the scene's frame, sorted."""
    depsgraph = scene.view_layers[0].depsgraph
    found = set()
    for data in used:
        evaluated = data.evaluated_get(depsgraph)
        for _, now in ((data, evaluated), *_trees(data, evaluated)):
            animation = getattr(now, "animation_data", None)
            for curve in animation.drivers if animation else ():
                if not curve.driver.is_valid:
                    found.add((data.name, curve.driver.expression))
    return sorted(found)


def _trees(data, evaluated):
    """The node tree that belongs to a data-block alone, and the same evaluated."""
    tree = getattr(data, "node_tree", None)
    return [(tree, evaluated.node_tree)] if tree else []


def _players(owner) -> list[tuple]:
    """What plays an action, and the strip that it is, or None."""
    animation = owner.animation_data
    if animation is None:
        return []
    return [(animation, None), *((strip, strip) for track in animation.nla_tracks for strip in track.strips)]


def _curves(action, slot):
    if action is None:
        return []
    if not getattr(action, "is_action_layered", False):  # from 4.4; from 5.0 there is no other
        return action.fcurves
    strips = [strip for layer in action.layers for strip in layer.strips if strip.type == "KEYFRAME"]
    bags = [strip.channelbag(slot) for strip in strips] if slot else []
    return [curve for bag in bags if bag for curve in bag.fcurves]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The curves by which keyframes move what a data-block has."""

from __future__ import annotations

from collections.abc import Iterator

import bpy


def curves_of(owner: bpy.types.ID) -> Iterator[tuple[bpy.types.FCurve, bpy.types.NlaStrip | None]]:
    """The curves of the action of a data-block and of its NLA strips, each with the strip, in whose time it is."""
    for player, strip in _players(owner):
        for curve in _curves(player.action, getattr(player, "action_slot", None)):
            yield curve, strip


def actions_of(owner: bpy.types.ID) -> list[bpy.types.Action]:
    """The actions that a data-block, or an NLA strip of it, plays."""
    return [player.action for player, _ in _players(owner) if player.action]


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

# SPDX-License-Identifier: GPL-3.0-or-later
"""The curves by which keyframes move what a data-block has."""

from __future__ import annotations

from collections.abc import Iterator

import bpy


def curves_of(owner: bpy.types.ID) -> Iterator[tuple[bpy.types.FCurve, bpy.types.NlaStrip | None]]:
    """The curves of the action of a data-block and of its NLA strips, each with the strip, in whose time it is."""
    animation = owner.animation_data
    if animation is None:
        return
    played = [(animation.action, getattr(animation, "action_slot", None), None)]
    for track in animation.nla_tracks:
        played += [(strip.action, getattr(strip, "action_slot", None), strip) for strip in track.strips]
    for action, slot, strip in played:
        for curve in _curves(action, slot):
            yield curve, strip


def _curves(action, slot):
    if action is None:
        return []
    if not getattr(action, "is_action_layered", False):  # from 4.4; from 5.0 there is no other
        return action.fcurves
    strips = [strip for layer in action.layers for strip in layer.strips if strip.type == "KEYFRAME"]
    bags = [strip.channelbag(slot) for strip in strips] if slot else []
    return [curve for bag in bags if bag for curve in bag.fcurves]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves and texts given a body, since a medium needs an inside: flat ones thickness, tubes ends; and as they were again."""

import json

import bpy

THICKNESS = 0.1  # of a flat text, in parts of the size of its letters; of a curve, in parts of a tenth of its length


def close(object_: bpy.types.Object) -> str:
    """Let a curve or text enclose a volume as far as its own settings can; returns what reopen() needs, "" for nothing.

    One whose data others share, or that is no curve or text, stays as it is.
    """
    data = object_.data
    if object_.type not in ("CURVE", "FONT") or data.users > 1 or data.library or data.override_library:
        return ""
    corners = list(zip(*object_.bound_box, strict=True))
    size = data.size if object_.type == "FONT" else max(max(axis) - min(axis) for axis in corners) / 10 or 0.1
    is_line = not (data.bevel_depth or data.extrude or data.bevel_object)
    if data.dimensions == "2D" and data.fill_mode != "NONE":
        wanted = {"fill_mode": "BOTH"} | ({"extrude": size * THICKNESS / 2} if is_line else {})
    elif data.extrude and not (data.bevel_depth or data.bevel_object):
        return ""  # a ribbon
    else:
        whole = {} if data.dimensions == "2D" else {"fill_mode": "FULL"}  # which one in a plane has anyway, unfilled
        wanted = whole | {"use_fill_caps": True} | ({"bevel_depth": size * THICKNESS} if is_line else {})
    changed = {}
    for name, value in wanted.items():
        former = getattr(data, name)
        if former != value:
            setattr(data, name, value)
            changed[name] = [former, getattr(data, name)]
    return json.dumps(changed) if changed else ""


def reopen(object_: bpy.types.Object, changed: str) -> None:
    """Give a curve or text back what close() changed, unless a person has changed it since."""
    for name, (former, given) in json.loads(changed or "{}").items():
        if getattr(object_.data, name) == given:
            setattr(object_.data, name, former)

# SPDX-License-Identifier: GPL-3.0-or-later
"""What a built scene remembers: what it was built of, and a mark of how it stood then, by which changes by hand are known."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any

import bpy
import numpy as np

from .. import caustics
from ..caustics.digest import LAMP_PROPERTIES
from ..cycles.nodes import uses_nodes
from ..scenes import stage as stages

BUILT = "nim_built"  # a custom property of the scene
# What Build sets of a scene itself; samples and size in percent follow the quality.
RENDER = ("engine", "resolution_x", "resolution_y")
VIEW = ("view_transform", "look", "exposure", "gamma")
OBJECT = ("matrix_basis", "hide_render", "hide_viewport", "pass_index", "color")
# And of what objects use, whichever has it: a lamp, a camera, a material, a sky.
DATA = (
    *LAMP_PROPERTIES,
    *(
        "lens",
        "sensor_fit",
        "sensor_width",
        "sensor_height",
        "shift_x",
        "shift_y",
        "clip_start",
        "clip_end",
        "ortho_scale",
    ),
    *("diffuse_color", "displacement_method", "volume_intersection_method", "pass_index"),
)


def remember(scene: bpy.types.Scene, of: Mapping[str, str]) -> None:
    """Note in a scene that was built just now what of, texts by what they are of, and how it stands."""
    scene[BUILT] = {"of": json.dumps(dict(of)), "mark": mark(scene, scene[stages.STAGE_MARK])}


def remembered(scene: bpy.types.Scene) -> dict[str, str]:
    """What a scene was built of; empty where that is not known."""
    return json.loads(scene[BUILT]["of"]) if BUILT in scene else {}


def by_hand(scene: bpy.types.Scene) -> bool:
    """Whether something of a built scene that Build would make anew is no longer as it was built, or may be."""
    return BUILT not in scene or scene[BUILT]["mark"] != mark(scene, scene[stages.STAGE_MARK])


def holds(scene: bpy.types.Scene) -> bool:
    """Whether Build would take away what a person has made: changes by hand, or caustics."""
    return caustics.left(scene) or by_hand(scene)


@contextlib.contextmanager
def ours(scene: bpy.types.Scene, **of: str) -> Iterator[None]:
    """What happens to a scene meanwhile is none of a person's changes; of: what it is built of from then on."""
    counts = BUILT in scene and not holds(scene)
    yield
    if counts:
        remember(scene, remembered(scene) | of)


def mark(scene: bpy.types.Scene, name: str) -> str:
    """A mark of how the stage of that name stands in its scene, another one if a person changes any of it."""
    own = sorted((obj for obj in scene.collection.all_objects if obj.get(stages.STAGE_MARK) == name), key=_name)
    lines: list[Any] = [[_values(scene.render, RENDER), _values(scene.view_settings, VIEW)]]
    data: dict[Any, None] = {}
    layer = scene.view_layers[0]
    for obj in own:
        worn = [slot.material for slot in obj.material_slots]
        data |= dict.fromkeys(one for one in (obj.data, *worn) if one)
        lines.append(
            [
                _values(obj, OBJECT),
                obj.name in layer.objects and obj.hide_get(view_layer=layer),
                [(one.name, one.type) for one in (*obj.modifiers, *obj.constraints)],
                [one and one.name for one in (obj.parent, obj.data, *worn)],
                obj.animation_data is not None,
            ]
        )
    if scene.world and scene.world.get(stages.STAGE_MARK) == name:
        data[scene.world] = None
    lines += [[_name(one), _of(one)] for one in data]
    return hashlib.sha256(repr(lines).encode()).hexdigest()


def _name(one):
    return one.name


def _of(data):
    """What there is to be seen of data that an object uses."""
    if isinstance(data, bpy.types.Mesh):
        if data.is_editmode:
            return "edited"  # by a person, just now
        places = np.empty(3 * len(data.vertices), np.float32)
        data.attributes["position"].data.foreach_get("vector", places)
        return len(data.polygons), hashlib.sha256(places.data).hexdigest()
    found = [_values(data, DATA)]
    if not isinstance(data, bpy.types.Camera) and uses_nodes(data):
        for node in data.node_tree.nodes:
            found.append([node.name, node.bl_idname, node.mute, node.type == "GROUP" and _name(node.node_tree)])
            found += [_plain(socket.default_value) for socket in node.inputs if hasattr(socket, "default_value")]
            if not len(node.inputs):
                found += [_plain(socket.default_value) for socket in node.outputs if hasattr(socket, "default_value")]
        found.append(len(data.node_tree.links))
    return found


def _values(owner, names):
    """The plain values of Blender's data by their names, None where it has none of such a name."""
    return [_plain(getattr(owner, name, None)) for name in names]


def _plain(value):
    if isinstance(value, (str, bool, int, float, type(None))):
        return value
    return [_plain(part) for part in value] if hasattr(value, "__len__") else str(value)

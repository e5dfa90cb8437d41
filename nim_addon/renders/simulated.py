# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulations of a scene of a .blend: what of them is beside the file or in it, and what has to be played to be there."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import bpy

from .used import used_by

FOLDER = "blendcache_{}"  # beside NAME.blend, by Blender
POINTS = "{name}_*_{index:02d}.bphys"  # the file of each frame in there


def folder_of(blend: Path) -> Path:
    """Where Blender keeps the simulations of a .blend that are baked to disk."""
    return blend.parent / FOLDER.format(blend.stem)


def files_of_caches(scene: bpy.types.Scene) -> list[str]:
    """The files of each simulation that is baked to disk, "/a/blendcache_b/506C_*_00.bphys"."""
    return [
        str(Path(bpy.path.abspath(cache.filepath)) / POINTS.format(name=cache.name, index=cache.index))
        for _, cache in _caches(scene)
        if cache.use_external and cache.name
    ]


def find_beside(scene: bpy.types.Scene, blend: Path) -> None:
    """Let a scene that was appended from a .blend have its simulations on disk, which Blender looks for beside the open file."""
    for owner, cache in _caches(scene):
        if cache.use_disk_cache and not cache.use_external and not owner.library:
            named = cache.name or owner.name.encode().hex().upper()
            cache.use_external = True
            cache.name, cache.filepath = named, str(folder_of(blend))


def bring(blend: Path, copy: Path) -> None:
    """Let a copy of a .blend find its simulations on disk beside itself: by a link, or where there are none, copied too."""
    held, wanted = folder_of(blend), folder_of(copy)
    if not held.is_dir() or wanted.exists():
        return
    try:
        wanted.symlink_to(held.resolve(), target_is_directory=True)
    except OSError:  # Windows has links for those it trusts
        shutil.copytree(held, wanted)


def played(scene: bpy.types.Scene) -> list[str]:
    """The names of what in a scene is where it is at a frame only if all frames before have been played."""
    names = [owner.name for owner, cache in _caches(scene) if not (cache.is_baked or cache.use_external)]
    for object_ in _objects(scene):
        groups = [getattr(modifier, "node_group", None) for modifier in object_.modifiers if modifier.show_render]
        if any(group and _simulates(group, set()) for group in groups):
            names.append(object_.name)
    return list(dict.fromkeys(names))


def play(scene: bpy.types.Scene, frame: int) -> None:
    """Play a scene from where its simulations begin to a frame."""
    starts = [cache.frame_start for _, cache in _caches(scene)]
    with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        bpy.context.evaluated_depsgraph_get()  # by which alone it is active: Blender simulates in no other
    for at in range(min([scene.frame_start, *starts]), frame + 1):
        scene.frame_set(at)


def _caches(scene) -> Iterator[tuple[bpy.types.ID, bpy.types.PointCache]]:
    """Each cache of points that is rendered, and whose it is."""
    world = scene.rigidbody_world
    if world and world.enabled and world.collection and any(_moves(object_) for object_ in world.collection.objects):
        yield scene, world.point_cache
    for object_ in _objects(scene):
        for modifier in object_.modifiers:
            if not modifier.show_render:
                continue
            if modifier.type in ("CLOTH", "SOFT_BODY"):
                yield object_, modifier.point_cache
            elif modifier.type == "PARTICLE_SYSTEM" and _particles_move(modifier.particle_system):
                yield object_, modifier.particle_system.point_cache
            elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings:
                for surface in modifier.canvas_settings.canvas_surfaces:
                    if surface.surface_format != "IMAGE":
                        yield object_, surface.point_cache


def _objects(scene):
    """All that it needs, those too that only an instance of their collection brings in, in the order of their names."""
    return sorted((one for one in used_by(scene) if isinstance(one, bpy.types.Object)), key=lambda one: one.name_full)


def _moves(object_):
    body = object_.rigid_body
    return body and body.type == "ACTIVE" and body.enabled and not body.kinematic


def _particles_move(system):
    settings = system.settings
    return system.use_hair_dynamics if settings.type == "HAIR" else settings.physics_type != "NO"


def _simulates(group, seen):
    """Whether a group of geometry nodes has a simulation zone, or one that it has in it."""
    if group in seen:
        return False
    seen.add(group)
    return any(
        node.bl_idname == "GeometryNodeSimulationOutput"
        or (getattr(node, "node_tree", None) and _simulates(node.node_tree, seen))
        for node in group.nodes
    )

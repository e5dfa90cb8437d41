# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage a scene is put on: a Blender scene and a collection of its own; nothing of the user's is touched."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import bpy
import mathutils
import numpy as np
from numpy.typing import ArrayLike

from .. import caustics
from ..cycles import settings
from ..cycles.material import resolve
from ..cycles.packed import remember
from .parameters import Parameters
from .shapes import Faces

STAGE_MARK = "nim_scene"  # the custom property of all that belongs to a stage: the name of its scene
SAMPLES = 128


class Pose(NamedTuple):
    """Where a camera stands and looks, z up: `field_of_view` in degrees across the side that `fit`, a sensor_fit, names."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field_of_view: float
    fit: str = "AUTO"


class Stage:
    """A Blender scene "NIM <name>" with one collection of that name, set up so that no light is lost.

    Where an earlier stage of that name left its scene in the file, that scene is cleared: of the stage's own objects
    and of whatever only they used, not of what a user put there. `size`: pixels of the picture, (width, height);
    `backend`: of the materials that come onto the stage, resolved in its attribute of that name.
    """

    def __init__(self, name: str, size: tuple[int, int], backend: str = "auto"):
        self.backend = resolve(backend)
        title = f"NIM {name}"
        self.name = name
        earlier = built(name)
        if earlier is None:
            self.scene = bpy.data.scenes.new(title)
            self.scene[STAGE_MARK] = name
        else:
            self.scene = earlier
            caustics.clear(earlier)
            _clear(earlier, name)
        self.collection = bpy.data.collections.new(title)
        self.collection[STAGE_MARK] = name
        self.scene.collection.children.link(self.collection)
        settings.lossless(self.scene, self.backend)
        self.scene.render.resolution_x, self.scene.render.resolution_y = size
        self.scene.render.resolution_percentage = 100
        self.scene.cycles.samples = SAMPLES
        self.scene.view_settings.view_transform = "AgX"
        self.scene.view_settings.exposure = 0.0

    def _place(self, name, data, location=(0, 0, 0)):
        object_ = bpy.data.objects.new(name, data)
        object_[STAGE_MARK] = self.name
        object_.location = location
        self.collection.objects.link(object_)
        return object_

    def mesh(
        self,
        name: str,
        vertices: ArrayLike,
        faces: Faces,
        materials: bpy.types.Material | Sequence[bpy.types.Material],
        *,
        slots: ArrayLike | None = None,
        smooth: bool = False,
        normals: ArrayLike | None = None,
        location: ArrayLike = (0, 0, 0),
    ) -> bpy.types.Object:
        """An object from arrays.

        vertices:  (N, 3) in metres; faces: tuples of vertex indices, counter-clockwise seen from outside
        materials: one material, or a list of them with `slots`, the index of each face's material
        smooth:    shade smooth; normals: (C, 3) unit normals, one a face corner, in the faces' order
        Returns the bpy.types.Object.
        """
        data = bpy.data.meshes.new(name)
        data.from_pydata(np.asarray(vertices).tolist(), [], faces)
        for material in [materials] if isinstance(materials, bpy.types.Material) else materials:
            data.materials.append(material)
        if slots is not None:
            data.polygons.foreach_set("material_index", np.asarray(slots, np.int32))
        if smooth or normals is not None:
            data.shade_smooth()
        data.update()
        if normals is not None:
            data.normals_split_custom_set(np.asarray(normals, float).tolist())
        return self._place(name, data, location)

    def object(self, name: str, data: bpy.types.ID, location: ArrayLike = (0, 0, 0)) -> bpy.types.Object:
        """An object around data made elsewhere (a light, a mesh); returns the bpy.types.Object."""
        return self._place(name, data, location)

    def camera(
        self, eye: Sequence[float], target: Sequence[float], field_of_view: float, fit: str = "AUTO"
    ) -> bpy.types.Object:
        """The scene's camera in that Pose; returns the bpy.types.Object."""
        data = bpy.data.cameras.new("Camera")
        data.clip_start, data.clip_end = 0.01, 1000.0
        camera = self._place("Camera", data)
        aim(camera, eye, target, field_of_view, fit)
        self.scene.camera = camera
        return camera

    def world(self, world: bpy.types.World, aim: int | None = None) -> None:
        """Light the scene with a bpy.types.World.

        aim: None for a smooth sky, which is found by chance more cheaply than by shadow rays, since an interface
             blocks those anyway; for one with a sun, the width in pixels of the map by which shadow rays find it
        """
        world[STAGE_MARK] = self.name
        self.scene.world = world
        world.cycles.sampling_method = "NONE" if aim is None else "MANUAL"
        world.cycles.sample_map_resolution = aim or 64


def staged(parameters_type: type[Parameters]) -> Callable:
    """Decorate a function build(parameters, backend) of a scene whose parameters are of that type.

    It raises TypeError, one sentence, for others, before anything is built, and leaves no new scene behind if it fails.
    """

    def decorated(build):
        @functools.wraps(build)
        def checked(parameters, backend="auto"):
            if not isinstance(parameters, parameters_type):
                name = parameters_type.__name__
                raise TypeError(f"{parameters!r} is no {name}; give {name}(), or {name}.read() of a list of settings.")
            before = set(bpy.data.scenes)
            try:
                return build(parameters, backend)
            except BaseException:
                for scene in set(bpy.data.scenes) - before:
                    if STAGE_MARK in scene:
                        _clear(scene, scene[STAGE_MARK])
                        bpy.data.scenes.remove(scene)
                raise

        return checked

    return decorated


def aim(
    camera: bpy.types.Object, eye: Sequence[float], target: Sequence[float], field_of_view: float, fit: str = "AUTO"
) -> None:
    """Put a camera (bpy.types.Object) into that Pose."""
    camera.data.sensor_fit = fit
    camera.data.angle = math.radians(field_of_view)
    camera.location = eye
    direction = mathutils.Vector(target) - mathutils.Vector(eye)
    camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()


def built(name: str) -> bpy.types.Scene | None:
    """The bpy.types.Scene that holds the stage of that name, or None."""
    return next((scene for scene in bpy.data.scenes if scene.get(STAGE_MARK) == name), None)


def _clear(scene, name):
    """Remove the stage's own objects, collections and world from its scene, and the data that only they used."""
    own = [object_ for object_ in scene.collection.all_objects if object_.get(STAGE_MARK) == name]
    collections = [
        collection for collection in scene.collection.children_recursive if collection.get(STAGE_MARK) == name
    ]
    for object_ in {object_ for collection in collections for object_ in collection.all_objects} - set(own):
        if object_.name not in scene.collection.objects:
            scene.collection.objects.link(object_)
    used = _used_by([*own, scene.world] if scene.world and scene.world.get(STAGE_MARK) == name else own)
    if scene.world in used:
        scene.world = None
    remember()
    bpy.data.batch_remove([*own, *collections])
    # users first: a mesh before its material, a material before its node group, a group before its text
    while free := [data for data in used if data.users == 0]:
        bpy.data.batch_remove(free)
        used = [data for data in used if _alive(data)]


def _used_by(roots):
    """All data that `roots` use, and the roots themselves save objects, found through Blender's own map of users."""
    users = bpy.data.user_map()
    found, front = set(), set(roots)
    while front:
        found |= front
        front = {data for data, using in users.items() if using & front} - found
    kept = (bpy.types.Object, bpy.types.Scene, bpy.types.Collection)
    return [data for data in found if not isinstance(data, kept)]


def _alive(data):
    try:
        return bool(data.name)
    except ReferenceError:
        return False

# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as cameras: each sends out photons as a Cycles camera sends out rays, over all of its size and directions.

What a lamp's watts mean is what Cycles takes them for: P / (4 pi) into each steradian from a point or spot, cos / pi of P
from a flat lamp, however large, and watts per square metre from a sun. Points and spots are spheres here, as Cycles has
them without Soft Falloff; with it they are (radius / distance)^2 darker, close by.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import bpy
import mathutils
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cycles import spectral
from ..cycles.nodes import uses_nodes
from ..cycles.visibility import is_instance_rendered, is_rendered, rendered

TURNS = 60  # ways to turn the frame about the light's direction, of which the tightest is taken
SUN_PROPERTY = "nim_sun"  # of a bpy.types.World: direction, irradiance and angle of the Gaussian sun in its sky
SUN_HIDDEN = "NIM Sun hidden"  # its Value node: 1 hides that sun from paths that were scattered
ALL_DIRECTIONS = (-math.pi, math.pi, -math.pi / 2, math.pi / 2)  # a Shot's window


class Shot(NamedTuple):
    """One picture from the light.

    frame:  mathutils.Matrix of the camera
    width:  metres across the wider side of a view of parallel rays; None for one of all directions from a place
    window: for the latter its longitudes and latitudes, radians: lowest and highest of both
    lens, focus: radius of the lens and distance of what it keeps sharp, metres
    size:   pixels (width, height)
    power:  (3,) or (height, width, 3), W where the light is in watts: of each pixel, all its rays together
    """

    frame: mathutils.Matrix
    width: float | None
    window: tuple[float, ...] | None
    lens: float
    focus: float
    size: tuple[int, int]
    power: NDArray


class Target(NamedTuple):
    """What the light is sent at, in the world, metres.

    bent: (N, 3) points on the boxes around what bends or mirrors light; corners: (M, 3) those on the boxes around all
    """

    bent: NDArray
    corners: NDArray


class Sun(NamedTuple):
    """Light from far away.

    direction:  (3,) that it travels in, of any length
    irradiance: (3,) on a plane across its rays, W/m^2 or any unit
    angle:      across its disk, radians
    gaussian:   whether it is a Gaussian of that width, from 1/e to 1/e, rather than a disk
    """

    direction: tuple[float, ...]
    irradiance: tuple[float, ...]
    angle: float
    gaussian: bool = False

    def half_angles(self, count: int, random: np.random.Generator) -> NDArray:
        """(count,) half-angles, radians, of the uniform disks that together are this sun."""
        if not self.gaussian:
            return np.full(count, self.angle / 2)
        # a Gaussian is a mixture of disks whose radius^2 is a sum of two exponential numbers
        strata = (np.arange(count) + random.random(count)) / count
        return self.angle / 2 * np.sqrt(_gamma2(random.permutation(strata)))

    def shots(self, target: Target, photons: int, passes: int, random: np.random.Generator) -> Iterator[Shot]:
        """A Shot of about so many photons for each of the passes: parallel rays at the target.

        The lens is as wide as the sun's disk is at the target.
        """
        halves = self.half_angles(passes, random)
        back = -np.asarray(self.direction, float) / np.linalg.norm(self.direction)
        axes, low, high = _tightest(target.bent, back)
        # behind all that could throw a shadow
        distance = float((target.corners @ back).max() - (low + high)[2] / 2) + 1.0
        # a ray that tilts meets the focal plane elsewhere than the interface
        reach = np.maximum((high - low)[:2] + (high - low)[2] * math.tan(float(halves.max())), 1e-6) * 1.001
        size, extent = _pixels(reach, photons)
        frame = mathutils.Matrix(axes.T.tolist()).to_4x4()
        frame.translation = mathutils.Vector(((low + high) / 2) @ axes + distance * back)
        power = np.multiply(self.irradiance, np.prod(extent / size))
        for half in halves:
            lens = distance * math.tan(half)
            yield Shot(frame, float(extent.max()), None, lens, distance, tuple(size), power)


class Lamp(NamedTuple):
    """A point or spot lamp.

    place:     (3,) in the world, metres
    intensity: (3,) W/sr, of a spot along its axis
    radius:    of its sphere, metres
    axis:      (3,) that a spot shines along, of any length; None for a point
    edge:      cosine of a spot's half-angle
    blend:     share of a spot's cone, 0 to 1, that is softened
    """

    place: tuple[float, ...]
    intensity: tuple[float, ...]
    radius: float = 0.0
    axis: tuple[float, ...] | None = None
    edge: float = -1.0
    blend: float = 0.0

    def shots(self, target: Target, photons: int, passes: int, random: np.random.Generator) -> Iterator[Shot]:
        """A Shot of about so many photons for each of the passes: all directions to the target, from a disk across each."""
        frame, window, size, solid = _outlook(self.place, target, self.radius, photons)
        power = solid[..., None] * np.asarray(self.intensity)
        if self.axis is not None:
            power = power * self._falloff(self.axis, _directions(window, size) @ np.array(frame.to_3x3()).T)[..., None]
        for _ in range(passes):
            # so far that a sphere's light is parallel from all of its disk
            yield Shot(frame, None, window, self.radius, 1e6 * max(1.0, self.radius), size, power)

    def _falloff(self, axis, directions):
        """How much of the intensity a spot has in directions (..., 3), unit: spot_light_attenuation() of Cycles."""
        cosine = directions @ (np.asarray(axis) / np.linalg.norm(axis))
        x = np.clip((cosine - self.edge) / max((1 - self.edge) * self.blend, 1e-9), 0, 1)
        return x * x * (3 - 2 * x)


class Area(NamedTuple):
    """A flat lamp.

    frame:     (4, 4) where it stands, without a scale; it shines along -z
    size:      (2,) along x and y, metres
    round:     whether it is an ellipse, rather than a rectangle
    intensity: (3,) W/sr along its axis; beside that it falls with the cosine, as Lambert has it
    """

    frame: tuple
    size: tuple[float, float]
    round: bool
    intensity: tuple[float, ...]

    @property
    def place(self) -> tuple[float, ...]:
        """Its middle (3,)."""
        return tuple(np.asarray(self.frame)[:3, 3])

    def shots(self, target: Target, photons: int, passes: int, random: np.random.Generator) -> Iterator[Shot]:
        """A Shot of about so many photons for each of the passes, each from another point of the lamp."""
        matrix = np.asarray(self.frame, float)
        axis = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        for u, v in _even(passes, random):
            if self.round:
                radius, angle = math.sqrt(u) / 2, 2 * math.pi * v
                x, y = radius * math.cos(angle), radius * math.sin(angle)
            else:
                x, y = u - 0.5, v - 0.5
            place = matrix[:3, 3] + matrix[:3, 0] * x * self.size[0] + matrix[:3, 1] * y * self.size[1]
            frame, window, size, solid = _outlook(place, target, 0.0, photons)
            cosine = np.maximum(_directions(window, size) @ np.array(frame.to_3x3()).T @ axis, 0)
            power = (solid * cosine)[..., None] * np.asarray(self.intensity)
            yield Shot(frame, None, window, 0.0, 1e6, size, power)


Light = Sun | Lamp | Area


def light_of(lamp: bpy.types.Object, matrix: mathutils.Matrix | None = None) -> Light:
    """What an object of type LIGHT is as a Light; matrix: where it stands, None for where it does itself.

    Raises ValueError, one sentence, for what is not traced.
    """
    data, matrix = lamp.data, matrix or lamp.matrix_world
    strength = np.array(data.color) * data.energy * 2.0 ** getattr(data, "exposure", 0.0)
    if getattr(data, "use_temperature", False):
        strength = strength * np.array(data.temperature_color)
    strength = strength * emitted(lamp)
    if not getattr(data, "normalize", True):
        raise ValueError(f"the lamp {lamp.name} is not normalized, and such are not traced; switch its Normalize on.")
    axis = (-(matrix.to_3x3() @ mathutils.Vector((0, 0, 1))).normalized()).to_tuple()
    place = matrix.translation.to_tuple()
    if data.type == "SUN":
        return Sun(axis, tuple(strength), data.angle)
    if data.type == "AREA":
        if data.spread < math.radians(179.9):
            raise ValueError(
                f"the lamp {lamp.name} is narrowed, and such are not traced; set its Spread to 180 degrees."
            )
        scale = matrix.to_scale()
        square = data.shape in ("SQUARE", "DISK")
        size = data.size * scale.x, (data.size if square else data.size_y) * scale.y
        if 0 in size:
            raise ValueError(f"the lamp {lamp.name} has no area; give it a size.")
        rigid = mathutils.Matrix.LocRotScale(matrix.translation, matrix.to_quaternion(), None)
        return Area(
            tuple(map(tuple, np.array(rigid).tolist())),
            size,
            data.shape in ("DISK", "ELLIPSE"),
            tuple(strength / math.pi),
        )
    intensity, radius = tuple(strength / (4 * math.pi)), data.shadow_soft_size
    if data.type == "SPOT":
        return Lamp(place, intensity, radius, axis, math.cos(data.spot_size / 2), data.spot_blend)
    return Lamp(place, intensity, radius)


def sun_of(scene: bpy.types.Scene) -> Sun | None:
    """The Sun in the sky of a scene, as scenes.surfaces.sky() makes it, or None."""
    values = scene.world and scene.world.get(SUN_PROPERTY)
    return Sun(tuple(values[:3]), tuple(values[3:6]), values[6], gaussian=True) if values else None


def lamps_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that shine in a render of `scene` without baked caustics, by themselves or in instances of collections.

    In the order in which they are traced: suns first, then spots, points and areas. It evaluates nothing; see placed().
    """
    found, queue, seen = [], rendered(scene), set()
    while queue:
        obj = queue.pop()
        held = obj.instance_collection if obj.instance_type == "COLLECTION" else None
        if held and held not in seen:
            seen.add(held)
            queue += [inner for inner in held.all_objects if is_rendered(inner)]
        if _shines(obj) and obj not in found:
            found.append(obj)
    return sorted(found, key=_rank)


class Placed(NamedTuple):
    """A lamp of the file where it stands, or where an instance of it does.

    lamp: the object; matrix: of the place; single: whether it is that object itself, not an instance of it
    """

    lamp: bpy.types.Object
    matrix: mathutils.Matrix
    single: bool


def placed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> list[Placed]:
    """The lamps of lamps_of(), and each instance of a lamp that a render shows; depsgraph: visibility.as_rendered()'s."""
    alone = set(rendered(scene))
    found = []
    for instance in depsgraph.object_instances:
        lamp: Any = instance.object.original
        single = not instance.is_instance
        there = (
            lamp in alone if single else is_instance_rendered(lamp, instance.parent and instance.parent.original, alone)
        )
        if there and _shines(lamp):
            found.append(Placed(lamp, instance.matrix_world.copy(), single))
    return sorted(found, key=lambda place: (_rank(place.lamp), not place.single))


def _shines(obj):
    if obj.type != "LIGHT" or (obj.data.type == "AREA" and obj.data.cycles.is_portal):
        return False
    return obj.data.energy > 0 and any(obj.data.color)


def _rank(lamp):
    return ("SUN", "SPOT", "POINT", "AREA").index(lamp.data.type), lamp.name


def check(lamp: bpy.types.Object) -> None:
    """Raise ValueError, one sentence, for a lamp some of whose light would be counted twice, or wrongly, by a bake."""
    data, name = lamp.data, f"the lamp {lamp.name}"
    if lamp.library or data.library:
        raise ValueError(f"{name} is linked from a library, and a bake has to change it; make it local.")
    if lamp.override_library or data.override_library:
        raise ValueError(f"{name} is an override of a library, which does not save what a bake changes; make it local.")
    if not data.use_shadow:
        raise ValueError(
            f"{name} throws no shadows, so that it shines through interfaces, and a bake would count that light twice; "
            "switch its Shadow on."
        )
    if lamp.light_linking.blocker_collection:
        raise ValueError(
            f"{name} has Shadow Linking, by which it may shine through interfaces, and a bake would count that light twice; "
            "clear its Shadow Linking."
        )
    if data.cycles.is_caustics_light:
        raise ValueError(
            f"{name} has Shadow Caustics, which are caustics as well, and would be counted twice; switch them off."
        )
    hidden = [ray for ray in ("diffuse", "glossy", "transmission") if not getattr(lamp, f"visible_{ray}")]
    if hidden:
        raise ValueError(
            f"{name} is not there for {' and '.join(hidden)} rays, and is traced for all; switch its Ray Visibility on."
        )


def leaves_out(lamp: bpy.types.Object, objects: Iterable[bpy.types.Object]) -> set[bpy.types.Object]:
    """Those of some objects that a lamp does not shine on, by its light linking."""
    linked = lamp.light_linking.receiver_collection
    if linked is None:
        return set()
    only, never = set(), set()
    states = [({obj}, state) for obj, state in zip(linked.objects, linked.collection_objects, strict=True)]
    states += [
        (set(child.all_objects), state)
        for child, state in zip(linked.children, linked.collection_children, strict=True)
    ]
    for some, state in states:
        (only if state.light_linking.link_state == "INCLUDE" else never).update(some)
    return {obj for obj in objects if obj in never or (only and obj not in only)}


def emitted(lamp: bpy.types.Object) -> NDArray:
    """Colour times strength (3,) of a lamp's own Emission node, 1 where it has none.

    Raises ValueError, one sentence, where more than that decides its light.
    """
    data: Any = lamp.data
    if not uses_nodes(data):
        return np.ones(3)
    nodes = [node for node in data.node_tree.nodes if node.type not in ("OUTPUT_LIGHT", "FRAME", "REROUTE")]
    nodes = [node for node in nodes if not spectral.is_weight(node)]
    if len(nodes) == 1 and nodes[0].type == "EMISSION":
        colour, strength = spectral.weighted(nodes[0].inputs["Color"]), nodes[0].inputs["Strength"]
        if not (colour.is_linked or strength.is_linked):
            return np.array(colour.default_value[:3]) * strength.default_value
    raise ValueError(
        f"the light of {lamp.name} comes from its own nodes, and such is not traced; switch its nodes off."
    )


def _gamma2(q):
    """Quantile q of the sum of two exponential numbers, 1 - (1 + x) e^-x = q, by Newton's method."""
    x = np.sqrt(2 * q) + q
    for _ in range(40):
        x = np.maximum(x - (1 - (1 + x) * np.exp(-x) - q) / np.maximum(x * np.exp(-x), 1e-12), 1e-9)
    return x


def _even(count, random):
    """`count` points (count, 2) of the unit square, evenly spread (the R2 sequence, shifted at random)."""
    ratio = 1.32471795724474602596  # x^3 = x + 1
    return (random.random(2) + np.arange(1, count + 1)[:, None] / np.array([ratio, ratio**2])) % 1.0


def _tightest(points, back):
    """Axes (3, 3), the last of them `back`, along which `points` fill the smallest rectangle, and its bounds."""
    side = np.cross((0, 0, 1) if abs(back[2]) < 0.9 else (0, 1, 0), back)
    side /= np.linalg.norm(side)
    other = np.cross(back, side)
    best = None
    for turn in np.linspace(0, math.pi / 2, TURNS, endpoint=False):
        x = math.cos(turn) * side + math.sin(turn) * other
        axes = np.stack([x, np.cross(back, x), back])
        flat = points @ axes.T
        low, high = flat.min(axis=0), flat.max(axis=0)
        area = np.prod((high - low)[:2])
        if best is None or area < best[0] * (1 - 1e-9):
            best = area, axes, low, high
    return best[1:]


def _pixels(reach, photons):
    """Pixels (width, height), about `photons` in all, for a view of `reach` (2,), and what they span: no less than it."""
    size = np.maximum(np.round(np.sqrt(photons * reach / reach[::-1])), 4).astype(int)
    return size, size * float((reach / size).max())  # pixels are square


def _outlook(place, target, radius, photons):
    """The view of the target from a place: frame, window, size in pixels, and the solid angle (height, width) of each."""
    away = target.bent - np.asarray(place)
    distance = np.linalg.norm(away, axis=1)
    middle = (target.bent.min(axis=0) + target.bent.max(axis=0)) / 2 - np.asarray(place)
    frame = mathutils.Vector(middle).to_track_quat("-Z", "Y").to_matrix()
    x, y, z = (away @ np.array(frame)).T
    longitude, latitude = np.arctan2(x, -z), np.arcsin(y / np.maximum(distance, 1e-9))
    margin = radius / max(distance.min(), 1e-9) + 0.02
    window = (
        longitude.min() - margin / math.cos(min(np.abs(latitude).max(), 1.4)),
        longitude.max() + margin / math.cos(min(np.abs(latitude).max(), 1.4)),
        latitude.min() - margin,
        latitude.max() + margin,
    )
    if max(map(abs, window[:2])) > 2.0 or max(map(abs, window[2:])) > 1.3 or distance.min() < 2 * radius:
        window = ALL_DIRECTIONS
    window = tuple(float(edge) for edge in window)
    frame = frame.to_4x4()
    frame.translation = place
    span = np.array([window[1] - window[0], window[3] - window[2]])
    size = tuple(np.maximum(np.round(np.sqrt(photons * span / span[::-1])), 4).astype(int).tolist())
    edges = np.sin(np.linspace(window[2], window[3], size[1] + 1))
    solid = np.repeat(np.diff(edges)[:, None] * (span[0] / size[0]), size[0], axis=1)
    return frame, window, size, solid


def _directions(window, size):
    """Unit vectors (height, width, 3), in the camera's frame, of the middles of pixels; the first row is the lowest."""
    longitude = window[0] + (np.arange(size[0]) + 0.5) / size[0] * (window[1] - window[0])
    latitude = window[2] + (np.arange(size[1]) + 0.5) / size[1] * (window[3] - window[2])
    cosine = np.cos(latitude)[:, None]
    return np.stack(
        [
            cosine * np.sin(longitude),
            np.broadcast_to(np.sin(latitude)[:, None], (size[1], size[0])),
            -cosine * np.cos(longitude),
        ],
        axis=-1,
    )


def aim(camera: bpy.types.Object, scene: bpy.types.Scene, shot: Shot, corners: ArrayLike) -> None:
    """Set a camera, and the size of its scene, to take a Shot that reaches as far as `corners` (N, 3), those of all."""
    data, render = camera.data, scene.render
    reach = float(np.linalg.norm(corners - np.array(shot.frame.translation), axis=1).max())
    data.clip_start, data.clip_end = 1e-6, 2 * reach + shot.lens + 1.0
    render.resolution_x, render.resolution_y = (int(edge) for edge in shot.size)
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    if shot.window is None:
        data.type, data.ortho_scale, data.sensor_fit = "ORTHO", shot.width, "AUTO"
        focal_length = 1.0
    else:
        data.type = "PANO"
        panorama = data if hasattr(data, "panorama_type") else data.cycles
        panorama.panorama_type = "EQUIRECTANGULAR"
        panorama.longitude_min, panorama.longitude_max, panorama.latitude_min, panorama.latitude_max = shot.window
        focal_length = data.lens * 1e-3
    data.dof.use_dof = shot.lens > 0
    data.dof.focus_distance = shot.focus
    data.dof.aperture_fstop = focal_length / max(2 * shot.lens, 1e-9)
    camera.matrix_world = shot.frame

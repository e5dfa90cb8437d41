# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons: Cycles renders from the light, with the same optics, and every pixel says where its photon landed.

A camera stands where the light is (lights.Shot). Every surface that light lands on shines with the place that was hit,
and only if the path met an interface or a mirror before: light that reaches a surface straight is the path tracer's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from ..base.text import listed
from ..cycles import drift, meshes, settings, spectral
from ..cycles.casting import Faces
from ..cycles.closures import SHUTTER
from ..cycles.closures.backends import osl_available
from ..cycles.dispersive import is_medium_node
from ..cycles.nodes import Nodes, empty_tree
from ..cycles.object_values import give, values_of
from ..cycles.render import pixels_of
from ..cycles.visibility import CAUSTICS_MARK, as_rendered, rendered
from ..physics import REPRESENTATIVE_NM
from ..physics.colour import Wavelengths
from . import atlas, landing, lights
from .atlas import Chart, Part
from .bending import Bending, share_of
from .counting import POWER, WHITE, switch

PLACE_ATTRIBUTE = "nim_place"  # of the corners of the meshes that light lands on: Tracer._mark()
# The collections of bpy.data of what a Tracer makes.
DATA = ("objects", "meshes", "materials", "worlds", "cameras", "scenes", "node_groups")
# Photons whose passes are sent together: to change a material takes as long as some 1e5 of them.
TOGETHER = 1 << 18
BOX_SAMPLES = 5  # points along an edge of a box that light is sent at


class Landed:
    """Photons that met an interface or a mirror, and landed.

    side:  (N,) twice the number of the chart, and 1 more where they landed on the back of its faces
    place: (N, 2) in the chart, metres
    power: (N, 3) W, where the light is in watts
    share: (N,) what part of a photon's power Cycles makes of it (Tracer)
    nm:    (N,) wavelength, nanometres; the neutral one where the scene is not spectral
    """

    def __init__(self, side: NDArray, place: NDArray, power: NDArray, share: NDArray, nm: NDArray):
        self.side, self.place, self.power, self.share, self.nm = side, place, power, share, nm

    @property
    def chart(self) -> NDArray:
        """(N,) number of the chart."""
        return self.side // 2

    def only(self, here: NDArray) -> Landed:
        """Those for which `here` (N,) is true."""
        return Landed(self.side[here], self.place[here], self.power[here], self.share[here], self.nm[here])


class Tracer:
    """A scene made ready for photons, which trace() sends. Use it with `with`: what it makes is taken away at the end.

    source:  the scene; nothing of it is changed
    charts:  where light lands, by their numbers; parts: the meshes that these are of
    benders: the objects that bend or mirror light; surfaces: what stands for their meshes and instances
    target:  what light is sent at
    bending: the materials that the photons meet
    wavelengths: how photons have theirs, in a scene that is spectral; else None, and all have the neutral one

    Raises ValueError, one sentence, for a scene without an interface or a mirror, without a surface for the light to land
    on, or with one that has no area.

    Cycles takes radiance as the same on both sides of an interface, where really it grows by (n_t / n_i)^2. Where eye and
    light are in one medium this cancels over a whole path, of which the photons are only a part: `share` of a photon
    that landed within a medium is (n / n_t)^2 for the medium's n_t and the light's n.
    """

    def __init__(self, scene: bpy.types.Scene):
        self.source = scene
        self.charts: list[Chart] = []
        self.parts: list[Part] = []
        self.benders: set[bpy.types.Object] = set()
        self.surfaces: list[bpy.types.Object] = []

    def __enter__(self) -> Tracer:
        before = {name: set(getattr(bpy.data, name)) for name in DATA}
        try:
            self._build()
        except BaseException:
            bpy.data.batch_remove(_since(before))
            raise
        self._made = _since(before)
        return self

    def __exit__(self, *_) -> None:
        bpy.data.batch_remove(self._made)

    def _build(self):
        _check(self.source)
        self.scene = self._empty_scene()
        self.bending = Bending()
        self.wavelengths = Wavelengths.by_importance() if spectral.is_spectral(self.source) else None
        self._shine = self._shining()
        bent, corners = [], []
        with as_rendered(self.source) as depsgraph:
            can_shine = landing.replaceable(depsgraph)
            for surface in landing.met(self.source, depsgraph):
                if meshes.placeless(surface.mesh).any():
                    raise ValueError(
                        f"{surface.original.name} has vertices whose coordinates are no finite numbers; remove them, by Mend "
                        "All, or hide it from renders."
                    )
                copy, bends, box = self._add(surface, depsgraph, can_shine(surface))
                if copy is None:
                    continue
                corners.append(box)
                if bends:
                    bent.append(box)
                    self.surfaces.append(copy)
        if not bent:
            raise ValueError(
                "the scene has no interface or mirror; give a mesh the material of a NIM (Make Negative-Index)."
            )
        if not self.charts:
            seen = set(rendered(self.source))
            own = [obj for obj in self.source.objects if obj.type == "MESH" and not obj.get(CAUSTICS_MARK)]
            if hidden := listed(obj.name for obj in own if obj not in seen):
                raise ValueError(
                    f"the scene has no diffuse surface for light to land on (hidden from renders: {hidden}); show one in "
                    "renders, by the camera in the Outliner, or add a ground or a floor."
                )
            raise ValueError(
                "the scene has no diffuse surface of its own for light to land on; add a ground or a floor (one that is "
                "instanced, linked or overridden, in another scene too, or shown and hidden by keyframes does not count)."
            )
        if any(is_medium_node(node) for tree in self.bending.trees for node in tree.nodes):
            # a medium that disperses asks OSL for the wavelength, the neutral one too
            self.scene.cycles.shading_system = osl_available()
        if self.wavelengths and drift.drifts(self.source):
            drift.let_drift(self.scene, self.scene.objects)
        self.target = lights.Target(np.concatenate(bent), np.concatenate(corners))
        self.camera = bpy.data.objects.new("NIM photons", bpy.data.cameras.new("NIM photons"))
        self.scene.collection.objects.link(self.camera)
        self.scene.camera = self.camera

    def _empty_scene(self):
        """A new scene that renders photons, in the dark."""
        scene = bpy.data.scenes.new("NIM photons")
        settings.lossless(scene, "nodes")
        # no path ends by chance
        scene.cycles.min_light_bounces = scene.cycles.min_transparent_bounces = settings.BOUNCES
        scene.cycles.diffuse_bounces = 0  # scattered light is the path tracer's
        scene.cycles.pixel_filter_type = "BOX"
        scene.cycles.filter_width = 1.0
        scene.cycles.use_light_tree = False
        scene.render.use_persistent_data = True
        if spectral.is_spectral(self.source):
            spectral.open_shutter(scene)
            scene.cycles.shading_system = osl_available()
        scene.world = bpy.data.worlds.new("NIM photons")
        scene.world.color = (0, 0, 0)
        empty_tree(scene.world)
        return scene

    def _add(self, surface, depsgraph, lit):
        """Put a copy of what is Shown into the scene, which, if `lit`, light can land on.

        Returns it, or None for one without faces, whether it bends light, and its _box().
        """
        matrix = surface.matrix.copy()  # which can be decomposed, as a frozen one cannot
        if not surface.single and surface.parent == surface.original:  # an instance of a mesh that belongs to no object
            mesh = surface.mesh.copy()
        else:
            # all layers of the mesh that a surface or a text becomes: Blender 4.2 falls over them
            layers = surface.original.type == "MESH"
            mesh = bpy.data.meshes.new_from_object(surface.object, preserve_all_data_layers=layers, depsgraph=depsgraph)
        if not mesh.polygons:
            return None, False, None
        if not _is_plain(matrix):
            # an object of its own cannot be sheared, as one with a parent can
            mesh.transform(matrix)
            if matrix.determinant() < 0:
                mesh.flip_normals()
            matrix = mathutils.Matrix.Identity(4)
        effects = [self.bending.of(material, surface.original.name) for material in surface.materials]
        bends = any(effect.bends for effect in effects)
        if bends:
            self.benders.add(surface.original)
            _check_shadow(surface)
        values = values_of(surface, self.source, set().union(*(effect.reads for effect in effects)))
        # what cannot be given a light of its own only throws a shadow
        lands = [effect.lands and lit for effect in effects]
        if any(lands):
            self._mark(mesh, matrix, lands, surface, values)
        plain = [self._shine if land else self.bending.dark for land in lands]
        set_materials(mesh, [effect.copy or other for effect, other in zip(effects, plain, strict=True)])
        copy = bpy.data.objects.new("NIM photons", mesh)
        copy.matrix_world = matrix
        give(copy, values, surface.original)
        self.scene.collection.objects.link(copy)
        return copy, bends, _box(mesh, matrix)

    def _mark(self, mesh, matrix, lands, surface, values):
        """Give each corner of the faces that light lands on its place in a chart: (1 to 2, 1 to 2, 4 (chart + 1)).

        lands: for each material, whether light does; values: object_values.values_of() the surface, a Shown
        """
        name, vertices = surface.original.name, meshes.vertices(mesh, matrix)
        normals = meshes.read(mesh.polygons, "normal", 3) @ np.linalg.inv(np.array(matrix)[:3, :3])
        corners, starts = meshes.corners(mesh), meshes.starts(mesh)
        number, axes = atlas.charts_of(meshes.faces(corners, starts), normals)
        slot = meshes.slots(mesh, len(lands))
        face = np.repeat(np.arange(len(slot)), np.diff(starts))
        at = vertices[corners]
        places = np.zeros((len(face), 3), np.float32)
        chart_of = np.full(len(face), -1)
        here = np.asarray(lands)[slot[face]]
        if not meshes.read(mesh.polygons, "area").any():
            raise ValueError(f"{name} has no area for light to land on; scale it up, or hide it from renders.")
        order = np.argsort(number[face], kind="stable")
        bounds = np.searchsorted(number[face][order], np.arange(len(axes) + 1))
        for chart, axis in enumerate(axes):
            mine = order[bounds[chart] : bounds[chart + 1]]
            mine = mine[here[mine]]
            if len(mine):
                flat = np.delete(at[mine], axis // 2, axis=1)
                low, high = flat.min(axis=0), flat.max(axis=0)
                self.charts.append(Chart(name, int(axis), low, high))
                places[mine, :2] = 1 + (flat - low) / np.maximum(high - low, 1e-9)
                places[mine, 2] = 4 * len(self.charts)
                chart_of[mine] = len(self.charts) - 1
        layer = mesh.attributes.new(PLACE_ATTRIBUTE, "FLOAT_VECTOR", "CORNER")
        layer.data.foreach_set("vector", places.ravel())
        self.parts.append(Part(name, mesh, matrix, list(surface.materials), at, chart_of, values))

    def _shining(self):
        """A material that emits the corner attribute where the path met an interface or a mirror; in blue 2 more on the
        back of a face, 1 more where the path crossed interfaces an odd number of times, and a part of 0.5 more that is
        the path's share of the shutter, by which it has its wavelength."""
        material = bpy.data.materials.new("NIM place")
        nodes = Nodes(empty_tree(material))
        path = nodes.add("ShaderNodeLightPath").outputs
        # a bend backwards counts as transparent, any other as a transmission, a reflection as neither
        crossed = nodes.math("ADD", path["Transparent Depth"], path["Transmission Depth"])
        met = nodes.math("MINIMUM", nodes.math("ADD", path["Ray Depth"], path["Transparent Depth"]), 1.0)
        back = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
        more = nodes.math("MULTIPLY_ADD", back, 2.0, nodes.math("FLOORED_MODULO", crossed, 2.0))
        if self.wavelengths:
            shutter = SHUTTER.new_node(nodes.tree, "osl" if osl_available() else "nodes")
            more = nodes.math("MULTIPLY_ADD", shutter.outputs["Share"], 0.5, more)
        place = nodes.add("ShaderNodeAttribute", attribute_name=PLACE_ATTRIBUTE).outputs["Vector"]
        place = nodes.vector("ADD", place, nodes.add("ShaderNodeCombineXYZ", inputs={2: more}).outputs[0])
        color = nodes.mix(switch(nodes, "white"), place, WHITE)
        nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": color, "Strength": met}))
        material.cycles.emission_sampling = "NONE"
        self.bending.trees.append(nodes.tree)
        return material

    def check_outside(self, name: str, place: Sequence[float]) -> None:
        """Raise ValueError, one sentence, for a lamp of that name, at that place (3,), that stands within a medium.

        Its light would be counted as from outside.
        """
        backs = total = 0
        for surface in self.surfaces:
            mesh: Any = surface.data
            vertices = meshes.vertices(mesh, surface.matrix_world)
            outwards = 1 if surface.matrix_world.determinant() > 0 else -1  # what is mirrored is wound the other way
            corners, starts = meshes.corners(mesh), meshes.starts(mesh)
            faces = Faces(vertices, [face[::outwards] for face in meshes.faces(corners, starts)])
            # at the middles of faces: a vertex may be missed by a rounding
            middles = np.add.reduceat(vertices[corners], starts[:-1]) / np.diff(starts)[:, None]
            ways = middles[:: max(1, len(middles) // 64)] - np.asarray(place)
            ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-30)
            distance, normals = faces.meet(np.broadcast_to(place, ways.shape), ways)
            backs += (np.sum(normals * ways, axis=1) > 0).sum()
            total += np.isfinite(distance).sum()
        if backs > total / 2:
            raise ValueError(
                f"the lamp {name} stands within a medium, and light is traced from outside only; move it out."
            )

    def trace(
        self, light: lights.Light, photons: int, passes: int = 1, *, seed: int = 0, first: int = 0
    ) -> Iterator[Landed]:
        """Send about so many photons of a light in each of the passes; yields a Landed each.

        The passes are shares of one light: what lands in each of them, all its power, is to be divided by their number.
        first: passes to leave out, as those that were traced before
        """
        random = np.random.default_rng(seed)
        shots = islice(enumerate(light.shots(self.target, photons, passes, random)), first, None)
        while some := list(islice(shots, max(1, TOGETHER // photons))):
            yield from self._sent(some, passes, seed)

    def _sent(self, shots, passes, seed):
        """A Landed of each of some shots (number, lights.Shot), of which all have one kind of picture before the next."""

        def pictures(**switches):
            self.bending.set(**{"white": 0.0, "tinted": 0.0, "counted": 0.0} | switches)
            found = []
            for index, shot in shots:
                lights.aim(self.camera, self.scene, shot, self.target.corners)
                # the first sample of a pixel sits at its centre, whatever the seed: it is left out
                settings.one_sample(self.scene, index + 1, passes + 1)
                found.append(pixels_of(self.scene))
            return found

        self.scene.cycles.seed = seed
        shares = self.bending.shares
        # of the only interface there is, from outside of which all photons come
        (crossing,) = shares if len(shares) == 1 else (None,)
        nothing = [None] * len(shots)
        places = pictures()
        tints = pictures(white=1.0, tinted=1.0) if self.bending.tinted else nothing
        counts = pictures(white=1.0, counted=1.0) if crossing is None else nothing
        for (_, shot), pixels, tint, counted in zip(shots, places, tints, counts, strict=True):
            there = pixels[..., 2] > 0.5
            code = np.floor(pixels[there][:, 2] + 0.25).astype(int)
            power = np.broadcast_to(shot.power, pixels.shape)[there]
            nm: NDArray | float = REPRESENTATIVE_NM
            if self.wavelengths:
                share_of_shutter = np.clip(2 * (pixels[there][:, 2] - code), 0, 1)
                nm = self.wavelengths.wavelength(share_of_shutter)
                power = power * self.wavelengths.weight(share_of_shutter)
            if tint is not None:
                power = power * tint[there]
            if crossing is not None:
                share = np.where(code % 2 == 1, share_of(crossing, nm), 1.0)
            else:
                share = counted[there][:, 2] ** (1 / POWER)
            yield self._landed(code, pixels[there], power, share, np.broadcast_to(nm, len(code)))

    def _landed(self, code, pixels, power, share, nm):
        side = code // 2 - 2
        low = np.array([chart.low for chart in self.charts])[side // 2]
        high = np.array([chart.high for chart in self.charts])[side // 2]
        place = low + (pixels[:, :2] - 1) * np.maximum(high - low, 1e-9)
        return Landed(side, place, power, share, nm)


def _check(scene):
    """Raise ValueError, one sentence, where a scene has a medium that no mesh bounds."""
    volume = next((obj for obj in rendered(scene) if obj.type == "VOLUME"), None)
    if volume:
        raise ValueError(f"light is not traced through the volume {volume.name}; hide it from renders.")
    output = scene.world and scene.world.node_tree and scene.world.node_tree.get_output_node("CYCLES")
    if output and output.inputs["Volume"].is_linked:
        raise ValueError(f"light is not traced through the volume of the world {scene.world.name}; unlink it there.")


def _check_shadow(surface):
    """Raise ValueError, one sentence, where what is Shown, which bends light, throws no shadow."""
    for obj in (surface.original, surface.parent):
        if obj and not obj.visible_shadow:
            raise ValueError(
                f"{obj.name} throws no shadow, so that lamps shine straight through it, and a bake would count that light "
                "twice; switch Shadow on in its Ray Visibility."
            )


def set_materials(mesh: bpy.types.Mesh, materials: Sequence[bpy.types.Material | None]) -> None:
    """Give a mesh as many materials as it has, or one where it has none; clearing them would forget each face's."""
    for index, material in enumerate(materials):
        if index < len(mesh.materials):
            mesh.materials[index] = material
        else:
            mesh.materials.append(material)


def _is_plain(matrix):
    """Whether a matrix is a place, a rotation and a scale, none of them 0."""
    if abs(matrix.determinant()) < 1e-30:
        return False
    plain = mathutils.Matrix.LocRotScale(*matrix.decompose())
    return np.allclose(np.array(plain), np.array(matrix), rtol=0, atol=1e-5 * np.abs(matrix).max())


def _since(before):
    """The data-blocks that were made since there were those, {name of a collection of bpy.data: set}."""
    return [data for name in DATA for data in set(getattr(bpy.data, name)) - before[name]]


def _box(mesh, matrix):
    """Points (N, 3) on the sides of the box around a mesh, in the world, its corners among them."""
    low, high = meshes.bounds(meshes.vertices(mesh))
    steps = np.linspace(0, 1, BOX_SAMPLES)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[np.any((grid == 0) | (grid == 1), axis=1)]
    return meshes.moved(low + grid * (high - low), matrix)

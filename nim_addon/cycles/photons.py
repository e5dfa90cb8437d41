# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons: Cycles renders from the light, with the same shader, and every pixel says where its photon landed.

An orthographic camera looks along the sun's light; its lens is as wide as the sun's disk, so that the rays through each
point of the focal plane come from all of the disk. Every opaque surface shines with the place that was hit, and only if
the path met an interface before: light that reaches a surface straight is the path tracer's.
"""

import math
from typing import NamedTuple

import bpy
import mathutils
import numpy as np

from . import settings
from .material import empty_tree, interface_nodes, interface_of, resolve
from .render import pixels_of

ATTRIBUTE = "nim_place"
SUBDIVISION = 4  # points of a cell, along an edge, by which its surface is counted


class Sun(NamedTuple):
    """Light from far away: `direction` it travels in (3,), `irradiance` (3,) on a plane across its rays, W/m^2 or any
    unit, `angle` of its disk, radians, and whether it is a Gaussian of that width (1/e to 1/e) rather than a disk."""

    direction: tuple
    irradiance: tuple
    angle: float
    gaussian: bool = False

    def half_angles(self, count, random):
        """Half-angles, radians, of `count` uniform disks that together are this sun."""
        if not self.gaussian:
            return np.full(count, self.angle / 2)
        # a Gaussian is a mixture of disks whose radius^2 is a sum of two exponential numbers
        strata = (np.arange(count) + random.random(count)) / count
        return self.angle / 2 * np.sqrt(_gamma2(random.permutation(strata)))


def _gamma2(q):
    """Quantile q of the sum of two exponential numbers, 1 - (1 + x) e^-x = q, by Newton's method."""
    x = np.sqrt(2 * q) + q
    for _ in range(40):
        x = np.maximum(x - (1 - (1 + x) * np.exp(-x) - q) / np.maximum(x * np.exp(-x), 1e-12), 1e-9)
    return x


class Landed(NamedTuple):
    """Photons that met an interface and landed.

    chart: (N,) number of the chart; place: (N, 2) in it, in metres; power: (N, 3)
    inside: (N,) whether they had crossed interfaces an odd number of times, and so landed within a medium
    """

    chart: np.ndarray
    place: np.ndarray
    power: np.ndarray
    inside: np.ndarray


class Chart(NamedTuple):
    """A nearly flat piece of a surface, seen along one axis of the world.

    thing: name of its object; axis: 0 to 5 for +x, -x, +y, -y, +z, -z; low, high: its bounds (2,) in metres, on the two
    other axes in their order
    """

    thing: str
    axis: int
    low: np.ndarray
    high: np.ndarray


class Part(NamedTuple):
    """A mesh that light lands on: its object's name, its matrix and materials, each corner's place in the world and chart."""

    name: str
    mesh: bpy.types.Mesh
    matrix: mathutils.Matrix
    materials: list
    corners: np.ndarray
    charts: np.ndarray


def charts_of(vertices, polygons, normals):
    """The chart of each face of a mesh: faces that share an edge and look the same way, of six ways.

    vertices: (V, 3); polygons: sequences of vertex indices; normals: (F, 3)
    Returns (F,) chart numbers from 0, and the axis of each chart.
    """
    normals = np.asarray(normals)
    strongest = np.abs(normals).argmax(axis=1)
    axis = 2 * strongest + (normals[np.arange(len(normals)), strongest] < 0)
    parent = np.arange(len(polygons))

    def root(face):
        while parent[face] != face:
            parent[face] = parent[parent[face]]
            face = parent[face]
        return face

    edges = {}
    for face, corners in enumerate(polygons):
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            other = edges.setdefault((min(a, b), max(a, b)), face)
            if axis[other] == axis[face]:
                parent[root(face)] = root(other)
    _, first, number = np.unique([root(face) for face in range(len(polygons))], return_index=True, return_inverse=True)
    return number, axis[first]


class Tracer:
    """A scene made ready for photons: `charts`, a list of Chart, and trace().

    scene:   bpy.types.Scene; nothing of it is changed
    backend: of its interfaces, as for material.resolve
    Use it with `with`: what it makes is taken away at the end. Raises ValueError, one sentence, for a scene without an
    interface or without a surface for the light to land on.
    """

    def __init__(self, scene, backend="auto"):
        self.source, self.backend = scene, resolve(backend)
        self.charts, self.parts, self.interfaces = [], [], {}

    def __enter__(self):
        self.before = {kind: set(getattr(bpy.data, kind)) for kind in _KINDS}
        try:
            self._build()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        new = [data for kind in _KINDS for data in set(getattr(bpy.data, kind)) - self.before[kind]]
        bpy.data.batch_remove([data for data in new if data.name != "Render Result"])

    def _build(self):
        scene = self.scene = bpy.data.scenes.new("NIM photons")
        settings.lossless(scene, self.backend)
        scene.cycles.pixel_filter_type = "BOX"
        scene.cycles.filter_width = 1.0
        scene.cycles.use_light_tree = False
        scene.render.use_persistent_data = True
        scene.world = bpy.data.worlds.new("NIM photons")
        scene.world.color = (0, 0, 0)
        empty_tree(scene.world)
        self.shine = _shining()
        self.dark = bpy.data.materials.new("NIM dark")
        tree = empty_tree(self.dark)
        tree.links.new(
            tree.nodes.new("ShaderNodeHoldout").outputs[0],
            tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"],
        )
        bent, corners = [], []
        with bpy.context.temp_override(scene=self.source, view_layer=self.source.view_layers[0]):
            depsgraph = bpy.context.evaluated_depsgraph_get()
            for instance in depsgraph.object_instances:
                thing = instance.object
                if thing.type == "MESH" and instance.show_self and not thing.original.hide_render:
                    box = [tuple(instance.matrix_world @ mathutils.Vector(corner)) for corner in thing.bound_box]
                    corners += box
                    if self._add(thing, instance.matrix_world.copy(), depsgraph):
                        bent += box
        if not bent:
            raise ValueError("the scene has no interface for light to pass; give a mesh the material of a NIM.")
        if not self.charts:
            raise ValueError("the scene has no diffuse surface for light to land on; add a ground or a floor.")
        self.bent, self.corners = np.array(bent), np.array(corners)
        self.camera = bpy.data.objects.new("NIM photons", bpy.data.cameras.new("NIM photons"))
        scene.collection.objects.link(self.camera)
        scene.camera = self.camera

    def _add(self, thing, matrix, depsgraph):
        """Put a copy of an object into the scene; returns whether it has an interface."""
        mesh = bpy.data.meshes.new_from_object(thing, preserve_all_data_layers=True, depsgraph=depsgraph)
        materials = list(mesh.materials) or [None]
        bends = [bool(interface_nodes(material)) for material in materials]
        self.interfaces |= {
            material.name: interface_of(node) for material in materials for node in interface_nodes(material)
        }
        lands_here = [not b and (m is None or lands(m)) for b, m in zip(bends, materials, strict=True)]
        if any(lands_here):
            self._mark(mesh, matrix, lands_here, thing.original.name)
        mesh.materials.clear()
        for material, bend, land in zip(materials, bends, lands_here, strict=True):
            mesh.materials.append(material if bend else self.shine if land else self.dark)
        copy = bpy.data.objects.new("NIM photons", mesh)
        copy.matrix_world = matrix
        self.scene.collection.objects.link(copy)
        return any(bends)

    def _mark(self, mesh, matrix, lands_here, name):
        """Give each corner of the faces that light lands on its place in a chart: (1 to 2, 1 to 2, 2 (chart + 1))."""
        frame = np.array(matrix)
        vertices = _read(mesh.vertices, "co", 3) @ frame[:3, :3].T + frame[:3, 3]
        normals = _read(mesh.polygons, "normal", 3) @ np.linalg.inv(frame[:3, :3])
        polygons = [tuple(polygon.vertices) for polygon in mesh.polygons]
        number, axes = charts_of(vertices, polygons, normals)
        slot = np.minimum(_read(mesh.polygons, "material_index", 1, np.int32)[:, 0], len(lands_here) - 1)
        face = np.repeat(np.arange(len(polygons)), [len(polygon) for polygon in polygons])
        at = vertices[np.concatenate(polygons)]
        values = np.zeros((len(face), 3), np.float32)
        charts = np.full(len(face), -1)
        for chart, axis in enumerate(axes):
            mine = (number[face] == chart) & np.asarray(lands_here)[slot[face]]
            if mine.any():
                flat = np.delete(at[mine], axis // 2, axis=1)
                low, high = flat.min(axis=0), flat.max(axis=0)
                self.charts.append(Chart(name, int(axis), low, high))
                values[mine, :2] = 1 + (flat - low) / np.maximum(high - low, 1e-9)
                values[mine, 2] = 2 * len(self.charts)
                charts[mine] = len(self.charts) - 1
        layer = mesh.attributes.new(ATTRIBUTE, "FLOAT_VECTOR", "CORNER")
        layer.data.foreach_set("vector", values.ravel())
        materials = list(mesh.materials)
        self.parts.append(Part(name, mesh, matrix, materials, at, charts))

    def copies(self, name, windows, uv, low, high, texels):
        """Meshes and matrices of the object `name`, free of the tracer, with the places of its windows in a texture.

        uv:   name of the UV map; low, high: of the corner attributes that hold the window's bounds in it
        windows: caustics.Window by chart; texels: edge of the texture
        """
        for part in self.parts:
            if part.name != name:
                continue
            mesh = part.mesh.copy()
            mesh.materials.clear()
            for material in part.materials:
                mesh.materials.append(material)
            mesh.attributes.remove(mesh.attributes[ATTRIBUTE])
            place = np.full((len(part.charts), 2), -1.0, np.float32)
            bounds = np.zeros((2, len(part.charts), 3), np.float32)
            for number, window in windows.items():
                mine = part.charts == number
                flat = np.delete(part.corners[mine], self.charts[number].axis // 2, axis=1)
                place[mine] = ((flat - window.low) / window.texel + window.at) / texels
                # half a texel within, so that no neighbour shines through
                bounds[0, mine, :2] = (window.at + 0.5) / texels
                bounds[1, mine, :2] = (window.at + window.cells - 0.5) / texels
            layer = mesh.uv_layers.new(name=uv, do_init=False)
            layer.uv.foreach_set("vector", place.ravel())
            for attribute, values in zip((low, high), bounds, strict=True):
                mesh.attributes.new(attribute, "FLOAT_VECTOR", "CORNER").data.foreach_set("vector", values.ravel())
            self.before["meshes"].add(mesh)  # it stays
            yield mesh, part.matrix

    def area(self, number, low, texel, cells):
        """Surface (height, width), m^2, of a chart in each cell of a grid of `cells` (width, height) of side `texel`."""
        chart = self.charts[number]
        answer = np.zeros(tuple(cells)[::-1])
        step = (np.arange(SUBDIVISION) + 0.5) / SUBDIVISION
        for part in self.parts:
            if part.name != chart.thing or not (part.charts == number).any():
                continue
            part.mesh.calc_loop_triangles()
            loops = _read(part.mesh.loop_triangles, "loops", 3, np.int32)
            loops = loops[part.charts[loops[:, 0]] == number]
            corners = part.corners[loops]
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            steep = np.linalg.norm(across, axis=1) / np.maximum(np.abs(across[:, chart.axis // 2]), 1e-12)
            flat = (np.delete(corners, chart.axis // 2, axis=2) - low) / texel
            for triangle, slope in zip(flat, steep, strict=True):
                first = np.clip(np.floor(triangle.min(axis=0)).astype(int), 0, cells)
                last = np.clip(np.ceil(triangle.max(axis=0)).astype(int), 0, cells)
                if np.any(last <= first):
                    continue
                x = (first[0] + np.arange(last[0] - first[0])[:, None] + step).ravel()
                y = (first[1] + np.arange(last[1] - first[1])[:, None] + step).ravel()
                inside = _in_triangle(triangle, x[None, :], y[:, None])
                cover = inside.reshape(last[1] - first[1], SUBDIVISION, last[0] - first[0], SUBDIVISION).mean((1, 3))
                answer[first[1] : last[1], first[0] : last[0]] += cover * slope * texel**2
        return answer

    def trace(self, sun, side, passes=1, *, seed=0, progress=None):
        """Send side x side photons of `sun` at the interfaces, `passes` times; yields a Landed for each pass.

        The power of a photon is a share of the light on a square about the interfaces, `aperture(sun)` square metres.
        """
        random = np.random.default_rng(seed)
        halves = sun.half_angles(passes, random)
        spread = math.tan(float(halves.max()))
        frame, distance, width = self._aim(sun, spread)
        data, scene = self.camera.data, self.scene
        data.type, data.ortho_scale = "ORTHO", width
        data.clip_start, data.clip_end = 1e-3, 1e5
        data.dof.use_dof = True
        data.dof.focus_distance = distance
        scene.render.resolution_x = scene.render.resolution_y = side
        scene.render.resolution_percentage = 100
        scene.cycles.seed = seed
        area = (width / side) ** 2
        for index, half in enumerate(halves):
            if progress:
                progress(index, passes)
            # a lens of that radius at that distance
            data.dof.aperture_fstop = 1 / max(2 * distance * math.tan(half), 1e-9)
            self.camera.matrix_world = frame
            # the first sample of a pixel sits at its centre, whatever the seed: it is left out
            settings.one_sample(scene, index + 1, passes + 1)
            yield self._landed(pixels_of(scene), np.multiply(sun.irradiance, area))

    def _aim(self, sun, spread):
        """The camera's matrix, its distance from the interfaces' middle, the width of the square that holds them."""
        back = -np.asarray(sun.direction, float) / np.linalg.norm(sun.direction)
        side = np.cross((0, 0, 1) if abs(back[2]) < 0.9 else (0, 1, 0), back)
        side /= np.linalg.norm(side)
        axes = np.stack([side, np.cross(back, side), back])
        low, high = (self.bent @ axes.T).min(axis=0), (self.bent @ axes.T).max(axis=0)
        # behind all that could throw a shadow
        distance = float((self.corners @ back).max() - (low + high)[2] / 2) + 1.0
        # a ray that tilts meets the focal plane elsewhere than the interface
        width = float((high - low)[:2].max() + (high - low)[2] * spread) * 1.001
        frame = mathutils.Matrix(axes.T.tolist()).to_4x4()
        frame.translation = mathutils.Vector(((low + high) / 2) @ axes + distance * back)
        return frame, distance, width

    def aperture(self, sun):
        """Area, m^2 across the light, of the square that trace() sends photons through."""
        half = 1.5 * sun.angle if sun.gaussian else sun.angle / 2
        return self._aim(sun, math.tan(half))[2] ** 2

    def _landed(self, pixels, power):
        values = pixels.reshape(-1, 3)
        values = values[values[:, 2] > 0.5]
        code = np.rint(values[:, 2]).astype(int)
        chart = code // 2 - 1
        low = np.array([one.low for one in self.charts])[chart]
        high = np.array([one.high for one in self.charts])[chart]
        place = low + (values[:, :2] - 1) * np.maximum(high - low, 1e-9)
        return Landed(chart, place, np.broadcast_to(power, (len(chart), 3)), code % 2 == 1)


_KINDS = ("objects", "meshes", "materials", "worlds", "cameras", "scenes")


def _read(collection, name, width, kind=np.float32):
    values = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def _in_triangle(triangle, x, y):
    """Which points lie in a triangle (3, 2); on an edge they lie in one of the two that share it."""
    inside = None
    a, b, c = triangle
    turn = np.sign((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    for p, q in ((a, b), (b, c), (c, a)):
        side = turn * ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]))
        # the same edge, run through the other way, takes the other half
        here = side >= 0 if turn * (q[1] - p[1]) > 0 or (q[1] == p[1] and turn * (q[0] - p[0]) > 0) else side > 0
        inside = here if inside is None else inside & here
    return inside


def lands(material):
    """Whether light lands on a material: it scatters diffusely."""
    kinds = {"BSDF_DIFFUSE", "BSDF_PRINCIPLED", "EEVEE_SPECULAR", "SUBSURFACE_SCATTERING", "BSDF_TRANSLUCENT"}
    return material.node_tree is None or any(node.type in kinds for node in material.node_tree.nodes)


def _shining():
    """A material that emits the corner attribute, and 1 more in blue within a medium, where the path met an interface."""
    material = bpy.data.materials.new("NIM place")
    tree = empty_tree(material)

    def math_node(operation, *inputs):
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, inputs, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node.outputs[0]

    path = tree.nodes.new("ShaderNodeLightPath").outputs
    # a bend backwards counts as transparent, any other as a transmission, a reflection as neither
    crossed = math_node("ADD", path["Transparent Depth"], path["Transmission Depth"])
    met = math_node("MINIMUM", math_node("ADD", path["Ray Depth"], path["Transparent Depth"]), 1.0)
    parity = math_node("FLOORED_MODULO", crossed, 2.0)
    place = tree.nodes.new("ShaderNodeAttribute")
    place.attribute_name = ATTRIBUTE
    blue = tree.nodes.new("ShaderNodeCombineXYZ")
    tree.links.new(parity, blue.inputs["Z"])
    both = tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(place.outputs["Vector"], both.inputs[0])
    tree.links.new(blue.outputs[0], both.inputs[1])
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(both.outputs[0], glow.inputs["Color"])
    tree.links.new(met, glow.inputs["Strength"])
    tree.links.new(glow.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    material.cycles.emission_sampling = "NONE"
    return material

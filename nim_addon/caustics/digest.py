# SPDX-License-Identifier: GPL-3.0-or-later
"""What baked caustics are of: one mark of all that photons meet, as it is evaluated, and of the lamps that send them.

Nothing is listed that a modifier, a driver, a keyframe or an instance could change behind it: marked are the meshes that
are rendered, where they stand, and the nodes that are asked. Names, and how things are shown, have no part in it.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable

import bpy
import numpy as np
from numpy.typing import NDArray

from ..cycles import meshes, object_values
from ..cycles.nodes import uses_nodes
from ..cycles.visibility import PATHS_MARK, as_rendered, asked, has_nodes, shown, source_of, value_of
from . import lights

# Of an object: what a copy must have to look like it.
OBJECT_PROPERTIES = (
    *("visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission", "visible_volume_scatter"),
    *("visible_shadow", "is_shadow_catcher", "is_holdout", "color", "pass_index"),
)
LAMP_PROPERTIES = (
    *("type", "energy", "color", "exposure", "use_temperature", "temperature", "normalize", "angle"),
    *("shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y", "spread", "use_soft_falloff"),
    *("use_shadow", "use_square"),
)
MATERIAL_PROPERTIES = ("pass_index", "displacement_method")
IMAGE_PROPERTIES = ("name", "filepath", "source", "size", "alpha_mode", "generated_type", "generated_color")
PLAIN_TYPES = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")  # of RNA properties that are values
# By the type of an attribute of a mesh: the property that has its values, how many these are, and of what type.
ATTRIBUTES = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
    "INT32_2D": ("value", 2, np.int32),
    "INT16_2D": ("value", 2, np.int32),
}
# What stands, among the (type, name) of attributes that a material reads, for the random number of Object Info.
OBJECT_INFO = ("INFO", "Random")
SHAPE_ATTRIBUTES = {".corner_vert", ".edge_verts"}  # the attributes with a dot that are no selection
SAME = 1e-6  # of the size of an object: what moves by less has not moved


def digest(scene: bpy.types.Scene, marks: dict | None = None) -> str:
    """A mark of all that decides the caustics of `scene`, another one if any of it changes.

    marks: where those of meshes are kept from one call to the next, by whoever calls forget_changed() for every
           update of the depsgraph in between; None where there is no such
    It evaluates the scene as a render does (visibility.as_rendered).
    """
    marks = {} if marks is None else marks
    with as_rendered(scene) as depsgraph:
        trees = _Trees(depsgraph)
        lines = [repr(lights.sun_of(scene))]
        here, objects = set(), set()
        for surface in shown(scene, depsgraph):
            if surface.original.get(PATHS_MARK):
                continue
            objects.add(surface.original)
            maker = surface.parent or surface.original
            key = (surface.original.session_uid, maker.session_uid, surface.mesh.as_pointer())
            here.add(key)
            if key not in marks:
                marks[key] = mesh_mark(surface.mesh)
            lines.append(_surface_mark(surface, marks[key], trees, scene))
        lines += [_lamp_mark(placed, trees, objects) for placed in lights.placed(scene, depsgraph)]
        for key in set(marks) - here:
            del marks[key]
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


def forget_changed(marks: dict, depsgraph: bpy.types.Depsgraph) -> None:
    """Take out of the marks of meshes that digest() keeps those of objects that `depsgraph` evaluated anew just now."""
    # what is evaluated has no number of its own
    changed = {update.id.original.session_uid for update in depsgraph.updates if update.is_updated_geometry}
    for key in [key for key in marks if changed & set(key[:2])]:
        del marks[key]


# ------------------------------------------------------------------------------------------------ objects


def _surface_mark(surface, mesh, trees, scene):
    """The mark of what is Shown; mesh: mesh_mark() of its mesh."""
    mark, low, high = mesh
    line = [
        mark,
        _place(surface.matrix, low, high),
        [_plain(getattr(surface.original, name)) for name in OBJECT_PROPERTIES],
    ]
    line += [trees.mark(material) for material in surface.materials]
    # what these nodes read is the object's, not the material's
    reads = set().union(*(trees.reads(material) for material in surface.materials))
    if reads:
        try:
            values = object_values.values_of(surface, scene, reads - {OBJECT_INFO})
        except ValueError:  # which no bake takes
            values = {}
        random = values.pop(object_values.RANDOM, None)
        values.pop(object_values.LOCATION, None)
        line.append([sorted(values.items()), random if OBJECT_INFO in reads else None])
    return repr(line)


def _place(matrix, low, high):
    """Where a matrix puts a box, to SAME of its size there, and whether it mirrors it."""
    corners = meshes.moved([low, *(low + np.eye(3) * (high - low))], matrix.copy())
    extent = float(np.linalg.norm(np.ptp(corners, axis=0)))
    return _rounded(corners, extent), matrix.determinant() < 0


def _rounded(values, extent):
    """Numbers, to SAME of an extent, or of a quarter of the largest: single precision is not much finer."""
    values = np.asarray(values, float)
    size = max(extent, float(np.abs(values).max(initial=0.0)) / 4)
    if not 0 < size < math.inf:
        return values.tolist()
    step = 2.0 ** math.floor(
        math.log2(SAME * size)
    )  # a power of two, which a size that is a little off leaves as it is
    return (np.round(values / step) * step + 0.0).tolist()


def mesh_mark(mesh: bpy.types.Mesh) -> tuple[str, NDArray, NDArray]:
    """A mark of an evaluated mesh, raw: shape, faces, and all values of points and corners; and its bounds (3,), (3,)."""
    mark = hashlib.sha256()
    mark.update(meshes.starts(mesh)[:-1].data)
    low = high = np.zeros(3)
    for layer in mesh.attributes:
        if layer.data_type not in ATTRIBUTES or (layer.name.startswith(".") and layer.name not in SHAPE_ATTRIBUTES):
            continue
        values = meshes.read(layer.data, *ATTRIBUTES[layer.data_type]).ravel()
        if values.dtype == np.float32:
            values += 0.0  # -0.0 is 0.0
        if layer.name == "position" and len(values):
            low, high = meshes.bounds(values.reshape(-1, 3))
        mark.update(repr((layer.name, layer.domain, layer.data_type, len(values))).encode())
        mark.update(values.data)
    if mesh.has_custom_normals:
        mark.update(meshes.read(mesh.corner_normals, "vector", 3).ravel().data)
    return mark.hexdigest(), low, high


def _lamp_mark(placed, trees, objects):
    """The mark of a lights.Placed, and of which of those objects it shines on or is blocked by."""
    lamp = placed.lamp
    data = lamp.evaluated_get(trees.depsgraph).data
    frame = np.array(placed.matrix.copy())
    line = [_plain(getattr(data, name, None)) for name in LAMP_PROPERTIES]
    line += [_rounded(frame[:3, :3], 0.0), _rounded(frame[:3, 3], 0.0)]
    if uses_nodes(data):
        line.append(trees.mark(lamp.data))
    blocker = lamp.light_linking.blocker_collection
    line.append(sorted(obj.name_full for obj in lights.leaves_out(lamp, objects)))
    line.append(sorted(obj.name_full for obj in objects & set(blocker.all_objects)) if blocker else None)
    return repr(line)


# ------------------------------------------------------------------------------------------------ nodes


class _Trees:
    """The marks of what materials and lamps, evaluated, ask of their nodes; each is made once."""

    def __init__(self, depsgraph):
        self.depsgraph, self._known = depsgraph, {}

    def mark(self, owner):
        """A mark of a material, or None, or a lamp."""
        return self._of(owner)[0]

    def reads(self, owner):
        """object_values.attributes_of() it, and OBJECT_INFO where it asks for the random number, made of the name."""
        return self._of(owner)[1]

    def _of(self, owner):
        key = owner and owner.session_uid
        if key not in self._known:
            self._known[key] = self._marked(owner)
        return self._known[key]

    def _marked(self, owner):
        if owner is None or (isinstance(owner, bpy.types.Material) and not has_nodes(owner)):
            return repr(owner and _plain(owner.diffuse_color)), set()
        owner = owner.evaluated_get(self.depsgraph)
        line = [_plain(getattr(owner, name, None)) for name in MATERIAL_PROPERTIES]
        reads = object_values.attributes_of(owner) if isinstance(owner, bpy.types.Material) else set()
        output = owner.node_tree.get_output_node("CYCLES")
        for end in output.inputs if output else ():
            nodes = asked(owner, end.name)
            places = {node: place for place, node in enumerate(nodes)}
            line.append(_source(end, (), places))
            for node, path in nodes:
                line.append([node.bl_idname, self._settings(node)])
                line += [_source(socket, path, places) for socket in node.inputs if not socket.is_unavailable]
                if not len(node.inputs):
                    line.append([_plain(getattr(socket, "default_value", None)) for socket in node.outputs])
                if node.type == "OBJECT_INFO" and node.outputs["Random"].is_linked:
                    reads.add(OBJECT_INFO)
        return hashlib.sha256(repr(line).encode()).hexdigest(), reads

    def _settings(self, owner, depth=0):
        """What a node is set to, with the images, objects, texts, ramps and curves that it reads."""
        base = bpy.types.Node.bl_rna.properties if isinstance(owner, bpy.types.Node) else ()
        found = []
        for prop in owner.bl_rna.properties:
            if prop.identifier in base or prop.identifier == "rna_type":
                continue
            if prop.type in PLAIN_TYPES:
                found.append([prop.identifier, _plain(getattr(owner, prop.identifier))])
            elif prop.type == "POINTER" and depth < 2:
                found.append([prop.identifier, self._pointed(getattr(owner, prop.identifier), depth)])
        return found

    def _pointed(self, value, depth):
        if isinstance(value, bpy.types.Image):
            return _image_mark(value)
        if isinstance(value, bpy.types.Object):
            return _rounded(np.array(value.evaluated_get(self.depsgraph).matrix_world), 0.0)
        if isinstance(value, bpy.types.Text):
            return value.as_string()
        if isinstance(value, bpy.types.ColorRamp):
            return [self._settings(value, 2), [[stop.position, _plain(stop.color)] for stop in value.elements]]
        if isinstance(value, bpy.types.CurveMapping):
            points = [[[_plain(point.location), point.handle_type] for point in curve.points] for curve in value.curves]
            return [self._settings(value, 2), points]
        if value is None or isinstance(value, (bpy.types.NodeTree, bpy.types.ID)):
            return value and (not isinstance(value, bpy.types.NodeTree)) and value.name_full
        return self._settings(value, depth + 1)


def _source(socket, path, places):
    """What feeds an input of a node: the place of another node, an Asked, and the name of its output; or a value."""
    source = source_of(socket, path)
    if source is not None:
        return [socket.identifier, places.get((source[0].node, source[1])), source[0].identifier]
    return [socket.identifier, _plain(value_of(socket, path)) if hasattr(socket, "default_value") else None]


def _image_mark(image):
    line = [_plain(getattr(image, name)) for name in IMAGE_PROPERTIES] + [image.colorspace_settings.name]
    line += [hashlib.sha256(file.packed_file.data).hexdigest() for file in image.packed_files if file.packed_file]
    if image.is_dirty and image.has_data:  # painted, and nowhere else yet
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        line.append(hashlib.sha256(pixels.data).hexdigest())
    return line


def _plain(value):
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return value + 0.0  # -0.0 is 0.0
    if isinstance(value, set):
        return sorted(value)
    return [_plain(part) for part in value] if isinstance(value, Iterable) else None

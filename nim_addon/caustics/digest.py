# SPDX-License-Identifier: GPL-3.0-or-later
"""What baked caustics are of: one mark of all that photons meet, as it is evaluated, and of the lamps that send them.

Nothing is listed that a modifier, a driver, a keyframe or an instance could change behind it: marked are the meshes that
are rendered, where they stand, and the nodes that are asked. Names, and how things are shown, have no part in it.
"""

import hashlib
import math
from collections.abc import Iterable

import bpy
import numpy as np

from ..cycles import meshes, object_values
from ..cycles.nodes import uses_nodes
from ..cycles.visibility import PATHS, as_rendered, asked, has_nodes, shown, source_of, value_of
from . import lights

# what a copy must have of an object to look like it
ALIKE = ("visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission", "visible_volume_scatter")
ALIKE += ("visible_shadow", "is_shadow_catcher", "is_holdout", "color", "pass_index")
LAMP = ("type", "energy", "color", "exposure", "use_temperature", "temperature", "normalize", "angle")
LAMP += ("shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y", "spread", "use_soft_falloff")
LAMP += ("use_shadow", "use_square")
MATERIAL = ("pass_index", "displacement_method")
IMAGE = ("name", "filepath", "source", "size", "alpha_mode", "generated_type", "generated_color")
PLAIN = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")
VALUES = {"FLOAT": np.float32, "INT": np.int32, "BOOLEAN": bool, "FLOAT_VECTOR": np.float32, "FLOAT2": np.float32}
VALUES |= {"FLOAT_COLOR": np.float32, "BYTE_COLOR": np.float32, "QUATERNION": np.float32, "FLOAT4X4": np.float32}
VALUES |= {"INT8": np.int32, "INT32_2D": np.int32, "INT16_2D": np.int32}
WIDTH = {"FLOAT_VECTOR": 3, "FLOAT2": 2, "FLOAT_COLOR": 4, "BYTE_COLOR": 4, "QUATERNION": 4, "FLOAT4X4": 16}
WIDTH |= {"INT32_2D": 2, "INT16_2D": 2}
FIELD = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}
OBJECT_INFO = ("INFO", "Random")  # no type and name of an attribute
INNER = {".corner_vert", ".edge_verts"}  # the attributes with a dot that are no selection
SAME = 1e-6  # of the size of a thing: what moves by less has not moved


def digest(scene: bpy.types.Scene, meshes: dict | None = None) -> str:
    """A mark of all that decides the caustics of `scene`, another one if any of it changes.

    meshes: where the marks of meshes are kept from one call to the next, by whoever calls forget_changed() for every
            update of the depsgraph in between; None where there is no such
    It evaluates the scene as a render does (visibility.as_rendered).
    """
    meshes = {} if meshes is None else meshes
    with as_rendered(scene) as depsgraph:
        trees = _Trees(depsgraph)
        lines = [repr(lights.sun_of(scene))]
        here, things = set(), set()
        for one in shown(scene, depsgraph):
            if one.original.get(PATHS):
                continue
            things.add(one.original)
            key = (one.original, one.parent or one.original, one.mesh)
            key = (key[0].session_uid, key[1].session_uid, key[2].as_pointer())
            here.add(key)
            if key not in meshes:
                meshes[key] = _mesh_mark(one.mesh)
            lines.append(_surface_mark(one, meshes[key], trees, scene))
        lines += [_lamp_mark(one, trees, things) for one in lights.placed(scene, depsgraph)]
        for key in set(meshes) - here:
            del meshes[key]
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


def forget_changed(meshes: dict, depsgraph: bpy.types.Depsgraph) -> None:
    """Take out of the marks of meshes that digest() keeps those of objects that `depsgraph` evaluated anew just now."""
    # what is evaluated has no number of its own
    changed = {update.id.original.session_uid for update in depsgraph.updates if update.is_updated_geometry}
    for key in [key for key in meshes if changed & set(key[:2])]:
        del meshes[key]


# ------------------------------------------------------------------------------------------------ things


def _surface_mark(one, mesh, trees, scene):
    mark, low, high = mesh
    line = [mark, _place(one.matrix, low, high), [_plain(getattr(one.original, name)) for name in ALIKE]]
    line += [trees.mark(material) for material in one.materials]
    # what these nodes read is the object's, not the material's
    reads = set().union(*(trees.reads(material) for material in one.materials))
    if reads:
        try:
            values = object_values.values_of(one, scene, reads - {OBJECT_INFO})
        except ValueError:  # which no bake takes
            values = {}
        random = values.pop(object_values.RANDOM, None)
        values.pop(object_values.LOCATION, None)
        line.append([sorted(values.items()), random if OBJECT_INFO in reads else None])
    return repr(line)


def _place(matrix, low, high):
    """Where a matrix puts a box, to SAME of its size there, and whether it mirrors it."""
    frame, size = np.array(matrix.copy()), high - low
    corners = np.array([low, *(low + np.eye(3) * size)]) @ frame[:3, :3].T + frame[:3, 3]
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


def _mesh_mark(mesh):
    """A mark of an evaluated mesh, raw: shape, faces, and all values of points and corners; and the box (3,), (3,)."""
    mark = hashlib.sha256()
    mark.update(meshes.starts(mesh)[:-1])
    low = high = np.zeros(3)
    for layer in mesh.attributes:
        if layer.data_type not in VALUES or (layer.name.startswith(".") and layer.name not in INNER):
            continue
        width, kind = WIDTH.get(layer.data_type, 1), VALUES[layer.data_type]
        values = meshes.read(layer.data, FIELD.get(layer.data_type, "value"), width, kind).ravel()
        if values.dtype == np.float32:
            values += 0.0  # -0.0 is 0.0
        if layer.name == "position" and len(values):
            places = values.reshape(-1, 3)
            low, high = places.min(axis=0), places.max(axis=0)
        mark.update(repr((layer.name, layer.domain, layer.data_type, len(values))).encode())
        mark.update(values)
    if mesh.has_custom_normals:
        mark.update(meshes.read(mesh.corner_normals, "vector", 3))
    return mark.hexdigest(), low, high


def _lamp_mark(one, trees, things):
    lamp = one.thing.evaluated_get(trees.depsgraph).data
    frame = np.array(one.matrix.copy())
    line = [_plain(getattr(lamp, name, None)) for name in LAMP]
    line += [_rounded(frame[:3, :3], 0.0), _rounded(frame[:3, 3], 0.0)]
    if uses_nodes(lamp):
        line.append(trees.mark(one.thing.data))
    blocker = one.thing.light_linking.blocker_collection
    line.append(sorted(thing.name_full for thing in lights.leaves_out(one.thing, things)))
    line.append(sorted(thing.name_full for thing in things & set(blocker.all_objects)) if blocker else None)
    return repr(line)


# ------------------------------------------------------------------------------------------------ nodes


class _Trees:
    """The marks of what materials and lamps, evaluated, ask of their nodes; each is made once."""

    def __init__(self, depsgraph):
        self.depsgraph, self.made = depsgraph, {}

    def mark(self, owner):
        """A mark of a material, or None, or a lamp."""
        return self._of(owner)[0]

    def reads(self, owner):
        """object_values.attributes_of() it, and OBJECT_INFO where it asks for the random number, made of the name."""
        return self._of(owner)[1]

    def _of(self, owner):
        key = owner and owner.session_uid
        if key not in self.made:
            self.made[key] = self._made(owner)
        return self.made[key]

    def _made(self, owner):
        if owner is None or (isinstance(owner, bpy.types.Material) and not has_nodes(owner)):
            return repr(owner and _plain(owner.diffuse_color)), set()
        owner = owner.evaluated_get(self.depsgraph)
        line = [_plain(getattr(owner, name, None)) for name in MATERIAL]
        reads = object_values.attributes_of(owner) if isinstance(owner, bpy.types.Material) else set()
        output = owner.node_tree.get_output_node("CYCLES")
        for end in output.inputs if output else ():
            nodes = asked(owner, end.name)
            places = {(one.node, one.path): place for place, one in enumerate(nodes)}
            line.append(_source(end, (), places))
            for one in nodes:
                line.append([one.node.bl_idname, self._settings(one.node)])
                line += [_source(socket, one.path, places) for socket in one.node.inputs if not socket.is_unavailable]
                if not len(one.node.inputs):
                    line.append([_plain(getattr(socket, "default_value", None)) for socket in one.node.outputs])
                if one.node.type == "OBJECT_INFO" and one.node.outputs["Random"].is_linked:
                    reads.add(OBJECT_INFO)
        return hashlib.sha256(repr(line).encode()).hexdigest(), reads

    def _settings(self, owner, depth=0):
        """What a node is set to, with the images, objects, texts, ramps and curves that it reads."""
        base = bpy.types.Node.bl_rna.properties if isinstance(owner, bpy.types.Node) else ()
        found = []
        for one in owner.bl_rna.properties:
            if one.identifier in base or one.identifier == "rna_type":
                continue
            if one.type in PLAIN:
                found.append([one.identifier, _plain(getattr(owner, one.identifier))])
            elif one.type == "POINTER" and depth < 2:
                found.append([one.identifier, self._pointed(getattr(owner, one.identifier), depth)])
        return found

    def _pointed(self, value, depth):
        if isinstance(value, bpy.types.Image):
            return _image_mark(value)
        if isinstance(value, bpy.types.Object):
            return _rounded(np.array(value.evaluated_get(self.depsgraph).matrix_world), 0.0)
        if isinstance(value, bpy.types.Text):
            return value.as_string()
        if isinstance(value, bpy.types.ColorRamp):
            return [self._settings(value, 2), [[one.position, _plain(one.color)] for one in value.elements]]
        if isinstance(value, bpy.types.CurveMapping):
            points = [[[_plain(one.location), one.handle_type] for one in curve.points] for curve in value.curves]
            return [self._settings(value, 2), points]
        if value is None or isinstance(value, (bpy.types.NodeTree, bpy.types.ID)):
            return value and (not isinstance(value, bpy.types.NodeTree)) and value.name_full
        return self._settings(value, depth + 1)


def _source(socket, path, places):
    """What feeds an input of a node: the place of another node and the name of its output, or a value."""
    source = source_of(socket, path)
    if source is not None:
        return [socket.identifier, places.get((source[0].node, source[1])), source[0].identifier]
    return [socket.identifier, _plain(value_of(socket, path)) if hasattr(socket, "default_value") else None]


def _image_mark(image):
    line = [_plain(getattr(image, name)) for name in IMAGE] + [image.colorspace_settings.name]
    line += [hashlib.sha256(one.packed_file.data).hexdigest() for one in image.packed_files if one.packed_file]
    if image.is_dirty and image.has_data:  # painted, and nowhere else yet
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        line.append(hashlib.sha256(pixels).hexdigest())
    return line


def _plain(value):
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return value + 0.0  # -0.0 is 0.0
    if isinstance(value, set):
        return sorted(value)
    return [_plain(one) for one in value] if isinstance(value, Iterable) else None

# SPDX-License-Identifier: GPL-3.0-or-later
"""What in a scene would spoil an interface's picture, in a sentence each, and the mending of it."""

from typing import NamedTuple

import bpy

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
import numpy as np

from . import settings
from .material import MARK, device_runs_osl, interface_nodes, osl_available, switch_backend

# Below this a picture with a few NIMs in it has black spots; Blender starts with 8.
TRANSPARENT_BOUNCES = 64
# What a light of no size is given: a small bulb (metres), and the sun as it is seen from the earth (radians).
RADIUS, SUN = 0.1, 0.00918
# The sentence that is added where a thing cannot be changed in this file.
LINKED = "It is linked from a library: mend it in that file."
# And where the mesh itself needs no mending, so that a button could change nothing.
MODIFIED = "A modifier makes it so, not the mesh itself: mend it there."


class Problem(NamedTuple):
    """One thing that is wrong.

    code:      what kind it is, a key of MENDS
    texts:     templates of the sentences that say it, filled in from `values`
    remedy:    what mending does, in a few words for a button; None where only a person can
    things:    names of the objects it is about, if any
    materials: names of the interface materials it is about; None for all of the scene's
    """

    code: str
    texts: tuple
    values: dict
    remedy: str | None
    things: tuple = ()
    materials: tuple | None = None

    @property
    def sentence(self):
        """What is wrong, in English."""
        return " ".join(self.texts).format(**self.values)


class Surface(NamedTuple):
    """What a mesh's faces enclose: are they closed, do neighbours agree on a side, and is that side the outer one?"""

    closed: bool
    agreeing: bool
    outward: bool


def interfaces(scene):
    """The interface materials that a bpy.types.Scene renders: {material: [its objects]}."""
    ours = {material for material in bpy.data.materials if interface_nodes(material)}
    found = {}
    for thing in scene.objects if ours else ():
        if not thing.hide_render:
            for material in {slot.material for slot in thing.material_slots} & ours:
                found.setdefault(material, []).append(thing)
    return found


def backends(materials):
    """Names of the interface materials by the backend of their nodes: {"osl": names, "nodes": names}."""
    names = {}
    for material in materials:
        for kind in {node.node_tree[MARK] for node in interface_nodes(material)}:
            names.setdefault(kind, []).append(material.name)
    return {kind: tuple(sorted(those)) for kind, those in names.items()}


def problems(scene):
    """All that is wrong in a bpy.types.Scene, as a list of Problem; empty where it renders no interface material."""
    worn = interfaces(scene)
    if not worn:
        return []
    layer = scene.view_layers[0]
    layer.update()
    surfaces = {thing: surface(evaluated_mesh(thing, layer.depsgraph)) for thing in meshes(worn)}
    return setting_problems(scene, backends(worn)) + light_problems(scene) + mesh_problems(worn, surfaces)


def setting_problems(scene, backends):
    """The Problems of render settings; quick. `backends`: as the function of that name gives them."""
    cycles = getattr(scene, "cycles", None)
    if cycles is None:
        text = "Cycles is switched off in the preferences: only Cycles renders the interface."
        return [Problem("engine", (text,), {}, None)]
    found = []

    def add(code, text, remedy, materials=None, **values):
        found.append(Problem(code, (text,), values, remedy, materials=materials))

    if scene.render.engine != "CYCLES":
        names = {"BLENDER_EEVEE_NEXT": "EEVEE", "BLENDER_EEVEE": "EEVEE", "BLENDER_WORKBENCH": "Workbench"}
        engine = names.get(scene.render.engine, scene.render.engine)
        add(
            "engine",
            "{engine} cannot bend a ray at the interface: only Cycles renders it.",
            "Use Cycles",
            engine=engine,
        )
    if scripted := backends.get("osl"):
        if not osl_available():
            text = "This Blender was built without OSL, which the material's script needs."
            add("osl_missing", text, "Use nodes", scripted)
        elif not device_runs_osl(scene):
            text = "This GPU does not run OSL, which the material's script needs: only the CPU and OptiX do."
            add("osl_device", text, "Use nodes", scripted)
        elif not cycles.shading_system:
            add("osl_off", "Open Shading Language is off, which the material's script needs.", "Turn on OSL", scripted)
    if cycles.transparent_max_bounces < TRANSPARENT_BOUNCES:
        text = "Transparent bounces: {bounces}. Each bend backwards is one, and after the last the path is black."
        add("transparent_bounces", text, "Raise them", bounces=cycles.transparent_max_bounces)
    if cycles.sample_clamp_direct > 0 or cycles.sample_clamp_indirect > 0:
        text = "Clamping dims what is mirrored but not what is bent backwards: their balance is wrong."
        add("clamp", text, "Turn off clamping")
    if cycles.blur_glossy > 0:
        text = "Filter Glossy blurs what is mirrored but not what is bent backwards."
        add("filter_glossy", text, "Turn off the filter")
    if scene.render.film_transparent:
        text = "The film is transparent: a negative-index material shows as a hole in it."
        add("film_transparent", text, "Make the film opaque")
    return found


def light_problems(scene):
    """The Problems of lights: one of no size is never met by a ray that an interface has bent."""
    found = []
    for thing in scene.objects:
        if thing.type == "LIGHT" and not thing.hide_render and _sizeless(thing.data):
            text = "The light {name} has no size: it is never seen through the interface and casts no light through it."
            found.append(_about(thing, "zero_light", text, "Give it a size"))
    return found


def meshes(worn):
    """The mesh objects among those of interfaces(), each once."""
    return list(dict.fromkeys(thing for things in worn.values() for thing in things if thing.type == "MESH"))


def mesh_problems(worn, surfaces):
    """The Problems of meshes. `worn`: as interfaces() gives it; `surfaces`: {object: Surface}, where they are known."""
    found = []
    for thing in meshes(worn):
        shape = surfaces.get(thing)
        if shape is None:
            continue
        materials = tuple(sorted(material.name for material, things in worn.items() if thing in things))
        if shape.closed and not (shape.agreeing and shape.outward):
            text = "The normals of {name} point inwards, so that inside and outside are exchanged."
            if not shape.agreeing:
                text = "The normals of {name} do not agree, so that inside and outside are exchanged here and there."
            own = _own_surface(thing, shape)
            modified = own.agreeing and own.outward
            found.append(_about(thing, "normals", text, "Turn them out", materials, modified))
        filled = tuple(sorted(material.name for material in worn if thing in worn[material] and _has_volume(material)))
        if filled and not shape.closed:
            text = "{name} has holes, but its material has a volume, which then has no end."
            modified = _own_surface(thing, shape).closed
            found.append(_about(thing, "open_volume", text, "Close the holes", filled, modified))
    return found


def evaluated_mesh(thing, depsgraph):
    """The bpy.types.Mesh of a mesh object with its modifiers, where the depsgraph has it; else the mesh itself."""
    own = thing.evaluated_get(depsgraph) if depsgraph and thing.modifiers else thing
    return own.data


def surface(mesh):
    """The Surface of a bpy.types.Mesh: closed where each edge has two faces, outward where it encloses a volume > 0."""
    corners = len(mesh.loops)
    if not corners:
        return Surface(False, True, True)
    edge, vertex = np.empty(corners, np.int32), np.empty(corners, np.int32)
    mesh.loops.foreach_get("edge_index", edge)
    mesh.loops.foreach_get("vertex_index", vertex)
    ends = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    faces = np.bincount(edge, minlength=len(ends))
    # two faces that agree run along their common edge in opposite directions
    forward = np.bincount(edge, weights=vertex == ends[edge, 0], minlength=len(ends))
    used = faces > 0
    closed = bool(np.all(faces[used] == 2))
    agreeing = bool(np.all(forward[faces == 2] == 1))
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    mesh.calc_loop_triangles()
    triangles = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    a, b, c = np.moveaxis((points - points.mean(axis=0)).astype(float)[triangles], 1, 0)
    return Surface(closed, agreeing, bool(np.sum(a * np.cross(b, c)) >= 0))


def mend(scene, code=None):
    """Mend what is wrong with a bpy.types.Scene: the problems of that code, or all. Returns those that were mended."""
    mended = [problem for problem in problems(scene) if problem.remedy and code in (None, problem.code)]
    for problem in mended:
        MENDS[problem.code](scene, problem)
    return mended


def _about(thing, code, text, remedy, materials=None, modified=False):
    texts = (text, MODIFIED) if modified else (text,)
    # modifiers are the object's, which may be of this file though its data is linked
    linked = (thing if modified else thing.data).library
    if linked:
        texts += (LINKED,)
    remedy = None if modified or linked else remedy
    return Problem(code, texts, {"name": thing.name}, remedy, (thing.name,), materials)


def _own_surface(thing, shape):
    """The Surface of a mesh object without its modifiers; `shape`: the one with them."""
    return surface(thing.data) if thing.modifiers else shape


def _sizeless(light):
    if light.type == "SUN":
        return light.angle == 0
    if light.type == "AREA":
        return light.size == 0 or (light.shape in ("RECTANGLE", "ELLIPSE") and light.size_y == 0)
    return light.shadow_soft_size == 0


def _has_volume(material):
    output = material.node_tree.get_output_node("CYCLES")
    return output is not None and output.inputs["Volume"].is_linked


def _own_data(scene, problem):
    """The object data that a problem is about, each once, though several objects share it."""
    return list(dict.fromkeys(thing.data for thing in scene.objects if thing.name in problem.things))


def _use_nodes(scene, problem):
    for name in problem.materials:
        switch_backend(bpy.data.materials[name], "nodes")


def _give_size(scene, problem):
    for light in _own_data(scene, problem):
        if light.type == "SUN":
            light.angle = SUN
        elif light.type == "AREA":
            light.size, light.size_y = light.size or RADIUS, light.size_y or RADIUS
        else:
            light.shadow_soft_size = RADIUS


def _turn_out(scene, problem):
    for mesh in _own_data(scene, problem):
        if not surface(mesh).agreeing:
            with _Edited(mesh) as shape:
                bmesh.ops.recalc_face_normals(shape, faces=shape.faces)
        # only where it is still inside out: two objects may share it, and the first has turned it
        if not surface(mesh).outward:
            mesh.flip_normals()
            mesh.update()


def _close(scene, problem):
    for mesh in _own_data(scene, problem):
        with _Edited(mesh) as shape:
            bmesh.ops.holes_fill(shape, edges=[edge for edge in shape.edges if edge.is_boundary], sides=0)
            bmesh.ops.recalc_face_normals(shape, faces=shape.faces)


class _Edited:
    """A mesh as a bmesh, written back at the end."""

    def __init__(self, mesh):
        self.mesh = mesh

    def __enter__(self):
        self.shape = bmesh.new()
        self.shape.from_mesh(self.mesh)
        return self.shape

    def __exit__(self, *error):
        if error[0] is None:
            self.shape.to_mesh(self.mesh)
            self.mesh.update()
        self.shape.free()


def _set(owner, **values):
    """A mend that sets attributes of the scene's `owner` ("render" or "cycles")."""

    def settle(scene, problem):
        for name, value in values.items():
            setattr(getattr(scene, owner), name, value)

    return settle


MENDS = {
    "engine": _set("render", engine="CYCLES"),
    "osl_missing": _use_nodes,
    "osl_device": _use_nodes,
    "osl_off": _set("cycles", shading_system=True),
    "transparent_bounces": _set("cycles", transparent_max_bounces=settings.BOUNCES),
    "clamp": _set("cycles", sample_clamp_direct=0.0, sample_clamp_indirect=0.0),
    "filter_glossy": _set("cycles", blur_glossy=0.0),
    "film_transparent": _set("render", film_transparent=False),
    "zero_light": _give_size,
    "normals": _turn_out,
    "open_volume": _close,
}

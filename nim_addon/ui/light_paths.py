# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths: rays through the interfaces of a scene, drawn as curves."""

import math

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty
from mathutils.bvhtree import BVHTree

from ..cycles.material import interface_nodes, interface_of
from ..cycles.nodes import Nodes, empty_tree
from ..physics.rays import MOST, Hit, Kind, trace

COLLECTION = "NIM Light Paths"
# The custom property of all we draw; that of an object holds the source it was drawn for.
MARK = "nim_light_paths"

# Linear colours: light arrives yellow, is reflected blue, and goes on orange.
COLORS = {Kind.INCIDENT: (1.0, 0.80, 0.25), Kind.REFLECTED: (0.10, 0.60, 1.0), Kind.TRANSMITTED: (1.0, 0.20, 0.02)}
# Thickness goes with this power of the energy: a branch of one per cent is still seen, a third as thick.
THINNING = 0.25


class Settings:
    """The settings of the rays: those of a scene, and those of the operator while it can be redone."""

    source: EnumProperty(
        name="Source",
        description="Where the rays start",
        items=(
            (
                "CURSOR",
                "3D Cursor",
                "From the 3D cursor; from its left (-X) if it is in the target's middle",
                "PIVOT_CURSOR",
                0,
            ),
            ("CAMERA", "Camera", "From the scene's camera, against the light it sees", "OUTLINER_OB_CAMERA", 1),
            ("LAMP", "Selected Lamps", "From every selected lamp; from the only lamp, where none is", "LIGHT", 2),
        ),
        options={"SKIP_SAVE"},
    )
    aim: EnumProperty(
        name="Aim",
        description="Where the rays go; those of a sun always go where it shines",
        items=(
            ("TARGET", "Interface", "Towards the active object, or all interfaces if it is none", "PIVOT_BOUNDBOX", 0),
            ("FORWARD", "Forward", "Where the camera looks, the lamp shines or the cursor's -Z points", "FORWARD", 1),
            ("DIRECTION", "Direction", "Along a direction of your own", "ORIENTATION_GLOBAL", 2),
        ),
        options={"SKIP_SAVE"},
    )
    direction: FloatVectorProperty(
        name="Direction",
        description="Direction of the rays in the scene's axes, of any length but zero",
        default=(1.0, 0.0, 0.0),
        subtype="XYZ",
        options={"SKIP_SAVE"},
    )
    arrangement: EnumProperty(
        name="Arrangement",
        description="How the rays spread; those of a sun are always parallel",
        items=(
            ("BEAM", "Beam", "Parallel rays side by side in a plane", "ALIGN_JUSTIFY", 0),
            ("FAN", "Fan", "Rays from one point in a plane", "IPO_LINEAR", 1),
            ("CONE", "Cone", "Rays from one point, evenly within a cone", "CONE", 2),
        ),
        options={"SKIP_SAVE"},
    )
    rays: IntProperty(
        name="Rays",
        description="How many rays start at each source",
        default=21,
        min=1,
        max=1000,
        options={"SKIP_SAVE"},
    )
    width: FloatProperty(
        name="Width",
        description="Width of a beam",
        default=1.0,
        min=0.0,
        unit="LENGTH",
        options={"SKIP_SAVE"},
    )
    angle: FloatProperty(
        name="Angle",
        description="Angle between the outermost rays of a fan or a cone",
        default=math.radians(30),
        min=0.0,
        max=math.radians(360),
        subtype="ANGLE",
        options={"SKIP_SAVE"},
    )
    roll: FloatProperty(
        name="Roll",
        description="Turns the plane of a beam or a fan about its middle ray; at 0 it stands upright",
        default=0.0,
        subtype="ANGLE",
        options={"SKIP_SAVE"},
    )
    bounces: IntProperty(
        name="Bounces",
        description="How many interfaces a path may cross or be reflected by",
        default=8,
        min=0,
        max=64,
        options={"SKIP_SAVE"},
    )
    least: FloatProperty(
        name="Least Energy",
        description="A branch with less than this share of its ray's energy is not drawn",
        default=0.001,
        min=0.00001,
        max=0.99,
        precision=4,
        options={"SKIP_SAVE"},
    )
    fit: BoolProperty(
        name="Fit to Interfaces",
        description="Choose the width of a beam, the thickness and the reach by the size of what the rays meet",
        default=True,
        options={"SKIP_SAVE"},
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Thickness of a ray with all its energy; weaker ones are thinner",
        default=0.02,
        min=0.0,
        precision=4,
        unit="LENGTH",
        options={"SKIP_SAVE"},
    )
    reach: FloatProperty(
        name="Reach",
        description="How far a ray that meets nothing more is drawn",
        default=3.0,
        min=0.000001,
        unit="LENGTH",
        options={"SKIP_SAVE"},
    )
    through: BoolProperty(
        name="Seen Inside",
        description="In a render, show the rays inside and behind an interface too, bent by it as anything else",
        default=True,
        options={"SKIP_SAVE"},
    )


class NIM_PG_rays(Settings, bpy.types.PropertyGroup):
    """How the rays of a scene are drawn: Scene.nim_rays."""


def _draw_settings(layout, settings):
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    column.prop(settings, "source")
    column.prop(settings, "aim")
    if settings.aim == "DIRECTION":
        column.prop(settings, "direction")
    column = layout.column(align=True)
    column.prop(settings, "arrangement")
    column.prop(settings, "rays")
    if settings.arrangement != "BEAM":
        column.prop(settings, "angle")
    if settings.arrangement != "CONE":
        column.prop(settings, "roll")
    column = layout.column(align=True)
    column.prop(settings, "bounces")
    column.prop(settings, "least")
    column = layout.column(align=True)
    column.prop(settings, "fit")
    if not settings.fit:
        column.prop(settings, "width")
        column.prop(settings, "thickness")
        column.prop(settings, "reach")
    layout.prop(settings, "through")


class NIM_OT_light_paths(Settings, bpy.types.Operator):
    """Shoot rays through the interfaces of this scene and draw where they go, by energy, in place of the last ones"""

    bl_idname = "nim.light_paths"
    bl_label = "Draw Light Paths"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Light paths are drawn in Object Mode only")
            return False
        return True

    def draw(self, context):
        _draw_settings(self.layout, self)

    def execute(self, context):
        # what the caller leaves open is as the scene has it; what was drawn last is what the scene remembers
        settings = context.scene.nim_rays
        for name in Settings.__annotations__:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
        try:
            surfaces, drawn = _traced(context, self)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for source, paths in drawn.items():
            _draw_paths(context.scene, source, paths, self.thickness, self.through)
        for name in Settings.__annotations__:
            setattr(settings, name, getattr(self, name))
        rays = sum(len(paths.lost) for paths in drawn.values())
        pieces = sum(len(paths.ray) for paths in drawn.values())
        self.report(
            {"INFO"}, pgettext_rpt("Light paths drawn; rays: {rays}, pieces: {pieces}").format(rays=rays, pieces=pieces)
        )
        if surfaces.unknown:
            self.report(
                {"WARNING"},
                pgettext_rpt(
                    "Rays end at {materials}: a link decides its media, so that they are not known here"
                ).format(materials=", ".join(sorted(surfaces.unknown))),
            )
        elif all(paths.depth.max() == 0 for paths in drawn.values()) and self.bounces:
            self.report({"WARNING"}, pgettext_rpt("No ray met an interface; move the source, or aim it at one"))
        return {"FINISHED"}


class NIM_OT_light_paths_clear(bpy.types.Operator):
    """Remove all light paths of this scene, and what was made for them"""

    bl_idname = "nim.light_paths_clear"
    bl_label = "Clear Light Paths"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if _collection_of(context.scene) is None:
            cls.poll_message_set("This scene has no light paths")
            return False
        return True

    def execute(self, context):
        scene = context.scene
        _remove([thing for thing in scene.objects if thing.get(MARK)])
        collection = _collection_of(scene)
        # what a person has put there stays in the scene; what is in it already cannot be linked again, and two things
        # of one name, one of them from a library, are not the same
        for theirs, ours in (
            (scene.collection.objects, collection.objects),
            (scene.collection.children, collection.children),
        ):
            known = set(theirs)
            for thing in [one for one in ours if one not in known]:
                theirs.link(thing)
        bpy.data.collections.remove(collection)
        bpy.data.batch_remove([m for m in bpy.data.materials if m.get(MARK) and m.users == 0])
        self.report({"INFO"}, pgettext_rpt("Light paths cleared"))
        return {"FINISHED"}


class NIM_PT_light_paths(bpy.types.Panel):
    """Rays through the interfaces of the scene, drawn as curves"""

    bl_idname = "NIM_PT_light_paths"
    bl_label = "Light Paths"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "NIM"
    bl_order = 20

    def draw(self, context):
        settings = context.scene.nim_rays
        column = self.layout.column(align=True)
        column.operator(NIM_OT_light_paths.bl_idname, icon="LIGHT_SUN")
        column.operator(NIM_OT_light_paths_clear.bl_idname, icon="TRASH")
        if settings.source == "CAMERA" and context.scene.camera is None:
            self.layout.label(text="The scene has no camera", icon="ERROR")
        elif settings.source == "LAMP" and not _lamps(context):
            self.layout.label(text="Select a lamp", icon="ERROR")
        _draw_settings(self.layout, settings)


# ---------------------------------------------------------------- what the rays meet


class Meshes:
    """The visible meshes of a scene in one tree, as physics.rays.trace() takes surfaces.

    Faces with an interface node bend rays, all others stop them. `unknown` names the materials whose media a link
    decides: what it gives is not known here, so rays stop there as well. `bounds` maps each object (its original) to
    the two corners of its interfaces, `low` and `high` are those of all, `size` the distance between them.
    Raises ValueError where no visible mesh has an interface.

    A bend uses the interpolated normal, as Cycles does: with the faces' own, a beam through a round but coarse mesh
    comes out as one bundle a face.
    """

    def __init__(self, depsgraph):
        self.interfaces, self.unknown, self.bounds = [], set(), {}
        corners, normals, facing, which, points, polygons = [], [], [], [], [], []
        count = 0
        for instance in depsgraph.object_instances:
            thing = instance.object
            # curves with a thickness come as meshes too: those of a person stop rays, ours do not
            if thing.type != "MESH" or not instance.show_self or thing.original.get(MARK) or _not_rendered(instance):
                continue
            mesh, matrix = thing.data, np.array(instance.matrix_world)
            mesh.calc_loop_triangles()
            triangles = mesh.loop_triangles
            turned = np.linalg.det(matrix[:3, :3])
            if not len(triangles) or turned == 0:
                continue
            vertices = _read(mesh.vertices, "co", 3) @ matrix[:3, :3].T + matrix[:3, 3]
            index = _read(triangles, "vertices", 3, np.int32)
            at = vertices[index]
            corners.append(at)
            # a mirrored object has its normals on the same side as before, though its corners run the other way round
            facing.append(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]) * np.sign(turned))
            own = _read(mesh.corner_normals, "vector", 3) @ np.linalg.inv(matrix[:3, :3])
            normals.append(own[_read(triangles, "loops", 3, np.int32)])
            slots = np.array([self._which(slot.material) for slot in thing.material_slots] or [-1])
            slot = _read(triangles, "material_index", 1, np.int32)[:, 0]
            which.append(slots[np.minimum(slot, len(slots) - 1)])
            bends = at[which[-1] >= 0].reshape(-1, 3)
            if len(bends):
                low, high = self.bounds.get(thing.original, (np.inf, -np.inf))
                self.bounds[thing.original] = np.minimum(low, bends.min(axis=0)), np.maximum(high, bends.max(axis=0))
            points += vertices.tolist()
            polygons += (index + count).tolist()
            count += len(vertices)
        if not self.bounds:
            raise ValueError(
                pgettext_rpt(
                    "Light paths: no visible mesh of this scene has a NIM Interface material with media of its own; "
                    "give one to an object first"
                )
            )
        self.low = np.min([low for low, _ in self.bounds.values()], axis=0)
        self.high = np.max([high for _, high in self.bounds.values()], axis=0)
        self.size = float(np.linalg.norm(self.high - self.low))
        # Blender casts in single precision
        self.gap = 1e-6 * float(np.abs([self.low, self.high]).max())
        self._corners, self._which_of = np.concatenate(corners), np.concatenate(which)
        self._facing, self._normals = _unit_or_zero(np.concatenate(facing)), _unit_or_zero(np.concatenate(normals))
        self._tree = BVHTree.FromPolygons(points, polygons, all_triangles=True)

    def _which(self, material):
        """Index of the material's interface, -1 where rays end at it."""
        node = next((node for node in interface_nodes(material) if node.outputs["BSDF"].is_linked), None)
        if node is None:
            return -1
        interface = interface_of(node)
        if interface is None:
            self.unknown.add(material.name)
            return -1
        if interface not in self.interfaces:
            self.interfaces.append(interface)
        return self.interfaces.index(interface)

    def hit(self, origins, directions):
        """The nearest physics.rays.Hit of rays from origins (N, 3) along unit directions (N, 3)."""
        cast = self._tree.ray_cast
        found = [cast(o, d)[2] for o, d in zip(origins.tolist(), directions.tolist(), strict=True)]
        nothing = np.array([index is None for index in found])
        face = np.array([index or 0 for index in found])
        # the tree says which triangle, in single precision; where it is met is worked out again in double
        a, b, c = np.moveaxis(self._corners[face], 1, 0)
        facing = self._facing[face]
        along = _dot(directions, facing)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = _dot(a - origins, facing) / along
            distance = np.where(nothing, np.inf, np.maximum(np.nan_to_num(distance), 0))
            at = origins + np.where(nothing, 0, distance)[:, None] * directions
            # areas of the triangles between the point and two of the corners
            weights = np.stack([_dot(np.cross(q - at, r - at), facing) for q, r in ((b, c), (c, a), (a, b))], -1)
            weights = np.clip(weights / weights.sum(axis=-1, keepdims=True), 0, 1)
        normal = _unit_or_zero(np.einsum("ni,nij->nj", np.nan_to_num(weights), self._normals[face]))
        # near the rim of a smooth mesh its normals look away from the ray, or mirror it through the face
        towards = _dot(directions, normal)
        mirrored = along - 2 * towards * _dot(normal, facing)
        normal = np.where((towards * along > 0) & (mirrored * along < 0), normal.T, facing.T).T
        return Hit(distance, normal, np.where(nothing, -1, self._which_of[face]))


def _not_rendered(instance):
    if not instance.is_instance:
        return instance.object.hide_render
    # geometry nodes render an object that they make instances of even where it is hidden itself
    parent = instance.parent
    return parent.hide_render or (parent.instance_type != "NONE" and instance.object.hide_render)


def _read(items, name, width, kind=np.float32):
    values = np.empty((len(items), width), kind)
    items.foreach_get(name, values.ravel())
    return values if kind == np.int32 else values.astype(float)


def _dot(a, b):
    return np.sum(a * b, axis=-1)


def _unit_or_zero(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


# ---------------------------------------------------------------- where they start


def _traced(context, settings):
    """The Meshes, and {source: Paths}; ValueError with a sentence where the settings lead nowhere."""
    depsgraph = context.evaluated_depsgraph_get()
    sources = _sources(context, settings.source, depsgraph)
    surfaces = Meshes(depsgraph)
    low, high = surfaces.bounds.get(context.active_object, (surfaces.low, surfaces.high))
    if settings.fit:
        # as properties, so that whoever takes the fit off goes on from here
        settings.width = 0.8 * float(np.median(high - low))
        settings.thickness, settings.reach = 0.007 * surfaces.size, surfaces.size
    drawn = {}
    for name, matrix, is_sun in sources:
        origins, directions = _rays(settings, matrix, is_sun, (low + high) / 2, surfaces.size, context.scene.cursor)
        try:
            drawn[name] = trace(
                surfaces,
                origins,
                directions,
                bounces=settings.bounces,
                least=settings.least,
                reach=settings.reach,
                gap=surfaces.gap,
            )
        except ValueError:
            raise ValueError(
                pgettext_rpt(
                    "Light paths: the rays split into more than {most} pieces; "
                    "take fewer rays or bounces, or a higher least energy"
                ).format(most=MOST)
            ) from None
    return surfaces, drawn


def _sources(context, source, depsgraph):
    """Of each source its name, its matrix (4, 4), and whether it is a sun."""
    scene = context.scene
    if source == "CURSOR":
        return [("cursor", np.array(scene.cursor.matrix), False)]
    things = _lamps(context) if source == "LAMP" else [scene.camera] if scene.camera else []
    if not things:
        raise ValueError(
            pgettext_rpt("Light paths: no lamp is selected, and there is not just one; select a lamp")
            if source == "LAMP"
            else pgettext_rpt("Light paths: the scene has no camera; add one, or choose another source")
        )
    return [
        (
            f"lamp {thing.name}" if source == "LAMP" else "camera",
            np.array(thing.evaluated_get(depsgraph).matrix_world),
            thing.type == "LIGHT" and thing.data.type == "SUN",
        )
        for thing in things
    ]


def _lamps(context):
    """The selected lamps; where none is, the scene's lamp if there is just one."""
    chosen = [thing for thing in context.selected_objects if thing.type == "LIGHT"]
    if not chosen:
        chosen = [thing for thing in context.scene.objects if thing.type == "LIGHT"]
        chosen = chosen if len(chosen) == 1 else []
    return chosen


def _rays(settings, matrix, is_sun, middle, size, cursor):
    """Origins and directions (N, 3) of the rays of one source, whose target is at `middle`."""
    place = matrix[:3, 3]
    if settings.aim == "TARGET" and np.linalg.norm(middle - place) < 1e-3 * size:
        # as in a new file, where cursor and cube are both at the origin: in there nothing would be bent
        place = middle - (size, 0, 0)
    if is_sun or settings.aim == "FORWARD":
        axis = -matrix[:3, 2]
    else:
        axis = np.array(settings.direction) if settings.aim == "DIRECTION" else middle - place
    if not np.linalg.norm(axis) > 0:
        raise ValueError(
            pgettext_rpt("Light paths: the direction of the rays is zero; give another, or choose another aim")
        )
    axis = axis / np.linalg.norm(axis)
    if is_sun:
        # from nowhere near: a beam that is centred on the target, and starts outside of everything that bends
        place = (middle if settings.aim == "TARGET" else np.array(cursor.location)) - axis * size
    # upright, turned by the roll; about the vertical it starts at the y axis
    upright = np.array((0.0, 0.0, 1.0) if abs(axis[2]) < 0.9999 else (0.0, 1.0, 0.0))
    upright -= axis * (axis @ upright)
    upright /= np.linalg.norm(upright)
    up = math.cos(settings.roll) * upright + math.sin(settings.roll) * np.cross(axis, upright)
    spread = np.linspace(-0.5, 0.5, settings.rays)[:, None] if settings.rays > 1 else np.zeros((1, 1))
    if is_sun or settings.arrangement == "BEAM":
        return place + settings.width * spread * up, np.broadcast_to(axis, (settings.rays, 3))
    if settings.arrangement == "FAN":
        directions = np.cos(settings.angle * spread) * axis + np.sin(settings.angle * spread) * up
    else:
        # equal steps of height on the unit sphere, each turned by the golden angle, are spread evenly
        step = np.arange(settings.rays)[:, None]
        cosine = 1 - (1 - math.cos(settings.angle / 2)) * (step + 0.5) / settings.rays
        turn = step * math.pi * (3 - math.sqrt(5))
        across = np.cos(turn) * up + np.sin(turn) * np.cross(axis, up)
        directions = cosine * axis + np.sqrt(1 - cosine**2) * across
    return np.broadcast_to(place, directions.shape), directions


# ---------------------------------------------------------------- how they are drawn


def _draw_paths(scene, source, paths, thickness, through):
    """Replace the curves of `source` in a bpy.types.Scene by those of physics.rays.Paths."""
    _remove([thing for thing in scene.objects if thing.get(MARK) == source])
    collection = _collection_of(scene)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[MARK] = True
        scene.collection.children.link(collection)
    radius = np.repeat((paths.energy**THINNING).astype(np.float32)[:, None], 2, axis=1)
    if source == "camera":
        # pointed at the lens: who looks through the camera would look into tubes, and see nothing else
        radius[paths.depth == 0, 0] = 0
    ends = np.stack([np.insert(paths.start, 3, 1, axis=1), np.insert(paths.end, 3, 1, axis=1)], axis=1)
    ends = ends.reshape(-1, 8).astype(np.float32)
    for kind in Kind:
        chosen = np.flatnonzero(paths.kind == kind)
        if not len(chosen):
            continue
        curve = bpy.data.curves.new(f"{kind.name.capitalize()} {source}", "CURVE")
        curve.dimensions = "3D"
        curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = thickness / 2, 1, True
        curve.materials.append(_material(kind, through))
        for segment in chosen:
            points = curve.splines.new("POLY").points
            points.add(1)
            points.foreach_set("co", ends[segment])
            points.foreach_set("radius", radius[segment])
        thing = bpy.data.objects.new(curve.name, curve)
        thing[MARK] = source
        # a camera sees them, and through interfaces if wished; nothing is lit or shaded by them
        thing.visible_diffuse = thing.visible_glossy = thing.visible_volume_scatter = thing.visible_shadow = False
        thing.visible_transmission = through
        collection.objects.link(thing)


def _material(kind, through):
    """The file's material for that kind of path, made on first use: it glows, and is not looked for as a lamp."""
    mark = kind.name if through else f"{kind.name}, not inside"
    material = next((m for m in bpy.data.materials if m.get(MARK) == mark and not m.library), None)
    if material is not None:
        return material
    material = bpy.data.materials.new(f"Light Path {kind.name.lower()}")
    material[MARK] = mark
    material.diffuse_color = (*COLORS[kind], 1.0)
    material.cycles.emission_sampling = "NONE"
    nodes = Nodes(empty_tree(material))
    shader = nodes.add("ShaderNodeEmission", inputs={"Color": COLORS[kind]})
    if not through:
        # a ray bent backwards still counts as the camera's; the bend counts as a transparent surface before this one
        before = nodes.add("ShaderNodeLightPath").outputs["Transparent Depth"]
        clear = nodes.add("ShaderNodeBsdfTransparent")
        behind = nodes.math("GREATER_THAN", before, 0.5)
        shader = nodes.add("ShaderNodeMixShader", inputs={0: behind, 1: shader.outputs[0], 2: clear.outputs[0]})
    nodes.end(shader)
    return material


def _collection_of(scene):
    """The collection of light paths in that scene, None where it has none."""
    return next((collection for collection in scene.collection.children_recursive if collection.get(MARK)), None)


def _remove(things):
    curves = {thing.data for thing in things}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove([curve for curve in curves if curve.users == 0])


CLASSES = (NIM_PG_rays, NIM_OT_light_paths, NIM_OT_light_paths_clear, NIM_PT_light_paths)


def register():
    """Add the settings that each scene keeps."""
    bpy.types.Scene.nim_rays = PointerProperty(
        type=NIM_PG_rays, name="Light Paths", description="How the light paths of this scene are drawn"
    )


def unregister():
    """Take them back."""
    del bpy.types.Scene.nim_rays

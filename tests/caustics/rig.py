# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of caustics are made of: small scenes in the dark, a bake of few photons."""

import bpy
import numpy as np

from nim_addon import caustics
from nim_addon.caustics.photons import Landed, Tracer
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage


def bake(scene, **options):
    return caustics.bake(scene, **{"photons": 1 << 16, "texels": 128} | options)


def mesh_object(name, shape, material, location=(0, 0, 0), slot="DATA"):
    """An object of vertices and faces, its material in its own slot ("OBJECT") or in that of its mesh."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(shape[0]).tolist(), [], shape[1])
    data.materials.append(None)
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)
    obj.material_slots[0].link = slot
    obj.material_slots[0].material = material
    return obj


def material_of(shader, name="Material", **inputs):
    """A material of one shader node."""
    material = bpy.data.materials.new(name)
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add(shader, inputs=inputs))
    return material


def painted(name, color=(0.5, 0.5, 0.5)):
    return material_of("ShaderNodeBsdfDiffuse", name, Color=color)


def dark_world():
    world = bpy.data.worlds.new("Dark")
    empty_tree(world)
    return world


def dark_scene(lamp, energy, height, eye, width):
    """The scene of the file, dark but for a lamp at that height, and an eye at another that looks down on so many metres."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 4
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.world = dark_world()
    data = bpy.data.lights.new("Lamp", lamp)
    data.energy = energy
    obj = bpy.data.objects.new("Lamp", data)
    obj.location.z = height
    scene.collection.objects.link(obj)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", width, (0, 0, eye)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene


def over_floor(material, shape, *, name="Surface", albedo=(0.5, 0.5, 0.5), size=64, backend="nodes"):
    """A Stage of a shape of that name over a wide floor at z = -1; without it where the material is None."""
    stage = Stage("surface", (size, size), backend)
    stage.mesh("Floor", *shapes.rectangle((-9, -9), (9, 9), -1.0), surfaces.plain("Floor", albedo))
    if material:
        stage.mesh(name, *shape, material)
    return stage


def sheet(half):
    """A square at z = 0 that reaches as far as `half` either way."""
    return shapes.rectangle((-half, -half), (half, half))


def floor_eye(stage, width):
    """In the dark, an eye between the surface and the floor, which sees so many metres of what the floor itself shines with."""
    camera = stage.camera((0, 0, -0.5), (0, 0, -1), 40)
    camera.data.type, camera.data.ortho_scale = "ORTHO", width
    stage.world(dark_world())
    stage.scene.cycles.max_bounces = 0
    return stage.scene


def landed_of(scene, light, photons, passes):
    """Photons of a light, about so many in each of the passes: the name (N,) of the object where each landed, and a Landed."""
    with Tracer(scene) as tracer:
        batches = list(tracer.trace(light, photons, passes))
        names = np.array([chart.name for chart in tracer.charts])
    columns = ("side", "place", "power", "share", "nm")
    landed = Landed(*(np.concatenate([getattr(batch, column) for batch in batches]) for column in columns))
    return names[landed.chart], landed

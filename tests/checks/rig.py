# SPDX-License-Identifier: GPL-3.0-or-later
"""A floor under a wide slab of n = -1, which reflects nothing: in the light of a sun it is as bright as without."""

import math

import bpy

from nim_addon import checks
from nim_addon.cycles.material import interface_material, interface_node
from nim_addon.cycles.nodes import empty_tree
from nim_addon.physics import Medium


def build(scene):
    """Put the floor, the slab, the sun and a camera above them into a scene."""
    scene.world = bpy.data.worlds.new("World")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    slab = add(scene, "Slab", box(200.0, 1.8, 2.2), interface_material("NIM", Medium(-1.0), backend="nodes"))
    slab.data.validate()
    matt = bpy.data.materials.new("Matt")
    tree = empty_tree(matt)
    white = tree.nodes.new("ShaderNodeBsdfDiffuse")
    white.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(white.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    add(scene, "Floor", box(2.0, -0.1, 0.0), matt)
    light = bpy.data.lights.new("Sun", "SUN")
    light.angle, light.energy = math.radians(60.0), math.pi
    scene.collection.objects.link(bpy.data.objects.new("Sun", light))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 1), "ORTHO", 1.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.cycles.samples = 256


def box(half, bottom, top):
    mesh = bpy.data.meshes.new("Box")
    points = [(x, y, z) for z in (bottom, top) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))]
    sides = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    mesh.from_pydata(points, [], [(3, 2, 1, 0), (4, 5, 6, 7), *sides])
    return mesh


def add(scene, name, mesh, material):
    obj = bpy.data.objects.new(name, mesh)
    mesh.materials.append(material)
    scene.collection.objects.link(obj)
    return obj


def codes(scene):
    return [problem.code for problem in checks.problems(scene)]


def slab():
    return bpy.data.objects["Slab"]


def sun():
    return bpy.data.objects["Sun"]


def nim():
    return bpy.data.materials["NIM"]


def own_group(scene):
    inner = bpy.data.node_groups.new("Mine", "ShaderNodeTree")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    node = interface_node(inner, Medium(-1.5), backend="nodes")
    inner.links.new(node.outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
    material = bpy.data.materials.new("Grouped")
    tree = empty_tree(material)
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    tree.links.new(group.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    slab().data.materials[0] = material


def dark_tint(scene):
    set_tint((-0.5, 1.5, math.nan))


def set_tint(color):
    nim().node_tree.nodes["NIM Interface"].inputs["Tint"].default_value = (*color, 1.0)

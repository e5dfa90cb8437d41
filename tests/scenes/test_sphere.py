# SPDX-License-Identifier: GPL-3.0-or-later
"""The sphere scene: a sphere that is round, of the medium asked for, built at once."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.scenes.sphere import SphereParameters, build


def evaluated(scene, name):
    """Vertices and normals of the vertices of an object as the final render sees it, about its centre."""
    object_ = scene.objects[name]
    for modifier in object_.modifiers:  # the render's own level; a depsgraph in the background is the viewport's
        if modifier.type == "SUBSURF":
            modifier.levels = modifier.render_levels
    graph = scene.view_layers[0].depsgraph
    scene.view_layers[0].update()
    graph.update()
    mesh = object_.evaluated_get(graph).to_mesh()
    vertices, normals = np.empty((len(mesh.vertices), 3)), np.empty((len(mesh.vertices), 3))
    mesh.vertices.foreach_get("co", vertices.ravel())
    mesh.vertices.foreach_get("normal", normals.ravel())
    edges = np.empty((len(mesh.edges), 2), int)
    mesh.edges.foreach_get("vertices", edges.ravel())
    smooth = all(polygon.use_smooth for polygon in mesh.polygons)
    object_.evaluated_get(graph).to_mesh_clear()
    return vertices, normals, edges, smooth


@pytest.mark.parametrize("name, radius", [("Sphere", 1.0), ("Red", 0.6), ("Blue", 0.35)])
def test_round(name, radius, empty_file):
    scene = build(SphereParameters(companions=True))
    vertices, normals, edges, smooth = evaluated(scene, name)
    assert smooth
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), radius, rtol=1e-5)
    # the normals that bend the light point outwards and are the sphere's own to a seventh of the 0.7 degrees between
    # faces; worst, 0.074, where Blender's even division of one quad meets the next
    assert np.sum(normals * vertices, axis=1).min() / radius > math.cos(math.radians(0.1))

    # The silhouette is a polygon of the longest edges at worst; at 1080p its sagitta must not show.
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 1920, 1080, 100
    longest = np.linalg.norm(np.diff(vertices[edges], axis=1), axis=2).max()
    sagitta = radius - math.sqrt(radius**2 - (longest / 2) ** 2)
    camera = scene.camera
    distance = (camera.location - scene.objects[name].location).length
    pixel = 2 * math.tan(camera.data.angle / 2) / 1920
    assert sagitta / (distance - radius) / pixel < 0.1


@pytest.mark.parametrize("n, mu", [(-1.5, None), (1.33, None), (-4.1, -25)])
def test_medium_is_on_the_sockets(n, mu, empty_file):
    scene = build(SphereParameters(n=n, mu=mu))
    (material,) = scene.objects["Sphere"].data.materials
    sockets = {s.name: s.default_value for s in material.node_tree.nodes["NIM Interface"].inputs}
    assert sockets["Index Inside"] == pytest.approx(n)
    assert sockets["Permeability Inside"] == (mu or math.copysign(1, n))
    assert (sockets["Index Outside"], sockets["Permeability Outside"]) == (1, 1)
    assert tuple(sockets["Tint"]) == (1, 1, 1, 1)


def test_companions_stand_behind_and_in_front(empty_file):
    assert set(build(SphereParameters()).objects.keys()) == {"Ground", "Sphere", "Camera"}
    scene = build(SphereParameters(companions=True))
    assert set(scene.objects.keys()) == {"Ground", "Sphere", "Red", "Blue", "Camera"}
    eye = np.array(scene.camera.location)
    far = {name: np.linalg.norm(np.array(scene.objects[name].location) - eye) for name in ("Red", "Sphere", "Blue")}
    assert far["Blue"] < far["Sphere"] < far["Red"]
    # nothing stands in anything else or in the ground
    balls = [(np.array(scene.objects[name].location), r) for name, r in (("Sphere", 1), ("Red", 0.6), ("Blue", 0.35))]
    for i, (a, r) in enumerate(balls):
        assert a[2] >= r - 1e-6
        for b, s in balls[:i]:
            assert np.linalg.norm(a - b) > r + s


def test_scene_is_whole(empty_file):
    scene = build(SphereParameters())
    assert scene.camera.name in scene.objects and scene.world.node_tree is not None
    assert bpy.context.scene != scene, "the window's own scene is not switched under a script"

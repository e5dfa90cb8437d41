# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of media that absorb: straight ways through them against closed forms, and nothing absorbed twice."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles import meshes, spectral
from nim_addon.cycles.absorption import MARK
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.figures import probes
from nim_addon.physics import MEDIA, Interface, Medium
from nim_addon.physics.colour import absorption_of_channels, weights
from nim_addon.scenes import glass, pool, scene_type, sea, surfaces
from nim_addon.scenes.stage import aim

pytestmark = pytest.mark.usefixtures("empty_file")
BACKENDS = ("osl", "nodes")
NEAR = 0.01  # metres before the camera that it does not see
ASIDE = 0.4, 0.2  # where rays go down: no edge of a mesh is there


def built(name, *settings, backend="nodes", world=0.0):
    """A scene to be measured, under a uniform sky."""
    kind = scene_type(name)
    scene = kind.build(kind.parameters.read(settings), backend)
    scene.cycles.samples = 64
    probes.set_up(scene)
    scene.world = bpy.data.worlds.new("Uniform")
    nodes = Nodes(empty_tree(scene.world))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": (1, 1, 1), "Strength": world}), "World")
    scene.render.resolution_x = scene.render.resolution_y = 16
    return scene


def shine(scene, name, strength=1.0):
    probes.paint(probes.find(scene, name), surfaces.shining(name, lambda nodes: (1, 1, 1), strength))


def same(pixels, wanted):
    """Whether the mean of a picture is as wanted, by its own standard error."""
    values = pixels.mean(axis=2).ravel().astype(float)
    error = values.std(ddof=1) / math.sqrt(values.size)
    assert abs(values.mean() - wanted) < 4 * error + 2e-5 * wanted, (values.mean(), wanted, error)
    assert error < 0.02 * wanted


def reflected(medium, outside=MEDIA["air"]):
    return float(Interface(Medium.parse(medium), outside).fresnel(1.0).R)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("medium", ["n=1.33,length=1", "n=-1.33,length=1", "n=-1.5,length=1,mu=-4"])
def test_along_the_axis_of_the_sphere(medium, backend, render):
    scene = built("sphere", f"n={medium}", backend=backend, world=1.0)
    probes.show_only(scene, "Sphere")
    aim(scene.camera, (0, -7, 1.001), (0, 0, 1.001), 0.02)
    R, once = reflected(medium), math.exp(-2)
    same(render(scene), R + (1 - R) ** 2 * once / (1 - R * once))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("n", [1.33, -1.33])
def test_down_to_the_floor_of_the_pool(n, backend, render):
    scene = built("pool", f"liquid=n={n},length=2", "waves=0", "view=top", backend=backend)
    shine(scene, "Basin")
    aim(scene.camera, (*ASIDE, 7), (*ASIDE, 0), 0.02)
    same(render(scene), (1 - reflected(str(n))) * math.exp(-(pool.LEVEL - pool.FLOOR) / 2))


@pytest.mark.parametrize("n", [1.33, -1.33])
def test_from_an_eye_in_the_pool_to_its_wall_and_to_the_sky(n, render):
    scene = built("pool", f"liquid=n={n},length=2", "waves=0.1", "view=window")
    shine(scene, "Basin")
    aim(scene.camera, (0, 0, pool.FLOOR + 0.3), (1, 0, pool.FLOOR + 0.3), 0.02)
    same(render(scene), math.exp(-(pool.HALF[0] - NEAR) / 2))
    scene = built("pool", f"liquid=n={n},length=2", "waves=0", "view=window", world=1.0)
    shine(scene, "Basin", 0.0)
    aim(scene.camera, (*ASIDE, pool.FLOOR + 0.3), (*ASIDE, 0), 0.02)
    same(render(scene), (1 - reflected(str(n))) * math.exp(-(pool.LEVEL - pool.FLOOR - 0.3 - NEAR) / 2))


@pytest.mark.parametrize("n", [1.33, -1.33])
def test_up_from_the_sea(n, render):
    scene = built("sea", f"liquid=n={n},length=2", "waves=0", world=1.0)
    shine(scene, "Deep", 0.0)
    aim(scene.camera, (*ASIDE, -sea.DEPTH), (*ASIDE, 0), 0.02)
    same(render(scene), (1 - reflected(str(n))) * math.exp(-(sea.DEPTH - NEAR) / 2))


def through(first, second, once):
    """R from above, T and R from below of two layers, each the same three, with what is left of one way between them."""
    (R, T, R_below), (other, on, other_below) = first, second
    series = 1 - R_below * other * once**2
    return (
        R + T * T * once**2 * other / series,
        T * on * once / series,
        other_below + on * on * once**2 * R_below / series,
    )


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("straw", ["no", "yes"])
@pytest.mark.parametrize("n", [1.33, -1.33])
def test_down_through_the_glass(n, straw, backend, render):
    scene = built("glass", f"liquid=n={n},length=0.05", f"straw={straw}", "view=top", backend=backend)
    shine(scene, "Table")
    place = -0.005, 0.022
    aim(scene.camera, (*place, 0.6), (*place, 0), 0.004)
    faces = [reflected(str(n)), reflected("glass", Medium(n)), reflected("glass")]
    top, wall, foot = ((R, 1 - R, R) for R in faces)
    _, T, _ = through(through(top, wall, math.exp(-(glass.LEVEL - glass.BASE) / 0.05)), foot, 1.0)
    same(render(scene), T)


@pytest.mark.parametrize("n", [1.33, -1.33])
def test_the_body_in_the_glass_takes_what_its_faces_do(n, render):
    """Each way of absorbing, in all of a picture: by blocks, against their own standard error."""
    block, pictures = 8, []
    for seed, immersed in enumerate((False, True)):
        scene = built("glass", "liquid=none", "straw=no", world=1.0)
        stage = type("Stage", (glass.Stage,), {"__init__": lambda self: None})()
        stage.name, stage.collection, stage.backend = "glass", scene.collection, "nodes"
        bpy.data.objects.remove(probes.find(scene, "Glass"))
        glass.glass(stage, Medium.parse(f"n={n},length=0.05"), immersed)
        assert any(MARK in node for m in bpy.data.materials for node in m.node_tree.nodes) == immersed
        scene.render.resolution_x, scene.render.resolution_y = 5 * block, 5 * block
        scene.cycles.seed, scene.cycles.sample_subset_length = seed, 128
        scene.cycles.samples = 512
        pictures.append(render(scene).astype(float).mean(axis=2))
        bpy.data.scenes.remove(scene)
        for material in list(bpy.data.materials):
            bpy.data.materials.remove(material)
    noise = (pictures[0] - pictures[1]).reshape(5, block, 5, block).transpose(0, 2, 1, 3).reshape(25, block * block)
    error = noise.std(axis=1, ddof=1) / block
    z = noise.mean(axis=1) / np.maximum(error, 1e-6)
    assert np.abs(z).max() < 4.5 and np.sqrt(np.mean(np.square(z))) < 1.6, z.round(1)


def shape(scene, name):
    """Vertices (V, 3), the corners' vertices (C,) and normals (C, 3), how many faces meet at each edge (E,), of a mesh."""
    mesh = probes.find(scene, name).data
    meet = np.zeros(len(mesh.edges), int)
    np.add.at(meet, [loop.edge_index for loop in mesh.loops], 1)
    normals = np.array([corner.vector for corner in mesh.corner_normals])
    return meshes.vertices(mesh), meshes.corners(mesh), normals, meet


@pytest.mark.parametrize("name", ["pool", "sea"])
@pytest.mark.parametrize("waves", [0.0, 0.1])
def test_only_what_absorbs_has_a_body(name, waves):
    vertices, corners, normals, meet = shape(built(name, "liquid=-1.33", f"waves={waves}"), "Liquid")
    assert (meet == 1).any()
    own, _, smooth, closed = shape(built(name, "liquid=n=-1.33,length=0.5", f"waves={waves}"), "Liquid")
    assert (closed == 2).all()
    # the surface is where it was, and as smooth; the sides of the sea's lie beyond its walls
    inner = np.abs(vertices[:, :2]).max(axis=1) < (sea.HALF if name == "sea" else np.inf)
    np.testing.assert_array_equal(own[: len(vertices)][inner], vertices[inner])
    kept = inner[corners]
    np.testing.assert_allclose(smooth[: len(normals)][kept], normals[kept], atol=1e-3)
    floor, half = (pool.FLOOR, pool.HALF) if name == "pool" else (-sea.GROUND, [sea.HALF] * 2)
    assert own[:, 2].min() < floor and (np.abs(own[:, :2]).max(axis=0) > half).all()


def test_only_what_stands_in_a_liquid_that_absorbs_gives_the_glass_a_body():
    for settings, has in (
        (["liquid=-1.33"], False),
        (["liquid=n=-1.33,length=0.05"], True),
        (["liquid=n=-1.33,length=0.05", "straw=no"], False),
        (["liquid=nim-causal"], False),
    ):
        assert ("Liquid" in [obj.name for obj in built("glass", *settings).objects]) == has
    *_, meet = shape(built("glass", "liquid=n=-1.33,length=0.05"), "Liquid")
    assert (meet == 2).all()


WINE = "n=1.34,k=table(380 2e-6 520 2e-6 600 2e-7 730 1e-7)"


def test_a_coloured_liquid_is_of_one_wavelength_or_of_three_channels(render):
    # in OSL: nodes let things drift by 0.1 mm before the camera, 0.3 % of such a way
    scene = built("pool", f"liquid={WINE}", "waves=0", "view=top", backend="osl")
    shine(scene, "Basin")
    aim(scene.camera, (*ASIDE, pool.FLOOR + 0.1), (*ASIDE, pool.FLOOR), 0.02)
    way = 0.1 - NEAR
    same(render(scene), math.exp(-way * Medium.parse(WINE).absorption()))
    spectral.set_neutral(650.0)
    same(render(scene), math.exp(-way * Medium.parse(WINE).absorption(650)))
    spectral.set_neutral()
    spectral.set_up(scene, "osl")
    nm, w = weights()
    alpha = 4 * np.pi * Medium.parse(WINE).spectrum(nm)[0].imag / (nm * 1e-9)
    # of powers of two, from the first on, samples have wavelengths that are spread evenly
    scene.cycles.use_sample_subset, scene.cycles.samples = False, 256
    picture = render(scene)
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), np.exp(-way * absorption_of_channels(alpha)), rtol=1e-4)
    # and near to the light that is really left, which is no exponential
    left = (w * np.exp(-alpha * way)[:, None]).mean(axis=0)
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), left, atol=0.08)
    spectral.undo(scene)
    same(render(scene), math.exp(-way * Medium.parse(WINE).absorption()))

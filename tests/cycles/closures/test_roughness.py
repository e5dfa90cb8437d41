# SPDX-License-Identifier: GPL-3.0-or-later
"""Rough interfaces: what one face does to a beam, beside a microfacet model of its own in numpy, and Blender's own Glass.

A beam falls on a flat face, and the world says by its colour which way light went. The model here draws facets from all of
them and weighs them as Walter and others (2007, equation 41) do; the shader draws those that the viewer sees.
"""

import math
import re
from pathlib import Path

import bpy
import mathutils
import numpy as np
import pytest

from nim_addon.caustics.bending import check
from nim_addon.cycles import settings
from nim_addon.cycles.casting import Meshes
from nim_addon.cycles.closures import INTERFACE
from nim_addon.cycles.material import interface_material, interface_nodes, is_rough
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.render import pixels_of
from nim_addon.cycles.visibility import as_rendered, shown
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import shapes
from nim_addon.scenes.parameters import file_name
from nim_addon.scenes.sphere import SphereParameters, build

ROOT = Path(__file__).parents[3]
both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])
SIDE, SAMPLES = 48, 64  # 147,456 paths
FACETS = 1_000_000
SIGMAS = 4.0
AIR = Medium(1.0)

# ------------------------------------------------------------------------------------------------ the model


def masking(alpha, cosine):
    square = np.maximum(cosine**2, 1e-12)
    return 0.5 * (np.sqrt(1 + alpha**2 * (1 - square) / square) - 1)


def model(interface, alpha, angle, seed=1):
    """Means over facets, and their standard errors, of a beam along (sin, 0, -cos) of an angle in degrees: six numbers.

    What is reflected: R, R (2 + x), R z, of its direction (x, y, z); what is let through: T, T (2 + x), -T z.
    """
    random = np.random.default_rng(seed)
    tangent = alpha * np.sqrt(1 / np.maximum(random.random(FACETS), 1e-12) - 1)
    turn, cosine = 2 * np.pi * random.random(FACETS), 1 / np.sqrt(1 + tangent**2)
    sine = cosine * tangent
    m = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    to_viewer = np.array([-math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))])
    cos_i = m @ to_viewer
    R = np.ones(FACETS)
    R[cos_i > 0] = interface.fresnel(cos_i[cos_i > 0]).R
    q = interface.outside.n / interface.inside.n
    cos_t = np.sqrt(np.maximum(1 - q**2 * (1 - cos_i**2), 0))
    mirrored = 2 * cos_i[:, None] * m - to_viewer
    through = (q * cos_i - cos_t)[:, None] * m - q * to_viewer
    weight = np.where(cos_i > 0, cos_i / (to_viewer[2] * cosine), 0)
    rows = []
    for share, way, side in ((R, mirrored, 1), (1 - R, through, -1)):
        z = side * way[:, 2]
        kept = np.where(z > 0, 1 / (1 + masking(alpha, to_viewer[2]) + masking(alpha, z)), 0) * weight * share
        rows += [kept, kept * (2 + way[:, 0]), kept * z]
    return np.array([np.mean(rows, axis=1), np.std(rows, axis=1) / math.sqrt(FACETS)])


# ------------------------------------------------------------------------------------------------ the beam


def beam(material, angle, sky, flipped=False, backend="osl", side=SIDE, samples=SAMPLES):
    """A scene of a flat face that an orthographic camera sees at an angle in degrees; sky(nodes, x, y, z) colours it."""
    scene = bpy.data.scenes.new("Beam")
    settings.lossless(scene, backend)
    scene.cycles.samples, scene.cycles.seed, scene.cycles.pixel_filter_type = samples, 1, "BOX"
    scene.world = bpy.data.worlds.new("Sky")
    nodes = Nodes(empty_tree(scene.world))
    away = nodes.scale(nodes.add("ShaderNodeNewGeometry").outputs["Incoming"], -1.0)
    x, y, z = nodes.add("ShaderNodeSeparateXYZ", inputs={0: away}).outputs
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": sky(nodes, x, y, z)}), "World")
    scene.world.cycles.sampling_method = "NONE"
    vertices, faces = shapes.rectangle((-5, -5), (5, 5))[:2]
    mesh = bpy.data.meshes.new("Face")
    mesh.from_pydata(vertices, [], [face[::-1] for face in faces] if flipped else faces)
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Face", mesh))
    theta = math.radians(angle)
    camera = bpy.data.objects.new("Beam", bpy.data.cameras.new("Beam"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.5
    axes = (math.cos(theta), 0, math.sin(theta)), (0, 1, 0), (-math.sin(theta), 0, math.cos(theta))
    frame = mathutils.Matrix(axes).transposed().to_4x4()
    frame.translation = 4 * mathutils.Vector(axes[2])
    camera.matrix_world = frame
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.resolution_percentage = 100
    return scene


def one_way(side):
    """A sky of (1, 2 + x, |z|) on one side, above (1) or below (-1), and black on the other."""

    def sky(nodes, x, y, z):
        here = nodes.math("GREATER_THAN", nodes.math("MULTIPLY", z, float(side)), 0.0)
        color = {0: 1.0, 1: nodes.math("ADD", x, 2.0), 2: nodes.math("ABSOLUTE", z)}
        return nodes.scale(nodes.add("ShaderNodeCombineXYZ", inputs=color).outputs[0], here)

    return sky


def measured(make, angle, flipped=False, backend="osl"):
    """The six numbers of model() and their standard errors, in Cycles; make() gives the material."""
    rows = []
    for side in (1, -1):
        pixels = pixels_of(beam(make(), angle, one_way(side), flipped, backend)).reshape(-1, 3).astype(float)
        rows.append([pixels.mean(axis=0), pixels.std(axis=0, ddof=1) / math.sqrt(len(pixels))])
    return np.concatenate(rows, axis=1)


def agree(got, expected):
    z = (got[0] - expected[0]) / np.hypot(got[1], expected[1])
    assert np.abs(z).max() < SIGMAS, (z, got[0], expected[0])


MEDIA = {
    "nim": (Medium(-1.5), AIR, 60, False),
    "nim, from inside": (Medium(-1.5), AIR, 30, True),
    "nim of 1.33": (Medium(-1.33), AIR, 0, False),
    "nim in water": (Medium(-1.5), Medium(1.33), 60, True),
    "a mirror of a nim": (Medium(-1.5, -10.0), AIR, 60, False),
    "magnetic": (Medium(1.5, 2.0), AIR, 60, False),
}


@both_backends
@pytest.mark.parametrize("alpha", [0.05, 0.3])
@pytest.mark.parametrize("inside, outside, angle, flipped", MEDIA.values(), ids=MEDIA)
def test_a_face_sends_light_as_the_model_does(inside, outside, angle, flipped, alpha, backend, empty_file):
    def make():
        return interface_material("Rough", inside, outside, backend=backend, roughness=math.sqrt(alpha))

    seen = Interface(inside, outside)
    expected = model(seen.reversed() if flipped else seen, alpha, angle)
    agree(measured(make, angle, flipped, backend), expected)


@both_backends
@pytest.mark.parametrize("alpha", [0.05, 0.3])
@pytest.mark.parametrize("angle", [0, 60])
def test_glass_is_blenders_own(angle, alpha, backend, empty_file):
    """R, T and the mean bend; a bent normal, which is the true one here, keeps Blender's Glass from being used."""
    roughness = math.sqrt(alpha)

    def native():
        material = bpy.data.materials.new("Glass")
        nodes = Nodes(empty_tree(material))
        inputs = {"IOR": 1.5, "Roughness": roughness}
        nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs=inputs, distribution="GGX"))
        return material

    def ours(bent):
        material = interface_material("Rough", Medium(1.5), backend=backend, roughness=roughness)
        if bent:
            nodes = Nodes(material.node_tree)
            up = nodes.add("ShaderNodeCombineXYZ", inputs={2: 1.0}).outputs[0]
            nodes.feed(interface_nodes(material)[0].inputs["Normal"], up)
        return material

    expected = measured(native, angle, backend=backend)
    agree(measured(lambda: ours(True), angle, backend=backend), expected)
    agree(measured(lambda: ours(False), angle, backend=backend), expected)


@both_backends
@pytest.mark.parametrize("n", [1.5, -1.5, -1.33])
def test_a_nim_blurs_more_than_glass(n, backend, empty_file):
    """Half of the facets tilt by less than alpha, which turns light by (1 - 1 / n) times as much: by 1/3 or by 5/3."""
    alpha = 0.01
    reach = math.sin(alpha * abs(1 - 1 / n))

    def sky(nodes, x, y, z):
        wide = nodes.math("ADD", nodes.math("MULTIPLY", x, x), nodes.math("MULTIPLY", y, y))
        color = {0: nodes.math("LESS_THAN", wide, reach**2), 1: 1.0}
        below = nodes.math("LESS_THAN", z, 0.0)
        return nodes.scale(nodes.add("ShaderNodeCombineXYZ", inputs=color).outputs[0], below)

    material = interface_material("Rough", Medium(n), backend=backend, roughness=math.sqrt(alpha))
    near, all_of_it, _ = pixels_of(beam(material, 0, sky, backend=backend)).reshape(-1, 3).astype(float).T
    error = near.std(ddof=1) / math.sqrt(len(near)) / all_of_it.mean()
    assert abs(near.mean() / all_of_it.mean() - 0.5) < SIGMAS * error
    assert error < 0.002


def test_the_loss_that_is_written_is_what_is_lost(empty_file):
    rows = re.findall(
        r"^\| (0\.\d+) \| (-?1\.\d+) \| (\d\.\d+) \| (\d\.\d+) \| (\d\.\d+) \| (\d\.\d+) \|$",
        (ROOT / "docs" / "physics.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    assert len(rows) == 6
    for row in rows:
        alpha, n, *written = (float(word) for word in row)
        for value, (flipped, angle) in zip(written, ((False, 0), (False, 60), (True, 0), (True, 60)), strict=True):
            make = lambda: interface_material("Rough", Medium(n), backend="osl", roughness=math.sqrt(alpha))  # noqa: E731, B023
            pixels = pixels_of(beam(make(), angle, lambda nodes, x, y, z: (1.0, 1.0, 1.0, 1.0), flipped))[..., 0]
            error = pixels.std(ddof=1) / SIDE
            assert abs(pixels.mean() - value) < SIGMAS * error + 5e-5, (row, pixels.mean())


@both_backends
def test_no_two_samples_meet_the_same_facet(backend, empty_file):
    """The noise of a pixel falls with its samples, and neighbours know nothing of each other: no structure is seen."""
    spread = {}
    for samples in (1, 16):
        # which reflects everything, so that nothing but the facets is left to chance
        material = interface_material("Rough", Medium.of(-2.0, 1.0), backend=backend, roughness=0.5)
        scene = beam(material, 30, one_way(1), backend=backend, side=128, samples=samples)
        pixels = pixels_of(scene).astype(float)[..., 1]
        spread[samples] = pixels.var()
        noise = (pixels - pixels.mean()) / pixels.std()
        for step in (1, 2, 3):
            for a, b in ((noise[step:], noise[:-step]), (noise[:, step:], noise[:, :-step])):
                assert abs(np.mean(a * b)) < SIGMAS / math.sqrt(a.size)
        power = np.abs(np.fft.rfft2(noise)) ** 2 / noise.size
        assert power.max() < 20  # of white noise 1 on average, and 20 once in 5e8 times
    fourth = np.mean(noise**4)  # which says how well a spread is known
    assert abs(16 * spread[16] / spread[1] - 1) < SIGMAS * math.sqrt(2 * fourth / noise.size)


@both_backends
def test_a_lamp_without_size_is_mirrored(backend, empty_file):
    """A sun is never met by chance; in the middle of its mirror image it has D F G / (4 cos cos) of a GGX surface."""
    alpha, angle = 0.1, 40.0
    theta = math.radians(angle)
    material = interface_material("Rough", Medium(-1.5), backend=backend, roughness=math.sqrt(alpha))
    scene = beam(material, angle, lambda nodes, x, y, z: (0.0, 0.0, 0.0, 1.0), backend=backend, side=8, samples=4)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 2.0, 0.0
    sun.rotation_euler = (0, theta, 0)  # it comes from where the camera's beam is mirrored to
    scene.collection.objects.link(sun)
    R = float(Interface(Medium(-1.5)).fresnel(math.cos(theta)).R)
    G = 1 / (1 + 2 * masking(alpha, math.cos(theta)))
    expected = 2.0 * R * G / (math.pi * alpha**2) / (4 * math.cos(theta))
    assert pixels_of(scene).mean() == pytest.approx(expected, rel=1e-3)


# ------------------------------------------------------------------------------------------------ 0 is smooth


@pytest.mark.parametrize("medium", [Medium(-1.5), Medium(1.5), Medium(1.5, 2.0), Medium(-1.33, -10.0)], ids=str)
def test_without_roughness_its_nodes_are_none(medium, empty_file):
    """Bit for bit, and without what draws the facets: Cycles leaves all of it away."""
    pictures = []
    for cut in (False, True):
        material = interface_material("Smooth", medium, backend="nodes")
        if cut:
            group = interface_nodes(material)[0].node_tree
            for node in [node for node in group.nodes if node.type in ("TEX_WHITE_NOISE", "BSDF_PRINCIPLED")]:
                group.nodes.remove(node)
        pictures.append(smooth_picture(material, "nodes"))
    assert np.array_equal(*pictures)


def test_without_roughness_the_shader_is_the_smooth_one(empty_file, monkeypatch):
    material = interface_material("Smooth", Medium(-1.5), backend="osl")
    whole = smooth_picture(material, "osl")
    text = INTERFACE.source()
    smooth = re.sub(r"float alpha = [^;]*;", "float alpha = 0.0;", text)
    assert smooth != text
    monkeypatch.setattr("nim_addon.cycles.closures.script.source", lambda shader: smooth)
    assert np.array_equal(whole, smooth_picture(interface_material("Smooth", Medium(-1.5), backend="osl"), "osl"))


def smooth_picture(material, backend):
    scene = beam(material, 50, one_way(-1), backend=backend, side=32, samples=16)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    return pixels_of(scene)


# ------------------------------------------------------------------------------------------------ what else it meets


@pytest.mark.parametrize("roughness", [-0.1, 1.1, math.nan])
def test_a_roughness_that_is_none_is_refused(roughness, empty_file, one_sentence):
    with pytest.raises(ValueError) as error:
        interface_material("Rough", Medium(-1.5), roughness=roughness)
    one_sentence(error.value.args[0].replace("0.1", "").replace("1.1", ""), "roughness", "from 0")
    assert not bpy.data.materials


@both_backends
def test_caustics_are_of_smooth_interfaces(backend, empty_file, one_sentence):
    check(interface_material("Smooth", Medium(-1.5), backend=backend), "Ball")
    rough = interface_material("Rough", Medium(-1.5), backend=backend, roughness=0.1)
    decided = interface_material("Decided", Medium(-1.5), backend=backend)
    nodes = Nodes(decided.node_tree)
    nodes.feed(interface_nodes(decided)[0].inputs["Roughness"], nodes.add("ShaderNodeTexNoise").outputs[0])
    for material in (rough, decided):
        with pytest.raises(ValueError) as error:
            check(material, "Ball")
        one_sentence(error.value, material.name, "Ball", "rough", "Roughness to 0")


def test_light_paths_know_what_is_rough(empty_file):
    scene = build(SphereParameters(roughness=0.2), "nodes")
    with as_rendered(scene) as depsgraph:
        assert Meshes(shown(scene, depsgraph), depsgraph).rough == {"Sphere"}
    for material in bpy.data.materials:
        for node in interface_nodes(material):
            node.inputs["Roughness"].default_value = 0.0
    with as_rendered(scene) as depsgraph:
        assert Meshes(shown(scene, depsgraph), depsgraph).rough == set()


def test_a_group_of_an_earlier_version_is_smooth(empty_file):
    node = interface_nodes(interface_material("Rough", Medium(-1.5), backend="nodes", roughness=0.3))[0]
    assert is_rough(node)
    items = node.node_tree.interface
    items.remove(next(item for item in items.items_tree if item.name == "Roughness"))
    assert not is_rough(node)


@both_backends
def test_the_sphere_takes_it(backend, empty_file):
    scene = build(SphereParameters.read(["n=-1.33", "roughness=0.3"]), backend)
    sphere = next(obj for obj in scene.objects if obj.name.startswith("Sphere"))
    assert interface_nodes(sphere.data.materials[0])[0].inputs["Roughness"].default_value == pytest.approx(0.3)
    assert file_name("sphere", ["roughness=0.3"]) == "sphere_roughness-0.3"
    with pytest.raises(ValueError, match="roughness"):
        SphereParameters(roughness=1.5)

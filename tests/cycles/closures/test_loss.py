# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of media with loss: R as 40 digits have it, what is absorbed in a surface, and on the way to one."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures import INTERFACE, script
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.stage import Stage

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])
QUANTITIES = ("Index", "Extinction", "Permeability", "Permeability Loss")


@pytest.fixture(scope="module")
def reference(data):
    """(285, ...) rows: the angle, n, k, mu and mu_imag of the incident and of the transmitting medium, and R."""
    rows = np.loadtxt(data / "fresnel_complex.csv.gz", delimiter=",")
    epsilon_i, mu_i, _, mu_t, n_t = rows[:, 2:12].reshape(-1, 5, 2).transpose(1, 0, 2) @ (1, 1j)
    n_i = np.sqrt(epsilon_i) * np.sqrt(mu_i)  # where both are in the upper half plane and neither is negative real
    negative = (epsilon_i.imag == 0) & (epsilon_i.real < 0) & (mu_i.imag == 0) & (mu_i.real < 0)
    n_i = np.where(negative, -np.sqrt(epsilon_i * mu_i), n_i)
    media = [part for n, mu in ((n_i, mu_i), (n_t, mu_t)) for part in (n.real, n.imag, mu.real, mu.imag)]
    return np.column_stack([rows[:, 1], *media, np.minimum(rows[:, 22], 1)])


def reflecting(backend, monkeypatch):
    """A node group of the interface that shines with R."""
    if backend == "osl":
        shown = INTERFACE.source().rstrip().removesuffix("}") + "    BSDF = R * emission();\n}\n"
        monkeypatch.setattr(script, "source", lambda shader: shown)
        return INTERFACE.group("osl")
    group = bpy.data.node_groups.new("Shines", "ShaderNodeTree")
    optics = INTERFACE.build(group, "nodes")
    nodes = Nodes(group)
    shines = nodes.add("ShaderNodeEmission", inputs={"Color": optics.reflected_or_not.inputs[0].links[0].from_socket})
    leave = next(node for node in group.nodes if node.type == "GROUP_OUTPUT")
    nodes.feed(leave.inputs[0], shines.outputs[0])
    return group


def tilted_faces(rows, flipped):
    """Vertices and faces of a quad for each row, side by side along x, tilted so that light from above meets it at its angle."""
    places = np.arange(len(rows))
    # all at y = 0, where a tilt is exact in single precision
    centres = np.stack([places + 0.5, 0 * places, 0 * places], 1)
    theta = np.radians(rows[:, 0])
    up = np.stack([np.zeros(len(rows)), np.cos(theta), np.sin(theta)], 1) * 0.4
    right = np.array([0.4, 0, 0])
    corners = np.stack([centres - right - up, centres + right - up, centres + right + up, centres - right + up], 1)
    faces = np.arange(4 * len(rows)).reshape(-1, 4)
    return corners.reshape(-1, 3), (faces[:, ::-1] if flipped else faces).tolist()


def with_media(mesh, group, rows, flipped):
    """A material of the group, which takes both media of each face from attributes of the mesh."""
    material = bpy.data.materials.new("Shines")
    nodes = Nodes(empty_tree(material))
    sides = ("Inside", "Outside") if flipped else ("Outside", "Inside")
    inputs = {}
    for column, name in enumerate([f"{quantity} {side}" for side in sides for quantity in QUANTITIES], start=1):
        mesh.attributes.new(name, "FLOAT", "FACE").data.foreach_set("value", rows[:, column].astype(np.float32))
        inputs[name] = nodes.add("ShaderNodeAttribute", attribute_name=name).outputs["Fac"]
    nodes.end(nodes.add("ShaderNodeGroup", node_tree=group, inputs=inputs))
    mesh.materials.append(material)


@both_backends
@pytest.mark.parametrize("flipped", [False, True], ids=["from outside", "from inside"])
def test_r_is_that_of_40_digits(reference, flipped, backend, empty_file, monkeypatch, render):
    stage = Stage("loss", (64, 48), backend)
    vertices, faces = tilted_faces(reference, flipped)
    surface = stage.mesh("Faces", vertices, faces, [])
    with_media(surface.data, reflecting(backend, monkeypatch), reference, flipped)
    middle = len(reference) / 2
    camera = stage.camera((middle, 0, 5), (middle, 0, 0), 40)
    camera.data.type, camera.data.ortho_scale = "ORTHO", len(reference)
    scene = stage.scene
    # the first sample goes through the middle of its pixel
    scene.render.resolution_x, scene.render.resolution_y, scene.cycles.samples = len(reference), 5, 1
    got = render(scene)[2, :, 0].astype(float)
    np.testing.assert_allclose(got, reference[:, -1], rtol=0, atol=2e-5)


# What goes on, and what is left of it


def beam(stage, degrees):
    """A camera whose rays all run along (sin, 0, -cos) of an angle, through a spot of 2 mm about the origin."""
    theta = math.radians(degrees)
    camera = stage.camera((-3 * math.sin(theta), 0, 3 * math.cos(theta)), (0, 0, 0), 40)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2e-3
    stage.scene.render.resolution_x = stage.scene.render.resolution_y = 16
    stage.scene.cycles.samples = 64


def surface(stage, medium, flipped=False, z=0.0, reach=1.0, name="Surface"):
    """A square at height z, of a medium, whose faces look up, or down if flipped."""
    material = interface_material(name, Medium(-1.5), backend=stage.backend)
    give(material, medium)
    vertices, faces = shapes.rectangle((-reach, -reach), (reach, 0.7 * reach), z)  # whose diagonal is elsewhere
    stage.mesh(name, vertices, [face[::-1] for face in faces] if flipped else faces, material)
    return material


def give(material, medium, absorption=0.0):
    inputs = material.node_tree.nodes[INTERFACE.label].inputs
    numbers = medium.n, medium.k, medium.mu, medium.mu_imag, absorption
    for name, number in zip((*QUANTITIES, "Absorption"), numbers, strict=True):
        inputs[f"{name} Inside"].default_value = number


def lit_halves(stage, above, below):
    """A world that shines with `above`, over a floor that shines with `below`."""
    stage.mesh("Floor", *shapes.rectangle((-99, -99), (99, 99), -1), surfaces.shining("Floor", lambda nodes: below))
    stage.world(surfaces.sky("Sky", above, above))


@both_backends
@pytest.mark.parametrize(
    "medium, degrees, passes",
    [
        (Medium(-1.33 + 1e-4j), 30, True),
        (Medium(1.5 + 1e-6j), 60, True),
        (Medium(0.5 + 1e-4j), 20, True),
        (Medium(0.5 + 1e-4j), 40, False),  # beyond |sin| = |Re n|
        (Medium(-1.33 + 0.01j), 30, False),  # gone within micrometres
        (Medium.of(-2.0), 30, False),  # no wave at all
        (Medium(0.05 + 3.3j), 60, False),  # as silver
        (Medium.of(1e-9 + 1e-9j), 0, False),  # Re n nearly 0
    ],
    ids=str,
)
def test_what_is_not_reflected_goes_on_or_is_absorbed(medium, degrees, passes, backend, empty_file, render):
    stage = Stage("loss", (64, 48), backend)
    surface(stage, medium)
    lit_halves(stage, (1, 0, 0), (0, 1, 0))
    beam(stage, degrees)
    red, green, _ = render(stage.scene).astype(float).mean((0, 1))
    fresnel = Interface(medium).fresnel(math.cos(math.radians(degrees)))
    error = math.sqrt(float(fresnel.R * fresnel.T) / (256 * 64))  # of tossing coins, at most
    assert abs(red - fresnel.R) <= 4 * error + 1e-5
    assert abs(green - (fresnel.T if passes else 0)) <= 4 * error + 1e-5


@both_backends
@pytest.mark.parametrize("degrees", [0, 40, 70])
@pytest.mark.parametrize("n", [1.5, -1.5, -1.0])
def test_a_way_through_a_medium_takes_its_share(n, degrees, backend, empty_file, render):
    """A closed slab 0.5 thick in a white world: R, and what comes back and goes on after one way or more of its length."""
    alpha, thick = 3.0, 0.5
    stage = Stage("slab", (64, 48), backend)
    for z, flipped in ((0.0, False), (-thick, True)):
        give(surface(stage, Medium(n), flipped, z, 9.0, f"Face {z}"), Medium(n), alpha)
    lit_halves(stage, (1, 1, 1), (1, 1, 1))
    beam(stage, degrees)
    picture = render(stage.scene).astype(float).mean(-1)
    interface, theta = Interface(Medium(n)), math.radians(degrees)
    R, T = interface.fresnel(math.cos(theta))[2:]
    left = math.exp(-alpha * thick / math.cos(float(interface.theta_t(theta))))
    expected = R + T * T * left / (1 - R * left)
    error = picture.std(ddof=1) / math.sqrt(picture.size)
    assert abs(picture.mean() - expected) <= 4 * error + 1e-5
    assert error < 0.01 and abs(expected - 1) > 0.1


@both_backends
def test_real_media_keep_blenders_glass_and_others_do_not(backend, empty_file, render):
    """A loss of either side, or of mu, is one: R is that of complex numbers, and a k too small to see changes nothing."""
    stage = Stage("loss", (64, 48), backend)
    material = surface(stage, Medium(1.5))
    lit_halves(stage, (1, 0, 0), (0, 0, 0))
    beam(stage, 60)
    inputs = material.node_tree.nodes[INTERFACE.label].inputs
    inputs["Extinction Inside"].default_value = 0.0
    plain = render(stage.scene)[..., 0].mean()
    for name in ("Extinction Outside", "Extinction Inside", "Permeability Loss Inside", "Permeability Loss Outside"):
        inputs[name].default_value = 2.0
        assert abs(render(stage.scene)[..., 0].mean() - plain) > 0.05, name
        inputs[name].default_value = 0.0
    inputs["Extinction Inside"].default_value = 1e-7
    assert abs(render(stage.scene)[..., 0].mean() - plain) < 4 * math.sqrt(plain / (256 * 64))

# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of media with loss: R as 40 digits have it, what is absorbed in a surface, and on the way to one."""

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures import INTERFACE, script
from nim_addon.cycles.nodes import Nodes, empty_tree
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
    scene.render.resolution_x, scene.render.resolution_y, scene.cycles.samples = len(reference), 5, 1
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    got = render(scene)[2, :, 0].astype(float)
    np.testing.assert_allclose(got, reference[:, -1], rtol=0, atol=2e-5)

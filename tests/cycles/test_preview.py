# SPDX-License-Identifier: GPL-3.0-or-later
"""What EEVEE is given of a material: R, the tint and a veil, by an output of its own, which Cycles does not read."""

import dataclasses

import bpy
import numpy as np
import pytest

from nim_addon.cycles import closures, versions
from nim_addon.cycles.closures import INTERFACE, preview
from nim_addon.cycles.graded import graded_ball_material
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.material import interface_material, interface_nodes, switch_backend
from nim_addon.cycles.nodes import empty_tree
from nim_addon.cycles.slabs import slab_material
from nim_addon.cycles.visibility import asked, source_of
from nim_addon.physics import MEDIA, Interface, Medium
from nim_addon.physics.graded import Profile
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import shapes
from nim_addon.scenes.stage import Stage

BACKENDS = ("osl", "nodes")


def outputs(material):
    """{engine: the node that its output shows}."""
    ends = [node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]
    return {end.target: end.inputs["Surface"].links[0].from_socket for end in ends}


@pytest.fixture
def white(empty_file):
    """white(material, angle) -> a scene: a face that wears it, seen at that angle, in a world of 1."""

    def scene(material, angle):
        stage = Stage("preview", (8, 8), "nodes")
        face = stage.mesh("Face", *shapes.rectangle((-50, -50), (50, 50)), material)
        face.rotation_euler.x = angle
        stage.camera((0, 0, 4), (0, 0.001, 0), 5)
        world = bpy.data.worlds.new("World")
        if world.node_tree is None:
            world.use_nodes = True
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        stage.world(world)
        stage.scene.cycles.samples = 256
        return stage.scene

    return scene


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", ["nim-1.5", "nim-4.1", "glass", "nim-mu10", "-1", "silver"])
def test_the_rim_is_that_of_the_media(white, render, name, backend):
    medium = MEDIA.get(name) or Medium.parse(name)
    material = interface_material(name, medium, backend=backend)
    tree, shown = material.node_tree, outputs(material)["EEVEE"]
    tree.links.new(shown, tree.get_output_node("CYCLES").inputs["Surface"])
    colour = preview.NEGATIVE if medium.is_nim else preview.POSITIVE
    absorbs = 1 - np.array(colour)
    scene = white(material, 0.0)
    for angle in (0.0, 1.2) if medium.is_real else (0.0,):
        scene.objects["Face"].rotation_euler.x = angle
        seen = 1 - render(scene).reshape(-1, 3).astype(float).mean(0)
        (wanted,) = np.atleast_1d(Interface(medium, MEDIA["air"]).fresnel(np.cos(angle)).R)
        # all that is not reflected, and is the veil's, loses what the veil absorbs
        assert 1 - seen[2] / (preview.VEIL * absorbs[2]) == pytest.approx(wanted, abs=0.03)


@pytest.mark.parametrize("backend", BACKENDS)
def test_all_that_is_shown_has_the_tint(white, render, backend):
    seen = []
    for tint in ((1.0, 1.0, 1.0), (0.2, 0.5, 0.9)):
        material = interface_material("NIM", MEDIA["nim-4.1"], backend=backend, tint=tint)
        tree = material.node_tree
        tree.links.new(outputs(material)["EEVEE"], tree.get_output_node("CYCLES").inputs["Surface"])
        seen.append(render(white(material, 0.0)).reshape(-1, 3).astype(float).mean(0))
    # what is reflected, a third of it, what is behind the veil, and the veil
    np.testing.assert_allclose(seen[1] / seen[0], (0.2, 0.5, 0.9), atol=0.02)


@pytest.mark.parametrize("backend", BACKENDS)
def test_its_mirror_is_as_rough_as_the_surface(empty_file, backend):
    material = interface_material("NIM", Medium(-1.5), backend=backend)
    (node,) = interface_nodes(material)
    end = next(inner for inner in node.node_tree.nodes if inner.type == "GROUP_OUTPUT")
    mirror = source_of(source_of(end.inputs["EEVEE"])[0].node.inputs[2])[0].node
    assert mirror.type == "BSDF_GLOSSY"
    source, _ = source_of(mirror.inputs["Roughness"])
    assert source.node.type == "GROUP_INPUT" and source.name == "Roughness"


@pytest.mark.parametrize("backend", BACKENDS)
def test_cycles_renders_the_same_without_it(white, render, backend):
    material = interface_material("NIM", Medium(-1.5), backend=backend)
    scene = white(material, 0.4)
    scene.cycles.samples = 4
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    with_it = render(scene)
    tree = material.node_tree
    tree.nodes.remove(tree.get_output_node("EEVEE"))
    assert "EEVEE" not in outputs(material)
    assert np.array_equal(render(scene), with_it)


@pytest.mark.parametrize(
    "make",
    [
        lambda: interface_material("x", Medium(-1.5), backend="nodes"),
        lambda: graded_ball_material("x", Profile("eaton"), backend="nodes"),
        lambda: lenslet_material("x", LensletWindow(-1.0), backend="nodes"),
        lambda: slab_material("x", UniaxialSlab(2.0, -3.0, 0.5), backend="nodes"),
    ],
)
def test_every_material_has_one_and_it_is_none_of_cycles(empty_file, make):
    material = make()
    shown = outputs(material)
    assert set(shown) == {"ALL", "EEVEE"} and shown["ALL"] != shown["EEVEE"]
    assert {found.node for found in asked(material) if not found.path} <= {shown["ALL"].node} and asked(material)
    assert material.node_tree.get_output_node("CYCLES").target == "ALL"
    assert material.diffuse_color[3] == 0.5
    assert len({node.location.to_tuple() for node in material.node_tree.nodes}) == len(material.node_tree.nodes)


def test_it_stays_when_the_backend_is_switched(empty_file):
    material = interface_material("x", Medium(-1.5), backend="nodes")
    for backend in BACKENDS:
        switch_backend(material, backend)
        assert outputs(material)["EEVEE"].name == "EEVEE" and interface_nodes(material)


def test_what_a_person_made_gets_none(empty_file):
    """An update gives one to materials that are a node of ours alone, and to no other."""
    mine = interface_material("Mine", Medium(-1.5), backend="nodes")
    mixed = interface_material("Mixed", Medium(-1.5), backend="nodes")
    for material in (mine, mixed):
        material.node_tree.nodes.remove(material.node_tree.get_output_node("EEVEE"))
    tree = mixed.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(interface_nodes(mixed)[0].outputs["BSDF"], mix.inputs[1])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    interface_nodes(mine)[0].node_tree[closures.closure.VERSION_MARK] = INTERFACE.version - 1
    assert versions.update().updated
    assert set(outputs(mine)) == {"ALL", "EEVEE"} and set(outputs(mixed)) == {"ALL"}


def test_the_output_is_numbered_last(empty_file):
    """Values follow the numbers of sockets: those of groups without this output must stay, or a switch exchanges values."""
    for group in (INTERFACE.filled("osl"), INTERFACE.group("nodes")):
        numbers = [item.identifier for item in group.interface.items_tree if item.name != "EEVEE"]
        assert numbers == [f"Socket_{place}" for place in range(len(numbers))]


def test_a_file_without_it_is_switched_with_all_its_values(empty_file):
    earlier = dataclasses.replace(INTERFACE, outputs=(closures.closure.BSDF,), preview=None, version=3)
    material = bpy.data.materials.new("x")
    tree = empty_tree(material)
    node, output = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeOutputMaterial")
    node.node_tree = earlier.filled("osl")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    node.inputs["Index Inside"].default_value, node.inputs["Permeability Outside"].default_value = -1.33, 2.0

    def values():
        (node,) = interface_nodes(material)
        return {socket.name: np.ravel(socket.default_value).tolist() for socket in node.inputs}

    before = values()
    versions.update()
    for backend in BACKENDS:
        switch_backend(material, backend)
        assert values() == before and set(outputs(material)) == {"ALL", "EEVEE"}

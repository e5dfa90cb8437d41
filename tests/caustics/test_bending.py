# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons through what materials are made of: volumes, glass of every kind, groups; and what is refused, in a sentence."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.caustics.lights import Sun
from nim_addon.caustics.photons import Tracer
from nim_addon.cycles.graded import graded_ball_material, graded_core_material
from nim_addon.cycles.material import NODE_NAME, interface_material, interface_node
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Interface, Medium
from nim_addon.physics.graded import Profile
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.sphere import ball
from tests.caustics.rig import landed_of, over_floor

SIDE = 64
DOWN = Sun((0, 0, -1), (1.0, 1.0, 1.0), 0.0)


def material_of(build):
    """A material whose nodes build(nodes) adds, and whose shader it returns."""
    material = bpy.data.materials.new("Made")
    nodes = Nodes(empty_tree(material))
    nodes.end(build(nodes))
    return material


def volume(material, kind="Absorption", density=0.5, color=(0.0, 0.5, 1.0)):
    """Fill a material with a volume; of white light the colour's part stays where the density is 1, after 1 m."""
    nodes = Nodes(material.node_tree)
    shader = nodes.add(f"ShaderNodeVolume{kind}", inputs={"Density": density, "Color": color})
    nodes.feed(material.node_tree.get_output_node("CYCLES").inputs["Volume"], shader.outputs[0])
    return material


def scene_of(material, shape=None):
    """A metre of it, 2 m wide, over a wide floor."""
    return over_floor(material, shape or shapes.box((-1, -1, 0), (1, 1, 1))).scene


def landed(scene, sun=DOWN, passes=4):
    """Place (N, 2) and power (N, 3), counted by Cycles, of what landed, that of all passes divided by their number."""
    _, landed = landed_of(scene, sun, SIDE**2, passes)
    return landed.place, landed.power * landed.share[:, None] / passes


# ------------------------------------------------------------------------------------------------ volumes


@pytest.mark.parametrize("density", [0.5, 20.0])
@pytest.mark.parametrize("n", [1.0, -1.0])
def test_an_absorbing_volume_takes_light_and_moves_nothing(n, density, empty_file):
    """Beer-Lambert over 1 m, each colour by itself, and each photon where it lands without the volume."""
    clear = scene_of(interface_material("Box", Medium(n), backend="nodes"))
    sun = DOWN._replace(direction=(0.3, 0.0, -1.0))
    there, whole = landed(clear, sun)
    thick = scene_of(volume(interface_material("Box", Medium(n), backend="nodes"), density=density))
    place, power = landed(thick, sun)
    assert np.array_equal(place, there)
    # most of the light goes from top to bottom, some by the sides
    length = math.hypot(0.3, 1.0)
    most = np.median(power / whole, axis=0)
    assert most == pytest.approx(np.exp(-density * length * np.array([1.0, 0.5, 0.0])), rel=1e-3)


def losing(medium, **losses):
    """A material of an interface whose sockets of those names, Inside, have those values."""
    material = interface_material("Box", medium, backend="nodes")
    for name, value in losses.items():
        material.node_tree.nodes[NODE_NAME].inputs[f"{name} Inside"].default_value = value
    return material


@pytest.mark.parametrize("alpha", [0.5, 5.0])
@pytest.mark.parametrize("n", [1.0, -1.0])
def test_an_absorbing_interface_takes_light_and_moves_nothing(n, alpha, empty_file):
    sun = DOWN._replace(direction=(0.3, 0.0, -1.0))
    there, whole = landed(scene_of(interface_material("Box", Medium(n), backend="nodes")), sun)
    place, power = landed(scene_of(losing(Medium(n), Absorption=alpha)), sun)
    assert np.array_equal(place, there)
    most = np.median(power / whole, axis=0)
    assert most == pytest.approx(np.full(3, np.exp(-alpha * math.hypot(0.3, 1.0))), rel=1e-3)


def test_a_metal_mirrors_its_share_to_where_a_mirror_does(empty_file):
    silver = Medium(0.05 + 3.3j)
    material = losing(Medium(silver.n), Extinction=silver.k)
    scene = scene_of(material, shapes.rectangle((-1, -1), (1, 1)))
    roof = scene.objects["Surface"]
    roof.rotation_euler.y = math.radians(-60)  # sends what comes from above away and down
    place, power = landed(scene)
    mirror = scene_of(principled(Metallic=1.0), shapes.rectangle((-1, -1), (1, 1)))
    mirror.objects["Surface"].rotation_euler.y = math.radians(-60)
    there, whole = landed(mirror)
    assert np.median(place, axis=0) == pytest.approx(np.median(there, axis=0), abs=0.01)
    R = float(Interface(silver).fresnel(0.5).R)
    assert R < 0.99 and power.sum() == pytest.approx(R * whole.sum(), rel=3e-3)


def test_a_volume_alone_stops_nothing_and_takes_its_part(empty_file):
    box = bpy.data.materials.new("Smoke")
    nodes = Nodes(empty_tree(box))
    nodes.add("ShaderNodeOutputMaterial")
    volume(box, density=1.0)
    scene = scene_of(box)
    mesh = bpy.data.meshes.new("Surface")
    vertices, faces = shapes.rectangle((-0.5, -0.5), (0.5, 0.5), -0.5)[:2]
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(interface_material("NIM", Medium(-1.5), backend="nodes"))
    scene.collection.objects.link(bpy.data.objects.new("Surface", mesh))
    place, power = landed(scene)
    # light that met the volume only is not the photons'
    assert np.abs(place).max() < 0.52
    passed = 0.96 / 1.5**2 * np.exp([-1.0, -0.5, 0.0])
    assert power.sum(axis=0) == pytest.approx(passed, rel=0.03)


@pytest.mark.parametrize("kind", ["Scatter", "Principled"])
def test_a_volume_that_scatters_is_refused(kind, empty_file, one_sentence):
    scene = scene_of(volume(interface_material("Milk", Medium(1.5), backend="nodes"), kind))
    with pytest.raises(ValueError) as error, Tracer(scene):
        pass
    one_sentence(error.value, "Milk", "Surface", "Volume Absorption")


# ------------------------------------------------------------------------------------------------ glass


def principled(**values):
    def build(nodes):
        inputs = {"Transmission Weight": 1.0, "Roughness": 0.0, "IOR": 1.5, "Base Color": (1.0, 1.0, 1.0)}
        return nodes.add("ShaderNodeBsdfPrincipled", inputs=inputs | values)

    return material_of(build)


@pytest.mark.parametrize("n", [1.5, 1.2])
def test_principled_glass_is_glass(n, empty_file):
    sheet = shapes.rectangle((-1, -1), (1, 1))
    place, power = landed(scene_of(principled(IOR=n), sheet))
    passed = 4 * (1 - float(Interface(Medium(n)).fresnel(1.0).R)) / n**2
    assert power.sum(axis=0) == pytest.approx(np.full(3, passed), rel=0.03)
    # its colour is that of two crossings
    _, tinted = landed(scene_of(principled(IOR=n, **{"Base Color": (0.25, 0.64, 1.0)}), sheet))
    assert tinted.sum(axis=0) == pytest.approx(power.sum(axis=0) * (0.5, 0.8, 1.0), rel=1e-3)


def test_principled_metal_is_a_mirror(empty_file):
    """What comes from below is mirrored down."""
    scene = scene_of(principled(Metallic=1.0, **{"Base Color": (0.9, 0.5, 0.2)}), shapes.rectangle((-1, -1), (1, 1)))
    place, power = landed(scene, DOWN._replace(direction=(0, 0, -1)))
    assert len(place) == 0
    roof = scene.objects["Surface"]
    roof.rotation_euler.y = math.radians(-60)  # sends what comes from above away and down
    place, power = landed(scene)
    assert power.sum(axis=0)[0] > 0.5 and np.median(place[:, 0]) < -0.5
    assert np.ptp(power.sum(axis=0) / power.sum(axis=0)[0] / np.array([1.0, 5 / 9, 2 / 9])) < 0.6


@pytest.mark.parametrize(
    "values",
    [{"Transmission Weight": 0.5}, {"Roughness": 0.3}, {"Coat Weight": 1.0}, {"Alpha": 0.5}, {"Metallic": 0.5}],
)
def test_glass_in_part_is_refused(values, empty_file, one_sentence):
    with pytest.raises(ValueError) as error, Tracer(scene_of(principled(**values))):
        pass
    one_sentence(error.value, "Made", "Surface", "Transmission", "Roughness")


def test_rough_and_mixed_glass_are_refused(empty_file, one_sentence):
    def mixed(nodes):
        glass = nodes.add("ShaderNodeBsdfGlass", inputs={"Roughness": 0.0})
        other = nodes.add("ShaderNodeBsdfDiffuse")
        return nodes.add("ShaderNodeMixShader", inputs={0: 0.5, 1: glass.outputs[0], 2: other.outputs[0]})

    for material in (
        material_of(lambda nodes: nodes.add("ShaderNodeBsdfGlass", inputs={"Roughness": 0.3})),
        material_of(mixed),
    ):
        with pytest.raises(ValueError) as error, Tracer(scene_of(material)):
            pass
        one_sentence(error.value, "Made", "Surface", "Roughness")


def shadowless(shader):
    """The way glass is often given bright shadows: it is not there for shadow rays."""

    def build(nodes):
        other = nodes.add("ShaderNodeBsdfTransparent")
        ray = nodes.add("ShaderNodeLightPath").outputs["Is Shadow Ray"]
        return nodes.add("ShaderNodeMixShader", inputs={0: ray, 1: shader(nodes).outputs[0], 2: other.outputs[0]})

    return material_of(build)


@pytest.mark.parametrize("kind", ["interface", "Glass"])
def test_what_lets_shadow_rays_pass_is_refused(kind, empty_file, one_sentence):
    def shader(nodes):
        if kind == "Glass":
            return nodes.add("ShaderNodeBsdfGlass", inputs={"Roughness": 0.0})
        return interface_node(nodes.tree, Medium(-1.5), backend="nodes")

    with pytest.raises(ValueError) as error, Tracer(scene_of(shadowless(shader))):
        pass
    one_sentence(error.value, "Made", "Surface", "twice", "Transparent")


# ------------------------------------------------------------------------------------------------ groups


def grouped(material, times=1):
    """The shader of a material put into a group, that into another, and so on; the index comes from the outermost."""
    for depth in range(times):
        tree = material.node_tree
        inner = bpy.data.node_groups.new(f"Mine {depth}", "ShaderNodeTree")
        inner.interface.new_socket("n", in_out="INPUT", socket_type="NodeSocketFloat")
        inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        enter, leave = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
        old = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
        new = inner.nodes.new(old.bl_idname)
        new.node_tree = old.node_tree
        index = "Index Inside" if depth == 0 else "n"
        value = old.inputs[index].default_value
        inner.links.new(enter.outputs["n"], new.inputs[index])
        inner.links.new(new.outputs[0], leave.inputs[0])
        nodes = Nodes(tree)
        holds = nodes.add("ShaderNodeGroup", node_tree=inner, inputs={"n": value})
        tree.nodes.remove(old)
        nodes.feed(tree.get_output_node("CYCLES").inputs["Surface"], holds.outputs[0])
    return material


@pytest.mark.parametrize("times", [1, 2])
def test_an_interface_in_a_persons_groups_bends_photons(times, empty_file):
    sheet = shapes.rectangle((-1, -1), (1, 1))
    sun = DOWN._replace(direction=(0.5, 0.0, -1.0))
    plain, power = landed(scene_of(interface_material("Plain", Medium(-1.33), backend="nodes"), sheet), sun)
    groups = set(bpy.data.node_groups)
    material = grouped(interface_material("Held", Medium(-1.33), backend="nodes"), times)
    mine = set(bpy.data.node_groups) - groups
    scene = scene_of(material, sheet)
    place, same = landed(scene, sun)
    assert same.sum() == pytest.approx(power.sum(), rel=0.02)
    assert np.median(place, axis=0) == pytest.approx(np.median(plain, axis=0), abs=0.01)
    assert set(bpy.data.node_groups) == groups | mine  # copies of groups are gone


# ------------------------------------------------------------------------------------------------ other closures


def graded_ball(device, backend="nodes", **values):
    return graded_ball_material("Ball", Profile(device, **values), backend=backend)


def round_ball(radius=1.0):
    vertices, faces = shapes.cube_sphere(16)
    return radius * np.asarray(vertices), faces


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_the_focus_of_a_luneburg_ball_is_bright_behind_it(backend, empty_file):
    """All light of the sun that meets it comes to the point of its far rim, and all goes on from there."""
    material = graded_ball("luneburg", backend)
    before = {tree.name for tree in bpy.data.node_groups}
    scene = scene_of(material, round_ball())
    bpy.data.objects["Surface"].location.z = 0.001  # the floor lies at -1
    place, power = landed(scene)
    near = np.hypot(*place.T) < 0.001 * math.tan(math.asin(0.9))
    for some, share in ((near, 0.9**2), (slice(None), 1.0)):
        assert power[some, 0].sum() == pytest.approx(share * math.pi, rel=2e-2)
    # half of the radius lower, a cone whose rays go down by the cosine of their angle of incidence
    bpy.data.objects["Surface"].location.z = 0.5
    place, power = landed(scene)
    radius = np.hypot(*place.T)
    for least, most in ((0.1, 0.2), (0.3, 0.5)):
        sines = [distance / math.hypot(distance, 0.5) for distance in (least, most)]
        ring = power[(radius > least) & (radius < most), 0].sum()
        assert ring == pytest.approx(math.pi * (sines[1] ** 2 - sines[0] ** 2), rel=6e-2)
    assert {tree.name for tree in bpy.data.node_groups} == before


def test_a_ball_in_the_light_beside_an_interface_counts_no_crossing(empty_file):
    """A photon that has passed a ball has crossed nothing, and one that is in a medium as well has crossed one interface."""
    scene = over_floor(interface_material("Sea", Medium(1.5), backend="nodes"), shapes.rectangle((-3, -3), (3, 3)))
    scene.mesh("Ball", *round_ball(0.5), graded_ball("invisible"), location=(0, 0, 1))
    place, power = landed(scene.scene)
    T = float(Interface(Medium(1.5)).fresnel(1.0).T)
    within = np.hypot(*place.T) < 0.45
    for some, area in ((within, math.pi * 0.45**2), (np.abs(place).max(axis=1) < 2, 16.0)):
        assert power[some, 0].sum() == pytest.approx(area * T / 1.5**2, rel=4e-2)


def test_what_a_core_takes_does_not_land(empty_file):
    scene = scene_of(graded_ball("magnifier", core=0.5, surface="black"), round_ball())
    place, power = landed(scene)
    assert power.sum() == 0 or np.hypot(*place.T).min() > 0.98


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("device, core", [("magnifier", 0.5), ("luneburg", 0.4)])
def test_light_on_a_core_counts_as_within_the_medium_there(device, core, backend, empty_file):
    """What comes to it is less by n^2 of the shell there; what passes it has crossed nothing."""
    profile = Profile(device, core=core, surface="textured")
    stage = over_floor(graded_core_material("Ball", profile, backend=backend), round_ball())
    bpy.data.objects["Surface"].location.z = 0.5
    ball(stage, "Core", (0, 0, 0.5), core, surfaces.plain("Core", (0.5, 0.5, 0.5)))
    names, landed = landed_of(stage.scene, DOWN, SIDE**2, 4)
    power = landed.power[:, 0] * landed.share / 4
    n = float(profile.index(np.array([core]))[0])
    least = min(abs(n) * core, 1.0)  # p from which on light passes the core
    assert power[names == "Core"].sum() == pytest.approx(math.pi * least**2 / n**2, rel=2e-2)
    assert power[names == "Floor"].sum() == pytest.approx(math.pi * (1 - least**2), rel=3e-2, abs=1e-3)
    assert not any("photons" in tree.name for tree in bpy.data.node_groups)


def test_a_ball_that_scatters_too_is_refused(empty_file, one_sentence):
    material = graded_ball("luneburg")
    nodes = Nodes(material.node_tree)
    surface = material.node_tree.get_output_node("CYCLES").inputs["Surface"]
    diffuse = nodes.add("ShaderNodeBsdfDiffuse")
    mix = nodes.add("ShaderNodeMixShader", inputs={1: surface.links[0].from_socket, 2: diffuse.outputs[0]})
    nodes.feed(surface, mix.outputs[0])
    with pytest.raises(ValueError) as error:
        Tracer(scene_of(material, round_ball())).__enter__()
    one_sentence(error.value, "Ball", "in part")

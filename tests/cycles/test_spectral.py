# SPDX-License-Identifier: GPL-3.0-or-later
"""All wavelengths in one render: what has no colour stays as it is, what disperses is at the path's own wavelength."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles import dispersive, drift, spectral, wavelength
from nim_addon.cycles.closures import SHUTTER
from nim_addon.cycles.material import interface_material, interface_nodes, interface_of, set_medium, switch_backend
from nim_addon.cycles.nodes import Nodes, empty_tree, uses_nodes
from nim_addon.physics import DISPERSIVE, REPRESENTATIVE_NM, VISIBLE_NM, Interface, Medium
from nim_addon.physics.colour import CURVE_POINTS, Wavelengths
from nim_addon.scenes.stage import Stage

BENT = ("water-daimon", "n-bk7", "n-sf11", "silver", "gold", "fishnet")  # which are tables, their k at least
BACKENDS = pytest.mark.parametrize("backend", ["osl", "nodes"])


def glowing(stage, name, at=(0, 0, 0), colour=(1.0, 1.0, 1.0)):
    """A square metre that glows, facing up; its object and its Emission."""
    material = bpy.data.materials.new(name)
    nodes = Nodes(empty_tree(material))
    emission = nodes.add("ShaderNodeEmission", inputs={"Color": (*colour, 1.0)})
    nodes.add("ShaderNodeOutputMaterial", inputs={"Surface": emission.outputs[0]})
    corners = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)]
    return stage.mesh(name, corners, [(0, 1, 2, 3)], material, location=at), emission


def set_up(scene, backend):
    """spectral.set_up() with weights for all light, also for what has met nothing that disperses."""
    done = spectral.set_up(scene, backend)
    wavelength.set_clear_paths(white=False)
    return done


@pytest.fixture
def stage(empty_file):
    """A stage that looks down on a square metre, 16 x 16 pixels."""
    stage = Stage("spectral", (16, 16), "nodes")
    camera = stage.camera((1, 2, 4), (1, 2, 0.5), 10)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.8
    stage.scene.cycles.shading_system = True
    stage.scene.cycles.samples = 256
    return stage


@BACKENDS
def test_what_has_no_colour_stays_as_it_is(stage, render, backend):
    colour = np.array((0.2, 0.5, 0.9))
    obj, emission = glowing(stage, "Light", (1, 2, 0.5), colour)
    before = render(stage.scene).mean(axis=(0, 1))
    done = set_up(stage.scene, backend)
    assert done == (0, 1, False) and spectral.is_spectral(stage.scene)
    picture = render(stage.scene)
    # 256 well-spread wavelengths a pixel, and 256 pixels: what remains of chance is the table's, measured below 1e-3
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), before, rtol=2e-3)
    assert (picture.std(axis=(0, 1)) / before).min() > 3e-4  # each pixel has its noise of colour: it is not just white
    stage.scene.render.use_motion_blur = False
    np.testing.assert_allclose(render(stage.scene).mean(axis=(0, 1)), before, rtol=1e-5)


def facing(medium, rough=0.0):
    """The material of a surface whose faces look at the camera, with that medium beneath."""
    return interface_material("Face", medium, backend="nodes", roughness=rough)


def mirror(_):
    material = bpy.data.materials.new("Mirror")
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfAnisotropic", inputs={"Roughness": 0.0}))
    return material


def glass(_):
    return facing(Medium(1.5))


def nim(_):
    return facing(Medium(-1.5))


def film(_):
    material = bpy.data.materials.new("Film")
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfTransparent"))
    return material


@BACKENDS
@pytest.mark.parametrize("met", [None, mirror, glass, nim, film], ids=lambda met: met.__name__ if met else "nothing")
def test_light_has_the_weight_of_its_wavelength_only_where_it_met_something_that_bends_it(stage, render, backend, met):
    """Seen directly, or on a floor that lamps and squares light, it is white without any noise of colour."""
    glowing(stage, "Light", (1, 2, 0.5))
    if met is not None:
        corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        stage.mesh("Met", corners, [(0, 1, 2, 3)], met(stage), location=(1, 2, 1))
    if met == mirror:
        glowing(stage, "Shown", (1, 2, 8))
    stage.scene.cycles.samples = 16
    before = render(stage.scene)
    spectral.set_up(stage.scene, backend)
    assert wavelength.clear_paths_are_white()
    picture = render(stage.scene)
    tint = np.ptp(picture, axis=2).max()
    if met is None:
        assert tint == 0
        np.testing.assert_allclose(picture, before, rtol=1e-6)
    else:
        assert before.min() > 0.01 and tint > 0.02
    stage.scene.render.use_motion_blur = False
    assert np.ptp(render(stage.scene), axis=2).max() == 0


@BACKENDS
@pytest.mark.parametrize("sampled", ["NONE", "FRONT_BACK"])
@pytest.mark.parametrize("met", [mirror, glass, nim, film], ids=lambda met: met.__name__)
def test_a_path_that_met_something_has_its_wavelength_on_the_floors_it_meets_later(
    stage, render, backend, met, sampled
):
    """A floor behind what is met, or a ceiling that a mirror shows, beside a lamp that is not in the picture."""
    corners = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
    thing = stage.mesh("Met", corners, [(0, 1, 2, 3)], met(stage), location=(1, 2, 2))
    thing.visible_diffuse = thing.visible_shadow = False  # it is met once
    floor = bpy.data.materials.new("Floor")
    nodes = Nodes(empty_tree(floor))
    nodes.end(nodes.add("ShaderNodeBsdfDiffuse"))
    stage.mesh("Floor", corners, [(0, 1, 2, 3)], floor, location=(0, 0, 6 if met == mirror else 0))
    glowing(stage, "Light", (2.2, 2, 5 if met == mirror else 1))
    # light is found by bounces off the floor, or asked for there
    bpy.data.materials["Light"].cycles.emission_sampling = sampled
    stage.scene.cycles.samples = 64
    spectral.set_up(stage.scene, backend)
    assert wavelength.clear_paths_are_white()
    picture = render(stage.scene)
    assert picture.mean() > 0 and np.ptp(picture, axis=2).max() > 0.02 * picture.max()


@BACKENDS
def test_a_floor_that_is_lit_has_no_noise_of_colour(stage, render, backend):
    obj, _ = glowing(stage, "Light", (1.8, 2, 2.0))
    stage.object("Lamp", bpy.data.lights.new("Lamp", "POINT"), location=(1, 2.8, 1))
    bpy.data.lights["Lamp"].energy = 20
    floor = bpy.data.materials.new("Floor")
    nodes = Nodes(empty_tree(floor))
    nodes.end(nodes.add("ShaderNodeBsdfDiffuse"))
    stage.mesh("Floor", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)], floor)
    stage.scene.cycles.samples = 4
    assert spectral.set_up(stage.scene, backend) == (1, 1, False)
    picture = render(stage.scene)
    assert picture.mean() > 0.1 and np.ptp(picture, axis=2).max() < 1e-6 * picture.max()
    wavelength.set_clear_paths(white=False)
    assert np.ptp(render(stage.scene), axis=2).max() > 0.01 * picture.max()


@pytest.mark.parametrize("kind", ["POINT", "SUN", "SPOT", "AREA"])
def test_lamps_have_wavelengths_whatever_their_kind(stage, render, kind):
    """Where nodes cannot tell them, before Blender 4.5, OSL does."""
    lamp = stage.object("Lamp", bpy.data.lights.new("Lamp", kind), location=(1, 2, 3))
    lamp.data.energy = 50
    stage.mesh("Face", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)], facing(Medium(1.5), 0.3))
    stage.scene.cycles.samples = 4
    set_up(stage.scene, "nodes")
    picture = render(stage.scene)
    assert picture.max() > 0 and np.ptp(picture, axis=2).max() > 0.1 * picture.max()


def test_facets_that_disperse_have_their_colours_under_lamps(stage, render):
    """A sun beneath rough diamond, seen where its green goes: Cycles asks the lamp itself for the light on facets."""
    diamond = Medium.parse("diamond-peter")
    towards = math.radians(50)  # how far the camera is from the normal, in air
    inside = math.asin(math.sin(towards) / diamond.at(REPRESENTATIVE_NM).n)
    stage.mesh("Face", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)], facing(diamond, 0.06))
    sun = stage.object("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler = (math.pi, inside, 0)
    sun.data.angle = 0
    stage.camera((4 * math.sin(towards), 0, 4 * math.cos(towards)), (0, 0, 0), 1)
    stage.scene.camera.data.type = "PERSP"
    spectral.set_up(stage.scene)
    assert not wavelength.clear_paths_are_white()
    red, green, blue = render(stage.scene).mean(axis=(0, 1))
    assert green > 0 and blue < 0.7 * green and red < 0.95 * green
    wavelength.set_clear_paths(white=True)
    assert np.ptp(render(stage.scene).mean(axis=(0, 1))) < 1e-6 * green  # which is wrong
    spectral.undo(stage.scene)
    assert wavelength.clear_paths_are_white()


def test_only_what_is_rough_and_disperses_lets_all_light_be_weighted(stage):
    glowing(stage, "Light")
    smooth, dull = facing(Medium.parse("n-bk7")), facing(Medium(1.5), 0.3)
    spectral.set_up(stage.scene, "nodes")
    assert wavelength.clear_paths_are_white() and not spectral.scattering()
    set_medium(interface_nodes(dull)[0], "Outside", Medium.parse("n-bk7"))
    assert spectral.scattering() == [dull] and smooth not in spectral.scattering()
    spectral.set_up(stage.scene, "nodes")
    assert not wavelength.clear_paths_are_white()


@BACKENDS
def test_the_same_button_undoes_all(stage, backend):
    obj, emission = glowing(stage, "Light", (1, 2, 0.5), (0.2, 0.5, 0.9))
    lamp = stage.object("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    stage.world(bpy.data.worlds.new("Sky"))
    scene = stage.scene
    scene.render.motion_blur_shutter = 0.25

    def state():
        trees = [emission.id_data, *(owner.node_tree for owner in (lamp.data, scene.world) if uses_nodes(owner))]
        nodes = [sorted(node.name for node in tree.nodes) for tree in trees]
        settings = [scene.path_resolve(path) for path in spectral.SETTINGS]
        return (
            nodes,
            settings,
            len(emission.id_data.links),
            obj.animation_data,
            {name: value for name, value in obj.items() if name != "cycles"},
            obj.cycles.use_motion_blur,
            tuple(obj.delta_location),
        )

    before = state()
    assert spectral.set_up(scene, backend) == (1, 1, True)
    assert state() != before
    spectral.set_up(scene, backend)  # a second time changes nothing
    emission.inputs["Color"].links[0].from_node.inputs[6].default_value = (0.3, 0.4, 0.5, 1)
    spectral.undo(scene)
    assert not spectral.is_spectral(scene)
    assert state()[:3] == before[:3] and state()[4:] == before[4:]
    assert tuple(emission.inputs["Color"].default_value) == pytest.approx((0.3, 0.4, 0.5, 1))  # what was set meanwhile


@pytest.mark.parametrize("light, method", [(0.4, "NONE"), (0.6, "AUTO")])
def test_what_is_too_dim_for_a_lamp_becomes_none(stage, light, method):
    """Of a colour that is linked Cycles does not know how bright it is, and takes it for a lamp."""
    _, emission = glowing(stage, "Light", colour=(light / 2, 0.1, 0))
    emission.inputs["Strength"].default_value = 2
    material = bpy.data.materials["Light"]
    for _ in range(2):
        spectral.set_up(stage.scene, "osl")
        assert material.cycles.emission_sampling == method
    spectral.undo(stage.scene)
    assert material.cycles.emission_sampling == "AUTO" and spectral.DIM not in material


def test_what_moves_stands_still_for_all_colours(stage, render):
    """Its edge is where it is in the middle of the shutter's time; blurred, each colour has another."""
    obj, _ = glowing(stage, "Light", (1.2, 2, 0.5))
    scene = stage.scene
    spectral.set_up(scene, "osl")
    still = render(scene)
    spectral.undo(scene)
    obj.driver_add("location", 0).driver.expression = f"1 + 40 * (frame - {scene.frame_current})"  # by 0.4 m meanwhile
    spectral.set_up(scene, "osl")
    np.testing.assert_allclose(render(scene), still, atol=1e-3)


@BACKENDS
def test_the_share_of_the_shutter_is_uniform_and_that_of_the_wavelength(stage, render, backend):
    """Moments of u and of the wavelength over 65,536 paths, against those of the law; time taken as u would be off."""
    obj, emission = glowing(stage, "Light", (1, 2, 0.5))
    spectral.set_up(stage.scene, backend)
    tree = emission.id_data
    node = wavelength.new_node(tree, backend)
    share = next(inner for inner in node.node_tree.nodes if SHUTTER.is_of(getattr(inner, "node_tree", None)))
    nodes = Nodes(tree)
    shutter = nodes.add("ShaderNodeGroup")
    shutter.node_tree = share.node_tree
    for link in list(emission.inputs["Color"].links):
        tree.links.remove(link)
    u = shutter.outputs["Share"]
    square = nodes.add("ShaderNodeMath", inputs={0: u, 1: u}, operation="MULTIPLY").outputs[0]
    for output, expected in ((u, 1 / 2), (square, 1 / 3)):
        tree.links.new(output, emission.inputs["Color"])
        # nodes tell the place of an object 2 m away to 1.2e-3 of its drift
        np.testing.assert_allclose(
            render(stage.scene).mean(), expected, rtol=0, atol=2e-4 if backend == "osl" else 1.5e-3
        )
    tree.links.new(node.outputs["Wavelength"], emission.inputs["Color"])
    drawn = Wavelengths.by_importance().wavelength((np.arange(4096) + 0.5) / 4096).mean()
    np.testing.assert_allclose(render(stage.scene).mean(), drawn, rtol=0, atol=0.5)


@BACKENDS
def test_strata_are_parts_of_the_same_picture(stage, render, backend):
    obj, emission = glowing(stage, "Light", (1, 2, 0.5))
    set_up(stage.scene, backend)
    parts = []
    for number in range(4):
        spectral.set_stratum(number, 4)
        parts.append(render(stage.scene).mean(axis=(0, 1)))
    np.testing.assert_allclose(np.mean(parts, axis=0), 1, rtol=0, atol=2e-3)
    u = (np.arange(4096) + 0.5) / 4096
    expected = Wavelengths.by_importance().weight(u).reshape(4, 1024, 3).mean(axis=1)
    np.testing.assert_allclose(parts, expected, rtol=0, atol=5e-3)


@pytest.mark.parametrize("name", DISPERSIVE)
def test_a_medium_node_gives_the_numbers_of_its_medium(stage, render, name):
    medium = Medium.parse(name)
    obj, emission = glowing(stage, "Light", (1, 2, 0.5))
    stage.scene.cycles.samples = 1
    tree = emission.id_data
    node = dispersive.medium_node(tree, medium, "osl")
    assert dispersive.medium_of(node) == medium and str(dispersive.medium_of(node)) == name
    nodes = Nodes(tree)
    step = (VISIBLE_NM[1] - VISIBLE_NM[0]) / (CURVE_POINTS - 1)

    def numbers(nm):
        there = medium.at(nm)
        return np.array((there.n, there.k, there.mu, there.mu_imag, there.absorption(nm)))

    for nm in (400, 487, REPRESENTATIVE_NM, 633, 707):
        wavelength.set_neutral(nm)
        # straight lines cut off the corner of a table, by what it bends within one of them
        bend = np.abs(numbers(nm - step) + numbers(nm + step) - 2 * numbers(nm)) if name in BENT else np.zeros(5)
        for output, number, cut in zip(dispersive.OUTPUTS, numbers(nm), bend, strict=True):
            scale = 1 / max(abs(number), 1e-12)
            # as a number near 3, so that the signs of what is below 0 are seen
            shown = nodes.add(
                "ShaderNodeMath", inputs={0: node.outputs[output], 1: scale, 2: 3.0}, operation="MULTIPLY_ADD"
            ).outputs[0]
            tree.links.new(shown, emission.inputs["Color"])
            measured = (float(render(stage.scene).mean(dtype=float)) - 3) / scale
            assert measured == pytest.approx(number, abs=2e-6 * abs(number) + cut), (
                output,
                nm,
            )  # the film keeps 2e-7 of 3
    wavelength.set_neutral()


def test_media_that_are_the_same_share_a_group(empty_file):
    tree = empty_tree(bpy.data.materials.new("Two"))
    one, other = (dispersive.medium_node(tree, Medium.parse("n-bk7"), "nodes") for _ in range(2))
    assert one.node_tree == other.node_tree
    assert dispersive.medium_node(tree, Medium.parse("nim-causal"), "nodes").node_tree != one.node_tree
    with pytest.raises(ValueError, match="same at all wavelengths"):
        dispersive.medium_node(tree, Medium(-1.5), "nodes")
    assert dispersive.switch(bpy.data.materials["Two"], "osl") == 3
    assert dispersive.medium_of(one) == Medium.parse("n-bk7") and one.node_tree[dispersive.BACKEND] == "osl"


@BACKENDS
def test_an_interface_takes_a_medium_that_disperses(empty_file, backend):
    material = interface_material("Causal", Medium.parse("nim-causal"), backend=backend)
    node = interface_nodes(material)[0]
    assert str(interface_of(node).inside) == "nim-causal" and interface_of(node).outside == Medium(1.0)
    set_medium(node, "Outside", Medium.parse("n-bk7"))
    # the interface, two media and two outputs
    assert str(interface_of(node).outside) == "n-bk7" and len(material.node_tree.nodes) == 5
    other = "nodes" if backend == "osl" else "osl"
    assert switch_backend(material, other) == 3 and str(interface_of(node).outside) == "n-bk7"
    for side in ("Inside", "Outside"):
        set_medium(node, side, Medium(-1.5, -3))
    assert interface_of(node) == Interface(Medium(-1.5, -3), Medium(-1.5, -3)) and len(material.node_tree.nodes) == 3


def test_what_a_person_moved_by_a_delta_is_where_it_was(stage):
    """The drift goes along an axis that nothing else moves, from where that stands; and all is given back."""
    obj, _ = glowing(stage, "Light", (1, 2, 0.5))
    obj.delta_location = (0.25, 0.5, 0.75)
    obj.driver_add("delta_location", 2).driver.expression = "0.75"
    spectral.set_up(stage.scene, "nodes")
    stage.scene.view_layers[0].update()
    np.testing.assert_allclose(obj.matrix_world.translation, (1.25, 2.5, 1.25), atol=3e-4)
    assert drift.is_at_rest(obj) and len(obj.animation_data.drivers) == 2
    spectral.undo(stage.scene)
    stage.scene.view_layers[0].update()
    np.testing.assert_allclose(obj.matrix_world.translation, (1.25, 2.5, 1.25), atol=1e-6)
    assert len(obj.animation_data.drivers) == 1 and not any(key.startswith("nim_spectral") for key in dict(obj.items()))


def test_what_is_linked_from_another_file_stays_as_it_is(stage, tmp_path):
    obj, _ = glowing(stage, "Light", (1, 2, 0.5))
    bpy.data.libraries.write(str(tmp_path / "other.blend"), {obj})
    bpy.data.objects.remove(obj)
    with bpy.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (_, wanted):
        wanted.objects = ["Light"]
    (linked,) = wanted.objects
    stage.collection.objects.link(linked)
    for backend in ("osl", "nodes"):
        assert spectral.set_up(stage.scene, backend).materials == 0
        assert linked.animation_data is None and spectral.unweighted(linked.data.materials[0])
    spectral.undo(stage.scene)

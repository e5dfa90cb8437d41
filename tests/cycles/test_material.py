# SPDX-License-Identifier: GPL-3.0-or-later
"""The material: where it sends a ray, that it loses no light, and that a file keeps it whole without this add-on."""

import hashlib
import math
import subprocess
import sys

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures import INTERFACE, backends
from nim_addon.cycles.closures.script import bytecode_of, script_of
from nim_addon.cycles.material import NODE_NAME, interface_material, interface_node, interface_of, medium_of, set_medium
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Interface, Medium, spectra
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.sphere import ball
from nim_addon.scenes.stage import Stage

VACUUM = Medium(1.0)

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])


def small(scene, size, samples):
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.cycles.samples = samples
    return scene


def parallel_rays(stage, d):
    """A camera whose rays all run along d, through a spot of 2 mm about the origin."""
    d = np.asarray(d, float) / np.linalg.norm(d)
    camera = stage.camera(-3 * d, (0, 0, 0), 40)
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 2e-3


def furnace(medium, *, bump=False, inside=False, backend="osl"):
    """A sphere of that medium where everything around shines with 1: so must every pixel, if no light is lost."""
    stage = Stage("furnace", (64, 48), backend)
    material = interface_material("Sphere", medium, backend=backend)
    ball(stage, "Sphere", (0, 0, 0), 1.0, material)
    if bump:
        tree = material.node_tree
        noise, bumps = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeBump")
        noise.inputs["Scale"].default_value = 12.0
        bumps.inputs["Distance"].default_value = 0.3
        tree.links.new(noise.outputs[0], bumps.inputs["Height"])
        tree.links.new(bumps.outputs["Normal"], tree.nodes[NODE_NAME].inputs["Normal"])
    stage.world(surfaces.sky("White", (1, 1, 1), (1, 1, 1)))
    if inside:
        stage.camera((0.3, 0.2, -0.1), (1, -0.5, 0.4), 120)
    else:
        stage.camera((0, -3, 0), (0, 0, 0), 45)  # the rim is in the picture, and some of what is behind
    # at 16 samples, four lost paths, which one processor in some has, are more than is allowed
    scene = small(stage.scene, 48, 64)
    if bump:
        # The Bump node takes its heights a part of a pixel apart, its Filter Width, and before 4.5 a whole one. Where that
        # is not small beside the bumps its normals are of no surface, and total reflection on them traps paths for good:
        # 8 % of the light in 4.2, and in 5.2 with a Filter Width of 1. So the pixels are small where bumps are.
        small(scene, 96, 16) if "Filter Width" in bumps.inputs else small(scene, 512, 1)
    return scene


# The node group


def test_materials_share_one_group_one_text_and_one_bytecode(empty_file):
    a = interface_material("A", Medium(-1.5))
    bytecode = script_of(INTERFACE.group()).bytecode_hash
    b = interface_material("A", Medium(1.33), Medium(-2, -3), tint=(0.5, 0.6, 0.7))
    assert (a.name, b.name) == ("A", "A.001")
    assert len(bpy.data.node_groups) == len(bpy.data.texts) == 1
    group = a.node_tree.nodes[NODE_NAME].node_tree
    assert group == b.node_tree.nodes[NODE_NAME].node_tree == INTERFACE.group() == bpy.data.node_groups[NODE_NAME]
    assert script_of(group).script == bpy.data.texts["nim_interface.osl"]
    assert script_of(group).script.as_string() == INTERFACE.source()
    assert script_of(group).bytecode_hash == bytecode, "it was compiled again for nothing"


def test_media_and_tint_are_on_the_sockets(empty_file):
    material = interface_material("A", Medium(-1.33, -10), Medium(1.5, 2), tint=(0.25, 0.5, 0.75))
    values = {s.name: s.default_value for s in material.node_tree.nodes[NODE_NAME].inputs}
    assert values["Index Inside"] == pytest.approx(-1.33) and values["Permeability Inside"] == -10
    assert values["Index Outside"] == 1.5 and values["Permeability Outside"] == 2
    assert tuple(values["Tint"]) == (0.25, 0.5, 0.75, 1)


MEDIA_WITH_LOSS = [
    Medium(-1.33 + 1e-6j),
    Medium(1.5 + 0.01j),
    Medium(0.055 + 3.32j),  # silver
    Medium(-0.8 + 0.3j, -1.2 + 0.1j),
    Medium.of(0.01 + 0.02j),  # epsilon near zero
    Medium.of(-2.0, 1.5),
    Medium.of(2.0, -1.5),
    Medium.of(-1.7, -0.7 + 0.3j),  # all of its loss is of mu
    Medium.of(-1.77 + 1e-3j, -1.77 + 1e-3j),
]


@both_backends
@pytest.mark.parametrize("medium", MEDIA_WITH_LOSS, ids=str)
def test_media_with_loss_are_read_back(medium, backend, empty_file):
    for inside, outside in ((medium, Medium(1.33)), (Medium(-1.5, -2), medium)):
        node = interface_material("A", inside, outside, backend=backend).node_tree.nodes[NODE_NAME]
        got = interface_of(node)
        for read, wanted in ((got.inside, inside), (got.outside, outside)):
            assert read.index == pytest.approx(wanted.index, rel=1e-6)
            assert read.permeability == pytest.approx(wanted.permeability, rel=1e-6)
            assert read.is_single_negative == wanted.is_single_negative
    assert node.inputs["Absorption Outside"].default_value == pytest.approx(medium.absorption(), rel=1e-6)
    assert node.inputs["Absorption Inside"].default_value == 0


def test_losses_are_read_as_the_shaders_read_them(empty_file):
    node = interface_material("A", Medium(-1.5), backend="nodes").node_tree.nodes[NODE_NAME]
    value = {socket.name: socket for socket in node.inputs}
    # an absorption alone is a k
    value["Absorption Inside"].default_value = 20.0
    assert interface_of(node).inside.absorption() == pytest.approx(20.0)
    # a mu that no medium without gain has with this index counts as its negative
    value["Extinction Inside"].default_value, value["Permeability Inside"].default_value = 0.25, 1.0
    assert interface_of(node).inside == Medium(-1.5 + 0.25j, -1.0)
    # gain, and what is none of this
    value["Extinction Inside"].default_value = -0.25
    assert interface_of(node) is None
    value["Extinction Inside"].default_value = math.nan
    assert interface_of(node) is None
    noise = node.id_data.nodes.new("ShaderNodeTexNoise")
    value["Extinction Inside"].default_value = 0.25
    node.id_data.links.new(noise.outputs[0], value["Permeability Loss Inside"])
    assert interface_of(node) is None


@pytest.mark.parametrize(
    "medium", [Medium(-1.33 + 1e-6j), Medium.of_index(-1.33, spectra.read("table(300 1e-6 800 2e-6)"))]
)
def test_a_volume_absorbs_in_the_place_of_the_interface(medium, empty_file):
    material = interface_material("A", medium, backend="nodes", volume=True)
    output = material.node_tree.get_output_node("CYCLES")
    (link,) = output.inputs["Volume"].links
    assert link.from_node.type == "VOLUME_ABSORPTION"
    assert link.from_node.inputs["Density"].default_value == pytest.approx(medium.absorption(), rel=1e-6)
    assert tuple(link.from_node.inputs["Color"].default_value) == (0, 0, 0, 1)
    node = material.node_tree.nodes[NODE_NAME]
    assert node.inputs["Absorption Inside"].default_value == 0 and not node.inputs["Absorption Inside"].is_linked
    assert interface_of(node).inside.absorption() == pytest.approx(medium.absorption(), rel=1e-6)
    clear = interface_material("B", Medium(-1.5), backend="nodes", volume=True)
    assert not clear.node_tree.get_output_node("CYCLES").inputs["Volume"].is_linked


def test_an_outdated_group_is_brought_up_to_date_in_place(empty_file, render):
    scene = furnace(Medium(-1.5))
    group = INTERFACE.group()
    script, text = script_of(group), script_of(group).script
    # an older version of the shader, which lost a quarter of the light
    older = INTERFACE.source().replace("passed = tint;", "passed = 0.75 * tint;")
    text.from_string(older)
    script.bytecode = bytecode_of(INTERFACE.shader, older)
    script.bytecode_hash = hashlib.md5(script.bytecode.encode()).hexdigest()
    assert render(scene).mean() < 0.95

    assert INTERFACE.group() == group and script_of(group) == script and script.script == text
    assert text.as_string() == INTERFACE.source()
    assert len(bpy.data.node_groups) == len(bpy.data.texts) == 1
    assert render(scene).mean() == pytest.approx(1, abs=1e-3)


@both_backends
def test_a_medium_by_wavelength_leaves_the_file_with_its_groups_and_texts(empty_file, backend):
    def there():
        return sorted(one.name for kind in (bpy.data.node_groups, bpy.data.texts) for one in kind)

    node = INTERFACE.nodes_of(interface_material("x", Medium(-1.5), backend=backend))[0]
    before = there()
    set_medium(node, "Inside", Medium.parse("gold"))
    set_medium(node, "Outside", Medium.parse("gold"))
    set_medium(node, "Inside", Medium(-1.5))
    assert medium_of(node, "Outside") == Medium.parse("gold"), "the other side keeps the group that both shared"
    set_medium(node, "Outside", Medium(1.0))
    assert there() == before and len(node.id_data.nodes) == 3


def test_unknown_backend(empty_file, one_sentence):
    with pytest.raises(ValueError) as caught:
        interface_material("A", Medium(-1.5), backend="magic")
    one_sentence(caught.value, "'magic'", "auto, osl, nodes")
    assert not bpy.data.materials and not bpy.data.node_groups


@pytest.mark.parametrize(
    "media, tint, kind, words",
    [
        ((-1.5,), (1, 1, 1), TypeError, "inside = -1.5 is no Medium"),
        ((Medium(-1.5), "water"), (1, 1, 1), TypeError, "outside = 'water' is no Medium"),
        ((Medium.parse("n=table(500 1.5 600 1.4)"),), (1, 1, 1), ValueError, "does not cover 380 nm"),
        ((Medium(-1.5),), (1, 1), ValueError, "three numbers from 0 to 1"),
        ((Medium(-1.5),), (1, 1, 1, 1), ValueError, "three numbers from 0 to 1"),
        ((Medium(-1.5),), 0.5, ValueError, "three numbers from 0 to 1"),
        ((Medium(-1.5),), "red", ValueError, "three numbers from 0 to 1"),
        ((Medium(-1.5),), (1, 1, 1.5), ValueError, "three numbers from 0 to 1"),
        ((Medium(-1.5),), (1, -0.5, 1), ValueError, "three numbers from 0 to 1"),
        ((Medium(-1.5),), (1, math.nan, 1), ValueError, "three numbers from 0 to 1"),
    ],
)
def test_what_is_no_medium_or_tint_is_refused_and_leaves_nothing(empty_file, one_sentence, media, tint, kind, words):
    with pytest.raises(kind) as error:
        interface_material("x", *media, backend="nodes", tint=tint)
    one_sentence(error.value, words)
    assert not len(bpy.data.materials) and not len(bpy.data.node_groups)


def test_a_node_of_what_is_no_medium_is_refused_and_leaves_nothing(empty_file, one_sentence):
    tree = empty_tree(bpy.data.materials.new("Mine"))
    with pytest.raises(TypeError) as error:
        interface_node(tree, None, backend="nodes")
    one_sentence(error.value, "inside = None is no Medium")
    with pytest.raises(ValueError) as error:
        interface_node(tree, Medium(1.5), Medium.parse("n=table(500 1.5 600 1.4)"), backend="nodes")
    one_sentence(error.value, "known from 500 to 600 nm", "does not cover 380 nm")
    assert not len(tree.nodes) and not len(bpy.data.node_groups)


def test_blender_without_osl(empty_file, monkeypatch, one_sentence):
    monkeypatch.setattr(backends, "osl_available", lambda: False)
    with pytest.raises(RuntimeError) as caught:
        interface_material("A", Medium(-1.5), backend="osl")
    one_sentence(str(caught.value).replace(bpy.app.version_string, "4.x"), "without OSL", "blender.org")
    assert not bpy.data.materials and not bpy.data.node_groups and not bpy.data.texts
    material = interface_material("A", Medium(-1.5))
    assert material.node_tree.nodes[NODE_NAME].node_tree.name == "NIM Interface (nodes)"


def test_survives_in_a_file_without_the_addon(empty_file, tmp_path):
    scene = furnace(Medium(-1.5), bump=True)
    node = scene.objects["Sphere"].data.materials[0].node_tree.nodes[NODE_NAME]
    node.inputs["Tint"].default_value = (1, 0.5, 1, 1)
    bpy.context.window.scene = scene  # the one that opens with the file
    file, picture = tmp_path / "furnace.blend", tmp_path / "furnace.exr"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), check_existing=False)
    program = f"""
import sys
sys.modules["nim_addon"] = None  # were it installed, importing it would now raise
import bpy
bpy.ops.wm.open_mainfile(filepath={str(file)!r})
scene = bpy.context.scene
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = {str(picture)!r}
bpy.ops.render.render(write_still=True)
"""
    # -I: neither this folder nor PYTHONPATH is on sys.path
    subprocess.run([sys.executable, "-I", "-c", program], check=True, stdout=subprocess.DEVNULL, cwd=tmp_path)
    import OpenImageIO as oiio

    pixels = oiio.ImageBuf(str(picture)).get_pixels(oiio.FLOAT)[..., :3]
    assert pixels[..., [0, 2]].mean() == pytest.approx(1, abs=1e-3)
    middle = pixels.shape[0] // 2
    assert 0.01 < pixels[middle - 8 : middle + 8, middle - 8 : middle + 8, 1].mean() < 0.6, (
        "the tint of the file's own node is in the picture"
    )


# A link


def test_a_sign_driven_by_a_texture_bends_both_ways(empty_file, render):
    pictures = []
    for backend in ("osl", "nodes"):
        stage = Stage("signs", (64, 32), backend)
        material = interface_material("Surface", Medium(1.5), backend=backend)
        tree = material.node_tree
        xyz = tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], xyz.inputs[0])
        steps = tree.nodes.new("ShaderNodeMath")  # 1.5 where y > 0, -1.5 where y < 0
        steps.operation = "SIGN"
        scale = tree.nodes.new("ShaderNodeMath")
        scale.operation = "MULTIPLY"
        scale.inputs[1].default_value = 1.5
        tree.links.new(xyz.outputs["Y"], steps.inputs[0])
        tree.links.new(steps.outputs[0], scale.inputs[0])
        tree.links.new(scale.outputs[0], tree.nodes[NODE_NAME].inputs["Index Inside"])
        stage.mesh("Surface", *shapes.rectangle((-1, -1), (1, 1)), material)
        halves = surfaces.shining(
            "Floor",
            lambda nodes: nodes.math(
                "GREATER_THAN",
                nodes.add(
                    "ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeTexCoord").outputs["Object"]}
                ).outputs["X"],
            ),
        )
        stage.mesh("Floor", *shapes.rectangle((-8, -8), (8, 8), -1), halves)
        camera = stage.camera((-3, 0, 3), (0, 0, 0), 40)
        camera.data.type, camera.data.ortho_scale = "ORTHO", 0.1
        pictures.append(render(small(stage.scene, 16, 64)).mean(axis=2))
    for picture in pictures:
        left, right = picture[:, :8].mean(), picture[:, 8:].mean()  # one lands at x > 0, the other at x < 0
        assert abs(left - right) > 0.9
    assert abs(pictures[0] - pictures[1]).mean() < 0.02


# The optics


@pytest.mark.parametrize("inside, outside", [(1.5, 1.0), (1.33, 1.5), (-1.5, -1.33)])
def test_between_dielectrics_the_nodes_are_blenders_glass(inside, outside, empty_file, render):
    """Pixel for pixel, and so at the same cost; a bent normal or a permeability of its own takes the other way."""
    pictures = []
    for glass in (False, True):
        stage = Stage("glass", (48, 48), "nodes")
        stage.mesh(
            "Floor", *shapes.rectangle((-9, -9), (9, 9), -1.2), surfaces.shining("Floor", lambda nodes: (0.9, 0.5, 0.1))
        )
        one = interface_material("Sphere", Medium(inside), Medium(outside), backend="nodes")
        if glass:
            nodes = Nodes(empty_tree(one))
            nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs={"Roughness": 0.0, "IOR": inside / outside}))
        ball(stage, "Sphere", (0, 0, 0), 1.0, one)
        stage.camera((0, -4, 1), (0, 0, 0), 40)
        stage.world(surfaces.sky("Sky", (1.0, 0.9, 0.75), (0.25, 0.45, 0.9)))
        pictures.append(render(small(stage.scene, 48, 16)))
    assert pictures[0].std() > 0.1
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-6


@both_backends
@pytest.mark.parametrize("bump", [False, True], ids=["smooth", "bump"])
@pytest.mark.parametrize("inside", [False, True], ids=["outside", "inside"])
@pytest.mark.parametrize("n, mu", [(-1.5, None), (-1.0, None), (-0.6, None), (1.5, None), (-1.33, -25)])
def test_white_furnace(n, mu, bump, inside, backend, empty_file, render):
    picture = render(furnace(Medium(n, mu), bump=bump, inside=inside, backend=backend))
    assert picture.max() < 1 + 1e-4
    # A sample is lost whole or not at all, a speck darker than its surroundings. One in 10,000 is allowed: 1 in
    # 70,000 gets lost at the rim of a smooth NIM. A normal that faces away from the viewer, at the rim or on a bump,
    # loses thirteen times as many as that if the shader does not see to it.
    lost = 1 - picture.astype(float).mean()
    assert lost < 1e-4, f"{np.sum(picture[..., 0] < 0.999)} specks"


def landing(medium, d, flipped, render, backend="osl"):
    """x and y at which a ray along d through the origin, in a surface z = 0 of `medium`, meets z = -1."""
    stage = Stage("landing", (64, 48), backend)
    vertices, faces = shapes.rectangle((-1, -1), (1, 1))
    faces = [face[::-1] for face in faces] if flipped else faces
    stage.mesh("Surface", vertices, faces, interface_material("Surface", medium, backend=backend))

    def coordinates(nodes):
        # x + 9, y + 9 and 1: what is reflected or dimmed on the way cancels in their ratios
        xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeTexCoord").outputs["Object"]})
        return nodes.add(
            "ShaderNodeCombineXYZ",
            inputs={0: nodes.math("ADD", xyz.outputs[0], 9.0), 1: nodes.math("ADD", xyz.outputs[1], 9.0), 2: 1.0},
        ).outputs[0]

    stage.mesh("Floor", *shapes.rectangle((-8, -8), (8, 8), -1), surfaces.shining("Floor", coordinates))
    parallel_rays(stage, d)
    r, g, b = render(small(stage.scene, 8, 16)).astype(float).mean((0, 1))
    assert b > 0.1, "nothing arrived"
    return np.array([r, g]) / b - 9


@both_backends
@pytest.mark.parametrize("d", [(1, 0, -1), (0.2, -0.5, -1), (-0.1, 0.05, -1)])
@pytest.mark.parametrize("flipped", [False, True], ids=["from outside", "from inside"])
@pytest.mark.parametrize("n", [-1.33, 1.33, -0.9])
def test_where_a_ray_lands(n, flipped, d, backend, empty_file, render):
    t = Interface(Medium(n)).refract(d, (0, 0, -1 if flipped else 1))
    np.testing.assert_allclose(landing(Medium(n), d, flipped, render, backend), t[:2] / -t[2], rtol=0, atol=1e-3)


def test_where_a_ray_lands_by_hand(empty_file, render):
    # Snell: sin = sin(45 degrees) / 1.33, backwards
    assert landing(Medium(-1.33), (1, 0, -1), False, render)[0] == pytest.approx(-0.6277, abs=1e-3)


def test_a_socket_edited_by_hand_is_rendered(empty_file, render):
    landing(Medium(-1.33), (1, 0, -1), False, render)
    scene = bpy.data.scenes["NIM landing"]
    node = scene.objects["Surface"].data.materials[0].node_tree.nodes[NODE_NAME]
    node.inputs["Index Inside"].default_value = 1.33
    r, _, b = render(scene).astype(float).mean((0, 1))
    assert r / b - 9 == pytest.approx(0.6277, abs=1e-3)
    node.inputs["Tint"].default_value = (0, 0, 0, 1)
    assert render(scene).max() == 0


@both_backends
@pytest.mark.parametrize(
    "inside, outside, degrees",
    [
        (Medium(-1.5), VACUUM, 70),
        (Medium(-1.33, -10), VACUUM, 60),
        (Medium(-1.33, -25), VACUUM, 0),
        (Medium(1.5, 4), Medium(-2, -3), 40),
        (Medium(-2.418), Medium(-1.33), 75),
        (VACUUM, Medium(1.33), 45),
        (VACUUM, Medium(1.5), 60),
        (VACUUM, Medium(-1.5), 60),
    ],
    ids=str,
)
@pytest.mark.parametrize("flipped", [False, True], ids=["from outside", "from inside"])
def test_reflectance(inside, outside, degrees, flipped, backend, empty_file, render):
    if flipped:  # the same two media, described from the other side
        inside, outside = outside, inside
    stage = Stage("reflectance", (64, 48), backend)
    vertices, faces = shapes.rectangle((-1, -1), (1, 1))
    faces = [face[::-1] for face in faces] if flipped else faces
    stage.mesh("Surface", vertices, faces, interface_material("Surface", inside, outside, backend=backend))
    stage.mesh("Black", *shapes.rectangle((-99, -99), (99, 99), -1), surfaces.shining("Black", lambda nodes: (0, 0, 0)))
    stage.world(surfaces.sky("White", (1, 1, 1), (1, 1, 1)))
    angle = math.radians(degrees)
    parallel_rays(stage, (math.sin(angle), 0, -math.cos(angle)))
    size, samples = 32, 32
    got = float(render(small(stage.scene, size, samples)).astype(float).mean())
    interface = Interface(inside, outside)
    expected = float((interface.reversed() if flipped else interface).fresnel(math.cos(angle)).R)
    # each sample is 0 or 1: the standard error of their mean is at most that of tossing coins
    error = math.sqrt(expected * (1 - expected) / (size * size * samples))
    assert abs(got - expected) <= 4 * error + 1e-6

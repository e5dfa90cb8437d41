# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks: what spoils the picture of an interface is found, said, and mended; the renders that they speak of are wrong.

The rig is a floor under a wide slab of n = -1, which reflects nothing: in the light of a sun it is as bright as without.
"""

import math

import bpy
import pytest

from nim_addon import caustics, checks
from nim_addon.cycles import settings
from nim_addon.cycles.material import interface_material, interface_node
from nim_addon.cycles.nodes import empty_tree
from nim_addon.cycles.visibility import as_rendered
from nim_addon.physics import Medium


@pytest.fixture
def scene(empty_file):
    scene = bpy.context.scene
    settings.lossless(scene, "nodes")
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
    return scene


def box(half, bottom, top):
    mesh = bpy.data.meshes.new("Box")
    points = [(x, y, z) for z in (bottom, top) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))]
    sides = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    mesh.from_pydata(points, [], [(3, 2, 1, 0), (4, 5, 6, 7), *sides])
    return mesh


def add(scene, name, mesh, material):
    thing = bpy.data.objects.new(name, mesh)
    mesh.materials.append(material)
    scene.collection.objects.link(thing)
    return thing


def codes(scene):
    return [problem.code for problem in checks.problems(scene)]


def slab():
    return bpy.data.objects["Slab"]


def sun():
    return bpy.data.objects["Sun"]


def nim():
    return bpy.data.materials["NIM"]


def no_diffuse_bounces(scene):
    scene.cycles.diffuse_bounces = 0


def no_bounces(scene):
    scene.cycles.max_bounces = 0


def fast_gi(scene):
    scene.cycles.use_fast_gi = True


def adaptive_and_small(scene):
    scene.cycles.use_adaptive_sampling = True
    sun().data.angle = math.radians(2.0)
    scene.cycles.samples = 2048


def no_chance(scene):
    sun().data.cycles.use_multiple_importance_sampling = False


def no_shadow(scene):
    sun().data.use_shadow = False


def no_shadow_of_slab(scene):
    slab().visible_shadow = False


def not_for_diffuse(scene):
    slab().visible_diffuse = False


def not_linked_to_shadow(scene):
    held = bpy.data.collections.new("Blockers")
    held.objects.link(slab())
    held.collection_objects[0].light_linking.link_state = "EXCLUDE"
    sun().light_linking.blocker_collection = held


def only_others_cast_shadow(scene):
    held, child = bpy.data.collections.new("Blockers"), bpy.data.collections.new("Child")
    child.objects.link(bpy.data.objects["Floor"])
    held.children.link(child)
    sun().light_linking.blocker_collection = held


def shadow_caustics(scene):
    sun().data.cycles.is_caustics_light = True
    slab().cycles.is_caustics_caster = True
    bpy.data.objects["Floor"].cycles.is_caustics_receiver = True


def shadow_trick(scene):
    tree = nim().node_tree
    output = tree.get_output_node("CYCLES")
    path, clear, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("LightPath", "BsdfTransparent", "MixShader"))
    tree.links.new(output.inputs["Surface"].links[0].from_socket, mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    tree.links.new(path.outputs["Is Shadow Ray"], mix.inputs["Fac"])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def offset(scene):
    if hasattr(slab(), "shadow_terminator_shading_offset"):
        slab().shadow_terminator_shading_offset = 1.0
    else:  # until 4.2
        slab().cycles.shadow_terminator_offset = 1.0


def overridden(scene):
    scene.view_layers[0].material_override = bpy.data.materials["Matt"]


def dark_tint(scene):
    set_tint((-0.5, 1.5, math.nan))


def set_tint(color):
    nim().node_tree.nodes["NIM Interface"].inputs["Tint"].default_value = (*color, 1.0)


# what a wrong setting makes of a floor that is 1 bright, and whether a button mends it; light that is counted twice is
# 1.94, since both ways share by chance what is near the sun's middle, and more where shadow linking lets it through, in
# each Blender another number
SPOILT = [
    ("diffuse_bounces", no_diffuse_bounces, 0.0, True),
    ("bounces", no_bounces, 0.0, True),
    ("fast_gi", fast_gi, 0.0, True),
    ("adaptive_sampling", adaptive_and_small, 0.0, True),
    ("light_by_chance", no_chance, 0.0, True),
    ("light_shadow", no_shadow, 1.94, True),
    ("ray_visibility", no_shadow_of_slab, 1.94, True),
    ("ray_visibility", not_for_diffuse, 0.06, True),
    ("shadow_linking", not_linked_to_shadow, None, False),
    ("shadow_linking", only_others_cast_shadow, None, False),
    ("shadow_caustics", shadow_caustics, 0.0, True),
    ("shadow_trick", shadow_trick, 1.94, False),
    ("layer_material", overridden, 0.0, True),
]


@pytest.mark.parametrize(
    "code, spoil, brightness, mendable", SPOILT, ids=lambda value: getattr(value, "__name__", None) or str(value)
)
def test_what_is_said_is_wrong_and_what_is_mended_is_right(scene, render, code, spoil, brightness, mendable):
    assert codes(scene) == []
    spoil(scene)
    (problem,) = checks.problems(scene)
    assert problem.code == code and problem.sentence.endswith(".") and "{" not in problem.sentence
    mean = float(render(scene).mean())
    assert mean > 1.9 if brightness is None else mean == pytest.approx(brightness, abs=0.01)
    assert (problem.remedy is not None) == mendable
    if mendable:
        checks.mend(scene)
        assert codes(scene) == []
        seen = render(scene)
        assert seen.mean() == pytest.approx(1.0, abs=max(0.005, 4 * float(seen.std()) / 8))


def glossy_world_off(scene):
    scene.world.cycles_visibility.glossy = False


def world_of_layer_off(scene):
    layer = scene.view_layers[0]
    other = bpy.data.worlds.new("Other")
    if hasattr(layer, "world_override"):  # from 4.3
        layer.world_override = other
    else:
        scene.world = other
    other.cycles_visibility.camera = False


def few_samples_of_layer(scene):
    scene.view_layers[0].samples = 1


def caustics_off(scene):
    scene.cycles.caustics_reflective = False


def glossy_bounces_few(scene):
    scene.cycles.glossy_bounces = 4


def not_for_glossy(scene):
    slab().visible_glossy = False


def not_for_transmission(scene):
    slab().visible_transmission = False


@pytest.mark.parametrize(
    "code, spoil",
    [
        ("world_visibility", glossy_world_off),
        ("world_visibility", world_of_layer_off),
        ("layer_samples", few_samples_of_layer),
        ("caustics", caustics_off),
        ("bounces", glossy_bounces_few),
        ("shading_offset", offset),
        ("ray_visibility", not_for_glossy),
        ("ray_visibility", not_for_transmission),
        ("tint", dark_tint),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_what_else_is_found_and_mended(scene, code, spoil):
    spoil(scene)
    assert codes(scene) == [code]
    checks.mend(scene)
    assert codes(scene) == []


def test_a_tint_is_brought_into_range(scene):
    dark_tint(scene)
    checks.mend(scene)
    assert tuple(nim().node_tree.nodes["NIM Interface"].inputs["Tint"].default_value) == (0, 1, 1, 1)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda scene: setattr(slab(), "is_holdout", True),
        lambda scene: setattr(scene.cycles, "film_exposure", 2.0),
        lambda scene: setattr(scene.render, "use_border", True),
        lambda scene: setattr(scene.cycles, "use_denoising", True),
        lambda scene: setattr(slab(), "visible_camera", False),
        lambda scene: setattr(bpy.data.objects["Floor"], "visible_glossy", False),
        lambda scene: setattr(slab().cycles, "is_caustics_caster", True),
        lambda scene: sky_portal(scene),
    ],
    ids=["holdout", "exposure", "border", "denoising", "unseen", "floor", "no caustics light", "sky portal"],
)
def test_a_persons_choice_is_not_spoken_of(scene, spoil):
    spoil(scene)
    assert codes(scene) == []


def sky_portal(scene):
    light = bpy.data.lights.new("Window", "AREA")
    light.size, light.cycles.is_portal, light.cycles.use_multiple_importance_sampling = 0.0, True, False
    scene.collection.objects.link(bpy.data.objects.new("Window", light))


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_baked_caustics_are_no_problem(scene, angle):
    sun().data.angle = math.radians(angle)
    caustics.bake(scene, photons=1 << 12, texels=16)
    assert sun().data.cycles.use_multiple_importance_sampling is False and codes(scene) == []
    caustics.clear(scene)
    assert codes(scene) == ([] if angle else ["zero_light"])


def test_shells_that_forgot_what_is_outside_of_them_are_mended(scene, render):
    """Twenty matched balls, one in the other, each in air as it says: paths are trapped until their bounces run out."""
    for name in ("Slab", "Floor", "Sun"):
        bpy.data.objects.remove(bpy.data.objects[name])
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 20.0
    scene.camera.location.z, scene.cycles.samples = 3.0, 4
    material = interface_material("NIM", Medium(-2.0, -2.0), backend="nodes")
    for k in range(20):
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1 - 0.04 * k)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material.copy())
    assert render(scene).mean() < 0.2
    checks.mend(scene)
    assert codes(scene) == [] and render(scene).mean() == pytest.approx(1.0, abs=0.002)


# ------------------------------------------------------------------------------------------- numbers


@pytest.mark.parametrize("name", ["Index Inside", "Permeability Inside", "Index Outside", "Permeability Outside"])
@pytest.mark.parametrize("value, word", [(0.0, "refracts nothing"), (math.nan, "range"), (1e7, "range"), (-1e-9, "0")])
@pytest.mark.parametrize("fed", [False, True], ids=["in the socket", "by a Value node"])
def test_a_number_that_nothing_has(scene, one_sentence, name, value, word, fed):
    put(name, value, fed)
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "NIM", name, word)
    assert problem.code == "number" and problem.remedy is None and problem.materials == ("NIM",)


def test_a_number_that_a_driver_or_ones_own_group_gives(scene):
    own_group(scene)
    group = bpy.data.node_groups["Mine"]
    group.interface.new_socket("n", in_out="INPUT", socket_type="NodeSocketFloat")
    node = next(one for one in group.nodes if one.type == "GROUP")
    group.links.new(group.nodes.new("NodeGroupInput").outputs["n"], node.inputs["Index Inside"])
    outer = bpy.data.materials["Grouped"].node_tree.nodes["Group"].inputs["n"]
    outer.default_value = -1.5
    assert codes(scene) == []
    outer.driver_add("default_value").driver.expression = "0.0"
    bpy.context.view_layer.update()
    assert codes(scene) == ["number"]


def test_a_tint_that_a_value_gives_and_an_index_that_a_colour_gives(scene):
    value, colour = (nim().node_tree.nodes.new(f"ShaderNode{kind}") for kind in ("Value", "RGB"))
    sockets = nim().node_tree.nodes["NIM Interface"].inputs
    nim().node_tree.links.new(value.outputs[0], sockets["Tint"])
    nim().node_tree.links.new(colour.outputs[0], sockets["Index Inside"])
    value.outputs[0].default_value, colour.outputs[0].default_value = 2.0, (0.0, 1.0, 1.0, 1.0)
    assert codes(scene) == ["tint"]
    checks.mend(scene)
    assert codes(scene) == [] and value.outputs[0].default_value == 1.0


def put(name, value, fed=False):
    tree = nim().node_tree
    socket = tree.nodes["NIM Interface"].inputs[name]
    if fed:
        node = tree.nodes.new("ShaderNodeValue")
        tree.links.new(node.outputs[0], socket)
        socket = node.outputs[0]
    socket.default_value = value
    return socket


@pytest.mark.parametrize("fed", [False, True], ids=["in the socket", "by a Value node"])
@pytest.mark.parametrize("strip", [False, True], ids=["action", "strip"])
@pytest.mark.parametrize(
    "keys, words",
    [
        ({1: -1.5, 20: 0.0, 40: -2.0}, ("is 0 on frame 20",)),
        ({1: -1.5, 20: 1e9, 40: -1.5}, ("out of range",)),
        ({1: -1.5, 40: 1.5}, ("passes through 0 before frame 21",)),
    ],
)
def test_a_number_that_is_wrong_on_the_way(scene, one_sentence, fed, strip, keys, words):
    socket = put("Index Inside", -1.5, fed)
    for frame, value in keys.items():
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    scene.frame_set(1)
    if strip:
        animation = nim().node_tree.animation_data
        action, slot = animation.action, getattr(animation, "action_slot", None)
        played = animation.nla_tracks.new().strips.new("Strip", 1, action)
        if slot:
            played.action_slot = slot
        animation.action = None
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "NIM", "Index Inside", *words)


def test_an_animation_that_is_right(scene):
    socket = put("Index Inside", -1.5)
    for frame, value in ((1, -1.5), (40, -0.5)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    assert codes(scene) == []


def test_a_tint_that_is_wrong_on_the_way(scene, one_sentence):
    socket = nim().node_tree.nodes["NIM Interface"].inputs["Tint"]
    for frame, value in ((1, 1.0), (11, 2.0)):
        socket.default_value = (1.0, value, 1.0, 1.0)
        socket.keyframe_insert("default_value", frame=frame)
    scene.frame_set(1)
    (problem,) = checks.problems(scene)
    one_sentence(problem.sentence, "frame 2", "1.0")
    assert problem.code == "tint" and problem.remedy is None


# ------------------------------------------------------------------------------------------- what is in a scene


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


def instanced(scene):
    held = bpy.data.collections.new("Held")
    held.objects.link(slab())
    scene.collection.objects.unlink(slab())
    maker = bpy.data.objects.new("Maker", None)
    maker.instance_type, maker.instance_collection = "COLLECTION", held
    scene.collection.objects.link(maker)


def by_geometry_nodes(scene):
    material = slab().data.materials[0]
    slab().data.materials[0] = None
    tree = bpy.data.node_groups.new("Set", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    enter, put, leave = (tree.nodes.new(k) for k in ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput"))
    put.inputs["Material"].default_value = material
    tree.links.new(enter.outputs[0], put.inputs["Geometry"])
    tree.links.new(put.outputs[0], leave.inputs[0])
    slab().modifiers.new("Set", "NODES").node_group = tree


def hidden_in_the_viewport(scene):
    slab().hide_viewport = True


@pytest.mark.parametrize("place", [own_group, instanced, by_geometry_nodes, hidden_in_the_viewport])
def test_an_interface_is_seen_wherever_it_is(scene, place):
    place(scene)
    assert codes(scene) == [] and len(checks.interfaces(scene)) == 1
    scene.cycles.blur_glossy = 1.0
    slab().visible_shadow = False
    assert codes(scene) == ["filter_glossy", "ray_visibility"]
    checks.mend(scene)
    assert codes(scene) == [] and slab().visible_shadow


def test_an_instance_is_as_visible_as_what_makes_it(scene):
    instanced(scene)
    bpy.data.objects["Maker"].visible_shadow = False
    assert codes(scene) == ["ray_visibility"]
    checks.mend(scene)
    assert codes(scene) == []


def test_the_lamp_of_an_instance_counts(scene):
    sun().data.angle = 0.0
    held = bpy.data.collections.new("Held")
    held.objects.link(sun())
    scene.collection.objects.unlink(sun())
    assert codes(scene) == []
    maker = bpy.data.objects.new("Maker", None)
    maker.instance_type, maker.instance_collection = "COLLECTION", held
    scene.collection.objects.link(maker)
    assert codes(scene) == ["zero_light"]
    checks.mend(scene)
    assert codes(scene) == []


def test_what_is_hidden_from_renders_is_not_spoken_of(scene):
    held = bpy.data.collections.new("Hidden")
    scene.collection.children.link(held)
    held.objects.link(slab())
    scene.collection.objects.unlink(slab())
    slab().visible_shadow = False
    assert codes(scene) == ["ray_visibility"]
    held.hide_render = True
    assert codes(scene) == [] and checks.interfaces(scene) == []


def test_looking_changes_nothing(scene):
    slab().hide_viewport = True
    checks.problems(scene)
    assert slab().hide_viewport
    with as_rendered(scene):
        assert not slab().hide_viewport


def test_an_interface_that_only_a_later_view_layer_shows_is_said(scene):
    later = scene.view_layers.new("Later")
    alone = bpy.data.collections.new("Alone")
    scene.collection.children.link(alone)
    assert "other_layers" not in codes(scene)  # both show it
    scene.collection.objects.unlink(slab())
    alone.objects.link(slab())
    scene.view_layers[0].layer_collection.children["Alone"].exclude = True
    (problem,) = checks.problems(scene)
    assert problem.sentence == (
        "Only the view layer Later shows Slab: checks, caustics and light paths look at the first one, "
        f"{scene.view_layers[0].name}."
    )
    later.use = False
    assert not checks.problems(scene)


def test_bumps_of_a_wide_filter_are_said_and_narrowed(scene):
    tree = nim().node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], bump.inputs["Height"])
    if "Filter Width" in bump.inputs:
        assert not checks.problems(scene)  # linked to nothing
        bump.inputs["Filter Width"].default_value = 1.0
    interface = next(node for node in tree.nodes if node.type == "GROUP")
    tree.links.new(bump.outputs["Normal"], interface.inputs["Normal"])
    (problem,) = checks.problems(scene)
    assert problem.code == "bump_filter"
    if "Filter Width" in bump.inputs:
        assert checks.mend(scene) and not checks.problems(scene)
        assert bump.inputs["Filter Width"].default_value == pytest.approx(0.1)
    else:
        assert problem.remedy is None and "4.5" in problem.sentence

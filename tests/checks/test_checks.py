# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks: what spoils the picture of an interface is found, said, and mended; the renders that they speak of are wrong.

The rig is a floor that the light of a sun reaches through a slab, and is as bright as without.
"""

import math

import bpy
import pytest

from nim_addon import caustics, checks
from nim_addon.checks.sight import look
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.visibility import as_rendered
from nim_addon.physics import Medium
from tests.checks import rig
from tests.checks.rig import codes, dark_tint, nim, own_group, slab, sun


@pytest.fixture
def scene(scene):
    rig.build(scene)
    return scene


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
    path, clear, mix = (tree.nodes.new(f"ShaderNode{name}") for name in ("LightPath", "BsdfTransparent", "MixShader"))
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


# ------------------------------------------------------------------------------------------- what is in a scene


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
    assert codes(scene) == []
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
    assert codes(scene) == []


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


def worn_by_a_modifier():
    """The slab's material is that of its slots no longer: geometry nodes set it."""
    material = slab().active_material
    slab().data.materials.clear()
    tree = bpy.data.node_groups.new("Wear", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    enter, wear, leave = map(tree.nodes.new, ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput"))
    wear.inputs["Material"].default_value = material
    tree.links.new(enter.outputs[0], wear.inputs["Geometry"])
    tree.links.new(wear.outputs[0], leave.inputs[0])
    slab().modifiers.new("Wear", "NODES").node_group = tree


def instanced_alone():
    """The slab is in the scene as an instance only, which an empty makes."""
    held = bpy.data.collections.new("Slab")
    bpy.context.scene.collection.objects.unlink(slab())
    held.objects.link(slab())
    maker = bpy.data.objects.new("Maker", None)
    maker.instance_type, maker.instance_collection = "COLLECTION", held
    bpy.context.scene.collection.objects.link(maker)


@pytest.mark.parametrize("way", [worn_by_a_modifier, instanced_alone])
def test_what_no_slot_of_the_scene_has_is_looked_for_too(scene, way):
    way()
    (thing,) = {obj for obj in scene.objects if obj.name in ("Slab", "Maker")}
    assert codes(scene) == []
    overridden(scene)
    assert codes(scene) == ["layer_material"]
    scene.view_layers[0].material_override = None
    scene.view_layers.new("Later")
    alone = bpy.data.collections.new("Alone")
    scene.collection.children.link(alone)
    scene.collection.objects.unlink(thing)
    alone.objects.link(thing)
    scene.view_layers[0].layer_collection.children["Alone"].exclude = True
    assert codes(scene) == ["other_layers"]


@pytest.mark.parametrize("way", [worn_by_a_modifier, instanced_alone])
def test_it_is_known_to_be_there_where_the_view_hides_it(scene, way):
    way()
    (thing,) = {obj for obj in scene.objects if obj.name in ("Slab", "Maker")}
    thing.hide_viewport = True
    scene.view_layers[0].update()
    sight = look(scene, scene.view_layers[0].depsgraph)
    assert [(material.name, wearers) for material, wearers in sight.worn.items()] == [(nim().name, [])]

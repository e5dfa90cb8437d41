# SPDX-License-Identifier: GPL-3.0-or-later
"""A hint says where caustics would help: it is no problem, and goes when they are baked."""

import math
from types import SimpleNamespace

import bpy
import pytest

from nim_addon import caustics, checks
from nim_addon.checks.hints import NARROW
from nim_addon.cycles import settings
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.visibility import CAUSTICS_MARK
from nim_addon.physics import Medium
from nim_addon.scenes import SCENES, surfaces
from nim_addon.ui import viewport, warnings

from .conftest import Layout


@pytest.fixture
def scene(addon):
    """The file that Blender starts with, in which the cube is a NIM, over a floor."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1.1))
    bpy.context.object.name = "Floor"
    settings.lossless(scene, "nodes")
    bpy.data.objects["Cube"].data.materials[0] = interface_material("NIM", Medium(-1.5), backend="nodes")
    warnings.forget()
    return scene


def hinted(scene):
    """The lamps that the panel gives a hint on; none of them are problems."""
    bpy.context.view_layer.update()
    found = [hint for hint in warnings.known(scene).hints if hint.code != "sky"]
    assert all(hint.code == "caustics" and hint.remedy is None for hint in found)
    return ", ".join(hint.values["lamps"] for hint in found)


def lamp(light_type, **values):
    def change(scene):
        obj = scene.objects["Light"]
        obj.data.type = light_type
        for name, value in values.items():
            setattr(obj if name in ("location", "rotation_euler", "scale") else obj.data, name, value)

    return change


def glass(scene):
    bpy.data.objects["Cube"].data.materials[0] = interface_material("Glass", Medium(1.5), backend="nodes")


def portal(scene):
    lamp("AREA", shape="SQUARE", size=0.2, **DOWN)(scene)
    scene.objects["Light"].data.cycles.is_portal = True


def no_interface(scene):
    bpy.data.objects["Cube"].data.materials.clear()


def nothing_below(scene):
    bpy.data.objects.remove(scene.objects["Floor"])


DOWN = {"location": (0, 0, 6), "rotation_euler": (0, 0, 0)}
CASES = [
    ("point", lamp("POINT"), "Light"),
    ("wide point", lamp("POINT", shadow_soft_size=1.5), ""),
    ("point of no size", lamp("POINT", shadow_soft_size=0.0), ""),
    ("dark point", lamp("POINT", energy=0.0), ""),
    ("sun", lamp("SUN", angle=math.radians(0.53)), "Light"),
    ("wide sun", lamp("SUN", angle=math.radians(24)), ""),
    ("spot", lamp("SPOT", spot_size=math.radians(40), **DOWN), "Light"),
    (
        "spot that looks away",
        lamp("SPOT", spot_size=math.radians(40), **DOWN | {"rotation_euler": (math.pi, 0, 0)}),
        "",
    ),
    ("small area", lamp("AREA", shape="SQUARE", size=0.2, **DOWN), "Light"),
    ("large area", lamp("AREA", shape="SQUARE", size=3.0, **DOWN), ""),
    ("large by its scale", lamp("AREA", shape="SQUARE", size=0.2, scale=(15, 15, 1), **DOWN), ""),
    ("portal", portal, ""),
    # of the body it is the nearest that counts
    ("wide for what is near it", lamp("POINT", shadow_soft_size=math.sqrt(NARROW) * 5, location=(0, 0, 6)), ""),
    ("glass", glass, "Light"),
    ("no interface", no_interface, ""),
    ("nothing below", nothing_below, ""),
]


@pytest.mark.parametrize(("change", "lamps"), [case[1:] for case in CASES], ids=[case[0] for case in CASES])
def test_a_narrow_lamp_over_an_interface_is_hinted_at(scene, change, lamps):
    change(scene)
    assert hinted(scene) == lamps


def drawn_checks(scene):
    """The Layout on which the Checks panel was drawn."""
    layout = Layout()
    context = SimpleNamespace(
        scene=scene,
        space_data=None,
        region=SimpleNamespace(width=9000),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    viewport.NIM_PT_checks.draw(SimpleNamespace(layout=layout), context)
    return layout


@pytest.mark.parametrize("name", SCENES)
def test_the_scenes_whose_sun_is_narrow_say_so(addon, press, name):
    bpy.context.scene.nim_scenes.scene, bpy.context.scene.nim_scenes.backend = name, "nodes"
    press("nim.build_scene")
    warnings.forget()
    assert bool(hinted(bpy.context.scene)) == (name in ("prism", "drop"))


def test_a_hint_is_no_problem_and_has_the_button_that_bakes(scene, one_sentence):
    bpy.context.view_layer.update()
    assert checks.problems(scene) == []
    layout = drawn_checks(scene)
    assert ("operator", "nim.bake_caustics") in layout.drawn
    said = next(line for line in layout.text.splitlines() if "caustics" in line)
    one_sentence(said, "The shadow of Cube stays black")
    assert said.endswith("(Light).") and "Nothing to mend" in layout.text


def test_what_a_sky_would_help_stands_below_the_button_that_mends_all_and_above_what_it_mends(addon, press):
    press("nim.convert")
    assert darkness(bpy.context.scene) == [ALONE] and len(checks.problems(bpy.context.scene)) > 3
    buttons = [name for kind, name in drawn_checks(bpy.context.scene).drawn if kind == "operator"]
    assert buttons[:3] == ["nim.mend", "nim.add_sky", "nim.mend"]


def test_it_goes_when_caustics_are_baked_and_comes_back_without(scene):
    assert hinted(scene) == "Light"
    collection = bpy.data.collections.new("NIM Caustics")
    collection[CAUSTICS_MARK] = True
    scene.collection.children.link(collection)
    assert hinted(scene) == ""
    caustics.clear(scene)
    assert hinted(scene) == "Light"


# ------------------------------------------------------------------------------------------------ something to bend


def darkness(scene):
    """Whether the panel gives the hint that a sky would help, and what it says."""
    bpy.context.view_layer.update()
    warnings.forget()
    return [hint.sentence for hint in warnings.known(scene).hints if hint.code == "sky"]


def no_light(scene):
    bpy.data.objects.remove(scene.objects["Light"])


def no_light_no_world(scene):
    no_light(scene)
    scene.world = None


def dark_light(scene):
    scene.objects["Light"].data.energy = 0.0


def bright(scene):
    no_light(scene)
    background(scene).inputs["Strength"].default_value = 10.0


def background(scene):
    return next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")


def coloured(scene):
    tree = scene.world.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs[0], background(scene).inputs["Color"])


def linked_to_the_other_kind(scene):
    """A number as the sky's colour, and a colour as its strength."""
    no_light(scene)
    tree, node = scene.world.node_tree, background(scene)
    grey, strength = tree.nodes.new("ShaderNodeValue"), tree.nodes.new("ShaderNodeRGB")
    grey.outputs[0].default_value, strength.outputs[0].default_value = 0.05, (1.0, 1.0, 1.0, 1.0)
    tree.links.new(grey.outputs[0], node.inputs["Color"])
    tree.links.new(strength.outputs[0], node.inputs["Strength"])


def coloured_without_light(scene):
    coloured(scene)
    no_light(scene)


def glowing_floor(scene):
    no_light(scene)
    scene.objects["Floor"].data.materials.append(surfaces.shining("Glow", lambda nodes: (1.0, 1.0, 1.0)))


def alone(scene):
    nothing_below(scene)


def alone_under_a_sky(scene):
    nothing_below(scene)
    coloured(scene)


DARK = "Hardly anything shines in this scene: Cube stays in the dark."
ALONE = "There is nothing to bend: Cube is alone in a world of one color."
BACKDROPS = [
    (lambda scene: None, []),
    (no_light, [DARK]),
    (no_light_no_world, [DARK]),
    (dark_light, [DARK]),
    (bright, []),
    (linked_to_the_other_kind, [DARK]),
    (coloured, []),
    (coloured_without_light, []),
    (glowing_floor, []),
    (alone, [ALONE]),
    (alone_under_a_sky, []),
    (no_interface, []),
]


@pytest.mark.parametrize(("change", "said"), BACKDROPS, ids=lambda value: getattr(value, "__name__", None))
def test_where_there_is_nothing_to_bend_or_nothing_shines_a_sky_is_offered(scene, change, said):
    change(scene)
    assert darkness(scene) == said


def test_a_floor_that_a_bake_has_put_a_copy_in_place_of_is_there_to_be_bent(scene):
    assert darkness(scene) == []
    caustics.bake(scene, photons=1 << 12, texels=64)
    assert scene.objects["Floor"].hide_render and darkness(scene) == []


def test_one_click_gives_a_sky_and_one_undo_takes_it_back(scene, press, render):
    nothing_below(scene)
    no_light(scene)
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.cycles.samples = 16
    dark, before = render(scene), scene.world.name
    bpy.ops.ed.undo_push(message="before")
    assert darkness(scene)
    assert ("operator", "nim.add_sky") in drawn_checks(scene).drawn
    assert press("nim.add_sky") == {"FINISHED"}
    lit = render(scene)
    assert lit[..., :3].mean() > 5 * dark[..., :3].mean() and lit[..., :3].std() > 5 * dark[..., :3].std()
    assert darkness(scene) == [] and checks.problems(scene) == []
    bpy.ops.ed.undo()
    assert bpy.context.scene.world.name == before and len(bpy.data.worlds) == 1


def test_the_sky_stands_in_the_place_of_what_overrides_that_of_the_scene(scene, press):
    no_light(scene)
    scene.view_layers[0].world_override = bpy.data.worlds.new("Black")
    assert darkness(scene) == [DARK]
    press("nim.add_sky")
    assert darkness(scene) == []


def test_under_the_sky_a_white_floor_in_the_light_of_a_new_file_is_well_exposed(scene, press, render):
    bpy.data.objects.remove(scene.objects["Cube"])
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.cycles.samples = 64
    press("nim.add_sky")
    floor = render(scene)[:8, :, :3]  # of a scene whose middle grey is 0.18
    assert 0.2 < floor.mean() < 0.6 and floor.max() < 1

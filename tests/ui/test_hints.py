# SPDX-License-Identifier: GPL-3.0-or-later
"""A hint says where caustics would help: it is no problem, and goes when they are baked."""

import math
from types import SimpleNamespace

import bpy
import pytest

from nim_addon import caustics, checks
from nim_addon.cycles import settings
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.visibility import CAUSTICS_MARK
from nim_addon.physics import Medium
from nim_addon.scenes import SCENES
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
    found = warnings.known(scene).hints
    assert all(hint.code == "caustics" and hint.remedy is None for hint in found)
    return ", ".join(hint.values["lamps"] for hint in found)


def lamp(light_type, **values):
    def change(scene):
        obj = scene.objects["Light"]
        obj.data.type = light_type
        for name, value in values.items():
            setattr(obj if name in ("location", "rotation_euler") else obj.data, name, value)

    return change


def glass(scene):
    bpy.data.objects["Cube"].data.materials[0] = interface_material("Glass", Medium(1.5), backend="nodes")


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
    ("glass", glass, "Light"),
    ("no interface", no_interface, ""),
    ("nothing below", nothing_below, ""),
]


@pytest.mark.parametrize(("change", "lamps"), [case[1:] for case in CASES], ids=[case[0] for case in CASES])
def test_a_narrow_lamp_over_an_interface_is_hinted_at(scene, change, lamps):
    change(scene)
    assert hinted(scene) == lamps


@pytest.mark.parametrize("name", SCENES)
def test_the_scenes_whose_sun_is_narrow_say_so(addon, press, name):
    bpy.context.scene.nim_scenes.scene, bpy.context.scene.nim_scenes.backend = name, "nodes"
    press("nim.build_scene")
    warnings.forget()
    assert bool(hinted(bpy.context.scene)) == (name in ("prism", "drop"))


def test_a_hint_is_no_problem_and_has_the_button_that_bakes(scene, one_sentence):
    bpy.context.view_layer.update()
    assert checks.problems(scene) == []
    layout = Layout()
    context = SimpleNamespace(
        scene=scene,
        space_data=None,
        region=SimpleNamespace(width=9000),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    viewport.NIM_PT_checks.draw(SimpleNamespace(layout=layout), context)
    assert ("operator", "nim.bake_caustics") in layout.drawn
    said = next(line for line in layout.text.splitlines() if "caustics" in line)
    one_sentence(said, "The shadow of Cube stays black")
    assert said.endswith("(Light).") and "Nothing to mend" in layout.text


def test_it_goes_when_caustics_are_baked_and_comes_back_without(scene):
    assert hinted(scene) == "Light"
    collection = bpy.data.collections.new("NIM Caustics")
    collection[CAUSTICS_MARK] = True
    scene.collection.children.link(collection)
    assert hinted(scene) == ""
    caustics.clear(scene)
    assert hinted(scene) == "Light"

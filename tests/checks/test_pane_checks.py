# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of lenslets and slabs that a render cannot show, and the buttons that mend it; what is right has no problem."""

import bpy
import numpy as np
import pytest

from nim_addon import checks
from nim_addon.cycles.closures import LENSLET_WINDOW, UNIAXIAL_SLAB
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.slabs import slab_material
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import shapes
from tests.checks.pieces import codes, found


def window(**values):
    material = lenslet_material("Window", LensletWindow(-1.0, aperture=0.5), backend="nodes")
    put("Window", *shapes.rectangle((-1, -1), (1, 1)), material)
    (node,) = LENSLET_WINDOW.nodes_of(material)
    for name, value in values.items():
        node.inputs[name.replace("_", " ").title()].default_value = value
    return node


def plate(shape, thickness=0.25):
    material = slab_material("Slab", UniaxialSlab(2.0, -3.0, thickness), backend="nodes")
    return put("Plate", *shape, material), UNIAXIAL_SLAB.nodes_of(material)[0]


def put(name, vertices, faces, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(vertices, float).tolist(), [], faces)
    mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def test_a_window_alone_is_right(scene):
    window()
    assert codes(scene) == []
    scene.cycles.transparent_max_bounces = 4
    assert codes(scene) == ["transparent_bounces"]


@pytest.mark.parametrize("name", ["eta_u", "eta_v"])
def test_an_eta_of_0(scene, name):
    window(**{name: 0.0})
    (problem,) = found(scene)
    assert (problem.code, problem.remedy) == ("pane_number", None)
    assert problem.sentence.startswith(f"Window: {name.replace('_', ' ').title()} is 0")


def test_an_aperture_of_0_is_mended_to_ideal_lenslets(scene):
    node = window(aperture=0.0)
    (problem,) = found(scene)
    assert problem.code == "aperture" and "the aperture is 0" in problem.sentence
    checks.mend(scene)
    assert codes(scene) == [] and node.inputs["Losses"].default_value == 0
    assert node.inputs["Aperture"].default_value == 0, "which counts for nothing"


@pytest.mark.parametrize("closed", [False, True])
def test_a_plate_of_another_thickness_is_mended(scene, closed):
    shape = shapes.box((-1, -1, -0.25), (1, 1, 0))
    if not closed:
        shape = shape[0], [face for face in shape[1] if len({shape[0][corner][2] for corner in face}) == 1]
    obj, node = plate(shape)
    obj.scale = (1, 2, 3)  # the slab is scaled with it
    assert codes(scene) == []
    node.inputs["Thickness"].default_value = 0.5
    (problem,) = found(scene)
    assert problem.code == "slab_thickness"
    assert problem.sentence == (
        "Plate is 0.25 thick, but its slab has a thickness of 0.5: light leaves it somewhere else."
    )
    checks.mend(scene)
    assert codes(scene) == [] and node.inputs["Thickness"].default_value == pytest.approx(0.25)


def test_a_lamp_of_no_size_is_given_one(scene):
    window()
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    lamp.data.shadow_soft_size = 0.0
    (problem,) = found(scene)
    assert problem.code == "light_at_pane" and problem.sentence.startswith("The light Lamp has no size")
    checks.mend(scene)
    assert codes(scene) == [] and lamp.data.shadow_soft_size > 0


def test_one_face_alone_and_a_permittivity_of_0(scene):
    _, node = plate(shapes.rectangle((-1, -1), (1, 1)))
    assert codes(scene) == ["slab_open"]
    node.inputs["Permittivity Along"].default_value = 0.0
    assert codes(scene) == ["pane_number"]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The uniaxial slab in Cycles, in both forms: where both polarisations leave, and how much, beside physics.uniaxial."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles.material import asked_closures
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.cycles.render import pixels_of
from nim_addon.cycles.slabs import slab_material, slab_of
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import shapes
from tests.cycles.closures.beam import OFFSET, body, floor, landing, pose

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])
HYPERBOLIC = UniaxialSlab(2.0, -3.0, 0.5)
DEPTH = 0.4  # of the floor below the slab
SIGMAS = 4.0
# a plate that is twice as thick, and one that stands elsewhere, turned, and is as thick as before
STANDS = (
    (pose(), 1.0),
    (pose((0.3, 0.8, -2.0), (2.0, 2.0, 2.0), (4.0, 3.0, -6.0)), 2.0),
    (pose((-1.0, 0.1, 0.7), (3.0, 0.5, 1.0), (0.3, 0.0, 0.2)), 1.0),
    # sheared: what lies along z leans, and its faces come nearer to each other
    (pose((0.2, 0.1, 0.4)) @ np.array([(1, 0, 0.75, 0), (0, 1, 0, 0), (0, 0, 0.8, 0), (0, 0, 0, 1)]), 0.8),
)


@pytest.fixture(autouse=True)
def _(empty_file):
    pass


def plate(slab):
    """Two faces that look away from each other, the upper at z = 0."""
    upper, face = shapes.rectangle((-4, -4), (4, 4))
    lower, _ = shapes.rectangle((-4, -4), (4, 4), -slab.thickness)
    return shapes.joined((upper, face), (lower, [face[0][::-1]]))[:2]


def through(slab, backend, stand, theta, side, between=(-OFFSET, OFFSET)):
    """The share of a beam that lands beyond a plate, within bounds of the floor, and how far aside of where it enters.

    stand:  the plate's matrix, and by how much it is thicker; side: 1 from above, -1 from below
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    matrix, scale = stand
    body(*plate(slab), slab_material("Slab", slab, backend=backend), matrix)
    u, v = (matrix[:3, axis] / np.linalg.norm(matrix[:3, axis]) for axis in (0, 1))
    normal = side * np.cross(u, v)
    # where it enters; from below that is the other face
    target = matrix[:3, 3] + matrix[:3, :3] @ (0.11, 0.17, 0 if side > 0 else -slab.thickness)
    floor(target - (scale * slab.thickness + DEPTH) * normal, (u, np.cross(normal, u)), between)
    return landing(target, math.sin(theta) * u - math.cos(theta) * normal, backend)


@both_backends
@pytest.mark.parametrize("side", [1, -1], ids=["above", "below"])
@pytest.mark.parametrize("slab", [HYPERBOLIC, UniaxialSlab(0.6, -0.8, 0.25)], ids=["from 1", "below 1"])
def test_p_leaves_on_the_side_that_it_came_from_and_s_on_the_other(slab, side, backend):
    for stand, degrees in zip(STANDS, (10, 35, 50, 80), strict=True):
        theta = math.radians(degrees)
        slopes, T = slab.slopes(theta), slab.transmittances(theta)
        beyond = DEPTH * math.tan(theta)
        for slope, share, between in (
            (slopes.p, T.p, (-OFFSET, beyond)),
            (slopes.s, T.s, (beyond, OFFSET)),
        ):
            found, (x, y), error = through(slab, backend, stand, theta, side, between)
            assert found == pytest.approx(share / 2, abs=SIGMAS * error)  # two portals and a mirror, taken by chance
            if share:
                depth = stand[1] * slab.thickness
                assert x == pytest.approx(depth * slope + beyond, abs=1e-4 * max(1, depth)) and abs(y) <= 1e-4
    assert (T.s == 0) == (slab.across < 1), "beyond the critical angle of s"


@both_backends
def test_the_shares_are_those_of_all_inner_reflections(backend):
    for slab in (HYPERBOLIC, UniaxialSlab(9.0, 2.0, 0.1), UniaxialSlab(-2.0, 0.5, 0.1)):
        for degrees in (0, 60, 80):
            share, _, error = through(slab, backend, STANDS[0], math.radians(degrees), 1)
            T = slab.transmittances(math.radians(degrees))
            assert share == pytest.approx((T.s + T.p) / 2, abs=SIGMAS * error) and error < 2e-3, degrees


@both_backends
def test_light_is_kept(backend):
    """A plate in a white world, through both faces and mirrored by them."""
    vertices, faces = plate(HYPERBOLIC)
    body(vertices, faces, slab_material("Slab", HYPERBOLIC, backend=backend), pose())
    landing((0, 0.3, 0), (0.6, 0, -0.8), backend)
    world = bpy.context.scene.world
    nodes = Nodes(empty_tree(world))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": (1, 1, 1)}), "World")
    np.testing.assert_allclose(pixels_of(bpy.context.scene), 1, atol=1e-5)


@both_backends
def test_a_closed_plate_is_the_same_and_stands_on_others(backend):
    theta = math.radians(40)
    slopes = HYPERBOLIC.slopes(theta)
    material = slab_material("Slab", HYPERBOLIC, backend=backend)
    for top in (0.0, -0.6):
        body(*shapes.box((-4, -4, top - 0.5), (4, 4, top)), material, pose())
    floor((0.1, 0.3, -1.5), ((1, 0, 0), (0, 1, 0)), (-OFFSET, 0.5 * math.tan(theta)))
    share, (x, _), _ = landing((0.1, 0.3, 0), (math.sin(theta), 0, -math.cos(theta)), backend)
    p = HYPERBOLIC.transmittances(theta).p / 2
    assert share > p * p * 0.9 and x < 0.5 * math.tan(theta)
    # what is p in both leaves farthest back
    assert x == pytest.approx(2 * 0.5 * slopes.p + 0.5 * math.tan(theta), abs=0.05)


def test_a_material_is_read_again_as_the_slab_that_it_is():
    for slab in (HYPERBOLIC, UniaxialSlab(-1.5, 0.25, 2.0)):
        material = slab_material("Slab", slab, backend="nodes")
        ((node, path),) = asked_closures(material)
        assert slab_of(node, path) == slab
    node.inputs["Permittivity Along"].default_value = 0.0
    assert slab_of(node) is None


def test_what_is_no_slab_is_refused_and_leaves_nothing(one_sentence):
    before = len(bpy.data.materials)
    with pytest.raises(TypeError) as error:
        slab_material("Slab", 0.2)
    assert "UniaxialSlab" in one_sentence(str(error.value))
    with pytest.raises(ValueError):
        slab_material("Slab", HYPERBOLIC, backend="none")
    assert len(bpy.data.materials) == before

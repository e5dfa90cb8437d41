# SPDX-License-Identifier: GPL-3.0-or-later
"""The window of lenslets in Cycles, in both forms: where light lands behind it, and how much, beside physics.lenslet."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles.closures import LENSLET_WINDOW
from nim_addon.cycles.lenslets import lenslet_material, window_of
from nim_addon.cycles.material import asked_closures
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.scenes import shapes
from tests.cycles.closures.beam import body, floor, landing, pose

both_backends = pytest.mark.parametrize("backend", ["osl", "nodes"])
ETAS = (-1.0, -1.2, 0.8, -0.5, (2.0, -0.7))
DEPTH = 1.0
STANDS = (
    pose(),
    pose((0.4, -1.1, 2.0), (3.0, 3.0, 3.0), (7.0, -5.0, 2.0)),
    pose((1.2, 0.3, -0.5), (1.0, 0.2, 5.0), (-0.4, 0.1, 0.6)),
)


@pytest.fixture(autouse=True)
def _(empty_file):
    pass


def beside(window, backend, matrix, angles, from_behind):
    """Landings behind a window beside those of physics, in depths; and shares of the light beside its transmittance.

    angles: of incidence, and about the normal from u on, radians
    """
    vertices, faces = shapes.rectangle((-1, -1), (1, 1))
    body(vertices, faces, lenslet_material("Window", window, backend=backend), matrix)
    linear = matrix[:3, :3]
    u, normal = (axis / np.linalg.norm(axis) for axis in (linear[:, 0], np.cross(linear[:, 0], linear[:, 1])))
    v = np.cross(normal, u)
    target = matrix[:3, 3] + linear @ (0.11, 0.17, 0.0)  # off the diagonal
    theta, turn = angles
    across = math.cos(turn) * u + math.sin(turn) * v
    sense = normal if from_behind else -normal
    d = math.sin(theta) * across + math.cos(theta) * sense
    floor(target + DEPTH * sense, (u, v))
    share, found, _ = landing(target, d, backend)
    bent = window.bend(d, normal, u)
    expected = DEPTH * np.array([bent @ u, bent @ v]) / abs(bent @ normal)
    return found, expected, share, float(window.transmittance(d, normal, u))


@both_backends
@pytest.mark.parametrize("eta", ETAS, ids=str)
@pytest.mark.parametrize("from_behind", [False, True], ids=["front", "behind"])
def test_light_lands_where_the_law_says(eta, from_behind, backend):
    for place, (theta, turn) in enumerate(((0, 0), (20, 50), (45, 160), (70, 290), (85, 10))):
        offset = (0.3, -0.2) if place % 2 else (0.0, 0.0)
        window, matrix = LensletWindow(eta, offset), STANDS[place % len(STANDS)]
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        found, expected, share, _ = beside(window, backend, matrix, np.radians((theta, turn)), from_behind)
        assert np.abs(found - expected).max() <= 1e-4 * max(1.0, np.linalg.norm(expected)), (theta, found, expected)
        assert share == pytest.approx(1.0, abs=1e-5), "ideal lenslets lose nothing"


@both_backends
@pytest.mark.parametrize("from_behind", [False, True], ids=["front", "behind"])
def test_lenslets_of_a_width_lose_what_misses_the_second(from_behind, backend):
    shares = []
    for eta, offset, theta in (
        (-1.2, (0.0, 0.0), 10),
        (0.8, (0.1, -0.05), 25),
        (-2.0, (0.0, 0.1), 5),
        (-1, (0, 0), 60),
    ):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        window = LensletWindow(eta, offset, aperture=0.8)
        *_, share, expected = beside(window, backend, STANDS[1], np.radians((theta, 30)), from_behind)
        assert share == pytest.approx(expected, abs=1e-5)
        shares.append(share)
    assert 0 < min(shares[:3]) < max(shares[:3]) < 1 and shares[3] == 0


@both_backends
def test_an_eta_of_0_and_an_aperture_of_0_are_black(backend):
    vertices, faces = shapes.rectangle((-1, -1), (1, 1))
    material = lenslet_material("Window", LensletWindow(-1.0, aperture=0.5), backend=backend)
    (node,) = LENSLET_WINDOW.nodes_of(material)
    body(vertices, faces, material, pose())
    floor((0, 0, -1), ((1, 0, 0), (0, 1, 0)))
    assert landing((0.1, 0.3, 0), (0, 0, -1), backend)[0] == pytest.approx(1, abs=1e-5)
    node.inputs["Aperture"].default_value = 0.0
    assert landing((0.1, 0.3, 0), (0, 0, -1), backend)[0] == 0
    node.inputs["Losses"].default_value = 0.0
    assert landing((0.1, 0.3, 0), (0, 0, -1), backend)[0] == pytest.approx(1, abs=1e-5), "ideal ones have no width"
    node.inputs["Eta V"].default_value = 0.0
    assert landing((0.1, 0.3, 0), (0, 0, -1), backend)[0] == 0


@both_backends
def test_a_face_that_looks_along_x_has_u_along_y(backend):
    body([(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)], [(0, 1, 2, 3)], _window((2.0, -1.0), backend), pose())
    floor((-1, 0.1, 0.3), ((0, 1, 0), (0, 0, 1)))
    share, found, _ = landing((0, 0.1, 0.3), np.array([-1, 0.5, 0.25]) / math.sqrt(1.3125), backend)
    np.testing.assert_allclose(found, (0.25, -0.25), atol=1e-4)


def _window(eta, backend):
    return lenslet_material("Window", LensletWindow(eta), backend=backend)


def test_a_material_is_read_again_as_the_window_that_it_is():
    for window in (LensletWindow(-1.25), LensletWindow((0.5, -2.0), (0.25, -0.5), 0.75)):
        material = lenslet_material("Window", window, backend="nodes")
        ((node, path),) = asked_closures(material)
        assert window_of(node, path) == window
    node.inputs["Eta U"].default_value = 0.0
    assert window_of(node) is None


def test_what_is_no_window_is_refused_and_leaves_nothing(one_sentence):
    before = len(bpy.data.materials)
    with pytest.raises(TypeError) as error:
        lenslet_material("Window", -1.0)
    assert "LensletWindow" in one_sentence(str(error.value))
    with pytest.raises(ValueError):
        lenslet_material("Window", LensletWindow(), backend="none")
    assert len(bpy.data.materials) == before

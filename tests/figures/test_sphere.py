# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 5.4 and 5.6: the prediction stands on its own, Cycles agrees with it, and a wrong sign is seen."""

import math

import numpy as np
import pytest

from nim_addon.figures import sphere
from nim_addon.figures.measure import (
    STANDARD_ERRORS,
    Camera,
    block_scores,
    blocks,
    compare,
    estimate,
    impact,
    misplaced,
)
from nim_addon.physics import Interface
from nim_addon.physics.rays import Fate, Shapes, Sphere, trace
from nim_addon.scenes import sphere as scene_of
from nim_addon.scenes.sphere import SphereParameters

INDICES = sorted({*sphere.ALONE, *sphere.ACCOMPANIED})
SIZE, SEEDS, PASSES = (96, 72), 6, 8
# Four times that of the rms of some hundred independent scores: the three colours of a block are not independent.
SCATTER = 0.28


@pytest.mark.parametrize("n", [-1.025, -1.33, -1.5, -4.1])
def test_the_inner_region_from_afar_is_where_light_leaves_sideways(n):
    b = 1 / math.hypot(1, 1 + math.sqrt(2) / abs(n)) + np.array([-1e-6, 1e-6])  # as figures/sphere.py says
    origins = np.stack([b, 0 * b, 0 * b + 5], axis=-1)
    ball = Shapes(Sphere((0, 0, 0), 1, Interface(SphereParameters(n=n).medium)))
    paths = trace(ball, origins, (0, 0, -1), branches=False)
    onward = paths.direction[(paths.fate == Fate.ESCAPED) & (paths.depth == 2), 2]
    assert onward[0] < 0 < onward[1]


@pytest.mark.parametrize("n", [n for n in INDICES if n < 0])
def test_the_radius_is_read_off_to_a_pixel(n):
    camera = Camera(*sphere.PROBE_POSE, (160, 160))
    pixels = sphere.predicted_probe(SphereParameters(n=n), camera, 4)
    b = impact(camera, scene_of.CENTER, scene_of.RADIUS)
    distance = math.dist(sphere.EYE, scene_of.CENTER)

    def turned(b):  # by which a ray at b leaves the axis, less the quarter turn at which it looks sideways
        return 2 * (math.asin(b) + math.asin(b / -n)) - math.asin(b / distance) - math.pi / 2

    low, high = 0.0, 1.0
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if turned(middle) < 0 else (low, middle)
    assert sphere.radius_of_inner(pixels, b) == pytest.approx(low, abs=0.003)


@pytest.fixture
def unlit(empty_file, render):
    """unlit(n, companions) -> SEEDS small unlit renders of the scene (SEEDS, H, W, 3), and the camera that saw them."""

    def pictures(n, companions):
        scene = scene_of.build(SphereParameters(n=n, companions=companions))
        scene.render.resolution_x, scene.render.resolution_y = SIZE
        scene.render.use_persistent_data = True
        scene.cycles.samples = 8
        sphere.unlit(scene)
        each = []
        for seed in range(SEEDS):
            scene.cycles.seed = seed
            each.append(render(scene))
        return np.array(each), Camera(*scene_of.pose(None), SIZE)

    return pictures


def rms(scores):
    return math.sqrt(np.mean(np.square(scores)))


@pytest.mark.parametrize("n", INDICES)
def test_cycles_shows_the_picture_that_numpy_traces(n, unlit):
    companions = n in sphere.ACCOMPANIED
    each, camera = unlit(n, companions)
    predicted = sphere.predicted_unlit(SphereParameters(n=n, companions=companions), camera, PASSES)
    scores, expected = block_scores(each, predicted)
    print(f"n = {n:g}: {scores.size} blocks, rms {rms(scores):.3f}, expected {expected:.3f}")
    assert scores.size > 150
    assert rms(scores) == pytest.approx(expected, abs=SCATTER)


def test_a_wrong_sign_index_or_permeability_is_seen(unlit):
    each, camera = unlit(-1.5, False)
    for wrong in (SphereParameters(n=1.5), SphereParameters(n=-1.5, mu=-1.8), SphereParameters(n=-1.7)):
        scores, expected = block_scores(each, sphere.predicted_unlit(wrong, camera, PASSES))
        print(f"{wrong}: rms {rms(scores):.3f}")
        assert rms(scores) > expected + 2 * SCATTER


def test_the_scores_of_noise_are_as_expected():
    random = np.random.default_rng(1)
    scores, expected = block_scores(random.normal(0, 1, (8, 256, 256, 3)), random.normal(0, 2, (12, 256, 256, 3)))
    assert rms(scores) == pytest.approx(expected, rel=0.05)
    shifted, _ = block_scores(random.normal(0.5, 1, (8, 256, 256, 3)), random.normal(0, 2, (12, 256, 256, 3)))
    assert rms(shifted) > 2 * expected


def test_blocks_without_noise_count_where_they_differ():
    noise = np.random.default_rng(3).normal(0, 1, (2, 8, 64, 64, 3))
    noise[:, :, :16] = 0.25
    scores, expected = block_scores(*noise)
    assert scores.size == 6 * 8 * 3 and rms(scores) == pytest.approx(expected, rel=0.2)
    noise[0, :, :16] += 0.001
    assert rms(block_scores(*noise)[0]) > 2 * expected


def test_misplaced_light_is_noise_or_more():
    random = np.random.default_rng(4)
    light = np.full((20, 20), 3.0)
    stacks = [light + random.normal(0, 0.1, (count, 20, 20)) for count in (4, 8)]
    by_chance, share = misplaced(*stacks)
    error = 0.1 * math.sqrt(1 / 4 + 1 / 8)
    assert (by_chance, share) == pytest.approx([math.sqrt(2 / math.pi) * error / 2 / 3] * 2, rel=0.15)
    # a chequer of a tenth more and less moves a twentieth of the light, and no mean
    wrong = 1 + 0.1 * (-1.0) ** np.indices((20, 20)).sum(axis=0)
    assert misplaced(stacks[0] * wrong, stacks[1])[1] == pytest.approx(0.05, rel=0.05)


def test_the_standard_error_of_a_statistic_is_the_scatter_it_has():
    random = np.random.default_rng(2)
    worlds = random.normal(5, 1, (400, 8, 6, 6, 2))

    def ratio(pixels):
        return pixels[..., 0].mean() / pixels[..., 1].mean()

    values, errors = np.transpose([estimate(ratio, stack) for stack in worlds])
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(values.std(), rel=0.1)
    # two stacks of the same noise, left out together
    difference, error = estimate(lambda one, other: one.mean() - other.mean(), worlds[0], worlds[0] + 1)
    assert difference == pytest.approx(-1) and error == pytest.approx(0, abs=1e-12)
    predicted, measured, allowed = compare(ratio, (worlds[0],), (worlds[1],))
    assert (predicted, measured) == (values[0], values[1])
    assert allowed == pytest.approx(STANDARD_ERRORS * math.hypot(errors[0], errors[1]))


def test_blocks_and_camera():
    np.testing.assert_array_equal(blocks(np.arange(36.0).reshape(6, 6, 1), 3)[..., 0], [[7, 10], [25, 28]])
    camera = Camera((1, 2, 3), (4, 6, 2), 40, "VERTICAL", (64, 48))
    np.testing.assert_allclose(camera.pixels_of((4, 6, 2)), (32, 24))
    eye, directions = camera.rays(np.array([5.5, 60.0]), np.array([7.25, 1.0]))
    np.testing.assert_allclose(camera.pixels_of(eye + 3 * directions), [(5.5, 7.25), (60, 1)])
    top = camera.rays(np.array([32.0]), np.array([0.0]))[1][0]
    bottom = camera.rays(np.array([32.0]), np.array([48.0]))[1][0]
    assert math.degrees(math.acos(top @ bottom)) == pytest.approx(40)
    assert top[2] > bottom[2]

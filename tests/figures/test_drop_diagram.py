# SPDX-License-Identifier: GPL-3.0-or-later
"""The diagram of a drop: each ray is turned by its order's own angle, and the bows are named where they are."""

import math

import numpy as np
import pytest

from nim_addon.figures import diagram_parts, diagrams, drop_diagram
from nim_addon.physics import Medium, deviation
from nim_addon.physics.rays import Kind

NEAR = 1e-7  # radians: the tracer goes on 1e-9 off each surface that it has met, and a drop's is curved


def turned(paths):
    """By which angle the last of Paths is turned clockwise, radians, from 0 to a whole turn."""
    x, y, _ = paths.direction[-1]
    return -math.atan2(y, x) % (2 * math.pi)


@pytest.mark.parametrize("order", drop_diagram.ORDERS)
@pytest.mark.parametrize("n", [1.33, 2.4, -1.33, -0.5])
def test_light_of_an_order_is_turned_by_its_angle(n, order):
    paths = drop_diagram.order_paths(Medium(n), 0.4, order)
    assert list(paths.kind) == [Kind.INCIDENT, Kind.TRANSMITTED, *[Kind.REFLECTED] * order, Kind.TRANSMITTED]
    wanted = float(deviation.drop(n, math.asin(0.4), order)) % (2 * math.pi)
    assert turned(paths) == pytest.approx(wanted, abs=NEAR)


def test_paths_that_are_joined_keep_their_rays_apart():
    paths = drop_diagram.drop_paths(Medium(1.33), [0.2, 0.5])
    assert paths.ray.max() == 5 and len(paths.lost) == 6
    first = paths.parent < 0
    np.testing.assert_allclose(paths.start[first][:, 1], [0.2] * 3 + [0.5] * 3)
    np.testing.assert_array_equal(paths.ray[~first], paths.ray[paths.parent[~first]])


def labels(monkeypatch, **options):
    """What stands beside the light that leaves, and the Paths, of a diagram of a drop."""
    pytest.importorskip("matplotlib")
    taken = {}
    head = diagram_parts.head
    monkeypatch.setattr(diagram_parts, "head", lambda ax, *rest: (taken.update(ax=ax), head(ax, *rest)))
    monkeypatch.setattr(diagrams, "save", lambda figure, title, *files: list(files))
    diagrams.diagram("drop", **options)
    return [text.get_text() for text in taken["ax"].texts]


def test_white_light_on_water_has_its_two_bows(monkeypatch):
    words = ["$k$ = 0", "$k$ = 1: 40.6 to 42.4°", "$k$ = 2: 53.6 to 50.2°"]
    assert labels(monkeypatch, spectrum=True) == words


def test_a_ray_has_the_bow_of_its_own_order_alone(monkeypatch):
    assert labels(monkeypatch, rays=1) == ["$k$ = 0", "$k$ = 1: 42.5°", "$k$ = 2"]


def test_a_nim_has_no_bow_and_its_light_comes_straight_back(monkeypatch):
    assert labels(monkeypatch, spectrum=True, inside=Medium.parse("nim-mirror")) == ["$k$ = 0", "$k$ = 1", "$k$ = 2"]
    back, *_ = drop_diagram.entries(-1.33)
    paths = drop_diagram.order_paths(Medium(-1.33), back, 0)
    np.testing.assert_allclose(paths.direction[-1], (-1, 0, 0), atol=NEAR)

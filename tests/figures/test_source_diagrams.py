# SPDX-License-Identifier: GPL-3.0-or-later
"""The diagrams of a point source: what is drawn as the caustic is what the drawn rays touch."""

import numpy as np
import pytest

from nim_addon.figures import diagram_parts, diagrams, source_diagrams
from nim_addon.figures.diagram_paths import transmitted_way
from nim_addon.physics.rays import Kind


@pytest.fixture
def drawn(monkeypatch):
    """drawn(scene, ...) -> the axes and the Paths of a diagram, before it becomes a file."""
    pytest.importorskip("matplotlib")
    taken = {}
    draw_paths = diagram_parts.draw_paths

    def kept(ax, paths, **more):
        taken.update(ax=ax, paths=paths)
        draw_paths(ax, paths, **more)

    monkeypatch.setattr(diagram_parts, "draw_paths", kept)
    monkeypatch.setattr(diagrams, "save", lambda figure, title, *files: list(files))

    def of(scene, **options):
        diagrams.diagram(scene, **options)
        return taken["ax"], taken["paths"]

    return of


def caustic(ax):
    """The points (N, 2) of the line that is labelled so; None where there is none."""
    lines = [line for line in ax.lines if str(line.get_label()).startswith("caustic")]
    return np.stack(lines[0].get_data(), axis=-1) if lines else None


def last_ways(paths):
    """Start and unit direction, (N, 2) both, of each ray's last way without having been reflected, and the ray, (N,)."""
    last = np.array([transmitted_way(paths, ray)[-1] for ray in range(len(paths.lost))])
    last = last[paths.kind[last] == Kind.TRANSMITTED]
    return paths.start[last][:, :2], paths.direction[last][:, :2], paths.ray[last]


@pytest.mark.parametrize(
    "scene, n", [("lens", -1.2), ("lens", -0.9), ("lens", 1.5), ("lamp", -1.33), ("lamp", -0.8), ("lamp", 1.33)]
)
def test_every_ray_touches_the_caustic(scene, n, drawn):
    ax, paths = drawn(scene, n=n, rays=9)
    points = caustic(ax)
    first = paths.direction[paths.kind == Kind.INCIDENT]
    angles = np.arctan2(first[:, 1], first[:, 0]) if scene == "lens" else np.arctan2(first[:, 0], -first[:, 1])
    touched = 0
    for a, d, ray in zip(*last_ways(paths), strict=True):
        angle = angles[ray]
        away = points - a
        side = away[:, 0] * d[1] - away[:, 1] * d[0]
        own = np.argmin(np.abs(source_diagrams.angles(n) - angle))
        near = side[own - 3 : own + 4]
        if abs(angle) > 0.05 and np.isfinite(near).all():  # in the cusp it crosses the axis, and some of it is cut off
            assert abs(side[own]) < 1e-4, "the ray goes through its own point"
            assert len(set(np.sign(near[[0, 1, 5, 6]]))) == 1, "and is a tangent there"
            touched += 1
    assert touched >= 4
    said = [text.get_text() for text in ax.get_legend().get_texts()]
    assert ("caustic, apparent" if n > 0 else "caustic") in said


@pytest.mark.parametrize("scene, point", [("lens", (1.5, 0)), ("lamp", (0, -0.5))])
def test_at_minus_one_all_rays_meet_in_a_point(scene, point, drawn):
    ax, paths = drawn(scene, n=-1)
    assert caustic(ax) is None
    start, way, _ = last_ways(paths)
    away = np.array(point) - start
    assert len(away) > 10 and np.abs(away[:, 0] * way[:, 1] - away[:, 1] * way[:, 0]).max() < 1e-9
    assert (paths.kind != Kind.REFLECTED).all(), "its impedance is that of air"


def test_white_light_is_drawn_by_its_colours(drawn):
    for scene in ("lens", "lamp"):
        ax, _ = drawn(scene, spectrum=True)
        assert caustic(ax) is None

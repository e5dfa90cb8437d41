# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of windows: their diagrams, the closed forms that the slab's pictures are read by, and a claim that fails."""

import numpy as np
import pytest

from nim_addon import command
from nim_addon.figures import window as figure
from nim_addon.figures import window_diagram
from nim_addon.figures.measure import Camera
from nim_addon.figures.recipes import Image
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.rays import Fate, Kind, Plane, Shapes, trace
from nim_addon.physics.uniaxial import Plate, UniaxialSlab
from nim_addon.scenes import window
from nim_addon.scenes.window import WindowParameters


@pytest.mark.parametrize("eta", [-1.2, 0.8])
def test_rays_of_a_point_meet_in_its_image(eta):
    law = LensletWindow(eta)
    paths, _ = window_diagram.rays_of(law, 7)
    out = np.flatnonzero(paths.kind == Kind.TRANSMITTED)
    start, d = paths.start[out], paths.direction[out]
    there = start + ((window_diagram.DEPTH / -eta - start[:, 0]) / d[:, 0])[:, None] * d
    np.testing.assert_allclose(there, [(window_diagram.DEPTH / -eta, 0, 0)] * 7, atol=1e-12)


def test_rays_of_p_go_down_within_a_hyperbolic_slab():
    slab = UniaxialSlab(2.0, -3.0)
    paths, angles = window_diagram.rays_of(slab, 5)
    within = (paths.kind == Kind.TRANSMITTED) & (paths.fate == Fate.SPLIT)
    rises = paths.direction[within][:, 1]
    assert (rises < 0).sum() == (rises > 0).sum() == 5 and np.all(angles > 0)


@pytest.mark.parametrize("words", [["--eta", "-1.2"], ["--across", "2", "--along", "-3", "--beam", "5"]])
def test_the_command_draws_them(words, tmp_path, capsys):
    file = tmp_path / "rays.svg"
    assert command.main(["rays", "window", *words, "--out", str(file)]) == 0
    assert file.read_text(encoding="utf-8").lstrip().startswith("<?xml") and str(file) in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["window", "--eta", "0"], "not 0"),
        (["window", "--eta", "1", "--along", "2"], "one or the others"),
        (["window", "--n", "1.5"], "no medium"),
        (["window", "--spectrum"], "all colours"),
        (["pool", "--eta", "1"], "of a window"),
    ],
)
def test_what_is_asked_wrongly_is_said_in_one_sentence(words, told, capsys):
    assert command.main(["rays", *words]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize("turn", [20, 60])
def test_the_rod_is_seen_where_traced_rays_meet_it(turn):
    parameters = WindowParameters(pane="slab", thickness=0.2, turn=turn)
    camera = Camera(*window.pose(parameters), (960, 12))
    middle, axes = window.pane(parameters)
    plate, far = Plate(parameters.slab), np.array(middle) - 0.2 * axes[2]
    surfaces = Shapes(Plane(middle, axes[2], plate), Plane(far, -axes[2], plate))
    for way in (0, 1):
        column = figure.seen(camera, parameters, way)
        eye, direction = camera.rays(np.array(column), np.array(6.0))
        paths = trace(surfaces, eye, direction)
        out = (paths.fate == Fate.ESCAPED) & (paths.kind == Kind.TRANSMITTED)
        start, d = paths.start[out], paths.direction[out]
        past = start + ((parameters.distance - start[:, 1]) / d[:, 1])[:, None] * d
        assert np.abs(past[:, 0]).min() < 1e-5


def test_a_disc_of_the_wrong_size_fails():
    """As it would be with the law of the other side."""
    images = {}
    size = (240, 240)
    for name in [f"{kind}_{eta:g}" for kind in ("disc", "spot") for eta in figure.ETAS] + ["losses"]:
        eta = float(name.partition("_")[2] or figure.ETAS[1])
        aperture = figure.APERTURE if name == "losses" else None
        aside = figure.ASIDE if name.startswith("spot") else 0.0
        parameters = WindowParameters(eta=eta, aperture=aperture, aside=aside)
        camera = Camera(*window.pose(parameters), size)
        wrong = LensletWindow(1 / eta)
        place = camera.pixels_of((0, float(wrong.image_depth(1.5)), window.MIDDLE))
        radius = figure.RADIUS * camera.scale / (window.EYE + float(wrong.image_depth(1.5)))
        grid = np.stack(np.meshgrid(np.arange(240) + 0.5, np.arange(240) + 0.5), axis=-1) - place
        seen = np.hypot(*np.moveaxis(grid, -1, 0)) < radius
        pixels = np.stack([seen & (grid[..., 1] < 0), seen & (grid[..., 1] > 0), 0 * seen], axis=-1).astype(float)
        images[name] = Image(pixels[None], camera, parameters)
    held = {claim.text: claim.holds for claim in figure.measure_lenslets(images)}
    assert not held["size through eta = -1.2, of that without a window"]
    assert not held["size through eta = 0.8, of that without a window"]
    assert not held["depth of the image behind the window of eta = 0.8, from 0.4 m aside"]

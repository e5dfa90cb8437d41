# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures E.2 to E.4: every claim holds in small renders, and fails where a ball is another one."""

import math

import numpy as np
import pytest

from nim_addon.figures import ball, ball_optics
from nim_addon.figures.measure import Camera
from nim_addon.figures.recipes import Image
from nim_addon.physics.graded import Profile
from nim_addon.scenes.ball import BallParameters

FIGURES = {figure.number: figure for figure in ball.FIGURES}
SIZE, BOARD = (96, 96), ball.BOARD[0]


def camera():
    return Camera(*ball.STRAIGHT, (200, 200))


def predicted_sky(parameters):
    """The picture under the sky of directions, by numpy."""
    eye, d = camera().pixel_rays()
    _, onward = ball_optics.carried(parameters.profile, ball.CENTER, ball.RADIUS, eye, d.reshape(-1, 3))
    pixels = np.nan_to_num(ball_optics.sky(onward).reshape(d.shape))
    return Image(pixels[None], camera(), parameters)


def test_what_is_read_off_is_what_is_there():
    for a in ball.CORES:
        seen = ball.Seen(predicted_sky(BallParameters(device="magnifier", core=a)))
        for angle in ball.ANGLES:
            assert ball.magnification(seen, angle) == pytest.approx(1 / a, abs=1e-6)
    capped = ball.Seen(predicted_sky(BallParameters(device="invisible", cap=3)))
    assert ball.straight_from(capped) == pytest.approx(math.sqrt(0.75), abs=0.002)
    assert ball.straight_from(ball.Seen(predicted_sky(BallParameters(device="cloak")))) == 0
    _, d = camera().pixel_rays()
    np.testing.assert_allclose(ball_optics.directions_of(ball_optics.sky(d)), d, atol=1e-12)


def test_the_size_of_a_dark_disc():
    p = ball.impact(camera(), ball.CENTER, ball.RADIUS)
    white = np.ones((200, 200, 3)) * (p > 0.3)[..., None]
    assert ball.dark_radius(white, camera()) == pytest.approx(0.3, abs=0.002)


def test_rays_that_miss_go_on_as_they_came():
    eye = np.array([0.0, -5, 1])
    points, onward = ball_optics.carried(
        Profile("eaton"), (0, 0, 1), 1.0, eye, np.array([[0.0, 1, 0], [0.6, 0.8, 0], [0, -1, 0]])
    )
    np.testing.assert_allclose(onward, [[0, -1, 0], [0.6, 0.8, 0], [0, -1, 0]], atol=1e-12)
    np.testing.assert_allclose(points[1:], [eye, eye])


def rendered(images, number, backend="auto"):
    figure = FIGURES[number]
    others = "sky", "garden", "white", "rim", "back"
    return images(figure, BOARD, 8, "board", backend=backend) | images(figure, SIZE, 8, *others, backend=backend)


def wrong(images, name, **settings):
    """The claims of the board that fail once it is taken for one of other settings."""
    image = images[f"board_{name}"]
    other = image._replace(parameters=BallParameters(**settings))
    return not ball.whole({f"board_{name}": other}, name).holds


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_the_magnifier(images, failing, backend):
    found = rendered(images, "E.2", backend)
    claims = ball.measure_magnifier(found)
    assert len(claims) == 12 and not failing(claims)
    swapped = found | {"sky_0.8": found["sky_0.5"], "sky_0.5": found["sky_0.8"]}
    assert len(failing(ball.measure_magnifier(swapped))) == 10
    assert wrong(found, "0.8", device="magnifier", core=0.78)


def test_what_nobody_sees(images, failing):
    found = rendered(images, "E.3")
    claims = ball.measure_unseen(found)
    assert len(claims) == 10 and not failing(claims)
    seen = found | {"sky_cloak": found["sky_capped"], "garden_invisible": found["sky_capped"]}
    assert len(failing(ball.measure_unseen(seen))) == 3
    assert wrong(found, "capped", device="invisible", cap=2.8)


def test_the_classics(images, failing):
    found = rendered(images, "E.4")
    claims = ball.measure_classics(found)
    assert len(claims) == 6 and not failing(claims)
    others = found | {"rim_luneburg": found["rim_fisheye"], "rim_fisheye": found["back_eaton"]}
    assert len(failing(ball.measure_classics(others))) == 1
    assert wrong(found, "luneburg", device="fisheye")

# SPDX-License-Identifier: GPL-3.0-or-later
"""The ball scene: one ball in a garden, of the profile that is asked for; some devices are not to be seen in its pictures."""

import numpy as np
import pytest

from nim_addon.checks import problems
from nim_addon.cycles import graded
from nim_addon.figures import probes
from nim_addon.figures.measure import Camera, impact
from nim_addon.physics.graded import DEVICES, Profile
from nim_addon.scenes import ball
from nim_addon.scenes.ball import BallParameters, build

pytestmark = pytest.mark.usefixtures("empty_file")


def picture(render, parameters, backend="osl", without=False):
    """The garden, unlit, in 48 x 36 pixels."""
    scene = build(parameters, backend)
    probes.unlit(scene)
    probes.find(scene, "Ball").hide_render = without
    scene.render.resolution_x, scene.render.resolution_y = 48, 36
    scene.cycles.samples = 16
    return render(scene)[..., :3]


@pytest.mark.parametrize("device", DEVICES)
def test_the_ball_is_of_the_profile_that_is_asked_for(device):
    scene = build(BallParameters(device=device, angle=45, hollow=0.5))
    (node,) = graded.profile_nodes(scene.objects["Ball"].active_material)
    assert graded.profile_of(node) == Profile(device, angle=np.radians(45), hollow=0.5)
    assert tuple(scene.objects["Ball"].location) == pytest.approx(ball.CENTER)
    assert node.inputs["Radius"].default_value == ball.RADIUS  # that of the mesh, and no other
    assert tuple(scene.objects["Ball"].dimensions) == pytest.approx((2 * ball.RADIUS,) * 3, rel=1e-4)
    assert {"Lawn", "Fence", "House", "Camera"} <= set(scene.objects.keys()) and "Head" not in scene.objects


@pytest.mark.parametrize(
    "settings, space",
    [({"device": "cloak", "hollow": 0.5}, 0.5), ({"device": "eaton", "core": 0.4}, 0.4), ({"device": "invisible"}, 1)],
)
def test_the_head_is_within(settings, space):
    scene = build(BallParameters(head=True, **settings))
    head = scene.objects["Head"]
    corners = np.array([vertex.co for vertex in head.data.vertices]) * head.scale
    assert tuple(head.location) == pytest.approx(ball.CENTER)
    assert 0.4 * space < np.linalg.norm(corners, axis=1).max() < space


def test_a_core_of_its_own_material(render):
    scene = build(BallParameters(device="magnifier", core=0.5, surface="textured"))
    core = scene.objects["Core"]
    assert tuple(core.location) == pytest.approx(ball.CENTER) and core.active_material.name.startswith("Core")
    assert tuple(core.dimensions) == pytest.approx((ball.RADIUS,) * 3, rel=1e-4)
    (node,) = graded.profile_nodes(scene.objects["Ball"].active_material)
    assert graded.profile_of(node) == Profile("magnifier", 0.5, "textured")
    assert problems(scene) == []
    # nothing but the core shines, which fills the whole outline of its shell, and no more
    probes.show_only(scene, "Ball", "Core")
    probes.paint(core, probes.glow("Shining", (1, 1, 1)))
    probes.sky(scene)
    scene.render.resolution_x, scene.render.resolution_y, scene.cycles.samples = 64, 48, 8
    probes.set_up(scene)
    p = impact(Camera(*ball.pose(), (64, 48)), ball.CENTER, ball.RADIUS)
    pixels = render(scene)[..., 0]
    assert pixels[p < 0.93] == pytest.approx(1, abs=1e-4) and not pixels[p > 1.05].any()


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("settings", [{"device": "invisible"}, {"device": "cloak", "head": True}])
def test_what_nobody_sees(settings, backend, render):
    parameters = BallParameters(**settings)
    seen = picture(render, parameters, backend)
    empty = picture(render, BallParameters(), backend, without=True)
    off = np.abs(seen - empty).max(axis=2)
    assert np.mean(off > 1e-5) < 0.02 and np.median(off) < 1e-6  # at edges a ray falls on the other side
    assert np.mean(np.abs(picture(render, BallParameters(device="luneburg"), backend) - empty).max(axis=2) > 0.01) > 0.1


def test_a_core_too_large_for_its_cloak_is_seen(render):
    dark = picture(render, BallParameters(device="cloak", core=0.7, surface="black"))
    empty = picture(render, BallParameters(), without=True)
    lost = 1 - (dark.sum(axis=2) / empty.sum(axis=2))
    ahead, across = ball.RADIUS / 7.06, np.tan(np.radians(17)) / 24  # of the ball's radius, and of a pixel
    disc = np.pi * (0.25 * ahead / across) ** 2  # (core - hollow) / (1 - hollow) of the radius
    assert lost.sum() == pytest.approx(disc, rel=0.03)


@pytest.mark.parametrize(
    "settings, words",
    [
        (["device=eton"], ("did you mean eaton",)),
        (["core=1"], ("core", "0.015625 and 0.984375")),
        (["device=cloak", "cap=3"], ("cloak", "no cap")),
        (["angle=0"], ("angle", "between 1 and 360 degrees")),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(one_sentence, settings, words):
    with pytest.raises(ValueError) as caught:
        BallParameters.read(settings)
    one_sentence(caught.value, *words)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The flat lens's figure, measured in small pictures: each claim holds, and fails of another index or another place."""

import dataclasses

import pytest

from nim_addon.figures import lens

(FIGURE,) = lens.FIGURES


def of_index(image, n):
    return image._replace(parameters=dataclasses.replace(image.parameters, n=n))


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_rays_meet_and_spread_as_they_should(backend, images, failing):
    made = images(FIGURE, (96, 96), 8, "image", "far", backend=backend)
    for n in lens.INDICES:
        of_it = made[f"image_{n:g}"]
        assert not failing(lens.spread_claims(of_it))
        assert len(failing(lens.spread_claims(of_index(of_it, n - 0.01)))) == 2
        assert lens.depth_claim(made[f"far_{n:g}"]).holds
        assert not lens.depth_claim(of_index(made[f"far_{n:g}"], n - 0.01)).holds


def test_the_ball_is_as_without_the_plate_and_nearer(images):
    made = images(FIGURE, (64, 64), 16, "seen", "moved")
    assert lens.likeness_claim(made["seen"], made["moved"]).holds
    shifted = made["moved"]._replace(each=made["moved"].each[:, :, 1:])
    cut = made["seen"]._replace(each=made["seen"].each[:, :, :-1])
    assert not lens.likeness_claim(cut, shifted).holds

# SPDX-License-Identifier: GPL-3.0-or-later
"""The wave field of a beam: it obeys Maxwell's equations, and goes where rays go, with Fresnel's shares of the energy."""

import math

import numpy as np
import pytest

from nim_addon.physics import Interface, Medium
from nim_addon.physics.wave_field import Beam

ANGLE = math.radians(35)
ALONG = np.linspace(-60, 60, 4001)


def laid(n, mu=None, angle=ANGLE, waist=4.0):
    return Beam(Interface(Medium(n, mu)), angle, waist)


@pytest.mark.parametrize("n, mu", [(1.33, None), (-1.33, None), (-1.5, -3.0), (-0.7, None)])
@pytest.mark.parametrize("place", [(0.4, 1.5), (-0.6, -1.7)])
def test_it_obeys_the_wave_equation(n, mu, place):
    x, z = place
    step = 2e-3
    around = laid(n, mu).at(x + step * np.array([1, -1, 0, 0, 0]), z + step * np.array([0, 0, 1, -1, 0])).E
    laplacian = (around[:4].sum() - 4 * around[4]) / step**2
    index = 1.0 if z > 0 else n
    assert laplacian / around[4] == pytest.approx(-((2 * math.pi * index) ** 2), rel=1e-3)


@pytest.mark.parametrize("n, mu", [(1.33, None), (-1.33, None), (-1.5, -3.0), (-0.4, None)])
def test_fields_and_energy_are_continuous_at_the_surface(n, mu):
    above, below = (laid(n, mu).at(ALONG, z) for z in (0.0, -1e-12))
    np.testing.assert_allclose(above.E, below.E, atol=1e-9)
    # H along the surface, which takes mu with it, and with it the flow of energy through the surface
    np.testing.assert_allclose(above.energy[:, 1], below.energy[:, 1], atol=1e-9)


@pytest.mark.parametrize("n, mu", [(1.33, None), (-1.33, None), (-1.5, -3.0), (2.0, None)])
def test_the_beam_goes_where_the_ray_does_with_its_share_of_the_energy(n, mu):
    beam = laid(n, mu, waist=12.0)
    depth = 8.0
    down = -beam.at(ALONG, -depth).energy[:, 1]
    assert (down > -1e-9).all() and down.max() > 0.1, "energy goes down, of a NIM too"
    theta = float(beam.interface.theta_t(ANGLE))
    assert (ALONG * down).sum() / down.sum() == pytest.approx(depth * math.tan(theta), abs=0.02)
    arriving = -Beam(Interface(Medium(1.0)), ANGLE, 12.0).at(ALONG, -depth).energy[:, 1]
    T = 1 - float(beam.interface.fresnel(math.cos(ANGLE)).R_s)
    assert down.sum() / arriving.sum() == pytest.approx(T, abs=1e-3)


def test_in_a_nim_the_fronts_run_backwards():
    for n in (1.33, -1.33):
        theta = math.asin(math.sin(ANGLE) / n)
        field = laid(n, waist=12.0).at(4 * math.tan(theta), -4.0)
        turned = field.energy @ field.phase / np.linalg.norm(field.energy) / np.linalg.norm(field.phase)
        assert turned == pytest.approx(math.copysign(1, n), abs=1e-5)
        assert np.linalg.norm(field.phase) == pytest.approx(2 * math.pi * abs(n), rel=1e-3)
        assert field.energy[1] < 0 and field.energy[0] * n > 0


def test_what_is_totally_reflected_falls_off():
    for n in (0.4, -0.4):
        beam = laid(n)
        sizes = [np.abs(beam.at(ALONG, -depth).E).max() for depth in (0.0, 0.5, 1.0)]
        kappa = 2 * math.pi * math.sqrt(math.sin(ANGLE) ** 2 - n * n)
        assert sizes[2] / sizes[1] == pytest.approx(math.exp(-0.5 * kappa), rel=0.1)


def test_what_is_no_beam_is_refused():
    for wrong in ({"angle": 2.0}, {"waist": 0.0}):
        with pytest.raises(ValueError, match="between 0 and 90 degrees, and its waist is above 0"):
            laid(-1.33, **wrong)
    with pytest.raises(ValueError, match="without loss"):
        Beam(Interface(Medium(-1.33 + 0.1j)), ANGLE, 3.0)

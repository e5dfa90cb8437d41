# SPDX-License-Identifier: GPL-3.0-or-later
"""Uniaxial slabs: against Maxwell's equations at the faces, Poynting's vector, and interference averaged over thicknesses."""

import math

import numpy as np
import pytest

from nim_addon.physics import Interface, Medium
from nim_addon.physics.rays import Fate, Plane, Shapes, trace
from nim_addon.physics.uniaxial import Plate, UniaxialSlab

ANGLES = np.radians([0.0, 5.0, 30.0, 60.0, 85.0])
HYPERBOLIC = UniaxialSlab(2.0, -3.0, 0.4)
SLABS = (HYPERBOLIC, UniaxialSlab(2.25, 2.25), UniaxialSlab(1.5, 4.0), UniaxialSlab(4.0, 1.2), UniaxialSlab(-2.0, 0.5))


def test_an_isotropic_slab_is_the_interface_of_its_index():
    slab, face = UniaxialSlab(2.25, 2.25), Interface(Medium(1.5))
    for slope in slab.slopes(ANGLES):
        np.testing.assert_allclose(slope, np.tan(face.theta_t(ANGLES)), rtol=0, atol=1e-13)
    fresnel = face.fresnel(np.cos(ANGLES))
    for R, expected in zip(slab.reflectances(ANGLES), fresnel[:2], strict=True):
        np.testing.assert_allclose(R, expected, rtol=0, atol=1e-14)


def modes(slab, theta, gap):
    """T of a slab by matching the tangential fields at its two faces; `gap` is its phase across.

    Returns T of s and p, and the slope of Poynting's vector of the p wave that runs forward.
    """
    kx, k = math.sin(theta), math.cos(theta)
    found = []
    for z, forward in (
        (1.0, np.sqrt(complex(slab.across - kx**2))),
        (slab.across, np.sqrt(complex(slab.across * (1 - kx**2 / slab.along))) * np.sign(slab.across)),
    ):
        # (u, w): u continuous and w = forward / z times it; 1 and r in front, two waves within, t behind
        inner, phase = forward / z, np.exp(1j * gap * np.sign(forward.real))
        matrix = np.array(
            [
                [-1, 1, 1, 0],
                [k, inner, -inner, 0],
                [0, phase, 1 / phase, -1],
                [0, inner * phase, -inner / phase, -k],
            ]
        )
        found.append(abs(np.linalg.solve(matrix, [1, k, 0, 0])[3]) ** 2)
    # H along y: E = (kz / across, 0, -kx / along) of it, S = E x H
    kz = np.sqrt(slab.across * (1 - kx**2 / slab.along)) * np.sign(slab.across)
    return found, (kx / slab.along) / (kz / slab.across)


@pytest.mark.parametrize("slab", [slab for slab in SLABS if slab.across > 0])
def test_a_slab_is_the_mean_of_interference_over_its_thicknesses(slab):
    gaps = (np.arange(64) + 0.5) * 2 * np.pi / 64
    for theta in ANGLES[:4]:
        if math.sin(theta) ** 2 >= min(slab.across, slab.along if slab.along > 0 else 9):
            continue
        each = [modes(slab, theta, gap) for gap in gaps]
        np.testing.assert_allclose(
            np.mean([found for found, _ in each], axis=0), slab.transmittances(theta), rtol=0, atol=1e-12
        )
        assert slab.slopes(theta).p == pytest.approx(each[0][1], abs=1e-13)


def test_energy_runs_along_the_gradient_of_the_dispersion():
    for slab in SLABS:
        kx = np.sin(ANGLES[3])
        square = slab.across * (1 - kx**2 / slab.along)
        if square <= 0:
            continue
        kz = math.sqrt(square)
        gradient = np.array([kx / slab.along, kz / slab.across])
        gradient *= np.sign(gradient[1])  # of the two waves that which carries energy on
        sign = 1 if slab.across > 0 else -1  # whose kx is the incident wave's
        assert slab.slopes(ANGLES[3]).p == pytest.approx(sign * gradient[0] / gradient[1], abs=1e-13)


def test_a_hyperbolic_slab_bends_p_backwards_at_every_angle_and_s_never():
    theta = np.radians(np.linspace(0.1, 89.9, 200))
    s, p = HYPERBOLIC.slopes(theta)
    assert HYPERBOLIC.is_hyperbolic and not UniaxialSlab(2.0, 3.0).is_hyperbolic
    assert np.all(p < 0) and np.all(s > 0)
    T = HYPERBOLIC.transmittances(theta)
    assert np.all(T.p > 0) and np.all(T.s > 0), "none is totally reflected"
    np.testing.assert_allclose(np.array(HYPERBOLIC.shifts(theta)), 0.4 * (np.array([s, p]) - np.tan(theta)))


def test_total_reflection():
    """epsilon across below 1 reflects s beyond its critical angle; one that is negative reflects all s."""
    slab = UniaxialSlab(0.5, 2.0)
    before, beyond = math.radians(44.9), math.radians(45.1)
    assert slab.reflectances(before).s < 1 and slab.reflectances(beyond).s == 1 and slab.transmittances(beyond).s == 0
    assert np.isnan(slab.slopes(beyond).s) and np.isfinite(slab.slopes(beyond).p)
    metal = UniaxialSlab(-2.0, 0.5)
    assert metal.reflectances(ANGLES).s.tolist() == [1] * 5
    assert metal.transmittances(math.radians(44)).p == 0 and metal.transmittances(math.radians(46)).p > 0


@pytest.mark.parametrize("wrong", [{"across": 0}, {"along": 0}, {"along": math.inf}, {"thickness": 0}])
def test_wrong_numbers_are_refused_in_one_sentence(wrong, one_sentence):
    with pytest.raises(ValueError) as error:
        UniaxialSlab(**({"across": 2.0, "along": -3.0} | wrong))
    assert next(iter(wrong)) in one_sentence(str(error.value))
    with pytest.raises(ValueError) as error:
        HYPERBOLIC.slopes(math.pi / 2)
    assert "theta" in one_sentence(str(error.value))


def test_rays_are_traced_through_a_plate_of_two_faces():
    theta, d = ANGLES[2], HYPERBOLIC.thickness
    faces = ((0, 0, 0), (0, 0, 1)), ((0, 0, -d), (0, 0, -1))
    # of an object that is scaled to half along z
    plate = Plate(UniaxialSlab(2.0, -3.0, 2 * d), np.diag((3.0, 1.0, 0.5)))
    near, far = (Plane(*face, plate) for face in faces)
    floor = Plane((0, 0, -d - 1), (0, 0, 1))
    for angle in (theta, 0.0):
        direction = (math.sin(angle), 0, -math.cos(angle))
        paths = trace(Shapes(near, far, floor), (0, 0, 0.0) - np.array(direction), direction)
        slopes, T = HYPERBOLIC.slopes(angle), HYPERBOLIC.transmittances(angle)
        landed = paths.fate == Fate.LANDED
        expected = [(d * slope + math.tan(angle), 0, -d - 1) for slope in slopes]
        np.testing.assert_allclose(paths.end[landed], expected, atol=1e-9)
        np.testing.assert_allclose(paths.arriving[landed], np.array(T) / 2, atol=1e-15)
        gone = paths.fate == Fate.ESCAPED
        assert paths.arriving[gone].sum() == pytest.approx(1 - (T.s + T.p) / 2) and paths.lost == pytest.approx(0)

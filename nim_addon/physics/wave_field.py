# SPDX-License-Identifier: GPL-3.0-or-later
"""The wave field of a Gaussian beam at a plane interface, as a sum of plane waves: what rays have no word for, the phase.

In two dimensions, time going as exp(-iwt): the beam comes from above, z > 0, and meets the interface, z = 0, at x = 0. Its
electric field is across the plane (s polarisation), of amplitude 1 in the middle of the beam. Lengths are wavelengths in vacuum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .interface import Interface

WAVES = 241  # that make the beam
REACH = 4.0  # of their angles, in units of the one at which the amplitude has fallen to 1 / e


class Field(NamedTuple):
    """A field at places (...).

    E:      complex amplitude
    phase:  (..., 2) gradient of its phase, along x and z, radians in a wavelength of vacuum
    energy: (..., 2) flow of energy, Poynting's vector over time, 1 in the middle of the incident beam
    """

    E: NDArray
    phase: NDArray
    energy: NDArray


@dataclass(frozen=True)
class Beam:
    """A beam that meets an Interface of two real media from its outside.

    angle: of incidence, radians, between 0 and pi / 2; waist: half its width, where the amplitude has fallen to 1 / e
    """

    interface: Interface
    angle: float
    waist: float

    def __post_init__(self):
        if self.interface.is_complex:
            raise ValueError("a beam is laid through media without loss; leave their k out.")
        if not 0 <= self.angle < math.pi / 2 or not self.waist > 0:
            raise ValueError("a beam's angle lies between 0 and 90 degrees, and its waist is above 0.")

    def at(self, x: ArrayLike, z: ArrayLike) -> Field:
        """The Field at places, wavelengths from where the beam's middle meets the interface; x and z broadcast: (...)."""
        x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
        outside, inside = self.interface.outside, self.interface.inside
        total, slope = np.zeros(x.shape, complex), np.zeros((*x.shape, 2), complex)
        above = z >= 0
        for weight, angle in zip(*self._waves(), strict=True):
            cosine = complex(self.interface.amplitudes(math.cos(angle)).cos_t)
            across = 2 * math.pi * outside.n * math.sin(angle)
            down = 2 * math.pi * outside.n * math.cos(angle)
            # of a NIM Re cos_t >= 0 is the wave that carries energy away: its phase, n cos_t, runs towards the surface
            on = 2 * math.pi * inside.n * cosine
            on = complex(on.real, abs(on.imag))  # and in total reflection what falls off, for either sign
            r = (down / outside.mu - on / inside.mu) / (down / outside.mu + on / inside.mu)
            here = np.where(above, z, 0)
            incident, mirrored = np.exp(-1j * down * here), r * np.exp(1j * down * here)
            passed = (1 + r) * np.exp(-1j * on * np.where(above, 0, z))
            along = weight * np.exp(1j * across * x)
            wave = along * np.where(above, incident + mirrored, passed)
            total += wave
            slope[..., 0] += 1j * across * wave
            slope[..., 1] += along * np.where(above, 1j * down * (mirrored - incident), -1j * on * passed)
        with np.errstate(divide="ignore", invalid="ignore"):
            phase = np.imag(slope / total[..., None])
        # H = curl E / (i w mu), S = Re(E x H*) / 2
        mu = np.where(above, outside.mu, inside.mu)[..., None]
        unit = 2 * math.pi * outside.n / outside.mu
        return Field(total, phase, np.imag(np.conj(total)[..., None] * slope) / mu / unit)

    def _waves(self):
        """Amplitudes and angles of incidence, (N,) both, of the waves that arrive."""
        width = 1 / (math.pi * abs(self.interface.outside.n) * self.waist)
        edge = min(REACH * width, math.pi / 2 - self.angle - 1e-6)
        turn = np.linspace(-min(REACH * width, math.pi / 2 - 1e-6), edge, WAVES)
        weights = np.exp(-np.square(turn / width))
        angles = self.angle + turn
        return weights / weights.sum(), angles

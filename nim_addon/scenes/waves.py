# SPDX-License-Identifier: GPL-3.0-or-later
"""Waves that travel on deep liquid: random directions, lengths and phases, and the frequencies that go with them."""

import numpy as np
from numpy.typing import NDArray

COUNT = 40
GRAVITY = 9.81  # m/s^2


def random_waves(
    seed: int, lengths: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """COUNT waves sin(k . (x, y) + phase - omega t), each of which travels along its k.

    seed: int; lengths: (shortest, longest) in metres, between which theirs are strewn evenly on a logarithmic scale
    Returns k (2, COUNT) in rad/m, phase (COUNT), omega (COUNT) in rad/s, and the lengths (COUNT) in metres. Liquid
    deeper than half a wavelength counts as deep: omega^2 = g |k| (Lamb, Hydrodynamics, chapter IX), so long waves run
    ahead of short ones.
    """
    random = np.random.default_rng(seed)
    angle, phase = random.uniform(0, 2 * np.pi, (2, COUNT))
    shortest, longest = np.log(lengths)
    length = np.exp(random.uniform(shortest, longest, COUNT))
    wavenumber = 2 * np.pi / length
    return wavenumber * np.stack([np.cos(angle), np.sin(angle)]), phase, np.sqrt(GRAVITY * wavenumber), length

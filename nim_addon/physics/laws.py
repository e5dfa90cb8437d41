# SPDX-License-Identifier: GPL-3.0-or-later
"""Laws of surfaces other than Snell's: a surface that takes a ray up and lets it go on elsewhere, all in one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from numpy.typing import NDArray


class Branch(NamedTuple):
    """One way in which N rays that have met a surface go on.

    share:     (N,) of the energy that a ray arrives with, 0 of those that do not go this way
    start:     (N, 3) where they go on, not on the side of a surface from which they would meet it again
    direction: (N, 3) unit vectors
    way:       (N, M, 3) points of the way there, the first where they met the surface and the last `start`; None where that
               is one place
    reflected: whether they are on the side that they came from, as a mirror would have them
    """

    share: NDArray
    start: NDArray
    direction: NDArray
    way: NDArray | None = None
    reflected: bool = False


class Law(Protocol):
    """What a surface does to rays, where it is no Interface between two media."""

    def branches(self, points: NDArray, directions: NDArray, normals: NDArray, /) -> Sequence[Branch]:
        """The ways of N rays that meet the surface at points (N, 3), along unit directions (N, 3).

        normals: (N, 3) of the surface there, unit vectors; direction . normal > 0 where a ray comes from inside
        What the shares of a ray leave of 1 is absorbed.
        """
        ...

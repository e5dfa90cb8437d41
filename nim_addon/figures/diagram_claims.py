# SPDX-License-Identifier: GPL-3.0-or-later
"""What must hold of the rays in the diagrams: traced rays against closed forms. No bpy, nothing is drawn."""

import math

import numpy as np

from ..physics import Medium
from ..physics.rays import Fate, Kind
from .claims import Claim
from .diagram_paths import BEAMS, DEPTH, STEEPEST, pool_paths, sphere_paths, transmitted_way


def pool_claims() -> list[Claim]:
    """Of figure 5.8."""
    claims = []
    size = 1.33
    critical = math.degrees(math.asin(1 / size))
    for name, n in (("water", size), ("NIM", -size)):
        sign = math.copysign(1, n)
        degrees = np.linspace(-STEEPEST, STEEPEST, 3001)
        paths = pool_paths(Medium(n), degrees, least=0.0, bounces=1)
        above = (paths.kind == Kind.TRANSMITTED) & (paths.energy > 0)
        theta = degrees[paths.ray[above]]
        d = paths.direction[above]
        leaving = np.degrees(np.arctan2(d[:, 0], d[:, 1]))
        surface = paths.start[above][:, 0]
        at_30 = np.argmin(np.abs(theta - 30))
        claims += [
            Claim(
                f"{name}: the ray 30 degrees from the vertical leaves at arcsin(n sin 30), on the "
                f"{'same' if n > 0 else 'other'} side",
                math.degrees(math.asin(n * 0.5)),
                leaving[at_30],
                1e-6,
                "deg",
            ),
            Claim(
                f"{name}: rays {'diverge' if n > 0 else 'converge'} above the surface, share of them",
                1,
                np.mean(sign * (leaving * surface)[theta != 0] > 0),
                0,
            ),
            Claim(f"{name}: the window ends at the critical angle", critical, np.max(np.abs(theta)), 0.05, "deg"),
            Claim(
                f"{name}: beyond it all is reflected, least energy that returns",
                1,
                np.min(paths.energy[(paths.kind == Kind.REFLECTED) & (np.abs(degrees[paths.ray]) > critical)]),
                1e-12,
            ),
        ]
        near = pool_paths(Medium(n), np.array([0.01]), least=0.0, bounces=1)
        last = transmitted_way(near, 0)[-1]
        point, d = near.start[last], near.direction[last]
        claims.append(
            Claim(
                f"{name}: the image of the source, heights above the surface",
                -DEPTH / n,
                point[1] - point[0] * d[1] / d[0],
                1e-6,
                "depths",
            )
        )
    return claims


def sphere_claims() -> list[Claim]:
    """Of figure B.1."""
    claims = []
    size = 1.5
    for name, n in (("glass", size), ("NIM", -size)):
        medium = Medium(n)
        heights = np.linspace(0.0005, 0.9995, 1000)
        paths = sphere_paths(medium, heights, bounces=2, branches=False)
        exits = paths.depth == 2
        order = np.argsort(paths.ray[exits])
        point, d = paths.start[exits][order], paths.direction[exits][order]
        claims.append(
            Claim(
                f"{name}: paraxial light {'meets' if n > 0 else 'seems to come from'} n / (2 (n - 1)) behind the centre",
                n / (2 * (n - 1)),
                point[0, 0] - point[0, 1] * d[0, 0] / d[0, 1],
                1e-5,
                "radii",
            )
        )
        # by Snell's law in triangles: out on the far side while theta_i + 2 |theta_t| < 90 degrees
        square = 4 / size**2
        far = math.sqrt(size**4 / 8 * (1 + square - math.sqrt((1 + square) ** 2 - square**2)))
        # and forwards while theta_i - theta_t < 45 degrees: the outermost rays of glass of 1.5 just do not
        forward = 1 / math.hypot(1, 1 - math.sqrt(2) / n)
        claims += [
            Claim(
                f"{name}: heights up to here leave by the far hemisphere",
                1.0 if n > 0 else far,
                _reaches(heights, point[:, 0] > 0),
                0.001,
                "radii",
            ),
            Claim(
                f"{name}: heights up to here go on forwards",
                forward,
                _reaches(heights, d[:, 0] > 0),
                0.001,
                "radii",
            ),
            Claim(
                f"{name}: light of the upper half in the centre leaves downwards, share of it",
                1,
                np.mean(d[heights < BEAMS[1].high, 1] < 0),
                0,
            ),
        ]
        edge = np.linspace(BEAMS[2].low, BEAMS[2].high, 41)
        claims.append(
            Claim(
                f"{name}: energy of the edge beam that goes back, by the series of inner reflections",
                np.mean([_returned(n, height) for height in edge]),
                _measured_return(medium, edge),
                1e-6,
            )
        )
    return claims


def _reaches(heights, holds):
    """The height up to which something holds of all rays, half a step beyond the last."""
    step = heights[1] - heights[0]
    return float(heights[np.argmin(holds)] - step / 2 if not holds.all() else heights[-1] + step / 2)


def _returned(n, height):
    """Energy that a ball of radius 1 sends backwards of a ray at a height, in closed form.

    The order p is turned by pi - 2 theta_i for p = 0, else by 2 (theta_i - theta_t) + (p - 1) (pi - 2 theta_t), and
    carries R for p = 0, else (1 - R)^2 R^(p - 1): inside, every interface is met at the same angle.
    """
    inner = math.asin(height / n)
    outer = math.asin(height)
    s = math.sin(outer - abs(inner)) / math.sin(outer + abs(inner))
    p = math.tan(outer - abs(inner)) / math.tan(outer + abs(inner))
    R = (s * s + p * p) / 2
    back = R if math.cos(math.pi - 2 * outer) < 0 else 0.0
    for order in range(1, 60):
        turned = 2 * (outer - inner) + (order - 1) * (math.pi - 2 * inner)
        back += (1 - R) ** 2 * R ** (order - 1) if math.cos(turned) < 0 else 0.0
    return back


def _measured_return(medium, heights):
    paths = sphere_paths(medium, heights, least=1e-10, bounces=60)
    leaves = paths.fate == Fate.ESCAPED
    back = leaves & (paths.direction[:, 0] < 0)
    return float(np.sum(paths.energy[back]) / np.sum(paths.energy[leaves]))

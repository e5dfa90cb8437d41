# SPDX-License-Identifier: GPL-3.0-or-later
"""A goniometer in Cycles: does this Blender obey the equations?

A parallel beam (an orthographic camera, seen backwards) falls at an angle on flat interfaces that lie side by side in
strips; rays stay in the plane of incidence, so the strips do not mix. Above is a red world, below at depth 1 a floor
that glows with the x where it was hit. Each path ends in one of them: red is R, the floor's mean is the landing point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict

import bpy
import numpy as np

from ..physics import MEDIA, REPRESENTATIVE_NM, Interface, Medium
from . import verify_closures, wavelength
from .goniometer import (
    ACROSS,
    ALONG,
    FURNACE_TOLERANCE,
    HEADER,
    LANDING_TOLERANCE,
    OFFSET,
    PITCH,
    SAMPLES,
    SIGMAS,
    Check,
    ball,
    beam,
    glowing_floor,
    landing,
    reflectance,
    rig,
    strip,
    within,
    world,
)
from .material import interface_material, resolve
from .render import pixels_of

__all__ = [
    "ACROSS",
    "ALONG",
    "HEADER",
    "LANDING_TOLERANCE",
    "SAMPLES",
    "SIGMAS",
    "Check",
    "measure_angle",
    "measure_losses",
    "measure_slabs",
    "measure_wavelength",
    "summary",
    "verify",
]

# degrees; 48 lies just below the critical angle of 1.33 to air, 48.75
ANGLES = (0.0, 30.0, 48.0, 60.0, 80.0, 89.0)
SHORT = (48.0,)
PAIRS = (
    Interface(MEDIA["water"]),
    Interface(MEDIA["glass"]),
    Interface(MEDIA["glass"], MEDIA["water"]),
    Interface(MEDIA["nim-1.025"]),
    Interface(MEDIA["nim-1.33"]),
    Interface(MEDIA["nim-1.5"]),
    Interface(MEDIA["nim-4.1"]),
    Interface(MEDIA["nim-1.33"], MEDIA["glass"]),
    Interface(MEDIA["nim-mu10"]),
    Interface(MEDIA["nim-mu25"]),
    Interface(MEDIA["nim-1.5"], MEDIA["nim-1.33"]),
    Interface(Medium(-0.6, -2.0), MEDIA["nim-mu10"]),
)
# Of what absorbs all that enters at once: R, and that nothing passes, from vacuum on either side of the faces.
LOSSY = (
    Medium.parse("silver").at(REPRESENTATIVE_NM),
    Medium.parse("gold").at(REPRESENTATIVE_NM),
    Medium(-1.33 + 0.05j),
    Medium.of(0.01 + 0.02j),  # epsilon near zero
    Medium.of(-2.25),  # epsilon alone is negative
    Medium(1.5 + 0.01j),
)
LOSSY_ANGLES = (0.0, 45.0, 75.0)
# Of slabs that absorb on the way through.
THICKNESS = 0.5
SLABS = (Medium(1.5 + 1.1e-7j), Medium(-1.0 + 1.1e-7j), Medium(-1.5 + 1.1e-7j))  # light falls to 1/e within 0.4
SLAB_ANGLES = (0.0, 40.0, 70.0)
# Of media that disperse, each by one render a wavelength, in nanometres.
DISPERSIVE = ("n-bk7", "n-sf11", "nim-normal", "nim-causal")
WAVELENGTHS, DISPERSIVE_ANGLE = (450.0, 650.0), 40.0
CHAIN = 40


def verify(
    progress: Callable[[int, int], object] | None = None, backend: str = "auto", short: bool = False
) -> list[Check]:
    """Measure R and landing points, a chain of interfaces, white furnaces, media with loss and colour, and other closures.

    progress: called with (renders done, renders in all)
    backend:  which form of the material to measure, as for material.interface_material
    short:    only the angles of SHORT, without all that follows them: 2 s instead of 30
    Nothing of the current file is changed. Raises as material.resolve() does.
    """
    backend = resolve(backend)
    checks = []
    steps = [(measure_angle, angle) for angle in (SHORT if short else ANGLES)]
    if not short:
        steps += [(_measure_chain, 30.0), (_measure_furnace, None)]
        steps += [(measure_losses, angle) for angle in LOSSY_ANGLES] + [(measure_slabs, angle) for angle in SLAB_ANGLES]
        steps += [(measure_wavelength, nm) for nm in WAVELENGTHS] + verify_closures.STEPS
    for done, (measure, argument) in enumerate(steps):
        if progress:
            progress(done, len(steps))
        checks += measure(argument, backend)
    if progress:
        progress(len(steps), len(steps))
    return checks


def summary(checks: Sequence[Check], backend: str) -> dict:
    """A JSON-ready dict: verdict, version, backend and all checks."""
    return {
        "backend": resolve(backend),
        "passed": all(check.passed for check in checks),
        "blender": bpy.app.version_string,
        "checks": [asdict(check) for check in checks],
    }


# ------------------------------------------------------------------------------------------------ the measurements


def _labels(interface, flipped):
    media = interface.outside, interface.inside
    incident, transmitted = media[::-1] if flipped else media
    sign = {True: "-", False: "+"}
    return {
        "incident": str(incident),
        "transmitted": str(transmitted),
        "signs": sign[incident.is_nim] + sign[transmitted.is_nim],
        "side": "inside" if flipped else "outside",
    }


def _views(media):
    """The interfaces of media with vacuum and whether they are flipped, so that light from vacuum meets either side."""
    vacuum = MEDIA["vacuum"]
    return [view for one in media for view in ((Interface(one), False), (Interface(vacuum, one), True))]


def _flat(views, angle, backend, wavelength_nm=None):
    """Blocks of pixels (ALONG, ACROSS, 3) of a beam on flat interfaces, flipped or not, that lie side by side.

    wavelength_nm: of the light, where a medium disperses; all media of the file are of it from then on
    """
    with rig(backend) as scene:
        world(scene, (1, 0, 0))
        strip(scene, glowing_floor(), 0, len(views) * PITCH, -1.0)
        for row, (interface, flipped) in enumerate(views):
            material = interface_material("NIM strip", interface.inside, interface.outside, backend=backend)
            strip(scene, material, row * PITCH, (row + 1) * PITCH, 0.0, flipped)
        beam(scene, angle, len(views))
        if wavelength_nm:
            wavelength.set_neutral(wavelength_nm)
        return np.split(pixels_of(scene), len(views))


def _landing(labels, angle, seen, block):
    """The Check of the point of the floor where the rays land, in a list; none where it cannot be told."""
    theta = math.radians(angle)
    theta_t = float(seen.theta_t(theta))
    # too little light passes to say where, or it runs off the floor's scale
    if not (seen.fresnel(math.cos(theta)).T > 0.01 and abs(math.tan(theta_t)) < OFFSET):
        return []
    return [within("landing", labels, angle, math.tan(theta_t), landing(block, angle), LANDING_TOLERANCE)]


def _reflected(views, angle, backend):
    """The Check of R, the labels, the Interface as it is seen, and the pixels, of each view."""
    for (interface, flipped), block in zip(views, _flat(views, angle, backend), strict=True):
        labels = _labels(interface, flipped)
        seen = interface.reversed() if flipped else interface
        R = float(seen.fresnel(math.cos(math.radians(angle))).R)
        yield reflectance("R", labels, angle, R, block[..., 0].ravel()), labels, seen, block


def measure_angle(angle: float, backend: str) -> list[Check]:
    """R and landing points of all PAIRS from both sides, for a beam at an angle in degrees; backend: "osl" or "nodes"."""
    checks = []
    for check, labels, seen, block in _reflected(
        [(pair, flipped) for pair in PAIRS for flipped in (False, True)], angle, backend
    ):
        checks += [check, *_landing(labels, angle, seen, block)]
    return checks


def measure_losses(angle: float, backend: str) -> list[Check]:
    """R of the LOSSY media from both sides, and that nothing passes; the same arguments."""
    checks = []
    for check, labels, _, block in _reflected(_views(LOSSY), angle, backend):
        checks += [check, within("T", labels, angle, 0.0, float(block[..., 2].mean()), 1e-6)]
    return checks


def measure_wavelength(wavelength_nm: float, backend: str) -> list[Check]:
    """Where rays of a wavelength, nanometres, land behind the media that are DISPERSIVE; backend as above."""
    media = [Medium.parse(name) for name in DISPERSIVE]
    views = [(Interface(medium), False) for medium in media]
    before = wavelength.neutral()
    try:
        blocks = _flat(views, DISPERSIVE_ANGLE, backend, wavelength_nm)
    finally:
        wavelength.set_neutral(before)
    checks = []
    for (interface, flipped), block in zip(views, blocks, strict=True):
        labels = _labels(interface, flipped)
        labels["transmitted"] += f" {wavelength_nm:g} nm"
        checks += _landing(labels, DISPERSIVE_ANGLE, interface.at(wavelength_nm), block)
    return checks


def measure_slabs(angle: float, backend: str) -> list[Check]:
    """What passes through closed SLABS, in all orders of reflection: T^2 l / (1 - R^2 l^2), l = exp(-alpha way).

    The same arguments as of measure_angle().
    """
    with rig(backend) as scene:
        world(scene, (1, 0, 0))
        strip(scene, glowing_floor(), 0, len(SLABS) * PITCH, -1.0)
        for row, medium in enumerate(SLABS):
            material = interface_material("NIM strip", medium, backend=backend)
            for z, flipped in ((0.0, False), (-THICKNESS, True)):
                strip(scene, material, row * PITCH, (row + 1) * PITCH, z, flipped)
        beam(scene, angle, len(SLABS))
        blocks = np.split(pixels_of(scene), len(SLABS))
    checks = []
    for medium, block in zip(SLABS, blocks, strict=True):
        theta = math.radians(angle)
        R, T = (float(share) for share in Interface(medium).fresnel(math.cos(theta))[2:])
        left = math.exp(-medium.absorption() * THICKNESS / math.cos(float(Interface(medium).theta_t(theta))))
        passed = T * T * left / (1 - (R * left) ** 2)
        checks.append(reflectance("slab", _labels(Interface(medium), False), angle, passed, block[..., 2].ravel()))
    return checks


def _measure_chain(angle, backend):
    """CHAIN interfaces one below the other: without interference R = N r / (1 + (N - 1) r), r the reflectance of one."""
    media = (Medium(-1.0), Medium(-1.5), Medium(1.5))
    with rig(backend) as scene:
        world(scene, (1, 0, 0))
        strip(scene, glowing_floor(), 0, len(media) * PITCH, -1.0)
        for row, medium in enumerate(media):
            material = interface_material("NIM chain", medium, backend=backend)
            for i in range(CHAIN):
                strip(scene, material, row * PITCH, (row + 1) * PITCH, -i / CHAIN, flipped=i % 2 == 1)
        beam(scene, angle, len(media))
        pixels = pixels_of(scene)
    checks = []
    for row, medium in enumerate(media):
        r = float(Interface(medium).fresnel(math.cos(math.radians(angle))).R)
        expected = CHAIN * r / (1 + (CHAIN - 1) * r)
        labels = _labels(Interface(medium), False)
        block = pixels[row * ALONG : (row + 1) * ALONG]
        checks.append(reflectance(f"R of {CHAIN}", labels, angle, expected, block[..., 0].ravel()))
        both = float(block[..., 0].mean() + block[..., 2].mean())
        checks.append(within("R + T", labels, angle, 1.0, both, FURNACE_TOLERANCE))
    return checks


def _measure_furnace(_, backend):
    """A round body in a white world is invisible if no light is lost."""
    checks = []
    for medium in (Medium(-1.5), Medium(-1.0), Medium(-0.6), Medium(1.5), MEDIA["nim-mu25"]):
        with rig(backend) as scene:
            world(scene, (1, 1, 1))
            ball(scene, interface_material("NIM furnace", medium, backend=backend))
            beam(scene, 0.0, 2 * ACROSS // ALONG)
            scene.camera.data.ortho_scale = 2.0
            scene.camera.location = (0, 0, 4)
            scene.cycles.samples = 16
            mean = float(pixels_of(scene).mean())
        checks.append(within("furnace", _labels(Interface(medium), False), 0.0, 1.0, mean, FURNACE_TOLERANCE))
    return checks

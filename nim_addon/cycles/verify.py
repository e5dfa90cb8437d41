# SPDX-License-Identifier: GPL-3.0-or-later
"""A goniometer in Cycles: does this Blender obey the equations?

A parallel beam (an orthographic camera, seen backwards) falls at an angle on flat interfaces that lie side by side in
strips; rays stay in the plane of incidence, so the strips do not mix. Above is a red world, below at depth 1 a floor
that glows with the x where it was hit. Each path ends in one of them: red is R, the floor's mean is the landing point.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import bpy
import mathutils
import numpy as np

from ..physics import MEDIA, REPRESENTATIVE_NM, Interface, Medium
from . import settings, wavelength
from .material import interface_material, resolve
from .nodes import Nodes, empty_tree
from .render import pixels_of

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
SAMPLES = 64  # a pixel
ACROSS, ALONG = 32, 16  # pixels of a strip: 512 of them make 32,768 samples
PITCH = 0.002  # width of a strip, where the floor lies at depth 1
OFFSET = 64.0  # added to x on the floor, so that what glows is positive
LANDING_TOLERANCE = 1e-3  # of the depth
FURNACE_TOLERANCE = 1e-3
SIGMAS = 4.0
CHAIN = 40
# of bpy.data, in which the rig makes something
COLLECTIONS = ("objects", "meshes", "materials", "worlds", "cameras", "node_groups", "texts", "scenes")


@dataclass(frozen=True)
class Check:
    """One measured number beside the equation's: `error` is its standard error, or the tolerance where `z` is None."""

    what: str  # "R", "T", "landing", "R of 40", "R + T", "furnace", "slab"
    incident: str
    transmitted: str
    signs: str
    side: str  # the side of the faces the beam comes from
    angle: float  # degrees
    equation: float
    measured: float
    error: float
    z: float | None
    passed: bool

    def row(self) -> str:
        """One line of the printed table."""
        z = "" if self.z is None else f"{self.z:+7.2f}"
        verdict = "" if self.passed else "  FAIL"
        pair = f"{self.incident} -> {self.transmitted}"
        return (
            f"{self.what:8} {pair:30} {self.side:8} {self.angle:5.1f} "
            f"{self.equation:12.6f} {self.measured:12.6f} {self.error:10.2g} {z:7}{verdict}"
        )


HEADER = f"{'what':8} {'media':30} {'from':8} {'angle':>5} {'equation':>12} {'measured':>12} {'std error':>10} {'z':>7}"


def verify(
    progress: Callable[[int, int], object] | None = None, backend: str = "auto", short: bool = False
) -> list[Check]:
    """Measure R and landing points, a chain of interfaces, white furnaces, and media with loss and colour in Cycles.

    progress: called with (renders done, renders in all)
    backend:  which form of the material to measure, as for material.interface_material
    short:    only the angles of SHORT, without all that follows them: 2 s instead of 25
    Nothing of the current file is changed. Raises as material.resolve() does.
    """
    backend = resolve(backend)
    checks = []
    steps = [(measure_angle, angle) for angle in (SHORT if short else ANGLES)]
    if not short:
        steps += [(_measure_chain, 30.0), (_measure_furnace, None)]
        steps += [(measure_losses, angle) for angle in LOSSY_ANGLES] + [(measure_slabs, angle) for angle in SLAB_ANGLES]
        steps += [(measure_wavelength, nm) for nm in WAVELENGTHS]
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


# ------------------------------------------------------------------------------------------------ the rig


@contextlib.contextmanager
def _rig(backend):
    """An empty scene set up for measuring, and a list for the data made for it: all is taken away at the end."""
    before = {name: set(getattr(bpy.data, name)) for name in COLLECTIONS}
    scene = bpy.data.scenes.new("NIM goniometer")
    settings.lossless(scene, backend)
    scene.cycles.samples = SAMPLES
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.seed = 1
    try:
        yield scene
    finally:
        new = [data for name in COLLECTIONS for data in set(getattr(bpy.data, name)) - before[name]]
        bpy.data.batch_remove([data for data in new if data.name != "Render Result"])


def _world(scene, color):
    world = scene.world = bpy.data.worlds.new("NIM goniometer")
    nodes = Nodes(empty_tree(world))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": color}), "World")
    world.cycles.sampling_method = "NONE"


def _glowing_floor():
    """A material that emits (0, x + OFFSET, 1)."""
    material = bpy.data.materials.new("NIM floor")
    nodes = Nodes(empty_tree(material))
    place = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    x = nodes.add("ShaderNodeSeparateXYZ", inputs={0: place}).outputs["X"]
    color = nodes.add("ShaderNodeCombineXYZ", inputs={1: nodes.math("ADD", x, OFFSET), 2: 1.0}).outputs[0]
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": color}))
    material.cycles.emission_sampling = "NONE"
    return material


def _strip(scene, material, low, high, z, flipped=False):
    """A quad across all x at height z, between y = low and high, its normal up or (flipped) down."""
    reach = 1.25 * OFFSET  # not farther: single precision places a hit to 1e-7 of the quad's size
    corners = [(-reach, low, z), (reach, low, z), (reach, high, z), (-reach, high, z)]
    mesh = bpy.data.meshes.new("NIM strip")
    mesh.from_pydata(corners, [], [(3, 2, 1, 0) if flipped else (0, 1, 2, 3)])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("NIM strip", mesh))


def _beam(scene, angle, strips):
    """Aim an orthographic camera: light travels along (sin, 0, -cos) of the angle; strip after strip up the image."""
    theta = math.radians(angle)
    data = bpy.data.cameras.new("NIM beam")
    data.type = "ORTHO"
    data.sensor_fit = "VERTICAL"
    data.ortho_scale = strips * PITCH
    data.clip_start = 1e-3
    camera = bpy.data.objects.new("NIM beam", data)
    right, up = (math.cos(theta), 0, math.sin(theta)), (0, 1, 0)
    back = (-math.sin(theta), 0, math.cos(theta))
    frame = mathutils.Matrix((right, up, back)).transposed().to_4x4()
    frame.translation = mathutils.Vector(back) * 4 + mathutils.Vector((0, strips * PITCH / 2, 0))
    camera.matrix_world = frame
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = ACROSS, strips * ALONG
    scene.render.resolution_percentage = 100


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


def _reflectance(what, labels, angle, equation, red):
    """The Check of a mean of pixels (N,) against R; each pixel is an independent estimate from SAMPLES paths."""
    measured = float(red.mean())
    # The sampler spreads a pixel's paths evenly, so pixels scatter less than a binomial; where they do not scatter at
    # all, one path of all is what can be told.
    error = max(float(red.std(ddof=1)) / math.sqrt(red.size), 1.0 / (red.size * SAMPLES))
    z = (measured - equation) / error
    return Check(
        what, **labels, angle=angle, equation=equation, measured=measured, error=error, z=z, passed=abs(z) <= SIGMAS
    )


def _within(what, labels, angle, equation, measured, tolerance):
    passed = abs(measured - equation) <= tolerance
    return Check(
        what, **labels, angle=angle, equation=equation, measured=measured, error=tolerance, z=None, passed=passed
    )


def _views(media):
    """The interfaces of media with vacuum and whether they are flipped, so that light from vacuum meets either side."""
    vacuum = MEDIA["vacuum"]
    return [view for one in media for view in ((Interface(one), False), (Interface(vacuum, one), True))]


def _flat(views, angle, backend, wavelength_nm=None):
    """Blocks of pixels (ALONG, ACROSS, 3) of a beam on flat interfaces, flipped or not, that lie side by side.

    wavelength_nm: of the light, where a medium disperses; all media of the file are of it from then on
    """
    with _rig(backend) as scene:
        _world(scene, (1, 0, 0))
        _strip(scene, _glowing_floor(), 0, len(views) * PITCH, -1.0)
        for row, (interface, flipped) in enumerate(views):
            material = interface_material("NIM strip", interface.inside, interface.outside, backend=backend)
            _strip(scene, material, row * PITCH, (row + 1) * PITCH, 0.0, flipped)
        _beam(scene, angle, len(views))
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
    entry = (np.arange(ACROSS) + 0.5 - ACROSS / 2) * PITCH / ALONG / math.cos(theta)
    green, blue = block[..., 1], block[..., 2]
    landing = float(np.sum(green - blue * (OFFSET + entry)) / max(np.sum(blue), 1e-9))
    return [_within("landing", labels, angle, math.tan(theta_t), landing, LANDING_TOLERANCE)]


def _reflected(views, angle, backend):
    """The Check of R, the labels, the Interface as it is seen, and the pixels, of each view."""
    for (interface, flipped), block in zip(views, _flat(views, angle, backend), strict=True):
        labels = _labels(interface, flipped)
        seen = interface.reversed() if flipped else interface
        R = float(seen.fresnel(math.cos(math.radians(angle))).R)
        yield _reflectance("R", labels, angle, R, block[..., 0].ravel()), labels, seen, block


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
        checks += [check, _within("T", labels, angle, 0.0, float(block[..., 2].mean()), 1e-6)]
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
    with _rig(backend) as scene:
        _world(scene, (1, 0, 0))
        _strip(scene, _glowing_floor(), 0, len(SLABS) * PITCH, -1.0)
        for row, medium in enumerate(SLABS):
            material = interface_material("NIM strip", medium, backend=backend)
            for z, flipped in ((0.0, False), (-THICKNESS, True)):
                _strip(scene, material, row * PITCH, (row + 1) * PITCH, z, flipped)
        _beam(scene, angle, len(SLABS))
        blocks = np.split(pixels_of(scene), len(SLABS))
    checks = []
    for medium, block in zip(SLABS, blocks, strict=True):
        theta = math.radians(angle)
        R, T = (float(share) for share in Interface(medium).fresnel(math.cos(theta))[2:])
        left = math.exp(-medium.absorption() * THICKNESS / math.cos(float(Interface(medium).theta_t(theta))))
        passed = T * T * left / (1 - (R * left) ** 2)
        checks.append(_reflectance("slab", _labels(Interface(medium), False), angle, passed, block[..., 2].ravel()))
    return checks


def _measure_chain(angle, backend):
    """CHAIN interfaces one below the other: without interference R = N r / (1 + (N - 1) r), r the reflectance of one."""
    media = (Medium(-1.0), Medium(-1.5), Medium(1.5))
    with _rig(backend) as scene:
        _world(scene, (1, 0, 0))
        _strip(scene, _glowing_floor(), 0, len(media) * PITCH, -1.0)
        for row, medium in enumerate(media):
            material = interface_material("NIM chain", medium, backend=backend)
            for i in range(CHAIN):
                _strip(scene, material, row * PITCH, (row + 1) * PITCH, -i / CHAIN, flipped=i % 2 == 1)
        _beam(scene, angle, len(media))
        pixels = pixels_of(scene)
    checks = []
    for row, medium in enumerate(media):
        r = float(Interface(medium).fresnel(math.cos(math.radians(angle))).R)
        expected = CHAIN * r / (1 + (CHAIN - 1) * r)
        labels = _labels(Interface(medium), False)
        block = pixels[row * ALONG : (row + 1) * ALONG]
        checks.append(_reflectance(f"R of {CHAIN}", labels, angle, expected, block[..., 0].ravel()))
        both = float(block[..., 0].mean() + block[..., 2].mean())
        checks.append(_within("R + T", labels, angle, 1.0, both, FURNACE_TOLERANCE))
    return checks


def _measure_furnace(_, backend):
    """A round body in a white world is invisible if no light is lost."""
    checks = []
    for medium in (Medium(-1.5), Medium(-1.0), Medium(-0.6), Medium(1.5), MEDIA["nim-mu25"]):
        with _rig(backend) as scene:
            _world(scene, (1, 1, 1))
            _ball(scene, interface_material("NIM furnace", medium, backend=backend))
            _beam(scene, 0.0, 2 * ACROSS // ALONG)
            scene.camera.data.ortho_scale = 2.0
            scene.camera.location = (0, 0, 4)
            scene.cycles.samples = 16
            mean = float(pixels_of(scene).mean())
        checks.append(_within("furnace", _labels(Interface(medium), False), 0.0, 1.0, mean, FURNACE_TOLERANCE))
    return checks


def _ball(scene, material, segments=128):
    """A smooth unit sphere at the origin."""
    import bmesh

    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=1.0)
    mesh = bpy.data.meshes.new("NIM furnace")
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("NIM furnace", mesh))

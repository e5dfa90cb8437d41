# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of bench/spectrum.py in Blender, and the ways in which this project renders them in colour.

  python spectrum_cycles.py JOB WAY

JOB is the JSON that bench/spectrum.py writes (spectrum_scenes.job), WAY one of WAYS.
"""

import contextlib
import functools
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import bpy
import numpy as np
from answering import answer
from reference_scene import render
from spectrum_scenes import CHECKS, GROUND, HORIZON, NEUTRAL_NM, OTHERS, SPHERE, ZENITH, camera, medium_of, prism

from nim_addon.base.streams import quiet
from nim_addon.cycles import settings, spectral
from nim_addon.cycles.material import interface_material
from nim_addon.physics import VISIBLE_NM
from nim_addon.physics.colour import Wavelengths, weights_of
from nim_addon.scenes import shapes, surfaces
from nim_addon.scenes.sphere import ball
from nim_addon.scenes.stage import Stage

STACK = 32  # wavelengths of a stack


def build(kind, medium, options, disperses=True):
    """A scene as a bpy.types.Scene, in an empty file.

    disperses: whether the medium is the named one, or else the real one that it is at the neutral wavelength
    """
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    stage = Stage("spectrum", (options.size, options.size), options.backend)
    named = medium_of(medium)
    made = interface_material("Medium", named if disperses else named.at(NEUTRAL_NM), backend=stage.backend)
    if kind == "prism":
        _prism(stage, prism(medium, options.size), made)
    else:
        _ball(stage, made, kind == "lit")
    eye, target, fov, _ = camera(kind, medium, options.size)
    stage.camera(eye, target, fov)
    scene = stage.scene
    scene.render.use_persistent_data = True  # what is built once is no part of the time
    scene.render.threads_mode, scene.render.threads = "FIXED", options.threads
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    return scene


def _ball(stage, made, lit):
    opaque = surfaces.diffuse if lit else surfaces.shining

    def checks(nodes):
        xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeTexCoord").outputs["Object"]})
        cells = nodes.math("ADD", *(nodes.math("FLOOR", xyz.outputs[axis]) for axis in (0, 1)))
        return nodes.mix(nodes.math("FLOORED_MODULO", cells, 2.0), *((grey,) * 3 for grey in CHECKS))

    stage.mesh("Ground", *shapes.rectangle((-GROUND, -GROUND), (GROUND, GROUND)), opaque("Ground", checks))
    ball(stage, "Sphere", *SPHERE, made)
    for number, (center, radius, grey) in enumerate(OTHERS):
        name = f"Other {number}"
        ball(stage, name, center, radius, opaque(name, lambda nodes, grey=grey: (grey,) * 3))
    stage.world(surfaces.sky("Sky", (HORIZON,) * 3, (ZENITH,) * 3))


def _prism(stage, own, made):
    for name, part, material in (
        ("Faces", own.faces, made),
        ("Walls", own.walls, surfaces.diffuse("Black", lambda nodes: (0.0,) * 3)),
        ("Slit", own.slit, surfaces.shining("Slit", lambda nodes: (1.0,) * 3)),
    ):
        stage.mesh(name, np.asarray(part[0]), part[1], material)


class Way:
    """A way to render a scene, of so many samples a pixel in all; a call with a seed gives pixels, and seconds on the
    clock and on the processors. What one sample takes is set-up, and no part of them."""

    renders = 1

    def __init__(self, kind, medium, options, disperses=True):
        self.samples, self.size = options.samples, options.size
        self.scene = build(kind, medium, options, disperses)
        self.set_up = []  # seconds of renders of one sample, clock and processors, of all calls

    def passes(self):
        """What is rendered, in turn: yields the first of its samples, and its weight (3,) in the picture."""
        yield 0, np.ones(3)

    def __call__(self, seed):
        pixels, seconds = np.zeros((self.size, self.size, 3)), np.zeros(2)
        for first, weight in self.passes():
            self._render(seed, first, 1)  # compiles
            part, *spent = self._render(seed, first, self.samples // self.renders)
            pixels += part * weight / self.renders
            seconds += spent
        self.set_up.append(self._render(seed, 0, 1)[1:])
        seconds -= self.renders * np.median(self.set_up, axis=0)
        return pixels, *(seconds * self.samples / (self.samples - self.renders)).tolist()

    def _render(self, seed, first, count):
        settings.sample_range(self.scene, first, count, self.samples)
        return render(self.scene, self.samples, seed)


class Single(Way):
    """One render in which each path has a wavelength of its own: likely as by importance, or all alike."""

    def __init__(self, kind, medium, options, by_importance=True):
        drawn = (
            contextlib.nullcontext()
            if by_importance
            else mock.patch.object(Wavelengths, "by_importance", Wavelengths.uniform)
        )
        with drawn:
            super().__init__(kind, medium, options)
            spectral.set_up(self.scene, options.backend)


class Strata(Single):
    """So many renders, each of its own part of the spectrum and of the sequence of samples."""

    def __init__(self, kind, medium, options, renders):
        super().__init__(kind, medium, options)
        self.renders = renders

    def passes(self):
        for number in range(self.renders):
            spectral.set_stratum(number, self.renders)
            yield number * self.samples // self.renders, np.ones(3)


class Stack(Way):
    """So many renders of one wavelength each, spread evenly over the visible, with one seed."""

    def __init__(self, kind, medium, options, renders=STACK):
        super().__init__(kind, medium, options)
        self.renders = renders
        least, most = VISIBLE_NM
        self.wavelengths = least + (np.arange(renders) + 0.5) * (most - least) / renders

    def passes(self):
        for nanometres, weight in zip(self.wavelengths, weights_of(self.wavelengths), strict=True):
            spectral.set_neutral(float(nanometres))
            yield 0, weight


WAYS = {
    "plain": functools.partial(Way, disperses=False),
    "single": Single,
    "alike": functools.partial(Single, by_importance=False),
    "strata-8": functools.partial(Strata, renders=8),
    "strata-16": functools.partial(Strata, renders=16),
    "stack": Stack,
}


def main(job, way):
    """Answer the requests on the input until it ends."""
    options, ready = SimpleNamespace(**json.loads(Path(job).read_text())), {}

    def picture(kind, medium, seed):
        if (kind, medium) not in ready:  # one at a time, since each is built in an empty file
            ready.clear()
            ready[kind, medium] = WAYS[way](kind, medium, options)
        return ready[kind, medium](seed)

    answer(lambda: picture)


if __name__ == "__main__":
    main(*sys.argv[1:])

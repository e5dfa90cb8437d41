# SPDX-License-Identifier: GPL-3.0-or-later
"""Render settings under which no light is lost at an interface: one list for what sets them and what checks them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import bpy

from .problem import Problem

# The most Cycles takes. A ray bent backwards counts as a transparent bounce, any other as a bounce of its kind, and a
# path that has used them up is black; paths that lose light end early by Russian roulette, so a high limit costs little.
BOUNCES = 1024
# Below this a picture with a few NIMs, or with one of many folds, has black spots; Blender starts with 8 and 4.
FEWEST_BOUNCES = 64


class Loss(NamedTuple):
    """Settings that lose light at an interface, or make it up.

    code, text, remedy: as of a problem.Problem; {worst} in the text is the smallest of the settings
    values: {path from the scene: the value that loses nothing}
    wrong:  whether the settings, given in that order, do
    """

    code: str
    values: dict[str, float | bool]
    wrong: Callable[..., bool]
    text: str
    remedy: str


def _below(least):
    return lambda *values: min(values) < least


def _on(*values):
    return any(value > 0 for value in values)


def _off(*values):
    return not all(values)


LOSSES = (
    Loss(
        "transparent_bounces",
        {"cycles.transparent_max_bounces": BOUNCES},
        _below(FEWEST_BOUNCES),
        "Transparent bounces: {worst}. Each bend backwards is one, and after the last the path is black.",
        "Raise them",
    ),
    Loss(
        "bounces",
        {f"cycles.{kind}_bounces": BOUNCES for kind in ("max", "glossy", "transmission")},
        _below(FEWEST_BOUNCES),
        "Light bounces: {worst}. Each reflection and each bend forwards is one, and after the last the path is black.",
        "Raise them",
    ),
    Loss(
        "diffuse_bounces",
        {"cycles.diffuse_bounces": BOUNCES},
        _below(1),
        "Diffuse bounces: 0. Light that was bent is then missing on matte surfaces.",
        "Raise them",
    ),
    Loss(
        "caustics",
        {"cycles.caustics_reflective": True, "cycles.caustics_refractive": True},
        _off,
        "Caustics are off: light that was mirrored or bent is missing on matte surfaces.",
        "Turn on caustics",
    ),
    Loss(
        "fast_gi",
        {"cycles.use_fast_gi": False},
        _on,
        "Fast GI Approximation ends paths early, and makes up what they would have met.",
        "Turn it off",
    ),
    Loss(
        "clamp",
        {"cycles.sample_clamp_direct": 0.0, "cycles.sample_clamp_indirect": 0.0},
        _on,
        "Clamping dims what is mirrored but not what is bent backwards: their balance is wrong.",
        "Turn off clamping",
    ),
    Loss(
        "filter_glossy",
        {"cycles.blur_glossy": 0.0},
        _on,
        "Filter Glossy blurs what is mirrored but not what is bent backwards.",
        "Turn off the filter",
    ),
    Loss(
        "adaptive_sampling",
        {"cycles.use_adaptive_sampling": False},
        _on,
        "Adaptive Sampling stops where it has met no light yet: a small light behind what bends it is missing.",
        "Turn it off",
    ),
    Loss(
        "film_transparent",
        {"render.film_transparent": False},
        _on,
        "The film is transparent: a negative-index material shows as a hole in it.",
        "Make the film opaque",
    ),
)


def losses(scene: bpy.types.Scene) -> list[Problem]:
    """The Problems of settings under which `scene` loses light at an interface; quick."""
    found = []
    for loss in LOSSES:
        values = [scene.path_resolve(path) for path in loss.values]
        if loss.wrong(*values):
            found.append(Problem(loss.code, (loss.text,), {"worst": min(values)}, loss.remedy))
    return found


def mend(scene: bpy.types.Scene, problem: Problem) -> None:
    """Set what the Loss of that problem's code is about to what loses nothing."""
    (values,) = (loss.values for loss in LOSSES if loss.code == problem.code)
    for path, value in values.items():
        put(scene, path, value)


def lossless(scene: bpy.types.Scene, backend: str) -> None:
    """Set a scene to render interfaces with Cycles, without bias; size and samples stay as they are.

    backend: "osl" or "nodes" (closures.backends.resolve)
    """
    put(scene, "render.engine", "CYCLES")
    for loss in LOSSES:
        for path, value in loss.values.items():
            put(scene, path, value)
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.shading_system = backend == "osl"
    cycles.use_denoising = False
    scene.render.use_compositing = False
    scene.render.use_sequencer = False


def put(scene: bpy.types.Scene, path: str, value: Any) -> None:
    """Give the setting at a path from a scene, such as "cycles.samples", a value, if it has another."""
    owner, _, name = path.partition(".")
    if scene.path_resolve(path) != value:  # setting it stops Cycles' previews, and waits for them, for nothing
        setattr(getattr(scene, owner), name, value)


def one_sample(scene: bpy.types.Scene, index: int, total: int) -> None:
    """Let a scene render sample `index` of `total` alone, counted from 0."""
    sample_range(scene, index, 1, total)


def sample_range(scene: bpy.types.Scene, first: int, count: int, total: int) -> None:
    """Let a scene render the samples from `first`, counted from 0, of the sequence of `total`."""
    cycles = scene.cycles
    cycles.sample_offset = first
    if hasattr(cycles, "use_sample_subset"):  # from 4.5
        cycles.use_sample_subset, cycles.samples, cycles.sample_subset_length = True, total, count
    else:
        cycles.samples = count
        if count > 1:  # which goes on at an offset in this one alone
            cycles.sampling_pattern = "TABULATED_SOBOL"


@contextlib.contextmanager
def samples_kept(scene: bpy.types.Scene) -> Iterator[None]:
    """Let the samples of a scene be at the end what they were."""
    cycles = scene.cycles
    names = ("samples", "sample_offset", "use_sample_subset", "sample_subset_length", "sampling_pattern")
    former = {name: getattr(cycles, name) for name in names if hasattr(cycles, name)}
    try:
        yield
    finally:
        for name, value in former.items():
            setattr(cycles, name, value)

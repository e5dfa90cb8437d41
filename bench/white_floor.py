# SPDX-License-Identifier: GPL-3.0-or-later
"""The white floor below a liquid's waves that bench/caustics.py measures on: its truth, and what is found of it."""

import math
import resource
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

LIQUIDS = {"NIM": "nim", "water": "water"}
THREADS = 2
RED = (1.0, 0.0, 0.0)  # the strongest channel of the pool's sun; the only one that is compared


class Spent(NamedTuple):
    """Seconds on the clock and of all processors."""

    clock: float
    processors: float


def now():
    """Spent so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return Spent(time.perf_counter(), used.ru_utime + used.ru_stime)


def since(start):
    """Spent since an earlier now()."""
    return Spent(*(b - a for a, b in zip(start, now(), strict=True)))


def white_floor(liquid, sun):
    """The scene that is measured: a bpy.types.Scene under a sun `sun` degrees wide."""
    import bpy

    from nim_addon.figures.pool import sun_on_white
    from nim_addon.scenes import pool, surfaces

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = pool.build(pool.PoolParameters(liquid=LIQUIDS[liquid], sky="sunny", sun_angle=max(sun, 0.5)), "nodes")
    sun_on_white(scene)
    scene.world = surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=pool.sun(sun))
    scene.world.cycles.sampling_method = "NONE"  # shadow rays end at the liquid
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    return scene


class Floor:
    """The floor among the charts of a Bake: `name` of its object, its `number`, `key` of its finest window, `low` and
    `high` corners (2,) in metres."""

    def __init__(self, bake):
        charts = bake.tracer.charts
        from nim_addon.caustics.density import LEVELS

        number = next(k for k, chart in enumerate(charts) if chart.name.startswith("Basin") and chart.axis == 4)
        self.name, self.number, self.key = charts[number].name, number, LEVELS * 2 * number
        self.low, self.high = np.asarray(charts[number].low, float), np.asarray(charts[number].high, float)

    def grid(self, cells):
        """(width, height) of a grid of square cells, `cells` along x, over the floor."""
        return cells, round(cells * (self.high - self.low)[1] / (self.high - self.low)[0])

    def counted(self, bake, cells):
        """A Density of that grid: a texture without a kernel, whose texels are the cells."""
        from nim_addon.caustics.density import Density, Texture, Window

        size = self.grid(cells)
        texel = (self.high - self.low)[0] / cells
        window = Window(self.low, texel, size)
        texture = Texture({self.key: window}, size[::-1], 0)
        return Density(bake.tracer.parts, bake.tracer.charts, {self.name: texture}, RED)

    def gathered(self, values, density, cells):
        """Values (H, W) a texel of this floor's texture, averaged (power per area is) over the grid: (height, width)."""
        texture = density.textures[self.name]
        window = texture.windows[self.key]
        rows, columns = (slice(a, a + n) for a, n in zip(window.at[::-1], window.cells[::-1], strict=True))
        size = self.grid(cells)
        edge = (self.high - self.low) / size
        share = []
        for axis in (0, 1):
            borders = self.low[axis] + edge[axis] * np.arange(size[axis] + 1)
            texels = window.low[axis] + window.texel * np.arange(window.cells[axis] + 1)
            overlap = np.minimum(borders[1:, None], texels[1:]) - np.maximum(borders[:-1, None], texels[:-1])
            share.append(np.maximum(overlap, 0))
        return share[1] @ values[rows, columns] @ share[0].T / edge.prod()


def truth(scene, name, photons, cells, cache, light=None):
    """The irradiance of the floor (2, height, width), its red channel, from two independent bakes of half the photons.

    cells: along x; light: of caustics.Bake; a file in the folder `cache` is gone on with, where it is of the same bake
    """
    return np.array([_counted(scene, name, photons / 2, cells, cache, light, seed) for seed in (1000, 2000)])


def _counted(scene, name, photons, cells, cache, light, seed):
    from nim_addon import caustics

    file = Path(cache, f"caustics-{name}-{photons / 1e6:g}-{cells}-{seed}.npz")
    with caustics.Bake(scene, light, photons=photons, seed=seed) as bake:
        floor = Floor(bake)
        if not bake.load(file):
            bake.density = floor.counted(bake, cells)
        start, first = now(), bake.done
        for done in bake:
            if done % 32 == 0 or done == bake.total:
                bake.save(file)
                left = since(start).clock / (done - first) * (bake.total - done)
                print(
                    f"truth of {name}, {seed}: {done} of {bake.total}, {left:.0f} s left", file=sys.stderr, flush=True
                )
        area = ((floor.high - floor.low)[0] / cells) ** 2
        flux = bake.density.flux[:, 0].sum(axis=0, dtype=float)
        return flux.reshape(bake.density.textures[floor.name].shape) / bake.total / area


def coarser(values, times):
    """Means (..., H, W) over square blocks of `times` cells."""
    *more, height, width = values.shape
    return values.reshape(*more, height // times, times, width // times, times).mean(axis=(-3, -1))


def error(found, halves):
    """How far `found` (H, W) is from the mean of two halves of the truth (2, H, W): relative, their own noise subtracted."""
    noise = np.mean((halves[0] - halves[1]) ** 2) / 4
    squared = np.mean((found - halves.mean(axis=0)) ** 2) - noise
    return math.sqrt(max(squared, 0)) / halves.mean()


def own_error(halves):
    """The noise of the mean of the truth's halves, relative."""
    return math.sqrt(np.mean((halves[0] - halves[1]) ** 2)) / 2 / halves.mean()


class Traced(NamedTuple):
    """A bake as it is done every day: its floor and density, the floor's irradiance (H, W) a texel, the area of the
    floor in each texel of its window, and what it took."""

    floor: Floor
    density: object
    irradiance: np.ndarray
    area: np.ndarray
    passes: int
    spent: Spent


def traced(scene, photons, seed, light=None):
    """Trace that many photons; returns a Traced."""
    from nim_addon import caustics
    from nim_addon.caustics import atlas

    start = now()
    with caustics.Bake(scene, light, photons=photons, seed=seed) as bake:
        floor = Floor(bake)
        for _ in bake:
            pass
        irradiance = bake.density.irradiance(floor.name, bake.done)[..., 0]
        spent = since(start)
        window = bake.density.textures[floor.name].windows[floor.key]
        number = floor.number
        chart = bake.tracer.charts[number]
        area = atlas.area(bake.tracer.parts, chart, number, window.low, window.texel, window.cells)
        return Traced(floor, bake.density, irradiance, area, bake.done, spent)


def path_traced(scene, samples, guiding, size, seed):
    """The floor's irradiance (height, width) by path tracing, seen from straight above, below the liquid; and Spent."""
    from nim_addon.cycles.render import pixels_of
    from nim_addon.figures.probes import set_up
    from nim_addon.scenes.pool import HALF

    camera, cycles = scene.camera, scene.cycles
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2 * HALF[0]
    camera.location, camera.rotation_euler = (0, 0, -0.3), (0, 0, 0)
    scene.render.resolution_x, scene.render.resolution_y = size
    cycles.samples, cycles.seed, cycles.use_guiding = samples, seed, guiding
    set_up(scene)
    start = now()
    pixels = pixels_of(scene)
    return math.pi * pixels[..., 0], since(start)

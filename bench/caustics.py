# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics traced from the sun beside path tracing, with and without guiding, and beside Mitsuba's particle tracer.

  python bench/caustics.py [--quick] [--truth 500] [--most 64] [--cells 512] [--parts speed paths kernels peers]

  speed    photons a second and peak memory, in the whole pool
  paths    how the error falls with time, and that of path tracing in equal time, for suns of 0.53, 2 and 10 degrees
  kernels  what is made of the same photons: a histogram, the estimate of Jensen's photon map, our kernels
  peers    Mitsuba's `ptracer` on water, its processor seconds and error for equally many photons

All but the speed is measured on one floor: the pool's liquid with its waves, a white floor that light leaves once, black
walls, nothing but the sun (figure 5.9 is measured there too). What is compared is the floor's irradiance in square cells,
`--cells` along its 8 m; the number depends on them, so some tables show three sizes. An error is the root of the mean
squared difference to a truth, over the mean of the truth. The truth is photons counted in the cells without a kernel, in
millions `--truth` (for the suns of 2 and 10 degrees an eighth of it), kept in `--cache`: a run that was stopped goes on.
Its own noise, known from its two independent halves, is subtracted from the mean squared difference.

A time holds all that a bake does: preparing the scene, the trial, the photons, the irradiance; of path tracing the whole
render. Processor seconds are those of all threads. Rendering until the error is 5 % is waited for with photons (between
two runs the error follows a power of the time); with path tracing it is extrapolated: its error falls as 1 / sqrt(time).
"""

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from white_floor import (
    LIQUIDS,
    THREADS,
    Spent,
    coarser,
    error,
    now,
    own_error,
    path_traced,
    since,
    traced,
    truth,
    white_floor,
)

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

SUNS = (0.53, 2.0, 10.0)
GOAL = 0.05
FINEST = 2  # times as many cells in the truth along an edge as are compared


# ------------------------------------------------------------------------------------------------------- the tables


def speed(options):
    """Photons a second and peak memory, each in a process of its own."""
    print("The whole pool under a sun of 0.53 degrees (a disk): bakes without what they put into the scene")
    print(f"{'':8}{'million photons':>16}{'clock s':>9}{'processor s':>13}{'photons/s of tracing':>26}{'peak MB':>9}")
    for liquid in LIQUIDS:
        for million in (options.memory, 8 * options.memory):
            command = [sys.executable, __file__, "--one", liquid, "--most", str(million)]
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
            measured = json.loads(done.stdout.strip().splitlines()[-1])
            print(
                f"{liquid:8}{million:16g}{measured['clock']:9.1f}{measured['processors']:13.1f}"
                f"{measured['rate']:26,.0f}{measured['peak']:9.0f}",
                flush=True,
            )


def one_bake(liquid, million):
    """What speed() asks of a process of its own."""
    import bpy

    from nim_addon import caustics
    from nim_addon.caustics import lights
    from nim_addon.scenes import pool

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = pool.build(pool.PoolParameters(liquid=LIQUIDS[liquid], sky="sunny", sun_angle=0.53), "nodes")
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    sun = lights.sun_of(scene)._replace(gaussian=False)
    start = now()
    with caustics.Bake(scene, [sun], photons=million * 1e6) as bake:
        for done in bake:
            if done == 1:  # before it lie a trial, and Cycles' own preparations
                before = now()
        tracing = since(before)
        for name in bake.density.textures:
            bake.density.irradiance(name, bake.done)
        total, sent = since(start), bake.photons * (bake.total - 1)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({**total._asdict(), "rate": sent / tracing.clock, "peak": peak}))


def paths(options):
    """Photons beside path tracing."""
    for sun in options.suns:
        for liquid in LIQUIDS:
            scene = white_floor(liquid, sun)
            share = 1 if sun == SUNS[0] else 8
            fine = truth(scene, f"{liquid}-{sun:g}", options.truth * 1e6 / share, options.cells * FINEST, options.cache)
            halves = coarser(fine, FINEST)
            size = halves.shape[:0:-1]
            edge = 8000 / size[0]
            print(
                f"\n{liquid}, sun of {sun:g} degrees; truth of {options.truth / share:g} million photons, in cells of",
                end="",
            )
            print(f" {edge:.1f} mm its own error is {own_error(halves):.2%}")
            wide = [f"{edge * times / FINEST:.1f} mm" for times in (1, 2, 4)]
            print(
                f"{'':26}{'clock s':>9}{'processor s':>13}   error in cells of {'':>3}"
                + "".join(f"{w:>10}" for w in wide)
            )
            curve = photon_rows(scene, fine, options)
            reached = to_goal(curve)
            print(f"  mean irradiance of the last over the truth's: {curve[-1].mean / halves.mean():.4f}")
            for guiding in (False, True):
                path_row(scene, halves, guiding, curve[-1], reached, options)


class Point(NamedTuple):
    """A point of a curve: what it took, its error in the cells that are compared, its mean irradiance."""

    spent: Spent
    error: float
    mean: float


def photon_rows(scene, fine, options):
    """Print a line for ever more photons, until the goal is reached; returns the Points."""
    curve, million = [], options.least
    while True:
        result = traced(scene, million * 1e6, 1)
        irradiance = result.floor.gathered(result.irradiance, result.density, fine.shape[2])
        errors = [error(coarser(irradiance, times), coarser(fine, times)) for times in (1, 2, 4)]
        line(f"{million:g} million photons", result.spent, errors)
        curve.append(Point(result.spent, errors[1], irradiance.mean()))
        million *= 4
        if errors[1] < GOAL or million > options.most:
            return curve


def line(name, spent, errors, rest=""):
    """Print one estimate."""
    cells = "".join(f"{share:>10.2%}" if share is not None else f"{'':10}" for share in errors)
    print(f"{name:26}{spent.clock:9.1f}{spent.processors:13.1f}{'':24}{cells}{rest}", flush=True)


def to_goal(curve):
    """Print and return the Spent until the error is GOAL, by the power of the time between the last two Points."""
    before, last = curve[-2:] if len(curve) > 1 else (curve[0], curve[0])
    word = "reached" if last.error <= GOAL < before.error else "less" if last.error <= GOAL else "extrapolated"
    ratio = 0.0
    if before.error > last.error > 0:
        ratio = math.log(before.error / GOAL) / math.log(before.error / last.error)
    spent = Spent(*(a * (b / a) ** ratio for a, b in zip(before.spent, last.spent, strict=True)))
    line("  time to 5 %, photons", spent, [None, GOAL, None], f"   {word}")
    return spent


def path_row(scene, halves, guiding, photons, reached, options):
    """Print the line of path tracing in the time that `photons` took."""
    name = "path tracing, guided" if guiding else "path tracing"
    size = halves.shape[:0:-1]
    few, more = (path_traced(scene, count, guiding, size, 7)[1].processors for count in (1, 5))
    samples = max(2, round(photons.spent.processors / max((more - few) / 4, 1e-3)))
    found, spent = path_traced(scene, min(samples, options.samples), guiding, size, 8)
    off = error(found, halves)
    line(
        f"{name}, {min(samples, options.samples)} spp", spent, [None, off, error(coarser(found, 2), coarser(halves, 2))]
    )
    goal = Spent(*(taken * (off / GOAL) ** 2 for taken in spent))
    ratio = Spent(*(a / b for a, b in zip(goal, reached, strict=True)))
    seconds = math.sqrt(max(np.mean((found - halves.mean(axis=0)) ** 2), 0)) / math.sqrt(found.size) / halves.mean()
    print(
        f"  time to 5 %, extrapolated: {goal.clock:,.0f} s, {goal.processors:,.0f} processor s: {ratio.clock:,.0f} and "
        f"{ratio.processors:,.0f} times the photons'; mean over the truth's {found.mean() / halves.mean():.4f} +- {seconds:.4f}",
        flush=True,
    )


def kernels(options):
    """What is made of the same photons."""
    print("\nOne set of photons, three estimates of the floor's irradiance (a sun of 0.53 degrees): their errors")
    for liquid in LIQUIDS:
        scene = white_floor(liquid, SUNS[0])
        fine = truth(scene, f"{liquid}-{SUNS[0]:g}", options.truth * 1e6, options.cells * FINEST, options.cache)
        edge = 8000 / fine.shape[2]
        wide = "".join(f"{edge * times:>9.1f}mm" for times in (1, 2, 4))
        print(f"{liquid + ', cells of':42}{wide}")
        for million in options.photons:
            result = traced(scene, million * 1e6, 1)
            for name, irradiance in estimates(result):
                found = result.floor.gathered(irradiance, result.density, fine.shape[2])
                errors = [error(coarser(found, times), coarser(fine, times)) for times in (1, 2, 4)]
                print(f"{f'{million:g} million, {name}':42}" + "".join(f"{off:>11.2%}" for off in errors), flush=True)


def estimates(result):
    """Names of estimates and their irradiance (H, W) a texel, of a Traced."""
    from nim_addon.caustics.density import ENOUGH

    density, floor, area = result.density, result.floor, result.area
    texture = density.textures[floor.name]
    window = texture.windows[floor.key]
    span = slice(texture.first, texture.first + texture.size)
    rows, columns = (slice(a, a + n) for a, n in zip(window.at[::-1], window.cells[::-1], strict=True))

    def here(values):
        return values[:, span].sum(axis=0).reshape(texture.shape)[rows, columns].astype(float)

    flux, count = here(density.flux[:, 0]) / result.passes, here(density.count)
    for name, found in (
        ("histogram of texels", np.divide(flux, area, out=np.zeros_like(flux), where=area > 0)),
        (f"photon map, the nearest {ENOUGH}", nearest(flux, count, area, ENOUGH)),
        (f"photon map, the nearest {4 * ENOUGH}", nearest(flux, count, area, 4 * ENOUGH)),
    ):
        whole = np.zeros(texture.shape)
        whole[rows, columns] = found
        yield name, whole
    yield "our kernels", result.irradiance


def nearest(flux, count, area, enough):
    """Power per area (H, W) as a photon map has it: about each texel the smallest box that holds `enough` photons."""
    from nim_addon.caustics.density import RADII

    answer, left = np.zeros_like(flux), area > 0
    for radius in RADII:
        power, held, ground = (boxes(values, radius) for values in (flux, count, area))
        here = left & ((held >= enough) | (radius == RADII[-1]))
        answer[here] = power[here] / ground[here]
        left &= ~here
    return answer


def boxes(values, radius):
    """Sums (H, W) over the square of that radius about each of the values, cut off at the edges."""
    table = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    table = np.pad(table, radius, mode="edge")
    wide = 2 * radius + 1
    rows = table[wide:] - table[:-wide]
    return rows[:, wide:] - rows[:, :-wide]


def peers(options):
    """Mitsuba's particle tracer beside ours, on water under a sun that is a point."""
    from nim_addon import caustics
    from nim_addon.caustics import lights
    from nim_addon.scenes import pool

    print("\nWater under a sun of 0 degrees, beside Mitsuba's particle tracer")
    if not options.peers_python:
        print(
            "Mitsuba is left out: make an environment with `pip install mitsuba numpy` and name its Python with "
            "--peers-python or NIM_PEERS_PYTHON (and libLLVM, 16 or newer, with DRJIT_LIBLLVM_PATH)."
        )
        return
    scene = white_floor("water", SUNS[0])
    light = [lights.Sun(tuple(-pool.TOWARDS_SUN), tuple(pool.SUN_IRRADIANCE), 0.0)]
    fine = truth(scene, "water-0", options.truth * 1e6 / 8, options.cells * FINEST, options.cache, light)
    halves = coarser(fine, FINEST)
    size = halves.shape[:0:-1]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "pool.npz")
        with caustics.Bake(scene, light) as bake:
            shot = next(light[0].shots(bake.tracer.target, 1 << 20, 1, np.random.default_rng(0)))
        np.savez(
            file, size=size, n=pool.PoolParameters(liquid="water").liquid.n, **beam(shot, light[0]), **shapes(scene)
        )
        try:
            peer = Mitsuba(file, options.peers_python)
        except OSError as error_:
            print(f"Mitsuba is left out: {error_}")
            return
        print(
            f"cells of {8000 / size[0]:.1f} mm; truth's own error {own_error(halves):.2%}; water's n^2 is divided out"
        )
        print(f"{'':40}{'clock s':>9}{'processor s':>13}{'photons/s':>12}{'error':>8}{'mean, of the truth':>20}")

        def show(name, photons, spent, found):
            off, mean = error(found, halves), found.mean() / halves.mean()
            print(
                f"{name:40}{spent.clock:9.1f}{spent.processors:13.1f}{photons / spent.clock:12,.0f}{off:8.2%}{mean:20.4f}",
                flush=True,
            )

        for million in options.photons:
            result = traced(scene, million * 1e6, 1, light)
            for name, irradiance in (next(estimates(result)), ("our kernels", result.irradiance)):
                found = result.floor.gathered(irradiance, result.density, size[0])
                show(f"{million:g} million, Cycles, {name}", million * 1e6, result.spent, found)
            found, spent = peer(million * 1e6, 1)
            show(f"{million:g} million, Mitsuba, its film", million * 1e6, spent, found)
            equal = million * 1e6 * result.spent.processors / spent.processors
            found, spent = peer(equal, 2)
            show(f"{equal / 1e6:.1f} million, Mitsuba, equal time", equal, spent, found)
        peer.close()


def beam(shot, sun):
    """Arrays by name of the rectangle that a lights.Shot of parallel rays starts from."""
    edges = shot.width * np.array(shot.size) / max(shot.size)
    return {"frame": np.array(shot.frame), "edges": edges, "irradiance": sun.irradiance[0]}


def shapes(scene):
    """Arrays by name of the triangles of liquid, floor, and all that is black."""
    from nim_addon.cycles import meshes

    answer = {}
    for object_ in (object_ for object_ in scene.objects if object_.type == "MESH"):
        mesh = object_.data
        vertices, triangles, corners = meshes.vertices(mesh), meshes.triangles(mesh), meshes.corners(mesh)
        slots = meshes.read(mesh.loop_triangles, "material_index", dtype=np.int32)
        normals = meshes.read(mesh.corner_normals, "vector", 3)
        word = object_.name.partition(".")[0].lower()
        at_vertices = np.zeros_like(vertices)
        at_vertices[corners] = normals
        kinds = {"liquid": slots >= 0} if word == "liquid" else {"floor": slots == 0, "walls": slots == 1}
        kinds = {"ground": slots >= 0} if word == "ground" else kinds
        for kind, mine in kinds.items():
            answer |= {f"{kind}_vertices": vertices, f"{kind}_faces": triangles[mine], f"{kind}_normals": at_vertices}
    return answer


class Mitsuba:
    """Mitsuba in a process of its own, which keeps its compiled kernels."""

    def __init__(self, file, python):
        command = [python, HERE / "mitsuba_pool.py", file, THREADS]
        self.log = tempfile.TemporaryFile("w+")  # noqa: SIM115 it lives as long as the process
        self.process = subprocess.Popen(
            list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True
        )
        if self.process.stdout.readline().strip() != "ready":
            self.log.seek(0)
            raise OSError((self.log.read().strip().splitlines() or ["it gave no reason"])[-1])

    def __call__(self, photons, seed):
        """The floor's irradiance (height, width), rows from -y, as Cycles counts it, and Spent."""
        self.process.stdin.write(f"{photons:.0f} {seed}\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        return np.load(answer["file"]), Spent(answer["clock"], answer["processors"])

    def close(self):
        """End the process."""
        self.process.stdin.close()
        self.process.wait()


PARTS = {"speed": speed, "paths": paths, "kernels": kernels, "peers": peers}


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small numbers, to see that it runs")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--suns", nargs="+", type=float, default=list(SUNS), metavar="DEGREES")
    parser.add_argument("--truth", type=float, metavar="MILLION", help="photons of the truth (500)")
    parser.add_argument("--least", type=float, metavar="MILLION", help="photons of the first bake (1)")
    parser.add_argument("--most", type=float, metavar="MILLION", help="photons of a bake at most (64)")
    parser.add_argument("--memory", type=float, metavar="MILLION", help="photons of the smaller bake of speed (4)")
    parser.add_argument("--photons", nargs="+", type=float, metavar="MILLION", help="for kernels and peers (1 16)")
    parser.add_argument("--cells", type=int, help="along the floor's 8 m, a multiple of 32 (512)")
    parser.add_argument("--samples", type=int, help="of path tracing at most (4096)")
    parser.add_argument("--cache", default=str(Path(tempfile.gettempdir(), "nim-bench")), metavar="DIR")
    parser.add_argument("--peers-python", default=os.environ.get("NIM_PEERS_PYTHON"))
    parser.add_argument("--one", choices=LIQUIDS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        one_bake(options.one, options.most)
        return
    usual = {"truth": 500, "least": 1, "most": 64, "memory": 4, "photons": [1, 16], "cells": 512, "samples": 4096}
    small = {"truth": 4, "least": 0.25, "most": 1, "memory": 0.5, "photons": [0.5], "cells": 256, "samples": 64}
    for name, value in (small if options.quick else usual).items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    if options.cells % 32 or min(options.truth, options.least, options.most, options.memory, *options.photons) <= 0:
        parser.error("take cells that are a multiple of 32, and photons above 0.")
    Path(options.cache).mkdir(parents=True, exist_ok=True)
    for part in options.parts:
        PARTS[part](options)


if __name__ == "__main__":
    main()

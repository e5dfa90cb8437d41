# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles with our closure beside Mitsuba 3 and POV-Ray 3.7, on the reference sphere: seconds x mean squared error.

  python bench/peers.py [--peers-python PYTHON] [--size 512] [--samples 64] [--rounds 5] [--kinds emit lit]

Mitsuba runs under a Python of its own (NIM_PEERS_PYTHON, or --peers-python) with the package `mitsuba` and, named by
DRJIT_LIBLLVM_PATH, LLVM 16 or newer; POV-Ray is the command `povray`. What is missing is said and left out.

Every program renders with two threads; set-up (scene, BVH, compiling) is not timed. Rounds alternate between the
programs, so that a busy machine is as busy for all of them; beside the clock stand processor seconds, which it troubles
less. Path tracers are unbiased (the last column says how far the block means are from the reference, and how far they
would be by chance): their mean squared error is their variance over the rounds' seeds, which needs no truth. POV-Ray
makes the same picture every time; its error, bias and all, is the mean product of its differences to independent
renders, whose own noise cancels. A cost is processor seconds x mean squared error.
"""

import argparse
import math
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from peer import Missing, Peer, Record

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

INDICES = (-1.5, 1.5)
THREADS = 2
# Mitsuba's default sampler, and the better one it has.
SAMPLERS = ("independent", "multijitter")
# Rays in a supersampled pixel of POV-Ray, along an edge, jittered; it takes them where neighbours differ by the
# threshold: the family that cost least of a dozen tried at 256 x 256, emit, n = -1.5.
POV_DEPTHS, POV_THRESHOLD, POV_LEVELS = (6, 8), 0.01, 20


class Cycles:
    """Our closure in Blender."""

    def __init__(self, n, kind, options):
        import bpy
        import reference_scene

        from nim_addon.base.streams import quiet

        with quiet():
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.render, self.samples = reference_scene.render, options.samples
        self.scene = reference_scene.build(n, kind == "lit", options.size, options.backend)
        self.adaptive = options.adaptive
        if self.adaptive:
            self.samples *= 2
            self.scene.cycles.adaptive_threshold, self.scene.cycles.adaptive_min_samples = self.adaptive, 16
        self.render(self.scene, 1, 0)

    def __call__(self, seed):
        """Pixels, seconds on the clock and on the processors. What one sample takes longer than a sample is set-up."""
        _, *one = self.render(self.scene, 1, seed)
        self.scene.cycles.use_adaptive_sampling = bool(self.adaptive)
        pixels, *all_of_them = self.render(self.scene, self.samples, seed)
        self.scene.cycles.use_adaptive_sampling = False
        scale = self.samples / (self.samples - 1)
        return pixels, *((a - b) * scale for a, b in zip(all_of_them, one, strict=True))


def mitsuba(sampler, options):
    """Mitsuba, which takes an index, a kind and a seed."""
    if not options.peers_python:
        raise Missing(
            "Mitsuba is left out: make an environment with `pip install mitsuba numpy` and name its Python "
            "with --peers-python or NIM_PEERS_PYTHON (and libLLVM, 16 or newer, with DRJIT_LIBLLVM_PATH)."
        )
    command = [options.peers_python, HERE / "mitsuba_scene.py", options.size, options.samples, THREADS, sampler]
    return Peer("Mitsuba", command)


def pov_ray(n, depth, options):
    """Pixels of POV-Ray, seconds on the clock and on the processors, as it counts them for tracing alone."""
    import OpenImageIO as oiio

    if not shutil.which("povray"):
        raise Missing("POV-Ray is left out: install POV-Ray 3.7, in Debian the package povray.")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "picture.exr")
        done = subprocess.run(
            [
                "povray",
                f"+I{HERE / 'sphere.pov'}",
                f"+O{file}",
                *("+FE", "File_Gamma=1.0", "-D", f"+W{options.size}", f"+H{options.size}", f"+WT{THREADS}"),
                *("+AM1", f"+A{POV_THRESHOLD}", f"+R{depth}", "+J1.0"),
                *(f"Declare=Index={n}", f"Declare=Levels={POV_LEVELS}"),
            ],
            capture_output=True,
            text=True,
        )
        times = re.search(
            r"Trace Time:.*?\(([\d.]+) seconds\)\s+using \d+ thread\(s\) with ([\d.]+)", done.stderr, re.S
        )
        if done.returncode or not times:
            raise Missing(f"POV-Ray is left out: {(done.stderr.strip().splitlines() or ['it gave no reason'])[-1]}")
        pixels = oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]
    return pixels, float(times[1]), float(times[2])


def bias(pictures, expected):
    """Rms of the mean picture's 32 x 32 blocks from the reference, and its standard error."""
    step = pictures[0].shape[0] // 32
    blocks = np.array([p.astype(float).reshape(32, step, 32, step, 3).mean((1, 3)) for p in pictures])
    error = math.sqrt(np.mean(blocks.var(0, ddof=1)) / len(blocks))
    return math.sqrt(np.mean((blocks.mean(0) - expected) ** 2)), error


def row(name, record, error, costs, clocks, rest):
    """Print one program's line."""
    print(
        f"{name:26}{statistics.median(record.clock):9.2f}{statistics.median(record.processors):13.2f}"
        f"{math.sqrt(max(error, 0)):9.5f}{statistics.median(costs):24.3f}{min(costs):7.3f}{max(costs):7.3f}"
        f"{statistics.median(clocks):14.3f}{rest}",
        flush=True,
    )


def compare(n, kind, peers, options):
    """Print the table of one index and kind."""
    ours = Cycles(n, kind, options)
    records = {"Cycles, NIM Interface": Record()} | {f"Mitsuba, {sampler}": Record() for sampler in peers}
    pov = {depth: Record() for depth in POV_DEPTHS} if kind == "emit" and options.pov else {}
    for seed in range(1, options.rounds + 1):
        records["Cycles, NIM Interface"].add(*ours(seed))
        for sampler, peer in peers.items():
            records[f"Mitsuba, {sampler}"].add(*peer(n, kind, seed))
        for depth, record in list(pov.items()):
            try:
                record.add(*pov_ray(n, depth, options))
            except Missing as missing:
                print(missing)
                del pov[depth]
    base = records["Cycles, NIM Interface"]
    expected = np.load(HERE.parent / "tests" / "data" / "reference_sphere.npz")[f"{kind} {n:+.1f}"]
    print(f"\n{kind}, n = {n:+.1f}: {options.size} x {options.size}, {options.samples} samples, {THREADS} threads")
    print(
        f"{'':26}{'clock s':>9}{'processor s':>13}{'rmse':>9}"
        f"{'our cost / its: median':>24}{'min':>7}{'max':>7}{'on the clock':>14}{'blocks off':>12}{'by chance':>11}"
    )
    for name, record in records.items():
        costs = [a * base.error / (b * record.error) for a, b in zip(base.processors, record.processors, strict=True)]
        clocks = [a * base.error / (b * record.error) for a, b in zip(base.clock, record.clock, strict=True)]
        off, error = bias(record.pictures, expected)
        row(name, record, record.error, costs, clocks, f"{off:12.5f}{error:11.5f}")
    for depth, record in pov.items():
        # its error scaled to ours, or ours to its, as errors scale with samples: inversely
        error = base.error_of(record.pictures[0])
        costs = [a * base.error / (b * error) for a, b in zip(base.processors, record.processors, strict=True)]
        clocks = [a * base.error / (b * error) for a, b in zip(base.clock, record.clock, strict=True)]
        off = bias(record.pictures, expected)[0]
        row(f"POV-Ray, {depth} x {depth}", record, error, costs, clocks, f"{off:12.5f}")


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-python", default=os.environ.get("NIM_PEERS_PYTHON"))
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--kinds", nargs="+", choices=("emit", "lit"), default=("emit", "lit"))
    parser.add_argument("--backend", default="osl", help="of our material (osl)")
    parser.add_argument(
        "--adaptive",
        type=float,
        metavar="THRESHOLD",
        help="let Cycles choose between 16 and twice the samples a pixel; it is then a little biased",
    )
    options = parser.parse_args()
    if options.rounds < 2 or options.size % 32 or options.samples < 2:
        parser.error("take at least 2 rounds and 2 samples, and a size that is a multiple of 32.")
    peers = {}
    for sampler in SAMPLERS:
        try:
            peers[sampler] = mitsuba(sampler, options)
        except Missing as missing:
            print(missing)
            break
    options.pov = bool(shutil.which("povray"))
    if not options.pov:
        print("POV-Ray is left out: install POV-Ray 3.7, in Debian the package povray.")
    for kind in options.kinds:
        for n in INDICES:
            compare(n, kind, peers, options)
    for peer in peers.values():
        peer.close()


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that disperse, beside our own stacks of wavelengths, Mitsuba 3 and LuxCore: processor seconds x mean squared error.

  python bench/spectrum.py [--peers-python PYTHON] [--size 64] [--samples 256] [--rounds 4] [--scenes ball lit prism]
                           [--media n-bk7 nim-mirror] [--out DIR]

Mitsuba and LuxCore run under a Python of their own (NIM_PEERS_PYTHON, or --peers-python) with the packages `mitsuba`,
`pyluxcore` and `numpy` and, named by DRJIT_LIBLLVM_PATH, LLVM 16 or newer. What is missing is said and left out.

The scenes are those of spectrum_scenes.py, all of them grey. Every program renders them with two threads and as many
samples in all, in a process of its own; set-up (scene, BVH, compiling) is not timed. Rounds alternate between the programs,
so that a busy machine is as busy for all of them. An error is to the closed form (prism) or to rays in double precision
(ball); that of the lit scene is the variance over the rounds' seeds. A cost is processor seconds x mean squared error in
linear sRGB, the ratios are of medians. `noise` is the variance alone, which misses what a program has wrong. The last
columns say how far the means of 8 x 8 pixels are from the truth, and how far they would be by chance.

The ball says little of dispersion: the line without it, whose error is to the same truth, says how little.
`--out DIR` keeps a picture of what each program makes of a scene, beside what must be seen.
"""

import argparse
import json
import math
import os
import statistics
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from peer import Missing, Peer, Record

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import spectrum_scenes  # noqa: E402 it needs the project, which is beside this folder

from nim_addon.physics.colour import encoded, into_gamut  # noqa: E402

THREADS, BLOCK = 2, 8
PLAIN, SINGLE, ALIKE, MITSUBA, LUXCORE = (
    "no dispersion",
    "single render",
    "wavelengths alike",
    "Mitsuba, multijitter",
    "LuxCore",
)
STRATA = ("strata, 8", "strata, 16")
OURS = {
    PLAIN: "plain",
    SINGLE: "single",
    ALIKE: "alike",
    STRATA[0]: "strata-8",
    STRATA[1]: "strata-16",
    "stack of 32": "stack",
}
PEERS = {
    "Mitsuba, independent": ("mitsuba_spectrum.py", "independent"),
    MITSUBA: ("mitsuba_spectrum.py", "multijitter"),
    LUXCORE: ("luxcore_spectrum.py", "SOBOL"),
}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB


def programs(options, job):
    """The Peers that start, by name; those that do not say why."""
    started = {name: Peer(name, [sys.executable, HERE / "spectrum_cycles.py", job, way]) for name, way in OURS.items()}
    if not options.peers_python:
        print(
            "Mitsuba and LuxCore are left out: make an environment with `pip install mitsuba pyluxcore numpy` and name its "
            "Python with --peers-python or NIM_PEERS_PYTHON (and libLLVM, 16 or newer, with DRJIT_LIBLLVM_PATH)."
        )
        return started
    for name, (program, sampler) in PEERS.items():
        try:
            started[name] = Peer(name, [options.peers_python, HERE / program, job, sampler])
        except Missing as missing:
            print(missing)
    return started


def measure(kind, medium, peers, options):
    """What each program makes of a scene, {name: Record}; those that end are taken out of `peers`."""
    records = {}
    for seed in range(1, options.rounds + 1):
        for name, peer in list(peers.items()):
            if name == LUXCORE and medium.startswith("nim"):
                continue  # it takes none
            try:
                rendered = peer(kind, medium, seed)
            except Missing as missing:
                print(missing, flush=True)
                del peers[name]
                records.pop(name, None)
                continue
            records.setdefault(name, Record()).add(*rendered)
    return records


class Measured:
    """What a program's Record comes to: `processors` seconds, the mean squared `error`, its `noise` alone (the variance over
    the seeds), how far its blocks are `off`, and how far they would be by `chance`; nan where there is no truth."""

    def __init__(self, record, truths):
        self.processors = statistics.median(record.processors)
        self.off, self.chance = math.nan, math.nan
        self.noise = record.error
        self.error = self.noise if truths is None else record.error_to(truths)
        if truths is not None:
            means = np.array([blocks(picture) for picture in record.pictures])
            own = np.mean(np.square(blocks(truths[0]) - blocks(truths[1]))) / 4  # the truth's, of the mean of two
            self.chance = math.sqrt(np.mean(means.var(0, ddof=1)) / len(means) + own)
            self.off = math.sqrt(np.mean(np.square(means.mean(0) - blocks(np.mean(truths, axis=0)))))

    @property
    def cost(self):
        """Processor seconds x mean squared error."""
        return self.processors * self.error


def blocks(picture):
    """The means of a picture's blocks."""
    count = picture.shape[0] // BLOCK
    return picture.astype(float).reshape(count, BLOCK, count, BLOCK, 3).mean((1, 3))


def table(kind, medium, records, truths, options):
    """Print a scene's table; returns {name: Measured}."""
    found = {name: Measured(record, truths) for name, record in records.items()}
    print(f"\n{kind}, {medium}: {options.size} x {options.size}, {options.samples} samples, {THREADS} threads")
    print(f"{'':22}{'processor s':>12}{'rmse':>9}{'noise':>9}{'cost / single':>15}{'blocks off':>12}{'by chance':>11}")
    for name, one in found.items():
        ratio = one.cost / found[SINGLE].cost if name != PLAIN else math.nan
        print(
            f"{name:22}{one.processors:12.3f}{math.sqrt(max(one.error, 0)):9.5f}{math.sqrt(one.noise):9.5f}{ratio:15.3f}"
            f"{one.off:12.5f}{one.chance:11.5f}",
            flush=True,
        )
    return found


def summary(found, records):
    """Print what there are goals for, of {scene and medium: {name: Measured}} and {...: {name: Record}}."""
    print(f"\n{'':22}" + "".join(f"{' '.join(key):>18}" for key in found))

    def line(text, ratio):
        values = [ratio(key) for key in found]
        print(f"{text:22}" + "".join(f"{'-' if value is None else f'{value:.3f}':>18}" for value in values), flush=True)

    def of_costs(ours, theirs):
        return lambda key: (
            found[key][ours].cost / found[key][theirs].cost if {ours, theirs} <= set(found[key]) else None
        )

    line("time, single / plain", lambda key: of_times(records[key].get(SINGLE), records[key].get(PLAIN)))
    for ours, theirs in [(SINGLE, ALIKE), *((name, SINGLE) for name in STRATA)]:
        line(f"{ours} / {'alike' if theirs == ALIKE else 'single'}", of_costs(ours, theirs))
    for ours in (SINGLE, *STRATA):
        line(f"{ours} / Mitsuba", of_costs(ours, MITSUBA))
        line(f"{ours} / LuxCore", of_costs(ours, LUXCORE))
        line(f"{'':10}by its noise", lambda key, ours=ours: of_noise(found[key].get(ours), found[key].get(LUXCORE)))


def of_noise(ours, theirs):
    """The ratio of costs where theirs is by its noise alone, as if it were right; None where one is missing."""
    return ours.cost / (theirs.processors * theirs.noise) if ours and theirs else None


def of_times(ours, theirs):
    """The median of the rounds' ratios of processor seconds; None where one is missing."""
    if ours is None or theirs is None:
        return None
    return statistics.median(a / b for a, b in zip(ours.processors, theirs.processors, strict=True))


def extent(picture):
    """How wide the spectrum of a prism is, in degrees: the scatter of its luminance across the middle rows, without that of
    the slit, and how far the middle of the blue is from that of the red."""
    size = len(picture)
    rows = picture[size * 7 // 16 : size * 9 // 16].mean(axis=0)  # higher up and lower down it is bent
    half = math.tan(math.radians(spectrum_scenes.VIEW / 2))
    places = np.degrees(np.arctan(half * (2 * (np.arange(size) + 0.5) / size - 1)))
    light = rows @ LUMINANCE
    middle = (light * places).sum() / light.sum()
    square = (light * (places - middle) ** 2).sum() / light.sum() - spectrum_scenes.SLIT**2 / 12
    red, _, blue = places @ rows / rows.sum(axis=0)
    return math.sqrt(max(square, 0)), abs(blue - red)


def widths(medium, records, truth):
    """Print how wide each program's spectrum is."""
    true = extent(truth)
    print(
        f"the spectrum of {medium}: scatter of its luminance, and how far its blue is from its red, in parts of the "
        f"{true[0]:.3f} and {true[1]:.3f} degrees that they must be"
    )
    for name, record in records.items():
        found = extent(np.mean(record.pictures, axis=0))
        print(f"{name:22}" + "".join(f"{a / b:12.3f}" for a, b in zip(found, true, strict=True)))


def keep(file, records, truth):
    """Write one picture of what each program made in its first round, beside the truth."""
    from matplotlib import pyplot

    pictures = ({} if truth is None else {"truth": truth}) | {
        name: record.pictures[0] for name, record in records.items()
    }
    figure, axes = pyplot.subplots(1, len(pictures), figsize=(1.8 * len(pictures), 2.1), layout="constrained")
    for axis, (name, picture) in zip(np.atleast_1d(axes), pictures.items(), strict=True):
        axis.imshow(encoded(into_gamut(picture)), interpolation="nearest")
        axis.set_title(name, fontsize=8)
        axis.set_axis_off()
    figure.savefig(file, dpi=150)
    pyplot.close(figure)
    print(file)


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-python", default=os.environ.get("NIM_PEERS_PYTHON"))
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--scenes", nargs="+", choices=spectrum_scenes.SCENES, default=spectrum_scenes.SCENES)
    parser.add_argument("--media", nargs="+", choices=spectrum_scenes.MEDIA, default=spectrum_scenes.MEDIA)
    parser.add_argument("--backend", default="osl", help="of our materials (osl)")
    parser.add_argument("--out", metavar="DIR", help="keep pictures in this folder")
    options = parser.parse_args()
    if options.rounds < 2 or options.size % BLOCK or options.samples < 64 or options.samples & (options.samples - 1):
        parser.error(
            f"take at least 2 rounds, a size that is a multiple of {BLOCK}, and a power of two of samples from 64 on."
        )
    if options.out:
        Path(options.out).mkdir(parents=True, exist_ok=True)
    found, records = {}, {}
    paths = [str(HERE.parent), os.environ.get("PYTHONPATH")]
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, paths))  # our ways to render are programs of their own
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder, "job.json")
        job.write_text(json.dumps(spectrum_scenes.job(SimpleNamespace(**vars(options), threads=THREADS))))
        peers = programs(options, job)
        for kind in options.scenes:
            for medium in options.media:
                key = (kind, medium)
                records[key] = measure(kind, medium, peers, options)
                truths = spectrum_scenes.truths(kind, medium, options.size)
                found[key] = table(kind, medium, records[key], truths, options)
                truth = None if truths is None else np.mean(truths, axis=0)
                if kind == "prism":
                    widths(medium, records[key], truth)
                if options.out:
                    keep(Path(options.out, f"{kind} {medium}.png"), records[key], truth)
        for peer in peers.values():
            peer.close()
    summary(found, records)


if __name__ == "__main__":
    main()

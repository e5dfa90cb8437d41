# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference sphere (tests/data/README.md) in Mitsuba 3. bench/peers.py runs this under the peers' Python.

  python mitsuba_scene.py SIZE SAMPLES THREADS SAMPLER

It says "ready". For each line "N KIND SEED" on its input ("-1.5 lit 7") it renders once and answers with one JSON line:
seconds of the rendering on the clock and on the processors, and the .npy file of the picture. An index above 0 is
Mitsuba's own `dielectric`, one below 0 our closure.
"""

import json
import resource
import sys
import tempfile
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

if mi.variant() is None:  # bench/mitsuba_spectrum.py has set its own
    mi.set_variant("llvm_ad_rgb")

SKY_HORIZON, SKY_ZENITH = (1.0, 0.9, 0.75), (0.25, 0.45, 0.9)
LIGHT, DARK, RED, BLUE = (0.8,) * 3, (0.2,) * 3, (0.8, 0.05, 0.05), (0.05, 0.1, 0.8)
BOUNCES = 64
SKY_ROWS = 2049  # over both hemispheres: the colour is linear in the elevation, so only the horizon's row is smoothed


class NIM(mi.BSDF):
    """A smooth interface of a medium of index n (mu is its sign) to vacuum: signed Snell, Fresnel by impedances."""

    def __init__(self, properties):
        mi.BSDF.__init__(self, properties)
        self.n = properties.get("n")
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [
            mi.BSDFFlags.DeltaReflection | sides,
            mi.BSDFFlags.DeltaTransmission | sides | mi.BSDFFlags.NonSymmetric,
        ]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def index(self, si):
        """The index inside."""
        return self.n

    def sample(self, context, si, sample1, sample2, active=True):
        """Reflect with the probability R, else transmit; the weight is 1."""
        cos = mi.Frame3f.cos_theta(si.wi)
        outside = cos > 0
        n = self.index(si)
        q = dr.select(outside, 1 / n, n)  # n_i / n_t
        z = abs(dr.select(outside, n, 1 / n))  # Z_i / Z_t
        c = dr.abs(cos)
        cos2_t = (1 - q * q) + q * q * c * c
        t = dr.safe_sqrt(cos2_t)
        r_s = (c - z * t) / (c + z * t)
        r_p = (z * c - t) / (z * c + t)
        R = dr.select(cos2_t > 0, 0.5 * (r_s * r_s + r_p * r_p), 1)
        reflected = (sample1 <= R) & active
        wi = si.wi
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(
            reflected,
            mi.Vector3f(-wi.x, -wi.y, wi.z),
            mi.Vector3f(-q * wi.x, -q * wi.y, dr.select(outside, -t, t)),
        )
        bs.pdf = dr.select(reflected, R, 1 - R)
        bs.eta = mi.Float(1)
        bs.sampled_component = dr.select(reflected, mi.UInt32(0), mi.UInt32(1))
        bs.sampled_type = dr.select(
            reflected, mi.UInt32(+mi.BSDFFlags.DeltaReflection), mi.UInt32(+mi.BSDFFlags.DeltaTransmission)
        )
        return bs, mi.Spectrum(1) & active

    def eval(self, context, si, wo, active=True):
        """Nothing: both directions are points."""
        return mi.Spectrum(0)

    def pdf(self, context, si, wo, active=True):
        """Nothing: both directions are points."""
        return mi.Float(0)

    def eval_pdf(self, context, si, wo, active=True):
        """Nothing: both directions are points."""
        return mi.Spectrum(0), mi.Float(0)


class Black(mi.BSDF):
    """Ends a path. Mitsuba's own black for emitters is a diffuse one: it would send a shadow ray from every hit."""

    def __init__(self, properties):
        mi.BSDF.__init__(self, properties)
        self.m_components = [mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide]
        self.m_flags = self.m_components[0]

    def sample(self, context, si, sample1, sample2, active=True):
        """Nothing."""
        return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0)

    def eval(self, context, si, wo, active=True):
        """Nothing."""
        return mi.Spectrum(0)

    def pdf(self, context, si, wo, active=True):
        """Nothing."""
        return mi.Float(0)

    def eval_pdf(self, context, si, wo, active=True):
        """Nothing."""
        return mi.Spectrum(0), mi.Float(0)


mi.register_bsdf("nim", NIM)
mi.register_bsdf("black", Black)


def sky():
    """A latitude-longitude image of the sky, rows from the zenith to the nadir."""
    elevation = np.clip(1 - 2 * (np.arange(SKY_ROWS) + 0.5) / SKY_ROWS, 0, None)[:, None]
    column = np.array(SKY_HORIZON) + (np.array(SKY_ZENITH) - np.array(SKY_HORIZON)) * elevation
    return np.repeat(column[:, None], 4, axis=1).astype(np.float32)


def build(n, lit, size, sampler):
    """The scene, to be rendered by mi.render."""

    def rgb(color):
        return {"type": "rgb", "value": list(color)}

    def opaque(color):
        if lit:
            return {"material": {"type": "diffuse", "reflectance": color}}
        return {"material": {"type": "black"}, "glow": {"type": "area", "radiance": color}}

    checks = {
        "type": "checkerboard",
        "color0": rgb(LIGHT),
        "color1": rgb(DARK),
        "to_uv": mi.ScalarTransform4f().scale([40, 40, 1]),
    }
    to_world = mi.ScalarTransform4f
    glass = {"type": "dielectric", "int_ior": n, "ext_ior": 1.0} if n > 0 else {"type": "nim", "n": n}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": BOUNCES + 1, "rr_depth": BOUNCES + 1},
            "sensor": {
                "type": "perspective",
                "fov": 40,
                "to_world": to_world().look_at(origin=[0, -6, 1.6], target=[0, 0, 1], up=[0, 0, 1]),
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "pixel_format": "rgb",
                    "component_format": "float32",
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": sampler},
            },
            "sky": {
                "type": "envmap",
                "bitmap": mi.Bitmap(sky()),
                "to_world": to_world().rotate([1, 0, 0], 90),
            },
            "ground": {"type": "rectangle", "to_world": to_world().scale([40, 40, 1]), **opaque(checks)},
            "sphere": {"type": "sphere", "center": [0, 0, 1], "radius": 1.0, "material": glass},
            "red": {"type": "sphere", "center": [0.5, 2.5, 0.6], "radius": 0.6, **opaque(rgb(RED))},
            "blue": {"type": "sphere", "center": [-0.9, -2.2, 0.35], "radius": 0.35, **opaque(rgb(BLUE))},
        }
    )


def processor_seconds():
    """Seconds of all threads so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main(size, samples, threads, sampler):
    """Answer the requests on the input until it ends."""
    dr.set_thread_count(int(threads) + 1)  # counts the calling thread, which only waits
    scenes = {}
    print("ready", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            n, kind, seed = line.split()

            def picture(key=(n, kind), seed=seed):
                image = mi.render(scenes[key], spp=int(samples), seed=int(seed))
                dr.eval(image)
                dr.sync_thread()
                return image

            if (n, kind) not in scenes:
                scenes[n, kind] = build(float(n), kind == "lit", int(size), sampler)
                picture(seed=0)  # compiles
            clock, processors = time.perf_counter(), processor_seconds()
            image = picture()
            clock, processors = time.perf_counter() - clock, processor_seconds() - processors
            file = Path(folder, "picture.npy")
            np.save(file, np.array(image))
            print(json.dumps({"clock": clock, "processors": processors, "file": str(file)}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

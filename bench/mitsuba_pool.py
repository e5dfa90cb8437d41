# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba's particle tracer on the pool's white floor. bench/caustics.py runs this under the peers' Python.

  python mitsuba_pool.py POOL.npz THREADS

It says "ready". For each line "PHOTONS SEED" on its input it traces once and answers with one JSON line: seconds of the
tracing on the clock and on the processors, and the .npy file of the floor's irradiance.
"""

import json
import math
import sys
import tempfile
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

from mitsuba_scene import processor_seconds  # noqa: E402 it sets the same variant

EYE, FLOOR, HALF = -0.3, -1.75, 4.0
DEPTH = 3  # from the sun to the liquid, to the floor, to the eye


def mesh(pool, kind, bsdf):
    """The triangles of that kind as a mi.Mesh."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(bsdf)
    vertices, faces = pool[f"{kind}_vertices"], pool[f"{kind}_faces"]
    smooth = kind == "liquid"
    made = mi.Mesh(kind, len(vertices), len(faces), has_vertex_normals=smooth, props=properties)
    values = mi.traverse(made)
    values["vertex_positions"], values["faces"] = vertices.ravel(), faces.ravel().astype(np.uint32)
    if smooth:
        values["vertex_normals"] = pool[f"{kind}_normals"].ravel()
    values.update()
    return made


def build(pool):
    """The scene."""
    to_world = mi.ScalarTransform4f
    width, height = (int(n) for n in pool["size"])
    across, along = pool["edges"] / 2
    frame = to_world(pool["frame"].tolist())
    white = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}}
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    # a camera looks along -z, a rectangle shines along +z
    turned = frame @ to_world().rotate([1, 0, 0], 180) @ to_world().scale([across, along, 1])
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "ptracer", "max_depth": DEPTH, "rr_depth": 100, "hide_emitters": True},
            "sensor": {
                "type": "perspective",
                "fov": 2 * math.degrees(math.atan(HALF / (EYE - FLOOR))),
                "near_clip": 0.01,
                "to_world": to_world().look_at(origin=[0, 0, EYE], target=[0, 0, FLOOR], up=[0, 1, 0]),
                "film": {
                    "type": "hdrfilm",
                    "width": width,
                    "height": height,
                    "pixel_format": "rgb",
                    "component_format": "float32",
                    "rfilter": {"type": "box"},
                },
            },
            "sun": {
                "type": "rectangle",
                "to_world": turned,
                "emitter": {
                    "type": "directionalarea",
                    "radiance": {"type": "rgb", "value": float(pool["irradiance"])},
                },
            },
            "liquid": mesh(pool, "liquid", {"type": "dielectric", "int_ior": float(pool["n"]), "ext_ior": 1.0}),
            "floor": mesh(pool, "floor", white),
            "walls": mesh(pool, "walls", {"type": "twosided", "bsdf": black}),
            "ground": mesh(pool, "ground", {"type": "twosided", "bsdf": black}),
        }
    )


def main(file, threads):
    """Answer the requests on the input until it ends."""
    dr.set_thread_count(int(threads) + 1)  # counts the calling thread, which only waits
    pool = np.load(file)
    scene = build(pool)
    cells = int(np.prod(pool["size"]))

    def picture(photons, seed):
        image = mi.render(scene, spp=max(1, round(photons / cells)), seed=seed)
        dr.eval(image)
        dr.sync_thread()
        return image

    picture(cells, 0)  # compiles
    print("ready", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            photons, seed = map(int, line.split())
            clock, processors = time.perf_counter(), processor_seconds()
            image = picture(photons, seed)
            clock, processors = time.perf_counter() - clock, processor_seconds() - processors
            # radiance of a white floor; within the liquid it is n^2 of what Cycles counts
            irradiance = math.pi * np.array(image)[::-1, :, 0] / pool["n"] ** 2
            target = Path(folder, "irradiance.npy")
            np.save(target, irradiance)
            print(json.dumps({"clock": clock, "processors": processors, "file": str(target)}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

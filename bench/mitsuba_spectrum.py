# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of bench/spectrum.py in Mitsuba 3, spectral. It runs this under the peers' Python.

  python mitsuba_spectrum.py JOB SAMPLER

JOB is the JSON that bench/spectrum.py writes (spectrum_scenes.job).
Mitsuba's `dielectric` takes no index that depends on the wavelength, so the surface is a closure of ours, of either sign.
A path carries four wavelengths there; all four are the first here, so that they share one direction.
"""

import json
import sys
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from answering import answer, timed

mi.set_variant("llvm_ad_spectral")

from mitsuba_scene import NIM, SKY_ROWS  # noqa: E402 with the variant that is set

CURVES = {}  # medium -> n at JOB's wavelengths, which are 1 nm apart


class Dispersive(NIM):
    """A smooth interface of a medium of n(lambda) to vacuum."""

    def __init__(self, properties):
        NIM.__init__(self, properties)
        self.first, curve = CURVES[properties["medium"]]
        self.last, self.curve = len(curve) - 1, mi.Float(curve)

    def index(self, si):
        """The index at the path's wavelength, on straight lines between the curve's points."""
        place = dr.clip(si.wavelengths[0] - self.first, 0, self.last)
        below = dr.minimum(mi.UInt32(place), self.last - 1)
        low, high = (dr.gather(mi.Float, self.curve, below + k) for k in (0, 1))
        return dr.lerp(low, high, place - mi.Float(below))


class OneWavelength(mi.SamplingIntegrator):
    """Mitsuba's path tracer with one wavelength a path: the first of the four, which then counts for all."""

    def __init__(self, properties):
        mi.SamplingIntegrator.__init__(self, properties)
        most = properties["most"]
        self.paths = mi.load_dict({"type": "path", "max_depth": most, "rr_depth": most})

    def sample(self, scene, sampler, ray, medium=None, active=True):
        """The light along a ray."""
        ray = mi.RayDifferential3f(ray)
        ray.wavelengths = type(ray.wavelengths)(ray.wavelengths[0])
        light, valid, _ = self.paths.sample(scene, sampler, ray, medium, active)
        return mi.Spectrum(4 * light[0], 0, 0, 0), valid, []


mi.register_bsdf("dispersive", Dispersive)
mi.register_integrator("one_wavelength", OneWavelength)


def daylight(radiance):
    """White light (D65) of that radiance."""
    return {"type": "d65", "scale": float(radiance)}


def grey(value):
    """A reflectance, the same at all wavelengths."""
    return {"type": "uniform", "value": float(value)}


def mesh(job, part, material):
    """The triangles of a part of the prism."""
    vertices, triangles = (np.array(array) for array in job[part])
    made = mi.Mesh(part, len(vertices), len(triangles), props=_props(material))
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = vertices.ravel().astype(np.float32)
    parameters["faces"] = triangles.ravel().astype(np.uint32)
    parameters.update()
    return made


def _props(material):
    properties = mi.Properties()
    for name, part in material.items():
        properties[name] = mi.load_dict(part)
    return properties


def prism(job, medium):
    """The slit, seen through a prism: all that is in the scene."""
    own = job["prisms"][medium]
    return {
        "slit": mesh(own, "slit", {"material": {"type": "black"}, "glow": {"type": "area", "radiance": daylight(1)}}),
        "glass": mesh(own, "faces", {"material": {"type": "dispersive", "medium": medium}}),
        "walls": mesh(own, "walls", {"material": {"type": "black"}}),
    }


def ball(job, medium, lit):
    """The ball over the chequered ground, with two more, under the sky."""
    to_world, ground = mi.ScalarTransform4f, [job["ground"], job["ground"], 1]

    def opaque(paint):
        light, color = paint
        if lit:
            return {"material": {"type": "diffuse", "reflectance": color}}
        return {"material": {"type": "black"}, "glow": {"type": "area", "radiance": light}}

    def checks(kind):
        values = {f"color{k}": kind(value) for k, value in enumerate(job["checks"])}
        return {"type": "checkerboard", **values, "to_uv": to_world().scale(ground)}

    def sphere(center, radius, **rest):
        return {"type": "sphere", "center": center, "radius": radius, **rest}

    elevation = np.clip(1 - 2 * (np.arange(SKY_ROWS) + 0.5) / SKY_ROWS, 0, None)
    horizon, zenith = job["sky"]
    sky = np.broadcast_to((horizon + (zenith - horizon) * elevation)[:, None, None], (SKY_ROWS, 4, 3))
    parts = {
        "sky": {
            "type": "envmap",
            "bitmap": mi.Bitmap(sky.astype(np.float32)),
            "to_world": to_world().rotate([1, 0, 0], 90),
        },
        "ground": {
            "type": "rectangle",
            "to_world": to_world().scale(ground),
            **opaque((checks(daylight), checks(grey))),
        },
        "sphere": sphere(*job["sphere"], material={"type": "dispersive", "medium": medium}),
    }
    for k, (center, radius, value) in enumerate(job["others"]):
        parts[f"other {k}"] = sphere(center, radius, **opaque((daylight(value), grey(value))))
    return parts


def build(job, kind, medium, sampler):
    """The scene, to be rendered by mi.render."""
    camera = job["cameras"][f"{kind} {medium}"]
    parts = prism(job, medium) if kind == "prism" else ball(job, medium, kind == "lit")
    up = [0, 0, 1]
    view = mi.ScalarTransform4f().look_at(origin=camera["eye"], target=camera["target"], up=up)
    film = {
        "type": "hdrfilm",
        "width": job["size"],
        "height": job["size"],
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "one_wavelength", "most": job["bounces"] + 1},
            "sensor": {
                "type": "perspective",
                "fov": camera["fov"],
                "to_world": view,
                "film": film,
                "sampler": {"type": sampler},
            },
            **parts,
        }
    )


def main(job, sampler):
    """Answer the requests on the input until it ends."""
    job = json.loads(Path(job).read_text())
    dr.set_thread_count(job["threads"] + 1)  # counts the calling thread, which only waits
    CURVES.update({name: (job["first_nm"], curve) for name, curve in job["curves"].items()})
    scenes = {}

    def picture(kind, medium, seed):
        first = (kind, medium) not in scenes
        if first:
            scenes[kind, medium] = build(job, kind, medium, sampler)

        def render():
            image = mi.render(scenes[kind, medium], spp=job["samples"], seed=seed)
            dr.eval(image)
            dr.sync_thread()
            return image

        if first:
            render()  # compiles
        image, *seconds = timed(render)
        return np.array(image), *seconds

    answer(lambda: picture)


if __name__ == "__main__":
    main(*sys.argv[1:])

# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of bench/spectrum.py in LuxCore, of positive media. It runs this under the peers' Python.

  python luxcore_spectrum.py JOB SAMPLER

JOB is the JSON that bench/spectrum.py writes (spectrum_scenes.job), SAMPLER the name of one of LuxCore's, such as SOBOL.
Its own glass takes n = A + B / lambda^2 (`cauchyb`).
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from answering import answer, timed

SKY_ROWS = 2049  # as in mitsuba_scene.py
ROUND, COARSE = 256, 64  # quads around the ball, and around those that shine: each triangle is a lamp there
VISIBLE_NM = (400, 700)  # over these the glass's curve is met


def cauchy(curve, first):
    """A and B, square micrometres, of n = A + B / lambda^2 nearest to a curve of one value a nanometre from `first`."""
    nanometres = np.arange(VISIBLE_NM[0], VISIBLE_NM[1] + 1)
    square = np.square(nanometres / 1000)
    n = np.array(curve)[nanometres - first]
    terms = np.stack([np.ones(len(n)), 1 / square], axis=-1)
    return np.linalg.lstsq(terms, n, rcond=None)[0]


def sphere(center, radius, around=ROUND):
    """A mesh of so many quads around: points (N, 3), triangles (M, 3) and normals (N, 3)."""
    v, u = np.meshgrid(
        np.linspace(0, np.pi, around // 2 + 1), np.linspace(0, 2 * np.pi, around + 1)[:-1], indexing="ij"
    )
    normals = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1).reshape(-1, 3)
    k, i = (a.ravel() for a in np.meshgrid(np.arange(around // 2), np.arange(around), indexing="ij"))
    a, b = k * around + i, k * around + (i + 1) % around
    triangles = np.concatenate([np.stack([a, a + around, b], -1), np.stack([b, a + around, b + around], -1)])
    return (np.array(center) + radius * normals), triangles, normals


class Scene:
    """A scene as it grows."""

    def __init__(self, lux, job, kind, medium):
        self.lux, self.scene, self.lit = lux, lux.Scene(), kind == "lit"
        self.words = {}
        camera = job["cameras"][f"{kind} {medium}"]
        row = 2 / job["size"]  # which its pictures are too low
        self.say(
            {
                "scene.camera.type": "perspective",
                "scene.camera.lookat.orig": camera["eye"],
                "scene.camera.lookat.target": camera["target"],
                "scene.camera.up": [0, 0, 1],
                "scene.camera.fieldofview": camera["fov"],
                "scene.camera.screenwindow": [-1, 1, -1 - row, 1 - row],
                "scene.camera.autofocus.enable": False,
                "scene.camera.lensradius": 0,
            }
        )
        A, B = cauchy(job["curves"][medium], job["first_nm"])
        self.say(
            {
                "scene.materials.glass.type": "glass",
                "scene.materials.glass.kr": [1, 1, 1],
                "scene.materials.glass.kt": [1, 1, 1],
                "scene.materials.glass.interiorior": float(A),
                "scene.materials.glass.cauchyb": float(B),
                "scene.materials.black.type": "mirror",
                "scene.materials.black.kr": [0, 0, 0],
            }
        )

    def say(self, words):
        """Set properties; Scene.done() has them read."""
        self.words.update(words)

    def done(self):
        """The scene for the renderer: read at once, since each reading makes its lamps anew."""
        properties = self.lux.Properties()
        for name, value in self.words.items():
            properties.Set(self.lux.Property(name, list(value) if isinstance(value, list | tuple) else [value]))
        self.scene.Parse(properties)
        return self.scene

    def add(self, name, material, points, triangles, normals=None, uv=None):
        """A mesh of a material."""
        listed = [None if part is None else [tuple(map(float, row)) for row in part] for part in (points, normals, uv)]
        faces = [tuple(map(int, row)) for row in triangles]
        self.scene.DefineMesh(name, listed[0], faces, listed[1], listed[2], None, None)
        self.say({f"scene.objects.{name}.shape": name, f"scene.objects.{name}.material": material})

    def opaque(self, name, paint):
        """A material that shines, or is lit, in a grey or in the colours of a texture; returns its name."""
        about = f"scene.materials.{name}"
        paint = paint if isinstance(paint, str) else [paint] * 3
        if self.lit:
            self.say({f"{about}.type": "matte", f"{about}.kd": paint})
        else:
            black = {f"{about}.type": "mirror", f"{about}.kr": [0, 0, 0]}
            self.say({**black, f"{about}.emission": paint, f"{about}.emission.gain": [1, 1, 1]})
        return name

    def ball(self, job):
        """The ball over the chequered ground, with two more, under the sky."""
        wide, (light, dark) = job["ground"], job["checks"]
        about = "scene.textures.checks"
        self.say(
            {
                f"{about}.type": "checkerboard2d",
                f"{about}.texture1": [light] * 3,
                f"{about}.texture2": [dark] * 3,
                f"{about}.mapping.type": "uvmapping2d",
                f"{about}.mapping.uvscale": [1, 1],
            }
        )
        corners = [(i * wide, j * wide) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        ground = [(*corner, 0) for corner in corners]
        self.add("ground", self.opaque("paved", "checks"), ground, [(0, 1, 2), (0, 2, 3)], None, corners)
        self.add("sphere", "glass", *sphere(*job["sphere"]))
        for k, (center, radius, grey) in enumerate(job["others"]):
            self.add(f"other{k}", self.opaque(f"paint{k}", grey), *sphere(center, radius, COARSE))
        elevation = np.clip(1 - 2 * (np.arange(SKY_ROWS) + 0.5) / SKY_ROWS, 0, None)
        horizon, zenith = job["sky"]
        rows = np.broadcast_to((horizon + (zenith - horizon) * elevation)[:, None, None], (SKY_ROWS, 4, 3))
        self.scene.DefineImageMap("sky", np.ascontiguousarray(rows, np.float32), 1.0, 3, 4, SKY_ROWS)
        self.say({"scene.lights.sky.type": "infinite", "scene.lights.sky.file": "sky"})

    def prism(self, own):
        """The slit, seen through a prism."""
        self.add("slit", self.opaque("light", 1.0), *own["slit"])
        self.add("faces", "glass", *own["faces"])
        self.add("walls", "black", *own["walls"])


def render(lux, scene, job, sampler, seed):
    """Pixels, and seconds on the clock and on the processors."""
    size = job["size"]
    properties = lux.Properties()
    for name, value in {
        "renderengine.type": "PATHCPU",
        "renderengine.seed": seed,
        "sampler.type": sampler,
        "sampler.sobol.adaptive.strength": 0.0,
        "native.threads.count": job["threads"],
        "film.width": size,
        "film.height": size,
        "film.filter.type": "NONE",
        "film.imagepipelines.0.0.type": "NOP",
        "batch.haltspp": job["samples"],
        "path.pathdepth.total": job["bounces"],
        "path.pathdepth.diffuse": job["bounces"],
        "path.pathdepth.glossy": job["bounces"],
        "path.pathdepth.specular": job["bounces"],
        "path.russianroulette.depth": job["bounces"],
        "path.clamping.variance.maxvalue": 0.0,
    }.items():
        properties.Set(lux.Property(name, [value]))
    session = lux.RenderSession(lux.RenderConfig(properties, scene))

    def run():
        session.Start()
        while not session.HasDone():
            time.sleep(0.01)
            session.UpdateStats()

    _, *seconds = timed(run)
    session.Stop()
    pixels = np.zeros((size, size, 3), np.float32)
    session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB_IMAGEPIPELINE, pixels, 0)
    return pixels[::-1], *seconds


def main(job, sampler):
    """Answer the requests on the input until it ends."""
    job = json.loads(Path(job).read_text())
    scenes = {}

    def start():
        import pyluxcore as lux  # which has much to say

        lux.Init()

        def picture(kind, medium, seed):
            if (kind, medium) not in scenes:
                made = Scene(lux, job, kind, medium)
                made.prism(job["prisms"][medium]) if kind == "prism" else made.ball(job)
                scenes[kind, medium] = made.done()
            return render(lux, scenes[kind, medium], job, sampler, seed)

        return picture

    answer(start)


if __name__ == "__main__":
    main(*sys.argv[1:])

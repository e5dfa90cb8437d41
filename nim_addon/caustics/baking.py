# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of small lights: photons, traced from the light, baked into what shines on the surfaces where they landed.

A surface that gets caustics is replaced by a copy that also shines with them; the light's own part of it, through
interfaces, is then left out of the path tracing, so that nothing is counted twice.
"""

import hashlib
import json
import math
import time
import zipfile
from pathlib import Path

import bpy
import numpy as np

from ..base.files import whole
from ..base.signals import interruptible
from ..cycles.material import asked_interfaces
from ..cycles.visibility import OWNER, as_rendered
from . import lights, placing
from .density import LEVELS, Density, layout
from .digest import digest
from .photons import ATTRIBUTE, Landed, Tracer, set_materials
from .placing import COLLECTION, SKY, baked, clear

DIGEST = "nim_caustics_of"  # of the collection: digest() of the scene that was traced
STANDING = "nim_caustics_standing"  # and a mark of placing.standing() as it was left
PHOTONS = 1 << 24
PASS = 1 << 20  # photons of a round
SAVING = 20  # seconds between two savings of a bake
PASSES = 64  # at least, of a light that a pass shows one point or one width of
TRIAL = 1 << 18  # photons by which the textures are laid out
NARROW = math.radians(10)  # a sun that is better traced than found by chance


class Bake:
    """A bake, pass by pass; with `with`, for it takes what it made to trace away at the end.

    scene:   bpy.types.Scene; nothing of it is changed before put(), which puts these caustics in the place of any others
    light:   None for the lamps of the scene and the sun of its sky (lights.sun_of), or a list of lights.Sun, Lamp or Area
             that nothing else in the scene stands for: lamps are made for what they shine on straight
    texels:  edge of the largest texture; photons: about how many in all; seed: of their noise
    most:    photons of one round, about, so that a window can answer in between
    for step in bake: one round, a pass of every light; bake.done of bake.total rounds are traced. Then put() at any time.
    Raises ValueError, one sentence: as photons.Tracer does, for a scene without a light, a light of a kind that is not
    traced or that stands in a medium, and from the first step on where no light lands.
    """

    def __init__(self, scene, light=None, *, texels=2048, photons=PHOTONS, seed=0, most=PASS):
        for name, value in (("photons", photons), ("texels", texels), ("most", most)):
            if value < 1:
                raise ValueError(f"{name} is {value}, but must be 1 or more.")
        self.scene, self.texels, self.seed, self.done = scene, texels, seed, 0
        self.sun = lights.sun_of(scene) if light is None else None
        if light is None:
            self.sources = [(self.sun, None)] if self.sun else []
            with as_rendered(scene) as depsgraph:
                lamps = lights.placed(scene, depsgraph)
            for lamp in lamps:
                lights.check(lamp.thing)
                self.sources.append((lights.light_of(lamp.thing, lamp.matrix), lamp))
        else:
            self.sources = [(one, None) for one in light]
        if not self.sources:
            raise ValueError("the scene has no light to trace; add a lamp: a sun, a point, a spot or an area.")
        each = max(64, math.ceil(photons / len(self.sources)))
        several = any(isinstance(one, lights.Area) or getattr(one, "gaussian", False) for one, _ in self.sources)
        self.total = max(PASSES if several else 2, math.ceil(photons / most))
        self.photons = math.ceil(each / self.total)
        self.density = None
        self.tracer = Tracer(scene)

    def __enter__(self):
        self.tracer.__enter__()
        try:
            for light, lamp in self.sources:
                if not isinstance(light, lights.Sun):
                    self.tracer.check_outside(lamp.thing.name if lamp else "of the bake", light.place)
            self.unlit = [self._unlit(lamp) for _, lamp in self.sources]
        except BaseException:
            self.tracer.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.tracer.__exit__()

    def __iter__(self):
        if self.density is None:
            self.density = self._laid_out()
        first = self.done
        rounds = zip(*(self._passes(number, first) for number in range(len(self.sources))), strict=True)
        for landed in rounds:
            for one in landed:
                self.density.add(one, self.done % 2)
            self.done += 1
            yield self.done

    def _passes(self, number, first):
        return self._trace(number, self.photons, self.total, seed=self.seed + 1 + number, first=first)

    def _trace(self, number, *given, **how):
        """Tracer.trace() of the light of that number, without what lands where light linking has it shine on nothing."""
        for landed in self.tracer.trace(self.sources[number][0], *given, **how):
            yield landed.only(~self.unlit[number][landed.chart]) if self.unlit[number].any() else landed

    def _unlit(self, lamp):
        """(charts,) whether a lights.Placed, or None for any light, leaves a chart out."""
        names = [chart.thing for chart in self.tracer.charts]
        if lamp is None:
            return np.zeros(len(names), bool)
        bending = lights.leaves_out(lamp.thing, self.tracer.benders)
        if bending:
            name = min(one.name for one in bending)
            raise ValueError(
                f"the lamp {lamp.thing.name} does not light {name}, which bends light, by its Light Linking, and such light is "
                f"not traced; let it light {name} too."
            )
        out = {one.name for one in lights.leaves_out(lamp.thing, set(self.scene.objects)) if not one.library}
        return np.array([name in out for name in names])

    def _laid_out(self):
        trial = []
        for number in range(len(self.sources)):
            trial += self._trace(number, TRIAL // 4, 4, seed=self.seed)
        if not sum(len(one.side) for one in trial):
            raise ValueError(
                "no light lands by way of an interface; let the lamps shine on the NIM, and it on something."
            )
        colors = np.array([placing.color(light) for light, _ in self.sources])
        alike = np.ptp(colors, axis=0).max() < 1e-6 and not self.tracer.bending.tinted
        names = ("side", "place", "power", "share")
        sample = Landed(*(np.concatenate([getattr(one, name) for one in trial]) for name in names))
        textures = layout(self.tracer.charts, sample, self.texels)
        return Density(self.tracer.parts, self.tracer.charts, textures, tuple(colors[0]) if alike else None)

    def put(self):
        """Put what has landed so far into the scene; returns the power that landed, as Cycles counts it, by object."""
        baked = []
        for name, texture in self.density.textures.items():
            copies = list(self._copies(name, texture))
            baked.append((name, copies, self.density.irradiance(name, self.done), placing.layers(texture)))
        clear(self.scene)
        try:
            self._replace(baked)
        except BaseException:  # nothing is left halfway between the scene and its caustics
            clear(self.scene)
            raise
        return self.density.power(self.done)

    def _replace(self, baked):
        collection = bpy.data.collections.new(COLLECTION)
        collection[OWNER], collection[DIGEST] = True, digest(self.scene)
        self.scene.collection.children.link(collection)
        for one in baked:
            placing.replace(self.scene, collection, *one)
        for light, lamp in self.sources:
            if lamp is None:
                placing.lamps(collection, light)
            else:
                placing.split(collection, lamp)
        if self.sun:
            collection[SKY] = self.scene.world
            placing.hide_sun(self.scene.world)
        collection[STANDING] = _standing(self.scene)

    def save(self, file):
        """Keep the state in a file (path), whole or not at all, for load()."""
        state = {"done": self.done, "mark": self._mark(), **self.density.state()}

        def write(part):
            with part.open("wb") as stream:
                np.savez(stream, **state)

        whole(file, write)

    def load(self, file):
        """Go on from a file that save() made of the same bake; returns whether there was one. Another's is left alone."""
        try:
            with np.load(file) as state:
                if str(state["mark"]) != self._mark():
                    return False
                self.density = Density(self.tracer.parts, self.tracer.charts, **Density.from_state(state))
                self.done = int(state["done"])
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            return False
        return True

    def _mark(self):
        of = [digest(self.scene), self.seed, self.photons, self.total, self.texels, bpy.app.version_string]
        of.append(
            [(chart.thing, chart.axis) for chart in self.tracer.charts]
        )  # sums are kept by their numbers and names
        return hashlib.sha256(json.dumps([*of, repr([light for light, _ in self.sources])]).encode()).hexdigest()

    def _copies(self, name, texture):
        """Meshes of an object, with the places of its windows in its texture, for either side, and the Part each is made of."""
        height, width = texture.shape
        for part in (part for part in self.tracer.parts if part.name == name):
            mesh = part.mesh.copy()
            set_materials(mesh, part.materials)
            mesh.attributes.remove(mesh.attributes[ATTRIBUTE])
            for back, level in placing.layers(texture):
                place = np.full((len(part.charts), 3), -1.0, np.float32)
                bounds = np.zeros((2, len(part.charts), 3), np.float32)
                for number in np.unique(part.charts):
                    window = texture.windows.get(LEVELS * (2 * number + back) + level) if number >= 0 else None
                    if window is None:
                        continue
                    mine = part.charts == number
                    flat = np.delete(part.corners[mine], self.tracer.charts[number].axis // 2, axis=1)
                    place[mine, :2] = ((flat - window.low) / window.texel + window.at) / (width, height)
                    # half a texel within, so that no neighbour shines through
                    bounds[0, mine, :2] = (window.at + 0.5) / (width, height)
                    bounds[1, mine, :2] = (window.at + window.cells - 0.5) / (width, height)
                for attribute, values in zip(placing.names(back, level), (place, *bounds), strict=True):
                    data = mesh.attributes.new(attribute, "FLOAT_VECTOR", "CORNER").data
                    data.foreach_set("vector", values.ravel())
            yield mesh, part


def bake(scene, light=None, *, progress=None, file=None, **options):
    """Trace the caustics of a scene's lights and put them into it; returns the power that landed, by object.

    scene, light, options: as for Bake; progress: called with (rounds done, rounds in all)
    file: None, or a path to keep the state in now and then: a bake that was killed goes on from there; gone at the end
    Raises as Bake does, and OSError where there is no folder for the file, or what is no file has its name.
    """
    if file and not Path(file).parent.is_dir():
        raise OSError(f"there is no folder {Path(file).parent} to keep the bake in; make it, or name another.")
    if file and Path(file).exists() and not Path(file).is_file():
        raise OSError(f"{file} is no file to keep the bake in; move it away, or name another.")
    with Bake(scene, light, **options) as one, interruptible():
        if file:
            one.load(file)
        if progress:
            progress(one.done, one.total)
        saved = time.monotonic()
        for done in one:
            if file and done < one.total and time.monotonic() - saved > SAVING:
                one.save(file)
                saved = time.monotonic()
            if progress:
                progress(done, one.total)
        power = one.put()
    if file:
        Path(file).unlink(missing_ok=True)
    return power


def best_way(scene):
    """ "traced" where the sun in the sky of `scene` is so narrow that a path tracer hardly meets it, else "path"."""
    sun = lights.sun_of(scene)
    bends = any(asked_interfaces(slot.material) for thing in scene.objects for slot in thing.material_slots)
    return "traced" if sun and sun.angle < NARROW and bends else "path"


def out_of_date(scene, meshes=None):
    """Whether `scene` has caustics of another shape, place, medium or light than it has now; `meshes` as for digest().

    Also where the copies that shine are not those that were put there, or stand elsewhere.
    """
    collection = baked(scene)
    if collection is None:
        return False
    now = _standing(scene)
    # an earlier version left no such mark
    return collection.get(STANDING, now) != now or collection.get(DIGEST) != digest(scene, meshes)


def _standing(scene):
    return hashlib.sha256(placing.standing(scene).encode()).hexdigest()

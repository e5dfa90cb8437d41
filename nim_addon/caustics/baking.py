# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of small lights: photons, traced from the light, baked into what shines on the surfaces where they landed.

A surface that gets caustics is replaced by a copy that also shines with them; the light's own part of it, through
interfaces, is then left out of the path tracing, so that nothing is counted twice.
"""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from ..base.files import whole
from ..base.signals import interruptible
from ..base.text import listed
from ..cycles.material import asked_interfaces
from ..cycles.visibility import CAUSTICS_MARK, as_rendered, shown
from . import lights, placing
from .density import Density, layout
from .digest import digest
from .photons import Landed, Tracer
from .placing import COLLECTION, SKY, baked, clear

# custom properties of the collection, in files that people have: they keep their names
DIGEST = "nim_caustics_of"  # digest() of the scene that was traced
REPORT = "nim_caustics_baked"  # what a person had baked: of how many photons, how large, and by which settings
STANDING = "nim_caustics_standing"  # a hash of placing.standing() as it was left
MILLION = 1_000_000  # photons in a person's unit
PHOTONS = 1 << 24
ROUND_PHOTONS = 1 << 20
SAVING = 20  # seconds between two savings of a bake
MANY_ROUNDS = 64  # at least, of a light of which each pass shows but one point, or one width
TRIAL_PHOTONS = 1 << 18  # by which the textures are laid out
NARROW = math.radians(10)  # a sun that is better traced than found by chance


class Source(NamedTuple):
    """A light that is traced, and the lamp of the scene that it is; None where it is none."""

    light: lights.Light
    lamp: lights.Placed | None


class Bake:
    """Caustics that are traced round by round, and can be put into the scene after any of them.

        with Bake(scene) as bake:
            for done in bake:  # a round: a pass of each light
                print(done, "of", bake.total)
            bake.put()

    scene:   nothing of it is changed before put(), which takes out the caustics that were there before
    light:   what shines. None for what does in the scene: its lamps, and the sun in its sky (lights.sun_of). Or a list of
             Lights that are not in the scene: put() then adds lamps as well, for what these light without an interface
    texels:  edge of the largest texture
    photons: about how many in all
    seed:    of their noise
    most:    photons of one round, about, so that a window can answer in between

    Leaving `with` takes away what was made to trace; what put() made stays.

    Raises ValueError, one sentence: as photons.Tracer does, for a scene without a light, a light of a kind that is not
    traced or that stands in a medium, and from the first step on where no light lands.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        light: Sequence[lights.Light] | None = None,
        *,
        texels: int = 2048,
        photons: int = PHOTONS,
        seed: int = 0,
        most: int = ROUND_PHOTONS,
    ):
        for name, value in (("photons", photons), ("texels", texels), ("most", most)):
            if value < 1:
                raise ValueError(f"{name} is {value}, but must be 1 or more.")
        self.scene, self.texels, self.seed, self.done = scene, texels, seed, 0
        self.sources = _sources(scene) if light is None else [Source(given, None) for given in light]
        self._of_sky = light is None and lights.sun_of(scene) is not None
        if not self.sources:
            dark = listed(obj.name for obj in scene.objects if obj.type == "LIGHT" and not obj.get(CAUSTICS_MARK))
            raise ValueError(
                f"the scene has no light to trace (hidden from renders, or without power: {dark}); let one shine in renders, "
                "or add a lamp: a sun, a point, a spot or an area."
                if dark
                else "the scene has no light to trace; add a lamp: a sun, a point, a spot or an area."
            )
        each = max(64, math.ceil(photons / len(self.sources)))
        many = any(isinstance(light, lights.Area) or getattr(light, "gaussian", False) for light, _ in self.sources)
        self.total = max(MANY_ROUNDS if many else 2, math.ceil(photons / most))
        self.photons = math.ceil(each / self.total)
        self.density: Density | None = None
        self.tracer = Tracer(scene)

    def __enter__(self) -> Bake:
        self.tracer.__enter__()
        try:
            for light, lamp in self.sources:
                if not isinstance(light, lights.Sun):
                    self.tracer.check_outside(lamp.lamp.name if lamp else "of the bake", light.place)
            self.unlit = [self._unlit(lamp) for _, lamp in self.sources]
        except BaseException:
            self.tracer.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        self.tracer.__exit__()

    def __iter__(self) -> Iterator[int]:
        if self.density is None:
            self.density = self._laid_out()
        first = self.done
        rounds = zip(*(self._passes(number, first) for number in range(len(self.sources))), strict=True)
        for passes in rounds:
            for landed in passes:
                self.density.add(landed, self.done % 2)
            self.done += 1
            yield self.done

    def _passes(self, number, first):
        return self._trace(number, self.photons, self.total, seed=self.seed + 1 + number, first=first)

    def _trace(self, number, *given, **how):
        """Tracer.trace() of the light of that number, without what lands where light linking has it shine on nothing."""
        for landed in self.tracer.trace(self.sources[number].light, *given, **how):
            yield landed.only(~self.unlit[number][landed.chart]) if self.unlit[number].any() else landed

    def _unlit(self, placed):
        """(charts,) whether a lights.Placed, or None for any light, leaves a chart out."""
        names = [chart.name for chart in self.tracer.charts]
        if placed is None:
            return np.zeros(len(names), bool)
        bending = lights.leaves_out(placed.lamp, self.tracer.benders)
        if bending:
            name = min(obj.name for obj in bending)
            raise ValueError(
                f"the lamp {placed.lamp.name} does not light {name}, which bends light, by its Light Linking, and such light "
                f"is not traced; let it light {name} too."
            )
        out = {obj.name for obj in lights.leaves_out(placed.lamp, self.scene.objects) if not obj.library}
        return np.array([name in out for name in names])

    def _laid_out(self):
        """An empty Density, its textures laid out by a trial."""
        trial = []
        for number in range(len(self.sources)):
            trial += self._trace(number, TRIAL_PHOTONS // 4, 4, seed=self.seed)
        if not sum(len(landed.side) for landed in trial):
            raise ValueError(
                "no light lands by way of an interface; let the lamps shine on the NIM, and it on something."
            )
        colors = np.array([placing.color(light) for light, _ in self.sources])
        alike = np.ptp(colors, axis=0).max() < 1e-6 and not self.tracer.bending.tinted
        alike &= self.tracer.wavelengths is None
        names = ("side", "place", "power", "share", "nm")
        sample = Landed(*(np.concatenate([getattr(landed, name) for landed in trial]) for name in names))
        textures = layout(self.tracer.charts, sample, self.texels)
        return Density(self.tracer.parts, self.tracer.charts, textures, tuple(colors[0]) if alike else None)

    def put(self) -> dict[str, float]:
        """Put what has landed so far into the scene, once a round is done.

        Returns the power that landed, as Cycles counts it: {name of the object: sum of its colours, W}.
        """
        density = self.density
        shining = []
        for name, texture in density.textures.items():
            copies = list(placing.copies(self.tracer.parts, self.tracer.charts, name, texture))
            shining.append((name, copies, density.irradiance(name, self.done), placing.layers(texture)))
        clear(self.scene)
        try:
            self._replace(shining)
        except BaseException:  # nothing is left halfway between the scene and its caustics
            clear(self.scene)
            raise
        return density.power(self.done)

    def _replace(self, shining):
        """Put copies, as the arguments of placing.replace() tell of them, in the place of what they are copies of."""
        collection = bpy.data.collections.new(COLLECTION)
        collection[CAUSTICS_MARK], collection[DIGEST] = True, digest(self.scene)
        self.scene.collection.children.link(collection)
        for surface in shining:
            placing.replace(self.scene, collection, *surface)
        for light, lamp in self.sources:
            if lamp is None:
                placing.lamps(collection, light)
            else:
                placing.split(collection, lamp)
        world = self.scene.world
        if self._of_sky and world:
            collection[SKY] = world
            placing.hide_sun(world)
        collection[STANDING] = _standing(self.scene)

    def save(self, file: str | Path) -> None:
        """Keep the state, once a round is done, in a file, whole or not at all, for load()."""
        state = {"done": self.done, "mark": self._mark(), "names": self._names(), **self.density.state()}

        def write(part):
            with part.open("wb") as stream:
                np.savez_compressed(stream, **state)  # most of a texture is dark

        whole(file, write)

    def load(self, file: str | Path) -> bool:
        """Go on from a file that save() made of the same bake; returns whether there was one. Another's is left alone."""
        try:
            with np.load(file) as held:
                state = dict(held)
        except Exception:  # zip, zlib, and numpy's reader of heads each have their own for what is damaged
            return False
        try:
            former = list(map(str, state["names"])) if "names" in state else None  # earlier versions kept none
            if str(state["mark"]) != self._mark(named=former is None):
                return False
            of = Density.from_state(state)
            if former:  # what is appended to another file may have other names there
                now = dict(zip(former, self._names(), strict=True))
                of["textures"] = {now[name]: texture for name, texture in of["textures"].items()}
            self.density = Density(self.tracer.parts, self.tracer.charts, **of)
            self.done = int(state["done"])
        except (ValueError, KeyError, TypeError):
            return False
        return True

    def _names(self):
        return [chart.name for chart in self.tracer.charts]

    def _mark(self, *, named=False):
        """A mark of this bake; named: as earlier versions made it, with the names of objects in it."""
        # sums are kept by the numbers of charts, which must be in the same order
        charts = [
            (chart.name, chart.axis) if named else (chart.axis, *(f"{x:.3g}" for x in (*chart.low, *chart.high)))
            for chart in self.tracer.charts
        ]
        of = [digest(self.scene), self.seed, self.photons, self.total, self.texels, charts]
        return hashlib.sha256(json.dumps([*of, repr([light for light, _ in self.sources])]).encode()).hexdigest()


def _sources(scene):
    """What shines in a scene: the sun of its sky first, then its lamps."""
    sun = lights.sun_of(scene)
    found = [Source(sun, None)] if sun else []
    with as_rendered(scene) as depsgraph:
        placed = lights.placed(scene, depsgraph)
    for lamp in placed:
        lights.check(lamp.lamp)
        found.append(Source(lights.light_of(lamp.lamp, lamp.matrix), lamp))
    return found


def bake(
    scene: bpy.types.Scene,
    light: Sequence[lights.Light] | None = None,
    *,
    progress: Callable[[int, int], object] | None = None,
    file: str | Path | None = None,
    **options,
) -> dict[str, float]:
    """Trace the caustics of a scene's lights and put them into it; returns the power that landed, as Bake.put() does.

    scene, light, options: as for Bake
    progress: called with (rounds done, rounds in all)
    file: where to keep the state now and then: a bake that was killed goes on from there; gone at the end

    Raises as Bake does, and OSError where there is no folder for the file, or what is no file has its name.
    """
    if file and not Path(file).parent.is_dir():
        raise OSError(f"there is no folder {Path(file).parent} to keep the bake in; make it, or name another.")
    if file and Path(file).exists() and not Path(file).is_file():
        raise OSError(f"{file} is no file to keep the bake in; move it away, or name another.")
    with Bake(scene, light, **options) as baking, interruptible():
        if file:
            baking.load(file)
        if progress:
            progress(baking.done, baking.total)
        saved = time.monotonic()
        for done in baking:
            if file and done < baking.total and time.monotonic() - saved > SAVING:
                baking.save(file)
                saved = time.monotonic()
            if progress:
                progress(done, baking.total)
        power = baking.put()
    if file:
        Path(file).unlink(missing_ok=True)
    return power


def best_way(scene: bpy.types.Scene) -> str:
    """ "traced" where the sun in the sky of `scene` is so narrow that a path tracer hardly meets it, else "path"."""
    sun = lights.sun_of(scene)
    if sun is None or sun.angle >= NARROW:
        return "path"
    with as_rendered(scene) as depsgraph:
        worn = {material for surface in shown(scene, depsgraph) for material in surface.materials}
    return "traced" if any(map(asked_interfaces, worn)) else "path"


def out_of_date(scene: bpy.types.Scene, marks: dict | None = None) -> bool:
    """Whether a scene has caustics of another shape, place, medium or light than it has now; `marks` as for digest().

    Also where the copies that shine are not those that were put there, or stand elsewhere.
    """
    collection = baked(scene)
    if collection is None:
        return False
    now = _standing(scene)
    # an earlier version left no such mark
    return collection.get(STANDING, now) != now or collection.get(DIGEST) != digest(scene, marks)


def _standing(scene):
    return hashlib.sha256(placing.standing(scene).encode()).hexdigest()

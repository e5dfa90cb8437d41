# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked for: which render, and how. It is checked as it is made, and written as JSON that is read back the same."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Self, TypeVar

import bpy

from .. import caustics
from ..base.options import MOST_SEED
from ..base.text import in_any_case
from ..base.version import VERSION
from ..cycles.images import read_metadata
from ..scenes import SCENES, SceneType, scene_type
from ..scenes.parameters import Parameters, file_name, switched
from ..scenes.stage import SAMPLES, Pose
from .blends import Blend
from .changes import change_of, code_mark
from .values import CHECKS, RECORDED, version_numbers

OPEN_IN_A_BLEND = ("size", "samples", "seed", "denoise")  # what the file decides where the request does not
OF_A_SCENE = ("scene", "parameters", *OPEN_IN_A_BLEND)  # what the record of every render of a scene has
OF_A_STACK = ("wavelengths", "region")  # what the record of a stack.Stack has beside its request's

Value = TypeVar("Value")


class NoPhotons(ValueError):
    """Photons were asked for where caustics are not traced."""


@dataclass(frozen=True)
class Asked:
    """A render of one of our scenes, or of a scene of a .blend file; None is as the scene, or the file, has it.

    scene:      name of one of scenes.SCENES, or of those OF_FIGURES
    parameters: that scene's Parameters; the usual ones where left out
    blend:      a blends.Blend in the place of both
    size:       (width, height) in pixels
    samples:    paths a pixel
    seed:       of the noise, the photons' too
    backend:    of the materials: "osl", "nodes", or "auto", OSL where this Blender has it
    denoise:    whether the picture is cleaned of its noise
    keep_noise: whether the EXR, to be measured, is not cleaned with it
    caustics:   "traced" from the lights or found by "path" tracing; None: as suits the scene, or as a .blend has them
    photons:    about how many are traced
    texels:     edge of the largest texture that they are baked into; None: as suits their number
    frame:      of the animation of a .blend
    spectral:   whether all wavelengths are in it: media disperse, and what glows has their colours
    spectral_passes: renders, each of a part of the wavelengths, whose mean is the spectral picture; None: as suits samples
    wavelength: the only one that is in it, nanometres; None: media as at 550, or all where it is spectral
    inputs:     of a .blend: (MATERIAL:INPUT, number) of its interface nodes, in place of what stands there
    pose:       a scenes.stage.Pose of the camera in place of the scene's own
    change:     name of a function that changes the scene once it is built, as changes.register() has it
    code:       the mark of the code that is to render it, changes.code_mark(), where that matters
    Raises ValueError, one sentence, for values that no render has, NoPhotons for photons where caustics are not traced.
    """

    scene: str | None = None
    parameters: Parameters | None = None
    _: KW_ONLY
    blend: Blend | None = None
    size: tuple[int, int] | None = None
    samples: int | None = None
    seed: int | None = None
    backend: str = "auto"
    denoise: bool | None = None
    caustics: str | None = None
    photons: int | None = None
    texels: int | None = None
    frame: int | None = None
    keep_noise: bool = False
    spectral: bool = False
    spectral_passes: int | None = None
    wavelength: float | None = None
    inputs: tuple[tuple[str, float], ...] | None = None
    pose: Pose | None = None
    change: str | None = None
    code: str | None = None

    def __post_init__(self) -> None:
        if (self.scene is None) == (self.blend is None):
            raise ValueError("a render is of a scene or of a .blend; give one of them.")
        if self.scene is not None:
            self._fill_in(scene_type(self.scene, of_figures=True))
        elif self.parameters is not None or self.backend != "auto":
            raise ValueError("a .blend has its own parameters and backend; leave them out.")
        if self.caustics == "traced" and self.photons is None:
            self._set("photons", caustics.PHOTONS)
        for key, check in CHECKS.items():
            if (value := getattr(self, key)) is not None:
                self._set(key, check(key, value))
        if self.photons and self.caustics == "path":
            raise NoPhotons("photons are for caustics that are traced; leave them out.")
        if self.spectral and self.wavelength is not None:
            raise ValueError("a spectral render has all wavelengths; leave the one out, or leave spectral out.")
        if self.spectral_passes is not None:
            self._check_passes(self.spectral_passes)
        if self.change:
            change_of(self.change)

    def _check_passes(self, passes):
        if self.scene and not self.spectral:
            raise ValueError("spectral passes are of a spectral render; leave them out, or let it be one.")
        if self.samples and self.samples % passes:
            raise ValueError(
                f"{self.samples} samples make no {passes} spectral passes of equal length; give fewer passes, or a number of "
                f"samples such as {-(-self.samples // passes) * passes}."
            )

    def _fill_in(self, type_: SceneType) -> None:
        parameters = type_.parameters() if self.parameters is None else self.parameters
        if not isinstance(parameters, type_.parameters):
            raise ValueError(
                f"{parameters!r} are no parameters of the {type_.name}; give {type_.parameters.__name__}()."
            )
        if self.inputs:
            raise ValueError(f"inputs are of the materials of a .blend; the {type_.name} has parameters instead.")
        if self.frame is not None:
            raise ValueError(f"frame is of the animation of a .blend; the {type_.name} has parameters instead.")
        usual = {"size": type_.size, "samples": SAMPLES, "seed": 0, "denoise": False}
        for key, value in usual.items():
            if getattr(self, key) is None:
                self._set(key, value)
        self._set("parameters", parameters)

    def _set(self, key, value):
        object.__setattr__(self, key, value)

    @classmethod
    def of(cls, scene: str, settings: Mapping[str, object] | Iterable[str] = (), **options) -> Self:
        """A request for the scene of a name, in any case, with settings: a dict, or texts "key=value"; options as above.

        Every scene has the setting `spectral` beside its own.
        """
        type_ = scene_type(in_any_case(scene, SCENES))
        values = dict(settings) if isinstance(settings, Mapping) else type_.parameters.assigned(settings)
        if "spectral" in values:
            options["spectral"] = switched("spectral", values.pop("spectral"))
        return cls(type_.name, type_.parameters.of(values), **options)

    @classmethod
    def of_blend(cls, file: str | Path, scene: str | None = None, **options) -> Self:
        """A request for a scene of a .blend file, which may be left out where there is only one; options as above."""
        return cls(blend=Blend.of(file, scene), **options)

    @property
    def name(self) -> str:
        """What its files are called where nobody says: the scene and its settings, or the .blend."""
        if self.blend:
            return Path(self.blend.file).stem
        return file_name(known(self.scene), known(self.parameters).assignments() + ["spectral=yes"] * self.spectral)

    @property
    def moves(self) -> bool:
        """Whether it is of a scene that has a time."""
        return self.parameters is not None and "time" in self.parameters.plain()

    def sequence(self, first: int, last: int, fps: float) -> dict[int, Self]:
        """The requests for the frames `first` to `last` of a scene that moves, each with a noise of its own.

        Frame 1 shows it at its parameter `time`. Raises ValueError, one sentence, for a scene in which nothing moves, and
        for a time out of its range.
        """
        if self.parameters is None or not self.moves:
            raise ValueError(f"nothing moves in the {self.scene or self.name}; a sequence is of the pool or the sea.")
        values = self.parameters.plain()
        return {
            frame: dataclasses.replace(
                self,
                parameters=self.parameters.of({**values, "time": float(values["time"]) + (frame - 1) / fps}),
                seed=(known(self.seed) + frame) % (MOST_SEED + 1),
            )
            for frame in range(first, last + 1)
        }

    # -------------------------------------------------------------------------------------------- as JSON

    def record(self) -> dict:
        """A dict of JSON-ready values that from_record() takes back; what is left open is left out."""
        plain = {} if self.blend else known(self.parameters).plain()
        of = {"blend": self.blend.record()} if self.blend else {"scene": self.scene, "parameters": plain}
        values = {key: getattr(self, key) for key in CHECKS if getattr(self, key) is not None}
        values = {key: value for key, value in values.items() if value or key not in ("keep_noise", "spectral")}
        plain = {key: _plain(value) for key, value in values.items()}
        return {"nimray": VERSION, **of, **plain, "blender": bpy.app.version_string}

    @classmethod
    def from_record(cls, record: Mapping[str, object], source: str = "the record") -> Self:
        """The request of a record(), or of an image that an earlier version made, checked as strictly as any other.

        source: what it was read from, which the sentences name
        Raises ValueError, one sentence, for a record that no render has, and for one of a later version or of other code.
        """
        missing = {"nimray", "blender", *(("blend",) if "blend" in record else OF_A_SCENE)} - set(record)
        if missing:
            raise ValueError(f"{source} does not record its {', '.join(sorted(missing))}, so it cannot be repeated.")
        if version_numbers(record["nimray"]) > version_numbers(VERSION):
            raise ValueError(
                f"{source} was made by nimray {record['nimray']}, and this is {VERSION}; repeat it with that one."
            )
        values = {}
        for key, value in record.items():
            try:
                values[key] = RECORDED[key](key, value)
            except (KeyError, ValueError):
                raise ValueError(
                    f"{source} records {key} = {value!r}, which no render has, so it cannot be repeated."
                ) from None
        if "code" in values and values["code"] != code_mark(changed="change" in values):
            raise ValueError(f"{source} is of other code than this; repeat it with that one.")
        of = _source_of(values, source)
        try:
            return cls(**of, **{key: values[key] for key in CHECKS if key in values})
        except ValueError as error:
            raise ValueError(f"{source}: {error}") from None

    @classmethod
    def again(cls, image: str | Path) -> tuple[Self, dict]:
        """The request that made an image (EXR or PNG), and its record.

        Raises FileNotFoundError, and ValueError, one sentence, for what is no image of ours, or not one render.
        """
        record = read_metadata(image)
        if "compares" in record:
            images = record["images"] if isinstance(record.get("images"), list) else []
            raise ValueError(
                f"{image} is a comparison, not one render; repeat one of its images: "
                f"{', '.join(f'{name}.exr' for name in images)}."
            )
        if "code" in record:
            raise ValueError(f"{image} is a part of a figure; repeat it with `nimray figures`.")
        return cls.from_record({key: record[key] for key in record if key not in OF_A_STACK}, str(image)), record


def known(value: Value | None) -> Value:
    """A value that a request of its kind always has."""
    assert value is not None
    return value


def _plain(value):
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _source_of(values, source):
    """The scene with its parameters, or the .blend, that a checked record is of."""
    if "blend" in values:
        try:
            return {"blend": Blend.from_record(values["blend"])}
        except ValueError as error:
            raise ValueError(f"{source}: {error}") from None
    type_ = scene_type(in_any_case(values["scene"], SCENES), of_figures=True)
    try:
        return {"scene": type_.name, "parameters": type_.parameters.of(values["parameters"])}
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None

# SPDX-License-Identifier: GPL-3.0-or-later
"""A render as a value: what is rendered and how. It is checked as it is made, written as JSON, and known by its content."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import NamedTuple, TypeVar

import bpy

from .. import caustics
from ..base.files import writable_folder
from ..base.options import MOST_SEED
from ..base.text import in_any_case
from ..base.version import VERSION
from ..cycles import render
from ..cycles.images import read_metadata, record_of
from ..cycles.material import resolve
from ..scenes import SCENES, SceneType, scene_type
from ..scenes.parameters import Parameters, file_name
from ..scenes.stage import SAMPLES, Pose, aim
from .blends import Blend, sha256_of
from .changes import change_of, code_mark
from .temporary import TemporaryScene
from .values import CHECKS, RECORDED, version_numbers

FEW_PHOTONS = 1 << 20  # fewer than these are baked into small textures
TEXELS = 512, 2048  # edges of the largest texture, of few photons and of many
OPEN_IN_A_BLEND = ("size", "samples", "seed", "denoise")  # what the file decides where the request does not
OF_A_SCENE = ("scene", "parameters", *OPEN_IN_A_BLEND)  # what the record of every render of a scene has

# From the name of an image and its samples, or from its samples and photons: what render(), or bake(), reports to.
Showing = Callable[[str, int], AbstractContextManager[Callable[[int, int, float | None], None] | None]]
Tracing = Callable[[int, int], AbstractContextManager[Callable[[int, int], None] | None]]

Value = TypeVar("Value")


class NoPhotons(ValueError):
    """Photons were asked for where caustics are not traced."""


class NotTraced(ValueError):
    """Caustics were to be traced in a scene where they cannot be."""


class Rendered(NamedTuple):
    """The two files of a render, linear and as displayed, what made them, and whether they were there already."""

    exr: Path
    png: Path
    record: dict
    was_there: bool


@dataclass(frozen=True)
class Request:
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
        if self.change:
            change_of(self.change)

    def _fill_in(self, type_: SceneType) -> None:
        parameters = type_.parameters() if self.parameters is None else self.parameters
        if not isinstance(parameters, type_.parameters):
            raise ValueError(
                f"{parameters!r} are no parameters of the {type_.name}; give {type_.parameters.__name__}()."
            )
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
    def of(cls, scene: str, settings: Mapping[str, object] | Iterable[str] = (), **options) -> Request:
        """A request for the scene of a name, in any case, with settings: a dict, or texts "key=value"; options as above."""
        type_ = scene_type(in_any_case(scene, SCENES))
        if isinstance(settings, Mapping):
            return cls(type_.name, type_.parameters.of(settings), **options)
        return cls(type_.name, type_.parameters.read(settings), **options)

    @classmethod
    def of_blend(cls, file: str | Path, scene: str | None = None, **options) -> Request:
        """A request for a scene of a .blend file, which may be left out where there is only one; options as above."""
        return cls(blend=Blend.of(file, scene), **options)

    @property
    def name(self) -> str:
        """What its files are called where nobody says: the scene and its settings, or the .blend."""
        if self.blend:
            return Path(self.blend.file).stem
        return file_name(_known(self.scene), _known(self.parameters).assignments())

    @property
    def moves(self) -> bool:
        """Whether it is of a scene that has a time."""
        return self.parameters is not None and "time" in self.parameters.plain()

    def sequence(self, first: int, last: int, fps: float) -> dict[int, Request]:
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
                seed=(_known(self.seed) + frame) % (MOST_SEED + 1),
            )
            for frame in range(first, last + 1)
        }

    # -------------------------------------------------------------------------------------------- as JSON

    def record(self) -> dict:
        """A dict of JSON-ready values that from_record() takes back; what is left open is left out."""
        if self.blend:
            of = {"blend": self.blend.record()}
        else:
            of = {"scene": self.scene, "parameters": _known(self.parameters).plain()}
        values = {key: getattr(self, key) for key in CHECKS if getattr(self, key) is not None}
        if not self.keep_noise:
            del values["keep_noise"]
        plain = {key: _plain(value) for key, value in values.items()}
        return {"nimray": VERSION, **of, **plain, "blender": bpy.app.version_string}

    @classmethod
    def from_record(cls, record: Mapping[str, object], source: str = "the record") -> Request:
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
    def again(cls, image: str | Path) -> tuple[Request, dict]:
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
        return cls.from_record(record, str(image)), record

    def decided(self) -> Request:
        """The same with all decided that it leaves open, as its image records it; raises as Session.request does."""
        with Session(self) as session:
            return session.request

    def key(self) -> str:
        """A hash, in hexadecimal, of all that decides the pixels: files count by their content, not by their names.

        It is of what is decided(), so a request and the record of its image have the same: where something is open, the
        scene is built to decide it. Raises as decided() does.
        """
        record = self.decided().record()
        if self.blend:
            del record["blend"]["file"]
        else:
            record["parameters"] |= {
                name: sha256_of(path) for name, path in _known(self.parameters).mesh_files().items()
            }
        return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()

    # -------------------------------------------------------------------------------------------- the act

    def render(self, folder: str | Path, name: str | None = None, **options) -> Rendered:
        """Render it to NAME.exr (linear, 32-bit) and NAME.png (as displayed), NAME being `name` where nobody says.

        folder, options: as for Session.render(); raises as it does
        """
        with Session(self) as session:
            return session.render(folder, self.name if name is None else name, **options)


class Session:
    """The act of rendering a Request, with `with`: its scene is built once, at need, for as many seeds as are rendered.

    persistent: whether Cycles keeps what it made of the scene from one seed to the next
    """

    def __init__(self, request: Request, *, persistent: bool = False) -> None:
        self._asked, self._persistent = request, persistent
        self._decided: Request | None = None
        self._temporary = TemporaryScene(self._set_up)

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error) -> None:
        self._temporary.__exit__(*error)

    @property
    def request(self) -> Request:
        """The request with all decided that it leaves open.

        Raises RuntimeError for a backend, or denoising, that this Blender does not have, NoPhotons for photons where
        caustics are not traced, and ValueError where the scene cannot be built, or the .blend has changed.
        """
        if self._decided is None:
            request = self._asked
            if request.denoise and not can_denoise():
                raise RuntimeError(
                    "this Blender was built without OpenImageDenoise; leave --denoise out and take more samples."
                )
            if request.blend:
                if any(getattr(request, key) is None for key in OPEN_IN_A_BLEND):
                    request = _as_in(self._temporary.scene, request)
            else:
                request = dataclasses.replace(request, backend=resolve(request.backend))
                if request.caustics is None:
                    request = dataclasses.replace(request, caustics=caustics.best_way(self._temporary.scene))
            self._decided = request
        return self._decided

    def _set_up(self):
        """The scene, made as it is asked for, but for its noise and its caustics."""
        request = self._asked
        if request.blend:
            scene = request.blend.append()
            if request.frame is not None:
                scene.frame_set(request.frame)
            request = _as_in(scene, request)
            if request.caustics == "path":
                caustics.clear(scene)
        else:
            scene = scene_type(_known(request.scene), of_figures=True).build(
                request.parameters, resolve(request.backend)
            )
        scene.render.resolution_x, scene.render.resolution_y = _known(request.size)
        scene.render.resolution_percentage = 100
        scene.cycles.samples = request.samples
        scene.cycles.use_denoising = request.denoise
        scene.view_layers[0].cycles.denoising_store_passes = request.denoise and request.keep_noise
        scene.render.use_persistent_data = self._persistent
        if request.pose:
            aim(_known(scene.camera), *request.pose)
        if request.change:
            change_of(request.change)(scene)
        return scene

    def render(
        self,
        folder: str | Path,
        name: str,
        *,
        seed: int | None = None,
        keep: bool = True,
        blend: bool = False,
        showing: Showing | None = None,
        tracing: Tracing | None = None,
    ) -> Rendered:
        """Render it to NAME.exr and NAME.png, which appear whole or not at all and carry the record.

        folder:  where to; made if missing
        seed:    in place of the request's
        keep:    what is there already, whole and made of the same, and no older than a mesh file, is not rendered again
        blend:   also save NAME.blend there
        showing: called with the name and the samples; returns a context that gives cycles.render.render()'s progress
        tracing: called with samples and photons; returns a context that gives caustics.bake()'s progress
        A bake that was killed goes on where it was, from .NAME.photons in the folder.
        Raises as `request` and cycles.render.render() do, and NotTraced for a scene whose caustics cannot be traced.
        """
        request = self.request if seed is None else dataclasses.replace(self.request, seed=seed)
        record = request.record()
        if keep and (exr := _found(folder, name, request, blend)):
            return Rendered(exr, exr.with_suffix(".png"), record, True)
        scene = self._temporary.scene
        # else Blender renders it at the frame of the scene that is shown
        with bpy.context.temp_override(scene=scene):
            if request.caustics == "traced":
                with _said_of_tracing():
                    caustics.Bake(scene)  # whether it can be is seen before anything is written
            folder = writable_folder(folder)  # before anybody is told how far it is
            if request.caustics == "traced":
                _bake(scene, request, folder / f".{name}.photons", tracing)
            scene.cycles.seed = request.seed
            with showing(name, _known(request.samples)) if showing else nullcontext() as progress:
                exr, png = render.render(scene, folder, name, metadata=record, progress=progress, blend=blend)
        return Rendered(exr, png, record, False)


def can_denoise() -> bool:
    """Whether this Blender has OpenImageDenoise."""
    import _cycles  # pyright: ignore[reportMissingImports]  it is inside Blender

    return _cycles.with_openimagedenoise


def _as_in(scene, request):
    """The request for the scene of a .blend with all that the file decides."""
    if scene.render.engine != "CYCLES":
        raise ValueError(f"the scene {request.blend.scene!r} of {request.blend.file} is not rendered by Cycles.")
    part = scene.render.resolution_percentage / 100
    own = {
        "size": tuple(max(1, round(side * part)) for side in (scene.render.resolution_x, scene.render.resolution_y)),
        "samples": scene.cycles.samples,
        "seed": scene.cycles.seed,
        "denoise": scene.cycles.use_denoising,
    }
    return dataclasses.replace(request, **{key: value for key, value in own.items() if getattr(request, key) is None})


def _bake(scene, request, file, tracing):
    """Trace the caustics that are asked for into the scene; `file` keeps what a killed run has traced."""
    samples, photons = _known(request.samples), _known(request.photons)
    texels = request.texels or TEXELS[photons >= FEW_PHOTONS]
    with tracing(samples, photons) if tracing else nullcontext() as progress, _said_of_tracing():
        caustics.bake(scene, photons=photons, texels=texels, seed=request.seed, file=file, progress=progress)


def _found(folder, name, request, blend):
    """The EXR of a render that is there, all its files whole and made of the same; None where it is not."""
    with contextlib.suppress(OSError, RuntimeError):  # there is no such home, as will be said
        exr = Path(folder).expanduser() / f"{name}.exr"
        same = record_of(exr) == request.record() and (not blend or exr.with_suffix(".blend").is_file())
        meshes = request.parameters.mesh_files().values() if request.parameters else ()
        if same and all(mesh.stat().st_mtime < exr.stat().st_mtime for mesh in meshes):  # recorded by its path alone
            return exr
    return None


@contextlib.contextmanager
def _said_of_tracing():
    try:
        yield
    except ValueError as error:
        raise NotTraced(str(error)) from None


def _known(value: Value | None) -> Value:
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""The act of rendering what is asked for: the scene is made, set up, rendered, and gone again."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

import bpy

from .. import caustics, checks
from ..base.files import writable_folder
from ..base.streams import quiet
from ..caustics import frames
from ..cycles import render, spectral, spectral_picture, visibility
from ..cycles.animation import settle, undriven
from ..cycles.images import record_of
from ..cycles.material import resolve
from ..scenes import scene_type
from ..scenes.stage import aim
from . import simulated
from .asked import Asked, known
from .changes import change_of
from .external import files_of
from .inputs import set_input
from .sizes import own_size, set_size
from .temporary import TemporaryScene
from .used import used_by

FEW_PHOTONS = 1 << 20  # fewer than these are baked into small textures
TEXELS = 512, 2048  # edges of the largest texture, of few photons and of many

# From the name of an image and its samples, or from its samples and photons: what render(), or bake(), reports to.
Showing = Callable[[str, int], AbstractContextManager[Callable[[int, int, float | None], None] | None]]
Tracing = Callable[[int, int], AbstractContextManager[Callable[[int, int], None] | None]]


Kind = TypeVar("Kind", bound=Asked)  # a renders.request.Request, as a rule


class NotTraced(ValueError):
    """Caustics were to be traced in a scene where they cannot be."""


class Rendered(NamedTuple):
    """The two files of a render, linear and as displayed, what made them, and whether they were there already."""

    exr: Path
    png: Path
    record: dict
    was_there: bool


class Own(NamedTuple):
    """What a scene of a .blend has that a render here may not keep.

    engine:   as people call it; denoised: whether it is
    undriven: (name, expression) of the drivers that do not run here, at the frame that is asked for
    """

    engine: str
    denoised: bool
    undriven: tuple[tuple[str, str], ...] = ()


class Session(Generic[Kind]):
    """The act of rendering an Asked, with `with`: its scene is built once, at need, for as many seeds as are rendered.

    persistent: whether Cycles keeps what it made of the scene from one seed to the next
    threads:    that Cycles renders with; 0: one for each processor
    """

    def __init__(self, request: Kind, *, persistent: bool = False, threads: int = 0) -> None:
        self._asked, self._persistent, self._threads = request, persistent, threads
        self._decided: Kind | None = None
        self._own: Own | None = None
        self._kept: frames.Frames | None = None
        self._temporary = TemporaryScene(self._set_up)

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error) -> None:
        self._temporary.__exit__(*error)

    @property
    def request(self) -> Kind:
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
                scene = self._temporary.scene
                request = _baked_anew(scene, _as_in(scene, request))
                if request.denoise and not can_denoise():
                    raise RuntimeError(
                        f"the scene {known(request.blend).scene!r} is denoised, and this Blender was built without "
                        "OpenImageDenoise; switch its denoising off, or leave it out with --no-denoise."
                    )
                self._kept = frames.frames_of(scene)
                frames.forget_frames(scene)  # whose handlers would take out what is traced
            else:
                request = dataclasses.replace(request, backend=resolve(request.backend))
                if request.caustics is None:
                    request = dataclasses.replace(request, caustics=caustics.best_way(self._temporary.scene))
            if request.spectral and request.spectral_passes is None:
                width, height = known(request.size)
                passes = spectral_picture.usual_strata(known(request.samples), width * height)
                request = dataclasses.replace(request, spectral_passes=passes)
            self._decided = request
        return self._decided

    @property
    def scene(self) -> bpy.types.Scene:
        """The scene, built at need; raises as `request` does."""
        return self._temporary.scene

    @property
    def own(self) -> Own | None:
        """What the scene has in its .blend, None where it is one of ours; raises as `request` does."""
        return self._own if self.scene else None

    @property
    def kept(self) -> frames.Frames | None:
        """Where a .blend has the caustics of its frames, which are rendered where they are of its scene; raises as `request`."""
        return self._kept if self.request else None

    def _set_up(self):
        """The scene, made as it is asked for, but for its noise and its caustics."""
        request = self._asked
        if request.blend:
            scene = request.blend.append(self._temporary.give_way)
            self._own = Own(checks.engine_name(scene), scene.cycles.use_denoising)
            scene.render.engine = "CYCLES"  # which alone bends a ray backwards
            frames.beside(scene, Path(request.blend.file).parent)
            if simulated.played(scene):
                with frames.as_they_are(), quiet(2):
                    simulated.play(scene, scene.frame_current if request.frame is None else request.frame)
            if request.frame is not None:
                with frames.as_they_are(), quiet(2):  # what drivers do not run Own has
                    scene.frame_set(request.frame)
                    settle(scene, {scene, *used_by(scene)})
                    with visibility.as_rendered(scene):  # what is hidden in the viewport alone is not evaluated before
                        used = {scene, *used_by(scene)}
                        settle(scene, used)
                        self._own = self._own._replace(undriven=tuple(undriven(scene, used)))
            request = _as_in(scene, request)
            for key, number in request.inputs or ():
                set_input(scene, key, number)
            if request.caustics == "path":
                caustics.clear(scene)
        else:
            scene = scene_type(known(request.scene), of_figures=True).build(
                request.parameters, resolve(request.backend)
            )
        set_size(scene, known(request.size))
        scene.cycles.samples = request.samples
        scene.cycles.use_denoising = request.denoise
        scene.view_layers[0].cycles.denoising_store_passes = request.denoise and request.keep_noise
        scene.render.use_persistent_data = self._persistent
        if self._threads:
            scene.render.threads_mode, scene.render.threads = "FIXED", self._threads
        if request.pose:
            aim(known(scene.camera), *request.pose)
        if request.change:
            change_of(request.change)(scene)
        if request.spectral:
            spectral.set_up(scene, "auto" if request.blend else resolve(request.backend))
        if request.wavelength is not None:
            scene.render.use_motion_blur = False  # by which paths have wavelengths of their own
            spectral.set_neutral(request.wavelength)
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
        keep:    what is there already, whole and made of the same, and no older than its files, is not rendered again
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
            self.check()
            folder = writable_folder(folder)  # before anybody is told how far it is
            if request.caustics == "traced":
                self.bake(folder / f".{name}.photons", tracing, request.seed)
            scene.cycles.seed = request.seed
            with showing(name, known(request.samples)) if showing else nullcontext() as progress:
                exr, png = render.render(
                    scene,
                    folder,
                    name,
                    metadata=record,
                    progress=progress,
                    blend=blend,
                    drawing=_drawing(scene, request),
                )
        return Rendered(exr, png, record, False)

    def check(self) -> None:
        """Raise, before anything is written, RuntimeError as render.check_scene(), and NotTraced where caustics cannot be."""
        render.check_scene(self.scene)
        if self.request.caustics == "traced":
            with _said_of_tracing():
                caustics.Bake(self.scene)

    def bake(self, file: Path, tracing: Tracing | None = None, seed: int | None = None) -> None:
        """Trace the caustics that are asked for into the scene; `file` keeps what a killed run has traced."""
        request = self.request
        samples, photons = known(request.samples), known(request.photons)
        texels = request.texels or TEXELS[photons >= FEW_PHOTONS]
        seed = known(request.seed) if seed is None else seed
        with tracing(samples, photons) if tracing else nullcontext() as progress, _said_of_tracing():
            caustics.bake(self.scene, photons=photons, texels=texels, seed=seed, file=file, progress=progress)


def can_denoise() -> bool:
    """Whether this Blender has OpenImageDenoise."""
    import _cycles  # pyright: ignore[reportMissingImports]  it is inside Blender

    return _cycles.with_openimagedenoise


def _as_in(scene, request):
    """The request for the scene of a .blend with all that the file decides."""
    own = {
        "size": own_size(scene),
        "samples": scene.cycles.samples,
        "seed": scene.cycles.seed,
        "denoise": scene.cycles.use_denoising,
    }
    blend = dataclasses.replace(request.blend, files=files_of(scene))
    left = {key: value for key, value in own.items() if getattr(request, key) is None}
    return dataclasses.replace(request, blend=blend, **left)


def _baked_anew(scene, request):
    """The request with caustics that are traced where the .blend has some that are of another state of its scene.

    Those that are kept of the frame are put in where they are of the scene, unless others are asked for. A frame at which
    nothing can be traced has none.
    """
    others = (request.caustics, request.photons, request.texels, request.wavelength)
    if (
        not request.spectral
        and others == (None,) * len(others)
        and not frames.follow(scene)
        and frames.in_the_dark(scene)
    ):
        return request
    asked = None if request.caustics else caustics.wanted(scene)
    if asked is None:
        return request
    photons, texels = asked
    photons, texels = request.photons or photons, request.texels or texels
    return dataclasses.replace(request, caustics="traced", photons=photons, texels=texels)


def _drawing(scene, request):
    """What renders a scene, where it is spectral; None where one render as it is set up is all."""
    if not spectral.is_spectral(scene) or request.wavelength is not None:
        return None
    return spectral_picture.drawing(request.spectral_passes or 1)


def _found(folder, name, request, blend):
    """The EXR of a render that is there, all its files whole and made of the same; None where it is not."""
    with contextlib.suppress(OSError, RuntimeError):  # there is no such home, as will be said
        exr = Path(folder).expanduser() / f"{name}.exr"
        same = record_of(exr) == request.record() and (not blend or exr.with_suffix(".blend").is_file())
        files = request.parameters.files().values() if request.parameters else ()
        if same and all(file.stat().st_mtime < exr.stat().st_mtime for file in files):  # recorded by its path alone
            return exr
    return None


@contextlib.contextmanager
def _said_of_tracing():
    try:
        yield
    except ValueError as error:
        raise NotTraced(str(error)) from None

# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray render FILE.blend`: a scene of any .blend, one image or frames of its animation, with the checks before."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from . import words
from .act import carry_out, refused, with_options
from .report import Failure, Output, note
from .words import UsageError

if TYPE_CHECKING:
    from ..renders.request import Request, Session


def render_blend(arguments: argparse.Namespace) -> None:
    """Render what the words ask for; `arguments` as render.run() has them, Blender loaded."""
    request = request_of(arguments)
    name = arguments.name or words.own_name(request.name)
    moments = {name: request}
    if arguments.frames:
        first, last = arguments.frames
        moments = {
            f"{name}_{frame:04}": dataclasses.replace(request, frame=frame)
            for frame in range(first, last + 1, arguments.step or 1)
        }
    said = Said(request, strict=arguments.strict, quiet=arguments.quiet, noisy=arguments.denoise is False)
    with Output(len(moments), quiet=arguments.quiet, progress=arguments.progress) as output:
        for name, moment in moments.items():
            output.frame = moment.frame
            keep = moment.frame is not None
            rendered = carry_out(moment, arguments.out, name, output, keep=keep, blend=arguments.blend, before=said)
            output.written([rendered.exr, rendered.png])
        output.end([], rendered.record["size"], rendered.record["samples"])


def request_of(arguments: argparse.Namespace) -> Request:
    """The request for the scene of a .blend that the words name, with the numbers of --set in its materials."""
    from ..renders.request import Request, can_denoise

    with refused():
        whole = Request.of_blend(arguments.scene, arguments.which)
        inputs = {}
        for key, number in map(_input, arguments.assignments):
            if key in inputs:
                raise UsageError(f"{key} is set twice; set it once.")
            inputs[key] = number
        whole = dataclasses.replace(whole, inputs=tuple(inputs.items()) or None)
        # as the file has it, which Said says where this Blender cannot
        return with_options(whole if can_denoise() else dataclasses.replace(whole, denoise=False), arguments)


def _input(text):
    """(MATERIAL:INPUT, number) of a text with an = between them."""
    key, _, value = text.rpartition("=")
    if not all(key.partition(":")):
        raise UsageError(f"--set {text!r}: a .blend has no parameters; set inputs, 'MATERIAL:INPUT=NUMBER'.")
    return key, words.number(f"--set {key}")(value)


class Said:
    """What is said of a scene before it is rendered, each thing once however many frames have it.

    noisy: whether its noise is to be kept
    """

    def __init__(self, request: Request, *, strict: bool, quiet: bool, noisy: bool) -> None:
        self.caustics, self.strict, self.quiet = request.caustics, strict, quiet
        self.noisy = noisy
        self.known: set[str] = set()

    def __call__(self, session: Session) -> None:
        """Say what a render would show wrong; Failure instead of the first of it where that is strict."""
        from .. import caustics, checks
        from ..renders.asked import known
        from ..renders.blends import newer
        from ..renders.external import missing_files

        decided, scene = session.request, session.scene
        later = newer(Path(known(decided.blend).file))
        wrong = [f"it was saved by Blender {later}, and this is older; what is new there is lost."] if later else []
        own = known(session.own)
        if own.engine != "Cycles":
            wrong.append(f"{own.engine} is its engine; Cycles renders it, which alone bends a ray backwards.")
        if own.denoised and not (decided.denoise or self.noisy):
            wrong.append(
                "it is denoised, and this Blender was built without OpenImageDenoise; the picture keeps its noise."
            )
        wrong += [f"{file} is missing, which the scene needs." for file in missing_files(scene)]
        wrong += [
            f"the driver {expression!r} of {name!r} does not run here, so what it drives stays as it was saved; give it "
            "keyframes, or an expression without functions of your own."
            for name, expression in own.undriven
        ]
        wrong += [problem.sentence for problem in checks.problems(scene)]
        if wrong and self.strict:
            more = f" ({len(wrong) - 1} more)" * (len(wrong) > 1)
            raise Failure(f"{_at(decided)}{wrong[0].rstrip('.')}{more}; mend it, or leave --strict out.")
        if decided.caustics != self.caustics:
            wrong.append(
                f"in {session.kept.folder} there are no caustics of its scene as it is now; they are traced anew, or left out "
                "with --caustics path. Bake Frames, in the panel, keeps them."
                if session.kept
                else "the caustics in the file are of another state of its scene; they are traced anew, or left out with "
                "--caustics path."
            )
        elif session.kept and decided.caustics is None:
            wrong.append(
                f"its caustics are those that are kept in {session.kept.folder}."
                if caustics.baked(scene)
                else "no light can be traced in it, and it has no caustics."
            )
        for sentence in wrong:
            if sentence not in self.known and not self.quiet:
                note(f"{_at(decided)}{sentence}")
        self.known.update(wrong)


def _at(request):
    return f"frame {request.frame}: " if request.frame is not None else ""
